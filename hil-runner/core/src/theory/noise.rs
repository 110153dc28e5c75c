//! Noise that the steps of encoder and converter add to a moving axis: white noise
//! through the linear loop.
//!
//! A signal that passes many steps from one sample to the next leaves a rounding
//! error that is uniform, of variance q²/12, and white (Widrow and Kollár,
//! "Quantization Noise", 2008; Franklin, Powell and Workman, "Digital Control
//! of Dynamic Systems", 10.1). There are three: the encoder's floor and the
//! setpoint's rounding, both in counts and both in the error, and the code's
//! rounding. With `X(k+1) = F·X(k) + g·n(k)` the covariance is
//!
//! ```text
//! P = F·P·Fᵀ + g·gᵀ·σ² = Σ_k F^k·g·gᵀ·(F^k)ᵀ·σ²
//! ```
//!
//! summed by doubling: `P ← P + F·P·Fᵀ, F ← F²` (Åström and Wittenmark,
//! "Computer-Controlled Systems", 11.2).
//!
//! It holds while the axis moves by several counts a sample and not in step
//! with them. At rest the errors are no noise: the axis stands, or cycles
//! ([`super::encoder_cycle`], [`super::dac_cycle`]).

use super::characteristic::{LoopGains, is_papers_loop};
use super::family::LoopFamily;
use super::held::HeldStep;
use super::linear_axis::{Column, JointState, Square};
use crate::case::{Case, Law};
use crate::options::Quantiser;

/// Quantisation noise of an axis in motion, in contact: standard
/// deviations at the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// From the encoder's floor.
    pub encoder: NoiseFigures,
    /// From the setpoint's rounding to whole counts.
    pub setpoint: NoiseFigures,
    /// From the code's rounding.
    pub dac: NoiseFigures,
    /// From all three, which are independent.
    pub together: NoiseFigures,
    /// Mean of the carriage's position against the axis without steps \[µm\]:
    /// the floor shows half a count less than there is, and the loop makes up
    /// for it.
    pub mean_um: f64,
}

/// Standard deviations of what one source causes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFigures {
    /// Position of the carriage \[µm\].
    pub position_um: f64,
    /// Its acceleration \[m/s²\].
    pub acceleration_mps2: f64,
    /// Motor voltage, that of the sample's own code \[V\]; of a current drive the commanded
    /// current \[A\].
    pub command: f64,
}

/// The quantisation noise of a case on rungs `quantised` and `firmware`. `None`
/// on the others, where the loop is not the paper's or not stable, and with a
/// quantiser that rounds to other than the nearest code.
pub fn quantisation_noise(case: &Case) -> Option<Noise> {
    let nearest = match case.controller.law {
        Law::Quantised => true,
        Law::Firmware => case.options.law.quantiser == Quantiser::Nearest,
        Law::Continuous | Law::Sampled => false,
    };
    if !nearest || !is_papers_loop(case) {
        return None;
    }
    let gains = LoopGains::of(case);
    let rad_per_count = 1.0 / case.encoder.counts_per_rad;
    let volts_per_code = case.dac.step_v * case.amplifier.gain;
    let family = LoopFamily::of(case, JointState::Contact)?;
    if !family.is_stable(&gains) {
        return None;
    }
    let steps = [rad_per_count, volts_per_code].map(|step| step / 12.0_f64.sqrt());
    let axis = &family.axis;
    let [of_error, of_code] = match axis.states() {
        2 => variances::<2, 5>(&family, &gains, steps),
        3 => variances::<3, 6>(&family, &gains, steps),
        4 => variances::<4, 7>(&family, &gains, steps),
        5 => variances::<5, 8>(&family, &gains, steps),
        _ => variances::<6, 9>(&family, &gains, steps),
    };
    let together = core::array::from_fn(|k| 2.0 * of_error[k] + of_code[k]);
    let figures = |variances: [f64; 3]| {
        let [position_m, acceleration_mps2, command] = variances.map(f64::sqrt);
        NoiseFigures {
            position_um: 1e6 * position_m,
            acceleration_mps2,
            command,
        }
    };
    let per_motor_rad = axis.pitch_m_per_rad * axis.gear_ratio;
    Some(Noise {
        encoder: figures(of_error),
        setpoint: figures(of_error),
        dac: figures(of_code),
        together: figures(together),
        mean_um: 1e6 * 0.5 * rad_per_count * per_motor_rad,
    })
}

/// Variances of position, acceleration and voltage, of an axis with N states, from one source
/// of error and from the codes, whose standard deviations are `error_rad` and `voltage_v`.
fn variances<const N: usize, const D: usize>(
    family: &LoopFamily,
    gains: &LoopGains,
    [error_rad, voltage_v]: [f64; 2],
) -> [[f64; 3]; 2] {
    let (axis, period_s, delay_s) = (&family.axis, family.period_s, family.delay_s);
    let system = axis.system::<N>();
    let step = HeldStep::new(&system, period_s, delay_s);
    let closed = ClosedLoop::<D>::new(&step, gains, axis.gear_ratio, period_s);
    let (a, b) = system;
    // γ̈ = β̈ − ε̈
    let (screw, per_command) = match axis.has_joint() {
        true => ((a.row(1) - a.row(3)).transpose(), b[1] - b[3]),
        false => (a.row(1).transpose(), b[1]),
    };
    let p = axis.pitch_m_per_rad;
    let mut position = Column::<D>::zeros();
    position[0] = p;
    if axis.has_joint() {
        position[2] = -p;
    }
    let mut acceleration = Column::<D>::zeros();
    acceleration.fixed_rows_mut::<N>(0).copy_from(&(screw * p));
    // What a sample adds to its own command acts at once where the current is the command's
    // and nothing delays it; with a delay the command of the last sample acts.
    let mut acceleration_per_own = 0.0;
    if delay_s == 0.0 {
        acceleration += closed.voltage * (p * per_command);
        acceleration_per_own = p * per_command;
    } else {
        acceleration[N] += p * per_command;
    }
    let of = |state: Column<D>, own_v: f64| {
        let covariance = covariance(&closed.transition, &state);
        let variance = |row: &Column<D>| row.dot(&(covariance * row)).max(0.0);
        let voltage = variance(&closed.voltage) + own_v * own_v;
        let own = acceleration_per_own * own_v;
        [
            variance(&position),
            variance(&acceleration) + own * own,
            voltage,
        ]
    };
    let own_v = closed.voltage_per_error * error_rad;
    [
        of(closed.per_error * error_rad, own_v),
        of(closed.per_volt * voltage_v, voltage_v),
    ]
}

/// Doublings of the sum: 2^40 samples.
const MOST_DOUBLINGS: u32 = 40;

/// `Σ_k F^k·g·gᵀ·(F^k)ᵀ` of a stable F.
fn covariance<const D: usize>(transition: &Square<D>, noise: &Column<D>) -> Square<D> {
    let mut power = *transition;
    let mut sum = noise * noise.transpose();
    for _ in 0..MOST_DOUBLINGS {
        let more = power * sum * power.transpose();
        let before = sum;
        sum += more;
        if sum == before {
            break;
        }
        power *= power;
    }
    sum
}

/// `X(k+1) = F·X(k) + …` with `X = (x, u(k−1), S(k−1), e(k−1))`: the axis with N
/// states, and what the controller remembers. D is N + 3.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ClosedLoop<const D: usize> {
    /// `F`.
    transition: Square<D>,
    /// Share of an error of 1 rad at the motor to X(k+1).
    per_error: Column<D>,
    /// Share of a volt on top of the law's in X(k+1).
    per_volt: Column<D>,
    /// The law's voltage `u(k)` as coefficients of X(k) …
    voltage: Column<D>,
    /// … and of an error of 1 rad at t_k.
    voltage_per_error: f64,
}

impl<const D: usize> ClosedLoop<D> {
    /// The loop around a held step.
    fn new<const N: usize>(
        step: &HeldStep<N>,
        gains: &LoopGains,
        gear_ratio: f64,
        period_s: f64,
    ) -> Self {
        let (past, sum, error) = (N, N + 1, N + 2);
        let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
        // u = (K_p + K_i·T + K_d/T)·e + K_i·S − K_d/T·e_prev, e = −β/z.
        let voltage_per_error = kp + ki * period_s + kd / period_s;
        let mut measured = Column::<D>::zeros();
        measured[0] = -1.0 / gear_ratio;
        let mut voltage = measured * voltage_per_error;
        voltage[sum] += ki;
        voltage[error] -= kd / period_s;

        let mut per_volt = Column::<D>::zeros();
        per_volt.fixed_rows_mut::<N>(0).copy_from(&step.present);
        per_volt[past] = 1.0;
        let mut free = Square::<D>::zeros();
        free.fixed_view_mut::<N, N>(0, 0)
            .copy_from(&(Square::<N>::identity() + step.change));
        free.fixed_view_mut::<N, 1>(0, past).copy_from(&step.past);
        free[(sum, sum)] = 1.0;
        let mut remembered = Column::<D>::zeros();
        remembered[sum] = period_s;
        remembered[error] = 1.0;
        Self {
            transition: free + per_volt * voltage.transpose() + remembered * measured.transpose(),
            per_error: per_volt * voltage_per_error + remembered,
            per_volt,
            voltage,
            voltage_per_error,
        }
    }
}
