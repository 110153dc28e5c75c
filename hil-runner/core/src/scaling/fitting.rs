//! What would fit: the largest gains for which the firmware accepts the words,
//! all other settings as they are.

use firmware::law::Part;

use super::{Refusal, ScalingRequest, key};
use crate::quantise::{QuantiseError, UnfitGain, error_range, rounded_down};

/// The gains that can be set, in the order of the law.
pub const GAIN_KEYS: [&str; 6] = [
    key(Part::Proportional),
    key(Part::Integral),
    key(Part::Derivative),
    key(Part::Velocity),
    key(Part::Acceleration),
    key(Part::Friction),
];

impl ScalingRequest {
    /// The value of a gain by its place in [`GAIN_KEYS`].
    fn gain_mut(&mut self, index: usize) -> &mut f64 {
        let feed_forward = &mut self.settings.feed_forward;
        match index {
            0 => &mut self.gains.kp,
            1 => &mut self.gains.ki_per_s,
            2 => &mut self.gains.kd_s,
            3 => &mut feed_forward.velocity_s,
            4 => &mut feed_forward.acceleration_s2,
            _ => &mut feed_forward.friction_codes,
        }
    }

    /// The largest value of a gain that fits, rounded down to five digits, so
    /// that what a table prints fits too; 0 if none does.
    pub fn largest_gain(&self, index: usize) -> f64 {
        let fits = |value: f64| {
            let mut request = *self;
            *request.gain_mut(index) = value;
            request.settle().is_ok()
        };
        // Whole powers of two first, then halves of the interval.
        let mut low = 0.0;
        let mut high = f64::INFINITY;
        for exponent in -60..60 {
            let value = 2_f64.powi(exponent);
            if fits(value) {
                low = value;
            } else if low > 0.0 {
                high = value;
                break;
            }
        }
        if !high.is_finite() {
            return rounded_down(low, 5);
        }
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if fits(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        rounded_down(low, 5)
    }
}

/// The fewest bits of a word that fit, if more than the present ones do.
fn fewest_bits(request: &ScalingRequest) -> Option<u32> {
    (request.settings.word_bits + 1..=31).find(|&word_bits| {
        let mut request = *request;
        request.settings.word_bits = word_bits;
        request.settle().is_ok()
    })
}

/// The refusal in terms of the run file.
pub(super) fn explain(request: &ScalingRequest, refusal: Refusal) -> QuantiseError {
    match refusal {
        Refusal::Dac(error) => QuantiseError::Dac(error),
        Refusal::Travel => QuantiseError::Travel(request.travel_counts),
        Refusal::Filter => QuantiseError::Setting {
            key: "controller.derivative_filter_s",
            value: request.settings.derivative_filter_s,
            because: "Δt/(T_f + Δt) has no word of 31 bits; at most 10^9 sample times do"
                .to_owned(),
        },
        Refusal::Tracking => QuantiseError::Setting {
            key: "controller.tracking_time_s",
            value: request.settings.tracking_time_s,
            because: "it must be longer than the sample time and at most 10^9 of them".to_owned(),
        },
        Refusal::Law(error) => {
            let error_limit = error_range(request.travel_counts).map_or(0, |range| range.limit());
            let mut unfit = Vec::new();
            for (index, key) in GAIN_KEYS.into_iter().enumerate() {
                let value = *{ *request }.gain_mut(index);
                let largest = request.largest_gain(index);
                // A gain is to blame if a smaller one cures.
                if value > 0.0 && largest > 0.0 && largest < value {
                    unfit.push(UnfitGain {
                        key,
                        value,
                        largest,
                        error_limit,
                    });
                }
            }
            if let Some(bits) = fewest_bits(request) {
                QuantiseError::Setting {
                    key: "controller.word_bits",
                    value: f64::from(request.settings.word_bits),
                    because: format!(
                        "these gains need words of at least {bits} bits to stay within one code \
                         of the exact law ({error})"
                    ),
                }
            } else if unfit.is_empty() {
                QuantiseError::Law(error)
            } else {
                QuantiseError::Gains(unfit)
            }
        }
    }
}
