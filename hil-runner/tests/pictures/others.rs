//! Kinds `bars`, `histogram` and `scatter`.

use super::samples::{Sample, draw_sample};
use super::sheet::{Form, Sheet};
use super::tables::{holes, numbers, spread, table, words};
use hil_runner::study::picture::Table;

fn sheet(keys: &str, table: Table) -> Sheet {
    Sheet::read(&draw_sample(&Sample::of("picture", keys, table))).unwrap()
}

fn filled<'a>(sheet: &'a Sheet, fill: &str) -> Vec<&'a Form> {
    let plot = sheet.plots()[0];
    let filled = |form: &&Form| form.tag == "rect" && form.fill == fill;
    let forms = sheet.forms.iter().filter(filled);
    forms.filter(|form| plot.holds(form.middle)).collect()
}

/// Bars are as long as their values, to either side of 0.
#[test]
fn bars_are_as_long_as_their_values() {
    let rows = table([
        words("law", &["a", "b", "c"]),
        numbers("y_mm", [2.0, -1.0, 4.0]),
    ]);
    let sheet = sheet("kind = \"bars\"\ncategory = \"law\"\ny = \"y_mm\"", rows);
    let bars = filled(&sheet, "#0072B2");
    let lengths = bars.iter().map(|bar| bar.room.right - bar.room.left);
    let lengths: Vec<f64> = lengths.collect();
    assert_eq!(lengths.len(), 3);
    assert!((lengths[0] / lengths[2] - 0.5).abs() < 1e-3);
    assert!((lengths[1] / lengths[2] - 0.25).abs() < 1e-3);
    assert!((bars[1].room.right - bars[0].room.left).abs() < 0.11);
    for words in ["a", "b", "c", "2", "−1", "4", "Law"] {
        assert!(sheet.has(words), "{words} {:?}", sheet.words());
    }
}

#[test]
fn a_bar_of_several_runs_is_their_median() {
    let rows = table([
        words("law", &["a", "a", "a", "b"]),
        numbers("y_mm", [1.0, 2.0, 6.0, 4.0]),
    ]);
    let sheet = sheet("kind = \"bars\"\ncategory = \"law\"\ny = \"y_mm\"", rows);
    let bars = filled(&sheet, "#0072B2");
    let lengths = bars.iter().map(|bar| bar.room.right - bar.room.left);
    let lengths: Vec<f64> = lengths.collect();
    assert!((lengths[0] / lengths[1] - 0.5).abs() < 1e-3);
    assert!(sheet.has("Bars and numbers: medians, lines: smallest to largest of up to 3 runs."));
}

/// Heights of the histogram's bars add up to the runs that have a value, and
/// the colours part at the limit.
#[test]
fn a_histogram_counts_every_run() {
    let values = [0.5, 1.5, 1.6, 2.5, 2.6, 2.7, -1.5];
    let mut rows: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
    rows.push(None);
    let keys = "kind = \"histogram\"\nx = \"y_mm\"\nbins = 5\nlimit = 2";
    let sheet = sheet(keys, table([holes("y_mm", &rows)]));
    let plot = sheet.plots()[0];
    let heights = |fill: &str| {
        let bars = filled(&sheet, fill);
        let heights = bars.iter().map(|bar| bar.room.bottom - bar.room.top);
        heights.sum::<f64>()
    };
    // The axis of counts: from 0 to the plot's lower edge, 1 a run above.
    let mut texts = sheet.texts.iter();
    let one = texts.find(|text| text.words == "1" && text.at.0 < plot.left);
    let run_px = plot.bottom - one.unwrap().at.1;
    let within = heights("#0072B2") / run_px;
    let beyond = heights("#D55E00") / run_px;
    assert!((within - 4.0).abs() < 0.05, "{within}");
    assert!((beyond - 3.0).abs() < 0.05, "{beyond}");
    for words in [
        "Yield 50\u{a0}%: 4 of 8 runs keep the limit",
        "within: 4",
        "beyond: 3",
        "without a value, not in the plot: 1",
        "Allowed: 2\u{a0}mm",
    ] {
        assert!(sheet.has(words), "{words} {:?}", sheet.words());
    }
}

/// Points that the study excludes are no runs of the yield; runs that could
/// not be made are.
#[test]
fn excluded_points_are_no_runs() {
    let yield_of = |status: [&str; 4]| {
        let rows = table([
            holes("y_mm", &[Some(1.0), Some(3.0), None, None]),
            words("status", &status),
        ]);
        let sheet = sheet("kind = \"histogram\"\nx = \"y_mm\"\nlimit = 2", rows);
        let words = sheet.words();
        let found = words.iter().find(|words| words.starts_with("Yield"));
        let said = sheet.has("The study's constraints leave out 1 point.");
        (found.unwrap().to_string(), said)
    };
    let (yield_words, said) = yield_of(["ok", "ok", "refused", "excluded"]);
    assert_eq!(yield_words, "Yield 33.3\u{a0}%: 1 of 3 runs keep the limit");
    assert!(said);
    let (yield_words, said) = yield_of(["ok", "ok", "refused", "failed"]);
    assert_eq!(yield_words, "Yield 25\u{a0}%: 1 of 4 runs keep the limit");
    assert!(!said);
}

/// Circles for what keeps its limits, crosses for what does not.
#[test]
fn a_scatter_tells_verdicts_apart() {
    let keys = "kind = \"scatter\"\nx = \"transmission.backlash_half_deg\"\nx_scale = \"log\"\n\
                y = \"peak_following_error_mm\"";
    let sheet = sheet(keys, spread());
    let plot = sheet.plots()[0];
    let crosses = sheet.forms.iter().filter(|form| form.fill == "#D55E00");
    let crosses = crosses.filter(|form| plot.holds(form.middle)).count();
    let circles = sheet.circles(&plot).len();
    assert_eq!(circles + crosses, 500);
    assert!(crosses > 0);
    assert!(sheet.has(&format!("keeps its limits: {circles}")));
    assert!(sheet.has(&format!("does not: {crosses}")));
}

/// 20,000 runs are thinned to what can be told apart, and that is said.
#[test]
fn many_runs_are_thinned() {
    let golden = |i: u32, step: f64| (f64::from(i) * step).fract();
    let many = |count: u32| {
        table([
            numbers("a_mm", (0..count).map(|i| golden(i, 0.618_034))),
            numbers("b_mm", (0..count).map(|i| golden(i, 0.414_214).powi(9))),
        ])
    };
    let keys = "kind = \"scatter\"\nx = \"a_mm\"\ny = \"b_mm\"";
    let marks = |sheet: &Sheet| sheet.circles(&sheet.plots()[0]).len();
    let thinned = sheet(keys, many(20_000));
    assert!(marks(&thinned) < 15_000);
    let words = thinned.words().join("|");
    let remark = format!("20000 runs, {} marks", marks(&thinned));
    assert!(words.contains(&remark), "{words}");
    assert_eq!(marks(&sheet(keys, many(4_000))), 4_000);
}
