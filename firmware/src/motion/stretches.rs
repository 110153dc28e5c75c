//! A plan as stretches: each a cubic through four points of the exact command.

use super::interval::{Course, Interval};
use super::plan::MotionPlan;
use super::real::Real;
use crate::counts::Counts;
use crate::dac::Codes;
use crate::law::LawWords;
use crate::reference::Stretch;
use crate::word::GainWord;

/// Most samples of a stretch of a sine: three roundings to 2^−33, one of them
/// summed three times, leave `N³/6·2^−33 = 2^−5.6` counts.
const SINE_SAMPLES_MAX: u64 = 1 << 10;
/// Most samples of a stretch of a parabola: `N²/2·2^−33 = 2^−6` counts.
const PARABOLA_SAMPLES_MAX: u64 = 1 << 14;
/// Most samples of a stretch of a line: `N·2^−33 = 2^−7` counts.
const LINE_SAMPLES_MAX: u64 = 1 << 26;

/// Sixths of a stretch: the command is taken at every second of them, the
/// feed-forward at every third.
const NODES: usize = 7;

/// Gains of the feed-forward \[codes per count and sample\].
#[derive(Debug, Clone, Copy)]
struct FeedForward {
    velocity: Real,
    acceleration: Real,
    /// \[codes\].
    friction: Real,
}

/// Stretches of a plan, in their order.
#[derive(Debug, Clone)]
pub struct Stretches<'a> {
    plan: &'a MotionPlan,
    feed_forward: FeedForward,
    /// Added to every position \[counts, modulo 2^32\].
    start: i32,
    /// Intervals that have ended.
    interval: usize,
    /// Samples of the present one that have.
    sample: u64,
    /// Samples of its stretches; the last one may be shorter. 0 before the first.
    length: u64,
    /// `φ = ω·τ` of the next sample, and what turns it by a sixth of a stretch.
    phase: Phase,
    turn: Phase,
    /// Samples of the stretch that it turns through.
    turned: u64,
}

/// Sine and cosine of an angle.
#[derive(Debug, Clone, Copy)]
struct Phase {
    sine: Real,
    cosine: Real,
}

impl Phase {
    const ZERO: Self = Self {
        sine: Real::ZERO,
        cosine: Real::ONE,
    };

    fn of(angle: Real) -> Self {
        let (sine, cosine) = angle.sine_cosine();
        Self { sine, cosine }
    }

    /// The sum of two angles.
    fn turned(self, by: Self) -> Self {
        let Self { sine, cosine } = self;
        Self {
            sine: sine.times(by.cosine).plus(cosine.times(by.sine)),
            cosine: cosine.times(by.cosine).minus(sine.times(by.sine)),
        }
    }
}

impl MotionPlan {
    /// The motion from `start` on \[counts, modulo 2^32\], with the feed-forward
    /// that the words give: `Kv·v + Ka·a + Kf·sign(v)`, in the exponents of
    /// [`MotionPlan::head`], with the sign that `v` has on the way.
    pub fn stretches(&self, words: &LawWords, start: i32) -> Stretches<'_> {
        let gain = |word: GainWord, rate_bits: u8| {
            let bits = i32::from(rate_bits).wrapping_sub(i32::from(word.fraction_bits));
            Real::new(i128::from(word.mantissa), bits)
        };
        Stretches {
            plan: self,
            feed_forward: FeedForward {
                velocity: gain(words.velocity_ff, self.head.velocity_fraction_bits),
                acceleration: gain(words.acceleration_ff, self.head.acceleration_fraction_bits),
                friction: gain(words.friction_ff, 0),
            },
            start,
            interval: 0,
            sample: 0,
            length: 0,
            phase: Phase::ZERO,
            turn: Phase::ZERO,
            turned: 0,
        }
    }
}

impl Iterator for Stretches<'_> {
    type Item = Stretch;

    fn next(&mut self) -> Option<Stretch> {
        let interval = self.plan.intervals.get(self.interval)?;
        let (omega, first) = interval.first_angle();
        if self.length == 0 {
            self.length = longest(interval, &self.feed_forward);
            self.turned = 0;
            if interval.is_curved() {
                self.phase = Phase::of(first);
            }
        }
        let left = interval.samples.saturating_sub(self.sample);
        let samples = left.min(self.length);
        if samples != self.turned && interval.is_curved() {
            let sixth = Real::from_integer(samples).over(Real::from_integer(6));
            self.turn = Phase::of(omega.times(sixth));
            self.turned = samples;
        }
        let stretch = self.stretch(interval, samples);
        self.sample = self.sample.saturating_add(samples);
        if samples == left {
            self.interval = self.interval.saturating_add(1);
            (self.sample, self.length) = (0, 0);
        }
        Some(stretch)
    }
}

/// Samples of a stretch, from its error:
///
/// ```text
/// cubic through 4 points      |x⁗|·N⁴/1944 ≤ 1/8 count
/// parabola through 3 points   |f‴|·N³/124.7 ≤ 1/16 code
/// ```
///
/// with `|x⁗| ≤ A·ω²` and `|f‴| ≤ Kv·A·ω² + Ka·A·ω³`.
fn longest(interval: &Interval, ahead: &FeedForward) -> u64 {
    if interval.amplitude.is_zero() {
        return LINE_SAMPLES_MAX;
    }
    if interval.course == Course::Constant {
        return PARABOLA_SAMPLES_MAX;
    }
    let (omega, _) = interval.first_angle();
    let fourth = interval.amplitude.magnitude().times(omega).times(omega);
    let third = fourth.times(ahead.velocity.plus(ahead.acceleration.times(omega)));
    // The bounds, in whole numbers rounded down.
    let (most_counts, most_codes) = (Real::from_integer(243), Real::from_integer(7));
    let fits = |n: u64| {
        let n = Real::from_integer(n);
        let cube = n.times(n).times(n);
        fourth.times(cube).times(n).at_most(most_counts) && third.times(cube).at_most(most_codes)
    };
    // One sample needs no curve.
    let (mut longest, mut step) = (1_u64, SINE_SAMPLES_MAX >> 1);
    while step > 0 {
        if fits(longest.wrapping_add(step)) {
            longest = longest.wrapping_add(step);
        }
        step >>= 1;
    }
    longest
}

/// Command of one instant.
#[derive(Debug, Clone, Copy)]
struct Instant {
    position: Real,
    ahead: Real,
}

impl Stretches<'_> {
    fn stretch(&mut self, interval: &Interval, samples: u64) -> Stretch {
        let first = interval.first.plus(Real::from_integer(self.sample));
        let length = Real::from_integer(samples);
        let sixth = length.over(Real::from_integer(6));
        let mut at = first;
        let mut phase = self.phase;
        let nodes = [(); NODES].map(|()| {
            let instant = interval.at(at, phase, &self.feed_forward);
            (at, self.phase) = (at.plus(sixth), phase);
            phase = phase.turned(self.turn);
            instant
        });
        let [a, _, b, c, d, _, e] = nodes;
        // Differences over thirds, and over halves.
        let [x1, x2, x3] = differences([a, b, d, e].map(|node| node.position));
        let (f1, f2) = halves([a, c, e].map(|node| node.ahead));

        // In powers of a sample: x0 + c1·k + c2·k² + c3·k³.
        let third = Real::from_integer(3);
        let per_third = third.over(length);
        let c3 = x3.over(Real::from_integer(6));
        let c2 = x2.scaled(-1).minus(x3.scaled(-1));
        let c1 = x1.minus(x2.scaled(-1)).plus(x3.over(third));
        let c1 = c1.times(per_third);
        let c2 = c2.times(per_third).times(per_third);
        let c3 = c3.times(per_third).times(per_third).times(per_third);
        // f0 + d1·k + d2·k²
        let per_half = Real::from_integer(2).over(length);
        let d2 = f2.scaled(-1).times(per_half).times(per_half);
        let d1 = f1.minus(f2.scaled(-1)).times(per_half);

        let sign = self.plan.head.sign | 1;
        let moves = !interval.rests();
        let fixed = |value: Real| signed(value.to_fixed(32), sign);
        let acceleration_sign = match (interval.amplitude.is_zero(), interval.number) {
            (true, _) => 0,
            (false, ..4) => 1,
            (false, _) => -1,
        };
        let start = Stretch::resting_at(self.start).position;
        Stretch {
            // The sign comes before the rounding: half a count of it is in the start.
            position: start.wrapping_add(Counts::from_bits(fixed(a.position))),
            velocity: Counts::from_bits(fixed(c1.plus(c2).plus(c3))),
            acceleration: Counts::from_bits(fixed(
                c2.scaled(1).plus(c3.times(Real::from_integer(6))),
            )),
            jerk: Counts::from_bits(fixed(c3.times(Real::from_integer(6)))),
            ahead: Codes::from_bits(fixed(a.ahead)),
            ahead_change: Codes::from_bits(fixed(d1.plus(d2))),
            ahead_growth: Codes::from_bits(fixed(d2.scaled(1))),
            // At most 2^26.
            samples: u32::try_from(samples).unwrap_or(u32::MAX),
            velocity_sign: direction(if moves { sign } else { 0 }),
            acceleration_sign: direction(sign.wrapping_mul(acceleration_sign)),
        }
    }
}

impl Interval {
    /// Tells whether nothing moves: a motion without travel.
    fn rests(&self) -> bool {
        self.velocity.is_zero() && self.amplitude.is_zero()
    }

    /// Tells whether its acceleration is a sine.
    fn is_curved(&self) -> bool {
        self.course != Course::Constant && !self.amplitude.is_zero()
    }

    /// The command at `τ` (see [`super`], section Equations).
    fn at(&self, tau: Real, phase: Phase, gains: &FeedForward) -> Instant {
        let a = self.amplitude;
        let (position, velocity, acceleration) = if !self.is_curved() {
            let velocity = self.velocity.plus(a.times(tau));
            let mean = self.velocity.plus(velocity).scaled(-1);
            (self.position.plus(mean.times(tau)), velocity, a)
        } else {
            let (omega, _) = self.first_angle();
            let Phase { sine, cosine } = phase;
            let speed = a.over(omega);
            let width = speed.over(omega);
            if self.course == Course::Rise {
                let line = self.velocity.plus(speed);
                let position = self.position.plus(line.times(tau));
                (
                    position.minus(width.times(sine)),
                    line.minus(speed.times(cosine)),
                    a.times(sine),
                )
            } else {
                let position = self.position.plus(width).plus(self.velocity.times(tau));
                (
                    position.minus(width.times(cosine)),
                    self.velocity.plus(speed.times(sine)),
                    a.times(cosine),
                )
            }
        };
        let rates = gains
            .velocity
            .times(velocity)
            .plus(gains.acceleration.times(acceleration));
        // Kf·sign(v)
        let friction = if self.rests() {
            Real::ZERO
        } else {
            gains.friction
        };
        Instant {
            position,
            ahead: rates.plus(friction),
        }
    }
}

/// First, second and third difference.
fn differences([a, b, c, d]: [Real; 4]) -> [Real; 3] {
    let [ab, bc, cd] = [b.minus(a), c.minus(b), d.minus(c)];
    let [abc, bcd] = [bc.minus(ab), cd.minus(bc)];
    [ab, abc, bcd.minus(abc)]
}

/// First and second difference.
fn halves([a, b, c]: [Real; 3]) -> (Real, Real) {
    let [ab, bc] = [b.minus(a), c.minus(b)];
    (ab, bc.minus(ab))
}

/// A fixed-point number modulo 2^64, with the sign of the motion.
fn signed(value: i128, sign: i32) -> i64 {
    let [a, b, c, d, e, f, g, h, ..] = value.to_le_bytes();
    i64::from_le_bytes([a, b, c, d, e, f, g, h]).wrapping_mul(i64::from(sign))
}

/// A sign as a byte.
const fn direction(sign: i32) -> i8 {
    match sign {
        0 => 0,
        1.. => 1,
        _ => -1,
    }
}
