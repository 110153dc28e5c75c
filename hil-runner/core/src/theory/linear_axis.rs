//! The axis as a linear system, in contact or in the gap.

use nalgebra::{Complex, SMatrix, SVector};
use plant::{Amplifier, AxisParameters, Control, Joint};

use crate::case::{Case, Law};
use crate::options::Feedback;

/// A square matrix, and a column of one.
pub(crate) type Square<const N: usize> = SMatrix<f64, N, N>;
pub(crate) type Column<const N: usize> = SVector<f64, N>;

/// State of the joint in the linear picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JointState {
    /// A flank carries: k and c act as if there were no gap. A rigid axis is
    /// one body.
    Contact,
    /// Within the gap: the motor turns its gear alone. A rigid axis has none.
    Gap,
}

/// The linear axis, `J1·β̈ = k_m·I/z − Ψ`, `J2·γ̈ = Ψ − p·a1·γ̇`,
/// and what the amplifier makes of the current. Constant and quadratic
/// resistance have no linear part at rest; nor has dry friction once the screw
/// slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinearAxis {
    /// `k_m/z` \[N m/A\].
    torque_nm_per_a: f64,
    actuator: Actuator,
    resistance_ohm: f64,
    inductance_h: f64,
    /// J1; of one body all that moves.
    gear_kg_m2: f64,
    /// d, of the screw or of the one body: 0 of the motor alone.
    drag_nms_per_rad: f64,
    /// The screw behind the joint. Without one it is one body, the whole axis
    /// or the motor alone: `J1·β̈ = τ − d·β̇`.
    load: Option<Load>,
    /// `p` \[m/rad\].
    pub(crate) pitch_m_per_rad: f64,
    /// `z`.
    pub(crate) gear_ratio: f64,
    /// The shaft whose encoder K_p and K_i see; K_d sees the motor's.
    pub(crate) position_of: Shaft,
}

/// A shaft with an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shaft {
    /// The motor's, α = β/z.
    Motor,
    /// The screw's, γ, behind the joint.
    Screw,
}

/// True if the position comes from the load's encoder: on rung `firmware` with
/// `controller.feedback = "dual"`.
pub(crate) fn has_dual_feedback(case: &Case) -> bool {
    case.controller.law == Law::Firmware && case.options.law.feedback == Feedback::Dual
}

/// The amplifier with the armature, within all limits.
///
/// ```text
/// voltage drive   L·İ = V − R·I − κ·β̇                                    eq. 26
/// current loop    İ = ω_c·(i_cmd − I) + ω_c·R/L·q − R/L·I − κ/L·β̇,   q̇ = i_cmd − I
/// ideal           I = i_cmd
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
enum Actuator {
    Voltage,
    CurrentLoop { omega_radps: f64 },
    IdealCurrent,
}

/// A second body, and `Ψ = k·ε + c·ε̇` between the two.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Load {
    /// J2.
    screw_kg_m2: f64,
    stiffness_nm_per_rad: f64,
    damping_nms_per_rad: f64,
}

impl LinearAxis {
    /// The linear axis of a case with the encoders that close its loop; none within
    /// the gap of a rigid axis, and none there of a position that comes from the load,
    /// which does not see the motor.
    pub(crate) fn of(case: &Case, joint: JointState) -> Option<Self> {
        let axis = Self::new(&case.axis, &case.amplifier, joint)?;
        if !has_dual_feedback(case) {
            return Some(axis);
        }
        // One body is its own load.
        let position_of = match axis.has_joint() {
            true => Shaft::Screw,
            false => Shaft::Motor,
        };
        (joint == JointState::Contact).then_some(Self {
            position_of,
            ..axis
        })
    }

    /// The linear axis, its position from the motor; none within the gap of a rigid axis, which has none.
    pub(crate) fn new(
        axis: &AxisParameters,
        amplifier: &Amplifier,
        joint: JointState,
    ) -> Option<Self> {
        let (motor, transmission) = (&axis.motor, &axis.transmission);
        let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
        // J1 = J_m/z², J2 = J_v + M·p² (eq. 11, 15).
        let gear_kg_m2 = motor.inertia_kg_m2 / (z * z);
        let screw_kg_m2 = transmission.screw_inertia_kg_m2 + axis.carriage.mass_kg * p * p;
        // The torque p·F_r of F_r = a1·γ̇.
        let drag_nms_per_rad = p * axis.carriage.resistance.linear_ns_per_rad;
        let (gear_kg_m2, drag_nms_per_rad, load) = match (transmission.joint, joint) {
            (Joint::Rigid, JointState::Gap) => return None,
            (Joint::Elastic(_), JointState::Gap) => (gear_kg_m2, 0.0, None),
            (Joint::Rigid, JointState::Contact) => {
                (gear_kg_m2 + screw_kg_m2, drag_nms_per_rad, None)
            }
            (Joint::Elastic(joint), JointState::Contact) => {
                let (k, c) = (joint.stiffness_nm_per_rad, joint.damping_nms_per_rad);
                let least = match amplifier.control {
                    Control::Current { .. } => LEAST_DAMPING_RATIO * (k * screw_kg_m2).sqrt(),
                    Control::Voltage { .. } => 0.0,
                };
                let load = Load {
                    screw_kg_m2,
                    stiffness_nm_per_rad: k,
                    damping_nms_per_rad: c.max(least),
                };
                (gear_kg_m2, drag_nms_per_rad, Some(load))
            }
        };
        Some(Self {
            torque_nm_per_a: motor.torque_constant_nm_per_a / z,
            actuator: match amplifier.control {
                Control::Voltage { .. } => Actuator::Voltage,
                Control::Current {
                    bandwidth_radps: None,
                    ..
                } => Actuator::IdealCurrent,
                Control::Current {
                    bandwidth_radps: Some(omega_radps),
                    ..
                } => Actuator::CurrentLoop { omega_radps },
            },
            resistance_ohm: motor.resistance_ohm,
            inductance_h: motor.inductance_h,
            gear_kg_m2,
            drag_nms_per_rad,
            load,
            pitch_m_per_rad: p,
            gear_ratio: z,
            position_of: Shaft::Motor,
        })
    }

    /// The same with `share` of the joint's stiffness and damping.
    pub(crate) fn with_share_of_joint(mut self, share: f64) -> Self {
        if let Some(load) = &mut self.load {
            load.stiffness_nm_per_rad *= share;
            load.damping_nms_per_rad *= share;
        }
        self
    }

    /// The number of states: β, β̇, of two bodies ε, ε̇, then I unless it is the input, and
    /// q of a current loop.
    pub(crate) fn states(&self) -> usize {
        let of_bodies = if self.has_joint() { 4 } else { 2 };
        let of_actuator = match self.actuator {
            Actuator::IdealCurrent => 0,
            Actuator::Voltage => 1,
            Actuator::CurrentLoop { .. } => 2,
        };
        of_bodies + of_actuator
    }

    /// True of two bodies.
    pub(crate) fn has_joint(&self) -> bool {
        self.load.is_some()
    }

    /// A and B, B of a volt or an ampere of the command; N is [`Self::states`].
    pub(crate) fn system<const N: usize>(&self) -> (Square<N>, Column<N>) {
        let (km, r, l) = self.armature();
        let (j1, d) = (self.gear_kg_m2, self.drag_nms_per_rad);
        let mut a = Square::<N>::zeros();
        let mut b = Column::<N>::zeros();
        // The bodies with a torque of one newton metre on the first.
        let mut per_torque = Column::<N>::zeros();
        per_torque[1] = 1.0 / j1;
        a[(0, 1)] = 1.0;
        match self.load {
            None => a[(1, 1)] = -d / j1,
            Some(load) => {
                let (j2, k, c) = (
                    load.screw_kg_m2,
                    load.stiffness_nm_per_rad,
                    load.damping_nms_per_rad,
                );
                // β̈ = (τ − k·ε − c·ε̇)/J1
                let gear = [0.0, 0.0, -k / j1, -c / j1];
                // γ̈ = (k·ε + c·ε̇ − d·(β̇ − ε̇))/J2
                let screw = [0.0, -d / j2, k / j2, (c + d) / j2];
                a[(2, 3)] = 1.0;
                for j in 0..gear.len() {
                    a[(1, j)] = gear[j];
                    a[(3, j)] = gear[j] - screw[j];
                }
                per_torque[3] = 1.0 / j1;
            }
        }
        let bodies = if self.has_joint() { 4 } else { 2 };
        if let Actuator::IdealCurrent = self.actuator {
            return (a, per_torque * km);
        }
        let (current, memory) = (bodies, bodies + 1);
        a.set_column(current, &(per_torque.map(|share| share * km)));
        a[(current, 1)] = -km / l;
        a[(current, current)] = -r / l;
        match self.actuator {
            Actuator::CurrentLoop { omega_radps } => {
                a[(current, current)] -= omega_radps;
                a[(current, memory)] = omega_radps * r / l;
                a[(memory, current)] = -1.0;
                (b[current], b[memory]) = (omega_radps, 1.0);
            }
            _ => b[current] = 1.0 / l,
        }
        (a, b)
    }

    /// The same of two bodies with the screw first: γ = β − ε and γ̇ for β and β̇.
    /// The screw's own row keeps the digits that a difference of two large answers
    /// would lose.
    pub(crate) fn system_of_screw<const N: usize>(&self) -> (Square<N>, Column<N>) {
        let (mut a, mut b) = self.system::<N>();
        for (first, joint) in [(0, 2), (1, 3)] {
            let row = a.row(first) - a.row(joint);
            a.set_row(first, &row);
            b[first] -= b[joint];
        }
        for (first, joint) in [(0, 2), (1, 3)] {
            let column = a.column(joint) + a.column(first);
            a.set_column(joint, &column);
        }
        (a, b)
    }

    /// `k_m/z`, R and L.
    fn armature(&self) -> (f64, f64, f64) {
        (self.torque_nm_per_a, self.resistance_ohm, self.inductance_h)
    }

    /// `β(s)/u(s)` of the continuous axis, u the command \[rad/V, or rad/A\]:
    ///
    /// ```text
    /// β/u = κ·(m + q)·n/(D·(J1·s²·(m + q) + q·m) + κ²·s·(m + q)·g)
    /// κ = k_m/z,   q = k + c·s,   m = J2·s² + d·s,   D·I = n·u − g·κ·s·β
    /// ```
    pub(crate) fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let km = self.torque_nm_per_a;
        let j1 = self.gear_kg_m2;
        let (free, load) = match self.joint_and_screw(s) {
            None => (Complex::from(1.0), s * (s * j1 + self.drag_nms_per_rad)),
            Some((q, m)) => (m + q, s * s * j1 * (m + q) + q * m),
        };
        let [divisor, per_command, per_induced] = self.actuation(s);
        free * km * per_command / (divisor * load + s * free * (km * km) * per_induced)
    }

    /// Answers of gear and screw to the command and to a force on the carriage,
    /// `[[β/u, β/F], [γ/u, γ/F]]` \[rad/V or rad/A, rad/N\], with F against
    /// positive x, whose torque on the screw is −p·F:
    ///
    /// ```text
    /// (Z + D·q)·β − D·q·γ = κ·n·u         Z = D·J1·s² + κ²·g·s
    /// (m + q)·γ − q·β = −p·F              Δ = Z·(m + q) + D·q·m
    /// ```
    pub(crate) fn answers(&self, s: Complex<f64>) -> [[Complex<f64>; 2]; 2] {
        let (km, p) = (self.torque_nm_per_a, self.pitch_m_per_rad);
        let [divisor, per_command, per_induced] = self.actuation(s);
        let drive = per_command * km;
        let motor = divisor * s * s * self.gear_kg_m2 + s * per_induced * (km * km);
        match self.joint_and_screw(s) {
            None => {
                let all = motor + divisor * s * self.drag_nms_per_rad;
                let answers = [drive / all, -divisor * p / all];
                [answers, answers]
            }
            Some((q, m)) => {
                let all = motor * (m + q) + divisor * q * m;
                let gear = [drive * (m + q) / all, -divisor * q * p / all];
                let screw = [drive * q / all, -(motor + divisor * q) * p / all];
                [gear, screw]
            }
        }
    }

    /// D, n and g of `D·I = n·u − g·κ·s·β`.
    fn actuation(&self, s: Complex<f64>) -> [Complex<f64>; 3] {
        let (_, r, l) = self.armature();
        let (armature, one) = (s * l + r, Complex::from(1.0));
        match self.actuator {
            Actuator::Voltage => [armature, one, one],
            // (s + ω_c)·I = ω_c·i_cmd − s/(R + L·s)·κ·s·β: the zero on the pole.
            Actuator::CurrentLoop { omega_radps: w } => [armature * (s + w), armature * w, s],
            Actuator::IdealCurrent => [one, one, Complex::from(0.0)],
        }
    }

    /// `γ(s)/ε(s)`, as m·γ = q·ε; none where the screw does not follow the motor
    /// through a joint.
    pub(crate) fn screw_per_joint(&self, s: Complex<f64>) -> Option<Complex<f64>> {
        self.joint_and_screw(s).map(|(q, m)| q / m)
    }

    /// `−(k + c·s)·(1/Z + 1/m)`: ε for a deflection of the joint, whose torque
    /// the screw, `m = J2·s² + d·s`, and the motor take. `law` is the command
    /// against β, and `Z = J1·s² + κ·(g·κ·s + n·law)/D`. None for one body.
    pub(crate) fn joint_response(
        &self,
        s: Complex<f64>,
        law: Complex<f64>,
    ) -> Option<Complex<f64>> {
        let km = self.torque_nm_per_a;
        let (q, m) = self.joint_and_screw(s)?;
        let [divisor, per_command, per_induced] = self.actuation(s);
        let against = s * km * per_induced + law * per_command;
        let motor = s * s * self.gear_kg_m2 + against * km / divisor;
        Some(-q * (motor.inv() + m.inv()))
    }

    /// `γ(s)/β(s)`: 1 for one body.
    pub(crate) fn screw_per_gear(&self, s: Complex<f64>) -> Complex<f64> {
        let joint = self.joint_and_screw(s);
        joint.map_or(Complex::from(1.0), |(q, m)| q / (m + q))
    }

    /// `k + c·s` and `J2·s² + d·s`; none for one body.
    fn joint_and_screw(&self, s: Complex<f64>) -> Option<(Complex<f64>, Complex<f64>)> {
        let load = self.load?;
        let joint = s * load.damping_nms_per_rad + load.stiffness_nm_per_rad;
        Some((joint, s * (s * load.screw_kg_m2 + self.drag_nms_per_rad)))
    }

    /// Angular frequencies at which the response bends: the run-up of the
    /// motor, the armature, and the joint's antiresonance and resonance; with a current
    /// drive its loop instead of the run-up.
    pub(crate) fn corners_radps(&self) -> [f64; 4] {
        let (km, r, l) = self.armature();
        let j1 = self.gear_kg_m2;
        let (inertia_kg_m2, joint) = match self.load {
            None => (j1, None),
            Some(load) => {
                let (j2, k) = (load.screw_kg_m2, load.stiffness_nm_per_rad);
                // The antiresonance, then the resonance.
                (j1 + j2, Some([(k / j2).sqrt(), (k / j1 + k / j2).sqrt()]))
            }
        };
        let [one, other] = match self.actuator {
            Actuator::Voltage => {
                let run_up = (km * km / r + self.drag_nms_per_rad) / inertia_kg_m2;
                [run_up, r / l]
            }
            Actuator::CurrentLoop { omega_radps } => [omega_radps, r / l],
            // A double integrator has no corner; any frequency will do.
            Actuator::IdealCurrent => [IDEAL_CORNER_RADPS; 2],
        };
        let [third, fourth] = joint.unwrap_or([one, other]);
        [one, other, third, fourth]
    }
}

/// Damping of the joint that the linear picture has at least with a current drive. Nothing
/// else need damp it there, and poles on the axis leave Nyquist's criterion no turn to count.
const LEAST_DAMPING_RATIO: f64 = 1e-6;

/// Frequency about which an ideal current drive is looked at.
const IDEAL_CORNER_RADPS: f64 = 100.0;
