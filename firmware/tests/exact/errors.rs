//! Error sequences that try to drive code and exact law apart.

use firmware::Pid;

use super::{Gains, Random, value};

/// Choice of the next error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// `+E` always.
    Constant,
    /// `+E`, `−E`, `+E`, …: the largest differences.
    Alternating,
    /// `+E` or `−E` for random stretches.
    BangBang,
    /// A walk with random steps.
    Walk,
    /// Any error, independently.
    Uniform,
    /// The error that takes the sum near a random code of the converter, so
    /// that it is hidden by no limit.
    Steered,
    /// Errors that a sluggish axis that follows the sum's sign would show.
    ClosedLoop,
}

impl Shape {
    pub(crate) const ALL: [Self; 7] = [
        Self::Constant,
        Self::Alternating,
        Self::BangBang,
        Self::Walk,
        Self::Uniform,
        Self::Steered,
        Self::ClosedLoop,
    ];
}

/// A source of errors within the declared ranges of a controller.
#[derive(Debug, Clone)]
pub(crate) struct Errors {
    shape: Shape,
    random: Random,
    limit: i64,
    sum_limit: i128,
    gains: [f64; 3],
    full_code: i64,
    error: i64,
    sum: i128,
    axis: f64,
    stretch: i64,
}

/// The gain as a float: for steering only, never for measuring.
fn rough(word: firmware::GainWord) -> f64 {
    f64::from(word.mantissa) * (-f64::from(word.fraction_bits)).exp2()
}

impl Errors {
    pub(crate) fn new(shape: Shape, seed: u64, pid: &Pid, dac_bits: u32) -> Self {
        let words = pid.words();
        Self {
            shape,
            random: Random(seed),
            limit: i64::from(pid.error_limit()),
            sum_limit: i128::from(pid.error_sum_limit()),
            gains: [words.kp, words.ki_dt, words.kd_per_dt].map(rough),
            full_code: 1 << (dac_bits - 1),
            error: 0,
            sum: 0,
            axis: 0.0,
            stretch: 0,
        }
    }

    /// The same errors within a smaller range of their sum.
    pub(crate) fn narrowed(self, sum_limit: u64) -> Self {
        Self {
            sum_limit: i128::from(sum_limit),
            ..self
        }
    }

    /// The next error; neither it nor the sum leaves its declared range.
    pub(crate) fn next(&mut self, last_code: i64) -> i64 {
        let wish = self.wish(last_code).clamp(-self.limit, self.limit);
        let room = self.sum_limit - self.sum.abs();
        let outward = (wish >= 0) == (self.sum >= 0);
        // At the limit of the sum: turn round and come back.
        let error = if outward && i128::from(wish.abs()) > room {
            -wish
        } else {
            wish
        };
        self.sum += i128::from(error);
        self.error = error;
        error
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "steering only: any integer is a valid error"
    )]
    fn wish(&mut self, last_code: i64) -> i64 {
        let limit = self.limit;
        match self.shape {
            Shape::Constant => limit,
            Shape::Alternating if self.error > 0 => -limit,
            Shape::Alternating => limit,
            Shape::BangBang => {
                self.stretch -= 1;
                if self.stretch < 0 || self.error == 0 {
                    self.stretch = self.random.between(0, 200);
                    let up = self.random.between(0, 1) == 1;
                    return if up { limit } else { -limit };
                }
                self.error
            }
            Shape::Walk => {
                let step = 1 << self.random.between(0, 18);
                self.error + self.random.between(-step, step)
            }
            Shape::Uniform => self.random.between(-limit, limit),
            Shape::Steered => {
                let [kp, ki_dt, kd_per_dt] = self.gains;
                let target = self.random.between(-self.full_code, self.full_code) as f64;
                let given = ki_dt * self.sum as f64 - kd_per_dt * self.error as f64;
                let gain = (kp + ki_dt + kd_per_dt).max(1e-9);
                ((target - given) / gain).round() as i64
            }
            Shape::ClosedLoop => {
                // First-order lag driven by the code, which was the last sum's.
                self.axis += last_code as f64 / self.full_code as f64 * 40.0;
                self.stretch = (self.stretch + 1) % 4_000;
                let setpoint = if self.stretch < 2_000 { 20_000.0 } else { 0.0 };
                (setpoint - self.axis).floor() as i64
            }
        }
    }
}

/// Words that stand for the gains to within half a unit of their last place.
pub(crate) fn within_half_a_unit(gains: &Gains, pid: &Pid) -> bool {
    let words = pid.words();
    [
        (&gains.kp, words.kp),
        (&gains.ki_dt, words.ki_dt),
        (&gains.kd_per_dt, words.kd_per_dt),
    ]
    .into_iter()
    .all(|(gain, word)| {
        let apart = gain - value(word);
        let unit = super::power_of_two(-i32::from(word.fraction_bits) - 1);
        apart <= unit && -apart <= unit
    })
}
