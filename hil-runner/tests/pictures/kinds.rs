//! What the marks of each kind are.

use hil_runner::study::picture::{Curve, Table, Values};
use serde_json::Value;

use super::check::{marks, rows_of};
use super::samples::{Sample, specified};
use super::tables::{border, gains, holes, numbers, sample_times, spread, table, words};

fn of(keys: &str, table: Table) -> Value {
    specified(&Sample::of("picture", keys, table))
}

/// A number of each mark.
fn field(spec: &Value, field: &str) -> Vec<f64> {
    marks(spec)
        .iter()
        .filter_map(|mark| mark[field].as_f64())
        .collect()
}

/// True if a remark or a word of a legend is there.
fn says(spec: &Value, words: &str) -> bool {
    spec.to_string().contains(&format!("\"{words}\""))
}

/// Values of layers with another source than the marks, by a key of their mark.
fn others<'a>(view: &'a Value, key: &str, value: &str) -> Vec<&'a Value> {
    let layers = view["layer"].as_array().unwrap().iter();
    let layers = layers.filter(|layer| layer["mark"][key] == value);
    layers
        .flat_map(|layer| layer["data"]["values"].as_array().unwrap())
        .collect()
}

const LINES: &str = "kind = \"lines\"\nx = \"controller.sample_time_s\"\n";

fn four_points() -> Table {
    table([
        numbers("controller.sample_time_s", [0.25e-3, 0.5e-3, 1e-3, 4e-3]),
        numbers("y_mm", [1.5, -2.0, 7.25, 3.0]),
    ])
}

#[test]
fn axes_say_quantity_and_unit() {
    let keys = format!("{LINES}y = \"y_mm\"\ny_unit = \"um\"\ny_label = \"Error\"");
    let spec = of(&keys, four_points());
    assert!(says(&spec, "Sample time Δt [ms]") && says(&spec, "Error [µm]"));
    assert_eq!(field(&spec, "x"), [0.25, 0.5, 1.0, 4.0]);
    assert_eq!(field(&spec, "y"), [1500.0, -2000.0, 7250.0, 3000.0]);
}

/// The first layer of a specification that is drawn with a mark of this type.
fn layer<'a>(spec: &'a Value, mark: &str) -> Option<&'a Value> {
    if spec["mark"]["type"] == mark {
        return Some(spec);
    }
    match spec {
        Value::Array(parts) => parts.iter().find_map(|part| layer(part, mark)),
        Value::Object(parts) => parts.values().find_map(|part| layer(part, mark)),
        _ => None,
    }
}

/// Several runs of a place: their median, a band from the smallest to the largest.
#[test]
fn runs_of_one_place_are_median_and_band() {
    let rows = |y: [f64; 6]| {
        let x = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0].map(|x| 1e-3 * x);
        table([numbers("controller.sample_time_s", x), numbers("y_mm", y)])
    };
    let keys = format!("{LINES}y = \"y_mm\"");
    let spec = of(&keys, rows([1.0, 2.0, 6.0, 3.0, 8.0, 4.0]));
    assert_eq!(field(&spec, "y"), [2.0, 4.0]);
    assert_eq!(
        (field(&spec, "low"), field(&spec, "high")),
        (vec![1.0, 3.0], vec![6.0, 8.0])
    );
    assert_eq!(rows_of(marks(&spec)[1]), [3, 5, 4]);
    assert!(says(
        &spec,
        "Lines: medians, bands: smallest to largest of up to 3 runs."
    ));
    let band = layer(&spec, "area").unwrap();
    let ends = ["y", "y2"].map(|channel| &band["encoding"][channel]["field"]);
    assert_eq!(ends, ["low", "high"]);
    assert_eq!(layer(&spec, "line").unwrap()["encoding"]["y"]["field"], "y");
    // The contrast: runs that agree have no band.
    let same = of(&keys, rows([2.0, 2.0, 2.0, 5.0, 5.0, 5.0]));
    assert!(layer(&same, "area").is_none());
}

/// A missing run parts the line, and the remark counts it.
#[test]
fn missing_runs_part_the_line() {
    let parts = |third: Option<f64>| {
        let x = numbers("controller.sample_time_s", [1.0, 2.0, 3.0, 4.0, 5.0]);
        let y = holes("y_mm", &[Some(1.0), Some(2.0), third, Some(2.0), Some(1.0)]);
        let spec = of(&format!("{LINES}y = \"y_mm\""), table([x, y]));
        let mut parts: Vec<String> = marks(&spec)
            .iter()
            .map(|mark| mark["part"].to_string())
            .collect();
        parts.dedup();
        (
            parts.len(),
            says(
                &spec,
                "1 of 5 values is missing: the run was not made or has no such figure.",
            ),
        )
    };
    assert_eq!(parts(None), (2, true));
    assert_eq!(parts(Some(3.0)), (1, false));
}

#[test]
fn what_axes_do_not_have_is_counted() {
    let x = numbers("controller.sample_time_s", [1.0, 2.0, 3.0, 4.0]);
    let y = numbers("y_mm", [0.0, -1.0, 3.0, 30.0]);
    let spec = of(
        &format!("{LINES}y = \"y_mm\"\ny_scale = \"log\""),
        table([x, y]),
    );
    assert!(says(
        &spec,
        "2 values are not above 0 and not shown: the axis is logarithmic."
    ));
    assert_eq!(field(&spec, "y"), [3.0, 30.0]);
    let spec = of(
        &format!("{LINES}y = \"y_mm\"\ny_range = [0, 5]"),
        four_points(),
    );
    assert!(says(&spec, "2 values lie beyond the ends of the axes."));
}

/// A limit is a line at its value; where data are below 0 at both signs.
#[test]
fn limits_stand_at_their_value() {
    let limits = |keys: &str| {
        let spec = of(&format!("{LINES}y = \"y_mm\"\n{keys}"), four_points());
        let lines = others(&spec, "style", "limit").into_iter();
        lines
            .map(|line| line["y"].as_f64().unwrap())
            .collect::<Vec<f64>>()
    };
    assert_eq!(limits("limit = 6"), [6.0, -6.0]);
    assert!(limits("").is_empty());
}

/// Panels are plots over the same x, with its numbers once.
#[test]
fn panels_share_x() {
    let keys = format!(
        "{LINES}[[panel]]\ny = \"peak_following_error_mm\"\n[[panel]]\ny = \"limit_cycle_um\""
    );
    let spec = of(&keys, sample_times(&[12.0], 1));
    let views = spec["vconcat"].as_array().unwrap();
    let x = |view: &Value, key: &str| {
        let layers = view["layer"].as_array().unwrap().iter();
        let x = layers
            .map(|layer| &layer["encoding"]["x"])
            .find(|x| x["field"] == "x")
            .unwrap();
        x[key].clone()
    };
    assert_eq!(views.len(), 2);
    assert_eq!(x(&views[0], "scale"), x(&views[1], "scale"));
    assert_eq!(
        (x(&views[0], "title"), x(&views[1], "title")),
        (Value::Null, "Sample time Δt [ms]".into())
    );
}

#[test]
fn series_and_theory_are_in_the_legend() {
    let keys = format!(
        "{LINES}y = \"peak_following_error_mm\"\nseries = \"drive.dac_bits\"\ntheory = \"theory.following_error_mm\"\nlimit = 0.9"
    );
    let spec = of(&keys, sample_times(&[8.0, 12.0, 16.0], 1));
    for words in [
        "Width n of the D/A converter:",
        "8\u{a0}bits",
        "16\u{a0}bits",
        "simulated",
        "theory",
        "Allowed: 0.9\u{a0}mm",
    ] {
        assert!(says(&spec, words), "{words}");
    }
    let alone = of(
        &format!("{LINES}y = \"peak_following_error_mm\""),
        sample_times(&[8.0], 1),
    );
    assert!(!says(&alone, "theory"));
}

const MAP: &str = "kind = \"map\"\nx = \"a_mm\"\ny = \"b_mm\"\nz = \"z_mm\"\n";

/// Unequal steps on purpose: 1, 2, 4 across, 1, 2 up.
fn six(z: [Option<f64>; 6]) -> Table {
    table([
        numbers("a_mm", [1.0, 2.0, 4.0, 1.0, 2.0, 4.0]),
        numbers("b_mm", [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]),
        holes("z_mm", &z),
    ])
}

const SIX: [Option<f64>; 6] = [
    Some(1.0),
    Some(2.0),
    Some(3.0),
    Some(4.0),
    Some(5.0),
    Some(6.0),
];

/// Edges lie half way between the values, by ratio on a logarithmic axis.
#[test]
fn cells_reach_half_way() {
    let spec = of(MAP, six(SIX));
    assert_eq!(field(&spec, "x")[..3], [0.5, 1.5, 3.0]);
    assert_eq!(field(&spec, "x2")[..3], [1.5, 3.0, 5.0]);
    assert_eq!(field(&spec, "z"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let log = of(&format!("{MAP}x_scale = \"log\""), six(SIX));
    let ratios: Vec<f64> = field(&log, "x")
        .iter()
        .zip(field(&log, "x2"))
        .map(|(from, to)| to / from)
        .collect();
    assert!(
        ratios.iter().all(|ratio| (ratio - 2.0).abs() < 1e-5),
        "{ratios:?}"
    );
}

/// Cells without a value are hatched under the word of their state, those without a
/// run white.
#[test]
fn what_was_not_run_is_told_apart() {
    let mut rows = six([Some(1.0), None, None, Some(4.0), Some(5.0), Some(6.0)]);
    rows.columns.push(words(
        "status",
        &["ok", "refused", "failed", "ok", "ok", "ok"],
    ));
    let both = of(MAP, rows.clone());
    assert!(says(&both, "failed") && says(&both, "refused"));
    let hatches = |spec: &Value| {
        others(spec, "type", "rule")
            .iter()
            .filter(|line| line["x2"] != line["x"] && line["y2"] != line["y"])
            .count()
    };
    assert_eq!((hatches(&both), hatches(&of(MAP, six(SIX)))), (2, 0));
    let fewer = of(&format!("{MAP}where.status = [\"ok\", \"failed\"]"), rows);
    assert!(says(&fewer, "White: no run (1 of 6 cells).") && !says(&fewer, "refused"));
}

/// A cross in every cell that fails, and none else; of many cells in one of several.
#[test]
fn cells_that_fail_have_a_cross() {
    let crosses = |verdicts: [f64; 6]| {
        let mut rows = six(SIX);
        rows.columns.push(numbers("pass", verdicts));
        let spec = of(MAP, rows);
        let crosses = others(&spec, "filled", "").len()
            + spec["layer"]
                .as_array()
                .unwrap()
                .iter()
                .filter(|layer| layer["mark"]["filled"] == true)
                .map(|layer| layer["data"]["values"].as_array().unwrap().len())
                .sum::<usize>();
        (crosses, says(&spec, "a limit is not kept"))
    };
    assert_eq!(crosses([1.0, 1.0, 0.0, 1.0, 0.0, 0.0]), (3, true));
    assert_eq!(crosses([1.0; 6]), (0, false));
    let keys = "kind = \"map\"\nx = \"controller.kp\"\ny = \"controller.kd_s\"\nx_scale = \"log\"\nz = \"peak_following_error_mm\"";
    assert!(says(&of(keys, gains(80, 60)), "One cross for 2 × 2 cells."));
    assert!(!says(
        &of(keys, gains(20, 15)),
        "One cross for 2 × 2 cells."
    ));
}

/// The contour of the level 2.5 in a plane z = x runs where x is 2.5.
#[test]
fn contours_run_where_the_level_is() {
    let z = [1.0, 2.0, 4.0, 1.0, 2.0, 4.0].map(Some);
    let with = of(&format!("{MAP}contours = [2.5]"), six(z));
    let points = others(&with, "type", "line");
    assert!(!points.is_empty() && points.iter().all(|point| point["x"] == 2.5));
    for (level, words) in [
        (9, "No cell reaches the contour at 9\u{a0}mm."),
        (0, "Every cell is above the contour at 0\u{a0}mm."),
    ] {
        let far = of(&format!("{MAP}contours = [{level}]"), six(z));
        assert!(others(&far, "type", "line").is_empty() && says(&far, words));
    }
}

/// The caller's curve is drawn if it crosses the plot.
#[test]
fn curves_are_drawn_over_the_map() {
    let keys = "kind = \"map\"\nx = \"controller.kp\"\nx_scale = \"log\"\ny = \"controller.kd_s\"\nz = \"peak_following_error_mm\"";
    let with = |curve: Curve| {
        let mut sample = Sample::of("map", keys, gains(9, 7));
        sample.curves.push(curve);
        specified(&sample)
    };
    let near = with(border());
    assert!(others(&near, "type", "line").len() >= 100 && says(&near, "border of stability"));
    let far = with(Curve {
        points: vec![(1e3, 1.0), (1e4, 2.0)],
        ..border()
    });
    assert!(others(&far, "type", "line").is_empty());
    assert!(far.to_string().contains("does not cross this plot."));
}

#[test]
fn colours_beyond_their_range_are_counted() {
    let spec = of(&format!("{MAP}z_range = [2, 4]"), six(SIX));
    assert!(says(
        &spec,
        "Beyond the ends of the colour scale, shown as its ends: 3 cells."
    ));
}

/// The base stands on the map, or as a line over one of its keys, where it lies on the axes.
#[test]
fn base_has_its_place() {
    let with_own = |own: f64| {
        let mut rows = six(SIX);
        (rows.columns[0].own, rows.columns[1].own) = (Some(own), Some(1.5));
        of(MAP, rows)
    };
    assert!(says(&with_own(3.0), "the base, 3\u{a0}mm and 1.5\u{a0}mm"));
    assert!(!with_own(30.0).to_string().contains("the base"));
}

/// Bars from 0 to the median, each with its number.
#[test]
fn bars_are_medians() {
    let rows = table([
        words("law", &["a", "a", "a", "b", "c"]),
        holes("y_mm", &[Some(1.0), Some(2.0), Some(6.0), Some(-4.0), None]),
    ]);
    let spec = of("kind = \"bars\"\ncategory = \"law\"\ny = \"y_mm\"", rows);
    assert_eq!(field(&spec, "x"), [2.0, -4.0, 0.0]);
    let numbers: Vec<&str> = marks(&spec)
        .iter()
        .map(|mark| mark["words"].as_str().unwrap())
        .collect();
    assert_eq!(numbers, ["2", "−4", "–"]);
    assert!(says(
        &spec,
        "Bars and numbers: medians, lines: smallest to largest of up to 3 runs."
    ));
}

/// Every run is in one bin that holds its value, and the colours part at the limit.
#[test]
fn histogram_counts_every_run() {
    let values = [0.5, 1.5, 1.6, 2.5, 2.6, 2.7, -1.5];
    let mut rows: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
    rows.push(None);
    let spec = of(
        "kind = \"histogram\"\nx = \"y_mm\"\nbins = 5\nlimit = 2",
        table([holes("y_mm", &rows)]),
    );
    let mut seen = Vec::new();
    for mark in marks(&spec) {
        let [from, to, low, high] = ["x", "x2", "y", "y2"].map(|key| mark[key].as_f64().unwrap());
        let rows = rows_of(mark);
        assert_eq!(high - low, rows.len() as f64);
        for row in rows {
            assert!((from..=to).contains(&values[row]), "{mark}");
            assert_eq!(mark["name"] == "within: 4", values[row].abs() <= 2.0);
            seen.push(row);
        }
    }
    seen.sort_unstable();
    assert_eq!(seen, [0, 1, 2, 3, 4, 5, 6]);
    for words in [
        "Yield 50\u{a0}%: 4 of 8 runs keep the limit.",
        "within: 4",
        "beyond: 3",
        "Allowed: 2\u{a0}mm",
    ] {
        assert!(says(&spec, words), "{words}");
    }
}

/// Points that the study excludes are no runs of the yield; runs that could not be made
/// are.
#[test]
fn excluded_points_are_no_runs() {
    let yield_of = |status: [&str; 4], words: &str| {
        let rows = table([
            holes("y_mm", &[Some(1.0), Some(3.0), None, None]),
            self::words("status", &status),
        ]);
        let spec = of("kind = \"histogram\"\nx = \"y_mm\"\nlimit = 2", rows);
        assert!(says(&spec, words), "{spec}");
        says(&spec, "The study's constraints leave out 1 point.")
    };
    let words = "Yield 33.3\u{a0}%: 1 of 3 runs keep the limit.";
    assert!(yield_of(["ok", "ok", "refused", "excluded"], words));
    let words = "Yield 25\u{a0}%: 1 of 4 runs keep the limit.";
    assert!(!yield_of(["ok", "ok", "refused", "failed"], words));
}

#[test]
fn scatter_tells_verdicts_apart() {
    let keys = "kind = \"scatter\"\nx = \"transmission.backlash_half_deg\"\nx_scale = \"log\"\ny = \"peak_following_error_mm\"";
    let rows = spread();
    let Some(Values::Number(pass)) = rows.find("pass").map(|column| column.values.clone()) else {
        panic!("no verdicts");
    };
    let passed = pass.iter().filter(|pass| **pass == Some(1.0)).count();
    let spec = of(keys, rows);
    let named = |name: String| {
        marks(&spec)
            .iter()
            .filter(|mark| mark["name"] == name)
            .count()
    };
    assert_eq!(named(format!("keeps its limits: {passed}")), passed);
    assert_eq!(named(format!("does not: {}", 500 - passed)), 500 - passed);
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
    let thinned = of(keys, many(20_000));
    let count = marks(&thinned).len();
    assert!(count < 15_000);
    assert!(
        thinned
            .to_string()
            .contains(&format!("20000 runs, {count} marks"))
    );
    assert_eq!(
        marks(&thinned)
            .iter()
            .map(|mark| rows_of(mark).len())
            .sum::<usize>(),
        20_000
    );
    assert_eq!(marks(&of(keys, many(4_000))).len(), 4_000);
}
