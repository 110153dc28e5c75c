//! Rendering of the page of a study: one HTML file that needs no network and no scripts.
//!
//! A [`StudyPage`] holds what is to be shown, as text and as SVG; [`render`]
//! puts it into the page. No clock, no file: the same page has the same bytes.
//!
//! ```
//! use hil_runner::study::{StudyPage, render};
//!
//! let page = StudyPage {
//!     title: "Sample time".into(),
//!     repeat: vec!["hil-runner study sample-time".into()],
//!     ..StudyPage::default()
//! };
//! assert!(render(&page)?.starts_with("<!doctype html>"));
//! # Ok::<(), hil_runner::study::StudyPageError>(())
//! ```

use minijinja::{Value, context};
use serde::Serialize;

use crate::report::environment;
use crate::study::picture::Label;

const TEMPLATE: &str = include_str!("../../../assets/study.html");
/// The style of the other reports, and what pictures need beyond it.
const STYLES: [&str; 2] = [
    include_str!("../../../assets/report.css"),
    include_str!("../../../assets/study.css"),
];

/// Everything that the page of a study shows. What is empty is left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct StudyPage {
    /// Heading of the page.
    pub title: String,
    /// The question and its reason, by paragraphs.
    pub description: Vec<String>,
    /// Program and version, such as `hil-runner 0.1.0`; no date.
    pub generated_by: String,
    /// The outcome.
    pub verdict: Option<StudyVerdict>,
    /// Things that the reader must see first: pictures that could not be drawn, runs
    /// that could not be made; one sentence each.
    pub warnings: Vec<String>,
    /// The plan in words, one sentence each: how many runs, of what kind.
    pub plan: Vec<String>,
    /// The base case and what the study replaces of it, one sentence each.
    pub base: Vec<String>,
    /// The axes of the plan.
    pub axes: Vec<AxisRow>,
    /// The best of the runs within all limits.
    pub best: FigureTable,
    /// The pictures, in their order.
    pub pictures: Vec<Shown>,
    /// The key figures.
    pub figures: FigureTable,
    /// For what the results hold and for what not, one sentence each.
    pub validity: Vec<String>,
    /// The command lines that repeat the study.
    pub repeat: Vec<String>,
    /// The files beside the page: name, and what is in it.
    pub files: Vec<(String, String)>,
}

/// The outcome of a study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StudyVerdict {
    /// True if it passes; `None` where nothing is judged but there is a yield
    /// to tell.
    pub pass: Option<bool>,
    /// In words: `948 of 1000 runs keep every limit (94.8 %)`.
    pub line: String,
}

/// One axis of the plan. Words and unit come from the column's name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AxisRow {
    /// Column of the results, such as `controller.sample_time_s`.
    pub column: String,
    /// Its values in words: `0.001, 0.002, 0.005` or `uniform from 0 to 1`.
    pub values: String,
}

/// One picture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Shown {
    /// Stem of the file that holds the same picture.
    pub file: String,
    /// The SVG.
    pub svg: String,
    /// The thing that the reader should see.
    pub caption: String,
}

/// A table of texts. A column is set as numbers if all its cells are.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FigureTable {
    /// Heads of the columns.
    pub heads: Vec<String>,
    /// Rows, each with as many cells as there are heads.
    pub rows: Vec<Vec<String>>,
}

/// The page could not be rendered. The results are not affected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyPageError {
    /// The template of the program itself is wrong.
    #[error("the template of the study's report failed: {0}")]
    Template(String),
    /// The picture of this file is no SVG, or has a script in it.
    #[error("picture \"{0}\" is no SVG without scripts")]
    NoPicture(String),
    /// A row of the key figures has this many cells, not as many as heads.
    #[error("a row of the key figures has {cells} cells under {heads} heads")]
    Cells {
        /// Cells of the row.
        cells: usize,
        /// Number of heads.
        heads: usize,
    },
}

impl From<minijinja::Error> for StudyPageError {
    fn from(error: minijinja::Error) -> Self {
        Self::Template(error.to_string())
    }
}

/// Renders the whole page; the same study gives the same bytes.
///
/// # Errors
///
/// A picture that is no SVG, a row of the key figures without its cells, or a
/// fault of the program's own template.
pub fn render(page: &StudyPage) -> Result<String, StudyPageError> {
    for table in [&page.figures, &page.best] {
        let heads = table.heads.len();
        if let Some(row) = table.rows.iter().find(|row| row.len() != heads) {
            let cells = row.len();
            return Err(StudyPageError::Cells { cells, heads });
        }
    }
    if let Some(shown) = page.pictures.iter().find(|shown| !is_picture(&shown.svg)) {
        return Err(StudyPageError::NoPicture(shown.file.clone()));
    }
    let mut environment = environment()?;
    environment.add_filter("words", |column: &str| Label::of(column).words);
    environment.add_filter("unit", |column: &str| Label::of(column).unit);
    environment.add_template("study.html", TEMPLATE)?;
    Ok(environment.get_template("study.html")?.render(context! {
        style => Value::from_safe_string(STYLES.concat()),
        numeric => [numeric(&page.best), numeric(&page.figures)],
        ..Value::from(minijinja::value::Serde(page))
    })?)
}

/// Accepts an SVG that brings nothing along: it goes into the page as it is.
fn is_picture(svg: &str) -> bool {
    let svg = svg.trim();
    let whole = svg.starts_with("<svg ") && svg.ends_with("</svg>");
    whole && !svg.contains("<script") && !svg.contains("<foreignObject")
}

/// For each column whether it has nothing but numbers and signs that there is
/// none.
fn numeric(table: &FigureTable) -> Vec<bool> {
    let number = |cell: &String| {
        let first = cell.trim_start_matches(['−', '-', '+', '±', '<', '>', '≤', '≥', ' ']);
        first.is_empty() || first == "–" || first.starts_with(|c: char| c.is_ascii_digit())
    };
    (0..table.heads.len())
        .map(|at| table.rows.iter().all(|row| row.get(at).is_none_or(number)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(words: &str) -> String {
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\"><desc>{words}</desc></svg>\n")
    }

    fn page() -> StudyPage {
        let texts = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
        StudyPage {
            title: "A title".into(),
            description: texts(&["A first paragraph.", "A second one."]),
            generated_by: "a program 1.0".into(),
            verdict: Some(StudyVerdict {
                pass: Some(false),
                line: "948 of 1000 runs".into(),
            }),
            warnings: texts(&["A warning."]),
            plan: texts(&["A grid of 1000 runs."]),
            base: texts(&["A base."]),
            best: FigureTable {
                heads: texts(&["Rung", "Margin"]),
                rows: vec![texts(&["sampled", "12"])],
            },
            axes: vec![AxisRow {
                column: "controller.sample_time_s".into(),
                values: "0.001, 0.002".into(),
            }],
            pictures: vec![Shown {
                file: "a-file".into(),
                svg: svg("a picture"),
                caption: "A caption.".into(),
            }],
            figures: FigureTable {
                heads: texts(&["Figure", "Value"]),
                rows: vec![texts(&["Error", "−1.5"]), texts(&["Cycle", "–"])],
            },
            validity: texts(&["A remark on validity."]),
            repeat: texts(&["hil-runner study a-study"]),
            files: vec![("results.csv".into(), "every run".into())],
        }
    }

    #[test]
    fn everything_is_on_the_page() {
        let html = render(&page()).unwrap();
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
            "<desc>a picture</desc>",
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
        assert_eq!(headings(&render(&StudyPage::default()).unwrap()), 0);
        assert_eq!(headings(&render(&page()).unwrap()), 6);
    }

    #[test]
    fn nothing_is_loaded() {
        let html = render(&page()).unwrap();
        assert!(html.contains("default-src 'none'"));
        let html = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        for load in [
            "src=", "@import", "url(", "http:", "https:", "<script", "<iframe",
        ] {
            assert!(!html.contains(load), "{load}");
        }
    }

    #[test]
    fn words_cannot_leave_their_place() {
        let hostile = "</h1><script>alert(1)</script><!--\"'&";
        let mut page = page();
        let tags = |html: &str| html.matches('<').count();
        let clean = tags(&render(&page).unwrap());
        page.title = hostile.into();
        page.description[0] = hostile.into();
        page.verdict.as_mut().unwrap().line = hostile.into();
        page.warnings[0] = hostile.into();
        page.axes[0].values = hostile.into();
        page.pictures[0].caption = hostile.into();
        page.figures.rows[0][0] = hostile.into();
        page.repeat[0] = hostile.into();
        page.files[0].1 = hostile.into();
        let html = render(&page).unwrap();
        assert_eq!(tags(&html), clean);
        assert!(html.contains("&lt;script&gt;alert(1)"));
    }

    #[test]
    fn pictures_bring_no_scripts() {
        for svg in [
            "<p>no picture</p>".to_owned(),
            svg("").replace("<desc>", "<script>1</script><desc>"),
            svg("") + "<p>more</p>",
        ] {
            let mut page = page();
            page.pictures[0].svg = svg;
            let error = render(&page).unwrap_err().to_string();
            assert_eq!(error, "picture \"a-file\" is no SVG without scripts");
        }
    }

    #[test]
    fn rows_have_their_cells() {
        let mut page = page();
        page.figures.rows[1].pop();
        let error = render(&page).unwrap_err().to_string();
        assert_eq!(error, "a row of the key figures has 1 cells under 2 heads");
    }

    #[test]
    fn same_page_same_bytes() {
        assert_eq!(render(&page()).unwrap(), render(&page()).unwrap());
    }
}
