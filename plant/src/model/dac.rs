//! D/A converter as a physical part (paper, eq. 24).

use crate::model::parameters::Dac;

impl Dac {
    /// A converter of `bits` bits over the full span `range_v` = ΔV \[V\]:
    /// `K_dac = ΔV/2^n`, eq. 24.
    pub fn with_range(bits: u32, range_v: f64) -> Self {
        Self {
            bits,
            step_v: range_v / f64::from(1_u32 << bits.min(31)),
        }
    }

    /// `V_out = K_dac·code`, eq. 24 \[V\]. The code may be a real number: rung
    /// `sampled` has a converter without steps.
    pub fn output_v(&self, code: f64) -> f64 {
        self.step_v * code
    }

    /// Lowest code, `−2^(n−1)`.
    pub fn code_min(&self) -> i32 {
        -(1 << (self.bits - 1))
    }

    /// Highest code, `2^(n−1) − 1`.
    pub fn code_max(&self) -> i32 {
        (1 << (self.bits - 1)) - 1
    }
}
