//! Words and unit of a column, from its name.

use super::unit::{Unit, suffix};
use hil_core::figures::{CHIP_FIGURES, SUMMARY_FIGURES};
use hil_core::runfile::SECTIONS;

/// Name and unit of a column in a picture.
///
/// ```
/// use hil_runner::study::picture::Label;
///
/// let label = Label::of("peak_following_error_mm");
/// assert_eq!(label.title(), "Peak following error [mm]");
/// assert_eq!(Label::of("drive.dac_bits").words, "Width n of the D/A converter");
/// assert_eq!(Label::of("theory.modulus_margin").title(), "Modulus margin (theory)");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// The quantity in words, with a capital.
    pub words: String,
    /// Symbol of its unit; empty where there is none.
    pub unit: String,
}

impl Label {
    /// Words and unit of a column: those of the figure or of the run file's key
    /// of that name; of any other name the suffix is the unit and the rest is
    /// read out.
    pub fn of(column: &str) -> Self {
        // The factor of an axis that follows another key.
        if let Some((key, times)) = column.split_once('/') {
            let (key, times) = (Self::of(key).words, Self::of(times).words);
            return Self::new(&format!("{key} / {}", within(&times)), "");
        }
        let mut figures = SUMMARY_FIGURES.iter().chain(&CHIP_FIGURES);
        if let Some(figure) = figures.find(|figure| figure.key == column) {
            return Self::new(figure.label, figure.unit);
        }
        if let Some((section, name)) = column.rsplit_once('.') {
            let section = SECTIONS.iter().find(|known| known.name == section);
            if let Some(key) = section.and_then(|section| section.key(name)) {
                // Pictures have room for signs only.
                let unit = if key.unit == "deg" { "°" } else { key.unit };
                // Up to the first remark.
                let words = key.meaning.split([',', ';', '(']).next();
                return Self::new(words.unwrap_or_default().trim_end(), unit);
            }
        }
        from_name(column)
    }

    /// Title of an axis: `Words [unit]`.
    pub fn title(&self) -> String {
        match self.unit.as_str() {
            "" => self.words.clone(),
            unit => format!("{} [{unit}]", self.words),
        }
    }

    fn new(words: &str, unit: &str) -> Self {
        Self {
            words: capital(words),
            unit: unit.to_owned(),
        }
    }

    /// The unit with what is known of it.
    pub(super) fn unit(&self) -> Unit {
        Unit::of(&self.unit)
    }
}

/// A name that nobody has described: `theory.peak_error_mm`.
fn from_name(column: &str) -> Label {
    let (group, name) = column.rsplit_once('.').unwrap_or(("", column));
    let (suffix, unit) = suffix(name).unwrap_or_default();
    let words = name.strip_suffix(suffix).unwrap_or(name);
    // A name that is all unit, such as "s", is its own word.
    let words = if words.is_empty() { name } else { words };
    let words = words.split('_').map(spelled);
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let words = match group.replace(['.', '_'], " ") {
        group if group.is_empty() => words.join(" "),
        group => format!("{} ({group})", words.join(" ")),
    };
    Label::new(&words, unit)
}

/// Parts of names that are not words.
fn spelled(word: &str) -> &str {
    match word {
        "acc" => "acceleration",
        "abs" => "",
        "rms" => "RMS",
        "dac" => "DAC",
        "ref" => "reference",
        other => other,
    }
}

/// The words as they stand within a sentence: without their capital, unless
/// they begin with a symbol or an abbreviation.
pub(super) fn within(words: &str) -> String {
    let mut letters = words.chars();
    match (letters.next(), letters.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => {
            first.to_lowercase().chain(letters).collect()
        }
        _ => words.to_owned(),
    }
}

/// With a capital.
pub(super) fn capital(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_words_and_units() {
        for (column, title) in [
            // A factor is named by both keys and has no unit.
            (
                "controller.computation_delay_s/controller.sample_time_s",
                "Delay from sample to new voltage / sample time Δt",
            ),
            // Figures and keys have their own words.
            ("peak_abs_acc_mps2", "Peak carriage acceleration [m/s²]"),
            ("controller.sample_time_s", "Sample time Δt [s]"),
            ("controller.kd_s", "Derivative gain K_d [codes s/count]"),
            (
                "transmission.backlash_half_deg",
                "Half backlash b of the joint [°]",
            ),
            (
                "controller.derivative_filter_s",
                "Time constant of the derivative's first-order filter [s]",
            ),
            ("drive.dac_lsb_v", "D/A step K_dac [V]"),
            // Other names are read out.
            ("peak_abs_speed_radps", "Peak speed [rad/s]"),
            ("rms_acc_noise_mps2", "RMS acceleration noise [m/s²]"),
            ("theory.limit_cycle_um", "Limit cycle (theory) [µm]"),
            ("s", "S [s]"),
            ("seed", "Seed"),
        ] {
            assert_eq!(Label::of(column).title(), title);
        }
    }
}
