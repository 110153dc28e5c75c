//! Power amplifier with limited output (paper, Fig. 4).

/// Power amplifier (paper, Fig. 4).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Amplifier {
    /// `K_a`, volts at the motor per volt at the input \[1\], greater than 0.
    pub gain: f64,
    /// `V_max`, limit of the output in both directions \[V\], greater than 0.
    pub voltage_limit_v: f64,
}

/// State of the amplifier's limit under the continuous law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AmplifierMode {
    /// The output follows the demand, or a held voltage.
    Linear,
    /// The output stands at `+V_max`.
    AtUpper,
    /// The output stands at `−V_max`.
    AtLower,
}

impl Amplifier {
    /// `V_m = clamp(K_a·V_out, ±V_max)` \[V\].
    ///
    /// ```
    /// let amplifier = plant::Amplifier { gain: 3.0, voltage_limit_v: 150.0 };
    /// assert_eq!(amplifier.output_v(10.0), 30.0);
    /// assert_eq!(amplifier.output_v(-60.0), -150.0);
    /// ```
    pub fn output_v(&self, input_v: f64) -> f64 {
        (self.gain * input_v).clamp(-self.voltage_limit_v, self.voltage_limit_v)
    }

    /// True if the output stands at its limit for this input.
    pub fn is_limited(&self, input_v: f64) -> bool {
        (self.gain * input_v).abs() >= self.voltage_limit_v
    }
}
