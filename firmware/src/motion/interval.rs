//! The seven intervals of the command, in counts and samples, and the words of
//! their samples.

use heapless::Vec;

use super::piece::{
    ACCELERATION_HALF, GRID_BITS, Long, Piece, Point, SINE_BITS_MAX, Shape, Turn, VELOCITY_BITS,
    VELOCITY_HALF,
};
use super::real::Real;
use crate::refusal::{Refusal, What};
use crate::wide::held;

/// Samples of one interval with constant acceleration at most.
const STRAIGHT_SAMPLES_MAX: u64 = 1 << 30;

/// Course of the acceleration within an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    Rise,
    Constant,
    Fall,
}

/// One interval in counts and samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    /// 1 to 7.
    pub(super) number: u8,
    pub(super) course: Course,
    pub(super) duration: Real,
    /// Position and velocity at its start.
    pub(super) position: Real,
    pub(super) velocity: Real,
    /// The acceleration's amplitude, with its sign.
    pub(super) amplitude: Real,
    /// Its samples, and when the first of them is after its start.
    pub(super) samples: u64,
    pub(super) first: Real,
}

impl Interval {
    /// `ω`, and `ω·τ` at the first sample.
    pub(super) fn first_angle(&self) -> (Real, Real) {
        let omega = Real::HALF_PI.over(self.duration);
        (omega, omega.times(self.first))
    }

    /// The largest acceleration that a sample of the interval may have: an
    /// interval with one sample may be so short that its peak is never seen.
    pub(super) fn largest_acceleration(&self) -> Real {
        let (_, theta) = self.first_angle();
        match (self.samples, self.course) {
            (1, Course::Rise) => self.amplitude.times(theta.sine_cosine().0),
            (1, Course::Fall) => self.amplitude.times(theta.sine_cosine().1),
            _ => self.amplitude,
        }
    }
}

/// The peak speed and the seven intervals, with the amplitudes that lead over
/// the travel to rest.
pub(super) fn chain(
    travel: u64,
    intervals_ps: [u64; 7],
    period_ps: u64,
) -> Result<(Real, Vec<Interval, 7>), Refusal> {
    let period = Real::from_integer(period_ps);
    let [t1, t2, t3, t4, t5, t6, t7] = intervals_ps.map(|t| Real::from_integer(t).over(period));
    let c = Real::TWO_OVER_PI;
    // Speed gained per unit of amplitude: ∫ of a quarter sine is (2/π)·T.
    let gain = t2.plus(c.times(t1.plus(t3)));
    let loss = t6.plus(c.times(t5.plus(t7)));
    for (what, speed) in [(What::Rise, gain), (What::Fall, loss)] {
        if speed.is_zero() {
            return Err(Refusal::new(what, 0, [1, i64::MAX]));
        }
    }
    // Speeds at the joints as parts of the peak speed.
    let v1 = c.times(t1).over(gain);
    let v2 = t2.plus(c.times(t1)).over(gain);
    let v6 = c.times(t7).over(loss);
    let v5 = t6.plus(c.times(t7)).over(loss);
    // Displacements at a peak speed of 1, the last three seen from the end.
    let rest = Real::ONE.minus(c);
    let sine = |t: Real, v: Real| t.times(v).times(rest);
    let ramp = |t: Real, u: Real, v: Real| t.times(u.plus(v)).scaled(-1);
    let cosine = |t: Real, v: Real| t.times(v.plus(c.times(Real::ONE.minus(v))));
    let (zero, one) = (Real::ZERO, Real::ONE);
    let (rise, constant, fall) = (Course::Rise, Course::Constant, Course::Fall);
    // Length, displacement and speed at the start.
    let parts = [
        (rise, t1, sine(t1, v1), zero),
        (constant, t2, ramp(t2, v1, v2), v1),
        (fall, t3, cosine(t3, v2), v2),
        (constant, t4, t4, one),
        (rise, t5, cosine(t5, v5), one),
        (constant, t6, ramp(t6, v5, v6), v5),
        (fall, t7, sine(t7, v6), v6),
    ];
    let unit = parts.iter().fold(zero, |sum, part| sum.plus(part.2));
    let peak = Real::from_integer(travel).scaled(-32).over(unit);

    let (up, down) = (peak.over(gain), peak.over(loss).negated());
    let amplitudes = [up, up, up, zero, down, down, down];
    let rows = intervals_ps.into_iter().zip(parts).zip(amplitudes).zip(1..);

    let mut intervals = Vec::new();
    let (mut start_ps, mut position) = (0_u64, Real::ZERO);
    for (((t_ps, (course, duration, displacement, speed)), amplitude), number) in rows {
        // Sample k lies in the interval if start ≤ k·Δt < end.
        let end_ps = start_ps.saturating_add(t_ps);
        let first_sample = sample_from(start_ps, period_ps);
        // Below 2^42: no time is rounded.
        let first_ps = first_sample
            .saturating_mul(period_ps)
            .saturating_sub(start_ps);
        // There is room for all seven.
        let _ = intervals.push(Interval {
            number,
            course,
            duration,
            position: position.times(peak),
            velocity: speed.times(peak),
            amplitude,
            samples: sample_from(end_ps, period_ps).saturating_sub(first_sample),
            first: Real::from_integer(first_ps).over(period),
        });
        start_ps = end_ps;
        position = position.plus(displacement);
    }
    Ok((peak, intervals))
}

/// The first sample at or after `time_ps`.
pub(super) fn sample_from(time_ps: u64, period_ps: u64) -> u64 {
    let before = period_ps.saturating_sub(1);
    time_ps
        .saturating_add(before)
        .checked_div(period_ps)
        .unwrap_or(0)
}

impl Interval {
    /// The words of an interval that has samples.
    pub(super) fn piece(
        &self,
        velocity_bits: i32,
        acceleration_bits: i32,
    ) -> Result<Piece, Refusal> {
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
                let start = self.position.plus(sine_amplitude);
                let velocity = self.velocity.plus(speed.times(sine));
                (start, self.velocity, cosine, velocity)
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

    /// Shape that turns a sine of this amplitude, and the sine's fraction bits.
    fn turning(
        &self,
        line_speed: Real,
        sine_amplitude: Real,
        velocity_bits: i32,
        acceleration_bits: i32,
    ) -> Result<(Shape, i32), Refusal> {
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
    fn straight(&self, velocity_bits: i32, acceleration_bits: i32) -> Result<Piece, Refusal> {
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

    fn samples_up_to(&self, max: u64) -> Result<u32, Refusal> {
        let [value, most] = [self.samples, max].map(held);
        let samples = u32::try_from(self.samples).ok();
        samples
            .filter(|_| value <= most)
            .ok_or_else(|| Refusal::new(What::IntervalSamples(self.number), value, [1, most]))
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
