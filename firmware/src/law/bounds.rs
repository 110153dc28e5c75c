//! Acceptance: the demands of [`super::words`], computed. It can run while the
//! image is compiled, so that a constant law is accepted or refused there.

use super::filter::FilterWords;
use super::term::Term;
use super::words::{AntiWindup, LARGEST_RATE, LawWords};
use crate::counts::ErrorRange;
use crate::dac::Dac;
use crate::refusal::{Refusal, What, accepted};
use crate::wide;
use crate::word::{GainWord, Part, power_of_two, power_of_two_or_most};

/// Results of acceptance, aligned to the sum. In this order in memory: what
/// every sample needs comes first, where the smallest processors reach it with
/// one instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub(super) struct Aligned {
    pub(super) range: ErrorRange,
    /// `D` \[counts\].
    pub(super) slope_limit: i32,
    pub(super) proportional: Term,
    pub(super) integral: Term,
    pub(super) derivative: Term,
    /// `Q` \[2^−F codes\].
    pub(super) integral_limit: i64,
    /// \[2^−F codes\].
    pub(super) friction: i64,
    pub(super) velocity: Term,
    pub(super) acceleration: Term,
    /// Largest magnitudes \[2^−F codes\].
    pub(super) largest: Largest,
    /// `S` \[counts\].
    pub(super) error_sum_limit: u64,
    /// Bits left above the largest sum.
    pub(super) headroom_bits: u32,
}

/// Largest magnitudes of the terms over the declared ranges \[2^−F codes\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Largest {
    pub(super) proportional: u64,
    pub(super) integral: u64,
    pub(super) derivative: u64,
    pub(super) velocity: u64,
    pub(super) acceleration: u64,
}

/// Bits of a 64-bit word that the largest sum leaves: it takes 62.
const BITS_ABOVE_SUM: u32 = 2;

/// Words that are above 0.
const WORD: [i64; 2] = [1, wide::signed(i32::MAX)];

impl LawWords {
    /// Checks every demand of [`super::words`] for the converter `dac`. Inlined
    /// with all that it calls once: an image that drops a refusal then makes none,
    /// which is 2 KiB of flash.
    #[inline(always)]
    pub(super) const fn check(&self, dac: Dac) -> Result<Aligned, Refusal> {
        let f = self.sum_fraction_bits;
        let supported = Self::SUM_FRACTION_BITS;
        let supported = [*supported.start(), *supported.end()];
        accepted!(What::SumFractionBits.byte_within(f, supported));
        let error_bits = self.error_bits;
        let range = accepted!(ErrorRange::from_bits(error_bits));
        let errors = range.limit().unsigned_abs();

        let least_p = error_bits.saturating_add(2);
        let proportional = accepted!(self.term(Part::Proportional, self.kp, errors, least_p));
        let integral = accepted!(self.term(Part::Integral, self.ki_dt, errors, 0));
        let velocity = accepted!(self.rate(Part::Velocity, self.velocity_ff));
        let acceleration = accepted!(self.rate(Part::Acceleration, self.acceleration_ff));
        let friction = accepted!(self.term(Part::Friction, self.friction_ff, 1, 5));

        // Everything but the derivative and the integral  [2^−F codes]
        let bits = wide::bits(f);
        let too_wide = Refusal::new(What::Terms, bits, [0, bits.saturating_sub(1)]);
        let code_range = codes(dac.min_code().unsigned_abs(), f);
        let integral_range = match 1_u32.checked_shl(wide::byte(self.integral_bits)) {
            Some(whole) => codes(whole, f),
            None => None,
        };
        let mut largest = Largest {
            proportional: proportional.largest(errors),
            integral: integral.largest(errors),
            derivative: 0,
            velocity: velocity.largest(LARGEST_RATE),
            acceleration: acceleration.largest(LARGEST_RATE),
        };
        let direct = total(&[
            largest.proportional,
            largest.velocity,
            largest.acceleration,
            friction.largest(1),
        ]);
        let (Some(code_range), Some(integral_range), Some(direct)) =
            (code_range, integral_range, direct)
        else {
            return Err(too_wide);
        };

        // D                                        (Kd/Δt)·D ≥ the rest, ≤ 2·E
        let Some(rest) = total(&[direct, integral_range, code_range, code_range]) else {
            return Err(too_wide);
        };
        let slope_limit = accepted!(self.slope_limit(errors, rest));
        let (derivative, limit) = accepted!(self.derivative_term(slope_limit));
        largest.derivative = derivative.largest(limit);

        let all = [
            direct,
            largest.derivative,
            // No sum that these belong to saturates and still fits.
            integral_range.saturating_mul(3),
            code_range.saturating_mul(3),
        ];
        let headroom_bits = match total(&all) {
            Some(sum) => sum.leading_zeros().checked_sub(BITS_ABOVE_SUM),
            None => None,
        };
        let Some(headroom_bits) = headroom_bits else {
            return Err(too_wide);
        };

        let error_sum_limit = self.error_sum_limit(integral_range, f);
        let wanted = wide::word(errors).saturating_mul(1 << 8);
        if error_sum_limit < wanted {
            let (reached, wanted) = (error_sum_limit.cast_signed(), wanted.cast_signed());
            return Err(Refusal::new(What::ErrorSum, reached, [wanted, i64::MAX]));
        }
        if let AntiWindup::BackCalculation { tracking } = self.anti_windup {
            accepted!(What::Tracking.within(wide::signed(tracking), WORD));
        }
        Ok(Aligned {
            range,
            proportional,
            integral,
            derivative,
            velocity,
            acceleration,
            // Of the integer 1.
            friction: friction.largest(1).cast_signed(),
            slope_limit: slope_limit.cast_signed(),
            integral_limit: integral_range.cast_signed(),
            largest,
            error_sum_limit,
            headroom_bits,
        })
    }

    /// A function for all six gains: the compiler made one for each constant
    /// `limit`, 640 bytes of flash on Cortex-M0.
    #[inline(never)]
    const fn term(
        &self,
        part: Part,
        word: GainWord,
        limit: u32,
        least: u8,
    ) -> Result<Term, Refusal> {
        let most = self.sum_fraction_bits;
        accepted!(What::Gain(part, word).not_negative(word.mantissa));
        let fine_enough = word.mantissa == 0 || word.fraction_bits >= least;
        if !fine_enough || word.fraction_bits > most {
            return Err(fraction_bits(part, word, [least, most]));
        }
        match Term::align(word, most, limit) {
            Some(term) => Ok(term),
            None => {
                let value = wide::unsigned(limit);
                Err(Refusal::new(
                    What::Term(part, word),
                    value,
                    [0, value.saturating_sub(1)],
                ))
            }
        }
    }

    #[inline(always)]
    const fn rate(&self, part: Part, word: GainWord) -> Result<Term, Refusal> {
        self.term(part, word, LARGEST_RATE, 35)
    }

    /// `D`: the first difference whose term reaches `rest`, at most `2·E`, and
    /// with a filter at most 2^29.
    #[inline(always)]
    const fn slope_limit(&self, errors: u32, rest: u64) -> Result<u32, Refusal> {
        let (part, word) = (Part::Derivative, self.kd_per_dt);
        accepted!(What::Gain(part, word).not_negative(word.mantissa));
        let most = self.sum_fraction_bits;
        let Some(shift) = most.checked_sub(word.fraction_bits) else {
            return Err(fraction_bits(part, word, [0, most]));
        };
        let whole = errors.saturating_mul(2);
        let whole = match self.filter {
            Some(_) if whole > FilterWords::LARGEST_DIFFERENCE => FilterWords::LARGEST_DIFFERENCE,
            _ => whole,
        };
        // At most 2^40; a term beyond 64 bits outweighs with one count.
        let unit = power_of_two_or_most(wide::byte(shift));
        let counts = match unit.checked_mul(wide::word(word.mantissa.unsigned_abs())) {
            Some(one_count) => match rest.saturating_sub(1).checked_div(one_count) {
                Some(before) => match wide::narrowed(before.saturating_add(1)) {
                    Some(first) if first < whole => first,
                    _ => whole,
                },
                // Without a gain no difference outweighs anything.
                None => whole,
            },
            None => 1,
        };
        // D·2^−(fd+1) ≤ ½
        let most = power_of_two_or_most(wide::byte(word.fraction_bits));
        if word.mantissa != 0 && wide::word(counts) > most {
            let (value, most) = (wide::unsigned(counts), most.cast_signed());
            return Err(Refusal::new(What::Difference(word), value, [0, most]));
        }
        Ok(counts)
    }

    /// The derivative's term, of counts or of filtered counts, and the largest
    /// number of them.
    #[inline(always)]
    const fn derivative_term(&self, slope_limit: u32) -> Result<(Term, u32), Refusal> {
        let (part, word) = (Part::Derivative, self.kd_per_dt);
        let Some(filter) = self.filter else {
            let term = accepted!(self.term(part, word, slope_limit, 0));
            return Ok((term, slope_limit));
        };
        accepted!(What::FilterSmoothing.within(wide::signed(filter.smoothing), WORD));
        // X·2^h ≤ 2^29, and a product no finer than the sum
        let finer = self.sum_fraction_bits.saturating_sub(word.fraction_bits);
        let by_range = FilterWords::most_fraction_bits(slope_limit);
        let most = if finer < by_range { finer } else { by_range };
        // (Kd/Δt)·2^−h ≤ 1/16, that is w·2^4 ≤ 2^(fd+h); no gain is negative here
        let gain = wide::word(word.mantissa.unsigned_abs()).saturating_mul(16);
        let bits = wide::byte(word.fraction_bits).saturating_add(wide::byte(filter.fraction_bits));
        if filter.fraction_bits > most || gain > power_of_two_or_most(bits) {
            let needed = 64_u32
                .saturating_sub(gain.saturating_sub(1).leading_zeros())
                .saturating_sub(wide::byte(word.fraction_bits));
            let allowed = [wide::unsigned(needed), wide::bits(most)];
            let value = wide::bits(filter.fraction_bits);
            return Err(Refusal::new(What::FilterFractionBits, value, allowed));
        }
        let scaled = GainWord {
            fraction_bits: word.fraction_bits.saturating_add(filter.fraction_bits),
            ..word
        };
        // |v̂| ≤ X·2^h + 1, and the filter's value never leaves its inputs' range.
        let limit = slope_limit
            .wrapping_shl(wide::byte(filter.fraction_bits))
            .saturating_add(1);
        Ok((accepted!(self.term(part, scaled, limit, 0)), limit))
    }

    /// `S`, the smaller of `2^(fi−1)` and `Q/(Ki·Δt)` \[counts\].
    const fn error_sum_limit(&self, integral_range: u64, f: u8) -> u64 {
        let word = self.ki_dt;
        let by_rounding = power_of_two_or_most(wide::byte(word.fraction_bits.saturating_sub(1)));
        let shift = wide::byte(f.saturating_sub(word.fraction_bits));
        let one_error =
            wide::word(word.mantissa.unsigned_abs()).saturating_mul(power_of_two_or_most(shift));
        match integral_range.checked_div(one_error) {
            Some(by_range) if by_range < by_rounding => by_range,
            Some(_) => by_rounding,
            // Without an integral term any sum will do.
            None => u64::MAX,
        }
    }
}

/// The refusal of a word for its fraction bits.
const fn fraction_bits(part: Part, word: GainWord, [least, most]: [u8; 2]) -> Refusal {
    let what = What::LawFractionBits(part, word);
    let allowed = [wide::bits(least), wide::bits(most)];
    Refusal::new(what, wide::bits(word.fraction_bits), allowed)
}

/// `count` codes \[2^−F codes\], where 64 bits hold them.
const fn codes(count: u32, f: u8) -> Option<u64> {
    match power_of_two(wide::byte(f)) {
        Some(one) => one.checked_mul(wide::word(count)),
        None => None,
    }
}

/// The sum of all, where 64 bits hold it.
const fn total(mut parts: &[u64]) -> Option<u64> {
    let mut sum = 0_u64;
    while let [part, rest @ ..] = parts {
        sum = match sum.checked_add(*part) {
            Some(sum) => sum,
            None => return None,
        };
        parts = rest;
    }
    Some(sum)
}
