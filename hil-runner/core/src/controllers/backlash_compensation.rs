//! The compensation of the backlash: how the reference crosses the gap, within the
//! room that the motion leaves.

use firmware::axis::Axis;
use firmware::law::Law;
use firmware::{BacklashCompensation, Room, Trigger};

use super::backlash_measurement::measure_gap;
use super::setup::Setup;
use crate::options::{Compensation, GapSource};
use crate::quantise::QuantiseError;

/// The axis of a run: where the case asks for a compensation by a measured gap, the
/// gap is measured here.
///
/// # Errors
/// [`QuantiseError`] if a setting has no fixed-point form, or the gap cannot be
/// measured or crossed.
pub fn compensated(setup: &Setup<'_>, law: Law) -> Result<Axis, QuantiseError> {
    let mut axis = setup.axis(law)?;
    axis.backlash_compensation = compensation(setup)?;
    Ok(axis)
}

/// The crossing of the gap, within what the motion leaves of the limits.
fn compensation(setup: &Setup<'_>) -> Result<Option<BacklashCompensation>, QuantiseError> {
    let (case, setpoint) = (setup.case, &setup.setpoint);
    let backlash = &case.options.backlash;
    let trigger = match backlash.compensation {
        Compensation::None => return Ok(None),
        Compensation::Velocity => Trigger::Velocity,
        Compensation::Acceleration => Trigger::Acceleration,
    };
    let half_gap_counts = match backlash.gap {
        // Saturates; a gap that large is refused by the plan.
        GapSource::Given => setup.half_gap_counts(backlash.half_gap_rad).round() as u32,
        GapSource::Measured => measure_gap(case)?.half_counts,
    };
    let limits = &case.options.limits;
    let motion = &case.motion;
    let [t1, t2, t3, ..] = motion.intervals_s();
    // The speed is largest where the acceleration ends.
    let peak_mps = motion.at(t1 + t2 + t3).velocity_mps.abs();
    let peak_mps2 = motion.peak_acceleration_until_mps2(motion.end_s());
    let dt_s = setup.period_ns as f64 / 1e9;
    let room = |key: &'static str, limit: Option<f64>, peak: f64, per_sample: f64| {
        let limit = limit.unwrap_or(0.0);
        let left = (limit - peak) * setpoint.counts_per_m() * per_sample;
        let room = (left * 4_294_967_296.0).floor();
        if room < 1.0 {
            let unit = if key.ends_with("mps2") {
                "m/s²"
            } else {
                "m/s"
            };
            let because = format!(
                "the motion's own peak is {peak:.6} {unit}; the backlash compensation needs room above it"
            );
            return Err(QuantiseError::setting(key, limit, &because));
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
    let half_rad = f64::from(half_gap_counts) * case.axis.transmission.gear_ratio
        / case.encoder.counts_per_rad;
    let refused = |error: &dyn std::fmt::Display| {
        QuantiseError::setting("backlash.half_gap_deg", half_rad.to_degrees(), error)
    };
    let crossing = BacklashCompensation::plan(half_gap_counts, room, trigger)
        .map_err(|error| refused(&error))?;
    let longest = setpoint.last_tick();
    if u64::from(crossing.samples()) > longest {
        let samples = crossing.samples();
        // The limit that is to blame is the one without which it would fit.
        let faster = Room {
            velocity: u64::MAX,
            ..room
        };
        let fits = |crossing: BacklashCompensation| u64::from(crossing.samples()) <= longest;
        let by_velocity =
            BacklashCompensation::plan(half_gap_counts, faster, trigger).is_ok_and(fits);
        let (key, limit) = if by_velocity {
            ("limits.velocity_mps", limits.velocity_mps)
        } else {
            ("limits.acceleration_mps2", limits.acceleration_mps2)
        };
        let because = format!(
            "it leaves the backlash compensation so little room that it needs {samples} samples, longer than the \
                 motion with its {longest}"
        );
        return Err(QuantiseError::setting(key, limit.unwrap_or(0.0), &because));
    }
    Ok(Some(crossing))
}
