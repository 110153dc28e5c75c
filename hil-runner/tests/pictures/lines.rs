//! Kind `lines`: values stand where the numbers of the axes say.

use super::samples::{Sample, draw_sample};
use super::sheet::{Sheet, Text};
use super::tables::{holes, numbers, sample_times, table};

const X: &str = "kind = \"lines\"\nx = \"controller.sample_time_s\"\n";

fn sheet(keys: &str, table: hil_runner::study::picture::Table) -> Sheet {
    let svg = draw_sample(&Sample::of("lines", &format!("{X}{keys}"), table));
    Sheet::read(&svg).unwrap()
}

fn value(text: &Text) -> Option<f64> {
    text.words.replace('−', "-").parse().ok()
}

/// Numbers below the plot or left of it with their places.
fn scale(sheet: &Sheet, upwards: bool) -> Vec<(f64, f64)> {
    let plot = sheet.plots()[0];
    let beside = |text: &&Text| {
        if upwards {
            text.at.0 < plot.left
        } else {
            text.at.1 > plot.bottom
        }
    };
    let place = |text: &Text| if upwards { text.at.1 } else { text.at.0 };
    let texts = sheet.texts.iter().filter(beside);
    texts
        .filter_map(|text| Some((value(text)?, place(text))))
        .collect()
}

/// The place of a value by the two outer numbers of a scale.
fn place(scale: &[(f64, f64)], measure: fn(f64) -> f64, value: f64) -> f64 {
    let (first, last) = (scale[0], scale[scale.len() - 1]);
    let share = (measure(value) - measure(first.0)) / (measure(last.0) - measure(first.0));
    first.1 + share * (last.1 - first.1)
}

/// Largest distance of the marks from where the values should be [px].
fn off(sheet: &Sheet, points: &[(f64, f64)], measures: [fn(f64) -> f64; 2]) -> f64 {
    let (x, y) = (scale(sheet, false), scale(sheet, true));
    let mut marks = sheet.circles(&sheet.plots()[0]);
    assert_eq!(marks.len(), points.len());
    marks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let distance = |(mark, point): (&(f64, f64), &(f64, f64))| {
        let (x, y) = (
            place(&x, measures[0], point.0),
            place(&y, measures[1], point.1),
        );
        (mark.0 - x).abs().max((mark.1 - y).abs())
    };
    marks.iter().zip(points).map(distance).fold(0.0, f64::max)
}

const POINTS: [(f64, f64); 4] = [(0.25, 1.5), (0.5, -2.0), (1.0, 7.25), (4.0, 3.0)];

fn rows(points: [(f64, f64); 4]) -> hil_runner::study::picture::Table {
    table([
        numbers("controller.sample_time_s", points.map(|(x, _)| 1e-3 * x)),
        numbers("y_mm", points.map(|(_, y)| y)),
    ])
}

fn four_points() -> hil_runner::study::picture::Table {
    rows(POINTS)
}

/// The sheet counts tenths of a pixel: mark and two numbers round by half of
/// one each, and the numbers' error grows towards the ends of the axis.
const ROUNDING_PX: f64 = 0.2;

#[test]
fn marks_stand_where_the_numbers_say() {
    let even: fn(f64) -> f64 = |value| value;
    let sheet = sheet("y = \"y_mm\"", four_points());
    assert!(off(&sheet, &POINTS, [even, even]) < ROUNDING_PX);
    // The contrast: a value that is 1 % of the axis off is seen.
    let mut others = POINTS;
    others[1].1 += 0.1;
    assert!(off(&sheet, &others, [even, even]) > ROUNDING_PX);
}

#[test]
fn logarithmic_axes_are_logarithmic() {
    let mut points = POINTS;
    points[1].1 = 200.0;
    let sheet = sheet(
        "y = \"y_mm\"\nx_scale = \"log\"\ny_scale = \"log\"",
        rows(points),
    );
    assert!(off(&sheet, &points, [f64::log10, f64::log10]) < ROUNDING_PX);
    let even: fn(f64) -> f64 = |value| value;
    assert!(off(&sheet, &points, [even, even]) > 10.0);
}

#[test]
fn axes_say_quantity_and_unit() {
    let keys = "y = \"y_mm\"\ny_unit = \"um\"\ny_label = \"Error\"";
    let sheet = sheet(keys, four_points());
    assert!(sheet.has("Sample time Δt [ms]"), "{:?}", sheet.words());
    assert!(sheet.find("Error [µm]").upwards);
    let tick = sheet.has("8000") || sheet.has("6000");
    assert!(tick, "{:?}", sheet.words());
}

/// Every mark of the legend has its series, and the legend is above the plot.
#[test]
fn series_are_in_the_legend() {
    let keys = "y = \"peak_following_error_mm\"\nseries = \"drive.dac_bits\"\n\
                theory = \"theory.following_error_mm\"\nlimit = 0.9";
    let sheet = sheet(keys, sample_times(&[8.0, 12.0, 16.0], 1));
    let top = sheet.plots()[0].top;
    for words in [
        "Width n of the D/A converter:",
        "8\u{a0}bits",
        "12\u{a0}bits",
        "16\u{a0}bits",
        "simulated",
        "theory",
        "Allowed: 0.9\u{a0}mm",
    ] {
        assert!(sheet.find(words).room.bottom < top, "{words}");
    }
    // Colours of the series: a line in the plot and one in the legend each.
    for stroke in ["#0072B2", "#D55E00", "#009E73"] {
        let lines = sheet.lines.iter().filter(|line| line.stroke == stroke);
        assert_eq!(lines.count(), 2, "{stroke}");
    }
}

/// Theory is dashed and has no marks.
#[test]
fn theory_is_dashed() {
    let keys = "y = \"peak_following_error_mm\"\ntheory = \"theory.following_error_mm\"";
    let sheet = sheet(keys, sample_times(&[12.0], 1));
    let pieces = |stroke: &str| {
        let lines = sheet.lines.iter().filter(|line| line.stroke == stroke);
        lines.count()
    };
    assert!(pieces("#1C2024") > 20);
    assert_eq!(pieces("#0072B2"), 2);
    assert_eq!(sheet.circles(&sheet.plots()[0]).len(), 9);
}

/// Several runs of a place: a mark at the median, a band from the smallest to
/// the largest, and the words for it.
#[test]
fn runs_of_one_place_are_median_and_band() {
    let x = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0].map(|x| 1e-3 * x);
    let y = [1.0, 2.0, 6.0, 3.0, 8.0, 4.0];
    let rows = |y: [f64; 6]| table([numbers("controller.sample_time_s", x), numbers("y_mm", y)]);
    let sheet_of = |y| sheet("y = \"y_mm\"", rows(y));
    let found = sheet_of(y);
    let even: fn(f64) -> f64 = |value| value;
    assert!(off(&found, &[(1.0, 2.0), (2.0, 4.0)], [even, even]) < ROUNDING_PX);
    let band = |sheet: &Sheet| {
        let forms = sheet.forms.iter();
        let light = forms.filter(|form| form.opacity < 0.5);
        light.cloned().collect::<Vec<_>>()
    };
    let bands = band(&found);
    assert_eq!(bands.len(), 1);
    let y_scale = scale(&found, true);
    let (top, bottom) = (place(&y_scale, even, 8.0), place(&y_scale, even, 1.0));
    assert!((bands[0].room.top - top).abs() < ROUNDING_PX);
    assert!((bands[0].room.bottom - bottom).abs() < ROUNDING_PX);
    assert!(found.has("Lines: medians, bands: smallest to largest of up to 3 runs."));
    // The contrast: runs that agree have no band.
    assert!(band(&sheet_of([2.0, 2.0, 2.0, 5.0, 5.0, 5.0])).is_empty());
}

/// A missing run parts the line, and the remark counts it.
#[test]
fn missing_runs_part_the_line() {
    let x = numbers("controller.sample_time_s", [1.0, 2.0, 3.0, 4.0, 5.0]);
    let y =
        |third: Option<f64>| holes("y_mm", &[Some(1.0), Some(2.0), third, Some(2.0), Some(1.0)]);
    let lines = |sheet: &Sheet| {
        let lines = sheet.lines.iter().filter(|line| line.stroke == "#0072B2");
        lines.count()
    };
    let parted = sheet("y = \"y_mm\"", table([x.clone(), y(None)]));
    assert_eq!(lines(&parted), 2);
    let remark = "1 of 5 values is missing: the run was not made or has no such figure.";
    assert!(parted.has(remark), "{:?}", parted.words());
    let whole = sheet("y = \"y_mm\"", table([x, y(Some(3.0))]));
    assert_eq!(lines(&whole), 1);
    assert!(!whole.has(remark));
}

#[test]
fn what_a_logarithmic_axis_does_not_have_is_counted() {
    let x = numbers("controller.sample_time_s", [1.0, 2.0, 3.0, 4.0]);
    let y = numbers("y_mm", [0.0, -1.0, 3.0, 30.0]);
    let sheet = sheet("y = \"y_mm\"\ny_scale = \"log\"", table([x, y]));
    assert!(sheet.has("2 values are not above 0 and not shown: the axis is logarithmic."));
    assert_eq!(sheet.circles(&sheet.plots()[0]).len(), 2);
}

#[test]
fn what_lies_beyond_the_axes_is_counted() {
    let sheet = sheet("y = \"y_mm\"\ny_range = [0, 5]", four_points());
    assert!(sheet.has("2 values lie beyond the ends of the axes."));
    assert_eq!(sheet.circles(&sheet.plots()[0]).len(), 2);
}

/// A limit is a line at its value; where data are below 0 at both signs.
#[test]
fn limits_stand_at_their_value() {
    let heights = |limit: &str| {
        let sheet = sheet(&format!("y = \"y_mm\"\n{limit}"), four_points());
        let plot = sheet.plots()[0];
        let red = sheet.lines.iter().filter(|line| line.stroke == "#B3201A");
        let mut heights: Vec<f64> = red
            .map(|line| line.points[0].1)
            .filter(|&y| plot.holds((plot.left, y)))
            .collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let y = scale(&sheet, true);
        let expected = [6.0, -6.0].map(|limit| place(&y, |value| value, limit));
        (heights, expected)
    };
    let (found, expected) = heights("limit = 6");
    assert_eq!(found.len(), 2);
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < ROUNDING_PX);
    }
    assert!(heights("").0.is_empty());
}

/// Panels share x: plots of equal width below each other, numbers once.
#[test]
fn panels_share_x() {
    let keys = "[[panel]]\ny = \"peak_following_error_mm\"\n[[panel]]\ny = \"limit_cycle_um\"";
    let sheet = sheet(keys, sample_times(&[12.0], 1));
    let plots = sheet.plots();
    assert_eq!(plots.len(), 2);
    let found = (plots[0].left, plots[0].right);
    assert_eq!(found, (plots[1].left, plots[1].right));
    assert!(plots[0].bottom < plots[1].top);
    let words = sheet.words().into_iter();
    let titles = words.filter(|words| words.starts_with("Sample time"));
    assert_eq!(titles.count(), 1);
}
