//! Gains in SI units → the firmware's fixed-point gains, and positions → its
//! setpoints.
//!
//! The firmware only accepts or rejects fixed-point gains; this is where they are made.
//! Per sample the law needs `Kp`, `Ki·Δt` and `Kd/Δt` in codes per count
//! (eq. 23 at `t = k·Δt`). Each becomes `w·2^−f` with the largest `f` for which
//! `w` fits 31 bits, so that
//!
//! ```text
//! |w·2^−f − gain| ≤ ½·2^−f        half a unit of the last place
//! ```
//!
//! which is what the firmware's error budget assumes (`firmware::gains`). The
//! products with `Δt` are formed in f64 from the decimal gain and the whole
//! nanoseconds; together with the reading of the decimal that is at most four
//! roundings of 2^−53. The terms of the law are below 2^30 codes, so these
//! shift the sum by less than 2^−20 codes, against a slack of 1/8 code.
//!
//! The error range `|e| ≤ E` is a power of two: at least twice the travel, so
//! that an axis that stands still or runs the wrong way stays inside, and at
//! least 2^17 counts. Gains are refused if their fixed-point form does not reach that
//! far. Mostly it reaches further, and then the range is as wide as they allow: the
//! gains are the same, and an axis that runs away stays within the firmware's
//! promise for longer. The paper's gains at 1 ms reach 2^27 counts.

use core::fmt::Display;

use firmware::law::Part;
use firmware::refusal::What;
use firmware::{ErrorRange, Gain, GainWord, Pid, PidWords, Refusal, SetpointTable};
use plant::PidGains;

/// Largest error range \[counts\].
const MAX_ERROR: u64 = 1 << ErrorRange::MAX_BITS;

/// Largest mantissa, as a number.
const MAX_MANTISSA: f64 = i32::MAX as f64;

/// Bits of the largest mantissa.
const MANTISSA_BITS: u32 = 31;

/// One gain of the law in fixed point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPointGain {
    /// Part of the law.
    pub part: Part,
    /// Value in the run file, in its key's unit.
    pub value: f64,
    /// The gain that the law multiplies by, per sample.
    pub wanted: f64,
    /// The fixed-point number that stands for it.
    pub word: GainWord,
}

impl FixedPointGain {
    /// Key in the run file.
    pub fn key(&self) -> &'static str {
        key(self.part)
    }

    /// The gain as the law has it.
    pub fn name(&self) -> &'static str {
        words(self.part)[1]
    }

    /// Its unit in the law: rates come in units of their own.
    pub fn unit(&self) -> &'static str {
        words(self.part)[2]
    }

    /// True for one of the three gains of eq. 23, which are shown even
    /// where they are 0.
    pub fn is_of_the_paper(&self) -> bool {
        matches!(
            self.part,
            Part::Proportional | Part::Integral | Part::Derivative
        )
    }

    /// `(value of the fixed-point number − wanted)/wanted`; 0 where nothing is wanted.
    pub fn relative_error(&self) -> f64 {
        if self.wanted == 0.0 {
            0.0
        } else {
            (value(self.word) - self.wanted) / self.wanted
        }
    }
}

/// The parts of the law that have a gain, in its order.
pub const PARTS: [Part; 6] = [
    Part::Proportional,
    Part::Integral,
    Part::Derivative,
    Part::Velocity,
    Part::Acceleration,
    Part::Friction,
];

/// The run file's key of a gain, its name in the law and its unit there.
fn words(part: Part) -> [&'static str; 3] {
    match part {
        Part::Proportional => ["controller.kp", "Kp", "codes/count"],
        Part::Integral => ["controller.ki_per_s", "Ki·Δt", "codes/count"],
        Part::Derivative => ["controller.kd_s", "Kd/Δt", "codes/count"],
        Part::Velocity => ["controller.velocity_ff_s", "Kv/Δt", "codes/unit of v"],
        Part::Acceleration => ["controller.acceleration_ff_s2", "Ka/Δt²", "codes/unit of a"],
        Part::Friction => ["controller.friction_ff_codes", "Kf", "codes"],
    }
}

/// The run file's key of a gain.
pub fn key(part: Part) -> &'static str {
    words(part)[0]
}

/// The gains of a run as tables and reports show them, whichever law they belong to.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedPointGains {
    /// The gains that are not left out.
    pub rows: Vec<FixedPointGain>,
    /// `E`: errors up to this size are within the declared range \[counts\].
    pub error_limit: i32,
}

/// The gains of the paper's law, accepted by the firmware.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuantisedGains {
    /// The control law with these gains; it also knows the declared ranges
    /// (`error_limit`, `error_sum_limit`).
    pub pid: Pid,
    /// `Kp`, `Ki·Δt` and `Kd/Δt`, in this order.
    pub gains: [FixedPointGain; 3],
}

impl QuantisedGains {
    /// All of them as they are shown.
    pub fn fixed_point(&self) -> FixedPointGains {
        FixedPointGains {
            rows: self.gains.to_vec(),
            error_limit: self.pid.error_limit(),
        }
    }
}

/// Turns gains into fixed-point ones for a sample time \[ns\] and a travel of the motor
/// shaft \[counts\].
///
/// # Errors
/// [`QuantiseError`] that names the keys, their values and what fits.
///
/// ```
/// use hil_core::quantise::quantise;
/// use plant::PidGains;
///
/// // The paper at 1 ms: 250 mm are 99 900 counts.
/// let gains = PidGains { kp: 3.2, ki_per_s: 5.0, kd_s: 0.05 };
/// let quantised = quantise(&gains, 1_000_000, 99_900)?;
/// assert_eq!(quantised.gains[0].word.to_string(), "1717986918·2^-29");
/// assert!(quantised.gains[0].relative_error().abs() < 3e-10);
/// assert_eq!(quantised.pid.error_limit(), 1 << 27);
///
/// let gains = PidGains { kp: 9_000.0, ..gains };
/// let error = quantise(&gains, 1_000_000, 99_900).unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "controller.kp = 9000: the firmware's fixed-point gains hold at most 2047.99 \
///      at this sample time and errors up to 262144 counts",
/// );
/// # Ok::<(), hil_core::quantise::QuantiseError>(())
/// ```
pub fn quantise(
    gains: &PidGains,
    sample_time_ns: u64,
    travel_counts: i64,
) -> Result<QuantisedGains, QuantiseError> {
    let range = error_range(travel_counts).ok_or(QuantiseError::Travel(travel_counts))?;
    let sample_ns = sample_time_ns as f64;
    // Per sample: Ki·Δt and Kd/Δt with Δt in ns, times and over 10^9.
    let (kp, ki, kd) = (gains.kp, gains.ki_per_s, gains.kd_s);
    let settings = [
        (Gain::Proportional, kp, kp),
        (Gain::Integral, ki, ki * sample_ns / 1e9),
        (Gain::Derivative, kd, kd * 1e9 / sample_ns),
    ];

    let mut unfit = Vec::new();
    for (gain, value, wanted) in settings {
        let most = largest(gain, range);
        // Also false for NaN.
        if !(0.0..=most).contains(&wanted) {
            unfit.push(UnfitGain {
                key: key(gain.part()),
                value,
                largest: match gain {
                    Gain::Proportional => most,
                    Gain::Integral => most * 1e9 / sample_ns,
                    Gain::Derivative => most * sample_ns / 1e9,
                },
                error_limit: range.limit(),
            });
        }
    }
    if !unfit.is_empty() {
        return Err(QuantiseError::Gains(unfit));
    }

    let gains = settings.map(|(gain, value, wanted)| FixedPointGain {
        part: gain.part(),
        value,
        wanted,
        word: finest_word(wanted, gain.max_fraction_bits(), MANTISSA_BITS),
    });
    let [kp, ki_dt, kd_per_dt] = gains.map(|gain| gain.word);
    let accept = |error_bits| {
        Pid::accept(PidWords {
            kp,
            ki_dt,
            kd_per_dt,
            error_bits,
        })
    };
    let pid = (range.bits()..=ErrorRange::MAX_BITS)
        .rev()
        .find_map(|error_bits| accept(error_bits).ok())
        .map_or_else(|| accept(range.bits()), Ok)?;
    Ok(QuantisedGains { pid, gains })
}

/// The setpoint table of the positions of `k = 0, 1, …` \[counts\], each
/// modulo 2^32 as an encoder register shows it.
///
/// # Errors
/// [`QuantiseError::Refused`] without any position or with more than `N`.
pub fn setpoint_table<const N: usize>(
    positions: impl IntoIterator<Item = i64>,
) -> Result<SetpointTable<N>, QuantiseError> {
    let counts: Vec<i32> = positions.into_iter().map(firmware::counts::wrap).collect();
    Ok(SetpointTable::from_counts(&counts)?)
}

/// The smallest range with `E ≥ 2·|travel|`: the one that is asked for.
pub(crate) fn error_range(travel_counts: i64) -> Option<ErrorRange> {
    let twice = travel_counts.unsigned_abs().checked_mul(2)?;
    (ErrorRange::MIN_BITS..=ErrorRange::MAX_BITS)
        .find(|&bits| twice <= 1 << bits)
        .and_then(|bits| ErrorRange::from_bits(bits).ok())
}

/// Largest gain per sample that has a fixed-point form for this error range.
fn largest(gain: Gain, range: ErrorRange) -> f64 {
    match gain {
        // A full mantissa at the fewest fraction bits.
        Gain::Proportional | Gain::Integral => {
            MAX_MANTISSA / power_of_two(gain.min_fraction_bits(range.bits()))
        }
        Gain::Derivative => power_of_two(firmware::gains::DERIVATIVE_MAX_BITS),
    }
}

/// The number with the most fraction bits, at most `max`, whose mantissa fits
/// `mantissa_bits` bits; for gains from 0 to 2^`mantissa_bits` − 1.
pub(crate) fn finest_word(gain: f64, max: u8, mantissa_bits: u32) -> GainWord {
    let largest = ((1_u64 << mantissa_bits) - 1) as f64;
    let mantissa = |bits: u8| (gain * power_of_two(bits)).round();
    let bits = (0..=max).rev().find(|&bits| mantissa(bits) <= largest);
    let bits = bits.unwrap_or(0);
    // Whole and within the type: the conversion is exact.
    GainWord::new(mantissa(bits) as i32, bits)
}

/// `2^exponent` for exponents below 64, exactly.
pub(crate) fn power_of_two(exponent: u8) -> f64 {
    (1_u64 << exponent) as f64
}

/// The value of a fixed-point number, exactly: 31 bits and a power of two.
fn value(word: GainWord) -> f64 {
    f64::from(word.mantissa) / power_of_two(word.fraction_bits)
}

/// `value` with so many significant digits, rounded down so that what a message
/// calls allowed is allowed.
pub(crate) fn rounded_down(value: f64, significant: i32) -> f64 {
    if value == 0.0 {
        return value;
    }
    let digits = significant - 1 - value.log10().floor() as i32;
    // Dividing by a power of ten gives the nearest number to the decimal;
    // multiplying by a negative power of ten would not.
    if digits >= 0 {
        let scale = 10_f64.powi(digits);
        (value * scale).floor() / scale
    } else {
        let scale = 10_f64.powi(-digits);
        (value / scale).floor() * scale
    }
}

/// A gain that no fixed-point number can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnfitGain {
    /// Key in the run file.
    pub key: &'static str,
    /// Value in the run file.
    pub value: f64,
    /// Largest value that fits this sample time and error range.
    pub largest: f64,
    /// The errors that the travel asks for \[counts\].
    pub error_limit: i32,
}

impl UnfitGain {
    /// The allowed, as the second half of a sentence.
    pub fn because(&self) -> String {
        if self.value.is_finite() && self.value >= 0.0 {
            format!(
                "the firmware's fixed-point gains hold at most {} at this sample time and errors \
                 up to {} counts",
                rounded_down(self.largest, 6),
                self.error_limit
            )
        } else {
            "a gain must be finite and at least 0".to_owned()
        }
    }
}

/// Settings of a controller that the firmware cannot have. The run cannot start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantiseError {
    /// The travel is too long for the largest error range \[counts\].
    #[error(
        "the travel makes {0} encoder counts; the firmware takes at most {most}",
        most = MAX_ERROR / 2
    )]
    Travel(i64),
    /// Gains that no fixed-point number can hold: all of them.
    #[error("{}", lines(.0))]
    Gains(Vec<UnfitGain>),
    /// The firmware refuses its law, its converter, its motion or its setpoints.
    #[error("{0}")]
    Refused(Refusal),
    /// A setting that has no fixed-point form.
    #[error("{key} = {value}: {because}")]
    Setting {
        /// Key in the run file.
        key: &'static str,
        /// Value in the run file.
        value: f64,
        /// The allowed, as the second half of a sentence.
        because: String,
    },
    /// The gap could not be measured, or the electronics cannot be had; a sentence.
    #[error("{0}")]
    Bench(String),
    /// Without a sample time there are no gains per sample.
    #[error("a sampled law needs controller.sample_time_s")]
    NoSampleTime,
    /// The delay is to be measured on a chip, and none takes part.
    #[error(
        "only the steps of a chip are measured; run law \"firmware\" over a link to one \
         (--link qemu), or give a number of seconds"
    )]
    DelayUnknown,
}

impl From<Refusal> for QuantiseError {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl QuantiseError {
    /// A setting that is refused.
    pub(crate) fn setting(key: &'static str, value: f64, because: impl Display) -> Self {
        Self::Setting {
            key,
            value,
            because: because.to_string(),
        }
    }

    /// The same for what the firmware says of the setting of that key.
    pub(crate) fn of<E: Display>(key: &'static str, value: f64) -> impl FnOnce(E) -> Self {
        move |refusal| Self::setting(key, value, refusal)
    }

    /// The error of a motion with `needed` samples, for callers that know the
    /// number before they have computed the samples.
    pub fn too_long(needed: u64, capacity: usize) -> Self {
        Self::Refused(Refusal {
            what: What::Setpoints,
            value: i64::try_from(needed).unwrap_or(i64::MAX),
            least: 1,
            most: i64::try_from(capacity).unwrap_or(i64::MAX),
        })
    }
}

/// One gain a line.
fn lines(unfit: &[UnfitGain]) -> String {
    let line = |gain: &UnfitGain| format!("{} = {}: {}", gain.key, gain.value, gain.because());
    unfit.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: PidGains = PidGains {
        kp: 3.2,
        ki_per_s: 5.0,
        kd_s: 0.05,
    };

    /// The paper's travel of 250 mm.
    const TRAVEL: i64 = 99_900;

    #[test]
    fn the_papers_gains_have_words_from_1_ms_to_1_us() {
        for (sample_time_ns, ki_dt, kd_per_dt) in [
            (1_000_000, 0.005, 50.0),
            (100_000, 0.000_5, 500.0),
            (10_000, 0.000_05, 5_000.0),
            (1_000, 0.000_005, 50_000.0),
        ] {
            let quantised = quantise(&PAPER, sample_time_ns, TRAVEL).unwrap();
            for (gain, wanted) in quantised.gains.iter().zip([3.2, ki_dt, kd_per_dt]) {
                assert!((gain.wanted - wanted).abs() <= wanted * 4.5e-16, "{gain:?}");
                assert!(gain.relative_error().abs() <= 1e-7, "{gain:?}");
                let half_a_unit = 0.5 / power_of_two(gain.word.fraction_bits);
                assert!(
                    (value(gain.word) - gain.wanted).abs() <= half_a_unit,
                    "{gain:?}"
                );
            }
            assert_eq!(quantised.pid.error_limit(), 1 << 27);
            assert!(quantised.pid.error_sum_limit() >= 1 << 35);
        }
    }

    #[test]
    fn a_full_mantissa_rounds_by_less_than_2_to_the_minus_31() {
        let mut gain = 1e-3;
        while gain < 2_000.0 {
            let word = finest_word(gain, 40, MANTISSA_BITS);
            assert!(word.mantissa >= 1 << 30, "{gain}: {word}");
            assert!(
                (value(word) - gain).abs() <= gain / 2_147_483_648.0,
                "{gain}"
            );
            gain *= 1.037;
        }
    }

    #[test]
    fn a_gain_of_zero_is_the_word_zero() {
        let none = PidGains {
            kp: 0.0,
            ki_per_s: 0.0,
            kd_s: 0.0,
        };
        let quantised = quantise(&none, 1_000_000, 0).unwrap();
        for gain in quantised.gains {
            assert_eq!(gain.word.mantissa, 0);
            assert_eq!(gain.relative_error(), 0.0);
        }
    }

    #[test]
    fn the_error_range_is_at_least_twice_the_travel_and_2_to_the_17() {
        let bits = |travel| error_range(travel).map(ErrorRange::bits);
        assert_eq!(bits(0), Some(17));
        assert_eq!(bits(65_536), Some(17));
        assert_eq!(bits(65_537), Some(18));
        assert_eq!(bits(-65_537), Some(18));
        assert_eq!(bits(1 << 28), Some(29));
        assert_eq!(bits((1 << 28) + 1), None);
        assert_eq!(bits(i64::MIN), None);
        let error = quantise(&PAPER, 1_000_000, 300_000_000).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the travel makes 300000000 encoder counts; the firmware takes at most 268435456"
        );
    }

    #[test]
    fn all_unfit_gains_are_named_at_once_with_what_fits() {
        let gains = PidGains {
            kp: 9_000.0,
            ki_per_s: f64::NAN,
            kd_s: 1e9,
        };
        let error = quantise(&gains, 1_000_000, TRAVEL).unwrap_err().to_string();
        let lines: Vec<_> = error.lines().collect();
        assert_eq!(lines.len(), 3, "{error}");
        assert!(lines[0].starts_with("controller.kp = 9000: "), "{error}");
        assert!(lines[1].ends_with("a gain must be finite and at least 0"));
        assert!(lines[2].contains("hold at most 134217 at"), "{error}");
    }

    #[test]
    fn what_a_message_calls_allowed_is_accepted() {
        for sample_time_ns in [10_000, 123_457, 1_000_000, 30_000_000] {
            for travel in [0, TRAVEL, 1 << 28] {
                let huge = PidGains {
                    kp: 1e30,
                    ki_per_s: 1e30,
                    kd_s: 1e30,
                };
                let Err(QuantiseError::Gains(unfit)) = quantise(&huge, sample_time_ns, travel)
                else {
                    panic!("no word holds 1e30");
                };
                let [kp, ki_per_s, kd_s] = [0, 1, 2].map(|i| rounded_down(unfit[i].largest, 6));
                let allowed = PidGains { kp, ki_per_s, kd_s };
                let quantised = quantise(&allowed, sample_time_ns, travel);
                let Ok(quantised) = quantised else {
                    panic!("{allowed:?}: {quantised:?}");
                };
                assert!(i64::from(quantised.pid.error_limit()) >= (2 * travel).max(1 << 17));
            }
        }
    }

    #[test]
    fn setpoints_wrap_and_too_many_are_refused() {
        let table = setpoint_table::<2>([1 << 31, -1]).unwrap();
        assert_eq!(table.as_counts(), [i32::MIN, -1]);
        let error = setpoint_table::<2>([0, 1, 2]).unwrap_err();
        assert!(error.to_string().contains("needs 3 setpoints"), "{error}");
        assert_eq!(error, QuantiseError::too_long(3, 2));
        assert!(setpoint_table::<2>([]).is_err());
    }
}
