//! The axis within one mode as an affine system, `dx/dt = A·x + u`.
//!
//! Everything but a quadratic resistance is affine between two changes of
//! mode: eq. 15 (elastic) and eq. 19 (rigid) with the armature of eq. 26, a
//! constant and a linear resistance, and a voltage that is held, at its limit,
//! or given by the continuous law (eq. 27).
//!
//! Two forms share all that follows. Under a held voltage the state is
//!
//! ```text
//! x = (β, β̇, δ, ε̇, I),   δ = ε − m·b,   m = −1, 0, +1 the flank in contact
//! ```
//!
//! so that b stands in no matrix and one set serves both flanks and every
//! backlash. Under the continuous law `β̂ = ∫β dt` and the motion command
//! follow, the command as an oscillator of its own: within one interval of
//! Fig. 6 its acceleration is constant, a sine or a cosine, and
//!
//! ```text
//! x = (β − r, β̇ − ṙ, δ, ε̇, I, β̂ − r̂, x_ref, v_ref, ∫x_ref dt, a_ref, w),   ȧ_ref = ω·w,   ẇ = −ω·a_ref
//! ```
//!
//! with the screw angle `r = x_ref/p` that the command asks for: what the loop
//! keeps small is small in x, so that the bounds of [`super::levels`], which add
//! magnitudes, do not count a motion that the axis follows.

use nalgebra::{SMatrix, SVector};

use crate::model::amplifier::AmplifierMode;
use crate::model::axis::Axis;
use crate::model::axis::Mode;
use crate::model::joint::JointMode;
use crate::model::motion::Oscillator;
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON, EPSILON_DOT, Vector};

/// States under a held voltage.
pub(crate) const HELD: usize = 5;
/// States under the continuous law, the command included.
pub(crate) const FEEDBACK: usize = 11;

/// Place of δ: the place of ε in the plant's own vector.
pub(crate) const DELTA: usize = EPSILON;
const X_REF: usize = 6;
const V_REF: usize = 7;
const X_REF_INTEGRAL: usize = 8;
const A_REF: usize = 9;
const W_REF: usize = 10;

/// `A` of the affine system, without what drives it.
pub(crate) type Matrix<const D: usize> = SMatrix<f64, D, D>;
/// A state, a rate, or the coefficients of a quantity that is linear in it.
pub(crate) type Column<const D: usize> = SVector<f64, D>;

/// The coefficients of the axis itself in one mode: `A`, what a volt adds to
/// the rate of the current, and what the resistance adds to the rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisSystem {
    pub(crate) a: Matrix<HELD>,
    /// `1/L` \[A/(V s)\].
    pub(crate) per_volt: f64,
    /// Constant part of the rates.
    pub(crate) load: Column<HELD>,
    /// γ̈ as coefficients of x, and its constant part.
    pub(crate) screw: Column<HELD>,
    pub(crate) screw_load: f64,
}

impl Axis {
    /// `m·b` of `δ = ε − m·b`: the flank that δ is counted from.
    pub(crate) fn offset_rad(&self, mode: &Mode) -> f64 {
        let b = self.joint.map_or(0.0, |joint| joint.backlash_half_rad);
        match mode.joint {
            JointMode::Loaded(flank) | JointMode::Released(flank) => flank.sign() * b,
            JointMode::Rigid | JointMode::Gapless | JointMode::Open => 0.0,
        }
    }

    /// The axis in `mode`; its quadratic resistance is left out.
    pub(crate) fn system(&self, mode: &Mode) -> AxisSystem {
        let motor = &self.motor;
        let (z, p, j1) = (self.gear_ratio, self.pitch_m_per_rad, self.gear_inertia);
        let (km, r, l) = (
            motor.torque_constant_nm_per_a,
            motor.resistance_ohm,
            motor.inductance_h,
        );
        let (a0, a1) = (
            self.resistance.constant_n,
            self.resistance.linear_ns_per_rad,
        );

        // γ̈ = (τ − p·F_r)/J with J = J2 and τ = Ψ, or rigid (eq. 15, 19).
        let mut screw = Column::<HELD>::zeros();
        let mut screw_load = 0.0;
        if mode.guide != GuideMode::Stuck {
            let inertia = self.moved_inertia();
            screw = (self.moving_torque_row(mode) - self.screw_speed_row() * (p * a1)) / inertia;
            screw_load = -(p * mode.guide.direction() * a0) / inertia;
        }
        let mut a = Matrix::<HELD>::zeros();
        let mut load = Column::<HELD>::zeros();
        a[(BETA, BETA_DOT)] = 1.0;
        if self.joint.is_some() {
            // β̈ = (k_m·I/z − Ψ)/J1 and ε̈ = β̈ − γ̈ (eq. 15).
            let mut gear = -self.moving_torque_row(mode) / j1;
            gear[CURRENT] += km / z / j1;
            a.set_row(BETA_DOT, &gear.transpose());
            a[(DELTA, EPSILON_DOT)] = 1.0;
            a.set_row(EPSILON_DOT, &(gear - screw).transpose());
            load[EPSILON_DOT] = -screw_load;
        } else {
            a.set_row(BETA_DOT, &screw.transpose());
            load[BETA_DOT] = screw_load;
        }
        // İ = (V − R·I − k_m·β̇/z)/L (eq. 26).
        a[(CURRENT, BETA_DOT)] = -km / z / l;
        a[(CURRENT, CURRENT)] = -r / l;
        AxisSystem {
            a,
            per_volt: 1.0 / l,
            load,
            screw,
            screw_load,
        }
    }

    /// γ̇ as coefficients of x.
    pub(crate) fn screw_speed_row(&self) -> Column<HELD> {
        let mut row = Column::zeros();
        row[BETA_DOT] = 1.0;
        row[EPSILON_DOT] = -1.0;
        row
    }

    /// Torque that turns the screw, as coefficients of x: Ψ of eq. 9-10, or `k_m·I/z`
    /// without a joint.
    pub(crate) fn moving_torque_row(&self, mode: &Mode) -> Column<HELD> {
        let mut row = Column::zeros();
        match (self.joint, mode.joint) {
            (None, _) => row[CURRENT] = self.motor.torque_nm(1.0) / self.gear_ratio,
            (Some(_), JointMode::Gapless | JointMode::Loaded(_)) => return self.flank_torque_row(),
            (Some(_), _) => {}
        }
        row
    }

    /// `k·δ + c·ε̇` of a flank, whether or not it carries.
    pub(crate) fn flank_torque_row(&self) -> Column<HELD> {
        let mut row = Column::zeros();
        if let Some(joint) = self.joint {
            row[DELTA] = joint.stiffness_nm_per_rad;
            row[EPSILON_DOT] = joint.damping_nms_per_rad;
        }
        row
    }
}

impl AxisSystem {
    /// Input of the system under a held voltage.
    pub(crate) fn input(&self, voltage_v: f64) -> Column<HELD> {
        let mut input = self.load;
        input[CURRENT] += self.per_volt * voltage_v;
        input
    }
}

/// The demand of the continuous law as coefficients of its state, eq. 27.
pub(crate) fn demand_row(pid: &ContinuousPid) -> Column<FEEDBACK> {
    let (gains, k0) = (pid.gains, pid.loop_gain);
    let (s, z) = (pid.radians_per_m, pid.gear_ratio);
    let (kp, ki, kd) = (k0 * gains.kp, k0 * gains.ki_per_s, k0 * gains.kd_s);
    let mut row = Column::zeros();
    row[X_REF] = kp * s;
    row[X_REF_INTEGRAL] = ki * s;
    row[V_REF] = kd * s;
    row[BETA] = -kp / z;
    row[BETA_DOT] = -kd / z;
    row[BETA_INTEGRAL] = -ki / z;
    row
}

/// The axis under the continuous law: `A` and u for one interval of the
/// command with angular frequency `omega`.
pub(crate) fn feedback_system(
    axis: &Axis,
    mode: &Mode,
    pid: &ContinuousPid,
    omega: f64,
) -> (Matrix<FEEDBACK>, Column<FEEDBACK>) {
    let system = axis.system(mode);
    let mut a = Matrix::<FEEDBACK>::zeros();
    let mut input = Column::<FEEDBACK>::zeros();
    a.fixed_view_mut::<HELD, HELD>(0, 0).copy_from(&system.a);
    input.fixed_rows_mut::<HELD>(0).copy_from(&system.load);
    match mode.amplifier {
        AmplifierMode::Linear => {
            for (j, coefficient) in demand_row(pid).iter().enumerate() {
                a[(CURRENT, j)] += system.per_volt * coefficient;
            }
        }
        AmplifierMode::AtUpper => input[CURRENT] += system.per_volt * pid.voltage_limit_v(),
        AmplifierMode::AtLower => input[CURRENT] -= system.per_volt * pid.voltage_limit_v(),
    }
    // dβ̂/dt = β (eq. 29).
    a[(BETA_INTEGRAL, BETA)] = 1.0;
    a[(X_REF_INTEGRAL, X_REF)] = 1.0;
    a[(X_REF, V_REF)] = 1.0;
    a[(V_REF, A_REF)] = 1.0;
    a[(A_REF, W_REF)] = omega;
    a[(W_REF, A_REF)] = -omega;
    // From (β, β̇, β̂) to what they are ahead of the command by.
    let ahead = ahead_of_command(axis.pitch_m_per_rad);
    let back = ahead_of_command(-axis.pitch_m_per_rad);
    (ahead * a * back, ahead * input)
}

/// The matrix that takes `r = x_ref/p` from β, and ṙ and r̂ likewise; with −p it
/// adds them.
fn ahead_of_command(pitch_m_per_rad: f64) -> Matrix<FEEDBACK> {
    let mut matrix = Matrix::<FEEDBACK>::identity();
    for (state, of_command) in COMMANDED {
        matrix[(state, of_command)] = -1.0 / pitch_m_per_rad;
    }
    matrix
}

/// States that are counted from the command, and the command's part.
const COMMANDED: [(usize, usize); 3] = [
    (BETA, X_REF),
    (BETA_DOT, V_REF),
    (BETA_INTEGRAL, X_REF_INTEGRAL),
];

/// A quantity's coefficients for the state that is counted from the command.
pub(crate) fn from_command(row: &Column<FEEDBACK>, pitch_m_per_rad: f64) -> Column<FEEDBACK> {
    ahead_of_command(-pitch_m_per_rad).transpose() * row
}

/// The plant's vector with δ for ε.
pub(crate) fn held_state(y: &Vector, offset_rad: f64) -> Column<HELD> {
    Column::<HELD>::new(
        y[BETA],
        y[BETA_DOT],
        y[EPSILON] - offset_rad,
        y[EPSILON_DOT],
        y[CURRENT],
    )
}

/// The plant's vector with δ for ε and counted from the command, which follows.
pub(crate) fn feedback_state(
    y: &Vector,
    (offset_rad, pitch_m_per_rad): (f64, f64),
    command: &Oscillator,
) -> Column<FEEDBACK> {
    let mut x = Column::<FEEDBACK>::zeros();
    x.fixed_rows_mut::<6>(0).copy_from(y);
    x[DELTA] -= offset_rad;
    x[X_REF] = command.point.displacement_m;
    x[V_REF] = command.point.velocity_mps;
    x[X_REF_INTEGRAL] = command.point.displacement_integral_ms;
    x[A_REF] = command.point.acceleration_mps2;
    x[W_REF] = command.quadrature_mps2;
    for (state, of_command) in COMMANDED {
        x[state] -= x[of_command] / pitch_m_per_rad;
    }
    x
}

/// The plant's vector from that.
pub(crate) fn plant_vector(
    x: &Column<FEEDBACK>,
    (offset_rad, pitch_m_per_rad): (f64, f64),
) -> Vector {
    let mut y = x.fixed_rows::<6>(0).into_owned();
    y[DELTA] += offset_rad;
    for (state, of_command) in COMMANDED {
        y[state] += x[of_command] / pitch_m_per_rad;
    }
    y
}

/// The plant's vector from the state under a held voltage.
pub(crate) fn to_plant_vector(
    x: &Column<HELD>,
    offset_rad: f64,
    beta_integral_rads: f64,
) -> Vector {
    Vector::new(
        x[BETA],
        x[BETA_DOT],
        x[DELTA] + offset_rad,
        x[EPSILON_DOT],
        x[CURRENT],
        beta_integral_rads,
    )
}
