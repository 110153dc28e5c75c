//! From travel and intervals to the words of each interval.

use heapless::Vec;

use super::error::MotionError;
use super::piece::{
    ACCELERATION_BITS, GRID_BITS, Long, Piece, Point, SINE_BITS_MAX, Shape, Turn, VELOCITY_BITS,
};
use super::real::Real;

/// Fraction bits of velocity and acceleration at most.
const OUTPUT_BITS_MAX: i32 = 60;
/// Samples of one interval with constant acceleration at most.
const STRAIGHT_SAMPLES_MAX: u64 = 1 << 30;
/// The intervals together last at most this long \[ps\].
const DURATION_MAX_PS: u64 = 1 << 62;

/// A motion that can be generated: checked and computed once.
///
/// ```
/// use firmware::MotionPlan;
///
/// // 2^20 counts in four quarter waves of 0.25 s, at 1 ms.
/// let quarter_ps = 250_000_000_000;
/// let intervals_ps = [quarter_ps, 0, quarter_ps, 0, quarter_ps, 0, quarter_ps];
/// let plan = MotionPlan::new(1 << 52, intervals_ps, 1_000_000)?;
/// assert_eq!(plan.last_sample(), 1_000);
/// // The peak is 2^21 counts per second, 2^10.996 per sample² is 30 bits.
/// assert_eq!(plan.velocity_fraction_bits(), 18);
/// # Ok::<(), firmware::MotionError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MotionPlan {
    /// Those of the intervals that have samples, for the travel's magnitude.
    pub(super) pieces: Vec<Piece, 7>,
    /// Whether the travel is negative.
    pub(super) mirrored: bool,
    /// Where the motion ends, `floor(h + ½)`.
    pub(super) end: i32,
    last_sample: u64,
    velocity_fraction_bits: u8,
    acceleration_fraction_bits: u8,
}

/// Course of the acceleration within an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Course {
    Rise,
    Constant,
    Fall,
}

/// One interval in counts and samples.
#[derive(Debug, Clone, Copy)]
struct Interval {
    /// 1 to 7.
    number: u8,
    course: Course,
    duration: Real,
    /// Position and velocity at its start.
    position: Real,
    velocity: Real,
    /// The acceleration's amplitude, with its sign.
    amplitude: Real,
    /// Its samples, and when the first of them is after its start.
    samples: u64,
    first: Real,
}

impl MotionPlan {
    /// The motion over `travel` \[2^−32 counts\] in the intervals `t1` to `t7`
    /// \[ps\], with a sample every `period_ns` from its start on.
    ///
    /// # Errors
    /// [`MotionError`] if there is no acceleration or no deceleration, or what
    /// is asked for cannot be generated to a quarter of a count.
    pub fn new(travel: i64, intervals_ps: [u64; 7], period_ns: u32) -> Result<Self, MotionError> {
        if period_ns == 0 {
            return Err(MotionError::Period);
        }
        if travel == i64::MIN {
            return Err(MotionError::Travel { travel });
        }
        let total_ps = intervals_ps
            .iter()
            .fold(0_u64, |sum, &t| sum.saturating_add(t));
        if total_ps > DURATION_MAX_PS {
            return Err(MotionError::Duration { total_ps });
        }
        // Below 2^42.
        let period_ps = u64::from(period_ns).saturating_mul(1_000);
        let intervals = chain(travel.unsigned_abs(), intervals_ps, period_ps)?;

        // The speed between acceleration and deceleration is the peak.
        let [_, _, _, Interval { velocity: peak, .. }, ..] = intervals;
        let velocity_bits = output_bits(peak).ok_or_else(|| MotionError::Speed {
            counts_per_sample: rounded(peak),
        })?;
        let mut acceleration_bits = OUTPUT_BITS_MAX;
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            let bits =
                output_bits(interval.amplitude).ok_or_else(|| MotionError::Acceleration {
                    interval: interval.number,
                    counts_per_sample2: rounded(interval.amplitude),
                })?;
            acceleration_bits = acceleration_bits.min(bits);
        }

        let mut pieces = Vec::new();
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            // There is room for all seven.
            let _ = pieces.push(interval.piece(velocity_bits, acceleration_bits)?);
        }
        let half = 1_i128 << 31_u32;
        let end = i128::from(travel).wrapping_add(half).wrapping_shr(32);
        let [a, b, c, d, ..] = end.to_le_bytes();
        Ok(Self {
            pieces,
            mirrored: travel < 0,
            end: i32::from_le_bytes([a, b, c, d]),
            last_sample: sample_from(total_ps, period_ps),
            velocity_fraction_bits: u8::try_from(velocity_bits).unwrap_or(0),
            acceleration_fraction_bits: u8::try_from(acceleration_bits).unwrap_or(0),
        })
    }

    /// Fraction bits of the setpoints' velocities, 0 to 60.
    pub const fn velocity_fraction_bits(&self) -> u8 {
        self.velocity_fraction_bits
    }

    /// Fraction bits of the setpoints' accelerations, 0 to 60.
    pub const fn acceleration_fraction_bits(&self) -> u8 {
        self.acceleration_fraction_bits
    }

    /// Number of the sample at which the motion has ended; the first is 0.
    pub const fn last_sample(&self) -> u64 {
        self.last_sample
    }

    /// The travel, rounded \[counts, modulo 2^32\].
    pub const fn end(&self) -> i32 {
        self.end
    }
}

/// The seven intervals with amplitudes that lead over the travel to rest.
fn chain(
    travel: u64,
    intervals_ps: [u64; 7],
    period_ps: u64,
) -> Result<[Interval; 7], MotionError> {
    let period = Real::from_integer(period_ps);
    let [t1, t2, t3, t4, t5, t6, t7] = intervals_ps.map(|t| Real::from_integer(t).over(period));
    let c = Real::TWO_OVER_PI;
    // Speed gained per unit of amplitude: ∫ of a quarter sine is (2/π)·T.
    let gain = t2.plus(c.times(t1.plus(t3)));
    let loss = t6.plus(c.times(t5.plus(t7)));
    if gain.is_zero() {
        return Err(MotionError::NoAcceleration);
    }
    if loss.is_zero() {
        return Err(MotionError::NoDeceleration);
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
    let displacements = [
        sine(t1, v1),
        ramp(t2, v1, v2),
        cosine(t3, v2),
        t4,
        cosine(t5, v5),
        ramp(t6, v5, v6),
        sine(t7, v6),
    ];
    let unit = displacements.iter().fold(Real::ZERO, |sum, &u| sum.plus(u));
    let peak = Real::from_integer(travel).scaled(-32).over(unit);

    let (up, down) = (peak.over(gain), peak.over(loss).negated());
    let one = Real::ONE;
    let starts = [Real::ZERO, v1, v2, one, one, v5, v6];
    let amplitudes = [up, up, up, Real::ZERO, down, down, down];
    let courses = [
        Course::Rise,
        Course::Constant,
        Course::Fall,
        Course::Constant,
        Course::Rise,
        Course::Constant,
        Course::Fall,
    ];
    let durations = [t1, t2, t3, t4, t5, t6, t7];
    let mut number = 0_u8;
    let mut start_ps = 0_u64;
    let mut position = Real::ZERO;
    let mut rows = intervals_ps
        .into_iter()
        .zip(durations)
        .zip(displacements)
        .zip(starts)
        .zip(amplitudes)
        .zip(courses);
    Ok([(); 7].map(|()| {
        let Some((((((t_ps, duration), displacement), speed), amplitude), course)) = rows.next()
        else {
            // Seven rows for seven intervals.
            return Interval::NONE;
        };
        // Sample k lies in the interval if start ≤ k·Δt < end.
        let end_ps = start_ps.saturating_add(t_ps);
        let first_sample = sample_from(start_ps, period_ps);
        number = number.saturating_add(1);
        let interval = Interval {
            number,
            course,
            duration,
            position: position.times(peak),
            velocity: speed.times(peak),
            amplitude,
            samples: sample_from(end_ps, period_ps).saturating_sub(first_sample),
            // Below 2^62 + 2^42: no time is rounded.
            first: Real::from_integer(
                first_sample
                    .saturating_mul(period_ps)
                    .saturating_sub(start_ps),
            )
            .over(period),
        };
        start_ps = end_ps;
        position = position.plus(displacement);
        interval
    }))
}

/// The first sample at or after `time_ps`.
fn sample_from(time_ps: u64, period_ps: u64) -> u64 {
    let before = period_ps.saturating_sub(1);
    time_ps
        .saturating_add(before)
        .checked_div(period_ps)
        .unwrap_or(0)
}

/// Fraction bits that bring a peak to 2^29 to 2^30; none if it is larger.
fn output_bits(peak: Real) -> Option<i32> {
    let bits = 30_i32.saturating_sub(peak.bits());
    (bits >= 0).then_some(bits.min(OUTPUT_BITS_MAX))
}

/// Magnitude in whole units, for messages.
fn rounded(value: Real) -> u64 {
    u64::try_from(value.to_fixed(0).unsigned_abs()).unwrap_or(u64::MAX)
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

/// Half a unit of the output, below so many bits.
const fn half(bits: i32) -> i64 {
    1_i64.wrapping_shl(bits.unsigned_abs().wrapping_sub(1))
}

impl Interval {
    const NONE: Self = Self {
        number: 0,
        course: Course::Constant,
        duration: Real::ZERO,
        position: Real::ZERO,
        velocity: Real::ZERO,
        amplitude: Real::ZERO,
        samples: 0,
        first: Real::ZERO,
    };

    /// The words of an interval that has samples.
    fn piece(&self, velocity_bits: i32, acceleration_bits: i32) -> Result<Piece, MotionError> {
        if self.course == Course::Constant {
            return self.straight(velocity_bits, acceleration_bits);
        }
        // ω·τ at the first sample; its sine and cosine.
        let omega = Real::HALF_PI.over(self.duration);
        let theta = omega.times(self.first);
        let (sine, cosine) = theta.sine_cosine();
        // The speed and the displacement of the sine, S = A/ω².
        let speed = self.amplitude.over(omega);
        let swing = speed.over(omega);
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
                (self.position.plus(swing), self.velocity, cosine, velocity)
            }
        };
        let line = line_start.plus(line_speed.times(self.first));
        if self.samples == 1 {
            let acceleration = self.amplitude.times(sine);
            return Ok(Piece {
                samples: 1,
                entry: Point {
                    line: Long::from_real(line.minus(swing.times(sine))),
                    velocity: velocity_word(velocity, velocity_bits),
                    ..Point::default()
                },
                shape: Shape::Straight {
                    growth: Long::default(),
                    velocity_growth: 0,
                    acceleration: short(acceleration, acceleration_bits),
                },
            });
        }

        // The amplitude takes 2^61 to 2^62 less a margin of 1/64, into which
        // the roundings may grow.
        let grown = swing.plus(swing.scaled(-6));
        let sine_bits = 62_i32.saturating_sub(grown.bits()).min(SINE_BITS_MAX);
        let fewer = sine_bits.saturating_sub(5).clamp(0, 31).unsigned_abs();
        let samples = self.samples_up_to(1_u64.wrapping_shl(fewer))?;

        // Two samples in the interval: ω/2 < π/4 and ω·τ + ω/2 < π/2.
        let half_omega = omega.scaled(-1);
        let (half_sine, half_cosine) = half_omega.sine_cosine();
        let (later_sine, later_cosine) = theta.plus(half_omega).sine_cosine();
        let cosine_later = match self.course {
            Course::Rise | Course::Constant => later_cosine,
            Course::Fall => later_sine.negated(),
        };
        let over = |bits: i32| bits.saturating_sub(sine_bits);
        let velocity_weight = short(
            omega.over(half_cosine).scaled(-1),
            over(velocity_bits.saturating_add(62)),
        );
        let acceleration_weight = short(
            omega.times(omega),
            over(acceleration_bits.saturating_add(61)),
        );
        Ok(Piece {
            samples,
            entry: Point {
                line: Long::from_real(line),
                step: Long::from_real(line_speed),
                sine: word(swing.times(sine), sine_bits),
                cosine: word(swing.times(cosine_later), sine_bits),
                velocity: velocity_word(velocity, velocity_bits),
            },
            shape: Shape::Sine {
                turn: Turn::from_real(half_sine.scaled(1)),
                shift: u8::try_from(over(0).saturating_neg().saturating_sub_unsigned(GRID_BITS))
                    .unwrap_or(0),
                // Two floors leave out a half each, in the mean.
                velocity_centre: velocity_word(line_speed, velocity_bits)
                    .saturating_sub(i64::from(velocity_weight)),
                velocity_weight,
                acceleration_weight,
                // So does one.
                acceleration_centre: acceleration_weight
                    .wrapping_shr(1)
                    .saturating_add(short(Real::ONE, ACCELERATION_BITS.saturating_sub(1))),
            },
        })
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
    word(velocity, velocity_bits.saturating_add(VELOCITY_BITS)).saturating_add(half(VELOCITY_BITS))
}
