//! What an axis does beyond the paper's law, as a report shows it: only what
//! differs from "off".

use super::Parameter;
use super::parameters::{text, value};
use crate::case::{Case, Law};
use crate::options::{
    AntiWindup, Compensation, Derivative, Feedback, FlankDetection, GapSource, LawSettings,
    Quantiser, RestIntegrator, SetpointOrigin,
};
use crate::time::seconds;

/// Nothing on the other rungs, nor where everything is off.
pub(crate) fn of(case: &Case) -> Vec<Parameter> {
    if case.controller.law != Law::Firmware {
        return Vec::new();
    }
    [
        law(&case.options.law),
        rest_and_reference(case),
        limits(case),
        script(case),
    ]
    .concat()
}

fn law(law: &LawSettings) -> Vec<Parameter> {
    let mut rows = Vec::new();
    if law.derivative == Derivative::Measurement {
        rows.push(text("Derivative of", "the measurement", ""));
    }
    if law.derivative_filter_s != 0.0 {
        let time_ms = 1e3 * law.derivative_filter_s;
        rows.push(value("Derivative filter T_f", time_ms, "ms"));
    }
    match law.anti_windup {
        AntiWindup::None => {}
        AntiWindup::Clamp => rows.push(text("Anti-windup", "clamp", "")),
        AntiWindup::BackCalculation => {
            let time_ms = 1e3 * law.tracking_time_s;
            rows.push(value("Back-calculation T_t", time_ms, "ms"));
        }
    }
    match law.quantiser {
        Quantiser::Nearest => {}
        Quantiser::ErrorFeedback => rows.push(text("Quantiser", "error feedback", "")),
        Quantiser::Dither => {
            let seed = format!("dither, seed {}", law.dither_seed);
            rows.push(text("Quantiser", &seed, ""));
        }
    }
    if let Some(slew) = law.slew_limit_codes_per_s {
        rows.push(value("Slew limit", slew, "codes/s"));
    }
    let forward = &law.feed_forward;
    for (label, gain, unit) in [
        ("Velocity feed-forward", forward.velocity_s, "codes·s/count"),
        (
            "Acceleration feed-forward",
            forward.acceleration_s2,
            "codes·s²/count",
        ),
        ("Friction feed-forward", forward.friction_codes, "codes"),
    ] {
        if gain != 0.0 {
            rows.push(value(label, gain, unit));
        }
    }
    rows
}

fn rest_and_reference(case: &Case) -> Vec<Parameter> {
    let (law, encoders, backlash) = (
        &case.options.law,
        &case.options.encoders,
        &case.options.backlash,
    );
    let mut rows = Vec::new();
    if law.rest_dead_band_counts != 0 {
        let counts = f64::from(law.rest_dead_band_counts);
        rows.push(value("Dead band at rest", counts, "counts"));
    }
    if law.rest_integrator == RestIntegrator::Hold {
        rows.push(text("Integrator at rest", "held", ""));
    }
    match law.setpoints {
        SetpointOrigin::Table => {}
        SetpointOrigin::Generator => rows.push(text("Setpoints", "generated on the chip", "")),
        SetpointOrigin::Queue => rows.push(text("Setpoints", "streamed", "")),
    }
    if encoders.counter_bits != u32::BITS {
        let bits = f64::from(encoders.counter_bits);
        rows.push(value("Encoder counter", bits, "bits"));
    }
    if let Some(load) = encoders.load {
        rows.push(value("Load encoder", load.counts_per_rad, "counts/rad"));
    }
    if law.feedback == Feedback::Dual {
        rows.push(text("Position from", "the load", ""));
    }
    let trigger = match backlash.compensation {
        Compensation::None => return rows,
        Compensation::Velocity => "by the velocity's sign",
        Compensation::Acceleration => "by the acceleration's sign",
    };
    rows.push(text("Backlash taken up", trigger, ""));
    match (backlash.gap, backlash.half_gap_rad) {
        (GapSource::Measured, _) => {
            let how = match backlash.backlash_measurement_detection {
                FlankDetection::LoadEncoder => "measured by the load encoder",
                FlankDetection::Effort => "measured by the effort",
            };
            rows.push(text("Half gap taken up", how, ""));
        }
        (GapSource::Given, Some(half_rad)) => {
            rows.push(value("Half gap taken up", half_rad.to_degrees(), "°"));
        }
        (GapSource::Given, None) => {}
    }
    rows
}

fn limits(case: &Case) -> Vec<Parameter> {
    let limits = &case.options.limits;
    let mut rows = Vec::new();
    if let Some(limit) = limits.following_error {
        let counts = f64::from(limit.counts);
        rows.push(value("Limit of the following error", counts, "counts"));
        if limit.per_speed_s != 0.0 {
            rows.push(value("… and per speed", 1e3 * limit.per_speed_s, "ms"));
        }
    }
    if let Some(counts) = limits.count_jump_counts {
        rows.push(value("Largest count jump", f64::from(counts), "counts"));
    }
    if let Some(loss) = limits.encoder_loss {
        let time_ms = 1e3 * seconds(loss.after_ns);
        rows.push(value("Encoder lost after", time_ms, "ms"));
        rows.push(value("… under", f64::from(loss.codes), "codes"));
    }
    if let Some(after_ns) = limits.saturation_ns {
        let time_ms = 1e3 * seconds(after_ns);
        rows.push(value("Longest saturation", time_ms, "ms"));
    }
    if limits.missed_ticks {
        rows.push(text("Missed tick", "a fault", ""));
    }
    for (label, limit, unit) in [
        ("Axis velocity limit", limits.velocity_mps, "m/s"),
        ("Axis acceleration limit", limits.acceleration_mps2, "m/s²"),
    ] {
        rows.extend(limit.map(|limit| value(label, limit, unit)));
    }
    rows
}

/// Requests and injected faults with their times.
fn script(case: &Case) -> Vec<Parameter> {
    let (requests, injections) = (&case.options.requests, &case.options.injections);
    let times = [
        ("Disabled at", requests.disable_ns),
        ("Enabled at", requests.enable_ns),
        ("Emergency stop at", requests.emergency_stop_ns),
        ("… released at", requests.emergency_stop_release_ns),
        ("Faults reset at", requests.reset_ns),
        (
            "Gains changed at",
            case.options.gain_change.map(|change| change.at_ns),
        ),
        (
            "Injected: glitch at",
            injections.encoder_glitch.map(|glitch| glitch.at_ns),
        ),
        ("Injected: frozen encoder at", injections.encoder_freeze_ns),
        ("Injected: missed tick at", injections.missed_tick_ns),
        ("Injected: bus error at", injections.bus_error_ns),
        ("Injected: dry queue at", injections.setpoint_underrun_ns),
    ];
    let given = times
        .into_iter()
        .filter_map(|(label, at_ns)| at_ns.map(|at_ns| value(label, seconds(at_ns), "s")));
    given.collect()
}
