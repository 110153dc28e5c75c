//! The take-up of the gap: how wide it is, and how much room the motion leaves.

use firmware::{BacklashCompensation, Room, Trigger};

use super::{Setup, setting};
use crate::controllers::axis_controller::homing::measure_gap;
use crate::controllers::last_tick;
use crate::options::{Compensation, GapSource};
use crate::quantise::QuantiseError;

impl Setup<'_> {
    /// The take-up of the gap, within what the motion leaves of the limits.
    pub(super) fn take_up(&self) -> Result<Option<BacklashCompensation>, QuantiseError> {
        let backlash = &self.case.options.backlash;
        let trigger = match backlash.compensation {
            Compensation::None => return Ok(None),
            Compensation::Velocity => Trigger::Velocity,
            Compensation::Acceleration => Trigger::Acceleration,
        };
        let half_gap_counts = match backlash.gap {
            // Saturates; a gap that large is refused by the plan.
            GapSource::Given => self.half_gap_counts(backlash.half_gap_rad).round() as u32,
            GapSource::Measured => measure_gap(self.case)?.half_counts,
        };
        let limits = &self.case.options.limits;
        let motion = &self.case.motion;
        let [t1, t2, t3, ..] = motion.intervals_s();
        // The speed is largest where the acceleration ends.
        let peak_mps = motion.at(t1 + t2 + t3).velocity_mps.abs();
        let peak_mps2 = motion.peak_acceleration_until_mps2(motion.end_s());
        let dt_s = self.period_ns as f64 / 1e9;
        let room = |key: &'static str, limit: Option<f64>, peak: f64, per_sample: f64| {
            let limit = limit.unwrap_or(0.0);
            let left = (limit - peak) * self.setpoint.counts_per_m() * per_sample;
            let room = (left * 4_294_967_296.0).floor();
            if room < 1.0 {
                let unit = if key.ends_with("mps2") {
                    "m/s²"
                } else {
                    "m/s"
                };
                let because = format!(
                    "the motion's own peak is {peak:.6} {unit}; the take-up needs room above it"
                );
                return Err(setting(key, limit, &because));
            }
            // Saturates: more room than any axis needs.
            Ok(room as u64)
        };
        let room = Room {
            velocity: room("limits.velocity_mps", limits.velocity_mps, peak_mps, dt_s)?,
            acceleration: room(
                "limits.acceleration_mps2",
                limits.acceleration_mps2,
                peak_mps2,
                dt_s * dt_s,
            )?,
        };
        let half_rad = f64::from(half_gap_counts) * self.case.axis.transmission.gear_ratio
            / self.case.encoder.counts_per_rad;
        let refused = |error: &dyn std::fmt::Display| {
            setting("backlash.half_gap_deg", half_rad.to_degrees(), error)
        };
        let take_up = BacklashCompensation::plan(half_gap_counts, room, trigger)
            .map_err(|error| refused(&error))?;
        let longest = last_tick(self.case, self.period_ns);
        if u64::from(take_up.samples()) > longest {
            let samples = take_up.samples();
            // The limit that is to blame is the one without which it would fit.
            let faster = Room {
                velocity: u64::MAX,
                ..room
            };
            let fits = |take_up: BacklashCompensation| u64::from(take_up.samples()) <= longest;
            let by_velocity =
                BacklashCompensation::plan(half_gap_counts, faster, trigger).is_ok_and(fits);
            let (key, limit) = if by_velocity {
                ("limits.velocity_mps", limits.velocity_mps)
            } else {
                ("limits.acceleration_mps2", limits.acceleration_mps2)
            };
            let because = format!(
                "it leaves the take-up so little room that it needs {samples} samples, longer than the \
                 motion with its {longest}"
            );
            return Err(setting(key, limit.unwrap_or(0.0), &because));
        }
        Ok(Some(take_up))
    }

    /// A half gap \[rad\], or the joint's own, at the motor \[counts\]: `K_enc·b/z`.
    pub(in crate::controllers::axis_controller) fn half_gap_counts(
        &self,
        half_rad: Option<f64>,
    ) -> f64 {
        let transmission = &self.case.axis.transmission;
        let half_rad = half_rad.unwrap_or(match &transmission.joint {
            plant::Joint::Elastic(joint) => joint.backlash_half_rad,
            plant::Joint::Rigid => 0.0,
        });
        self.case.encoder.counts_per_rad * half_rad / transmission.gear_ratio
    }
}
