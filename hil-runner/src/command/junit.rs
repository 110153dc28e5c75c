//! Verdicts as JUnit's XML, which systems for continuous integration show: a suite a
//! run, in it a test a limit. A run that could not be made is an error, one that was not
//! begun for another's sake is skipped.

use std::path::Path;

use hil_core::budget::Verdict;
use hil_core::summary::Summary;
use hil_core::{figures, number};
use hil_runner::files::OutputFile;
use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use serde::Serialize;

/// What has the extension of XML is escaped as such.
const TEMPLATE: (&str, &str) = ("junit.xml", include_str!("junit.xml"));

/// The file with the suites so far.
#[derive(Debug)]
pub(super) struct Junit {
    file: OutputFile,
    suites: Vec<Suite>,
}

#[derive(Debug, Serialize)]
struct Suite {
    name: String,
    tests: Vec<Test>,
}

/// A limit with the reason why it does not hold, or a run with that why there is none.
#[derive(Debug, Default, Serialize)]
struct Test {
    name: &'static str,
    failure: Option<String>,
    error: Option<String>,
    skipped: bool,
}

impl Junit {
    /// Prepares to write to a path, if there is one.
    ///
    /// # Errors
    /// As [`OutputFile::create`].
    pub(super) fn create(path: Option<&Path>) -> std::io::Result<Option<Self>> {
        let file = path.map(OutputFile::create).transpose()?;
        Ok(file.map(|file| Self {
            file,
            suites: Vec::new(),
        }))
    }

    /// Adds the verdicts on a run.
    pub(super) fn verdicts<'v>(
        &mut self,
        name: &str,
        summary: &Summary,
        verdicts: impl Iterator<Item = &'v Verdict>,
    ) {
        let test = |verdict: &Verdict| Test {
            name: verdict.figure,
            failure: (!verdict.pass).then(|| broken(summary, verdict)),
            ..Test::default()
        };
        self.add(name, verdicts.map(test).collect());
    }

    /// Adds a run that could not be made, and why; without a reason, one that was not begun
    /// because another one could not be made.
    pub(super) fn unmade(&mut self, name: &str, error: Option<&anyhow::Error>) {
        let test = Test {
            name: "run",
            error: error.map(|error| xml_text(&format!("{error:#}"))),
            skipped: error.is_none(),
            ..Test::default()
        };
        self.add(name, vec![test]);
    }

    fn add(&mut self, name: &str, tests: Vec<Test>) {
        let name = xml_text(name);
        self.suites.push(Suite { name, tests });
    }

    /// Writes the file.
    pub(super) fn write(self) -> anyhow::Result<()> {
        let (name, source) = TEMPLATE;
        let suites = Value::from(Serde(self.suites));
        let text = Environment::new().render_named_str(name, source, context! { suites })?;
        Ok(self.file.write_whole(&(text + "\n"))?)
    }
}

/// The figure and its limit: "final_error_um = −650.54 µm, limit 650 µm".
fn broken(summary: &Summary, verdict: &Verdict) -> String {
    let unit = figures::unit(verdict.figure);
    let with_unit = |number: String| format!("{number} {unit}").trim_end().to_owned();
    let digits = summary.digits(verdict.figure);
    let value = match verdict.value {
        None => "none".to_owned(),
        value => with_unit(number::shown(value, digits)),
    };
    let default = if verdict.default { " (default)" } else { "" };
    let limit = with_unit(number::table(verdict.limit));
    let at_least = if verdict.at_least { "at least " } else { "" };
    format!(
        "{} = {value}, limit {at_least}{limit}{default}",
        verdict.figure
    )
}

/// The text without the characters that XML cannot have.
fn xml_text(text: &str) -> String {
    let fits = |c: char| match c {
        '\n' | '\t' => true,
        c => !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}'),
    };
    text.replace(|c| !fits(c), "\u{fffd}")
}
