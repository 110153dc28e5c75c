//! The report of a study from the study, its results and its pictures: one HTML
//! file that needs no network. Its tables need no scripts; pictures and rows do. No
//! clock, no file: the same study has the same bytes.

pub(super) mod base;
mod libraries;
pub(super) mod pictures;
pub(super) mod rows;
pub(super) mod tally;

use minijinja::{Value, context};
use serde_json::json;

use self::base::base_sentences;
use self::libraries::libraries;
use self::pictures::Specified;
use self::tally::{Best, RungTally, Tally};
use super::picture::Label;
use super::plan::axis::{Axis, Scale, Spread};
use super::plan::points::PlanKind;
use super::plan::{LoopGain, Study};
use crate::live::{self, Live, LiveError};
use crate::page::policy::policy;
use crate::page::{self, PACKED, environment, linked, packed, style};
use hil_core::budget::judged;
use hil_core::case::Limit;
use hil_core::figures;
use hil_core::number;

const TEMPLATE: &str = include_str!("../../../assets/study.html");
/// The style beyond that of the other reports.
const STYLE: &str = include_str!("../../../assets/study.css");
const SCRIPT: [&str; 2] = [PACKED, include_str!("../../../assets/study.js")];

/// A table of texts. A column is set as numbers if all its cells are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FigureTable {
    /// Heads of the columns.
    pub heads: Vec<String>,
    /// Rows, each with as many cells as there are heads.
    pub rows: Vec<Vec<String>>,
}

/// The page could not be rendered, a sentence. The results are not affected.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct StudyPageError(String);

impl From<std::io::Error> for StudyPageError {
    fn from(error: std::io::Error) -> Self {
        Self(format!("the study's report cannot be packed: {error}"))
    }
}

impl From<minijinja::Error> for StudyPageError {
    fn from(error: minijinja::Error) -> Self {
        Self(format!(
            "the template of the study's report failed: {error}"
        ))
    }
}

impl From<LiveError> for StudyPageError {
    fn from(error: LiveError) -> Self {
        Self(error.to_string())
    }
}

/// Renders the whole page, with a simulator below where there is one; `command_line` makes the
/// study again.
///
/// # Errors
///
/// A row of the key figures without its cells, or a fault of the program's own
/// template.
pub fn render(
    study: &Study,
    tally: &Tally,
    specified: &[Specified],
    command_line: &str,
    live: Option<&Live>,
) -> Result<String, StudyPageError> {
    let mut warnings = warnings(tally);
    warnings.extend(study.warnings());
    let (mut pictures, mut specifications) = (Vec::new(), Vec::new());
    for one in specified {
        let picture = &one.picture;
        let (file, title) = (&picture.file, &picture.title);
        match &one.specification {
            Ok(specification) => {
                pictures.push(context! { file, title, caption => picture.caption.as_deref().unwrap_or_default() });
                specifications.push(json!({"file": file, "specification": specification}));
            }
            Err(error) => warnings.push(error.to_string()),
        }
    }
    let data = json!({"rows": tally.rows.data(study), "pictures": specifications});
    let words = study.description.split_whitespace();
    let axes = study.axes.iter();
    let page = context! {
        title => study.title.as_str(),
        description => [words.collect::<Vec<_>>().join(" ")],
        generated_by => format!("hil-runner {}", env!("CARGO_PKG_VERSION")),
        verdict => verdict(study, tally),
        warnings,
        plan => plan(study),
        base => base_sentences(study),
        axes => axes.map(|axis| axis_row(axis, study.plan.kind)).collect::<Vec<_>>(),
        best => shown_table(&best_table(tally))?,
        pictures,
        packed_data => Value::from_safe_string(packed(data.to_string().as_bytes())?),
        figures => shown_table(&figure_table(tally))?,
        validity => study.notes.clone(),
        repeat => [command_line.to_owned()],
        files => [
            ["results.csv", "every run, a row each"],
            ["results.parquet", "the same as Apache Parquet"],
            ["study.toml", "the study file"],
            ["base.toml", "the run file of the base case"],
            ["study.json", "version, --base and --set as given, checksums"],
        ],
    };
    filled(page, live)
}

/// The template with these values; what is empty or not there is left out.
fn filled(page: Value, live: Option<&Live>) -> Result<String, StudyPageError> {
    let libraries = libraries();
    let script = linked(&SCRIPT);
    let simulator = live.map(|_| page::script(live::modules(live)));
    let has_pictures = page.get_attr("pictures")?.is_true();
    let own = [libraries.as_str(), script.as_str()].into_iter();
    let own = own.filter(|_| has_pictures);
    let scripts: Vec<&str> = own.chain(simulator.as_deref()).collect();
    let page = context! {
        policy => Value::from_safe_string(policy(&scripts, live.is_some())),
        style => Value::from_safe_string(style(live::added_style(live)) + STYLE),
        packed_libraries => Value::from_safe_string(packed(libraries.as_bytes())?),
        script => Value::from_safe_string(script),
        live => live.map(Live::section).transpose()?,
        live_script => simulator.map(Value::from_safe_string),
        ..page
    };
    let mut environment = environment()?;
    environment.add_filter("words", |column: &str| Label::of(column).words);
    environment.add_filter("unit", |column: &str| Label::of(column).unit);
    let (name, section) = live::TEMPLATE;
    environment.add_template(name, section)?;
    Ok(environment.render_named_str("study.html", TEMPLATE, page)?)
}

/// A table for the page, with a flag for each column that has nothing but numbers
/// and signs that there is none.
fn shown_table(FigureTable { heads, rows }: &FigureTable) -> Result<Value, StudyPageError> {
    let columns = heads.len();
    if let Some(row) = rows.iter().find(|row| row.len() != columns) {
        let cells = row.len();
        let words = format!("a row of the key figures has {cells} cells under {columns} heads");
        return Err(StudyPageError(words));
    }
    let number = |cell: &String| {
        let first = cell.trim_start_matches(['−', '-', '+', '±', '<', '>', '≤', '≥', ' ']);
        first.is_empty() || first == "–" || first.starts_with(|c: char| c.is_ascii_digit())
    };
    let numeric = (0..columns).map(|at| rows.iter().all(|row| row.get(at).is_none_or(number)));
    let numeric: Vec<bool> = numeric.collect();
    Ok(context! { heads, rows, numeric })
}

/// True if enough runs pass, where the study says how many must.
pub fn enough_pass(study: &Study, tally: &Tally) -> Option<bool> {
    let required = study.required_yield_percent?;
    let percent = tally.yield_percent();
    Some(percent.is_some_and(|percent| percent >= required))
}

/// The outcome: pass or not, none where nothing is judged but there is a yield to
/// tell; and a line: `948 of 1000 runs keep every limit (94.8 %)`.
fn verdict(study: &Study, tally: &Tally) -> Option<Value> {
    let percent = number::table(tally.yield_percent()?);
    let rungs = tally.rungs.iter().map(|tally| {
        let (rung, of) = (&tally.rung, tally.made + tally.not_made);
        format!("{rung}: {} of {of} runs keep every limit", tally.passed)
    });
    let lines: Vec<String> = rungs.collect();
    let required = study.required_yield_percent.map(number::table);
    let required = required.map(|required| format!(", required are {required} %"));
    let required = required.unwrap_or_default();
    Some(context! {
        pass => enough_pass(study, tally),
        line => format!("{} ({percent} % in all{required})", lines.join("; ")),
    })
}

fn warnings(tally: &Tally) -> Vec<String> {
    let mut warnings = Vec::new();
    for rung in &tally.rungs {
        if let Some((row, reason)) = &rung.first_reason {
            warnings.push(format!(
                "{}: {} runs could not be made; the first is row {row}: {reason}",
                rung.rung, rung.not_made
            ));
        }
        warnings.extend(unstable_words(rung));
    }
    warnings
}

fn plan(study: &Study) -> Vec<String> {
    let points = study.plan.points();
    let kind = match study.plan.kind {
        PlanKind::Grid => "every value of every axis with every value of the others".to_owned(),
        PlanKind::LatinHypercube => format!("a Latin hypercube, seed {}", study.plan.seed),
        PlanKind::Sobol => format!("points of the Sobol sequence, seed {}", study.plan.seed),
        PlanKind::Random => format!("independent points, seed {}", study.plan.seed),
    };
    let mut lines = vec![
        format!("{points} points: {kind}."),
        format!("Each on rung {}.", study.rung_names()),
    ];
    let (limits, default) = judged(study.template().base());
    let limit = |limit: &Limit| {
        let sign = if limit.is_least() { '≥' } else { '≤' };
        format!("{} {sign} {}", limit.figure, number::table(limit.limit))
    };
    let limits: Vec<String> = limits.iter().map(limit).collect();
    let whose = match default {
        true => ", the defaults for the base",
        false => "",
    };
    if !limits.is_empty() {
        lines.push(format!("Limits: {}{whose}.", limits.join(", ")));
    }
    if study.loop_gain == LoopGain::Constant {
        lines.push(
            "Gains, feed-forward and limits keep the volts and radians that they have with the steps of the base, where encoder or converter change.".to_owned(),
        );
    }
    if !study.constraints.is_empty() {
        let texts: Vec<String> = study.constraints.iter().map(ToString::to_string).collect();
        lines.push(format!("Only points with {}.", texts.join(" and ")));
    }
    lines
}

/// Column of an axis, and its values in words. Words and unit come from the column.
fn axis_row(axis: &Axis, plan: PlanKind) -> Value {
    let mut values = match &axis.spread {
        Spread::List(values) => {
            let texts: Vec<String> = values.iter().map(ToString::to_string).collect();
            texts.join(", ")
        }
        Spread::Range(range) => {
            let (from, to, points) = (range.from, range.to, range.points);
            let scale = match range.scale {
                Scale::Linear => "evenly",
                Scale::Log => "logarithmically",
            };
            match plan {
                PlanKind::Grid => format!("{from} to {to}, {points} values {scale} spaced"),
                _ => format!("{from} to {to}, {scale} drawn"),
            }
        }
        Spread::Random(distribution) => distribution.to_string(),
    };
    match &axis.times {
        Some(_) if axis.is_of_base() => values += ", times what the base has",
        Some(times) => values += &format!(" times {}", times.path()),
        None => {}
    }
    context! { column => axis.factor_column().unwrap_or_else(|| axis.key.path()), values }
}

/// Says how many runs have a loop that is unstable, if there are any.
pub fn unstable_words(tally: &RungTally) -> Option<String> {
    (tally.unstable > 0).then(|| {
        format!(
            "{}: theory calls the loop of {} of {} runs unstable, in contact or in the gap (margin \
             below 0): their figures may not hold, and --row N says which digits do; {} of them are within \
             the limits, and not among the best",
            tally.rung, tally.unstable, tally.made, tally.unstable_passed
        )
    })
}

/// The best runs of every rung: head and cells of a table, without rows if
/// there are none.
pub fn best_table(tally: &Tally) -> FigureTable {
    let heads = ["rung", "row", "least margin %"].map(str::to_owned);
    let row = |rung: &str, best: &Best| {
        let percent = number::rounded(100.0 * best.margin, 3);
        let own = [rung.to_owned(), best.row.to_string(), percent];
        [&own[..], &best.axes].concat()
    };
    let rungs = tally.rungs.iter();
    let rows = rungs.flat_map(|rung| rung.best.iter().map(move |best| row(&rung.rung, best)));
    FigureTable {
        heads: [&heads[..], &tally.axes].concat(),
        rows: rows.collect(),
    }
}

fn figure_table(tally: &Tally) -> FigureTable {
    let heads = "rung|figure|least|in row|mean|most|in row|unit|runs without".split('|');
    let rows = tally.rungs.iter().flat_map(|rung| {
        let name = std::slice::from_ref(&rung.rung);
        figure_rows(rung).map(move |cells| [name, &cells].concat())
    });
    FigureTable {
        heads: heads.map(str::to_owned).collect(),
        rows: rows.collect(),
    }
}

/// The figures that any run of a rung has: name, least and its row, mean, most
/// and its row, unit, runs without.
pub fn figure_rows(rung: &RungTally) -> impl Iterator<Item = [String; 8]> + '_ {
    rung.figures.iter().filter_map(|figure| {
        let (least, mean, most) = (figure.least?, figure.mean()?, figure.most?);
        Some([
            figure.column.clone(),
            number::table(least.0),
            least.1.to_string(),
            number::table(mean),
            number::table(most.0),
            most.1.to_string(),
            figures::unit(&figure.column).to_owned(),
            figure.empty.to_string(),
        ])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page, with other words in some of its places where there are any.
    fn page(other: Option<&str>) -> String {
        let words = |own: &'static str| other.unwrap_or(own).to_owned();
        let texts = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
        let best = FigureTable {
            heads: texts(&["Rung", "Margin"]),
            rows: vec![texts(&["sampled", "12"])],
        };
        let figures = FigureTable {
            heads: texts(&["Figure", "Value"]),
            rows: vec![vec![words("Error"), "−1.5".into()], texts(&["Cycle", "–"])],
        };
        let (title, caption) = (words("A figure"), words("A caption."));
        let picture = context! { file => "a-file", title, caption };
        let page = context! {
            title => words("A title"),
            description => [words("A first paragraph."), "A second one.".into()],
            generated_by => "a program 1.0",
            verdict => context! { pass => false, line => words("948 of 1000 runs") },
            warnings => [words("A warning.")],
            plan => ["A grid of 1000 runs."],
            base => ["A base."],
            best => shown_table(&best).unwrap(),
            axes => [context! {
                column => "controller.sample_time_s",
                values => words("0.001, 0.002"),
            }],
            pictures => [picture],
            packed_data => "data",
            figures => shown_table(&figures).unwrap(),
            validity => ["A remark on validity."],
            repeat => [words("hil-runner study a-study")],
            files => [["results.csv".to_owned(), words("every run")]],
        };
        filled(page, None).unwrap()
    }

    #[test]
    fn everything_is_on_the_page() {
        let html = page(None);
        for words in [
            "<title>A title – FAIL</title>",
            "A first paragraph.",
            "A second one.",
            "a program 1.0",
            "948 of 1000 runs",
            "A warning.",
            "A grid of 1000 runs.",
            "Sample time Δt",
            "<code>controller.sample_time_s</code>",
            "0.001, 0.002",
            "<div class=\"drawing\" role=\"img\" aria-label=\"A figure\"></div>",
            "a-file.vl.json",
            "<script type=\"text/plain\" data-packed=\"data\">data</script>",
            "A caption.",
            "<th scope=\"col\" class=\"n\">Value</th>",
            "<td class=\"n\">−1.5</td>",
            "A remark on validity.",
            "hil-runner study a-study",
            "results.csv",
        ] {
            assert!(html.contains(words), "{words}");
        }
    }

    /// An empty part has no heading: a page of a title alone is short.
    #[test]
    fn empty_parts_are_left_out() {
        let headings = |html: &str| html.matches("<h2").count();
        let none = FigureTable {
            heads: Vec::new(),
            rows: Vec::new(),
        };
        let table = shown_table(&none).unwrap();
        let empty =
            context! { title => "", verdict => (), best => table.clone(), figures => table };
        let empty = filled(empty, None).unwrap();
        assert_eq!((headings(&empty), headings(&page(None))), (0, 7));
        // Without pictures no script, and no library.
        assert!(!empty.contains("<script") && page(None).len() > empty.len() + 300_000);
    }

    #[test]
    fn nothing_is_loaded() {
        let html = page(None);
        assert!(html.contains("default-src 'none'"));
        for load in ["src=", "@import", "url(", "http:", "https:", "<iframe"] {
            assert!(!html.contains(load), "{load}");
        }
        // What is packed is text; one script runs, and the policy names it and what it enters.
        let scripts = |tag: &str| html.matches(tag).count();
        assert_eq!((scripts("<script"), scripts("<script>")), (3, 1));
        assert_eq!(scripts("&#x27;sha256-") + scripts("'sha256-"), 2);
    }

    #[test]
    fn words_cannot_leave_their_place() {
        let hostile = "</h1><script>alert(1)</script><!--\"'&";
        let tags = |html: &str| html.matches('<').count();
        let html = page(Some(hostile));
        assert_eq!(tags(&html), tags(&page(None)));
        assert!(html.contains("&lt;script&gt;alert(1)"));
    }

    #[test]
    fn rows_have_their_cells() {
        let texts = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
        let table = FigureTable {
            heads: texts(&["Figure", "Value"]),
            rows: vec![texts(&["Error", "−1.5"]), texts(&["Cycle"])],
        };
        let error = shown_table(&table).unwrap_err().to_string();
        assert_eq!(error, "a row of the key figures has 1 cells under 2 heads");
    }

    #[test]
    fn same_page_same_bytes() {
        assert_eq!(page(None), page(None));
    }
}
