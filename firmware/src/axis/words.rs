//! An axis' settings as words, and the check of words that come from elsewhere.

use core::mem::offset_of;

use super::{Axis, Feedback};
use crate::backlash_compensation::{BacklashCompensation, HALF_GAP_MAX, Trigger};
use crate::law::{FilterWords, words::LARGEST_RATE};
use crate::monitor::FollowingErrorMonitor;
use crate::output::{Output, Quantiser};
use crate::position::CounterParameters;
use crate::settings::{MOST, Ranges, Settings, Unfit, Words};
use crate::wide;
use crate::word::GainWord;

/// Place of a word by its name.
macro_rules! place {
    ($word:ident) => {
        offset_of!(Settings, $word) >> 2
    };
}

/// The refusal of a word by its name.
macro_rules! unfit {
    ($word:ident) => {
        Unfit::at(place!($word))
    };
}

impl Settings {
    /// The settings of an axis.
    pub const fn of(axis: &Axis) -> Self {
        let (law, output) = (axis.law(), axis.output());
        let [quantiser, dither_seed] = match output.quantiser() {
            Quantiser::Nearest => [0, 0],
            Quantiser::ErrorFeedback => [1, 0],
            Quantiser::Dither { seed } => [2, seed],
        };
        let (of_load, load) = match axis.feedback {
            Feedback::Motor => (0, CounterParameters::WORD),
            Feedback::Load(counter) => (1, counter),
        };
        let monitors = &axis.monitors;
        let (following, lag, velocity_bits) = match monitors.following_error {
            Some(monitor) => {
                let (counts, lag) = monitor.limits();
                (counts, lag, wide::byte(monitor.velocity_fraction_bits()))
            }
            None => (u32::MAX, GainWord::new(0, 0), 0),
        };
        let (loss_codes, loss_samples) = match monitors.encoder_loss {
            Some(monitor) => monitor.limits(),
            None => (u32::MAX, u32::MAX),
        };
        let [
            half_gap,
            half_samples,
            first_low,
            first_high,
            by_acceleration,
        ] = match axis.backlash_compensation {
            Some(plan) => plan.words(),
            None => [0; 5],
        };
        Self {
            slew_codes: output.slew(),
            quantiser,
            dither_seed,
            counter_bits: wide::byte(axis.counter.bits()),
            largest_jump_counts: or_none(axis.counter.largest_jump()),
            feedback_of_load: of_load,
            load_counter_bits: wide::byte(load.bits()),
            load_largest_jump_counts: or_none(load.largest_jump()),
            following_error_counts: following,
            lag_mantissa: lag.mantissa.cast_unsigned(),
            lag_fraction_bits: wide::byte(lag.fraction_bits),
            velocity_fraction_bits: velocity_bits,
            encoder_loss_codes: loss_codes,
            encoder_loss_samples: loss_samples,
            saturation_samples: match monitors.saturation {
                Some(monitor) => monitor.limit(),
                None => u32::MAX,
            },
            watches_ticks: flag(monitors.ticks.is_some()),
            dead_band_counts: axis.rest.dead_band,
            hold_integral: flag(axis.rest.hold_integral),
            half_gap_counts: half_gap,
            crossing_half_samples: half_samples,
            crossing_first_low: first_low,
            crossing_first_high: first_high,
            flank_of_acceleration: by_acceleration,
            ..Self::from_words(law.settings.0)
        }
    }

    /// Checks each word against its range, and all terms together.
    ///
    /// # Errors
    /// The first word that is not accepted.
    pub fn check(&self) -> Result<(), Unfit> {
        Words::of(self).check()
    }
}

impl Words {
    /// The same as of the structure ([`Settings::check`]).
    ///
    /// # Errors
    /// The first word that is not accepted.
    #[inline(never)]
    pub fn check(&self) -> Result<(), Unfit> {
        static RANGES: Ranges = Ranges::ALL;
        RANGES.check(self)?;
        let (errors, mut units) = (self.error_limit_counts(), self.difference_limit_counts());
        if self.filter_smoothing() != 0 {
            // D·2^h + 1 units of a filtered difference.
            let filtered = product(units, self.filter_scale());
            if filtered > wide::word(FilterWords::LARGEST_DIFFERENCE) {
                return Err(unfit!(filter_scale));
            }
            units = wide::narrowed(filtered).unwrap_or(MOST).wrapping_add(1);
        }
        let range = 1_u32.wrapping_shl(self.dac_bits().wrapping_sub(1));
        let mut total = wide::word(range).wrapping_shl(32);
        // T + R ≤ 2^30 codes, and 31 bits of each factor
        self.add(&mut total, place!(kp_mantissa), &[errors, errors, units])?;
        // A source may put its own feed-forward in the place of these three.
        let ahead = wide::word(self.ahead_limit_codes()).wrapping_shl(32);
        if total.wrapping_add(ahead) > MOST_TERMS {
            return Err(unfit!(ahead_limit_codes));
        }
        let limits = [LARGEST_RATE, LARGEST_RATE, 1];
        self.add(&mut total, place!(velocity_ff_mantissa), &limits)?;
        if self.anti_windup() == 2 && self.tracking() == 0 {
            return Err(unfit!(tracking));
        }
        // Half a wheel is no motion.
        if !fits(self.counter_bits(), self.largest_jump_counts()) {
            return Err(unfit!(largest_jump_counts));
        }
        if !fits(self.load_counter_bits(), self.load_largest_jump_counts()) {
            return Err(unfit!(load_largest_jump_counts));
        }
        Ok(())
    }

    /// Adds three terms of integers up to their limits, mantissa and scale each, from the
    /// word at `place` on. The first of which a factor or the sum is too large is told.
    #[inline(never)]
    fn add(&self, total: &mut u64, mut place: usize, limits: &[u32; 3]) -> Result<(), Unfit> {
        let (terms, _) = self.0.get(place..).unwrap_or_default().as_chunks();
        for ([mantissa, scale], limit) in terms.iter().zip(limits) {
            let units = product(*limit, *scale);
            if units > wide::word(MOST) {
                return Err(Unfit::at(place));
            }
            // Two numbers of at most 2^62.
            *total = total.wrapping_add(wide::word(*mantissa).wrapping_mul(units));
            if *total > MOST_TERMS {
                return Err(Unfit::at(place));
            }
            place = place.wrapping_add(2);
        }
        Ok(())
    }
}

/// [`wide::product`] where it may be a call: what is checked once takes its time.
fn product(a: u32, b: u32) -> u64 {
    wide::word(a).wrapping_mul(wide::word(b))
}

/// Tells whether a counter of so many bits can change by so much, where it is watched.
#[inline(never)]
fn fits(bits: u32, jump: u32) -> bool {
    jump == u32::MAX || jump.wrapping_shr(bits.wrapping_sub(1)) == 0
}

/// 2^30 codes.
const MOST_TERMS: u64 = 1 << 62;

const fn flag(set: bool) -> u32 {
    if set { 1 } else { 0 }
}

const fn or_none(limit: Option<u32>) -> u32 {
    match limit {
        Some(limit) => limit,
        None => u32::MAX,
    }
}

/// Ranges that the words repeat.
const _: () = assert!(
    FollowingErrorMonitor::MAX_FRACTION_BITS == 46
        && Output::SLEW_MOST == 1 << 24
        && HALF_GAP_MAX == 1 << 24
);

impl BacklashCompensation {
    const fn words(&self) -> [u32; 5] {
        let first = self.first().to_bits();
        [
            self.half_gap_counts(),
            self.samples().wrapping_shr(1),
            wide::lower(first).cast_unsigned(),
            wide::upper(first).cast_unsigned(),
            flag(matches!(self.trigger(), Trigger::Acceleration)),
        ]
    }
}
