//! Trace of a run: one row per sample.

use std::io::Write;

use firmware::State;

/// One row: the plant at t_k and what the controller computed from it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Row {
    /// `t_k` \[s\].
    pub t_s: f64,
    /// Commanded displacement of the carriage \[m\].
    pub x_ref_m: f64,
    /// Commanded acceleration \[m/s²\], right-continuous.
    pub acc_ref_mps2: f64,
    /// Position error and DAC code; `None` on rung `continuous`.
    pub sample: Option<Sample>,
    /// Motor voltage of this row's code, in force or not yet; on rung
    /// `continuous` the voltage at t \[V\].
    pub motor_voltage_v: f64,
    /// Armature current \[A\].
    pub current_a: f64,
    /// Gear output angle β \[rad\].
    pub beta_rad: f64,
    /// Gear output speed \[rad/s\].
    pub beta_dot_radps: f64,
    /// Screw angle γ \[rad\].
    pub gamma_rad: f64,
    /// Screw speed \[rad/s\].
    pub gamma_dot_radps: f64,
    /// Carriage acceleration \[m/s²\].
    pub acc_mps2: f64,
    /// −1, 0 or +1.
    pub contact: i8,
    /// Displacement of the carriage, p·γ \[m\].
    pub x_m: f64,
    /// Velocity of the carriage, p·γ̇ \[m/s\].
    pub v_mps: f64,
    /// Commanded velocity \[m/s\].
    pub v_ref_mps: f64,
}

/// A value of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A whole number.
    Whole(i8),
    /// A name.
    Word(&'static str),
}

impl Row {
    /// The columns that the row has on its rung, by name, in the order of a trace.
    pub fn columns(&self) -> impl Iterator<Item = (&'static str, Value)> + Clone {
        // The sum turns −0 into 0, which is what a reader expects to see.
        let number = |value: f64| Some(Value::Number(value + 0.0));
        let sample = self.sample.as_ref();
        let of_sample = |of: fn(&Sample) -> f64| number(of(sample?));
        let state = sample.and_then(|sample| sample.axis_state);
        let columns = [
            ("t_s", number(self.t_s)),
            ("x_ref_m", number(self.x_ref_m)),
            ("acc_ref_mps2", number(self.acc_ref_mps2)),
            ("error_counts", of_sample(|sample| sample.error_counts)),
            ("dac_code", of_sample(|sample| sample.dac_code)),
            ("motor_voltage_v", number(self.motor_voltage_v)),
            ("current_a", number(self.current_a)),
            ("beta_rad", number(self.beta_rad)),
            ("beta_dot_radps", number(self.beta_dot_radps)),
            ("gamma_rad", number(self.gamma_rad)),
            ("gamma_dot_radps", number(self.gamma_dot_radps)),
            ("acc_mps2", number(self.acc_mps2)),
            ("contact", Some(Value::Whole(self.contact))),
            ("axis_state", state.map(|state| Value::Word(state.name()))),
            ("x_m", number(self.x_m)),
            ("v_mps", number(self.v_mps)),
            ("v_ref_mps", number(self.v_ref_mps)),
        ];
        let there = |(name, value): (_, Option<_>)| Some((name, value?));
        columns.into_iter().filter_map(there)
    }
}

/// The controller's part of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// `e` \[counts\].
    pub error_counts: f64,
    /// DAC code after its clamp.
    pub dac_code: f64,
    /// State of the axis; `None` where no supervision runs.
    pub axis_state: Option<State>,
}

/// Writes rows as CSV, numbers so that they read back exactly.
#[derive(Debug)]
pub struct TraceWriter<W: Write> {
    csv: csv::Writer<W>,
    header_written: bool,
}

impl<W: Write> TraceWriter<W> {
    /// Writes to `sink`.
    pub fn new(sink: W) -> Self {
        Self {
            csv: csv::Writer::from_writer(sink),
            header_written: false,
        }
    }

    /// Writes one row, and the header before the first.
    ///
    /// # Errors
    /// Whatever the sink reports.
    pub fn row(&mut self, row: &Row) -> std::io::Result<()> {
        if !self.header_written {
            let names = row.columns().map(|(name, _)| name);
            self.csv.write_record(names).map_err(io_error)?;
            self.header_written = true;
        }
        for (_, value) in row.columns() {
            match value {
                Value::Number(number) => self.csv.write_field(shortest(number)),
                Value::Whole(whole) => self.csv.write_field(whole.to_string()),
                Value::Word(word) => self.csv.write_field(word),
            }
            .map_err(io_error)?;
        }
        self.csv.write_record(None::<&[u8]>).map_err(io_error)
    }

    /// True before the first row.
    pub fn is_empty(&self) -> bool {
        !self.header_written
    }

    /// Writes out what is still buffered and returns the sink.
    ///
    /// # Errors
    /// Whatever the sink reports.
    pub fn finish(self) -> std::io::Result<W> {
        self.csv.into_inner().map_err(|error| error.into_error())
    }
}

/// The sink's own error; a row of equal length each time leaves nothing else.
fn io_error(error: csv::Error) -> std::io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => std::io::Error::other(format!("{other:?}")),
    }
}

/// The shortest text that reads back as the same number; whole numbers
/// without a fraction, very small and very large ones with an exponent.
fn shortest(value: f64) -> String {
    match value.abs() {
        magnitude if magnitude != 0.0 && !(1e-5..1e16).contains(&magnitude) => format!("{value:e}"),
        _ => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_exactly() {
        let power = 2.0_f64.powi(60);
        for value in [0.1, 1.0 / 3.0, 5e-324, 1e22, -6.02e-7, 12345678.9, power] {
            assert_eq!(shortest(value).parse::<f64>().unwrap(), value);
        }
        assert_eq!(shortest(-6200.0), "-6200");
    }

    /// No −0 is shown, and what a rung has not is no column.
    #[test]
    fn rows_have_the_columns_of_their_rung() {
        let row = Row {
            x_ref_m: -0.0,
            acc_ref_mps2: 1.0,
            contact: -1,
            x_m: 0.25,
            v_ref_mps: -0.5,
            ..Row::default()
        };
        let mut trace = TraceWriter::new(Vec::new());
        trace.row(&row).unwrap();
        let text = String::from_utf8(trace.finish().unwrap()).unwrap();
        let (header, values) = text.split_once('\n').unwrap();
        assert!(!header.contains("dac_code") && !header.contains("axis_state"));
        assert_eq!(values, "0,0,1,0,0,0,0,0,0,0,-1,0.25,0,-0.5\n");
    }
}
