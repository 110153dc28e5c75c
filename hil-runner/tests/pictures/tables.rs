//! Tables as studies have them, and awkward ones.

use hil_runner::study::picture::{Column, Curve, Table, Values};
use serde::Deserialize;

/// The name of a table in a file of samples.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Rows {
    Awkward,
    Gains(u32, u32),
    Laws,
    Lengths,
    LongNames,
    One,
    SampleTimes(Vec<f64>, u32),
    Spread,
}

impl Rows {
    pub(super) fn table(&self) -> Table {
        match self {
            Self::Awkward => awkward(),
            Self::Gains(across, up) => gains(*across, *up),
            Self::Laws => laws(),
            Self::Lengths => lengths(),
            Self::LongNames => long_names(),
            Self::One => one(),
            Self::SampleTimes(bits, runs) => sample_times(bits, *runs),
            Self::Spread => spread(),
        }
    }
}

fn column(name: &str, values: Values) -> Column {
    let (name, own) = (name.into(), None);
    Column { name, values, own }
}

pub(super) fn numbers(name: &str, values: impl IntoIterator<Item = f64>) -> Column {
    let values: Vec<Option<f64>> = values.into_iter().map(Some).collect();
    holes(name, &values)
}

pub(super) fn holes(name: &str, values: &[Option<f64>]) -> Column {
    column(name, Values::Number(values.to_vec()))
}

pub(super) fn words(name: &str, values: &[&str]) -> Column {
    let values = values.iter().map(ToString::to_string);
    column(name, Values::Text(values.collect()))
}

pub(super) fn table(columns: impl IntoIterator<Item = Column>) -> Table {
    Table {
        columns: columns.into_iter().collect(),
    }
}

/// Nine sample times, several widths of the converter, `runs` runs each.
pub(super) fn sample_times(bits: &[f64], runs: u32) -> Table {
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
pub(super) fn gains(across: u32, up: u32) -> Table {
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
        words("status", &state),
    ])
}

/// 500 runs with a figure of either sign, spread about 0, and its verdict.
pub(super) fn spread() -> Table {
    // Shares that look like chance, summed to something like a bell.
    let share = |i: u32, step: f64| (f64::from(i * i) * step).fract();
    let bell = |i: u32| {
        let steps = [0.618_034, 0.414_214, 0.732_051, 0.236_068];
        steps.iter().map(|&step| share(i, step)).sum::<f64>() - 2.0
    };
    let figure: Vec<f64> = (0..500).map(bell).collect();
    let gap = (0..500).map(|i| 10_f64.powf(-2.0 + 2.0 * share(i, 0.324_718)));
    let error = figure.iter().map(|v| 0.5 + 0.1 * v);
    let pass = figure.iter().map(|v| f64::from(u8::from(v.abs() < 0.8)));
    table([
        numbers("transmission.backlash_half_deg", gap),
        numbers("final_error_um", figure.iter().map(|value| 100.0 * value)),
        numbers("peak_following_error_mm", error),
        numbers("pass", pass),
    ])
}

/// A figure for every control law and width.
pub(super) fn laws() -> Table {
    let laws = ["continuous", "sampled", "quantised", "firmware"];
    let law: Vec<&str> = (0..12).map(|i| laws[i % 4]).collect();
    let value = |i: u32| (i != 5).then(|| -650.0 + 90.0 * f64::from(i));
    let values: Vec<Option<f64>> = (0..12).map(value).collect();
    let error = (0..12).map(|i| 0.03 + f64::from(i * i));
    table([
        words("controller.law", &law),
        numbers("drive.dac_bits", (0..12).map(|i| [8.0, 12.0, 16.0][i / 4])),
        holes("final_error_um", &values),
        numbers("rms_acc_error_mps2", error),
    ])
}

/// Columns with units that have prefixes, on a grid.
fn lengths() -> Table {
    table([
        numbers("x_s", [1.0, 2.0, 1.0, 2.0]),
        numbers("y_mm", [1.0, 1.0, 2.0, 2.0]),
        numbers("z", [1.0, 2.0, 3.0, 4.0]),
    ])
}

/// Awkward values along a plain x.
fn awkward() -> Table {
    let (nan, infinite) = (Some(f64::NAN), Some(f64::INFINITY));
    let none = [None, nan, infinite, None, Some(-f64::NAN)];
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

/// A curve across the map of gains.
pub(super) fn border() -> Curve {
    let point = |i: u32| (0.05 * 1.05_f64.powi(i as i32), 3e-5 * f64::from(i));
    Curve {
        label: "border of stability".into(),
        points: (0..100).map(point).collect(),
    }
}

/// A single run.
fn one() -> Table {
    table([numbers("x_s", [0.001]), numbers("y_mm", [5.0])])
}

/// Names that no line can hold, and letters that XML does not take.
fn long_names() -> Table {
    let long = "a rather long name of a series that nobody would call short, and which goes on \
                for longer than a line of the legend has room for, so that it must be folded";
    let laws = ["continuous", "sampled", "continuous", "sampled"];
    let names = [long, long, "b <&> \"c\"", "b <&> \"c\""];
    table([
        words("controller.law", &laws),
        words("names", &names),
        numbers("y_mm", [0.1, -0.2, 0.3, 0.25]),
    ])
}
