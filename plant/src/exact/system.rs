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
//! backlash. Under the continuous law `β̂ = ∫β dt` follows, what of the motion
//! command drives the axis, as a system of its own, and the memory q of a current loop:
//! within one interval of Fig. 6 the command's acceleration is constant, a sine or a cosine,
//! and
//!
//! ```text
//! x = (β − r, β̇ − ṙ, δ, ε̇, I, β̂ − r̂, v_ref, a_ref, w, q),   ȧ_ref = ω·w,   ẇ = −ω·a_ref
//! ```
//!
//! or on a profile, where its jerk is constant, `ȧ_ref = 1·w`, `ẇ = 0`;
//!
//! with the screw angle `r = x_ref/p` that the command asks for: what the loop
//! keeps small is small in x, so that the bounds of [`super::levels`], which add
//! magnitudes, do not count a motion that the axis follows. The law sees nothing
//! else, as its transmission is the axis', so that x_ref and its integral drive nothing;
//! they are known in closed form ([`crate::model::motion`]). A drive beyond the paper's
//! behind a held command is the same with a command of the motion that rests.

use nalgebra::{SMatrix, SVector};

use crate::model::axis::Axis;
use crate::model::axis::Mode;
use crate::model::joint::JointMode;
use crate::model::motion::{Coupling, MotionPoint, Oscillator};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{
    BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, CURRENT_INTEGRAL, EPSILON, EPSILON_DOT, Vector,
};

/// States under a held voltage.
pub(crate) const HELD: usize = 5;
/// States of whatever else gives the voltage, the command included.
pub(crate) const COMMANDED: usize = 10;
/// Those of them that are the axis' own and stand as in the plant's vector.
pub(crate) const OWN: usize = 6;

/// Place of δ: the place of ε in the plant's own vector.
pub(crate) const DELTA: usize = EPSILON;
pub(crate) const V_REF: usize = OWN;
pub(crate) const A_REF: usize = 7;
pub(crate) const W_REF: usize = 8;
/// Place of q, the memory of a current loop.
pub(crate) const LOOP: usize = 9;

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
    #[inline(always)]
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
            let constant_n = mode.guide.direction() * a0 + self.load_force_n;
            screw_load = -(p * constant_n) / inertia;
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
pub(crate) fn demand_row(pid: &ContinuousPid) -> Column<COMMANDED> {
    let (gains, k) = (pid.gains, -pid.loop_gain / pid.gear_ratio);
    let mut row = Column::zeros();
    row[BETA] = k * gains.kp;
    row[BETA_DOT] = k * gains.kd_s;
    row[BETA_INTEGRAL] = k * gains.ki_per_s;
    row
}

/// The axis counted from its command, within one interval of that and without a voltage: `A`
/// and u.
pub(super) fn commanded_system(
    axis: &Axis,
    system: &AxisSystem,
    coupling: Coupling,
) -> (Matrix<COMMANDED>, Column<COMMANDED>) {
    let rad_per_m = 1.0 / axis.pitch_m_per_rad;
    let mut a = Matrix::<COMMANDED>::zeros();
    let mut input = Column::<COMMANDED>::zeros();
    for i in 0..HELD {
        let row = from_command(&system.a.row(i).transpose(), rad_per_m);
        a.set_row(i, &row.transpose());
    }
    input.fixed_rows_mut::<HELD>(0).copy_from(&system.load);
    // The rates of what r, ṙ and r̂ are taken from are less by theirs; dβ̂/dt = β (eq. 29).
    a[(BETA, V_REF)] = 0.0;
    a[(BETA_DOT, A_REF)] = -rad_per_m;
    a[(BETA_INTEGRAL, BETA)] = 1.0;
    a[(V_REF, A_REF)] = 1.0;
    a[(A_REF, W_REF)] = coupling.up_per_s;
    a[(W_REF, A_REF)] = -coupling.down_per_s;
    (a, input)
}

/// A quantity's coefficients for the state that is counted from the command: less
/// what r itself makes of it.
pub(crate) fn from_command(row: &Column<HELD>, rad_per_m: f64) -> Column<COMMANDED> {
    let mut all = Column::<COMMANDED>::zeros();
    all.fixed_rows_mut::<HELD>(0).copy_from(row);
    all[V_REF] = row[BETA_DOT] * rad_per_m;
    all
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

/// β, β̇ and β̂ with what the command asks of them, times p.
fn commanded(point: &MotionPoint) -> [(usize, f64); 3] {
    [
        (BETA, point.displacement_m),
        (BETA_DOT, point.velocity_mps),
        (BETA_INTEGRAL, point.displacement_integral_ms),
    ]
}

/// The plant's vector with δ for ε and counted from the command, which follows.
pub(crate) fn commanded_state(
    y: &Vector,
    (offset_rad, rad_per_m): (f64, f64),
    command: &Oscillator,
) -> Column<COMMANDED> {
    let mut x = Column::<COMMANDED>::zeros();
    x.fixed_rows_mut::<OWN>(0)
        .copy_from(&y.fixed_rows::<OWN>(0));
    x[DELTA] -= offset_rad;
    for (state, of_command) in commanded(&command.point) {
        x[state] -= of_command * rad_per_m;
    }
    x[LOOP] = y[CURRENT_INTEGRAL];
    set_command(&mut x, command);
    x
}

/// Sets the command's part of a state.
#[inline]
pub(crate) fn set_command(x: &mut Column<COMMANDED>, command: &Oscillator) {
    x[V_REF] = command.point.velocity_mps;
    x[A_REF] = command.point.acceleration_mps2;
    x[W_REF] = command.quadrature_mps2;
}

/// The plant's vector from that.
#[inline]
pub(crate) fn plant_vector(
    x: &Column<COMMANDED>,
    (offset_rad, rad_per_m): (f64, f64),
    command: &MotionPoint,
) -> Vector {
    let mut y = Vector::zeros();
    y.fixed_rows_mut::<OWN>(0)
        .copy_from(&x.fixed_rows::<OWN>(0));
    y[DELTA] += offset_rad;
    for (state, of_command) in commanded(command) {
        y[state] += of_command * rad_per_m;
    }
    y[CURRENT_INTEGRAL] = x[LOOP];
    y
}
