//! The axis as a linear system, its joint closed or open.

use nalgebra::{Complex, SMatrix, SVector};
use plant::{AxisParameters, Joint};

/// State of the joint in the linear picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JointState {
    /// A flank carries: k and c act as if there were no gap. A rigid axis is
    /// one body.
    Closed,
    /// Within the gap: the motor turns its gear alone. A rigid axis has none.
    Open,
}

/// The linear axis, `J1·β̈ = k_m·I/z − Ψ`, `J2·γ̈ = Ψ − p·a1·γ̇`,
/// `L·İ = V − R·I − k_m·β̇/z` (eq. 11, 15, 26). Constant and quadratic
/// resistance have no linear part at rest; nor has dry friction once the screw
/// slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinearAxis {
    /// `k_m/z` \[N m/A\].
    pub(crate) torque_nm_per_a: f64,
    pub(crate) resistance_ohm: f64,
    pub(crate) inductance_h: f64,
    pub(crate) body: Body,
    /// `p` \[m/rad\].
    pub(crate) pitch_m_per_rad: f64,
    /// `z`.
    pub(crate) gear_ratio: f64,
}

/// Load of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Body {
    /// `J·β̈ = τ − d·β̇`: the whole axis, or the motor alone.
    One {
        inertia_kg_m2: f64,
        drag_nms_per_rad: f64,
    },
    /// Two bodies and `Ψ = k·ε + c·ε̇` between them.
    Two {
        /// `J1`.
        gear_kg_m2: f64,
        /// `J2`.
        screw_kg_m2: f64,
        drag_nms_per_rad: f64,
        stiffness_nm_per_rad: f64,
        damping_nms_per_rad: f64,
    },
}

/// States of one body: β, β̇, I.
pub(crate) const ONE: usize = 3;
/// States of two: β, β̇, ε, ε̇, I.
pub(crate) const TWO: usize = 5;

impl LinearAxis {
    /// The linear axis; none for the open joint of a rigid axis.
    pub(crate) fn new(axis: &AxisParameters, joint: JointState) -> Option<Self> {
        let (motor, transmission) = (&axis.motor, &axis.transmission);
        let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
        // J1 = J_m/z², J2 = J_v + M·p² (eq. 11, 15).
        let gear_kg_m2 = motor.inertia_kg_m2 / (z * z);
        let screw_kg_m2 = transmission.screw_inertia_kg_m2 + axis.carriage.mass_kg * p * p;
        // The torque p·F_r of F_r = a1·γ̇.
        let drag_nms_per_rad = p * axis.carriage.resistance.linear_ns_per_rad;
        let body = match (transmission.joint, joint) {
            (Joint::Rigid, JointState::Open) => return None,
            (Joint::Elastic(_), JointState::Open) => Body::One {
                inertia_kg_m2: gear_kg_m2,
                drag_nms_per_rad: 0.0,
            },
            (Joint::Rigid, JointState::Closed) => Body::One {
                inertia_kg_m2: gear_kg_m2 + screw_kg_m2,
                drag_nms_per_rad,
            },
            (Joint::Elastic(joint), JointState::Closed) => Body::Two {
                gear_kg_m2,
                screw_kg_m2,
                drag_nms_per_rad,
                stiffness_nm_per_rad: joint.stiffness_nm_per_rad,
                damping_nms_per_rad: joint.damping_nms_per_rad,
            },
        };
        Some(Self {
            torque_nm_per_a: motor.torque_constant_nm_per_a / z,
            resistance_ohm: motor.resistance_ohm,
            inductance_h: motor.inductance_h,
            body,
            pitch_m_per_rad: p,
            gear_ratio: z,
        })
    }

    /// The same with `share` of the joint's stiffness and damping.
    pub(crate) fn with_share_of_joint(mut self, share: f64) -> Self {
        if let Body::Two {
            stiffness_nm_per_rad,
            damping_nms_per_rad,
            ..
        } = &mut self.body
        {
            *stiffness_nm_per_rad *= share;
            *damping_nms_per_rad *= share;
        }
        self
    }

    /// A of one body, x = (β, β̇, I).
    pub(crate) fn one(&self, inertia_kg_m2: f64, drag_nms_per_rad: f64) -> SMatrix<f64, ONE, ONE> {
        let (km, r, l) = self.armature();
        let j = inertia_kg_m2;
        SMatrix::<f64, ONE, ONE>::new(
            0.0,
            1.0,
            0.0, //
            0.0,
            -drag_nms_per_rad / j,
            km / j, //
            0.0,
            -km / l,
            -r / l,
        )
    }

    /// A of two bodies, x = (β, β̇, ε, ε̇, I); none for one body.
    pub(crate) fn two(&self) -> Option<SMatrix<f64, TWO, TWO>> {
        let Body::Two {
            gear_kg_m2: j1,
            screw_kg_m2: j2,
            drag_nms_per_rad: d,
            stiffness_nm_per_rad: k,
            damping_nms_per_rad: c,
        } = self.body
        else {
            return None;
        };
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
        let (free, load) = match self.body {
            Body::One {
                inertia_kg_m2: j,
                drag_nms_per_rad: d,
            } => (Complex::from(1.0), s * (s * j + d)),
            Body::Two { gear_kg_m2: j1, .. } => {
                let (q, m) = self.joint_and_screw(s);
                (m + q, s * s * j1 * (m + q) + q * m)
            }
        };
        free * km / ((s * l + r) * load + s * free * (km * km))
    }

    /// `γ(s)/ε(s)`; none where the screw does not follow the motor through a
    /// joint.
    pub(crate) fn screw_per_joint(&self, s: Complex<f64>) -> Option<Complex<f64>> {
        // m·γ = q·ε
        matches!(self.body, Body::Two { .. }).then(|| {
            let (q, m) = self.joint_and_screw(s);
            q / m
        })
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
        let Body::Two { gear_kg_m2: j1, .. } = self.body else {
            return None;
        };
        let (q, m) = self.joint_and_screw(s);
        let motor = s * s * j1 + (s * km + law) * km / (s * l + r);
        Some(-q * (motor.inv() + m.inv()))
    }

    /// `γ(s)/β(s)`: 1 for one body.
    pub(crate) fn screw_per_gear(&self, s: Complex<f64>) -> Complex<f64> {
        match self.body {
            Body::One { .. } => Complex::from(1.0),
            Body::Two { .. } => {
                let (q, m) = self.joint_and_screw(s);
                q / (m + q)
            }
        }
    }

    /// `k + c·s` and `J2·s² + d·s`; 0 for one body.
    fn joint_and_screw(&self, s: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
        match self.body {
            Body::One { .. } => (Complex::from(0.0), Complex::from(0.0)),
            Body::Two {
                screw_kg_m2: j2,
                drag_nms_per_rad: d,
                stiffness_nm_per_rad: k,
                damping_nms_per_rad: c,
                ..
            } => (s * c + k, s * (s * j2 + d)),
        }
    }

    /// Angular frequencies at which the response bends: the run-up of the
    /// motor, the armature, and the joint's antiresonance and resonance.
    pub(crate) fn corners_radps(&self) -> [f64; 4] {
        let (km, r, l) = self.armature();
        let run_up = |j: f64, d: f64| (km * km / r + d) / j;
        match self.body {
            Body::One {
                inertia_kg_m2: j,
                drag_nms_per_rad: d,
            } => {
                let slow = run_up(j, d);
                [slow, r / l, slow, r / l]
            }
            Body::Two {
                gear_kg_m2: j1,
                screw_kg_m2: j2,
                drag_nms_per_rad: d,
                stiffness_nm_per_rad: k,
                ..
            } => [
                run_up(j1 + j2, d),
                r / l,
                (k / j2).sqrt(),
                (k / j1 + k / j2).sqrt(),
            ],
        }
    }
}
