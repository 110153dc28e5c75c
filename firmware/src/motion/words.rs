//! From an interval in counts and samples to the words of its samples.

use super::error::MotionError;
use super::interval::{Course, Interval};
use super::piece::{
    ACCELERATION_HALF, GRID_BITS, Long, Piece, Point, SINE_BITS_MAX, Shape, Turn, VELOCITY_BITS,
    VELOCITY_HALF,
};
use super::real::Real;

/// Samples of one interval with constant acceleration at most.
const STRAIGHT_SAMPLES_MAX: u64 = 1 << 30;

impl Interval {
    /// The words of an interval that has samples.
    pub(super) fn piece(
        &self,
        velocity_bits: i32,
        acceleration_bits: i32,
    ) -> Result<Piece, MotionError> {
        if self.course == Course::Constant || self.amplitude.is_zero() {
            return self.straight(velocity_bits, acceleration_bits);
        }
        let (omega, theta) = self.first_angle();
        let (sine, cosine) = theta.sine_cosine();
        // The speed and the displacement of the sine, S = A/ω².
        let speed = self.amplitude.over(omega);
        let sine_amplitude = speed.over(omega);
        let (line_start, line_speed, sine, velocity) = match self.course {
            // x = x0 + (v0 + A/ω)·τ − S·sin ωτ
            Course::Rise | Course::Constant => {
                let line_speed = self.velocity.plus(speed);
                let velocity = line_speed.minus(speed.times(cosine));
                (self.position, line_speed, sine, velocity)
            }
            // x = x0 + S + v0·τ − S·cos ωτ
            Course::Fall => {
                let velocity = self.velocity.plus(speed.times(sine));
                (
                    self.position.plus(sine_amplitude),
                    self.velocity,
                    cosine,
                    velocity,
                )
            }
        };
        let line = line_start.plus(line_speed.times(self.first));
        if self.samples == 1 {
            return Ok(Piece {
                samples: 1,
                entry: Point {
                    line: Long::from_real(line.minus(sine_amplitude.times(sine))),
                    velocity: velocity_word(velocity, velocity_bits),
                    ..Point::default()
                },
                shape: Shape::Straight {
                    growth: Long::default(),
                    velocity_growth: 0,
                    acceleration: short(self.amplitude.times(sine), acceleration_bits),
                },
            });
        }
        let (shape, sine_bits) =
            self.turning(line_speed, sine_amplitude, velocity_bits, acceleration_bits)?;
        // Half a sample later; there is another sample in the interval, so
        // that ω·τ + ω/2 < π/2.
        let (later_sine, later_cosine) = theta.plus(omega.scaled(-1)).sine_cosine();
        let cosine_later = match self.course {
            Course::Rise | Course::Constant => later_cosine,
            Course::Fall => later_sine.negated(),
        };
        Ok(Piece {
            // Checked above.
            samples: u32::try_from(self.samples).unwrap_or(u32::MAX),
            entry: Point {
                line: Long::from_real(line),
                step: Long::from_real(line_speed),
                sine: word(sine_amplitude.times(sine), sine_bits),
                cosine: word(sine_amplitude.times(cosine_later), sine_bits),
                velocity: velocity_word(velocity, velocity_bits),
            },
            shape,
        })
    }

    /// What turns a sine of amplitude `sine_amplitude`, and the sine's fraction bits.
    fn turning(
        &self,
        line_speed: Real,
        sine_amplitude: Real,
        velocity_bits: i32,
        acceleration_bits: i32,
    ) -> Result<(Shape, i32), MotionError> {
        // The amplitude takes 2^61 to 2^62 less a margin of 1/64, into which
        // the roundings may grow.
        let grown = sine_amplitude.plus(sine_amplitude.scaled(-6));
        let sine_bits = 62_i32.saturating_sub(grown.bits()).min(SINE_BITS_MAX);
        let most_bits = sine_bits.saturating_sub(5).clamp(0, 31).unsigned_abs();
        self.samples_up_to(1_u64.wrapping_shl(most_bits))?;

        let (omega, _) = self.first_angle();
        let (half_sine, half_cosine) = omega.scaled(-1).sine_cosine();
        let over = |bits: i32| bits.saturating_sub(sine_bits);
        let velocity_weight = short(
            omega.over(half_cosine).scaled(-1),
            over(velocity_bits.saturating_add(62)),
        );
        let acceleration_weight = short(
            omega.times(omega),
            over(acceleration_bits.saturating_add(61)),
        );
        let shape = Shape::Sine {
            turn: Turn::from_real(half_sine.scaled(1)),
            // 0 to 62.
            shift: u8::try_from(sine_bits.saturating_sub_unsigned(GRID_BITS)).unwrap_or(0),
            // Two floors leave out a half each, in the mean.
            velocity_centre: velocity_word(line_speed, velocity_bits)
                .saturating_sub(i64::from(velocity_weight)),
            velocity_weight,
            acceleration_weight,
            // So does one.
            acceleration_centre: acceleration_weight
                .wrapping_shr(1)
                .saturating_add(ACCELERATION_HALF),
        };
        Ok((shape, sine_bits))
    }

    /// Constant acceleration: `x = x0 + v0·τ + A·τ²/2`.
    fn straight(&self, velocity_bits: i32, acceleration_bits: i32) -> Result<Piece, MotionError> {
        let max = if self.amplitude.is_zero() {
            u64::from(u32::MAX)
        } else {
            STRAIGHT_SAMPLES_MAX
        };
        let samples = self.samples_up_to(max)?;
        let (a, t) = (self.amplitude, self.first);
        let mean = self.velocity.plus(a.times(t).scaled(-1));
        let velocity = self.velocity.plus(a.times(t));
        // With one sample there is no step, and an amplitude of any size.
        let growth = if samples == 1 { Real::ZERO } else { a };
        Ok(Piece {
            samples,
            entry: Point {
                line: Long::from_real(self.position.plus(mean.times(t))),
                step: Long::from_real(velocity.plus(growth.scaled(-1))),
                velocity: velocity_word(velocity, velocity_bits),
                ..Point::default()
            },
            shape: Shape::Straight {
                growth: Long::from_real(growth),
                velocity_growth: word(growth, velocity_bits.saturating_add(VELOCITY_BITS)),
                acceleration: short(a, acceleration_bits),
            },
        })
    }

    fn samples_up_to(&self, max: u64) -> Result<u32, MotionError> {
        let refused = MotionError::Samples {
            interval: self.number,
            samples: self.samples,
            max,
        };
        if self.samples > max {
            return Err(refused);
        }
        u32::try_from(self.samples).map_err(|_| refused)
    }
}

/// A velocity with half a unit of the output, ready for its floor.
fn velocity_word(velocity: Real, velocity_bits: i32) -> i64 {
    word(velocity, velocity_bits.saturating_add(VELOCITY_BITS)).saturating_add(VELOCITY_HALF)
}

/// A value that fits by the table of [`super::piece`]; held if it did not.
fn word(value: Real, fraction_bits: i32) -> i64 {
    let fixed = value.to_fixed(fraction_bits);
    i64::try_from(fixed.clamp(i128::from(i64::MIN), i128::from(i64::MAX))).unwrap_or(0)
}

/// The same for 32 bits.
fn short(value: Real, fraction_bits: i32) -> i32 {
    let fixed = word(value, fraction_bits);
    i32::try_from(fixed.clamp(i64::from(i32::MIN), i64::from(i32::MAX))).unwrap_or(0)
}
