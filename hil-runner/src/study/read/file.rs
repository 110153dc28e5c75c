//! The study file: a base case, axes over its keys, a plan.
//!
//! ```toml
//! base = "paper-2"
//! rungs = ["sampled", "quantised"]
//!
//! [set]
//! run.duration_s = 3.0
//!
//! [[axis]]
//! key = "controller.sample_time_s"
//! from = 1e-4
//! to = 1e-2
//! points = 21
//! scale = "log"
//! ```

use core::fmt;
use core::ops::Range;
use std::io::Read as _;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;
use toml::de::DeTable;

use super::ready;
use crate::study::picture::Picture;
use crate::study::plan::axis::Scale;
use crate::study::plan::points::PlanKind;
use crate::study::plan::{LoopGain, Theory};
use hil_core::distribution::Distribution;
use hil_core::runfile::list_mistakes;

/// A study file as it is written.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct StudyFile {
    /// Name of the study; the file's stem if left out.
    #[schemars(regex(pattern = r"^[\p{L}\p{N}_-]{1,100}$"))]
    pub(super) name: Option<String>,
    /// Title of the page; the name if left out.
    pub(super) title: Option<String>,
    /// Question of the study, in a sentence or two.
    #[serde(default)]
    pub(super) description: String,
    /// Remarks to know before a figure is quoted, a sentence each.
    #[serde(default)]
    pub(super) notes: Vec<String>,
    /// Built-in case, or path beside the study file.
    #[schemars(with = "String")]
    pub(super) base: Spanned<String>,
    /// Points of the axes' space that are run.
    #[serde(default)]
    pub(super) plan: PlanKind,
    /// Number of points of a plan that draws.
    #[schemars(with = "Option<u64>", range(min = 1))]
    pub(super) runs: Option<Spanned<u64>>,
    /// Seed of a plan that draws.
    #[serde(default)]
    pub(super) seed: u64,
    /// Rungs that every point is run on; that of the base if left out.
    #[schemars(with = "Option<Vec<String>>", length(min = 1))]
    pub(super) rungs: Option<Spanned<Vec<String>>>,
    /// Comparisons such as `controller.kd_s < 0.1`; points that break one are left out.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub(super) constraints: Vec<Spanned<String>>,
    /// Keys that differ from the base in every run.
    #[serde(default)]
    #[schemars(skip)]
    pub(super) set: toml::Table,
    /// Limits instead of those of the base.
    #[schemars(skip)]
    pub(super) budget: Option<toml::Table>,
    /// Keys of the run file with the values that they take.
    #[serde(default)]
    pub(super) axis: Vec<AxisFile>,
    /// Fate of the loop where steps of encoder or converter change.
    #[serde(default)]
    pub(super) loop_gain: LoopGain,
    /// Predictions that stand beside the figures.
    #[serde(default)]
    pub(super) theory: Vec<Theory>,
    /// True if it is found out what feeds a limit cycle.
    #[serde(default = "yes")]
    pub(super) feeding: bool,
    /// True if each rung is compared with the one before it, row by row.
    #[serde(default)]
    pub(super) differences: bool,
    /// Part of the runs that must pass \[%\].
    #[schemars(with = "Option<f64>", range(min = 0, max = 100))]
    pub(super) required_yield_percent: Option<Spanned<f64>>,
    /// Pictures of the results.
    #[serde(default)]
    pub(super) picture: Vec<Picture>,
}

fn yes() -> bool {
    true
}

/// One `[[axis]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisFile {
    /// Key of the run file, section.key.
    #[schemars(with = "String")]
    pub(super) key: Spanned<String>,
    /// Key by whose value the axis' own is multiplied.
    #[schemars(with = "Option<String>")]
    pub(super) times: Option<Spanned<String>>,
    /// The values themselves.
    #[schemars(with = "Option<Vec<serde_json::Value>>", length(min = 1))]
    pub(super) values: Option<Spanned<Vec<toml::Value>>>,
    /// Names of the values in results.
    pub(super) labels: Option<Vec<String>>,
    /// First value of a range.
    pub(super) from: Option<f64>,
    /// Last value of a range.
    pub(super) to: Option<f64>,
    /// Number of values of a range, on a grid.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub(super) points: Option<u64>,
    /// Spacing of a range.
    pub(super) scale: Option<Scale>,
    /// Distribution that the values are drawn from.
    pub(super) distribution: Option<Distribution>,
}

/// Everything that is wrong with a study; prints one line for each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudyFileError {
    lines: Vec<String>,
}

impl StudyFileError {
    /// One sentence about a whole study.
    pub(super) fn of(source_name: &str, sentence: impl fmt::Display) -> Self {
        Self {
            lines: vec![format!("{source_name}: {sentence}")],
        }
    }
}

impl fmt::Display for StudyFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        list_mistakes(f, &self.lines)
    }
}

impl std::error::Error for StudyFileError {}

/// Collects what is wrong, each with its line.
#[derive(Debug)]
pub(super) struct Findings<'t> {
    source_name: &'t str,
    text: &'t str,
    lines: Vec<(usize, String)>,
}

impl<'t> Findings<'t> {
    pub(super) fn new(source_name: &'t str, text: &'t str) -> Self {
        Self {
            source_name,
            text,
            lines: Vec::new(),
        }
    }

    /// A finding at a place of the text.
    pub(super) fn push(&mut self, span: Range<usize>, sentence: impl fmt::Display) {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let words = format!("{}:{line}: {sentence}", self.source_name);
        self.lines.push((line, visible(&words)));
    }

    /// The place of `section.key=value` of `[set]`, or of the limit of `[budget]`
    /// that `problem` names.
    pub(super) fn place_of(&self, set: &str, problem: &str) -> Option<Range<usize>> {
        let file = DeTable::parse(self.text).ok()?;
        let section = |name: &str| file.get_ref().get(name)?.get_ref().as_table();
        let (path, _) = set.split_once('=')?;
        let Some((name, key)) = path.split_once('.') else {
            let named = |key: &str| problem.contains(&format!("budget.{key}"));
            let limits = section("budget")?.iter();
            let limits = limits.filter(|(key, _)| named(key.get_ref()));
            // A name may begin as another does.
            let limit = limits.max_by_key(|(key, _)| key.get_ref().len());
            return limit.map(|(_, value)| value.span());
        };
        let keys = section("set")?.get(name)?.get_ref().as_table()?;
        keys.get(key).map(Spanned::span)
    }

    /// A finding about the whole.
    pub(super) fn push_whole(&mut self, sentence: impl fmt::Display) {
        let words = format!("{}: {sentence}", self.source_name);
        self.lines.push((usize::MAX, visible(&words)));
    }

    /// The findings, if there are any.
    ///
    /// # Errors
    /// All findings, by line.
    pub(super) fn into_result(mut self) -> Result<(), StudyFileError> {
        self.lines.sort();
        let lines: Vec<String> = self.lines.into_iter().map(|(_, line)| line).collect();
        match lines.is_empty() {
            true => Ok(()),
            false => Err(StudyFileError { lines }),
        }
    }
}

/// Reads the text of a study file.
///
/// # Errors
/// A text that is no TOML, or has keys or types that a study has not.
pub(super) fn parse(source_name: &str, text: &str) -> Result<StudyFile, StudyFileError> {
    toml::from_str(text).map_err(|error| {
        let mut findings = Findings::new(source_name, text);
        let message = error.message().replace('\n', " ");
        let message = message.replace("expected u64", "expected a whole number from 0 on");
        let mut message = message.replace("expected f64", "expected a number");
        if let Some(key) = error.span().and_then(|span| key_before(text, span.start)) {
            message = format!("{key}: {message}");
        }
        match error.span() {
            Some(span) => findings.push(span, message),
            None => findings.push_whole(message),
        }
        let found = findings.into_result().err();
        found.unwrap_or_else(|| StudyFileError::of(source_name, "cannot be read"))
    })
}

/// The key whose value begins at a place of the text.
fn key_before(text: &str, start: usize) -> Option<&str> {
    let line = text.get(..start)?.lines().last()?;
    let key = line.strip_suffix(' ').unwrap_or(line).strip_suffix('=')?;
    Some(key.trim())
}

/// Largest study file that is read \[bytes\].
const LARGEST_FILE: u64 = 1 << 22;

/// The text of a file.
///
/// # Errors
/// A sentence if there is none, or it is no text of a sensible size.
pub(super) fn read(path: &str) -> Result<String, StudyFileError> {
    let refuse = |sentence: &str| StudyFileError::of(path, sentence);
    let names = || ready::names().collect::<Vec<_>>().join(", ");
    let meta = std::fs::metadata(path).map_err(|error| {
        refuse(&match error.kind() {
            std::io::ErrorKind::NotFound => {
                format!("there is no such file; the ready studies are {}", names())
            }
            _ => format!("cannot be read: {error}"),
        })
    })?;
    if Path::new(path).join("study.json").is_file() {
        return Err(refuse(
            "this is a folder of results; --row N runs one of its rows once more",
        ));
    }
    if meta.is_dir() {
        return Err(refuse(&format!(
            "this is a directory; give a study file (TOML) or a ready study: {}",
            names()
        )));
    }
    // What is no file may have any length.
    let mut text = String::new();
    let file = std::fs::File::open(path);
    file.and_then(|file| file.take(LARGEST_FILE + 1).read_to_string(&mut text))
        .map_err(|error| refuse(&format!("cannot be read: {error}")))?;
    if text.len() as u64 > LARGEST_FILE {
        return Err(refuse("more than 4 MiB; a study file has a few kilobytes"));
    }
    Ok(text)
}

/// Words of a file as a terminal may show them.
fn visible(words: &str) -> String {
    let shown = |c: char| match c {
        '\n' => "\n".to_owned(),
        c if c.is_control() => c.escape_default().to_string(),
        c => c.to_string(),
    };
    words.chars().map(shown).collect()
}

/// A path that stands in a file, seen from where the file lies.
pub(super) fn beside(source_name: &str, path: &str) -> String {
    match Path::new(source_name).parent() {
        Some(folder) if Path::new(path).is_relative() => folder.join(path).display().to_string(),
        _ => path.to_owned(),
    }
}
