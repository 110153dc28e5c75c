//! The report: one HTML file that needs no network, drawn from plain data.
//!
//! A [`Report`] holds the contents of the page and
//! nothing else: no clock, no file, no simulation. [`render`] fills the
//! templates in `assets` with its serialised form, and the same report gives the
//! same bytes. Only the step time on the host depends on the machine, which is
//! why it is optional and the page shows it apart.
//!
//! ```
//! use hil_core::report::Report;
//! use hil_runner::report::render;
//!
//! let report = Report {
//!     title: "Servo bench".into(),
//!     command_line: "hil-runner".into(),
//!     generated_by: "hil-runner 0.1.0".into(),
//!     reserved: None,
//!     cases: Vec::new(),
//!     compare: None,
//!     ladder: None,
//!     log: None,
//! };
//! assert!(render(&report, None)?.starts_with("<!doctype html>"));
//! # Ok::<(), hil_runner::report::ReportError>(())
//! ```
//!
//! # Contents of the file
//!
//! * Tables are plain HTML, legible with scripts switched off. They show five
//!   significant digits; each number carries its full value (`<data value>`).
//! * Plots are drawn by uPlot (`assets/uplot`, MIT, copied in unchanged) from
//!   the report as JSON in the page. Curves are rounded to
//!   [`PLOT_DIGITS`](hil_core::number::PLOT_DIGITS) significant digits, which no screen can tell from
//!   the original and which halves the file.
//! * A content security policy forbids every load and every script but the page's own, so that
//!   "no network" does not rest on our word.

pub mod tune;

use minijinja::value::Serde;
use minijinja::{Value, context};

use hil_core::number;
use hil_core::report::Report;

use crate::live::{self, Live};
use crate::page::policy::policy;
use crate::page::{environment, in_script, script, style};

/// The page and its parts; `report.html` includes the others by these names.
const TEMPLATES: [(&str, &str); 8] = [
    ("report.html", include_str!("../assets/report.html")),
    ("verdicts.html", include_str!("../assets/verdicts.html")),
    ("case.html", include_str!("../assets/case.html")),
    ("compare.html", include_str!("../assets/compare.html")),
    ("loop.html", include_str!("../assets/loop.html")),
    ("ladder.html", include_str!("../assets/ladder.html")),
    ("log.html", include_str!("../assets/log.html")),
    live::TEMPLATE,
];

/// Modules besides those of plots.
pub(crate) const MODULES: [&str; 2] = [
    include_str!("../assets/front.js"),
    include_str!("../assets/report.js"),
];

/// Marks the page as one whose scripts run, before anything of it is shown.
const FIRST: &str = "document.documentElement.classList.add(\"js\");";

/// The report could not be rendered. No file was written; the run itself and
/// its other outputs are not affected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A template of the program itself is wrong.
    #[error("the report's template failed: {0}")]
    Template(#[from] minijinja::Error),
    /// The plot data could not be written as JSON.
    #[error("the report's plot data failed: {0}")]
    Data(#[from] serde_json::Error),
    /// The simulator cannot be shown.
    #[error(transparent)]
    Live(#[from] live::LiveError),
}

/// Renders the whole page, with a simulator below its runs where there is one; the same report
/// gives the same bytes.
///
/// # Errors
///
/// Only if the program's own template or data is at fault, see
/// [`ReportError`]; no value in the report can cause it.
pub fn render(report: &Report, live: Option<&Live>) -> Result<String, ReportError> {
    render_extended(report, "{% extends \"report.html\" %}", context! {}, live)
}

/// Renders a page that extends `report.html`: its template fills the blocks `links`, of the
/// list of sections, and `sections`, from the report and from `more`.
fn render_extended(
    report: &Report,
    page: &str,
    more: Value,
    live: Option<&Live>,
) -> Result<String, ReportError> {
    let mut environment = environment()?;
    environment.add_filter("number", number_cell);
    environment.add_filter("setting", setting_cell);
    environment.add_filter("share", share);
    environment.add_filter("standing", standing);
    environment.add_filter("margin_digits", margin_digits);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source)?;
    }
    let data = Value::from(Serde(report));
    let verdicts = report.cases.iter().flat_map(|case| &case.verdicts);
    let script = script(&[&MODULES, live::modules(live)].concat());
    let contents = context! {
        verdicts => Value::from(Serde(verdicts.collect::<Vec<_>>())),
        plot_data => Value::from_safe_string(in_script(&data)?),
        policy => Value::from_safe_string(policy(&[FIRST, &script], live.is_some())),
        style => Value::from_safe_string(style(live::added_style(live))),
        first_script => Value::from_safe_string(FIRST.to_owned()),
        script => Value::from_safe_string(script),
        live => live.map(Live::section).transpose()?,
        ..data.clone()
    };
    let contents = context! { ..contents, ..more };
    Ok(environment.render_named_str("page.html", page, contents)?)
}

/// A value of a run file: a number as in any other cell, a word without its quotes.
fn setting_cell(text: &str) -> Value {
    match text.parse::<f64>() {
        Ok(number) => number_cell(Value::from(number), None),
        Err(_) => Value::from(text.trim_matches('"')),
    }
}

/// Filter `number`: a table figure that carries its full value, or the digits
/// that hold alone.
fn number_cell(value: Value, digits: Option<usize>) -> Value {
    let value = f64::try_from(value).ok().filter(|value| value.is_finite());
    let shown = number::shown(value, digits);
    let (full, title) = match (value, digits) {
        (None, _) | (_, Some(0)) => return Value::from(shown),
        (Some(value), None) => (value + 0.0, format!("{}", value + 0.0)),
        (Some(value), Some(digits)) => (
            number::significant(value, digits),
            format!("digits that hold: {digits}"),
        ),
    };
    Value::from_safe_string(format!(
        "<data value=\"{full}\" title=\"{title}\">{shown}</data>"
    ))
}

/// Filter `share`: magnitude over limit in percent, or none.
fn share(value: Value, limit: f64) -> Option<f64> {
    let value = f64::try_from(value).ok()?;
    number::share_percent(value, limit)
}

/// Filter `standing`: the banner over verdicts, none without any.
fn standing(verdicts: Vec<Value>, reserved: Value) -> Option<&'static str> {
    let fails = |verdict: &Value| verdict.get_attr("pass").is_ok_and(|pass| !pass.is_true());
    if verdicts.is_empty() {
        return None;
    }
    Some(match (verdicts.iter().any(fails), reserved.is_true()) {
        (true, _) => "fail",
        (false, true) => "reserved",
        (false, false) => "pass",
    })
}

/// Filter `margin_digits`: the digits that hold of a margin, where `digits` of
/// the value do; none for all.
fn margin_digits(margin: Value, value: Value, digits: Option<usize>) -> Option<usize> {
    let [margin, value] = [margin, value].map(|number| f64::try_from(number).ok());
    Some(number::of_margin(margin?, value?, digits?))
}

/// The line that starts this program with these words: a POSIX shell takes
/// each of them as it is.
///
/// ```
/// use hil_runner::report::command_line;
///
/// let words = ["run", "my axis.toml", "--set", "motion.travel_mm=20"];
/// assert_eq!(
///     command_line(words),
///     "hil-runner run 'my axis.toml' --set 'motion.travel_mm=20'",
/// );
/// ```
pub fn command_line<'w>(words: impl IntoIterator<Item = &'w str>) -> String {
    let words = core::iter::once("hil-runner").chain(words);
    // Quoting fails for NUL alone, which no command line can have had.
    let quoter = shlex::Quoter::new().allow_nul(true);
    quoter.join(words).unwrap_or_default()
}

/// An option that is given once for each of its values.
pub fn each_with<'w, V: AsRef<str> + 'w>(
    option: &'w str,
    values: impl IntoIterator<Item = &'w V>,
) -> impl Iterator<Item = &'w str> {
    let pair = move |value: &'w V| [option, value.as_ref()];
    values.into_iter().flat_map(pair)
}

#[cfg(test)]
mod tests;
