//! The trace of a run: position and velocity of the carriage, the commanded velocity,
//! and the same rows as CSV and as Parquet.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs::File;
use std::path::Path;
use std::process::{Command, Output};

use hil_runner::files;
use parquet::basic::Type;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

fn ran(folder: &Path, line: &str) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    program.args(line.split_whitespace()).current_dir(folder);
    program.output().unwrap()
}

/// A column with its type and the value of every row as the CSV has it.
type Column = (String, Type, Vec<String>);

fn csv(path: &Path) -> Vec<(String, Vec<String>)> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().clone();
    let mut columns: Vec<_> = header
        .iter()
        .map(|name| (name.to_owned(), Vec::new()))
        .collect();
    for row in reader.records() {
        for (value, (_, values)) in row.unwrap().iter().zip(&mut columns) {
            values.push(value.to_owned());
        }
    }
    columns
}

fn parquet(path: &Path) -> Vec<Column> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let schema = reader.metadata().file_metadata().schema_descr();
    let column = |column: &parquet::schema::types::ColumnDescPtr| {
        (column.name().to_owned(), column.physical_type(), Vec::new())
    };
    let mut columns: Vec<Column> = schema.columns().iter().map(column).collect();
    for row in reader.get_row_iter(None).unwrap() {
        for ((_, field), (_, _, values)) in row.unwrap().get_column_iter().zip(&mut columns) {
            values.push(match field {
                Field::Double(number) => number.to_string(),
                Field::Long(whole) => whole.to_string(),
                Field::Str(text) => text.clone(),
                other => format!("{other:?}"),
            });
        }
    }
    columns
}

const LAWS: [&str; 4] = ["continuous", "sampled", "quantised", "firmware"];

/// On every rung: x = p·γ and v = p·γ̇ to the last bit, and a commanded velocity that
/// central differences of the command confirm as far as its jerk lets them.
#[test]
fn rows_have_position_and_velocities() {
    let folder = tempfile::tempdir().unwrap();
    for law in LAWS {
        let sets = [format!("controller.law={law}")];
        let line = format!("run paper-2 --set {} --trace t.csv", sets[0]);
        assert_eq!(ran(folder.path(), &line).status.code(), Some(0));
        let columns = csv(&folder.path().join("t.csv"));
        let column = |name: &str| -> Vec<f64> {
            let found = columns.iter().find(|(other, _)| other == name).unwrap();
            found.1.iter().map(|text| text.parse().unwrap()).collect()
        };
        let case = files::case("paper-2", &sets).unwrap();
        let pitch = case.axis.transmission.screw_pitch_m_per_rad;
        for (name, of) in [("x_m", "gamma_rad"), ("v_mps", "gamma_dot_radps")] {
            let scaled: Vec<f64> = column(of).iter().map(|value| pitch * value).collect();
            assert_eq!(column(name), scaled, "{law}: {name}");
        }
        // The axis moves, and the carriage is not the motor.
        assert!(column("v_mps").iter().any(|v| *v > 0.1), "{law}");
        let of_motor: Vec<f64> = column("beta_dot_radps").iter().map(|v| pitch * v).collect();
        assert_ne!(column("v_mps"), of_motor, "{law}");
        let (x, v, acc) = (
            column("x_ref_m"),
            column("v_ref_mps"),
            column("acc_ref_mps2"),
        );
        let h = column("t_s")[1];
        let jerk = acc
            .windows(2)
            .map(|a| (a[1] - a[0]).abs() / h)
            .fold(0.0, f64::max);
        let largest = |difference: fn(&[f64]) -> f64| {
            let off = x.windows(3).zip(&v[1..]);
            off.map(|(x, v)| (difference(x) - v).abs())
                .fold(0.0, f64::max)
        };
        // The remainder of Taylor's series, h²/6 of the third derivative.
        let bound = 1.01 * h * h / 6.0 * jerk;
        let central = largest(|x| (x[2] - x[0]) / 2e-3);
        assert!(h == 1e-3 && central <= bound, "{law}: {central} > {bound}");
        // The contrast: a difference of two rows is half a row late.
        let backward = largest(|x| (x[1] - x[0]) / 1e-3);
        assert!(backward > 10.0 * bound, "{law}: {backward}");
    }
}

/// CSV and Parquet have the same columns and, bit for bit, the same values.
#[test]
fn parquet_has_the_values_of_the_csv() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let supervised = "firmware --set controller.anti_windup=clamp";
    for law in LAWS.into_iter().chain([supervised]) {
        let run = |trace: &str| {
            let line = format!("run paper-3 --set controller.law={law} --trace {trace}");
            assert_eq!(ran(folder.path(), &line).status.code(), Some(0), "{law}");
        };
        run("t.csv");
        run("t.parquet");
        let (text, binary) = (csv(&path("t.csv")), parquet(&path("t.parquet")));
        assert_eq!(text.len(), binary.len(), "{law}");
        let states = binary
            .iter()
            .filter(|(name, _, _)| name == "axis_state")
            .count();
        assert_eq!(states, usize::from(law == supervised));
        for ((name, texts), (other, kind, values)) in text.iter().zip(&binary) {
            assert_eq!((name, texts.len()), (other, 1501));
            match name.as_str() {
                "axis_state" => assert_eq!((*kind, texts), (Type::BYTE_ARRAY, values)),
                "contact" => assert_eq!((*kind, texts), (Type::INT64, values)),
                name => {
                    let bits = |texts: &[String]| -> Vec<u64> {
                        texts
                            .iter()
                            .map(|text| text.parse::<f64>().unwrap().to_bits())
                            .collect()
                    };
                    assert_eq!(*kind, Type::DOUBLE, "{name}");
                    assert_eq!(bits(texts), bits(values), "{law}: {name}");
                }
            }
        }
    }
}

/// What was traced before a run ended is kept as Parquet too, whole; a run without rows
/// replaces nothing.
#[test]
fn parquet_of_a_run_that_ends_early_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.PARQUET");
    let line = "run paper-2 --trace t.PARQUET --time-limit 1e-6";
    assert_eq!(ran(folder.path(), line).status.code(), Some(2));
    let rows = parquet(&path)[0].2.len();
    assert!((1..1501).contains(&rows), "{rows}");
    let before = std::fs::read(&path).unwrap();
    let line = "run paper-2 --trace t.PARQUET --set controller.kp=1e9";
    assert_eq!(ran(folder.path(), line).status.code(), Some(2));
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
