//! An axis' settings as words, and back: the only place that knows both.

use super::{Axis, Feedback};
use crate::backlash_compensation::{BacklashCompensation, HALF_GAP_MAX, Trigger};
use crate::dac::Codes;
use crate::law::term::Term;
use crate::law::{AntiWindup, Derivative, FilterWords, Operands, words::LARGEST_RATE};
use crate::monitor::FollowingErrorMonitor;
use crate::output::{Output, Quantiser};
use crate::position::CounterParameters;
use crate::settings::{Settings, Unfit};
use crate::wide;
use crate::word::GainWord;

/// Places of the words that the sum of all terms is refused by.
mod place {
    pub(super) const KP: usize = 0;
    pub(super) const KI_DT: usize = 2;
    pub(super) const KD_PER_DT: usize = 4;
    pub(super) const VELOCITY_FF: usize = 6;
    pub(super) const ACCELERATION_FF: usize = 8;
    pub(super) const FRICTION_FF: usize = 10;
    pub(super) const AHEAD_LIMIT: usize = 12;
    pub(super) const FILTER_FRACTION_BITS: usize = 19;
    pub(super) const TRACKING: usize = 21;
    pub(super) const LARGEST_JUMP: usize = 27;
    pub(super) const LOAD_LARGEST_JUMP: usize = 30;
}

impl Settings {
    /// The settings of an axis.
    pub const fn of(axis: &Axis) -> Self {
        let (law, output) = (axis.law(), axis.output());
        let words = law.words();
        let operands = law.operands();
        let [smoothing, filter_bits] = match words.filter {
            Some(filter) => [
                filter.smoothing.cast_unsigned(),
                wide::byte(filter.fraction_bits),
            ],
            None => [0, 0],
        };
        let [anti_windup, tracking] = match words.anti_windup {
            AntiWindup::None => [0, 0],
            AntiWindup::Clamp => [1, 0],
            AntiWindup::BackCalculation { tracking } => [2, tracking.cast_unsigned()],
        };
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
        let crossing = match axis.backlash_compensation {
            Some(plan) => plan.words(),
            None => [0; 5],
        };
        let [
            half_gap,
            half_samples,
            first_low,
            first_high,
            by_acceleration,
        ] = crossing;
        Self {
            kp_mantissa: words.kp.mantissa.cast_unsigned(),
            kp_fraction_bits: wide::byte(words.kp.fraction_bits),
            ki_dt_mantissa: words.ki_dt.mantissa.cast_unsigned(),
            ki_dt_fraction_bits: wide::byte(words.ki_dt.fraction_bits),
            kd_per_dt_mantissa: words.kd_per_dt.mantissa.cast_unsigned(),
            kd_per_dt_fraction_bits: wide::byte(words.kd_per_dt.fraction_bits),
            velocity_ff_mantissa: words.velocity_ff.mantissa.cast_unsigned(),
            velocity_ff_fraction_bits: wide::byte(words.velocity_ff.fraction_bits),
            acceleration_ff_mantissa: words.acceleration_ff.mantissa.cast_unsigned(),
            acceleration_ff_fraction_bits: wide::byte(words.acceleration_ff.fraction_bits),
            friction_ff_mantissa: words.friction_ff.mantissa.cast_unsigned(),
            friction_ff_fraction_bits: wide::byte(words.friction_ff.fraction_bits),
            ahead_limit_codes: operands.ahead_limit.cast_unsigned(),
            error_limit_counts: operands.error_limit.cast_unsigned(),
            difference_limit_counts: operands.difference_limit.cast_unsigned(),
            difference_is_declared: flag(operands.difference_is_declared),
            integral_range_codes: operands.integral_range.cast_unsigned(),
            derivative_of_measurement: flag(matches!(words.derivative, Derivative::Measurement)),
            filter_smoothing: smoothing,
            filter_fraction_bits: filter_bits,
            anti_windup,
            tracking,
            dac_bits: law.dac().bits(),
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
        }
    }

    /// Checks each word against its range, and the sum of all terms.
    ///
    /// # Errors
    /// The first word that is not accepted.
    pub fn check(&self) -> Result<(), Unfit> {
        self.operands().map(|_| ())
    }

    /// The law as the samples read it, of checked words.
    pub(crate) fn operands(&self) -> Result<Operands, Unfit> {
        for (place, (word, [least, most])) in self.to_words().iter().zip(Self::RANGES).enumerate() {
            if *word < least || *word > most {
                return Err(Unfit::at(place));
            }
        }
        Operands::of(self)
    }
}

/// 2^30 codes.
const MOST_TERMS: u64 = 1 << 62;

/// Terms of the law, checked together.
impl Operands {
    fn of(settings: &Settings) -> Result<Self, Unfit> {
        let mut total = wide::word(1 << settings.dac_bits.wrapping_sub(1)).wrapping_shl(32);
        // T + R ≤ 2^30 codes
        let mut aligned = |place: usize, mantissa: u32, bits: u32, limit: u32| {
            let [fraction_bits, ..] = bits.to_le_bytes();
            let word = GainWord::new(mantissa.cast_signed(), fraction_bits);
            let term = Term::align(word, limit).ok_or(Unfit::at(place))?;
            total = total.saturating_add(term.largest(limit));
            if total > MOST_TERMS {
                return Err(Unfit::at(place));
            }
            Ok(term)
        };
        let s = settings;
        let errors = s.error_limit_counts;
        let kp = aligned(place::KP, s.kp_mantissa, s.kp_fraction_bits, errors)?;
        let ki_dt = aligned(
            place::KI_DT,
            s.ki_dt_mantissa,
            s.ki_dt_fraction_bits,
            errors,
        )?;
        let finer = match s.filter_smoothing {
            0 => 0,
            _ => s.filter_fraction_bits,
        };
        let differences = s.difference_limit_counts;
        // D·2^h + 1 units of a filtered difference.
        let units = match s.filter_smoothing {
            0 => differences,
            _ if differences.leading_zeros() <= finer => return Err(Unfit::at(place::KD_PER_DT)),
            _ => differences.wrapping_shl(finer).saturating_add(1),
        };
        if s.filter_smoothing != 0 && units > FilterWords::LARGEST_DIFFERENCE.saturating_add(1) {
            return Err(Unfit::at(place::FILTER_FRACTION_BITS));
        }
        let kd_bits = s.kd_per_dt_fraction_bits.wrapping_add(finer);
        let kd_per_dt = aligned(place::KD_PER_DT, s.kd_per_dt_mantissa, kd_bits, units)?;
        let rate = LARGEST_RATE;
        let velocity = aligned(
            place::VELOCITY_FF,
            s.velocity_ff_mantissa,
            s.velocity_ff_fraction_bits,
            rate,
        )?;
        let acceleration = aligned(
            place::ACCELERATION_FF,
            s.acceleration_ff_mantissa,
            s.acceleration_ff_fraction_bits,
            rate,
        )?;
        let friction = aligned(
            place::FRICTION_FF,
            s.friction_ff_mantissa,
            s.friction_ff_fraction_bits,
            1,
        )?;
        // A source may put its own feed-forward in the place of these three.
        let rates = [
            velocity.largest(rate),
            acceleration.largest(rate),
            friction.largest(1),
        ];
        let others = rates
            .iter()
            .fold(total, |sum, term| sum.saturating_sub(*term));
        let ahead = wide::word(s.ahead_limit_codes).wrapping_shl(32);
        if others.saturating_add(ahead) > MOST_TERMS {
            return Err(Unfit::at(place::AHEAD_LIMIT));
        }
        if s.anti_windup == 2 && s.tracking == 0 {
            return Err(Unfit::at(place::TRACKING));
        }
        let jumps = [
            (place::LARGEST_JUMP, s.counter_bits, s.largest_jump_counts),
            (
                place::LOAD_LARGEST_JUMP,
                s.load_counter_bits,
                s.load_largest_jump_counts,
            ),
        ];
        for (place, bits, jump) in jumps {
            // Half a wheel is no motion.
            let half = 1_u32.wrapping_shl(bits.wrapping_sub(1));
            if jump != u32::MAX && jump >= half {
                return Err(Unfit::at(place));
            }
        }
        let measured = s.derivative_of_measurement == 1;
        Ok(Self {
            error_limit: errors.cast_signed(),
            difference_limit: differences.cast_signed(),
            kp,
            ki_dt,
            kd_per_dt: if measured {
                kd_per_dt.negated()
            } else {
                kd_per_dt
            },
            derivative: if measured {
                Derivative::Measurement
            } else {
                Derivative::Error
            },
            feeds_forward: !(velocity.is_zero() && acceleration.is_zero() && friction.is_zero()),
            difference_is_declared: s.difference_is_declared == 1,
            filter: (s.filter_smoothing != 0).then_some(FilterWords {
                smoothing: s.filter_smoothing.cast_signed(),
                fraction_bits: wide::lowest_byte(finer),
            }),
            velocity,
            acceleration,
            friction: Codes::from_bits(friction.largest(1).cast_signed()),
            ahead_limit: s.ahead_limit_codes.cast_signed(),
            anti_windup: match s.anti_windup {
                0 => AntiWindup::None,
                1 => AntiWindup::Clamp,
                _ => AntiWindup::BackCalculation {
                    tracking: s.tracking.cast_signed(),
                },
            },
            integral_range: s.integral_range_codes.cast_signed(),
        })
    }
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
