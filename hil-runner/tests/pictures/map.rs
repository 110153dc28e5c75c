//! Kind `map`: cells, colours, hatches, crosses, contours.

use super::samples::{Sample, draw_sample};
use super::sheet::{Box, Form, Line, Sheet};
use super::tables::{border, gains, holes, numbers, table, words};
use hil_runner::study::picture::{Curve, Table, draw};

const KEYS: &str = "kind = \"map\"\nx = \"a_mm\"\ny = \"b_mm\"\nz = \"z_mm\"\n";

fn sheet(keys: &str, table: Table, curves: Vec<Curve>) -> Sheet {
    let mut sample = Sample::of("map", keys, table);
    sample.curves = curves;
    Sheet::read(&draw_sample(&sample)).unwrap()
}

/// Unequal steps on purpose: 1, 2, 4 across, 1, 2 up.
fn six(z: [Option<f64>; 6]) -> Table {
    table([
        numbers("a_mm", [1.0, 2.0, 4.0, 1.0, 2.0, 4.0]),
        numbers("b_mm", [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]),
        holes("z_mm", &z),
    ])
}

fn cells<'a>(sheet: &'a Sheet, plot: &Box) -> Vec<&'a Form> {
    let inside = |form: &&Form| {
        form.tag == "rect" && plot.holds(form.middle) && form.room.right - form.room.left < 700.0
    };
    sheet.forms.iter().filter(inside).collect()
}

/// The left ends of the cells' columns, in order.
fn lefts(sheet: &Sheet) -> Vec<f64> {
    let cells = cells(sheet, &sheet.plots()[0]);
    let mut lefts: Vec<f64> = cells.iter().map(|cell| cell.room.left).collect();
    lefts.sort_by(f64::total_cmp);
    lefts.dedup();
    lefts
}

fn fill_at(sheet: &Sheet, x: f64, y: f64) -> String {
    let at = |form: &&Form| form.tag == "rect" && form.room.holds((x, y));
    sheet.forms.iter().rfind(at).unwrap().fill.clone()
}

const SIX: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];

#[test]
fn colours_run_from_the_smallest_to_the_largest() {
    let sheet = sheet(KEYS, six(SIX.map(Some)), vec![]);
    let plot = sheet.plots()[0];
    assert_eq!(cells(&sheet, &plot).len(), 6);
    // Rows run upwards: the smallest value is below on the left.
    let found = fill_at(&sheet, plot.left + 20.0, plot.bottom - 20.0);
    assert_eq!(found, "#440154");
    let found = fill_at(&sheet, plot.right - 20.0, plot.top + 20.0);
    assert_eq!(found, "#FDE725");
    assert!(sheet.find("Z [mm]").upwards);
}

/// Edges lie half way between the values: from 0.5 over 1.5 and 3 to 5.
#[test]
fn unequal_steps_have_unequal_cells() {
    let sheet = sheet(KEYS, six(SIX.map(Some)), vec![]);
    let plot = sheet.plots()[0];
    let width = plot.right - plot.left;
    let lefts = lefts(&sheet);
    let expected = [0.5, 1.5, 3.0].map(|edge| plot.left + (edge - 0.5) / 4.5 * width);
    for (left, expected) in lefts.iter().zip(expected) {
        assert!((left - expected).abs() < 0.11, "{left} {expected}");
    }
    // On a logarithmic axis the same values have cells of equal width.
    let log = self::sheet(
        &format!("{KEYS}x_scale = \"log\""),
        six(SIX.map(Some)),
        vec![],
    );
    let lefts = self::lefts(&log);
    assert!((lefts[2] - 2.0 * lefts[1] + lefts[0]).abs() < 0.3);
}

#[test]
fn a_cell_of_several_runs_shows_their_median() {
    let mut rows = six(SIX.map(Some));
    let more = six([6.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(Some));
    for _ in 0..2 {
        for (column, more) in rows.columns.iter_mut().zip(&more.columns) {
            use hil_runner::study::picture::Values::Number;
            if let (Number(values), Number(more)) = (&mut column.values, &more.values) {
                values.extend(more);
            }
        }
    }
    let sheet = sheet(KEYS, rows, vec![]);
    let plot = sheet.plots()[0];
    // 1, 6 and 6 in the first cell: the largest colour now.
    let found = fill_at(&sheet, plot.left + 20.0, plot.bottom - 20.0);
    assert_eq!(found, "#FDE725");
    assert!(sheet.has("Cells show medians of up to 3 runs."));
}

/// Cells without a value are hatched under the word of their state, those
/// without a run white.
#[test]
fn what_was_not_run_is_told_apart() {
    let mut rows = six([Some(1.0), None, None, Some(4.0), Some(5.0), Some(6.0)]);
    let status = ["ok", "refused", "failed", "ok", "ok", "ok"];
    rows.columns.push(words("status", &status));
    let hatched = |sheet: &Sheet| {
        let plot = sheet.plots()[0];
        let lines = sheet.lines.iter().filter(|line| line.stroke == "#5C646D");
        let thin = |line: &&Line| line.width_px == 0.9 && plot.holds(line.points[0]);
        lines.filter(thin).count()
    };
    let both = sheet(KEYS, rows.clone(), vec![]);
    assert!(both.has("failed") && both.has("refused"));
    assert!(hatched(&both) > 10);
    assert!(!both.has("White: no run (1 of 6 cells)."));
    assert_eq!(hatched(&sheet(KEYS, six(SIX.map(Some)), vec![])), 0);
    let fewer = format!("{KEYS}where.status = [\"ok\", \"failed\"]");
    let fewer = sheet(&fewer, rows, vec![]);
    assert!(
        fewer.has("White: no run (1 of 6 cells)."),
        "{:?}",
        fewer.words()
    );
    assert!(!fewer.has("refused"));
}

/// A cross in every cell that fails, and none else.
#[test]
fn cells_that_fail_have_a_cross() {
    let crosses = |verdicts: [f64; 6]| {
        let mut rows = six(SIX.map(Some));
        rows.columns.push(numbers("pass", verdicts));
        let sheet = sheet(KEYS, rows, vec![]);
        let plot = sheet.plots()[0];
        let marks = sheet.forms.iter().filter(|form| form.tag == "polygon");
        let count = marks.filter(|form| plot.holds(form.middle)).count();
        (count, sheet.has("a limit is not kept"))
    };
    assert_eq!(crosses([1.0, 1.0, 0.0, 1.0, 0.0, 0.0]), (3, true));
    assert_eq!(crosses([1.0; 6]), (0, false));
}

/// Cells too small for a cross each are told of in a remark.
#[test]
fn crosses_of_many_cells_are_thinned() {
    let keys = "kind = \"map\"\nx = \"controller.kp\"\ny = \"controller.kd_s\"\n\
                x_scale = \"log\"\nz = \"peak_following_error_mm\"";
    let remark = "One cross for 2 × 2 cells; a fine line runs along the edge of what fails.";
    assert!(sheet(keys, gains(80, 60), vec![]).has(remark));
    assert!(!sheet(keys, gains(20, 15), vec![]).has(remark));
}

/// The contour of the level 2.5 in a plane z = x runs where x is 2.5.
#[test]
fn contours_run_where_the_level_is() {
    let z = [1.0, 2.0, 4.0, 1.0, 2.0, 4.0].map(Some);
    let dark = |sheet: &Sheet, plot: &Box| {
        let lines = sheet.lines.iter().filter(|line| line.stroke == "#1C2024");
        let lines = lines.filter(|line| plot.holds(line.points[0]));
        lines.cloned().collect::<Vec<_>>()
    };
    let with = sheet(&format!("{KEYS}contours = [2.5]"), six(z), vec![]);
    let plot = with.plots()[0];
    let lines = dark(&with, &plot);
    assert_eq!(lines.len(), 1);
    let expected = plot.left + (2.5 - 0.5) / 4.5 * (plot.right - plot.left);
    for (x, _) in &lines[0].points {
        assert!((x - expected).abs() < 0.11, "{x} {expected}");
    }
    assert!(with.has("Z = 2.5\u{a0}mm") && with.has("2.5\u{a0}mm"));
    for (level, words) in [
        (9, "No cell reaches the contour at 9\u{a0}mm."),
        (0, "Every cell is above the contour at 0\u{a0}mm."),
    ] {
        let far = sheet(&format!("{KEYS}contours = [{level}]"), six(z), vec![]);
        assert!(dark(&far, &plot).is_empty());
        assert!(far.has(words), "{:?}", far.words());
    }
}

/// The caller's curve is drawn as far as it lies in the plot.
#[test]
fn curves_are_drawn_over_the_map() {
    let keys = "kind = \"map\"\nx = \"controller.kp\"\nx_scale = \"log\"\ny = \"controller.kd_s\"\n\
                z = \"peak_following_error_mm\"";
    let lines = |sheet: &Sheet| {
        let plot = sheet.plots()[0];
        let lines = sheet.lines.iter().filter(|line| line.stroke == "#D55E00");
        lines.filter(|line| plot.holds(line.points[0])).count()
    };
    let with = sheet(keys, gains(9, 7), vec![border()]);
    assert_eq!(lines(&with), 1);
    assert!(with.has("border of stability"));
    let mut far = border();
    far.points = vec![(1e3, 1.0), (1e4, 2.0)];
    let without = sheet(keys, gains(9, 7), vec![far]);
    assert_eq!(lines(&without), 0);
    assert!(without.has("\"border of stability\" does not cross this plot."));
}

/// Beyond the given range of colours its ends hold, and that is said.
#[test]
fn colours_beyond_their_range_are_counted() {
    let sheet = sheet(
        &format!("{KEYS}z_range = [2, 4]"),
        six(SIX.map(Some)),
        vec![],
    );
    let plot = sheet.plots()[0];
    let found = fill_at(&sheet, plot.left + 20.0, plot.bottom - 20.0);
    assert_eq!(found, "#440154");
    let words = sheet.words().join("|");
    assert!(words.contains("Beyond the ends of the colour scale, shown as its ends: 3 cells."));
}

/// Long names and numbers are shortened; what is left without room is said.
#[test]
fn long_words_leave_room_for_the_plot() {
    let name = "W".repeat(200);
    let rows = |z: [f64; 2]| {
        table([
            numbers("a_mm", [1.0, 2.0]),
            words("b", &[&name, &name]),
            numbers("z_mm", z),
        ])
    };
    let keys = KEYS.replace("b_mm", "b");
    let named = sheet(&keys, rows([1.0, 2.0]), vec![]);
    let short = |word: &&str| word.starts_with("WWWWW") && word.ends_with('…');
    assert!(named.words().iter().any(short), "{:?}", named.words());
    let ranges = [
        "linear\"\nz_range = [0, 5e-324]",
        "log\"\nz_range = [1e90, 1e91]",
    ];
    for range in ranges {
        let keys = format!("{keys}z_scale = \"{range}\n");
        let plot = sheet(&keys, rows([1e90, 1e91]), vec![]).plots()[0];
        assert!(plot.right - plot.left >= 150.0, "{range}");
    }
    let keys = format!("{keys}z_label = \"{}\"\n", "W ".repeat(700));
    let sample = Sample::of("map", &keys, rows([1.0, 2.0]));
    let refused = draw(&sample.picture(), &sample.table, &[]).unwrap_err();
    assert!(refused.to_string().contains("leave no room"), "{refused}");
}
