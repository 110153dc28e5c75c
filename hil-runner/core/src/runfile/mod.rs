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
//! name or path ──► text ──► tree (every value with its line) ──► --set ──► checks ──► assemble ──► Case
//!                                                                          ▲
//!                                                             key table ───┴──► schema, key reference
//! ```
//!
//! Values arrive in SI units: pitch in m/rad, backlash in rad, travel in m,
//! times in counted nanoseconds.

mod assemble;
mod builtin;
mod check;
mod check_value;
mod consistency;
mod errors;
mod key_reference;
mod key_table;
mod keys;
mod nanoseconds;
mod overrides;
mod schema;
mod suggest;
mod template;
mod tree;
mod values;

pub use builtin::{builtin_names, builtin_text};
pub use consistency::{MOST_COUNTS, MOST_RK4_STEPS, MOST_ROWS};
pub use errors::{MOST_MISTAKES, Place, Problem, RunFileError, RunFileErrors, list_mistakes};
pub use key_reference::key_reference;
pub use key_table::SECTIONS;
pub use keys::{
    Acts, DefaultValue, Key, Kind, LARGEST_MAGNITUDE, LONGEST_TIME_S, Need, Range,
    SMALLEST_MAGNITUDE, Section,
};
pub use schema::schema;
pub use template::{KeyPath, KeyValue, Template};

use crate::case::Case;
use errors::Findings;
use values::Values;

/// A run file that was read and found right.
#[derive(Debug, Clone)]
pub struct RunFile {
    /// The run that it describes.
    pub case: Case,
    source_name: String,
    values: Values,
}

impl RunFile {
    /// Reads a run file from its text; `source_name` stands in messages, and
    /// its stem is the default of `name`.
    ///
    /// # Errors
    /// Everything that is wrong with the text and the overrides.
    pub fn parse(source_name: &str, text: &str, sets: &[String]) -> Result<Self, RunFileErrors> {
        let mut findings = Findings::new(source_name);
        let mut tree = match tree::parse_document(text) {
            Ok(tree) => tree,
            Err((place, problem)) => {
                findings.push(place, problem);
                return Err(findings.into_errors());
            }
        };
        overrides::apply(&mut tree, sets, &mut findings);
        let values = check::check(&tree, &mut findings);
        consistency::check(&values, &mut findings);
        match assemble::assemble(&values, &tree) {
            Some(case) if findings.is_empty() => Ok(Self {
                case,
                source_name: source_name.to_owned(),
                values,
            }),
            _ => Err(findings.into_errors()),
        }
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
    /// let file = RunFile::parse("x.toml", text, &["controller.kp=1e9".to_owned()])?;
    /// assert_eq!(
    ///     file.refuse("controller", "kp", "no word can hold more than 1e6").to_string(),
    ///     "--set controller.kp=1e9: controller.kp = 1e9 is not allowed: no word can hold more than 1e6",
    /// );
    /// # Ok::<(), hil_core::runfile::RunFileErrors>(())
    /// ```
    pub fn refuse(&self, section: &str, key: &str, because: &str) -> RunFileErrors {
        let mut findings = Findings::new(&self.source_name);
        let (place, problem) = consistency::refusal(&self.values, section, key, because.to_owned());
        findings.push(place, problem);
        findings.into_errors()
    }
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
///     "--set motor.inertia=1: unknown key motor.inertia; did you mean inertia_kg_m2?",
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

/// The case that the text of a run file describes; see [`RunFile::parse`].
///
/// # Errors
/// Everything that is wrong with the text and the overrides.
pub fn parse(source_name: &str, text: &str, sets: &[String]) -> Result<Case, RunFileErrors> {
    RunFile::parse(source_name, text, sets).map(|file| file.case)
}
