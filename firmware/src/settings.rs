//! Settings of an axis as one flat structure of words: what goes over a line,
//! into a C program, or into a chip's flash.
//!
//! A host makes them of an accepted [`crate::Axis`] ([`Settings::of`]). A chip that did
//! not make them itself checks them before the first sample
//! ([`Settings::check`]): each word against its range, and once the sum of all
//! terms against overflow. So it needs none of what acceptance needs: no
//! division, no sentence.

use core::mem::offset_of;

/// The largest mantissa of a gain, and the largest number with a sign.
pub(crate) const MOST: u32 = i32::MAX.cast_unsigned();

/// A structure of words in the order of the line: name, least and largest value, and the
/// value that switches off what the word is for.
macro_rules! words {
    (
        $(#[$about:meta])*
        pub struct $name:ident {
            $(
                #[doc = $doc:literal] $(#[doc = $more:literal])*
                $field:ident: $least:expr, $most:expr, $off:expr;
            )*
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[repr(C)]
        pub struct $name {
            $(#[doc = $doc] $(#[doc = $more])* pub $field: u32,)*
        }

        impl $name {
            /// Names of the words, in their order.
            pub const NAMES: [&'static str; Self::WORDS] = [$(stringify!($field),)*];
            /// The same in one piece, a zero behind each: as C reads them.
            pub const NAMES_IN_C: &'static str = concat!($(stringify!($field), "\0",)*);
            /// What each of them means.
            pub const MEANINGS: [&'static str; Self::WORDS] = [$(concat!($doc $(, $more)*),)*];
            /// Least and largest value of each.
            pub const RANGES: [[u32; 2]; Self::WORDS] = [$([$least, $most],)*];
            /// Number of words.
            pub const WORDS: usize = [$(stringify!($field),)*].len();
            /// No gain, no limit, no option; a converter of 2 bits.
            pub(crate) const OFF: Self = Self { $($field: $off,)* };

            /// The words in their order.
            pub const fn to_words(&self) -> [u32; Self::WORDS] {
                [$(self.$field,)*]
            }

            /// The structure of these words, unchecked.
            pub const fn from_words([$($field,)*]: [u32; Self::WORDS]) -> Self {
                Self { $($field,)* }
            }
        }

        impl Words {
            /// The words of settings.
            pub const fn of(settings: &$name) -> Self {
                Self(settings.to_words())
            }

            $(#[doc = $doc] $(#[doc = $more])*
            #[allow(clippy::indexing_slicing, reason = "a constant below the number of words")]
            #[inline(always)]
            pub(crate) const fn $field(&self) -> u32 {
                self.0[offset_of!($name, $field) >> 2]
            })*
        }
    };
}

words! {
    /// Settings of an axis. A limit that nothing reaches, 2^32 − 1, is none.
    ///
    /// ```
    /// use firmware::settings::Settings;
    /// use firmware::law::{Law, LawWords};
    /// use firmware::output::{Output, Quantiser};
    /// use firmware::{Axis, Dac, GainWord};
    ///
    /// let dac = Dac::with_bits(12)?;
    /// let words = LawWords { kp: GainWord::new(1 << 30, 29), ..LawWords::NONE };
    /// let axis = Axis::new(Law::accept(words, dac)?, Output::new(dac, None, Quantiser::Nearest)?);
    /// let settings = Settings::of(&axis);
    /// // 2^30·2^3 units of 2^−32 codes a count.
    /// assert_eq!((settings.kp_mantissa, settings.kp_scale), (1 << 30, 1 << 3));
    /// assert_eq!(settings.check(), Ok(()));
    /// // A word that is out of its range is named.
    /// let unfit = Settings { dac_bits: 25, ..settings }.check().unwrap_err();
    /// assert_eq!(unfit.name(), "dac_bits");
    /// # Ok::<(), firmware::Refusal>(())
    /// ```
    pub struct Settings {
        /// `Kp`: an integer `x` times `scale`, and that times `mantissa`, is `Kp·x` in 2^−32
        /// codes; so with the gains that follow.
        kp_mantissa: 0, MOST, 0;
        /// Of `Kp`.
        kp_scale: 1, 1 << 30, 1;
        /// `Ki·Δt` \[codes per count\].
        ki_dt_mantissa: 0, MOST, 0;
        /// Of `Ki·Δt`.
        ki_dt_scale: 1, 1 << 30, 1;
        /// `Kd/Δt` \[codes per count\]; with a filter per unit of the filtered difference.
        kd_per_dt_mantissa: 0, MOST, 0;
        /// Of `Kd/Δt`.
        kd_per_dt_scale: 1, 1 << 30, 1;
        /// 1: the derivative is that of the measurement, not of the error.
        derivative_of_measurement: 0, 1, 0;
        /// `a·2^31` of the derivative's filter; 0 is none.
        filter_smoothing: 0, MOST, 0;
        /// `2^h` of the filter: the units of a count in it.
        filter_scale: 1, 1 << 29, 1;
        /// `E`, largest error \[counts\].
        error_limit_counts: 1, 1 << 29, 1 << 17;
        /// `D`, largest difference \[counts\].
        difference_limit_counts: 1, 1 << 30, 1 << 18;
        /// Bits of the motor's counter.
        counter_bits: 8, 32, 32;
        /// Largest change of its count \[counts per sample\].
        largest_jump_counts: 1, u32::MAX, u32::MAX;
        /// 1: the position is that of the load's encoder.
        feedback_of_load: 0, 1, 0;
        /// Code from which on a healthy encoder moves \[codes\].
        encoder_loss_codes: 1, u32::MAX, u32::MAX;
        /// Samples after which it is lost.
        encoder_loss_samples: 1, u32::MAX, u32::MAX;
        /// Samples that the output may stand at a limit.
        saturation_samples: 0, u32::MAX, u32::MAX;
        /// Bits of the converter.
        dac_bits: 2, 24, 2;
        /// Largest change of the code \[codes per sample\].
        slew_codes: 1, 1 << 24, 1 << 24;
        /// 0 nearest, 1 error feedback, 2 dither.
        quantiser: 0, 2, 0;
        /// Start of the dither's generator.
        dither_seed: 0, u32::MAX, 0;
        /// 0 none, 1 clamp, 2 back-calculation.
        anti_windup: 0, 2, 0;
        /// `Δt/T_t·2^31` of the back-calculation.
        tracking: 0, MOST, 0;
        /// First whole number beyond the integral's range \[codes\].
        integral_range_codes: 1, MOST, 1 << 20;
        /// 1 where beyond `D` a declared range is left.
        difference_is_declared: 0, 1, 1;
        /// Feed-forward of the velocity \[codes per unit of a setpoint's velocity\].
        velocity_ff_mantissa: 0, MOST, 0;
        /// Of the feed-forward of the velocity.
        velocity_ff_scale: 1, 1 << 30, 1;
        /// Feed-forward of the acceleration \[codes per unit of a setpoint's
        /// acceleration\].
        acceleration_ff_mantissa: 0, MOST, 0;
        /// Of the feed-forward of the acceleration.
        acceleration_ff_scale: 1, 1 << 30, 1;
        /// Feed-forward of the friction \[codes\].
        friction_ff_mantissa: 0, MOST, 0;
        /// Of the feed-forward of the friction.
        friction_ff_scale: 1, 1 << 30, 1;
        /// Largest feed-forward of a source that computes it itself \[codes\].
        ahead_limit_codes: 0, 1 << 30, 0;
        /// Bits of the load's counter.
        load_counter_bits: 8, 32, 32;
        /// Largest change of its count \[counts per sample\].
        load_largest_jump_counts: 1, u32::MAX, u32::MAX;
        /// Largest following error at rest \[counts\].
        following_error_counts: 1, u32::MAX, u32::MAX;
        /// By how much it grows with the speed, `mantissa·2^−fraction_bits` \[samples\].
        lag_mantissa: 0, MOST, 0;
        /// Of the lag.
        lag_fraction_bits: 0, 46, 0;
        /// Fraction bits of setpoints' velocities.
        velocity_fraction_bits: 0, 60, 0;
        /// 1: a tick that is missed is a fault.
        watches_ticks: 0, 1, 0;
        /// Errors that count as 0 at rest \[counts\].
        dead_band_counts: 0, u32::MAX, 0;
        /// 1: the integral stands still at rest.
        hold_integral: 0, 1, 0;
        /// `B` of the backlash compensation \[motor counts\].
        half_gap_counts: 0, 1 << 24, 0;
        /// `N`, half the samples of a move across the gap; 0 is no compensation.
        crossing_half_samples: 0, 65_535, 0;
        /// `B/N²` \[2^−32 counts\], its lower word.
        crossing_first_low: 0, u32::MAX, 0;
        /// Its upper word \[counts\].
        crossing_first_high: 0, 1 << 24, 0;
        /// 1: the flank follows the acceleration, not the velocity.
        flank_of_acceleration: 0, 1, 0;
    }
}

/// Settings as the samples read them: their words in one piece, which a line fills
/// one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Words(pub [u32; Settings::WORDS]);

impl Words {
    /// All words 0, which are no settings.
    pub const ZERO: Self = Self([0; Settings::WORDS]);
}

/// Ranges of all words in less than half of the bytes: the different largest values,
/// and for each word the place of its own in the lower half of a byte, its least value
/// in the upper half.
pub(crate) struct Ranges {
    most: [u32; Self::MOST],
    of_word: [u8; Settings::WORDS],
}

impl Ranges {
    /// Different largest values at most: a half of a byte tells them apart.
    const MOST: usize = 16;
    /// Those of [`Settings::RANGES`].
    pub(crate) const ALL: Self = Self::distinct();

    #[allow(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        reason = "it is evaluated while it is compiled"
    )]
    const fn distinct() -> Self {
        let mut ranges = Self {
            most: [0; Self::MOST],
            of_word: [0; Settings::WORDS],
        };
        let (mut known, mut word) = (0, 0);
        while word < Settings::WORDS {
            let [least, most] = Settings::RANGES[word];
            assert!(least < 16, "a half of a byte holds it");
            let mut place = 0;
            while place < known && ranges.most[place] != most {
                place += 1;
            }
            ranges.most[place] = most;
            known = if place == known { known + 1 } else { known };
            let ([least, ..], [place, ..]) = (least.to_le_bytes(), place.to_le_bytes());
            ranges.of_word[word] = (least << 4) | place;
            word += 1;
        }
        ranges
    }

    /// Tells whether each word is within its range, or the place of the first that is not.
    pub(crate) fn check(&self, words: &Words) -> Result<(), Unfit> {
        for (place, (word, range)) in (0..).zip(words.0.iter().zip(&self.of_word)) {
            let least = u32::from(range.wrapping_shr(4));
            // There is one for every half of a byte.
            let most = self.most.get(usize::from(range & 0xf)).unwrap_or(&0);
            if *word < least || word > most {
                return Err(Unfit { word: place });
            }
        }
        Ok(())
    }
}

/// A word that is not accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unfit {
    /// Its place in [`Settings::NAMES`].
    pub word: u8,
}

impl Unfit {
    pub(crate) const fn at(place: usize) -> Self {
        let [word, ..] = place.to_le_bytes();
        Self { word }
    }

    /// Name of the word; empty where there is none of that number.
    pub fn name(&self) -> &'static str {
        let name = Settings::NAMES.get(usize::from(self.word));
        name.copied().unwrap_or_default()
    }
}
