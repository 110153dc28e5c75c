//! Acceptance: the demands of [`super::words`], computed.

use super::error::{LawError, Part};
use super::filter::FilterWords;
use super::term::Term;
use super::words::{AntiWindup, LARGEST_RATE, LawWords};
use crate::counts::ErrorRange;
use crate::dac::Dac;
use crate::word::GainWord;

/// What acceptance computed, aligned to the sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Aligned {
    pub(super) range: ErrorRange,
    pub(super) proportional: Term,
    pub(super) integral: Term,
    pub(super) derivative: Term,
    pub(super) velocity: Term,
    pub(super) acceleration: Term,
    /// \[2^−F codes\].
    pub(super) friction: i64,
    /// `D` \[counts\].
    pub(super) slope_limit: i32,
    /// `Q` \[2^−F codes\].
    pub(super) integral_limit: i64,
    /// `S` \[counts\].
    pub(super) error_sum_limit: u64,
    /// Bits left above the largest sum.
    pub(super) headroom_bits: u32,
}

/// Bits of a 64-bit word that the largest sum leaves: it takes 62.
const BITS_ABOVE_SUM: u32 = 2;

impl LawWords {
    /// Checks every demand of [`super::words`] for the converter `dac`.
    pub(super) fn check(&self, dac: Dac) -> Result<Aligned, LawError> {
        let f = self.sum_fraction_bits;
        if !Self::SUM_FRACTION_BITS.contains(&f) {
            return Err(LawError::SumFractionBits(f));
        }
        let error_bits = self.error_bits;
        let range = ErrorRange::from_bits(error_bits).ok_or(LawError::ErrorRange { error_bits })?;
        let errors = range.limit().unsigned_abs();

        let least_p = error_bits.saturating_add(2);
        let proportional = self.term(Part::Proportional, self.kp, errors, least_p)?;
        let integral = self.term(Part::Integral, self.ki_dt, errors, 0)?;
        let velocity = self.rate(Part::Velocity, self.velocity_ff)?;
        let acceleration = self.rate(Part::Acceleration, self.acceleration_ff)?;
        let friction = self.term(Part::Friction, self.friction_ff, 1, 5)?;

        // Everything but the derivative and the integral  [2^−F codes]
        let too_wide = || LawError::SumTooWide {
            sum_fraction_bits: f,
        };
        let codes = |bits: u32| 2_u64.checked_pow(bits.checked_add(u32::from(f))?);
        let total = |parts: &[u64]| {
            parts
                .iter()
                .try_fold(0_u64, |sum, part| sum.checked_add(*part))
        };
        let code_range = u64::from(dac.min_code().unsigned_abs())
            .checked_mul(codes(0).ok_or_else(too_wide)?)
            .ok_or_else(too_wide)?;
        let integral_range = codes(u32::from(self.integral_bits)).ok_or_else(too_wide)?;
        let direct = [
            proportional.largest(),
            velocity.largest(),
            acceleration.largest(),
            friction.largest(),
        ];
        let direct = total(&direct).ok_or_else(too_wide)?;

        // D                                        (Kd/Δt)·D ≥ the rest, ≤ 2·E
        let rest = total(&[direct, integral_range, code_range, code_range]);
        let rest = rest.ok_or_else(too_wide)?;
        let slope_limit = self.slope_limit(errors, rest)?;
        let derivative = self.derivative_term(slope_limit)?;

        let all = [
            direct,
            derivative.largest(),
            integral_range.checked_mul(3).ok_or_else(too_wide)?,
            code_range.checked_mul(3).ok_or_else(too_wide)?,
        ];
        let largest = total(&all).ok_or_else(too_wide)?;
        let headroom_bits = largest.leading_zeros().checked_sub(BITS_ABOVE_SUM);
        let headroom_bits = headroom_bits.ok_or_else(too_wide)?;

        let error_sum_limit = self.error_sum_limit(integral_range, f);
        let wanted = u64::from(errors).saturating_mul(1 << 8);
        if error_sum_limit < wanted {
            return Err(LawError::ErrorSumRange {
                reached: error_sum_limit,
                wanted,
            });
        }
        if let AntiWindup::BackCalculation { tracking } = self.anti_windup
            && tracking < 1
        {
            return Err(LawError::Tracking(tracking));
        }
        Ok(Aligned {
            range,
            proportional,
            integral,
            derivative,
            velocity,
            acceleration,
            friction: friction.times(1),
            slope_limit: slope_limit.cast_signed(),
            integral_limit: integral_range.cast_signed(),
            error_sum_limit,
            headroom_bits,
        })
    }

    fn term(&self, part: Part, word: GainWord, limit: u32, least: u8) -> Result<Term, LawError> {
        let most = self.sum_fraction_bits;
        if word.mantissa < 0 {
            return Err(LawError::Negative { part, word });
        }
        let fine_enough = word.mantissa == 0 || word.fraction_bits >= least;
        if !fine_enough || word.fraction_bits > most {
            return Err(LawError::FractionBits {
                part,
                word,
                least,
                most,
            });
        }
        Term::align(word, most, limit).ok_or(LawError::TermTooWide { part, word, limit })
    }

    fn rate(&self, part: Part, word: GainWord) -> Result<Term, LawError> {
        self.term(part, word, LARGEST_RATE, 35)
    }

    /// `D`: the first difference whose term reaches `rest`, at most `2·E`, and
    /// with a filter at most 2^29.
    fn slope_limit(&self, errors: u32, rest: u64) -> Result<u32, LawError> {
        let (part, word) = (Part::Derivative, self.kd_per_dt);
        if word.mantissa < 0 {
            return Err(LawError::Negative { part, word });
        }
        let most = self.sum_fraction_bits;
        let shift = most.checked_sub(word.fraction_bits);
        let shift = shift.ok_or(LawError::FractionBits {
            part,
            word,
            least: 0,
            most,
        })?;
        let whole = match self.filter {
            Some(_) => errors
                .saturating_mul(2)
                .min(FilterWords::LARGEST_DIFFERENCE),
            None => errors.saturating_mul(2),
        };
        let one_count = 2_u64
            .checked_pow(u32::from(shift))
            .and_then(|unit| unit.checked_mul(u64::from(word.mantissa.unsigned_abs())));
        let counts = match one_count {
            Some(0) => whole,
            Some(one_count) => {
                let first = rest
                    .saturating_sub(1)
                    .checked_div(one_count)
                    .unwrap_or(0)
                    .saturating_add(1);
                u32::try_from(first).map_or(whole, |first| first.min(whole))
            }
            None => 1,
        };
        // D·2^−(fd+1) ≤ ½
        let coarse = word.mantissa != 0
            && u64::from(counts) > 2_u64.saturating_pow(u32::from(word.fraction_bits));
        if coarse {
            return Err(LawError::DerivativeTooCoarse { word, counts });
        }
        Ok(counts)
    }

    /// The derivative's term: of counts, or of filtered counts.
    fn derivative_term(&self, slope_limit: u32) -> Result<Term, LawError> {
        let (part, word) = (Part::Derivative, self.kd_per_dt);
        let Some(filter) = self.filter else {
            return self.term(part, word, slope_limit, 0);
        };
        if filter.smoothing < 1 {
            return Err(LawError::FilterSmoothing(filter.smoothing));
        }
        // X·2^h ≤ 2^29, and a product no finer than the sum
        let finer = self.sum_fraction_bits.saturating_sub(word.fraction_bits);
        let most = FilterWords::most_fraction_bits(slope_limit).min(finer);
        // (Kd/Δt)·2^−h ≤ 1/16, that is w·2^4 ≤ 2^(fd+h)
        let gain = i64::from(word.mantissa).saturating_mul(16);
        let bits = u32::from(word.fraction_bits).saturating_add(u32::from(filter.fraction_bits));
        if filter.fraction_bits > most || gain > 2_i64.saturating_pow(bits) {
            let needed = 64_u32
                .saturating_sub(gain.saturating_sub(1).max(0).leading_zeros())
                .saturating_sub(u32::from(word.fraction_bits));
            return Err(LawError::FilterFractionBits {
                fraction_bits: filter.fraction_bits,
                needed,
                most,
            });
        }
        let scaled = GainWord {
            fraction_bits: word.fraction_bits.saturating_add(filter.fraction_bits),
            ..word
        };
        // |v̂| ≤ X·2^h + 1, and the filter's value never leaves its inputs' range.
        let limit = slope_limit
            .saturating_mul(2_u32.saturating_pow(u32::from(filter.fraction_bits)))
            .saturating_add(1);
        self.term(part, scaled, limit, 0)
    }

    /// `S`, the smaller of `2^(fi−1)` and `Q/(Ki·Δt)` \[counts\].
    fn error_sum_limit(&self, integral_range: u64, f: u8) -> u64 {
        let word = self.ki_dt;
        let by_rounding = 2_u64.saturating_pow(u32::from(word.fraction_bits.saturating_sub(1)));
        let shift = u32::from(f.saturating_sub(word.fraction_bits));
        let one_error =
            u64::from(word.mantissa.unsigned_abs()).saturating_mul(2_u64.saturating_pow(shift));
        match integral_range.checked_div(one_error) {
            Some(by_range) => by_range.min(by_rounding),
            // Without an integral term any sum will do.
            None => u64::MAX,
        }
    }
}
