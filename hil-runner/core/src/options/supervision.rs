//! What the supervision watches, what it is asked for, and what goes wrong at
//! given times of the run \[ns\].

/// What the supervision allows (`[limits]`); [`None`] is not watched.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Largest following error.
    pub following_error: Option<FollowingErrorLimit>,
    /// Largest change of the encoder count in one sample \[counts\], below
    /// half the counter's range.
    pub count_jump_counts: Option<u32>,
    /// When a count that stands still means that the encoder is lost.
    pub encoder_loss: Option<EncoderLoss>,
    /// Longest time with the output at its limit \[ns\], greater than 0.
    pub saturation_ns: Option<u64>,
    /// Whether a missed tick is a fault.
    pub missed_ticks: bool,
    /// Largest speed of the axis at the carriage \[m/s\]. The backlash
    /// compensation needs it.
    pub velocity_mps: Option<f64>,
    /// Largest acceleration of the axis at the carriage \[m/s²\]. The backlash
    /// compensation needs it.
    pub acceleration_mps2: Option<f64>,
}

/// Largest following error: `counts + per_speed_s·|reference speed|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowingErrorLimit {
    /// At standstill \[counts\], at least 1.
    pub counts: u32,
    /// On top, per speed \[counts/(counts/s)\], at least 0.
    pub per_speed_s: f64,
}

/// The encoder counts as lost if its count stands still this long under an
/// output of at least this size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderLoss {
    /// Time \[ns\], greater than 0.
    pub after_ns: u64,
    /// Magnitude of the output \[codes\], at least 1.
    pub codes: u32,
}

/// Requests at given times \[ns\] (`[sequence]`); [`None`] never comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Requests {
    /// Disable the axis.
    pub disable_ns: Option<u64>,
    /// Enable the axis.
    pub enable_ns: Option<u64>,
    /// The emergency stop goes on.
    pub emergency_stop_ns: Option<u64>,
    /// The emergency stop goes off, later than it went on.
    pub emergency_stop_release_ns: Option<u64>,
    /// Reset the faults.
    pub reset_ns: Option<u64>,
}

/// Gains that hold from some time on (`[gain_change]`); at least one of them
/// changes, [`None`] stays as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainChange {
    /// Time of the change \[ns\].
    pub at_ns: u64,
    /// Proportional gain \[codes/count\].
    pub kp: Option<f64>,
    /// Integral gain \[codes/(count s)\].
    pub ki_per_s: Option<f64>,
    /// Derivative gain \[codes s/count\].
    pub kd_s: Option<f64>,
}

/// Hardware that misbehaves at given times \[ns\] (`[inject]`); [`None`] never
/// does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Injections {
    /// One wrong count.
    pub encoder_glitch: Option<EncoderGlitch>,
    /// From here on the count stands still.
    pub encoder_freeze_ns: Option<u64>,
    /// The tick at this time does not come.
    pub missed_tick_ns: Option<u64>,
    /// The transfer at this time fails.
    pub bus_error_ns: Option<u64>,
    /// From here on the queue of setpoints is not filled.
    pub setpoint_underrun_ns: Option<u64>,
}

/// One wrong count of the encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderGlitch {
    /// Time \[ns\].
    pub at_ns: u64,
    /// What is added to the count \[counts\].
    pub counts: i32,
}
