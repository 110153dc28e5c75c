//! The run file: one TOML file that describes one run.
//!
//! Every key has its unit in its name, unknown keys are refused, and all that
//! is wrong with a file is reported at once, one line each:
//!
//! ```text
//! cases/x.toml:12: motor.inertia_kg_m2 = -1 is not allowed: the rotor inertia J_m must be greater than 0 kg m²
//! cases/x.toml: [motor] (line 3) lacks inductance_h: armature inductance L, H, greater than 0
//! ```
//!
//! ```text
//! name or path ──► text ──► tree (every value with its line) ──► --set ──► checks ──► Case ──► settings in a report
//!                                                                          ▲           ▲           ▲
//!                                                        table of keys ────┴───────────┴───────────┤
//!                                                                                                  └──► schema, form, key reference, commented file
//! ```
//!
//! Values arrive in SI units: pitch in m/rad, backlash in rad, travel in m,
//! times in counted nanoseconds.

mod check;
mod consistency;
mod edited;
mod errors;
mod form;
mod key_path;
mod keys;
mod overrides;
mod profile;
mod schema;
mod starter;
mod table;
mod template;
mod tree;
mod tune;
pub mod tune_settings;
mod values;

use std::path::{Path, PathBuf};

use plant::{Amplifier, AxisParameters, Dac, Encoder, Motion, PidGains, Start};

pub(crate) use consistency::motion_key;
pub use consistency::{MOST_COUNTS, MOST_RK4_STEPS, MOST_ROWS};
pub use edited::with_sets;
pub use errors::{MOST_MISTAKES, Place, Problem, RunFileError, RunFileErrors, list_mistakes};
pub use form::{FormKey, FormSection};
pub use key_path::{KeyPath, KeyValue, renamed};
pub use keys::{
    Acts, Key, Kind, LARGEST_MAGNITUDE, LONGEST_TIME_S, List, Need, Range, SMALLEST_MAGNITUDE,
    Section, Way,
};
pub(crate) use profile::csv_line;
pub use profile::{Beside, file_beside};
pub use schema::schema;
pub use starter::{template_names, template_text, values_of_template};
pub use table::{LISTS, SECTIONS};
pub use template::Template;
pub use values::Value;

use crate::case::{
    Case, ComputationDelay, ControllerSettings, Law, Limit, RunSettings, TargetSettings,
};
use crate::figures;
use crate::options::AxisOptions;
use crate::rest::unfit_window;
use check::Values;
use tree::Table;
use tune_settings::TuneSettings;

/// A run file that was read and found right.
#[derive(Debug, Clone)]
pub struct RunFile {
    /// The run that it describes.
    pub case: Case,
    /// The file of the motion's profile, if it is one.
    pub profile: Option<PathBuf>,
    /// What `tune` is asked for, if the file says it.
    pub tune: Option<TuneSettings>,
    source_name: String,
    values: Values,
}

impl RunFile {
    /// Reads a run file from its text; `source_name` stands in messages, and
    /// its stem is the default of `name`. A profile comes from `beside`, see [`Beside`].
    ///
    /// # Errors
    /// Everything that is wrong with the text and the overrides.
    pub fn parse(
        source_name: &str,
        text: &str,
        sets: &[String],
        beside: impl Fn(&str, &str) -> Result<String, String>,
    ) -> Result<Self, RunFileErrors> {
        let (tree, mut findings) = overrides::document(source_name, text, sets)?;
        let values = check::check(&tree, &mut findings);
        let tune = tune::read(&tree, &values, &values, &mut findings);
        let profile = |path: &str| profile::points(path, &beside(source_name, path)?);
        match consistency::check(&values, &tree, &profile, &mut findings) {
            Some(motion) if findings.is_empty() => {
                let path = tree.section("motion").and_then(|keys| keys.get("profile"));
                let path = path.and_then(|node| node.value.text());
                let file = Self {
                    case: case(source_name, &tree, &values, motion),
                    source_name: source_name.to_owned(),
                    profile: path.map(|path| file_beside(source_name, path)),
                    tune,
                    values,
                };
                let of_window = unfit_window(&file.case);
                let of_window = of_window.map(|because| ("run.rest_window_s".to_owned(), because));
                match of_window.or_else(|| file.unfit_conversion()) {
                    Some((key, because)) => Err(file.refuse(&key, &because)),
                    None => Ok(file),
                }
            }
            _ => Err(findings.into_errors()),
        }
    }

    /// What a file of its own, with overrides of its keys, asks `tune` for.
    ///
    /// # Errors
    /// Everything that is wrong with the text.
    pub fn tune_of(
        &self,
        source_name: &str,
        text: &str,
        sets: &[String],
    ) -> Result<TuneSettings, RunFileErrors> {
        tune::read_file(source_name, text, sets, &self.values)
    }

    /// The error for a value that is refused further on, by whoever knows a
    /// limit that the run file does not: a gain that no word of the firmware
    /// can hold, a motion too long for its table. It names file, line, key and
    /// value like any other; `because` is the sentence that says what is
    /// allowed.
    ///
    /// ```
    /// use hil_core::runfile::{RunFile, builtin_text};
    ///
    /// let text = builtin_text("paper-1").unwrap_or_default();
    /// let none = |_: &str, _: &str| Err("no profile is needed".to_owned());
    /// let file = RunFile::parse("x.toml", text, &["controller.kp=1e9".to_owned()], none)?;
    /// assert_eq!(
    ///     file.refuse("controller.kp", "no word can hold more than 1e6").to_string(),
    ///     "--set controller.kp=1e9: controller.kp = 1e9 is not allowed: no word can hold more than 1e6",
    /// );
    /// # Ok::<(), hil_core::runfile::RunFileErrors>(())
    /// ```
    pub fn refuse(&self, key: &str, because: &str) -> RunFileErrors {
        let (place, problem) = match self.given_instead(key) {
            // The file says it in another way, of which it is made.
            Some((given, text)) => {
                let because = format!("{because}; {} makes it", self.values.quote(&given));
                let (place, _) = consistency::refusal(&self.values, &given, String::new());
                let key = key.to_owned();
                (place, Problem::NotAllowed { key, text, because })
            }
            None => consistency::refusal(&self.values, key, because.to_owned()),
        };
        RunFileErrors::one(&self.source_name, place, problem)
    }

    /// The first key that the file gives in the place of another one, and what it makes
    /// of that.
    fn given_instead(&self, key: &str) -> Option<(String, String)> {
        let known = KeyPath::find(key).ok()?;
        let given = self.values.given_instead(&known)?;
        Some((given, known.key.get(&self.case)?.to_toml()))
    }

    /// A key whose value is right and makes something out of bounds of what a case
    /// holds, and the sentence that says so.
    fn unfit_conversion(&self) -> Option<(String, String)> {
        let unfit = |key: &Key| match (key.kind, key.get(&self.case)?) {
            (Kind::Number(range), Value::Number(number)) if key.need.is_required() => {
                let words = check::check_number(number, range, key).err()?;
                let (name, number) = (key.name, values::show_number(number));
                Some(format!("it makes {name} = {number}, which must be {words}"))
            }
            _ => None,
        };
        let of_section =
            |section: &'static Section| section.ways.iter().map(move |ways| (section, ways));
        SECTIONS
            .iter()
            .flat_map(of_section)
            .find_map(|(section, ways)| {
                let (first, others) = ways.split_first()?;
                let others = others.iter().copied().flatten();
                let mut paths = others.map(|name| keys::path(section.name, name));
                let given = paths.find(|path| self.values.is_given(path))?;
                let mut held = first.iter().filter_map(|name| section.key(name));
                Some((given, held.find_map(unfit)?))
            })
    }
}

/// The case of a file without findings.
fn case(source_name: &str, tree: &Table, values: &Values, motion: Motion) -> Case {
    let mut case = blank(motion);
    for part in &values.parts {
        if let Some(list) = part.list {
            (list.begin)(&mut case);
        }
        for (key, entry) in &part.entries {
            if let Some(value) = entry.value {
                key.set(&mut case, value);
            }
        }
    }
    let name = tree.get("name").and_then(|node| node.value.text());
    let stem = || Path::new(source_name).file_stem()?.to_str();
    case.name = name.or_else(stem).unwrap_or("run").to_owned();
    // The limits in the order of the file.
    case.budget = tree.section("budget").map(|budget| {
        let limit = |(figure, _): &(String, _)| {
            let limit = values.get(&keys::path("budget", figure))?;
            Some(Limit::new(figures::find(figure)?.key, limit))
        };
        budget.entries.iter().filter_map(limit).collect()
    });
    case.keys_without_effect = values.without_effect(case.controller.law);
    case.template_values = starter::unchanged(case.template, values);
    case
}

/// A case in which no key has been set: every required key and every default
/// takes the place of what stands here.
fn blank(motion: Motion) -> Case {
    Case {
        name: String::new(),
        template: None,
        template_values: Vec::new(),
        axis: AxisParameters::default(),
        dac: Dac::with_range(0, 0.0),
        amplifier: Amplifier::default(),
        load_force_n: 0.0,
        loads: Vec::new(),
        start: Start::default(),
        encoder: Encoder::with_lines(0.0),
        controller: ControllerSettings {
            law: Law::Continuous,
            gains: PidGains::default(),
            cascade: None,
            sample_time_ns: None,
            computation_delay: ComputationDelay::Fixed(0),
        },
        options: AxisOptions::default(),
        target: TargetSettings::default(),
        motion,
        run: RunSettings::default(),
        budget: None,
        keys_without_effect: Vec::new(),
    }
}

/// Name and text of every built-in case.
const CASES: [(&str, &str); 5] = [
    ("paper-1", include_str!("../../../../cases/paper-1.toml")),
    ("paper-2", include_str!("../../../../cases/paper-2.toml")),
    ("paper-3", include_str!("../../../../cases/paper-3.toml")),
    ("paper-4", include_str!("../../../../cases/paper-4.toml")),
    (
        "paper-2-12bit",
        include_str!("../../../../cases/paper-2-12bit.toml"),
    ),
];

/// Names of the built-in cases: the paper's four simulations and the second
/// one with the 12-bit converter of the paper's table.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    CASES.iter().map(|(name, _)| *name)
}

/// The run file of a built-in case, with its comments.
///
/// ```
/// use hil_core::runfile::builtin_text;
///
/// assert!(builtin_text("paper-1").is_some_and(|text| text.contains("[motor]")));
/// assert!(builtin_text("paper-9").is_none());
/// ```
pub fn builtin_text(name: &str) -> Option<&'static str> {
    let (_, text) = CASES.iter().find(|(known, _)| *known == name)?;
    Some(text)
}

/// A built-in case with the overrides of a command line.
///
/// # Errors
/// Everything that is wrong with the overrides; a name that no case has.
///
/// ```
/// use hil_core::runfile;
///
/// let case = runfile::builtin("paper-2", &["controller.law=sampled".to_owned()])?;
/// assert_eq!(case.controller.sample_time_ns, Some(1_000_000));
///
/// let errors = runfile::builtin("paper-2", &["motor.inertia=1".to_owned()]).unwrap_err();
/// assert_eq!(
///     errors.to_string(),
///     "--set motor.inertia=1: unknown key motor.inertia; did you mean inertia_kg_m2 or inertia_kg_cm2?",
/// );
/// # Ok::<(), runfile::RunFileErrors>(())
/// ```
pub fn builtin(name: &str, sets: &[String]) -> Result<Case, RunFileErrors> {
    let Some(text) = builtin_text(name) else {
        let names: Vec<&str> = builtin_names().collect();
        let because = format!("the built-in cases are {}", names.join(", "));
        return Err(RunFileErrors::unreadable(name, because));
    };
    parse(name, text, sets)
}

/// The case that the text of a run file describes, with no other file to read; see
/// [`RunFile::parse`].
///
/// # Errors
/// Everything that is wrong with the text and the overrides.
pub fn parse(source_name: &str, text: &str, sets: &[String]) -> Result<Case, RunFileErrors> {
    RunFile::parse(source_name, text, sets, profile::nothing_beside).map(|file| file.case)
}
