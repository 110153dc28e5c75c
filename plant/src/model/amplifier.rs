//! Power amplifier with limited output (paper, Fig. 4).

use crate::model::parameters::Amplifier;

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

    /// Whether the output stands at its limit for this input.
    pub fn is_limited(&self, input_v: f64) -> bool {
        (self.gain * input_v).abs() >= self.voltage_limit_v
    }
}
