//! Acceptance: the demands of [`super::words`], computed. It can run while the
//! image is compiled, so that a constant law is accepted or refused there.

use super::Law;
use super::filter::FilterWords;
use super::term::{FRACTION_BITS, Term};
use super::words::{AntiWindup, Derivative, LARGEST_RATE, LawWords};
use crate::counts::ErrorRange;
use crate::dac::Dac;
use crate::refusal::{Refusal, What, accepted};
use crate::settings::{Settings, Words};
use crate::wide;
use crate::word::{GainWord, Part, power_of_two_or_most};

/// The terms may add up to this many codes.
const MOST_CODES: u32 = 1 << 30;

/// Words that are above 0.
const WORD: [i64; 2] = [1, wide::signed(i32::MAX)];

impl Law {
    /// Accepts words if the law with them stays within one code of the exact
    /// one over the declared ranges, and nothing can overflow ([`super::words`]).
    ///
    /// # Errors
    /// A [`Refusal`] that names the part, its word and what is allowed.
    #[inline(always)]
    pub const fn accept(words: LawWords, dac: Dac) -> Result<Self, Refusal> {
        words.check(dac)
    }
}

impl LawWords {
    /// Checks every demand of [`super::words`] for the converter `dac`. Inlined
    /// with all that it calls once: an image that drops a refusal then makes none,
    /// which is 2 KiB of flash.
    #[inline(always)]
    const fn check(&self, dac: Dac) -> Result<Law, Refusal> {
        let error_bits = self.error_bits;
        let range = accepted!(ErrorRange::from_bits(error_bits));
        accepted!(What::IntegralBits.byte_within(self.integral_bits, [0, 30]));
        let errors = range.limit().unsigned_abs();

        let least_p = error_bits.saturating_add(2);
        let kp = accepted!(self.term(Part::Proportional, self.kp, errors, least_p));
        let ki_dt = accepted!(self.term(Part::Integral, self.ki_dt, errors, 0));
        let velocity = accepted!(self.rate(Part::Velocity, self.velocity_ff));
        let acceleration = accepted!(self.rate(Part::Acceleration, self.acceleration_ff));
        let friction = accepted!(self.term(Part::Friction, self.friction_ff, 1, 5));

        // Everything but the derivative and the integral
        let code_range = codes(dac.min_code().unsigned_abs());
        let integral_range = codes(1_u32.wrapping_shl(wide::byte(self.integral_bits)));
        let feed_forward = total(&[
            velocity.largest(LARGEST_RATE),
            acceleration.largest(LARGEST_RATE),
            friction.largest(1),
        ]);
        let direct = total(&[kp.largest(errors), feed_forward]);

        // D                                        (Kd/Δt)·D ≥ the rest, ≤ 2·E
        let rest = total(&[direct, integral_range, code_range, code_range]);
        let difference_limit = accepted!(self.difference_limit(errors, rest));
        let outweighs = self.filter.is_none() && difference_limit < errors.saturating_mul(2);
        let (kd_per_dt, limit) = accepted!(self.derivative_term(difference_limit));
        let [derivative, one_step] = [kd_per_dt.largest(limit), ki_dt.largest(errors)];

        // T + R ≤ 2^30 codes
        let all = total(&[direct, derivative, one_step, code_range]);
        if all > codes(MOST_CODES) {
            let needed = wide::held(whole_codes(all));
            let allowed = [0, wide::unsigned(MOST_CODES)];
            return Err(Refusal::new(What::Terms, needed, allowed));
        }

        let error_sum_limit = self.error_sum_limit(integral_range);
        let wanted = wide::word(errors).saturating_mul(1 << 8);
        if error_sum_limit < wanted {
            let (reached, wanted) = (error_sum_limit.cast_signed(), wanted.cast_signed());
            return Err(Refusal::new(What::ErrorSum, reached, [wanted, i64::MAX]));
        }
        // (Ki·Δt)·S, which is at most Q
        let told = match ki_dt.largest(1) {
            0 => integral_range,
            one_error => one_error.saturating_mul(error_sum_limit),
        };
        // What 2^30 codes leave beside the other terms.
        let ahead_limit = codes(MOST_CODES)
            .saturating_sub(all)
            .saturating_add(feed_forward);
        let mut settings = Settings {
            error_limit_counts: errors,
            difference_limit_counts: difference_limit,
            derivative_of_measurement: match self.derivative {
                Derivative::Error => 0,
                Derivative::Measurement => 1,
            },
            difference_is_declared: if outweighs { 0 } else { 1 },
            ahead_limit_codes: wide::upper(wide::held(ahead_limit)).cast_unsigned(),
            // The first whole number of codes beyond.
            integral_range_codes: wide::upper(wide::held(told))
                .wrapping_add(1)
                .cast_unsigned(),
            dac_bits: dac.bits(),
            ..Settings::of_terms([kp, ki_dt, kd_per_dt, velocity, acceleration, friction])
        };
        if let Some(filter) = self.filter {
            settings.filter_smoothing = filter.smoothing.cast_unsigned();
            settings.filter_scale = 1_u32.wrapping_shl(wide::byte(filter.fraction_bits));
        }
        match self.anti_windup {
            AntiWindup::None => {}
            AntiWindup::Clamp => settings.anti_windup = 1,
            AntiWindup::BackCalculation { tracking } => {
                accepted!(What::Tracking.within(wide::signed(tracking), WORD));
                (settings.anti_windup, settings.tracking) = (2, tracking.cast_unsigned());
            }
        }
        Ok(Law {
            settings: Words::of(&settings),
            words: *self,
            dac,
            error_sum_limit,
            headroom_bits: all.leading_zeros().saturating_sub(1),
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
        accepted!(What::Gain(part, word).not_negative(word.mantissa));
        let fine_enough = word.mantissa == 0 || word.fraction_bits >= least;
        if !fine_enough || word.fraction_bits > FRACTION_BITS {
            return Err(fraction_bits(part, word, least));
        }
        match Term::align(word, limit) {
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
        self.term(part, word, LARGEST_RATE, 29)
    }

    /// `D`: the first difference whose term reaches `rest`, at most `2·E`, and
    /// with a filter at most 2^29.
    #[inline(always)]
    const fn difference_limit(&self, errors: u32, rest: u64) -> Result<u32, Refusal> {
        let (part, word) = (Part::Derivative, self.kd_per_dt);
        accepted!(What::Gain(part, word).not_negative(word.mantissa));
        let Some(shift) = FRACTION_BITS.checked_sub(word.fraction_bits) else {
            return Err(fraction_bits(part, word, 0));
        };
        let whole = errors.saturating_mul(2);
        let whole = match self.filter {
            Some(_) if whole > FilterWords::LARGEST_DIFFERENCE => FilterWords::LARGEST_DIFFERENCE,
            _ => whole,
        };
        // At most 2^32; a term beyond 64 bits outweighs with one count.
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
    const fn derivative_term(&self, difference_limit: u32) -> Result<(Term, u32), Refusal> {
        let (part, word) = (Part::Derivative, self.kd_per_dt);
        let Some(filter) = self.filter else {
            let term = accepted!(self.term(part, word, difference_limit, 0));
            return Ok((term, difference_limit));
        };
        accepted!(What::FilterSmoothing.within(wide::signed(filter.smoothing), WORD));
        // D·2^h ≤ 2^29, and a product no finer than the sum
        let finer = FRACTION_BITS.saturating_sub(word.fraction_bits);
        let by_range = FilterWords::most_fraction_bits(difference_limit);
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
        // |v̂| ≤ D·2^h + 1, and the filter's value never leaves its inputs' range.
        let limit = difference_limit
            .wrapping_shl(wide::byte(filter.fraction_bits))
            .saturating_add(1);
        Ok((accepted!(self.term(part, scaled, limit, 0)), limit))
    }

    /// `S`, the smaller of `2^(fi−1)` and `Q/(Ki·Δt)` \[counts\].
    const fn error_sum_limit(&self, integral_range: u64) -> u64 {
        let word = self.ki_dt;
        let by_rounding = power_of_two_or_most(wide::byte(word.fraction_bits.saturating_sub(1)));
        let shift = wide::byte(FRACTION_BITS.saturating_sub(word.fraction_bits));
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
const fn fraction_bits(part: Part, word: GainWord, least: u8) -> Refusal {
    let what = What::FractionBits(part, word);
    let allowed = [wide::bits(least), wide::bits(FRACTION_BITS)];
    Refusal::new(what, wide::bits(word.fraction_bits), allowed)
}

/// `count` codes \[2^−32 codes\].
const fn codes(count: u32) -> u64 {
    wide::word(count).wrapping_shl(32)
}

/// So many 2^−32 codes in whole codes, rounded up.
const fn whole_codes(sum: u64) -> u64 {
    sum.saturating_add(u64::MAX.wrapping_shr(32))
        .wrapping_shr(32)
}

/// The sum of all, or the largest number where 64 bits do not hold it.
const fn total(mut parts: &[u64]) -> u64 {
    let mut sum = 0_u64;
    while let [part, rest @ ..] = parts {
        sum = sum.saturating_add(*part);
        parts = rest;
    }
    sum
}
