//! Tables and pictures to draw: ordinary ones and awkward ones.

use hil_runner::study::picture::{Curve, Picture, Table, Values, draw};

use super::tables::{awkward, border, gains, laws, long_names, one, sample_times, spread};

/// One picture with what it is drawn from.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub(super) name: &'static str,
    pub(super) keys: String,
    pub(super) table: Table,
    pub(super) curves: Vec<Curve>,
}

impl Sample {
    pub(super) fn of(name: &'static str, keys: &str, table: Table) -> Self {
        Self {
            name,
            keys: keys.into(),
            table,
            curves: Vec::new(),
        }
    }

    pub(super) fn with(mut self, curve: Curve) -> Self {
        self.curves.push(curve);
        self
    }

    pub(super) fn picture(&self) -> Picture {
        let text = format!("file = \"f\"\ntitle = \"{}\"\n{}", self.name, self.keys);
        toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    pub(super) fn has_words(&self) -> bool {
        let mut columns = self.table.columns.iter();
        columns.any(|column| matches!(column.values, Values::Text(_)))
    }

    pub(super) fn turn_rows_round(&mut self) {
        for column in &mut self.table.columns {
            match &mut column.values {
                Values::Number(values) => values.reverse(),
                Values::Text(values) => values.reverse(),
            }
        }
    }

    pub(super) fn change_a_number(&mut self) {
        for column in &mut self.table.columns {
            if let Values::Number(values) = &mut column.values {
                values[0] = values[0].map(|value| 1.1 * value);
            }
        }
    }
}

pub(super) fn draw_sample(sample: &Sample) -> String {
    let svg = draw(&sample.picture(), &sample.table, &sample.curves);
    svg.unwrap_or_else(|error| panic!("{}: {error}", sample.name))
}

const LONG: &str = "a figure with a very long name that goes on and on and fills more than the \
                    height of a panel and nearly the width of the picture";

/// All samples.
pub(super) fn all() -> Vec<Sample> {
    let mut all = lines();
    all.extend(awkward_lines());
    all.extend(maps());
    all.extend(others());
    all
}

fn lines() -> Vec<Sample> {
    let keys = |more: &str| {
        format!(
            "kind = \"lines\"\nx = \"controller.sample_time_s\"\nx_scale = \"log\"\n\
             series = \"drive.dac_bits\"\n{more}"
        )
    };
    let error = "y = \"peak_following_error_mm\"\n";
    let nine = [6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 14.0, 16.0];
    let given = Curve {
        label: "given".into(),
        points: vec![(1e-4, 0.1), (2e-4, f64::NAN), (3e-4, 0.2), (1e-2, 1.0)],
    };
    vec![
        Sample::of(
            "lines with theory, series and a limit",
            &keys(&format!(
                "{error}theory = \"theory.following_error_mm\"\nlimit = 0.9"
            )),
            sample_times(&[8.0, 12.0, 16.0], 1),
        ),
        Sample::of(
            "three panels",
            &keys(
                "[[panel]]\ny = \"peak_following_error_mm\"\n\
                 limit = { value = 0.9, label = \"max\" }\n\
                 [[panel]]\ny = \"peak_abs_acc_mps2\"\nlimit = 3\n\
                 [[panel]]\ny = \"limit_cycle_um\"\ny_scale = \"log\"",
            ),
            sample_times(&[8.0, 12.0, 16.0], 1),
        ),
        Sample::of(
            "a curve alone",
            &keys(error).replace("series = \"drive.dac_bits\"", ""),
            sample_times(&[12.0], 1),
        ),
        Sample::of("nine series", &keys(error), sample_times(&nine, 1)),
        Sample::of("bands", &keys(error), sample_times(&[8.0, 12.0], 7)),
        Sample::of(
            "several columns and a curve",
            "kind = \"lines\"\nx = \"controller.sample_time_s\"\nx_unit = \"us\"\n\
             y_scale = \"log\"\ny = [\"peak_following_error_mm\", \"limit_cycle_um\"]\n\
             theory = [\"theory.following_error_mm\"]",
            sample_times(&[12.0], 1),
        )
        .with(given),
        Sample::of(
            LONG,
            "kind = \"lines\"\nx = \"controller.law\"\nseries = \"names\"\ny = \"y_mm\"\n\
             y_label = \"Something that goes on and on and fills more than the height of a panel\"\n\
             limit = { value = 0.2, label = \"what the customer of the machine was promised\" }",
            long_names(),
        ),
    ]
}

/// One point, or the samples of [`awkward`].
fn awkward_lines() -> Vec<Sample> {
    let keys = |y: &str, more: &str| format!("kind = \"lines\"\nx = \"x_s\"\ny = \"{y}\"\n{more}");
    let log = "y_scale = \"log\"";
    let of = |name, y, more| Sample::of(name, &keys(y, more), awkward());
    vec![
        Sample::of("one point", &keys("y_mm", "limit = 7"), one()),
        Sample::of(
            "one point, logarithmic",
            &keys("y_mm", "x_scale = \"log\"\ny_scale = \"log\""),
            one(),
        ),
        of("all zero", "zero_mm", ""),
        of("all equal", "equal_mm", ""),
        of("nothing", "none_um", "limit = 5"),
        of("huge", "huge_s", ""),
        of("huge, log", "huge_s", log),
        of("all numbers", "all", ""),
        of("all numbers, log", "all", log),
        of("near a million", "near_v", ""),
        of("below zero", "negative_mm", "limit = 4.5"),
        of("below zero, log", "negative_mm", log),
        of("no rows", "zero_mm", "where = { x_s = 77 }"),
    ]
}

fn maps() -> Vec<Sample> {
    let keys = |more: &str| {
        format!(
            "kind = \"map\"\nx = \"controller.kp\"\nx_scale = \"log\"\ny = \"controller.kd_s\"\n\
             z = \"peak_following_error_mm\"\n{more}"
        )
    };
    let laws_keys = "kind = \"map\"\nx = \"controller.law\"\ny = \"drive.dac_bits\"\n\
                     z = \"final_error_um\"\n";
    vec![
        Sample::of("map", &keys("contours = [0.4, 0.6]"), gains(15, 12)).with(border()),
        Sample::of(
            "map of many cells",
            &keys(
                "colours = \"cividis\"\nz_scale = \"log\"\ncontours = [0.2, 0.5]\n\
                 contours_of = \"theory.modulus_margin\"",
            ),
            gains(90, 70),
        ),
        Sample::of("one cell", &keys(""), gains(1, 1)),
        Sample::of("one row of cells", &keys(""), gains(9, 1)),
        Sample::of(
            "no cells",
            &keys("where = { controller.kp = 7777 }"),
            gains(5, 5),
        ),
        Sample::of("map of words", laws_keys, laws()),
        Sample::of(
            "map, log of either sign",
            &format!("{laws_keys}z_scale = \"log\""),
            laws(),
        ),
    ]
}

fn others() -> Vec<Sample> {
    let bars = |more: &str| format!("kind = \"bars\"\ncategory = \"controller.law\"\n{more}");
    let given = Curve {
        label: "given".into(),
        points: vec![(0.001, 0.1), (0.1, 0.5), (10.0, 0.9)],
    };
    vec![
        Sample::of(
            "bars",
            &bars("series = \"drive.dac_bits\"\ny = \"final_error_um\"\nlimit = 400"),
            laws(),
        ),
        Sample::of(
            "bars, log",
            "kind = \"bars\"\ncategory = \"drive.dac_bits\"\nseries = \"controller.law\"\n\
             y = \"rms_acc_error_mps2\"\ny_scale = \"log\"",
            laws(),
        ),
        Sample::of(
            "bars of several runs",
            &bars("y = \"rms_acc_error_mps2\"\ny_range = [0, 50]"),
            laws(),
        ),
        Sample::of(
            "no bars",
            &bars("y = \"final_error_um\"\nwhere.drive.dac_bits = 9"),
            laws(),
        ),
        Sample::of(
            "histogram",
            "kind = \"histogram\"\nx = \"final_error_um\"\nlimit = 80",
            spread(),
        ),
        Sample::of(
            "histogram, log",
            "kind = \"histogram\"\nx = \"transmission.backlash_half_deg\"\nx_scale = \"log\"\n\
             bins = 12",
            spread(),
        ),
        Sample::of(
            "histogram of one value",
            "kind = \"histogram\"\nx = \"y_mm\"\nlimit = 7",
            one(),
        ),
        Sample::of(
            "histogram of nothing",
            "kind = \"histogram\"\nx = \"none_um\"\nlimit = 7",
            awkward(),
        ),
        Sample::of(
            "scatter",
            "kind = \"scatter\"\nx = \"transmission.backlash_half_deg\"\nx_scale = \"log\"\n\
             y = \"peak_following_error_mm\"\nlimit = 0.55",
            spread(),
        )
        .with(given),
        Sample::of(
            "scatter of one",
            "kind = \"scatter\"\nx = \"x_s\"\ny = \"y_mm\"",
            one(),
        ),
        Sample::of(
            "scatter of nothing",
            "kind = \"scatter\"\nx = \"x_s\"\ny = \"none_um\"",
            awkward(),
        ),
    ]
}
