//! An axis' settings as words, and the check of words that come from elsewhere.

use core::mem::offset_of;

use super::{Axis, Feedback};
use crate::backlash_compensation::{HALF_GAP_MAX, Trigger};
use crate::law::{FilterWords, words::LARGEST_RATE};
use crate::monitor::FollowingErrorMonitor;
use crate::output::{Output, Quantiser};
use crate::settings::{MOST, Ranges, Settings, Unfit, Words};
use crate::wide;

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
        let (output, monitors) = (axis.output(), &axis.monitors);
        // Of an accepted law, in which everything else is off.
        let mut words = Self::from_words(axis.law().settings.0);
        words.slew_codes = output.slew();
        match output.quantiser() {
            Quantiser::Nearest => {}
            Quantiser::ErrorFeedback => words.quantiser = 1,
            Quantiser::Dither { seed } => (words.quantiser, words.dither_seed) = (2, seed),
        }
        words.counter_bits = wide::byte(axis.counter.bits());
        words.largest_jump_counts = or_none(axis.counter.largest_jump());
        if let Feedback::Load(counter) = axis.feedback {
            words.feedback_of_load = 1;
            words.load_counter_bits = wide::byte(counter.bits());
            words.load_largest_jump_counts = or_none(counter.largest_jump());
        }
        if let Some(monitor) = monitors.following_error {
            let (counts, lag) = monitor.limits();
            words.following_error_counts = counts;
            words.lag_mantissa = lag.mantissa.cast_unsigned();
            words.lag_fraction_bits = wide::byte(lag.fraction_bits);
            words.velocity_fraction_bits = wide::byte(monitor.velocity_fraction_bits());
        }
        if let Some(monitor) = monitors.encoder_loss {
            (words.encoder_loss_codes, words.encoder_loss_samples) = monitor.limits();
        }
        if let Some(monitor) = monitors.saturation {
            words.saturation_samples = monitor.limit();
        }
        words.watches_ticks = flag(monitors.ticks.is_some());
        words.dead_band_counts = axis.rest.dead_band;
        words.hold_integral = flag(axis.rest.hold_integral);
        if let Some(plan) = axis.backlash_compensation {
            let first = plan.first().to_bits();
            words.half_gap_counts = plan.half_gap_counts();
            words.crossing_half_samples = plan.samples().wrapping_shr(1);
            words.crossing_first_low = wide::lower(first).cast_unsigned();
            words.crossing_first_high = wide::upper(first).cast_unsigned();
            words.flank_of_acceleration = flag(matches!(plan.trigger(), Trigger::Acceleration));
        }
        words
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
