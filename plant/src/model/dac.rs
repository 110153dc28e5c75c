//! D/A converter as a physical part (paper, eq. 24).

/// D/A converter as a physical part (eq. 24).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dac {
    /// `n`, number of bits; codes run from −2^(n−1) to 2^(n−1)−1.
    pub bits: u32,
    /// `K_dac = ΔV/2^n`, volts per code \[V\], greater than 0.
    pub step_v: f64,
}

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
