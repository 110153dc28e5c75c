//! Names that something had before, for sentences that tell the new one. No old
//! name is taken in the place of the new one.

/// Keys of the run file within their section, and figures: old name, new name.
const RENAMED: [(&str, &str); 7] = [
    ("homing_detection", "backlash_measurement_detection"),
    (
        "homing_speed_counts_per_s",
        "backlash_measurement_speed_counts_per_s",
    ),
    ("homing_effort_codes", "backlash_measurement_effort_codes"),
    ("late_steps", "deadline_misses"),
    ("margin_closed", "modulus_margin_contact"),
    ("margin_open", "modulus_margin_gap"),
    ("theory_margin_closed", "theory_modulus_margin_contact"),
];

/// The name that a key or figure has now; [`None`] if it never had another.
///
/// ```
/// use hil_core::renamed::renamed;
///
/// assert_eq!(renamed("margin_closed"), Some("modulus_margin_contact"));
/// assert_eq!(renamed("backlash.homing_detection"), Some("backlash_measurement_detection"));
/// assert_eq!(renamed("final_error_um"), None);
/// ```
pub fn renamed(name: &str) -> Option<&'static str> {
    let name = name.rsplit_once('.').map_or(name, |(_, name)| name);
    let (_, now) = RENAMED.iter().find(|(old, _)| *old == name)?;
    Some(now)
}
