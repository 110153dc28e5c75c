//! Inputs of an adversary: the corners of every declared range at once, and
//! sums just beside the limits of the converter.

use firmware::Codes;
use firmware::law::LawInput;

use super::Random;
use super::model::{CODE, Model, two, value};

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

/// A source of samples; nothing of them need be within its range.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    drive: Drive,
    random: Random,
    k: u64,
    sign: i64,
    last: [i64; 4],
}

const RATE: i64 = 1 << 24;
const MAX: i64 = i32::MAX as i64;

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

    /// The drive whose turn it is in a round, with a seed of its own.
    pub(crate) fn of_round(round: u64) -> Self {
        let drive = Drive::ALL[usize::try_from(round % 5).expect("below 5")];
        Self::new(drive, round / 5)
    }

    /// The next sample for the axis that `model` describes.
    pub(crate) fn next(&mut self, model: &Model) -> LawInput {
        let limits = [model.ranges.error, model.ranges.difference];
        let [limit, difference] = limits.map(|x| i64::try_from(x).expect("at most 2^30"));
        let wish = match self.drive {
            Drive::Corners => [
                self.corner(&[limit, limit + 1, difference, difference / 2, MAX, 1, 0]),
                self.corner(&[difference, difference + 1, limit, MAX, 1, 0]),
                self.corner(&[RATE, RATE - 1, MAX, 1, 0]),
                self.corner(&[RATE, RATE - 1, MAX, 1, 0]),
            ],
            Drive::Together => {
                self.k += 1;
                if self.k.is_multiple_of(600) {
                    self.sign = -self.sign;
                }
                let up = self.k % 600 < 300 || self.k % 2 == 1;
                let [error, rate] = [if up { self.sign } else { -self.sign }, self.sign];
                [error * MAX, -error * MAX, rate * MAX, rate * MAX]
            }
            Drive::Uniform => [(); 4].map(|()| {
                let size = 1 << self.random.between(0, 31);
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
        self.last = wish.map(|x| x.clamp(-MAX - 1, MAX));
        let [error, difference, velocity, acceleration] =
            self.last.map(|x| i32::try_from(x).expect("32 bits"));
        LawInput {
            error,
            difference,
            velocity,
            acceleration,
            ahead: Codes::ZERO,
            within_dead_band: self.random.one_in(16),
            hold_integral: self.random.one_in(16),
        }
    }

    /// One of `corners`, of either sign, or the lowest integer.
    fn corner(&mut self, corners: &[i64]) -> i64 {
        let corner = self.random.one_of(corners);
        if self.random.one_in(16) {
            -MAX - 1
        } else {
            corner * self.random.one_of(&[1, -1])
        }
    }

    /// An error that brings proportional and integral term near a code of the
    /// window, half a code beyond it, or a whole range beyond it.
    fn beside_a_code(&mut self, model: &Model) -> i64 {
        let (low, high) = model.window();
        let ends = [
            low * CODE,
            high * CODE,
            high * CODE + CODE / 2,
            2 * high * CODE,
        ];
        let target = self
            .random
            .one_of(&[ends[0], ends[1], ends[2], ends[3], model.code * CODE]);
        let gain = value(model.words.kp) + value(model.words.ki_dt);
        let error = (target - model.integral).div_euclid(gain.max(1));
        let near = i64::try_from(error.clamp(-two(31), two(31))).expect("33 bits");
        near + self.random.between(-2, 2)
    }
}
