//! What controller and plant tell each other, once per sample.

use crate::controllers::AxisStatus;

/// What the encoder shows at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Number of the sample, k.
    pub tick: u64,
    /// Position of the motor shaft \[counts\]: whole on every rung that has an
    /// encoder, `K_enc·α` itself on rung `sampled`.
    pub position_counts: f64,
    /// What an encoder at the load shows \[load counts\], where there is one.
    pub load_counts: Option<f64>,
}

/// What the controller answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Number of the sample that this answers.
    pub tick: u64,
    /// `e = r − c` \[counts\].
    pub error_counts: f64,
    /// DAC code; a real number on rung `sampled`.
    pub dac_code: f64,
    /// Whether the firmware worked outside its declared ranges.
    pub out_of_range: bool,
    /// How long the controller was busy with it; `None` where nobody measures.
    pub execution: Option<ExecutionTime>,
    /// What the axis reports; `None` where no supervision runs.
    pub axis: Option<AxisStatus>,
}

/// How long a controller on a chip was busy with one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExecutionTime {
    /// Instructions; `None` on a board, which counts cycles.
    pub instructions: Option<u32>,
    /// Cycles of the core: counted, or instructions times a stated factor.
    pub cycles: u64,
    /// The same at the chip's clock \[ns\], rounded up.
    pub time_ns: u64,
}
