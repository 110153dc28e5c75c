//! A log measured on a real axis, and how far a run is from it.
//!
//! A log is CSV: the first line names its columns, `t_s` and any of [`COLUMNS`],
//! which are those of a trace and of the report; others are ignored, and listed.
//! Between two rows of the run the simulation is the straight line; codes,
//! contacts and voltages that change with codes alone hold.

use serde::Serialize;

use crate::case::Case;
use crate::number::{column, seconds};
use crate::runfile::csv_line;
use crate::trace::Row;

/// A column that logs and runs have in common.
#[derive(Debug)]
pub struct Column {
    /// Its name, the unit at its end.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// True where it holds its value from row to row.
    held: fn(&Case) -> bool,
    /// Its value in a row; `None` where the case has no such thing.
    of: fn(&Case, &Row) -> Option<f64>,
}

const fn line(
    name: &'static str,
    unit: &'static str,
    of: fn(&Case, &Row) -> Option<f64>,
) -> Column {
    Column {
        name,
        unit,
        held: |_| false,
        of,
    }
}

/// Everything of a run that a log can be compared with.
pub const COLUMNS: [Column; 17] = [
    line("x_ref_m", "m", |_, row| Some(row.x_ref_m)),
    line("x_m", "m", |_, row| Some(row.x_m)),
    line("v_ref_mps", "m/s", |_, row| Some(row.v_ref_mps)),
    line("v_mps", "m/s", |_, row| Some(row.v_mps)),
    line("acc_ref_mps2", "m/s²", |_, row| Some(row.acc_ref_mps2)),
    line("acc_mps2", "m/s²", |_, row| Some(row.acc_mps2)),
    line("following_error_mm", "mm", |_, row| {
        Some(1e3 * (row.x_ref_m - row.x_m))
    }),
    line("error_counts", "counts", |_, row| {
        Some(row.sample?.error_counts)
    }),
    Column {
        held: |_| true,
        ..line("dac_code", "codes", |_, row| Some(row.sample?.dac_code))
    },
    Column {
        held: Case::holds_the_voltage,
        ..line("motor_voltage_v", "V", |_, row| Some(row.motor_voltage_v))
    },
    line("current_a", "A", |_, row| Some(row.current_a)),
    line("beta_rad", "rad", |_, row| Some(row.beta_rad)),
    line("beta_dot_radps", "rad/s", |_, row| Some(row.beta_dot_radps)),
    line("gamma_rad", "rad", |_, row| Some(row.gamma_rad)),
    line("gamma_dot_radps", "rad/s", |_, row| {
        Some(row.gamma_dot_radps)
    }),
    line("gap_deg", "°", |case, row| {
        case.axis.transmission.joint.elastic()?;
        Some((row.beta_rad - row.gamma_rad).to_degrees())
    }),
    Column {
        held: |_| true,
        ..line("contact", "", |_, row| Some(f64::from(row.contact)))
    },
];

/// A log, checked. Serialises as plot data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredLog {
    /// Name of the file.
    pub name: String,
    /// Offset that its times have been given \[s\].
    pub offset_s: f64,
    /// Times \[s\], the offset included, never falling.
    #[serde(serialize_with = "column")]
    pub t_s: Vec<f64>,
    /// The columns that are used, in the file's order.
    pub columns: Vec<LogColumn>,
    /// Names of the columns that are not.
    pub ignored: Vec<String>,
}

/// One column of a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LogColumn {
    /// Its name, one of [`COLUMNS`].
    pub name: &'static str,
    /// Place in [`COLUMNS`].
    #[serde(skip)]
    place: usize,
    /// Its cell in a line.
    #[serde(skip)]
    cell: usize,
    /// A value for each time.
    #[serde(serialize_with = "column")]
    pub values: Vec<f64>,
}

/// The first mistake in a log.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {problem}")]
pub struct LogError {
    /// Name of the file.
    pub file: String,
    /// Its line, from 1.
    pub line: u64,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

/// Of the names in the first line of a log the cell of the times, the columns that are used,
/// without a value yet, and the names of the others.
///
/// # Errors
/// The sentence that says what is missing, or stands twice.
fn columns(names: &csv::StringRecord) -> Result<(usize, Vec<LogColumn>, Vec<String>), String> {
    let known = || COLUMNS.map(|column| column.name).join(", ");
    if let Some(twice) = (names.iter().enumerate())
        .find_map(|(i, name)| names.iter().take(i).find(|before| *before == name))
    {
        return Err(format!("column {twice} stands twice; once is allowed"));
    }
    let Some(time) = names.iter().position(|name| name == "t_s") else {
        let commas = match names.len() {
            1 => " between commas",
            _ => "",
        };
        return Err(format!(
            "there is no column t_s; the first line names the columns{commas}, t_s and at least one of {}",
            known()
        ));
    };
    let (mut columns, mut ignored) = (Vec::new(), Vec::new());
    for (cell, name) in names.iter().enumerate().filter(|(cell, _)| *cell != time) {
        match COLUMNS.iter().position(|column| column.name == name) {
            Some(place) => columns.push(LogColumn {
                name: COLUMNS[place].name,
                place,
                cell,
                values: Vec::new(),
            }),
            None => ignored.push(name.to_owned()),
        }
    }
    if columns.is_empty() {
        let words = "no column besides t_s is known; at least one is needed of";
        return Err(format!("{words} {}", known()));
    }
    Ok((time, columns, ignored))
}

impl MeasuredLog {
    /// Reads a log; `offset_s` \[s\] is added to its times.
    ///
    /// # Errors
    /// [`LogError`] without `t_s` or any known column, with a column twice, a cell
    /// of a used column that is no finite number, a line of another length, times
    /// that fall, or no line below the names.
    pub fn parse(file: &str, text: &str, offset_s: f64) -> Result<Self, LogError> {
        let refuse = |line: u64, problem: String| LogError {
            file: file.to_owned(),
            line,
            problem,
        };
        let text = text.trim_start_matches('\u{feff}');
        let mut csv = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let malformed = |error: &csv::Error| {
            let line = csv_line(text, error.position());
            let problem = match error.kind() {
                csv::ErrorKind::UnequalLengths {
                    expected_len, len, ..
                } => format!(
                    "{len} cells where the first line has {expected_len}; a cell for each column is allowed"
                ),
                _ => format!("not CSV: {error}"),
            };
            refuse(line, problem)
        };
        let names = csv.headers().map_err(|error| malformed(&error))?;
        let (time, mut columns, ignored) = columns(names).map_err(|problem| refuse(1, problem))?;
        let (mut t_s, mut before_s) = (Vec::new(), f64::NEG_INFINITY);
        for record in csv.records() {
            let record = record.map_err(|error| malformed(&error))?;
            let line = csv_line(text, record.position());
            let number = |name: &str, cell: usize| {
                let text = record.get(cell).unwrap_or_default();
                let number = text.parse().ok().filter(|number: &f64| number.is_finite());
                let allowed = "only a finite number is";
                number.ok_or_else(|| {
                    refuse(line, format!("{name} = {text:?} is not allowed: {allowed}"))
                })
            };
            let now_s = number("t_s", time)?;
            if now_s < before_s {
                let problem = format!(
                    "t_s = {now_s} is not allowed: times must not fall, and the line before has {before_s}"
                );
                return Err(refuse(line, problem));
            }
            before_s = now_s;
            t_s.push(now_s + offset_s);
            for column in &mut columns {
                column.values.push(number(column.name, column.cell)?);
            }
        }
        if t_s.is_empty() {
            let problem = "no line below the names of the columns; at least one is needed";
            return Err(refuse(1, problem.to_owned()));
        }
        Ok(Self {
            name: file.to_owned(),
            offset_s,
            t_s,
            columns,
            ignored,
        })
    }

    /// The sentence that refuses a log of which no time lies within a run.
    pub fn is_apart_from(&self, case: &Case) -> Option<String> {
        let end_s = seconds(case.run.duration_ns);
        if self.t_s.iter().any(|t_s| (0.0..=end_s).contains(t_s)) {
            return None;
        }
        let [first, last] = [self.t_s.first(), self.t_s.last()].map(|t| t.copied().unwrap_or(0.0));
        let (file, name) = (&self.name, &case.name);
        Some(format!(
            "{file}: t_s from {first} to {last} s, the offset included, is apart from the run of \
             {name}, which is from 0 to {end_s} s"
        ))
    }
}

/// How far a run is from one column of a log, simulated less measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LogDifference {
    /// The column.
    pub column: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Instants of the log that lie within the run.
    pub samples: usize,
    /// Root mean square; `None` without a sample.
    pub rms: Option<f64>,
    /// The difference of largest magnitude, the first of several, signed.
    pub largest: Option<f64>,
    /// Its time \[s\].
    pub largest_at_s: Option<f64>,
}

/// Follows a run by its rows and compares them with a log.
#[derive(Debug)]
pub struct Comparison<'a> {
    log: &'a MeasuredLog,
    case: &'a Case,
    next: usize,
    last: Option<Row>,
    /// Of each column.
    sums: Vec<Sum>,
}

/// Sum over a column.
#[derive(Debug, Clone, Default)]
struct Sum {
    samples: usize,
    squares: f64,
    /// The largest difference and its time.
    largest: (f64, f64),
}

impl<'a> Comparison<'a> {
    /// Before the first row of the run of `case`.
    pub fn new(log: &'a MeasuredLog, case: &'a Case) -> Self {
        Self {
            log,
            case,
            next: 0,
            last: None,
            sums: vec![Sum::default(); log.columns.len()],
        }
    }

    /// Takes the next row.
    pub fn row(&mut self, row: &Row) {
        while let Some(&t_s) = self.log.t_s.get(self.next)
            && t_s <= row.t_s
        {
            // An instant before the run has no row before it.
            if t_s == row.t_s || self.last.is_some() {
                self.compare(t_s, row);
            }
            self.next += 1;
        }
        self.last = Some(*row);
    }

    /// Compares at the log's next instant, after the last row and up to this one.
    fn compare(&mut self, t_s: f64, row: &Row) {
        for (column, sum) in self.log.columns.iter().zip(&mut self.sums) {
            let Column { held, of, .. } = &COLUMNS[column.place];
            let value = |row: &Row| of(self.case, row);
            let simulated = match &self.last {
                Some(last) if t_s < row.t_s => value(last).zip(value(row)).map(|(from, to)| {
                    if held(self.case) {
                        return from;
                    }
                    from + (to - from) * ((t_s - last.t_s) / (row.t_s - last.t_s))
                }),
                _ => value(row),
            };
            let Some(simulated) = simulated else { continue };
            let difference = simulated - column.values[self.next];
            if difference.abs() > sum.largest.0.abs() || sum.samples == 0 {
                sum.largest = (difference, t_s);
            }
            sum.samples += 1;
            sum.squares += difference * difference;
        }
    }

    /// The differences, a column each.
    pub fn differences(&self) -> Vec<LogDifference> {
        let columns = self.log.columns.iter().zip(&self.sums);
        let difference = |(column, sum): (&LogColumn, &Sum)| {
            let some = |value: f64| (sum.samples > 0).then_some(value);
            LogDifference {
                column: column.name,
                unit: COLUMNS[column.place].unit,
                samples: sum.samples,
                rms: some(libm::sqrt(sum.squares / sum.samples as f64)),
                largest: some(sum.largest.0),
                largest_at_s: some(sum.largest.1),
            }
        };
        columns.map(difference).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{RunOptions, run};
    use crate::runfile::builtin;

    fn case() -> Case {
        builtin("paper-2", &["controller.law=sampled".to_owned()]).unwrap()
    }

    /// A row whose carriage moves at 2 m/s and whose voltage is 10 V a second.
    fn row(t_s: f64) -> Row {
        Row {
            t_s,
            motor_voltage_v: 10.0 * t_s,
            x_m: 2.0 * t_s,
            v_mps: 2.0,
            ..Row::default()
        }
    }

    fn compared(text: &str, offset_s: f64) -> Vec<LogDifference> {
        let log = MeasuredLog::parse("m.csv", text, offset_s).unwrap();
        let case = case();
        let mut comparison = Comparison::new(&log, &case);
        for t_s in [0.0, 1.0, 2.0] {
            comparison.row(&row(t_s));
        }
        comparison.differences()
    }

    fn close(found: Option<f64>, wanted: f64) -> bool {
        found.is_some_and(|found| (found - wanted).abs() < 1e-12)
    }

    /// x is 2·t: 1, 2 and 3 m at ½, 1 and 1½ s. Measured is 1, 5 and 3, so that the
    /// differences are 0, −3 and 0, their rms √3. The voltage holds: 0, 10, 10 V
    /// less 1 V each.
    #[test]
    fn differences_are_those_of_the_straight_line_and_of_what_holds() {
        let text = "t_s,x_m,note,motor_voltage_v\n0.5,1,a,1\n1,5,,1\n1.5,3,b,1\n";
        let [x, v] = compared(text, 0.0).try_into().unwrap();
        assert!(
            close(x.rms, 3.0_f64.sqrt()) && close(x.largest, -3.0),
            "{x:?}"
        );
        assert_eq!((x.largest_at_s, x.samples, x.unit), (Some(1.0), 3, "m"));
        // −1, 9 and 9 V.
        assert!(
            close(v.rms, (163.0_f64 / 3.0).sqrt()) && close(v.largest, 9.0),
            "{v:?}"
        );
        // The contrast: another measurement is another difference, and so is
        // another time.
        let other = compared(&text.replace("1,5,", "1,5.5,"), 0.0)[0];
        assert!(close(other.largest, -3.5) && !close(other.rms, 3.0_f64.sqrt()));
        let late = compared(text, 0.25)[0];
        // 0.5, −2.5 and 0.5 m.
        assert!(
            close(late.largest, -2.5) && late.largest_at_s == Some(1.25),
            "{late:?}"
        );
    }

    #[test]
    fn instants_outside_of_the_run_are_not_compared() {
        let text = "t_s,x_m\n-1,7\n0,0\n2,4\n2.5,7\n";
        let [x] = compared(text, 0.0).try_into().unwrap();
        assert_eq!((x.samples, x.rms, x.largest), (2, Some(0.0), Some(0.0)));
        let [x] = compared("t_s,x_m,\n5,1,\n", 0.0).try_into().unwrap();
        assert_eq!((x.samples, x.rms, x.largest), (0, None, None));
        let log = MeasuredLog::parse("m.csv", "t_s,x_m\n5,1\n", 0.0).unwrap();
        assert!(
            log.is_apart_from(&case())
                .is_some_and(|words| words.contains("from 5 to 5 s"))
        );
        let log = MeasuredLog::parse("m.csv", "t_s,x_m\n5,1\n", -4.0).unwrap();
        assert_eq!(log.is_apart_from(&case()), None);
    }

    /// A run is no distance from its own trace in any column; one of another gain
    /// is.
    #[test]
    fn a_run_agrees_with_its_own_trace() {
        let mut trace = crate::trace::TraceWriter::new(Vec::new());
        let options = RunOptions::default();
        run(&case(), options, &mut |row| trace.row(row)).unwrap();
        let text = String::from_utf8(trace.finish().unwrap()).unwrap();
        let log = MeasuredLog::parse("trace.csv", &text, 0.0).unwrap();
        assert!(log.ignored.is_empty());
        let differences = |case: &Case| {
            let mut comparison = Comparison::new(&log, case);
            run(case, options, &mut |row| {
                comparison.row(row);
                Ok(())
            })
            .unwrap();
            comparison.differences()
        };
        for same in differences(&case()) {
            assert_eq!(
                (same.rms, same.largest, same.samples),
                (Some(0.0), Some(0.0), 1501)
            );
        }
        let set = ["controller.law=sampled", "controller.kp=3"].map(str::to_owned);
        let other = builtin("paper-2", &set).unwrap();
        let moved = differences(&other);
        let apart = |name: &str| moved.iter().any(|d| d.column == name && d.rms > Some(1e-6));
        assert!(apart("beta_rad") && apart("dac_code") && apart("acc_mps2") && !apart("x_ref_m"));
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        for (text, words) in [
            (
                "x_m,y\n1,2\n",
                "m.csv:1: there is no column t_s; the first line names",
            ),
            ("", "m.csv:1: there is no column t_s"),
            ("t_s,foo\n1,2\n", "m.csv:1: no column besides t_s is known"),
            ("t_s,x_m,x_m\n1,2,3\n", "m.csv:1: column x_m stands twice"),
            ("t_s,x_m\n", "m.csv:1: no line below the names"),
            (
                "t_s,x_m\n0,1\n1,abc\n",
                "m.csv:3: x_m = \"abc\" is not allowed: only a finite number is",
            ),
            ("t_s,x_m\n0,NaN\n", "m.csv:2: x_m = \"NaN\" is not allowed"),
            ("t_s,x_m\ninf,0\n", "m.csv:2: t_s = \"inf\" is not allowed"),
            ("t_s,x_m\n0,\n", "m.csv:2: x_m = \"\" is not allowed"),
            (
                "t_s,x_m\n0.5,1\n\n0.25,1\n",
                "m.csv:4: t_s = 0.25 is not allowed: times must not fall",
            ),
            (
                "t_s,x_m\n0,1,2\n",
                "m.csv:2: 3 cells where the first line has 2",
            ),
        ] {
            let told = MeasuredLog::parse("m.csv", text, 0.0)
                .unwrap_err()
                .to_string();
            assert!(told.starts_with(words), "{told}");
        }
        // The contrast: spaces, a mark of the byte order, a time twice, and text
        // where nobody reads.
        let text = "\u{feff}t_s , x_m, note\r\n0, 1e-3, NaN\r\n0, 2, hm\r\n";
        let log = MeasuredLog::parse("m.csv", text, 0.5).unwrap();
        assert_eq!(
            (log.t_s, log.columns[0].values.clone()),
            (vec![0.5; 2], vec![1e-3, 2.0])
        );
        assert_eq!(log.ignored, ["note"]);
    }
}
