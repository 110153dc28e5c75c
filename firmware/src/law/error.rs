//! Why words are not accepted as a law.

use core::fmt;

use crate::counts::ErrorRange;
use crate::word::GainWord;

use super::words::LawWords;

/// A part of the law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// `Kp·e`.
    Proportional,
    /// `(Ki·Δt)·Σe`.
    Integral,
    /// `(Kd/Δt)·Δe`.
    Derivative,
    /// Velocity feed-forward.
    Velocity,
    /// Acceleration feed-forward.
    Acceleration,
    /// Friction feed-forward.
    Friction,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Proportional => "Kp",
            Self::Integral => "Ki·Δt",
            Self::Derivative => "Kd/Δt",
            Self::Velocity => "the velocity feed-forward",
            Self::Acceleration => "the acceleration feed-forward",
            Self::Friction => "the friction feed-forward",
        })
    }
}

/// Why words are not accepted. Nothing was built; the axis cannot start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LawError {
    /// The exponent of the sum lies outside 33 to 40.
    SumFractionBits(u8),
    /// The exponent of the error range lies outside 17 to 29.
    ErrorRange {
        /// The exponent given.
        error_bits: u8,
    },
    /// A gain is negative.
    Negative {
        /// Which one.
        part: Part,
        /// Its word.
        word: GainWord,
    },
    /// A word is too coarse for the accuracy, or finer than the sum. Where
    /// `least` is more than `most`, the sum itself is too coarse for this gain.
    FractionBits {
        /// Which gain.
        part: Part,
        /// Its word.
        word: GainWord,
        /// Fewest fraction bits that are accepted.
        least: u8,
        /// Most fraction bits that are accepted.
        most: u8,
    },
    /// Gain and range together need more than the product's 62 bits.
    TermTooWide {
        /// Which gain.
        part: Part,
        /// Its word.
        word: GainWord,
        /// Largest integer that it multiplies.
        limit: u32,
    },
    /// `Kd/Δt` is rounded too coarsely for the differences that it serves.
    DerivativeTooCoarse {
        /// Its word.
        word: GainWord,
        /// Largest difference \[counts\].
        counts: u32,
    },
    /// The terms add up to more than the sum holds.
    SumTooWide {
        /// The exponent of the sum.
        sum_fraction_bits: u8,
    },
    /// The range of the sum of errors is too small for normal operation.
    ErrorSumRange {
        /// What the words reach \[counts\].
        reached: u64,
        /// What is needed: 2^8 errors of the largest size \[counts\].
        wanted: u64,
    },
    /// `Δt/(T_f + Δt)` has no word: the filter is too slow for this sample
    /// time, or not a filter.
    FilterSmoothing(i32),
    /// The filtered difference has too few fraction bits for the accuracy, or
    /// more than its range or the sum leaves.
    FilterFractionBits {
        /// The number given.
        fraction_bits: u8,
        /// The fewest for an error of 1/16 code.
        needed: u32,
        /// The most that the range of the differences and the sum leave.
        most: u8,
    },
    /// `Δt/T_t` has no word: the tracking time is too long for this sample
    /// time, or shorter than it.
    Tracking(i32),
}

impl fmt::Display for LawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SumFractionBits(bits) => {
                let range = LawWords::SUM_FRACTION_BITS;
                let (least, most) = (range.start(), range.end());
                write!(
                    f,
                    "a sum with {bits} fraction bits is not supported; it must have {least} to {most}"
                )
            }
            Self::ErrorRange { error_bits } => write!(
                f,
                "an error range of 2^{error_bits} counts is not supported; \
                 the exponent must lie between {} and {}",
                ErrorRange::MIN_BITS,
                ErrorRange::MAX_BITS
            ),
            Self::Negative { part, word } => write!(
                f,
                "the word {word} of {part} is negative; a gain must be at least 0"
            ),
            Self::FractionBits {
                part,
                word,
                least,
                most,
            } => write!(
                f,
                "the word {word} of {part} has {} fraction bits; \
                 it must have at least {least} of them, and at most the {most} of the sum",
                word.fraction_bits
            ),
            Self::TermTooWide { part, word, limit } => write!(
                f,
                "the word {word} of {part} times {limit} needs more than 62 bits; \
                 a smaller gain or a smaller range fits"
            ),
            Self::DerivativeTooCoarse { word, counts } => write!(
                f,
                "the word {word} of Kd/Δt is too coarse for differences up to {counts} counts: \
                 they must be at most 2^{}",
                word.fraction_bits
            ),
            Self::SumTooWide { sum_fraction_bits } => write!(
                f,
                "the terms of the law add up to more than 2^{} codes; \
                 a sum with fewer than {sum_fraction_bits} fraction bits or smaller gains fit",
                62_u8.saturating_sub(*sum_fraction_bits)
            ),
            Self::ErrorSumRange { reached, wanted } => write!(
                f,
                "the words let the sum of errors reach {reached} counts; \
                 it must reach {wanted}: 2^8 errors of the largest size"
            ),
            Self::FilterSmoothing(word) => write!(
                f,
                "the filter's word is {word}; Δt/(T_f + Δt)·2^31 must be between 1 and 2^31 − 1"
            ),
            Self::FilterFractionBits {
                fraction_bits,
                needed,
                most,
            } => write!(
                f,
                "the filtered difference has {fraction_bits} fraction bits; \
                 the accuracy needs at least {needed}, and its range and the sum leave at most {most}"
            ),
            Self::Tracking(word) => write!(
                f,
                "the tracking word is {word}; Δt/T_t·2^31 must be between 1 and 2^31 − 1"
            ),
        }
    }
}

impl core::error::Error for LawError {}
