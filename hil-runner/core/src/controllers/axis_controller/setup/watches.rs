//! What the supervision watches, in samples and counts.

use firmware::axis::Monitors;
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};

use super::{Setup, setting};
use crate::quantise::{QuantiseError, finest_word};

impl Setup<'_> {
    pub(super) fn watches(&self) -> Result<Monitors, QuantiseError> {
        let limits = &self.case.options.limits;
        let rates = self.rates();
        let ticks =
            |time_ns: u64| u32::try_from(time_ns.div_ceil(self.period_ns)).unwrap_or(u32::MAX);
        let following_error = limits.following_error.map(|limit| {
            // Samples of lag: counts per (count per sample).
            let lag = limit.per_speed_s * 1e9 / self.period_ns as f64;
            let most = FollowingErrorMonitor::MAX_FRACTION_BITS
                .saturating_sub(rates.velocity)
                .min(32);
            if lag >= f64::from(1 << 30) {
                let because = "it must be below 2^30 sample times";
                return Err(setting(
                    "limits.following_error_per_speed_s",
                    limit.per_speed_s,
                    &because,
                ));
            }
            let word = finest_word(lag, most, 31);
            FollowingErrorMonitor::accept(limit.counts, word, rates.velocity).map_err(|error| {
                setting(
                    "limits.following_error_counts",
                    f64::from(limit.counts),
                    &error,
                )
            })
        });
        let encoder_loss = limits.encoder_loss.map(|loss| {
            EncoderLossMonitor::accept(loss.codes, ticks(loss.after_ns)).map_err(|error| {
                setting("limits.encoder_loss_codes", f64::from(loss.codes), &error)
            })
        });
        let saturation = limits.saturation_ns.map(|after_ns| {
            SaturationMonitor::accept(ticks(after_ns))
                .map_err(|error| setting("limits.saturation_s", after_ns as f64 / 1e9, &error))
        });
        Ok(Monitors {
            following_error: following_error.transpose()?,
            encoder_loss: encoder_loss.transpose()?,
            saturation: saturation.transpose()?,
            ticks: limits.missed_ticks.then_some(TickMonitor),
        })
    }
}
