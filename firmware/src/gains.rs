//! Words that are accepted as gains, and why they keep the law to one code.
//!
//! The words of `Kp`, `Ki·Δt` and `Kd/Δt` (eq. 23 at sample time `Δt`) arrive
//! as mantissa `w ≥ 0` and exponent `f`, each word within half a unit of its
//! last place of the decimal gain: `|w·2^−f − gain| ≤ 2^−(f+1)`. Products of
//! words and counts are exact, sums are exact, so these three roundings are
//! the only error before `floor(y + ½)`, and they may add up to 1 code
//! ([`crate::dac`]). `E = 2^error_bits` is the largest error.
//!
//! # Budget
//!
//! | term | counts | largest rounding \[codes\] | demand | allowed |
//! | --- | --- | --- | --- | --- |
//! | `Kp·e` | `\|e\| ≤ E` | `E·2^−(fp+1)` | `fp ≥ error_bits + 2` | 1/8 |
//! | `(Ki·Δt)·Σe` | `\|Σe\| ≤ 2^s` | `2^s·2^−(fi+1)` | `s ≤ fi − 1` | 1/4 |
//! | `(Kd/Δt)·Δe` | `\|Δe\| ≤ D` | `D·2^−(fd+1)` | `D ≤ 2^fd` | 1/2 |
//! | together | | | | 7/8 |
//!
//! The last eighth is slack for gains that reach their word through arithmetic
//! of 53 bits instead of exactly: with terms below 2^30 codes that costs less
//! than 2^−20 codes.
//!
//! # Ranges
//!
//! A mantissa has at most 31 bits. With the demands above this bounds the
//! terms, without further conditions:
//!
//! * `|Kp·e| ≤ w·2^−fp·E < 2^31·2^−2 = 2^29` codes.
//! * `|(Ki·Δt)·Σe| ≤ 2^28` codes defines the declared range of `Σe` together
//!   with the budget: `2^s` with `s = fi − max(1, bits(w) − 28)`, since
//!   `w < 2^bits(w)` gives `w·2^−fi·2^s < 2^28`. The range must hold at least
//!   2^8 errors of the largest size, or it would be left in normal operation;
//!   `fi ≥ error_bits + 11` guarantees that. Such an integral can stand at 32
//!   times the range of the widest converter (2^23 codes).
//! * Of `fi`, 40 bits can be used: `Σe` may then reach 2^39, which a constant
//!   error of 2^17 takes 2^22 samples to fill, 42 s at 10 µs. With the 32
//!   bits that the other two words have it would be 0.16 s.
//!
//! # Derivative
//!
//! `Kd/Δt` grows as `Δt` shrinks: the paper's 0.05 s at 10 µs is 5000 codes
//! per count, which for `E` = 2^18 and 31 bits would miss the budget at
//! `|Δe| = 2·E`. But such a difference drives every converter to its limit, and
//! the exact size no longer matters. So `Δe` is held at the first count `D`
//! whose term outweighs all others,
//!
//! ```text
//! w·2^−fd·D ≥ 2^29 + 2^28 + 2^24 = 822 083 584 codes,   D ≤ 2·E
//! ```
//!
//! Beyond `D` the sum keeps the sign of `Δe` and a magnitude of at least
//! 2^29 + 2^28 + 2^24 − 2^29 − 2^28 = 2^24 codes, here as in the exact law
//! (less the budget), so both stand at the same end of the code range. The
//! demand `D ≤ 2^fd` is met by `fd ≥ error_bits + 1` (then even `2·E ≤ 2^fd`)
//! or by a full mantissa, `w ≥ 822 083 584`. Finally `Kd/Δt ≤ 2^27`, 16 times
//! the range of the widest converter for one count, keeps the term below
//! 822 083 584 + 2^27 < 2^30 codes.
//!
//! # Overflow
//!
//! | value | type | magnitude below | of |
//! | --- | --- | --- | --- |
//! | `Kp`, `Kd/Δt`, 32 fraction bits | `i64` | 2^59 | 2^63 |
//! | `Kp·e + (Kd/Δt)·Δe`, 32 fraction bits | `i64` | 2^61 + 2^62 | 2^63 |
//! | `Ki·Δt`, 40 fraction bits | `i64` | 2^43 | 2^63 |
//! | `(Ki·Δt)·e`, 40 fraction bits | `i64` | 2^60 | 2^63 |
//! | `Σ (Ki·Δt)·e` after 2^64 samples, 40 fraction bits | `i128` | 2^124 | 2^127 |
//!
//! All of it follows from exponents and signs, and is checked once, when the
//! words are accepted, before the first step.

use crate::counts::ErrorRange;
use crate::refusal::{Refusal, What};
use crate::word::{GainWord, Part, power_of_two_or_most};

/// The three gains of the law as words, and the errors that they serve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PidWords {
    /// `Kp` \[codes per count\].
    pub kp: GainWord,
    /// `Ki·Δt` \[codes per count\].
    pub ki_dt: GainWord,
    /// `Kd/Δt` \[codes per count\].
    pub kd_per_dt: GainWord,
    /// The declared errors are `|e| ≤ 2^error_bits` counts; 17 to 29.
    pub error_bits: u8,
}

/// One of the three gains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Gain {
    /// `Kp`.
    Proportional,
    /// `Ki·Δt`.
    Integral,
    /// `Kd/Δt`.
    Derivative,
}

impl Gain {
    /// Fraction bits of the terms `Kp·e` and `(Kd/Δt)·Δe`.
    pub(crate) const TERM_FRACTION_BITS: u8 = 32;
    /// Fraction bits of the integral.
    pub(crate) const INTEGRAL_FRACTION_BITS: u8 = 40;

    /// The part of the law that it is the gain of.
    pub const fn part(self) -> Part {
        match self {
            Self::Proportional => Part::Proportional,
            Self::Integral => Part::Integral,
            Self::Derivative => Part::Derivative,
        }
    }

    /// The refusal of a word for its fraction bits.
    pub(crate) fn fraction_bits(self, word: GainWord, least: u8) -> Refusal {
        let what = What::PidFractionBits(self.part(), word);
        let allowed = [least, self.max_fraction_bits()].map(i64::from);
        Refusal::new(what, i64::from(word.fraction_bits), allowed)
    }

    /// Smallest number of fraction bits for errors of `2^error_bits` counts;
    /// for the derivative only where the mantissa is below
    /// [`DERIVATIVE_OUTWEIGHS`].
    pub const fn min_fraction_bits(self, error_bits: u8) -> u8 {
        error_bits.saturating_add(match self {
            Self::Proportional => 2,
            Self::Integral => 11,
            Self::Derivative => 1,
        })
    }

    /// Largest number of fraction bits: 32, and 40 for the integral.
    pub const fn max_fraction_bits(self) -> u8 {
        match self {
            Self::Proportional | Self::Derivative => Self::TERM_FRACTION_BITS,
            Self::Integral => Self::INTEGRAL_FRACTION_BITS,
        }
    }
}

/// `2^29 + 2^28 + 2^24`: a derivative term of this size outweighs the
/// proportional term, the integral and the widest converter \[codes\]. Also
/// the smallest mantissa that counts as full.
pub const DERIVATIVE_OUTWEIGHS: i32 = (1 << 29) + (1 << 28) + (1 << 24);

/// `Kd/Δt` is at most `2^27` codes per count.
pub const DERIVATIVE_MAX_BITS: u8 = 27;

impl PidWords {
    /// Checks every demand of the module page; the error range if all hold.
    pub(crate) fn check(&self) -> Result<ErrorRange, Refusal> {
        let error_bits = self.error_bits;
        let range = ErrorRange::from_bits(error_bits)?;

        for (gain, word) in [
            (Gain::Proportional, self.kp),
            (Gain::Integral, self.ki_dt),
            (Gain::Derivative, self.kd_per_dt),
        ] {
            What::Gain(gain.part(), word).not_negative(word.mantissa)?;
            // A full mantissa frees the derivative from its lower bound.
            let full = gain == Gain::Derivative && word.mantissa >= DERIVATIVE_OUTWEIGHS;
            let min = if full {
                0
            } else {
                gain.min_fraction_bits(error_bits)
            };
            let max = gain.max_fraction_bits();
            if word.fraction_bits < min || word.fraction_bits > max {
                return Err(gain.fraction_bits(word, min));
            }
        }

        // Kd/Δt ≤ 2^27, that is w ≤ 2^(27+fd). From fd = 4 on every mantissa is.
        let word = self.kd_per_dt;
        let exponent = DERIVATIVE_MAX_BITS.saturating_add(word.fraction_bits);
        let most = power_of_two_or_most(u32::from(exponent));
        let max_mantissa = i32::try_from(most).unwrap_or(i32::MAX);
        let what = What::PidDerivative(word);
        what.within(i64::from(word.mantissa), [0, i64::from(max_mantissa)])?;
        Ok(range)
    }

    /// `D`, at which `Δe` is held \[counts\], 1 to `2·E`; for checked words.
    pub(crate) fn slope_limit(&self, range: ErrorRange) -> i32 {
        let whole = range.limit().saturating_mul(2);
        let word = self.kd_per_dt;
        // D = ceil(2^fd·(2^29 + 2^28 + 2^24)/w); 62 bits at most.
        let outweighs = u64::from(DERIVATIVE_OUTWEIGHS.unsigned_abs())
            .saturating_mul(power_of_two_or_most(u32::from(word.fraction_bits)));
        let mantissa = u64::from(word.mantissa.unsigned_abs());
        match outweighs.saturating_sub(1).checked_div(mantissa) {
            Some(below) => i32::try_from(below.saturating_add(1)).map_or(whole, |d| d.min(whole)),
            // Without a derivative term any difference will do.
            None => whole,
        }
    }

    /// `s` of the declared range `|Σe| ≤ 2^s`, `error_bits` + 8 to 39; for
    /// checked words.
    pub(crate) fn error_sum_bits(&self) -> u32 {
        // s = fi − max(1, bits(w) − 28)
        let word = self.ki_dt;
        let below = word.mantissa_bits().saturating_sub(28).max(1);
        u32::from(word.fraction_bits).saturating_sub(below)
    }
}
