//! Inputs of an adversary for the axis' law: the corners of every declared
//! range at once, and sums just beside the limits of the converter.

use firmware::law::LawInput;

use super::Random;
use super::axis_law::{Model, two};

/// Choice of the next sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Drive {
    /// Each of the four integers at some corner, `i32`'s own included.
    Corners,
    /// All four integers together at their largest, with one sign: the
    /// integral is filled, then the error jumps from −E to +E.
    Together,
    /// Any integers of any size, independently.
    Uniform,
    /// Walks.
    Walk,
    /// The error that takes the sum beside a code within or beyond reach.
    Steered,
}

impl Drive {
    pub(crate) const ALL: [Self; 5] = [
        Self::Corners,
        Self::Together,
        Self::Uniform,
        Self::Walk,
        Self::Steered,
    ];
}

/// A source of samples.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    drive: Drive,
    random: Random,
    k: u64,
    sign: i64,
    last: [i64; 4],
}

const RATE: i64 = 1 << 30;

impl Samples {
    pub(crate) fn new(drive: Drive, seed: u64) -> Self {
        Self {
            drive,
            random: Random(seed),
            k: 0,
            sign: if seed.is_multiple_of(2) { 1 } else { -1 },
            last: [0; 4],
        }
    }

    /// The next sample for the axis that `model` describes. Velocity and
    /// acceleration are within their range; error and difference need not be.
    pub(crate) fn next(&mut self, model: &Model) -> LawInput {
        let limit = i64::try_from(model.ranges.error).expect("at most 2^29");
        let slope = i64::try_from(model.ranges.slope).expect("at most 2^30");
        let (min, max) = (i64::from(i32::MIN), i64::from(i32::MAX));
        let [e, d, v, a] = match self.drive {
            Drive::Corners => [
                self.corner(&[limit, limit + 1, slope, slope / 2, max, 1, 0], min),
                self.corner(&[slope, slope + 1, limit, max, 1, 0], min),
                self.corner(&[RATE, 1, 0], -RATE),
                self.corner(&[RATE, 1, 0], -RATE),
            ],
            Drive::Together => {
                self.k += 1;
                if self.k.is_multiple_of(600) {
                    self.sign = -self.sign;
                }
                let up = self.k % 600 < 300 || self.k % 2 == 1;
                let sign = if up { self.sign } else { -self.sign };
                let rate = RATE * self.sign;
                [sign * max, -sign * max, rate, rate]
            }
            Drive::Uniform => [31, 31, 30, 30].map(|bits| {
                let size = 1 << self.random.between(0, bits);
                self.random.between(-size, size - 1)
            }),
            Drive::Walk => self.last.map(|last| {
                let size = 1 << self.random.between(0, 22);
                last + self.random.between(-size, size)
            }),
            Drive::Steered => {
                let [_, d, v, a] = self.last.map(|last| {
                    let size = 1 << self.random.between(0, 20);
                    last / 2 + self.random.between(-size, size)
                });
                [self.beside_a_code(model), d, v, a]
            }
        };
        self.last = [
            e.clamp(min, max),
            d.clamp(min, max),
            v.clamp(-RATE, RATE),
            a.clamp(-RATE, RATE),
        ];
        let [error, difference, velocity, acceleration] =
            self.last.map(|x| i32::try_from(x).expect("32 bits"));
        LawInput {
            error,
            difference,
            velocity,
            acceleration,
            within_dead_band: self.random.one_in(16),
            hold_integral: self.random.one_in(16),
        }
    }

    /// One of `corners`, of either sign, or `lowest`.
    fn corner(&mut self, corners: &[i64], lowest: i64) -> i64 {
        let last = i64::try_from(corners.len()).expect("short") - 1;
        let index = usize::try_from(self.random.between(0, last)).expect("short");
        match self.random.between(0, 16) {
            0 => lowest,
            n if n % 2 == 0 => corners[index],
            _ => -corners[index],
        }
    }

    /// An error that brings proportional and integral term near a code of the
    /// window, half a code beyond it, or a whole range beyond it.
    fn beside_a_code(&mut self, model: &Model) -> i64 {
        let (low, high) = model.window();
        let unit = two(u32::from(model.words.sum_fraction_bits));
        let target = match self.random.between(0, 4) {
            0 => low * unit,
            1 => high * unit,
            2 => high * unit + unit / 2,
            3 => 2 * high * unit,
            _ => model.code * unit,
        };
        let gain = super::axis_law::value(&model.words, model.words.kp)
            + super::axis_law::value(&model.words, model.words.ki_dt);
        let error = (target - model.integral).div_euclid(gain.max(1));
        let near = i64::try_from(error.clamp(-two(31), two(31))).expect("33 bits");
        near + self.random.between(-2, 2)
    }
}
