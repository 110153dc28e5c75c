//! Trace of a run: one row per sample.

use std::io::Write;

use firmware::State;

/// One row: the plant at t_k and what the controller computed from it.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        let sample = row.sample.as_ref();
        let state = sample.and_then(|sample| sample.axis_state);
        let columns = [
            ("t_s", Some(row.t_s)),
            ("x_ref_m", Some(row.x_ref_m)),
            ("acc_ref_mps2", Some(row.acc_ref_mps2)),
            ("error_counts", sample.map(|sample| sample.error_counts)),
            ("dac_code", sample.map(|sample| sample.dac_code)),
            ("motor_voltage_v", Some(row.motor_voltage_v)),
            ("current_a", Some(row.current_a)),
            ("beta_rad", Some(row.beta_rad)),
            ("beta_dot_radps", Some(row.beta_dot_radps)),
            ("gamma_rad", Some(row.gamma_rad)),
            ("gamma_dot_radps", Some(row.gamma_dot_radps)),
            ("acc_mps2", Some(row.acc_mps2)),
            ("contact", Some(f64::from(row.contact))),
        ];
        let columns = columns.into_iter();
        let columns = columns.filter_map(|(name, value)| Some((name, value?)));
        if !self.header_written {
            let names = columns.clone().map(|(name, _)| name);
            let names = names.chain(state.map(|_| "axis_state"));
            self.csv.write_record(names).map_err(io_error)?;
            self.header_written = true;
        }
        for (_, value) in columns {
            self.csv.write_field(shortest(value)).map_err(io_error)?;
        }
        if let Some(state) = state {
            self.csv.write_field(state.name()).map_err(io_error)?;
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
    // Adding 0 turns −0 into 0, which is what a reader expects to see.
    let value = value + 0.0;
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
        assert_eq!(shortest(-0.0), "0");
        assert_eq!(shortest(-6200.0), "-6200");
    }
}
