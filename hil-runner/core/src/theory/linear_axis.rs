//! The axis as a linear system, in contact or in the gap.

use nalgebra::{Complex, SMatrix, SVector};
use plant::{AxisParameters, Joint};

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
/// `L·İ = V − R·I − k_m·β̇/z` (eq. 11, 15, 26). Constant and quadratic
/// resistance have no linear part at rest; nor has dry friction once the screw
/// slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinearAxis {
    /// `k_m/z` \[N m/A\].
    torque_nm_per_a: f64,
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
}

/// A second body, and `Ψ = k·ε + c·ε̇` between the two.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Load {
    /// J2.
    screw_kg_m2: f64,
    stiffness_nm_per_rad: f64,
    damping_nms_per_rad: f64,
}

/// States of one body: β, β̇, I.
pub(crate) const ONE: usize = 3;
/// States of two: β, β̇, ε, ε̇, I.
pub(crate) const TWO: usize = 5;

impl LinearAxis {
    /// The linear axis; none within the gap of a rigid axis, which has none.
    pub(crate) fn new(axis: &AxisParameters, joint: JointState) -> Option<Self> {
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
                let load = Load {
                    screw_kg_m2,
                    stiffness_nm_per_rad: joint.stiffness_nm_per_rad,
                    damping_nms_per_rad: joint.damping_nms_per_rad,
                };
                (gear_kg_m2, drag_nms_per_rad, Some(load))
            }
        };
        Some(Self {
            torque_nm_per_a: motor.torque_constant_nm_per_a / z,
            resistance_ohm: motor.resistance_ohm,
            inductance_h: motor.inductance_h,
            gear_kg_m2,
            drag_nms_per_rad,
            load,
            pitch_m_per_rad: p,
            gear_ratio: z,
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

    /// A of one body, x = (β, β̇, I).
    pub(crate) fn one(&self) -> SMatrix<f64, ONE, ONE> {
        let (km, r, l) = self.armature();
        let (j, d) = (self.gear_kg_m2, self.drag_nms_per_rad);
        let mut a = SMatrix::<f64, ONE, ONE>::zeros();
        a[(0, 1)] = 1.0;
        a[(1, 1)] = -d / j;
        a[(1, 2)] = km / j;
        a[(2, 1)] = -km / l;
        a[(2, 2)] = -r / l;
        a
    }

    /// A of two bodies, x = (β, β̇, ε, ε̇, I); none for one body.
    pub(crate) fn two(&self) -> Option<SMatrix<f64, TWO, TWO>> {
        let load = self.load?;
        let (j1, j2, d) = (self.gear_kg_m2, load.screw_kg_m2, self.drag_nms_per_rad);
        let (k, c) = (load.stiffness_nm_per_rad, load.damping_nms_per_rad);
        let (km, r, l) = self.armature();
        // β̈ = (k_m/z·I − k·ε − c·ε̇)/J1
        let gear = [0.0, 0.0, -k / j1, -c / j1, km / j1];
        // γ̈ = (k·ε + c·ε̇ − d·(β̇ − ε̇))/J2
        let screw = [0.0, -d / j2, k / j2, (c + d) / j2, 0.0];
        let mut a = SMatrix::<f64, TWO, TWO>::zeros();
        a[(0, 1)] = 1.0;
        a[(2, 3)] = 1.0;
        for j in 0..TWO {
            a[(1, j)] = gear[j];
            a[(3, j)] = gear[j] - screw[j];
        }
        a[(4, 1)] = -km / l;
        a[(4, 4)] = -r / l;
        Some(a)
    }

    /// `B`: a volt drives the current alone.
    pub(crate) fn per_volt<const N: usize>(&self) -> SVector<f64, N> {
        let mut b = SVector::zeros();
        b[N - 1] = 1.0 / self.inductance_h;
        b
    }

    /// `k_m/z`, R and L.
    fn armature(&self) -> (f64, f64, f64) {
        (self.torque_nm_per_a, self.resistance_ohm, self.inductance_h)
    }

    /// `β(s)/V(s)` of the continuous axis \[rad/V\]:
    ///
    /// ```text
    /// β/V = κ·(m + q)/((R + L·s)·(J1·s²·(m + q) + q·m) + κ²·s·(m + q))
    /// κ = k_m/z,   q = k + c·s,   m = J2·s² + d·s
    /// ```
    pub(crate) fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let (km, r, l) = self.armature();
        let j1 = self.gear_kg_m2;
        let (free, load) = match self.joint_and_screw(s) {
            None => (Complex::from(1.0), s * (s * j1 + self.drag_nms_per_rad)),
            Some((q, m)) => (m + q, s * s * j1 * (m + q) + q * m),
        };
        free * km / ((s * l + r) * load + s * free * (km * km))
    }

    /// `γ(s)/ε(s)`, as m·γ = q·ε; none where the screw does not follow the motor
    /// through a joint.
    pub(crate) fn screw_per_joint(&self, s: Complex<f64>) -> Option<Complex<f64>> {
        self.joint_and_screw(s).map(|(q, m)| q / m)
    }

    /// `−(k + c·s)·(1/Z + 1/m)`: ε for a deflection of the joint, whose torque
    /// the screw, `m = J2·s² + d·s`, and the motor take. `law` is the voltage
    /// against β, and `Z = J1·s² + κ·(κ·s + law)/(R + L·s)`. None for one body.
    pub(crate) fn joint_response(
        &self,
        s: Complex<f64>,
        law: Complex<f64>,
    ) -> Option<Complex<f64>> {
        let (km, r, l) = self.armature();
        let (q, m) = self.joint_and_screw(s)?;
        let motor = s * s * self.gear_kg_m2 + (s * km + law) * km / (s * l + r);
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
    /// motor, the armature, and the joint's antiresonance and resonance.
    pub(crate) fn corners_radps(&self) -> [f64; 4] {
        let (km, r, l) = self.armature();
        let j1 = self.gear_kg_m2;
        let run_up = |j: f64| (km * km / r + self.drag_nms_per_rad) / j;
        match self.load {
            None => [run_up(j1), r / l, run_up(j1), r / l],
            Some(load) => {
                let (j2, k) = (load.screw_kg_m2, load.stiffness_nm_per_rad);
                let (antiresonance, resonance) = ((k / j2).sqrt(), (k / j1 + k / j2).sqrt());
                [run_up(j1 + j2), r / l, antiresonance, resonance]
            }
        }
    }
}
