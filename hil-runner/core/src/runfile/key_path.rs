//! A key by its path, and for a path that leads to none the nearest of the known
//! names.

use super::errors::Problem;
use super::keys::{Key, Kind, Way, either, path};
use super::table;
use crate::number::seconds;

/// A key of the run file by its path, such as `controller.kp`.
#[derive(Debug, Clone, Copy)]
pub struct KeyPath {
    /// Name of its section.
    pub section: &'static str,
    /// The key's row in the table.
    pub key: &'static Key,
}

impl KeyPath {
    /// The key at a path.
    ///
    /// # Errors
    /// A sentence for a path that names no key, with what may have been meant.
    ///
    /// ```
    /// use hil_core::runfile::KeyPath;
    ///
    /// assert_eq!(KeyPath::find("controller.kp")?.key.name, "kp");
    /// let error = KeyPath::find("controller.sample_time").unwrap_err();
    /// assert_eq!(error, "unknown key controller.sample_time; did you mean sample_time_s?");
    /// let error = KeyPath::find("budget.late_steps").unwrap_err();
    /// assert_eq!(error, "budget.late_steps is now deadline_misses");
    /// # Ok::<(), String>(())
    /// ```
    pub fn find(path: &str) -> Result<Self, String> {
        let (section_name, key_name) = path.split_once('.').unwrap_or(("", path));
        if let Some(list) = table::find_list(section_name) {
            let name = list.row.name;
            return Err(format!(
                "{path} is a key of a row: each [[{name}]] has its own, and only a run file and the \
                 --set of a run reach it"
            ));
        }
        let Some(known) = table::find(section_name) else {
            let what = format!("section [{section_name}] in {path}");
            return Err(section(what, section_name).0.to_string());
        };
        let Some(found) = known.key(key_name) else {
            let (problem, _) = key(format!("key {path}"), section_name, key_name);
            return Err(problem.to_string());
        };
        Ok(Self {
            section: known.name,
            key: found,
        })
    }

    /// The path.
    pub fn path(&self) -> String {
        path(self.section, self.key.name)
    }

    /// The ways of the quantity that the key gives; none for a key that is the only one.
    pub fn ways(&self) -> &'static [Way] {
        let section = table::find(self.section);
        section.map_or(&[], |section| section.ways_with(self.key.name))
    }

    /// True if the two give one quantity in two ways, such as `lines` and
    /// `counts_per_rad`: only one of them can be given, and by `--set` it takes the
    /// place of the other.
    ///
    /// ```
    /// use hil_core::runfile::KeyPath;
    ///
    /// let [lines, counts] = ["encoder.lines", "encoder.counts_per_rad"].map(KeyPath::find);
    /// assert!(lines?.excludes(&counts?));
    /// # Ok::<(), String>(())
    /// ```
    pub fn excludes(&self, other: &Self) -> bool {
        self.section == other.section
            && table::find(self.section)
                .is_some_and(|section| section.excludes(self.key.name, other.key.name))
    }

    /// A number as a value of this key: times in whole nanoseconds, whole
    /// numbers whole, the nearest each.
    pub fn value(&self, number: f64) -> KeyValue {
        let (whole, of): (_, fn(i64) -> KeyValue) = match self.key.kind {
            Kind::Time(_) => (1e9 * number, KeyValue::Nanoseconds),
            Kind::Whole(..) => (number, KeyValue::Whole),
            _ => return KeyValue::Number(number),
        };
        nearest_whole(whole).map_or(KeyValue::Number(number), of)
    }
}

/// The nearest whole number, where `i64` holds it exactly.
fn nearest_whole(number: f64) -> Option<i64> {
    const MOST: f64 = 9_007_199_254_740_992.0; // 2^53
    let whole = libm::round(number);
    (whole.abs() <= MOST).then_some(whole as i64)
}

impl PartialEq for KeyPath {
    fn eq(&self, other: &Self) -> bool {
        core::ptr::eq(self.key, other.key)
    }
}

/// Another value of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum KeyValue {
    /// A number.
    Number(f64),
    /// A time, written in seconds \[ns\].
    Nanoseconds(i64),
    /// A whole number.
    Whole(i64),
    /// Anything else, as TOML.
    Toml(String),
}

impl KeyValue {
    /// The value as a number, in the key's unit; [`None`] for what is none.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Nanoseconds(ns) => Some(u64::try_from(*ns).map_or(*ns as f64 / 1e9, seconds)),
            Self::Whole(whole) => Some(*whole as f64),
            Self::Toml(_) => None,
        }
    }

    /// The value as a run file has it.
    pub fn to_toml(&self) -> String {
        match self {
            Self::Number(number) => format!("{number:?}"),
            Self::Nanoseconds(ns) => format!("{ns}e-9"),
            Self::Whole(whole) => whole.to_string(),
            Self::Toml(text) => text.clone(),
        }
    }
}

/// The problem with an unknown name, and the names that were probably meant.
pub(super) type Unknown = (Problem, Vec<&'static str>);

/// Names that something had before, for sentences that tell the new one; no old
/// name is taken in the place of the new one. Keys of the run file within their
/// section, and figures: old name, new name.
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
/// use hil_core::runfile::renamed;
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

/// The problem with the names that are near, or else with these words.
fn near(
    (what, unknown): (String, &str),
    names: &[&'static str],
    show: fn(&&str) -> String,
    otherwise: String,
) -> Unknown {
    let meant = nearest(unknown, names);
    let hint = match either(meant.iter().map(show)) {
        none if none.is_empty() => otherwise,
        names => format!("did you mean {names}?"),
    };
    (Problem::Unknown { what, hint }, meant)
}

/// The header that a section or a row of a list has in a file.
pub(super) fn header(name: &str) -> String {
    match table::find_list(name) {
        Some(_) => format!("[[{name}]]"),
        None => format!("[{name}]"),
    }
}

/// The problem with `what`, such as `section [moter]`: a section that does not exist.
pub(super) fn section(what: String, unknown: &str) -> Unknown {
    let names = table::all().skip(1).map(|section| section.name);
    let names: Vec<&str> = names.collect();
    let otherwise = format!("the sections are {}", names.join(", "));
    near((what, unknown), &names, |name| header(name), otherwise)
}

/// The problem with `what`, such as `key motor.inertia`: a key that its section does not
/// have; `section` is empty at the top of the file.
pub(super) fn key(what: String, section: &str, unknown: &str) -> Unknown {
    // A name that is right, but in the wrong place: TOML puts every key into
    // the section whose header stands above it.
    let elsewhere = match table::all().find(|s| s.key(unknown).is_some()) {
        Some(home) if home.name.is_empty() => Some(format!(
            "{unknown} stands at the top of the file, before the first section"
        )),
        Some(home) => Some(format!("{unknown} belongs to {}", header(home.name))),
        None => table::find(unknown).map(|_| format!("{unknown} is a section; write [{unknown}]")),
    };
    if let Some(hint) = elsewhere {
        return (Problem::Unknown { what, hint }, Vec::new());
    }
    let known = table::all().find(|known| known.name == section);
    if let Some(name) = renamed(unknown)
        && known.is_some_and(|known| known.key(name).is_some())
    {
        let key = what.trim_start_matches("key ").to_owned();
        return (Problem::Renamed { key, name }, Vec::new());
    }
    let keys = known.iter().flat_map(|section| section.keys);
    let names: Vec<&str> = keys.map(|key| key.name).collect();
    let otherwise = if section.is_empty() {
        "only name and template stand outside the sections".to_owned()
    } else {
        format!("the keys of {} are {}", header(section), names.join(", "))
    };
    let show = |name: &&str| (*name).to_owned();
    near((what, unknown), &names, show, otherwise)
}

/// Up to three names near `unknown`, the nearest first.
fn nearest<'a>(unknown: &str, names: &[&'a str]) -> Vec<&'a str> {
    let unknown = unknown.to_lowercase().replace('-', "_");
    let near = names.iter();
    let near: Vec<_> = near
        .filter_map(|name| Some((distance(&unknown, name)?, *name)))
        .collect();
    let best = near.iter().map(|(distance, _)| *distance).min();
    // One clear favourite stands alone; others only show if they are as near.
    let best = near.iter().filter(|(distance, _)| Some(*distance) == best);
    best.map(|(_, name)| *name).take(3).collect()
}

/// Edits between the two if they are few enough for a slip; a name without
/// its unit counts as one edit.
fn distance(unknown: &str, name: &str) -> Option<usize> {
    let prefix = unknown.len() >= 2 && name.starts_with(&format!("{unknown}_"));
    if prefix {
        return Some(1);
    }
    let longest = unknown.chars().count().max(name.len());
    // A long key cannot be a slip, and the table below is quadratic.
    if unknown.chars().count() > 2 * name.len() {
        return None;
    }
    let edits = strsim::levenshtein(unknown, name);
    (edits <= longest.div_ceil(3)).then_some(edits)
}

#[cfg(test)]
mod tests {
    use super::{KeyPath, key, nearest, section};

    fn section_meant(unknown: &str) -> Vec<&'static str> {
        section(String::new(), unknown).1
    }

    fn told(section: &str, name: &str) -> (String, Vec<&'static str>) {
        let (problem, meant) = key(format!("key {section}.{name}"), section, name);
        (problem.to_string(), meant)
    }

    #[test]
    fn slips_are_recognised_and_strangers_are_not() {
        assert_eq!(section_meant("moter"), ["motor"]);
        assert_eq!(section_meant("quaternion"), [""; 0]);
        let meant = |section, name| told(section, name).1;
        assert_eq!(
            meant("motor", "inertia"),
            ["inertia_kg_m2", "inertia_kg_cm2"]
        );
        assert_eq!(meant("budget", "final_eror_um"), ["final_error_um"]);
        assert_eq!(meant("motor", "Resistance-Ohm"), ["resistance_ohm"]);
        let words = |section, name| told(section, name).0;
        assert!(words("motor", "kp").contains("belongs to [controller]"));
        assert!(words("motor", "force_n").contains("belongs to [[load]]"));
        let (loads, _) = section("section [loads]".to_owned(), "loads");
        assert_eq!(
            loads.to_string(),
            "unknown section [loads]; did you mean [[load]]?"
        );
        let row = KeyPath::find("load.force_n").unwrap_err();
        assert!(row.contains("each [[load]] has its own"), "{row}");
        assert_eq!(nearest("zz", &["kp", "kd_s"]), [""; 0]);
    }

    #[test]
    fn an_old_name_is_told_in_the_section_of_the_new_one() {
        let (found, _) = told("budget", "late_steps");
        assert_eq!(found, "budget.late_steps is now deadline_misses");
        assert!(told("motor", "late_steps").0.starts_with("unknown key"));
    }
}
