//! A number that changes with every bit of a run.

use hil_core::run::Outcome;
use hil_core::trace::Row;

/// FNV-1a, 64 bits: short, the same everywhere, and no dependency. It guards
/// against chance, not against malice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    /// Takes in the bits of a number; −0 is not 0, and one NaN not another.
    pub fn number(&mut self, value: f64) {
        for byte in value.to_bits().to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// The digest so far.
    pub fn value(self) -> u64 {
        self.0
    }

    /// All numbers of all rows, and of every contact change.
    pub fn of_run(rows: &[Row], outcome: &Outcome) -> u64 {
        let mut digest = Self::default();
        for row in rows {
            let numbers = [
                row.t_s,
                row.x_ref_m,
                row.acc_ref_mps2,
                row.motor_voltage_v,
                row.current_a,
                row.beta_rad,
                row.beta_dot_radps,
                row.gamma_rad,
                row.gamma_dot_radps,
                row.acc_mps2,
                f64::from(row.contact),
            ];
            let sample = row.sample.map(|s| [s.error_counts, s.dac_code]);
            for value in numbers.into_iter().chain(sample.into_iter().flatten()) {
                digest.number(value);
            }
        }
        for change in &outcome.contact_changes {
            digest.number(change.time_s);
            digest.number(f64::from(change.to.sign()));
            digest.number(change.acceleration_before_mps2);
            digest.number(change.acceleration_after_mps2);
        }
        let summary = &outcome.summary;
        digest.number(summary.peak_abs_acc_mps2);
        digest.number(summary.peak_following_error_mm);
        digest.number(summary.peak_abs_current_a);
        digest.value()
    }
}
