//! A motion planned in place: its chain of intervals, and its stretches one by one.

use super::equations::{
    BEGIN, BOUNDS, C, CHAIN, COMMAND, CONSTANTS, DIFFERENCES, DIVIDE, ENTER, F0, FALL, FITS,
    FOURTH, GAIN, INTERVAL, K, KV, LARGEST, LEFT, LENGTH, LIMIT, LOSS, N, N0, ONLY, PEAK, PERIOD,
    RISE, S, SERIES, SLOPE, T, T1, TERMS, TURN,
};
use super::numbers::Numbers;
use super::real::Real;
use crate::reference::Stretch;
use crate::refusal::{Refusal, What};
use crate::wide::{held, joined, lower, upper};
use crate::word::GainWord;

/// Fraction bits of velocity and acceleration at most.
const OUTPUT_BITS_MAX: i32 = 60;
/// The intervals together last at most this long \[ps\].
const DURATION_MAX_PS: u64 = 1 << 62;

/// Peaks of velocity and acceleration \[counts per sample, per sample²\].
const PEAKS: [i64; 2] = [0, (1 << PEAK_BITS) - 1];

/// Bits of those peaks: setpoints' rates stay below
/// [`crate::law::words::LARGEST_RATE`].
const PEAK_BITS: u8 = 24;
const _: () = assert!(1 << PEAK_BITS == crate::law::words::LARGEST_RATE);

/// 2/π·2^63; its reciprocal is π/2 to 2^−63.
const TWO_OVER_PI: u64 = 5_871_781_006_564_002_453;

/// Most samples of a stretch of a sine: three roundings to 2^−33, one of them
/// summed three times, leave `N³/6·2^−33 = 2^−5.6` counts.
const SINE_SAMPLES_MAX: u32 = 1 << 10;
/// Most samples of a stretch of a parabola: `N²/2·2^−33 = 2^−6` counts.
const PARABOLA_SAMPLES_MAX: u32 = 1 << 14;
/// Most samples of a stretch of a line: `N·2^−33 = 2^−7` counts.
const LINE_SAMPLES_MAX: u32 = 1 << 26;

/// What is known of a motion besides its stretches; the default is no motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlanHead {
    /// −1 where the travel is negative, otherwise 0.
    pub sign: i32,
    /// The end of the motion, `floor(h + ½)` \[counts, modulo 2^32\].
    pub end: i32,
    /// Number of the sample at which the motion has ended; the first is 0.
    pub last_sample: u64,
    /// Fraction bits of the setpoints' velocities, 0 to 60.
    pub velocity_fraction_bits: u8,
    /// Fraction bits of the setpoints' accelerations, 0 to 60.
    pub acceleration_fraction_bits: u8,
}

/// Plans a motion and gives its stretches, in 2.3 KiB of memory.
///
/// ```
/// use firmware::GainWord;
/// use firmware::motion::Planner;
///
/// // 1000 counts up in 40 ms and to rest in 40 ms, a sample every 20 ms.
/// let mut planner = Planner::NONE;
/// planner.plan(1_000 << 32, &[0, 40_000_000_000, 0, 0, 0, 40_000_000_000, 0], 20_000_000)?;
/// planner.begin([GainWord::new(0, 0); 3], 0);
/// let mut words = [0; 16];
/// assert!(planner.next(&mut words) && planner.next(&mut words));
/// assert!(!planner.next(&mut words));
/// assert_eq!(planner.head().end, 1_000);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[repr(C)]
pub struct Planner {
    /// Samples of the intervals, and of all of them.
    samples: [u64; 7],
    last_sample: u64,
    /// Samples of the present interval that are left, and intervals that have begun.
    left: u64,
    interval: u8,
    /// Fraction bits of velocity, acceleration and friction.
    fraction_bits: [i32; 3],
    /// Sign of the motion: −1, 0 or 1.
    direction: i32,
    /// The end of the motion, and what is added to every position \[counts, modulo 2^32\].
    end: i32,
    start: i32,
    /// Samples of the interval's stretches; the last one may be shorter.
    length: u32,
    /// Samples of the stretch whose sixth a node is turned by.
    turned: u32,
    /// For the travel's magnitude.
    numbers: Numbers,
}

impl Planner {
    /// No motion: it ends where it starts.
    pub const NONE: Self = Self {
        samples: [0; 7],
        last_sample: 0,
        left: 0,
        interval: 0,
        fraction_bits: [0; 3],
        direction: 0,
        end: 0,
        start: 0,
        length: 0,
        turned: 0,
        numbers: Numbers::ZEROS,
    };

    /// What is known of the motion besides its stretches.
    pub const fn head(&self) -> PlanHead {
        let [velocity, acceleration, _] = self.fraction_bits;
        PlanHead {
            sign: self.direction.wrapping_shr(31),
            end: self.end,
            last_sample: self.last_sample,
            velocity_fraction_bits: lowest_byte(velocity),
            acceleration_fraction_bits: lowest_byte(acceleration),
        }
    }

    /// The end of the motion, `floor(h + ½)` \[counts, modulo 2^32\].
    pub const fn end(&self) -> i32 {
        self.end
    }

    /// Plans the motion of [`super::MotionPlan::new`] in a planner that has none.
    ///
    /// # Errors
    /// Those of [`super::MotionPlan::new`].
    pub fn plan(
        &mut self,
        travel: i64,
        intervals_ps: &[u64; 7],
        period_ns: u32,
    ) -> Result<(), Refusal> {
        What::Period.word_within(period_ns, [1, u32::MAX])?;
        What::Travel.within(travel, [i64::MIN.saturating_add(1), i64::MAX])?;
        let numbers = &mut self.numbers;
        // Below 2^42.
        numbers.set(PERIOD, u64::from(period_ns).wrapping_mul(1_000));
        numbers.set(LIMIT, DURATION_MAX_PS);
        numbers.set(C, TWO_OVER_PI);
        numbers.make(CONSTANTS);
        numbers.base = T1;
        for (t_ps, samples) in intervals_ps.iter().zip(&mut self.samples) {
            numbers.set(T, *t_ps);
            numbers.set(N, self.last_sample);
            numbers.make(DIVIDE);
            if numbers.at(LEFT).is_negative() {
                let total = intervals_ps.iter();
                let total_ps = total.fold(0_u64, |sum, &t_ps| sum.saturating_add(t_ps));
                let allowed = [0, held(DURATION_MAX_PS)];
                return Err(Refusal::new(What::Duration, held(total_ps), allowed));
            }
            let end = numbers.at(S).fixed(0).cast_unsigned();
            *samples = end.wrapping_sub(self.last_sample);
            self.last_sample = end;
            numbers.base = numbers.base.wrapping_add(INTERVAL);
        }
        // In units of 2^−32 counts so far.
        numbers.set(PEAK, travel.unsigned_abs()).scale(-32);
        numbers.make(CHAIN);
        let refused = |what| Err(Refusal::new(what, 0, [1, i64::MAX]));
        if numbers.at(GAIN).is_zero() {
            return refused(What::Rise);
        }
        if numbers.at(LOSS).is_zero() {
            return refused(What::Fall);
        }

        self.direction = lower(travel.signum());
        self.end = upper(travel.wrapping_add(1 << 31));
        let peak = numbers.at(PEAK);
        let refused = || Refusal::new(What::Velocity, peak.rounded(), PEAKS);
        let velocity_bits = output_bits(peak).ok_or_else(refused)?;
        let mut least = OUTPUT_BITS_MAX;
        for (interval, samples) in (0..).zip(&self.samples) {
            if *samples > 0 {
                enter(numbers, interval);
                // One sample may be all of an interval so short that its peak is never seen.
                numbers.make(if *samples == 1 { ONLY } else { LARGEST });
                let peak = numbers.at(S);
                let what = What::Acceleration(interval.wrapping_add(1));
                let refused = || Refusal::new(what, peak.rounded(), PEAKS);
                least = output_bits(peak).ok_or_else(refused)?.min(least);
            }
        }
        self.fraction_bits = [velocity_bits.min(OUTPUT_BITS_MAX), least, 0];
        Ok(())
    }

    /// Goes to the first stretch, with positions from `start` on \[counts, modulo 2^32\]
    /// and the feed-forward `Kv·v + Ka·a + Kf·sign(v)`, whose gains these are, in the
    /// exponents of [`Planner::head`].
    pub fn begin(&mut self, gains: impl IntoIterator<Item = GainWord>, start: i32) {
        for ((place, bits), gain) in (KV..).zip(&self.fraction_bits).zip(gains) {
            let bits = bits.wrapping_sub(gain.fraction_bits.into());
            let there = self.numbers.set(place, gain.mantissa.unsigned_abs().into());
            there.scale(bits).sign(gain.mantissa < 0);
        }
        self.start = start;
        (self.interval, self.left) = (0, 0);
    }

    /// Gives the words of the next stretch ([`Stretch::from_words`]); tells whether there
    /// is one.
    pub fn next(&mut self, words: &mut [i32; Stretch::WORDS]) -> bool {
        let numbers = &mut self.numbers;
        while self.left == 0 {
            let Some(samples) = self.samples.get(usize::from(self.interval)) else {
                return false;
            };
            self.left = *samples;
            enter(numbers, self.interval);
            self.length = longest(numbers);
            self.turned = 0;
            self.interval = self.interval.wrapping_add(1);
        }
        let samples = u32::try_from(self.left).unwrap_or(u32::MAX);
        let samples = samples.min(self.length);
        self.left = self.left.wrapping_sub(samples.into());
        numbers.set(LENGTH, samples.into());
        numbers.make(BEGIN);
        if samples != self.turned {
            self.turned = samples;
            turn(numbers);
        }
        // Seven: the command is taken at every second, the feed-forward at every third.
        for node in N0..F0 {
            if node > N0 {
                numbers.make(TURN);
            }
            numbers.base = node;
            numbers.make(COMMAND);
        }
        numbers.make(DIFFERENCES);

        let [fixed @ .., length, signs] = words;
        // The sign comes before the rounding: half a count of it is in the start.
        let mut start = joined(self.start, i32::MIN);
        let (pairs, _) = fixed.as_chunks_mut();
        for ([low, high], place) in pairs.iter_mut().zip(N0..) {
            let value = numbers.at(place).fixed(32);
            let value = value.wrapping_mul(self.direction.into());
            let value = value.wrapping_add(core::mem::take(&mut start));
            (*low, *high) = (lower(value), upper(value));
        }
        *length = samples.cast_signed();
        // The fourth interval has no acceleration, those behind it the other.
        let flank = 4_i32.wrapping_sub(self.interval.into()).signum();
        let flank = flank.wrapping_mul(self.direction);
        *signs = (self.direction & 0xff) | (flank & 0xff).wrapping_shl(8);
        true
    }
}

/// Enters one of the intervals, 0 to 6, at its first sample.
#[inline(never)]
fn enter(numbers: &mut Numbers, interval: u8) {
    numbers.base = interval.wrapping_mul(INTERVAL).wrapping_add(T1);
    numbers.make(ENTER);
    turn(numbers);
    // Those that are no sine are 0 times one.
    numbers.make(if interval & 3 == 2 { FALL } else { RISE });
}

/// Makes sine and cosine of `0 ≤ θ ≤ π/2` to 2^−60; a little beyond, where a curve has
/// its last point, as well. The first term left out is below (π/2)^28/28! < 2^−79.
#[inline(never)]
fn turn(numbers: &mut Numbers) {
    numbers.make(SERIES);
    for _ in 0..13 {
        numbers.make(TERMS);
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
fn longest(numbers: &mut Numbers) -> u32 {
    if numbers.at(FOURTH).is_zero() {
        return if numbers.at(SLOPE).is_zero() {
            LINE_SAMPLES_MAX
        } else {
            PARABOLA_SAMPLES_MAX
        };
    }
    numbers.at(FOURTH).sign(false);
    numbers.make(BOUNDS);
    // One sample needs no curve.
    let (mut longest, mut step) = (1_u32, SINE_SAMPLES_MAX >> 1);
    while step > 0 {
        numbers.set(N, longest.wrapping_add(step).into());
        numbers.make(FITS);
        if !numbers.at(S).is_negative() && !numbers.at(K).is_negative() {
            longest = longest.wrapping_add(step);
        }
        step >>= 1;
    }
    longest
}

/// Fraction bits that bring a peak to 2^23 to 2^24, however many; none if it is larger.
fn output_bits(peak: &Real) -> Option<i32> {
    let bits = i32::from(PEAK_BITS).wrapping_sub(peak.bits());
    (bits >= 0).then_some(bits)
}

/// 0 to 60 as a byte.
const fn lowest_byte(bits: i32) -> u8 {
    let [lowest, ..] = bits.to_le_bytes();
    lowest
}

#[cfg(test)]
mod tests {
    use super::super::equations::{COSINE, HALF_PI, ONE, SINE, SIX, THETA, THREE, TWO};
    use super::*;

    fn begun() -> Numbers {
        let mut planner = Planner::NONE;
        planner.plan(0, &[1; 7], 1).unwrap();
        planner.numbers
    }

    fn fixed(numbers: &mut Numbers, place: u8, fraction_bits: i32) -> i64 {
        numbers.at(place).fixed(fraction_bits)
    }

    #[test]
    fn the_constants_belong_together() {
        let mut numbers = begun();
        let whole = [ONE, TWO, THREE, SIX].map(|place| fixed(&mut numbers, place, 0));
        assert_eq!(whole, [1, 2, 3, 6]);
        // π·2^61 and 2^64/π, from the digits of π.
        assert_eq!(fixed(&mut numbers, HALF_PI, 62), 7_244_019_458_077_122_842);
        assert_eq!(fixed(&mut numbers, C, 30), 683_565_276);
    }

    #[test]
    fn sine_and_cosine_lie_on_the_circle_and_meet_at_the_ends() {
        let mut numbers = begun();
        let quarter = 7_244_019_458_077_122_842_u64;
        let mut at = |angle: u64| {
            numbers.set(THETA, angle).scale(-62);
            turn(&mut numbers);
            [SINE, COSINE].map(|place| fixed(&mut numbers, place, 62))
        };
        for k in 0..=64 {
            let angle = (quarter >> 6) * k;
            let [sine, cosine] = at(angle);
            let square = |x: i64| i128::from(x) * i128::from(x);
            let off = square(sine) + square(cosine) - (1 << 124);
            assert!(off.abs() <= 1 << (124 - 58), "node {k}: {off}");
            let [mirrored, _] = at(quarter - angle);
            assert!(mirrored.abs_diff(cosine) <= 1 << 3, "node {k}");
        }
        // sin(π/6) = 1/2 tells the circle's points apart.
        let [sine, _] = at(2_414_673_152_692_374_281);
        assert!(sine.abs_diff(1 << 61) <= 4);
    }
}
