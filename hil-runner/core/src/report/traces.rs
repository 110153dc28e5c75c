//! The curves of one run, as columns.

use serde::Serialize;

use crate::number::{rounded, rounded_option};

/// Curves over time; every column has one entry per entry of `t_s`.
///
/// The same time may stand twice: the left and the right limit at a jump, so
/// that jumps and contact spikes are drawn at their true height. A column
/// that is continuous there repeats its value. Numbers that are not finite
/// leave a hole in the curve. Every entry goes into the file, about 80 bytes
/// of it: long runs are for the caller to thin out.
///
/// Serialises rounded to [`PLOT_DIGITS`](crate::number::PLOT_DIGITS)
/// significant digits: this is plot data.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Traces {
    /// Time \[s\], never descending.
    #[serde(serialize_with = "rounded")]
    pub t_s: Vec<f64>,
    /// Commanded carriage acceleration \[m/s²\].
    #[serde(serialize_with = "rounded")]
    pub acc_ref_mps2: Vec<f64>,
    /// Carriage acceleration ẍ \[m/s²\].
    #[serde(serialize_with = "rounded")]
    pub acc_mps2: Vec<f64>,
    /// x_ref − x at the carriage \[mm\].
    #[serde(serialize_with = "rounded")]
    pub following_error_mm: Vec<f64>,
    /// Motor voltage \[V\].
    #[serde(serialize_with = "rounded")]
    pub motor_voltage_v: Vec<f64>,
    /// Whether the voltage holds its value until the next entry (sampled
    /// laws) and is drawn as steps, or is a continuous curve.
    pub voltage_held: bool,
    /// Armature current \[A\].
    #[serde(serialize_with = "rounded")]
    pub current_a: Vec<f64>,
    /// DAC code, held until the next entry; `None` on rung `continuous`.
    #[serde(serialize_with = "rounded_option")]
    pub dac_code: Option<Vec<f64>>,
    /// Joint gap ε = β − γ \[°\]; `None` where the joint is rigid.
    #[serde(serialize_with = "rounded_option")]
    pub gap_deg: Option<Vec<f64>>,
    /// Amplifier limit V_max \[V\]; drawn at plus and minus this value.
    pub voltage_limit_v: f64,
    /// Lowest and highest DAC code; `None` where the code has no range.
    pub code_limits: Option<(f64, f64)>,
    /// Half backlash b \[°\].
    pub backlash_half_deg: f64,
    /// When the joint carries torque, in order.
    pub contact_intervals: Vec<ContactInterval>,
    /// Times of the impacts: the gap closes \[s\].
    #[serde(serialize_with = "rounded")]
    pub impacts_s: Vec<f64>,
}

/// A time during which the joint rests on one flank.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactInterval {
    /// Begin \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// +1 at ε = +b, −1 at ε = −b.
    pub contact: i8,
}
