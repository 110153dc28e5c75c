//! An axis' settings as words, and the check of words that come from elsewhere.

use core::mem::offset_of;

use super::{Axis, Feedback};
use crate::backlash_compensation::{BacklashCompensation, HALF_GAP_MAX, Trigger};
use crate::law::{FilterWords, term::Term, words::LARGEST_RATE};
use crate::monitor::FollowingErrorMonitor;
use crate::output::{Output, Quantiser};
use crate::position::CounterParameters;
use crate::settings::{MOST, Settings, Unfit};
use crate::wide;
use crate::word::GainWord;

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
            ..law.settings
        }
    }

    /// Checks each word against its range, and all terms together.
    ///
    /// # Errors
    /// The first word that is not accepted.
    #[inline(never)]
    pub fn check(&self) -> Result<(), Unfit> {
        for (place, (word, [least, most])) in self.to_words().iter().zip(Self::RANGES).enumerate() {
            if *word < least || *word > most {
                return Err(Unfit::at(place));
            }
        }
        self.check_terms()?;
        if self.anti_windup == 2 && self.tracking == 0 {
            return Err(unfit(offset_of!(Self, tracking)));
        }
        let jumps = [
            (
                offset_of!(Self, largest_jump_counts),
                self.counter_bits,
                self.largest_jump_counts,
            ),
            (
                offset_of!(Self, load_largest_jump_counts),
                self.load_counter_bits,
                self.load_largest_jump_counts,
            ),
        ];
        for (offset, bits, jump) in jumps {
            // Half a wheel is no motion.
            if jump != u32::MAX && jump.wrapping_shr(bits.wrapping_sub(1)) != 0 {
                return Err(unfit(offset));
            }
        }
        Ok(())
    }

    /// `T + R ≤ 2^30` codes, and 31 bits of each factor.
    fn check_terms(&self) -> Result<(), Unfit> {
        let filtered = self.filter_smoothing != 0;
        let differences = self.difference_limit_counts;
        // D·2^h + 1 units of a filtered difference.
        let units = if filtered {
            differences
                .saturating_mul(self.filter_scale)
                .saturating_add(1)
        } else {
            differences
        };
        if filtered && units > FilterWords::LARGEST_DIFFERENCE.saturating_add(1) {
            return Err(unfit(offset_of!(Self, filter_scale)));
        }
        let errors = self.error_limit_counts;
        let direct = [
            (offset_of!(Self, kp_mantissa), self.kp(), errors),
            (offset_of!(Self, ki_dt_mantissa), self.ki_dt(), errors),
            (
                offset_of!(Self, kd_per_dt_mantissa),
                self.kd_per_dt(),
                units,
            ),
        ];
        let rates = [
            (
                offset_of!(Self, velocity_ff_mantissa),
                self.velocity_ff(),
                LARGEST_RATE,
            ),
            (
                offset_of!(Self, acceleration_ff_mantissa),
                self.acceleration_ff(),
                LARGEST_RATE,
            ),
            (
                offset_of!(Self, friction_ff_mantissa),
                self.friction_ff(),
                1,
            ),
        ];
        let range = 1_u32.wrapping_shl(self.dac_bits.wrapping_sub(1));
        let total = added(wide::word(range).wrapping_shl(32), &direct)?;
        // A source may put its own feed-forward in the place of these three.
        let ahead = wide::word(self.ahead_limit_codes).wrapping_shl(32);
        if total.saturating_add(ahead) > MOST_TERMS {
            return Err(unfit(offset_of!(Self, ahead_limit_codes)));
        }
        added(total, &rates).map(|_| ())
    }
}

/// 2^30 codes.
const MOST_TERMS: u64 = 1 << 62;

/// The sum with terms of integers up to their limits.
#[inline(never)]
fn added(mut total: u64, terms: &[(usize, Term, u32)]) -> Result<u64, Unfit> {
    for (offset, term, limit) in terms {
        let units = wide::product(*limit, term.scale.cast_unsigned());
        let units = wide::narrowed(units).filter(|units| *units <= MOST);
        let units = units.ok_or(unfit(*offset))?;
        total = total.saturating_add(wide::product(term.mantissa.cast_unsigned(), units));
        if total > MOST_TERMS {
            return Err(unfit(*offset));
        }
    }
    Ok(total)
}

/// The word at an offset of the structure.
const fn unfit(offset: usize) -> Unfit {
    Unfit::at(offset.wrapping_shr(2))
}

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
