//! Tables and pictures to draw: ordinary ones and awkward ones.

use hil_runner::study::picture::{Column, Curve, Picture, Table, Values, draw};

/// One picture with what it is drawn from.
#[derive(Debug, Clone)]
pub struct Sample {
    pub name: &'static str,
    pub keys: String,
    pub table: Table,
    pub curves: Vec<Curve>,
}

impl Sample {
    pub fn of(name: &'static str, keys: &str, table: Table) -> Self {
        Self {
            name,
            keys: keys.into(),
            table,
            curves: Vec::new(),
        }
    }

    pub fn with(mut self, curve: Curve) -> Self {
        self.curves.push(curve);
        self
    }

    pub fn picture(&self) -> Picture {
        let text = format!("file = \"f\"\ntitle = \"{}\"\n{}", self.name, self.keys);
        toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    pub fn has_words(&self) -> bool {
        let mut columns = self.table.columns.iter();
        columns.any(|column| matches!(column.values, Values::Text(_)))
    }

    pub fn turn_rows_round(&mut self) {
        for column in &mut self.table.columns {
            match &mut column.values {
                Values::Number(values) => values.reverse(),
                Values::Text(values) => values.reverse(),
            }
        }
    }

    pub fn change_a_number(&mut self) {
        for column in &mut self.table.columns {
            if let Values::Number(values) = &mut column.values {
                values[0] = values[0].map(|value| 1.1 * value);
            }
        }
    }
}

pub fn draw_sample(sample: &Sample) -> String {
    let svg = draw(&sample.picture(), &sample.table, &sample.curves);
    svg.unwrap_or_else(|error| panic!("{}: {error}", sample.name))
}

pub fn numbers(name: &str, values: impl IntoIterator<Item = f64>) -> Column {
    Column {
        name: name.into(),
        values: Values::Number(values.into_iter().map(Some).collect()),
    }
}

pub fn holes(name: &str, values: &[Option<f64>]) -> Column {
    Column {
        name: name.into(),
        values: Values::Number(values.to_vec()),
    }
}

pub fn words(name: &str, values: &[&str]) -> Column {
    Column {
        name: name.into(),
        values: Values::Text(values.iter().map(ToString::to_string).collect()),
    }
}

pub fn table(columns: impl IntoIterator<Item = Column>) -> Table {
    Table {
        columns: columns.into_iter().collect(),
    }
}

/// Nine sample times, several widths of the converter, `runs` runs each.
pub fn sample_times(bits: &[f64], runs: u32) -> Table {
    let mut rows: Vec<[f64; 6]> = Vec::new();
    for &bits in bits {
        for step in 0..9 {
            for run in 0..runs {
                let time_s = 1e-4 * 2_f64.powi(step);
                let spread = 1.0 + 0.01 * f64::from(run) * f64::from(step % 3 + 1);
                let error_mm = 0.2 + 60.0 * time_s + 3.0 / bits;
                let cycle_um = if step < 2 { 0.0 } else { 4e3 * (-bits).exp2() };
                let acceleration = 1.2 + 2e5 * time_s * time_s;
                rows.push([
                    time_s,
                    bits,
                    spread * error_mm,
                    error_mm,
                    spread * cycle_um,
                    spread * acceleration,
                ]);
            }
        }
    }
    let names = [
        "controller.sample_time_s",
        "drive.dac_bits",
        "peak_following_error_mm",
        "theory.following_error_mm",
        "limit_cycle_um",
        "peak_abs_acc_mps2",
    ];
    let column = |at: usize| numbers(names[at], rows.iter().map(|row| row[at]));
    table((0..names.len()).map(column))
}

/// Gains on a grid, with verdicts and runs that were not made.
pub fn gains(across: u32, up: u32) -> Table {
    let (mut kp, mut kd, mut error, mut margin) = (vec![], vec![], vec![], vec![]);
    let (mut pass, mut state) = (vec![], vec![]);
    for j in 0..up {
        for i in 0..across {
            let x = 0.05 * 100_f64.powf(f64::from(i) / f64::from(across.max(2) - 1));
            let y = 0.001 + 0.002 * f64::from(j) / f64::from(up.max(2) - 1);
            let here = 0.8 - 0.16 * x + 60.0 * y;
            let refused = x > 3.0 && j == 0;
            kp.push(x);
            kd.push(y);
            margin.push(here);
            error.push((!refused).then(|| 0.3 / (here + 0.4)));
            pass.push(f64::from(u8::from(here > 0.2)));
            state.push(if refused { "refused" } else { "ok" });
        }
    }
    table([
        numbers("controller.kp", kp),
        numbers("controller.kd_s", kd),
        holes("peak_following_error_mm", &error),
        numbers("theory.modulus_margin", margin),
        numbers("pass", pass),
        words("state", &state),
    ])
}

/// 500 runs with a figure of either sign, spread about 0, and its verdict.
pub fn spread() -> Table {
    // A sequence of low discrepancy, summed to something like a bell.
    let share = |i: u32, step: f64| (f64::from(i) * step).fract();
    let bell = |i: u32| {
        let steps = [0.618_034, 0.414_214, 0.732_051, 0.236_068];
        steps.iter().map(|&step| share(i, step)).sum::<f64>() - 2.0
    };
    let figure: Vec<f64> = (0..500).map(bell).collect();
    let gap = (0..500).map(|i| 10_f64.powf(-2.0 + 2.0 * share(i, 0.324_718)));
    table([
        numbers("transmission.backlash_half_deg", gap),
        numbers("final_error_um", figure.iter().map(|value| 100.0 * value)),
        numbers(
            "peak_following_error_mm",
            figure.iter().map(|v| 0.5 + 0.1 * v),
        ),
        numbers(
            "pass",
            figure
                .iter()
                .map(|value| f64::from(u8::from(value.abs() < 0.8))),
        ),
    ])
}

/// A figure for every control law and width.
pub fn laws() -> Table {
    let laws = ["continuous", "sampled", "quantised", "firmware"];
    let law: Vec<&str> = (0..12).map(|i| laws[i % 4]).collect();
    let value = |i: u32| (i != 5).then(|| -650.0 + 90.0 * f64::from(i));
    let values: Vec<Option<f64>> = (0..12).map(value).collect();
    table([
        words("controller.law", &law),
        numbers("drive.dac_bits", (0..12).map(|i| [8.0, 12.0, 16.0][i / 4])),
        holes("final_error_um", &values),
        numbers(
            "rms_acc_error_mps2",
            (0..12).map(|i| 0.03 + f64::from(i * i)),
        ),
    ])
}

/// Awkward values along a plain x.
fn awkward() -> Table {
    let none = [
        None,
        Some(f64::NAN),
        Some(f64::INFINITY),
        None,
        Some(-f64::NAN),
    ];
    let huge = [1e-9, -3.0, 1e-3, 0.0, 1e6];
    table([
        numbers("x_s", (0..5).map(f64::from)),
        numbers("zero_mm", [0.0; 5]),
        numbers("equal_mm", [-1234.5678; 5]),
        holes("none_um", &none),
        numbers("huge_s", huge),
        numbers("all", [-1e-30, 1e40, f64::MAX, f64::MIN_POSITIVE, 1e8]),
        numbers("near_v", [1e6, 1e6 + 1e-4, 1e6 + 2e-4, 1e6, 1e6]),
        numbers("negative_mm", [-5.0, -4.0, -1.0, -2.0, -3.0]),
    ])
}

pub fn border() -> Curve {
    let point = |i: u32| (0.05 * 1.05_f64.powi(i as i32), 3e-5 * f64::from(i));
    Curve {
        label: "border of stability".into(),
        points: (0..100).map(point).collect(),
    }
}

const LONG: &str = "a figure with a very long name that goes on and on and fills more than the \
                    height of a panel and nearly the width of the picture";

/// All samples.
pub fn all() -> Vec<Sample> {
    let x = "x = \"controller.sample_time_s\"\nx_scale = \"log\"\n";
    let lines = |more: &str| format!("kind = \"lines\"\n{x}{more}");
    let plain = |y: &str| format!("kind = \"lines\"\nx = \"x_s\"\ny = \"{y}\"\n");
    let map = "kind = \"map\"\nx = \"controller.kp\"\nx_scale = \"log\"\ny = \"controller.kd_s\"\n\
               z = \"peak_following_error_mm\"\n";
    let nine = [6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 14.0, 16.0];
    let one = || table([numbers("x_s", [0.001]), numbers("y_mm", [5.0])]);
    let long_words = [
        "a rather long name of a series that nobody would call short, and which goes on for longer \
         than a line of the legend has room for, so that it must be folded",
        "b <&> \"c\"",
    ];
    vec![
        Sample::of(
            "lines with theory, series and a limit",
            &lines(
                "y = \"peak_following_error_mm\"\ntheory = \"theory.following_error_mm\"\n\
                 series = \"drive.dac_bits\"\nlimit = 0.9",
            ),
            sample_times(&[8.0, 12.0, 16.0], 1),
        ),
        Sample::of(
            "three panels",
            &lines(
                "series = \"drive.dac_bits\"\n\
                 [[panel]]\ny = \"peak_following_error_mm\"\nlimit = { value = 0.9, label = \"max\" }\n\
                 [[panel]]\ny = \"peak_abs_acc_mps2\"\nlimit = 3\n\
                 [[panel]]\ny = \"limit_cycle_um\"\ny_scale = \"log\"",
            ),
            sample_times(&[8.0, 12.0, 16.0], 1),
        ),
        Sample::of(
            "a curve alone",
            &lines("y = \"peak_following_error_mm\""),
            sample_times(&[12.0], 1),
        ),
        Sample::of(
            "nine series",
            &lines("y = \"peak_following_error_mm\"\nseries = \"drive.dac_bits\""),
            sample_times(&nine, 1),
        ),
        Sample::of(
            "bands",
            &lines("y = \"peak_following_error_mm\"\nseries = \"drive.dac_bits\""),
            sample_times(&[8.0, 12.0], 7),
        ),
        Sample::of(
            "several columns and a curve",
            "kind = \"lines\"\nx = \"controller.sample_time_s\"\nx_unit = \"us\"\ny_scale = \"log\"\n\
             y = [\"peak_following_error_mm\", \"limit_cycle_um\"]\n\
             theory = [\"theory.following_error_mm\"]",
            sample_times(&[12.0], 1),
        )
        .with(Curve {
            label: "given".into(),
            points: vec![(1e-4, 0.1), (2e-4, f64::NAN), (3e-4, 0.2), (1e-2, 1.0)],
        }),
        Sample::of("one point", &format!("{}\nlimit = 7", "kind = \"lines\"\nx = \"x_s\"\ny = \"y_mm\""), one()),
        Sample::of(
            "one point, logarithmic",
            "kind = \"lines\"\nx = \"x_s\"\ny = \"y_mm\"\nx_scale = \"log\"\ny_scale = \"log\"",
            one(),
        ),
        Sample::of("all zero", &plain("zero_mm"), awkward()),
        Sample::of("all equal", &plain("equal_mm"), awkward()),
        Sample::of("nothing", &format!("{}limit = 5", plain("none_um")), awkward()),
        Sample::of("huge", &plain("huge_s"), awkward()),
        Sample::of("huge, log", &format!("{}y_scale = \"log\"", plain("huge_s")), awkward()),
        Sample::of("all numbers", &plain("all"), awkward()),
        Sample::of("all numbers, log", &format!("{}y_scale = \"log\"", plain("all")), awkward()),
        Sample::of("near a million", &plain("near_v"), awkward()),
        Sample::of("below zero", &format!("{}limit = 4.5", plain("negative_mm")), awkward()),
        Sample::of(
            "below zero, log",
            &format!("{}y_scale = \"log\"", plain("negative_mm")),
            awkward(),
        ),
        Sample::of("no rows", &format!("{}where = {{ x_s = 77 }}", plain("zero_mm")), awkward()),
        Sample::of(
            LONG,
            "kind = \"lines\"\nx = \"controller.law\"\nseries = \"names\"\ny = \"y_mm\"\n\
             y_label = \"Something that goes on and on and fills more than the height of a panel\"\n\
             limit = { value = 0.2, label = \"what the customer of the machine has been promised\" }",
            table([
                words("controller.law", &["continuous", "sampled", "continuous", "sampled"]),
                words("names", &[long_words[0], long_words[0], long_words[1], long_words[1]]),
                numbers("y_mm", [0.1, -0.2, 0.3, 0.25]),
            ]),
        ),
        Sample::of("map", &format!("{map}contours = [0.4, 0.6]"), gains(15, 12)).with(border()),
        Sample::of(
            "map of many cells",
            &format!("{map}colours = \"cividis\"\nz_scale = \"log\"\ncontours = [0.2, 0.5]\ncontours_of = \"theory.modulus_margin\""),
            gains(90, 70),
        ),
        Sample::of("one cell", map, gains(1, 1)),
        Sample::of("one row of cells", map, gains(9, 1)),
        Sample::of("no cells", &format!("{map}where = {{ controller.kp = 7777 }}"), gains(5, 5)),
        Sample::of(
            "map of words",
            "kind = \"map\"\nx = \"controller.law\"\ny = \"drive.dac_bits\"\nz = \"final_error_um\"",
            laws(),
        ),
        Sample::of(
            "map, log of either sign",
            "kind = \"map\"\nx = \"controller.law\"\ny = \"drive.dac_bits\"\nz = \"final_error_um\"\nz_scale = \"log\"",
            laws(),
        ),
        Sample::of(
            "bars",
            "kind = \"bars\"\ncategory = \"controller.law\"\nseries = \"drive.dac_bits\"\ny = \"final_error_um\"\nlimit = 400",
            laws(),
        ),
        Sample::of(
            "bars, log",
            "kind = \"bars\"\ncategory = \"drive.dac_bits\"\nseries = \"controller.law\"\ny = \"rms_acc_error_mps2\"\ny_scale = \"log\"",
            laws(),
        ),
        Sample::of(
            "bars of several runs",
            "kind = \"bars\"\ncategory = \"controller.law\"\ny = \"rms_acc_error_mps2\"\ny_range = [0, 50]",
            laws(),
        ),
        Sample::of(
            "no bars",
            "kind = \"bars\"\ncategory = \"controller.law\"\ny = \"final_error_um\"\nwhere.drive.dac_bits = 9",
            laws(),
        ),
        Sample::of(
            "histogram",
            "kind = \"histogram\"\nx = \"final_error_um\"\nlimit = 80",
            spread(),
        ),
        Sample::of(
            "histogram, log",
            "kind = \"histogram\"\nx = \"transmission.backlash_half_deg\"\nx_scale = \"log\"\nbins = 12",
            spread(),
        ),
        Sample::of("histogram of one value", "kind = \"histogram\"\nx = \"y_mm\"\nlimit = 7", one()),
        Sample::of(
            "histogram of nothing",
            "kind = \"histogram\"\nx = \"none_um\"\nlimit = 7",
            awkward(),
        ),
        Sample::of(
            "scatter",
            "kind = \"scatter\"\nx = \"transmission.backlash_half_deg\"\nx_scale = \"log\"\ny = \"peak_following_error_mm\"\nlimit = 0.55",
            spread(),
        )
        .with(Curve {
            label: "given".into(),
            points: vec![(0.001, 0.1), (0.1, 0.5), (10.0, 0.9)],
        }),
        Sample::of("scatter of one", "kind = \"scatter\"\nx = \"x_s\"\ny = \"y_mm\"", one()),
        Sample::of(
            "scatter of nothing",
            "kind = \"scatter\"\nx = \"x_s\"\ny = \"none_um\"",
            awkward(),
        ),
    ]
}
