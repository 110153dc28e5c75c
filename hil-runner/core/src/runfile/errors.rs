//! Mistakes in a run file: every finding is a value with its place,
//! and prints as one line.
//!
//! ```text
//! cases/x.toml:12: motor.inertia_kg_m2 = -1 is not allowed: the rotor inertia J_m must be greater than 0 kg m²
//! ```

use core::fmt;

use thiserror::Error;

/// Place of a value or a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole: a key that is not there has no line.
    File,
    /// A line of the file, counted from 1.
    Line(usize),
    /// An override of the command line; holds its text, such as
    /// `controller.kp=4`.
    Set(String),
}

impl Place {
    /// Number to sort findings by: lines in their order, the command line last.
    pub(super) fn order(&self) -> usize {
        match self {
            Self::Line(line) => *line,
            Self::File => usize::MAX - 1,
            Self::Set(_) => usize::MAX,
        }
    }
}

/// A mistake. No run can be made from a file with any of these.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file cannot be read as text; says why.
    #[error("{0}")]
    Unreadable(String),
    /// The text is not TOML. Nothing else is known about it then.
    #[error("not TOML: {message}")]
    Syntax {
        /// Column in characters, counted from 1.
        column: usize,
        /// Sentence of the TOML parser.
        message: String,
    },
    /// A `--set` that names no key or has no value; says why.
    #[error("{0}")]
    Override(String),
    /// A key or section that the run file does not have.
    #[error("unknown {what}; {hint}")]
    Unknown {
        /// `key motor.inertia` or `section [moter]`.
        what: String,
        /// Name that may have been meant, or the names that there are.
        hint: String,
    },
    /// A key that has another name now.
    #[error("{key} is now {name}")]
    Renamed {
        /// Path of the key, as it was.
        key: String,
        /// Its name in the same section.
        name: &'static str,
    },
    /// A key or section that must be given and is not; the rest of the
    /// sentence after the file's name.
    #[error("{0}")]
    Missing(String),
    /// A value of the wrong type or out of its range.
    #[error("{key} = {text} is not allowed: {because}")]
    NotAllowed {
        /// Path of the key, such as `motor.inertia_kg_m2`.
        key: String,
        /// The value as it was written, shortened to one line.
        text: String,
        /// Sentence that says what is allowed instead.
        because: String,
    },
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}: {problem}", self.origin())]
pub struct RunFileError {
    /// Name of the file or built-in case.
    pub source_name: String,
    /// Its place.
    pub place: Place,
    /// The mistake.
    pub problem: Problem,
}

impl RunFileError {
    /// Path of the key that it is about, where there is one.
    pub fn key(&self) -> Option<&str> {
        match (&self.place, &self.problem) {
            (_, Problem::NotAllowed { key, .. } | Problem::Renamed { key, .. }) => Some(key),
            (Place::Set(text), _) => text.split_once('=').map(|(key, _)| key.trim()),
            _ => None,
        }
    }

    /// `x.toml:12`, with the column where the text is not TOML.
    fn origin(&self) -> String {
        match (&self.place, &self.problem) {
            (Place::File, _) => self.source_name.clone(),
            (Place::Line(line), Problem::Syntax { column, .. }) => {
                format!("{}:{line}:{column}", self.source_name)
            }
            (Place::Line(line), _) => format!("{}:{line}", self.source_name),
            (Place::Set(text), _) => format!("--set {text}"),
        }
    }
}

/// Most mistakes that a message lists: what a screen shows.
pub const MOST_MISTAKES: usize = 20;

/// Writes one line for each mistake; of more than [`MOST_MISTAKES`] the first,
/// and how many more there are.
///
/// # Errors
/// If `to` does not take the words.
pub fn list_mistakes(to: &mut impl fmt::Write, mistakes: &[impl fmt::Display]) -> fmt::Result {
    for (index, mistake) in mistakes.iter().take(MOST_MISTAKES).enumerate() {
        let separator = if index == 0 { "" } else { "\n" };
        write!(to, "{separator}{mistake}")?;
    }
    match mistakes.len().saturating_sub(MOST_MISTAKES) {
        0 => Ok(()),
        more => write!(to, "\nand {more} more mistakes"),
    }
}

/// Everything that is wrong with a run file; prints one line for each.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct RunFileErrors {
    entries: Vec<RunFileError>,
}

impl RunFileErrors {
    /// The one finding that a file cannot be read, with a sentence that says why.
    pub fn unreadable(path: &str, because: String) -> Self {
        Self::one(path, Place::File, Problem::Unreadable(because))
    }

    /// The one finding.
    pub(super) fn one(source_name: &str, place: Place, problem: Problem) -> Self {
        let mut findings = Findings::new(source_name);
        findings.push(place, problem);
        findings.into_errors()
    }

    /// The findings in the order of the file, those of the command line last.
    pub fn entries(&self) -> &[RunFileError] {
        &self.entries
    }
}

impl fmt::Display for RunFileErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        list_mistakes(f, &self.entries)
    }
}

/// Collects the findings of one file.
#[derive(Debug)]
pub(super) struct Findings {
    source_name: String,
    /// With the line to sort by: that of the section for a missing key.
    entries: Vec<(usize, RunFileError)>,
}

impl Findings {
    pub(super) fn new(source_name: &str) -> Self {
        Self {
            source_name: one_line(source_name, usize::MAX),
            entries: Vec::new(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(super) fn push(&mut self, place: Place, problem: Problem) {
        self.push_at(place.order(), place, problem);
    }

    /// Records something missing, to be listed with its section.
    pub(super) fn push_missing(&mut self, section: Option<&Place>, sentence: String) {
        let line = match section {
            Some(Place::Line(line)) => *line,
            _ => usize::MAX - 1,
        };
        self.push_at(line, Place::File, Problem::Missing(sentence));
    }

    fn push_at(&mut self, line: usize, place: Place, problem: Problem) {
        let source_name = self.source_name.clone();
        let error = RunFileError {
            source_name,
            place,
            problem,
        };
        self.entries.push((line, error));
    }

    pub(super) fn into_errors(mut self) -> RunFileErrors {
        self.entries.sort_by_key(|(line, _)| *line);
        RunFileErrors {
            entries: self.entries.into_iter().map(|(_, entry)| entry).collect(),
        }
    }
}

/// `text` in one line of at most `limit` characters: a message stays one line
/// whatever a file holds.
pub(super) fn one_line(text: &str, limit: usize) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut line = String::new();
    for (length, character) in words.join(" ").chars().enumerate() {
        match character {
            ' ' => line.push(' '),
            _ if length >= limit => {
                line.push('…');
                break;
            }
            _ if character.is_control() => line.extend(character.escape_default()),
            _ => line.push(character),
        }
    }
    line
}
