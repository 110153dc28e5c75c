//! Words of what is no gain: the derivative's filter and the anti-windup.

use firmware::law::{AntiWindup, FilterWords};

use super::{Refusal, ScalingRequest};
use crate::options;
use crate::quantise::power_of_two;

impl ScalingRequest {
    /// `a = Δt/(T_f + Δt)`, and the fewest fraction bits with
    /// `(Kd/Δt)·2^−h ≤ 1/16`.
    pub(super) fn filter(&self, kd_per_dt: f64) -> Result<Option<FilterWords>, Refusal> {
        let filter_s = self.settings.derivative_filter_s;
        if filter_s == 0.0 {
            return Ok(None);
        }
        let dt_s = self.sample_time_ns as f64 / 1e9;
        let smoothing = word31(dt_s / (filter_s + dt_s)).ok_or(Refusal::Filter)?;
        let needed = (0..29).find(|&h| 16.0 * kd_per_dt <= power_of_two(h));
        Ok(Some(FilterWords {
            smoothing,
            fraction_bits: needed.unwrap_or(29),
        }))
    }

    pub(super) fn anti_windup(&self) -> Result<AntiWindup, Refusal> {
        Ok(match self.settings.anti_windup {
            options::AntiWindup::None => AntiWindup::None,
            options::AntiWindup::Clamp => AntiWindup::Clamp,
            options::AntiWindup::BackCalculation => {
                let dt_s = self.sample_time_ns as f64 / 1e9;
                let tracking = word31(dt_s / self.settings.tracking_time_s);
                AntiWindup::BackCalculation {
                    tracking: tracking.ok_or(Refusal::Tracking)?,
                }
            }
        })
    }
}

/// `fraction·2^31` as a word from 1 to 2^31 − 1; `None` beyond.
fn word31(fraction: f64) -> Option<i32> {
    let word = (fraction * power_of_two(31)).round();
    // Whole and within the type: the conversion is exact.
    (1.0..=f64::from(i32::MAX))
        .contains(&word)
        .then_some(word as i32)
}
