//! From [`Report`] to HTML: templates, plot data and assets in one file.

use std::fmt;

use minijinja::syntax::SyntaxConfig;
use minijinja::{AutoEscape, Environment, Value, context};

use super::context::page_context;
use hil_core::number;
use hil_core::report::Report;

/// The page and its parts; `report.html` includes the others by these names.
const TEMPLATES: [(&str, &str); 4] = [
    ("report.html", include_str!("../../assets/report.html")),
    ("verdicts.html", include_str!("../../assets/verdicts.html")),
    ("case.html", include_str!("../../assets/case.html")),
    ("ladder.html", include_str!("../../assets/ladder.html")),
];

const UPLOT_SCRIPT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../../assets/uplot/LICENSE");
const STYLE: &str = include_str!("../../assets/report.css");
const SCRIPTS: [&str; 2] = [
    include_str!("../../assets/chart.js"),
    include_str!("../../assets/report.js"),
];

/// The report could not be rendered. No file was written; the run itself and
/// its other outputs are not affected.
#[derive(Debug)]
#[non_exhaustive]
pub enum ReportError {
    /// A template of the program itself is wrong.
    Template(minijinja::Error),
    /// The plot data could not be written as JSON.
    Data(serde_json::Error),
}

impl fmt::Display for ReportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Template(error) => write!(f, "the report's template failed: {error}"),
            Self::Data(error) => write!(f, "the report's plot data failed: {error}"),
        }
    }
}

impl std::error::Error for ReportError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Template(error) => Some(error),
            Self::Data(error) => Some(error),
        }
    }
}

impl From<minijinja::Error> for ReportError {
    fn from(error: minijinja::Error) -> Self {
        Self::Template(error)
    }
}

impl From<serde_json::Error> for ReportError {
    fn from(error: serde_json::Error) -> Self {
        Self::Data(error)
    }
}

/// Renders the whole page; the same report gives the same bytes.
///
/// # Errors
///
/// Only if the program's own template or data is at fault, see
/// [`ReportError`]; no value in the report can cause it.
pub fn render(report: &Report) -> Result<String, ReportError> {
    let mut environment = environment()?;
    environment.add_filter("number", number_cell);
    environment.add_filter("share", share);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source)?;
    }
    let page = environment.get_template("report.html")?.render(context! {
        plot_data => Value::from_safe_string(plot_data(report)?),
        style => Value::from_safe_string([UPLOT_STYLE, "\n", STYLE].concat()),
        uplot => Value::from_safe_string(uplot_with_license()),
        script => Value::from_safe_string(SCRIPTS.concat()),
        ..page_context(report)
    })?;
    Ok(page)
}

/// What templates of pages have in common: every value is escaped.
pub(crate) fn environment<'s>() -> Result<Environment<'s>, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_syntax(
        SyntaxConfig::builder()
            .trim_blocks(true)
            .lstrip_blocks(true)
            .keep_trailing_newline(true)
            .build()?,
    );
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    Ok(environment)
}

/// The report as JSON that cannot end the `<script>` it stands in: in JSON
/// `<` occurs in strings only, where the escape means the same.
fn plot_data(report: &Report) -> Result<String, ReportError> {
    Ok(serde_json::to_string(report)?.replace('<', "\\u003c"))
}

/// The licence asks to travel with every copy, and the page is one.
fn uplot_with_license() -> String {
    format!("/*!\n{}\n*/\n{UPLOT_SCRIPT}", UPLOT_LICENSE.trim())
}

/// Filter `number`: a table figure that carries its full value, or the digits
/// that hold alone.
fn number_cell(value: Value, digits: Option<usize>) -> Value {
    match f64::try_from(value) {
        Ok(value) if value.is_finite() => {
            let shown = number::held(value, digits);
            let (full, title) = match digits {
                None => (value + 0.0, format!("{}", value + 0.0)),
                Some(0) => return Value::from(shown),
                Some(digits) => (
                    number::significant(value, digits),
                    format!("digits that hold: {digits}"),
                ),
            };
            Value::from_safe_string(format!(
                "<data value=\"{full}\" title=\"{title}\">{shown}</data>"
            ))
        }
        _ => Value::from(number::MISSING),
    }
}

/// Filter `share`: magnitude over limit in percent, or none.
fn share(value: Value, limit: f64) -> Option<f64> {
    f64::try_from(value)
        .ok()
        .and_then(|value| number::share_percent(value, limit))
}
