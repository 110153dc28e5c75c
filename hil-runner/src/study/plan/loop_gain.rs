//! The loop of the base at other steps of encoder and converter: everything
//! that counts in steps is scaled with them, so that volts and radians stay.
//!
//! ```text
//! codes           K_dac'/K_dac  of the base over that of the row
//! counts          K_enc  of the row over that of the base; of the load's encoder z·K_load, where it closes the loop
//! codes/count     (K_enc·K_dac)' / (K_enc·K_dac)
//! ```
//!
//! Whole numbers of counts and codes become the nearest whole number, at least 1
//! in size. Word lengths stay: they are what a finer step may ask more of.

use hil_core::case::Case;
use hil_core::options::Feedback;
use hil_core::runfile::{KeyPath, KeyValue, Kind, Template};

/// Unit that a key is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Steps {
    /// Codes for each count of the motor's encoder.
    CodesPerCount,
    /// Codes of the converter.
    Codes,
    /// Counts of the motor's encoder.
    Counts,
    /// Counts of the encoder that closes the loop.
    PositionCounts,
}

/// The gains, which every rung has.
const GAINS: [&str; 3] = ["controller.kp", "controller.ki_per_s", "controller.kd_s"];

/// Other keys that count in steps, and act only beyond the paper's law.
const BEYOND: [(&str, Steps); 14] = [
    ("gain_change.kp", Steps::CodesPerCount),
    ("gain_change.ki_per_s", Steps::CodesPerCount),
    ("gain_change.kd_s", Steps::CodesPerCount),
    ("controller.velocity_ff_s", Steps::CodesPerCount),
    ("controller.acceleration_ff_s2", Steps::CodesPerCount),
    ("controller.friction_ff_codes", Steps::Codes),
    ("controller.slew_limit_codes_per_s", Steps::Codes),
    ("controller.rest_dead_band_counts", Steps::PositionCounts),
    ("limits.following_error_counts", Steps::PositionCounts),
    ("limits.count_jump_counts", Steps::Counts),
    ("limits.encoder_loss_codes", Steps::Codes),
    (
        "backlash.backlash_measurement_speed_counts_per_s",
        Steps::Counts,
    ),
    ("backlash.backlash_measurement_effort_codes", Steps::Codes),
    ("inject.encoder_glitch_counts", Steps::Counts),
];

/// The keys that a row needs so that its loop is that which `template` and
/// `changes` describe at the steps of `base`; `case` has the steps of the row.
pub(super) fn at_other_steps(
    base: &Case,
    case: &Case,
    template: &Template,
    changes: &[(KeyPath, KeyValue)],
) -> Vec<(KeyPath, KeyValue)> {
    let per_rad = |case: &Case| case.encoder.counts_per_rad * case.dac.step_v;
    // Per radian of the motor, both.
    let z = base.axis.transmission.gear_ratio;
    let position = |case: &Case| match (case.options.law.feedback, case.options.encoders.load) {
        (Feedback::Dual, Some(load)) => z * load.counts_per_rad,
        _ => case.encoder.counts_per_rad,
    };
    let factor = |steps: Steps| match steps {
        Steps::CodesPerCount => per_rad(base) / per_rad(case),
        Steps::Codes => base.dac.step_v / case.dac.step_v,
        Steps::Counts => case.encoder.counts_per_rad / base.encoder.counts_per_rad,
        Steps::PositionCounts => position(case) / position(base),
    };
    let scaled = |(path, steps): (&str, Steps)| {
        let key = KeyPath::find(path).ok()?;
        let changed = changes.iter().find(|(changed, _)| changed.path() == path);
        let number = match changed {
            Some((_, value)) => value.number()?,
            None => template.number(&key)?,
        };
        let scaled = number * factor(steps);
        // Nothing stays nothing, and something does not become nothing.
        let steps = matches!(key.key.kind, Kind::Whole(..)) && number != 0.0;
        let least = if steps {
            scaled.abs().max(1.0)
        } else {
            scaled.abs()
        };
        Some((key, key.value(least.copysign(number))))
    };
    // With the paper's law alone the other keys do nothing, and must not be
    // what turns the rest on.
    let beyond = if case.options.is_off() {
        &[]
    } else {
        &BEYOND[..]
    };
    let gains = GAINS.map(|path| (path, Steps::CodesPerCount));
    gains
        .into_iter()
        .chain(beyond.iter().copied())
        .filter_map(scaled)
        .collect()
}
