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

use std::sync::LazyLock;

use super::axis::Setting;
use hil_core::case::Case;
use hil_core::options::Feedback;
use hil_core::runfile::{Key, KeyPath, Kind, SECTIONS, Section, Template};

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

impl Steps {
    /// The steps that a key counts in, by its unit; limits of the budget judge, and
    /// are left as they are.
    fn of(section: &str, key: &Key) -> Option<Self> {
        match (section, key.name, key.unit) {
            ("budget", ..) => None,
            (_, "rest_dead_band_counts" | "following_error_counts", _) => {
                Some(Self::PositionCounts)
            }
            (.., "counts" | "counts/s") => Some(Self::Counts),
            (.., "codes" | "codes/s") => Some(Self::Codes),
            (.., "codes/count" | "codes/(count s)" | "codes s/count" | "codes s²/count") => {
                Some(Self::CodesPerCount)
            }
            _ => None,
        }
    }
}

/// Every key that counts in steps.
static COUNTED: LazyLock<Vec<(KeyPath, Steps)>> = LazyLock::new(|| {
    let counted = |section: &'static Section| {
        let path = |key| KeyPath {
            section: section.name,
            key,
        };
        let steps = move |key| Some((path(key), Steps::of(section.name, key)?));
        section.keys.iter().filter_map(steps)
    };
    SECTIONS.iter().flat_map(counted).collect()
});

/// The keys that a row needs so that its loop is that which `template` and
/// `changes` describe at the steps of `base`; `case` has the steps of the row.
pub(super) fn at_other_steps(
    base: &Case,
    case: &Case,
    template: &Template,
    changes: &[Setting],
) -> Vec<Setting> {
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
    let scaled = |(key, steps): &(KeyPath, Steps)| {
        let path = key.path();
        let changed = changes.iter().find(|(changed, _)| changed.path() == path);
        let number = match changed {
            Some((_, value)) => value.number()?,
            None => template.number(key)?,
        };
        let mut size = (number * factor(*steps)).abs();
        // Nothing stays nothing, and something does not become nothing.
        if matches!(key.key.kind, Kind::Whole(..)) && number != 0.0 {
            size = size.max(1.0);
        }
        Some((*key, key.value(size.copysign(number))))
    };
    // With the paper's law alone the other keys do nothing, and must not be
    // what turns the rest on.
    let acts = |key: &KeyPath| !case.options.is_off() || !key.key.is_of_firmware();
    let counted = COUNTED.iter().filter(|(key, _)| acts(key));
    counted.filter_map(scaled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unit of a key says the steps.
    #[test]
    fn keys_count_in_the_steps_of_their_unit() {
        let steps = |path: &str| {
            let counted = COUNTED.iter().find(|(key, _)| key.path() == path);
            counted.map(|(_, steps)| *steps)
        };
        for (path, wanted) in [
            ("controller.kp", Some(Steps::CodesPerCount)),
            ("gain_change.kd_s", Some(Steps::CodesPerCount)),
            ("controller.slew_limit_codes_per_s", Some(Steps::Codes)),
            ("limits.following_error_counts", Some(Steps::PositionCounts)),
            ("inject.encoder_glitch_counts", Some(Steps::Counts)),
            ("limits.following_error_per_speed_s", None),
            ("encoder.counts_per_rad", None),
            ("budget.max_abs_dac_code", None),
            ("budget.rest_encoder_counts", None),
        ] {
            assert_eq!(steps(path), wanted, "{path}");
        }
        assert_eq!(COUNTED.len(), 17);
    }
}
