//! Puts together what the controller does beyond the paper's law.

use core::f64::consts::PI;

use plant::Encoder;

use super::super::values::Values;
use super::transmission;
use crate::options::{
    AntiWindup, AxisOptions, BacklashSettings, Compensation, Derivative, EncoderGlitch,
    EncoderLoss, EncoderSettings, FeedForward, Feedback, FlankDetection, FollowingErrorLimit,
    GainChange, GapSource, Injections, LawSettings, Limits, Quantiser, Requests, RestIntegrator,
    SetpointOrigin,
};

/// The settings; [`None`] if a value was refused. A key that is left out and
/// has no default gives a [`None`] of its own inside, as does one that was
/// refused: then the file as a whole is refused.
pub(super) fn options(v: &Values) -> Option<AxisOptions> {
    Some(AxisOptions {
        law: law(v)?,
        encoders: EncoderSettings {
            counter_bits: v.whole("encoder", "counter_bits")?,
            load: load_encoder(v),
        },
        limits: limits(v)?,
        backlash: backlash(v)?,
        requests: requests(v),
        gain_change: gain_change(v),
        injections: injections(v),
    })
}

fn law(v: &Values) -> Option<LawSettings> {
    let number = |key: &str| v.number("controller", key);
    let choice = |key: &str| v.choice("controller", key);
    Some(LawSettings {
        derivative: match choice("derivative")? {
            "error" => Derivative::Error,
            "measurement" => Derivative::Measurement,
            _ => return None,
        },
        derivative_filter_s: number("derivative_filter_s")?,
        anti_windup: match choice("anti_windup")? {
            "none" => AntiWindup::None,
            "clamp" => AntiWindup::Clamp,
            "back-calculation" => AntiWindup::BackCalculation,
            _ => return None,
        },
        tracking_time_s: number("tracking_time_s")?,
        word_bits: v.whole("controller", "word_bits")?,
        gain_fraction_bits: v.whole("controller", "gain_fraction_bits"),
        quantiser: match choice("quantiser")? {
            "nearest" => Quantiser::Nearest,
            "error-feedback" => Quantiser::ErrorFeedback,
            "dither" => Quantiser::Dither,
            _ => return None,
        },
        dither_seed: v.whole("controller", "dither_seed")?,
        slew_limit_codes_per_s: number("slew_limit_codes_per_s"),
        feed_forward: FeedForward {
            velocity_s: number("velocity_ff_s")?,
            acceleration_s2: number("acceleration_ff_s2")?,
            friction_codes: number("friction_ff_codes")?,
        },
        setpoints: setpoints(v)?,
        feedback: feedback(v)?,
        rest_dead_band_counts: v.whole("controller", "rest_dead_band_counts")?,
        rest_integrator: match choice("rest_integrator")? {
            "run" => RestIntegrator::Run,
            "hold" => RestIntegrator::Hold,
            _ => return None,
        },
    })
}

/// Where the setpoints come from.
pub(in crate::runfile) fn setpoints(v: &Values) -> Option<SetpointOrigin> {
    match v.choice("controller", "setpoints")? {
        "table" => Some(SetpointOrigin::Table),
        "generator" => Some(SetpointOrigin::Generator),
        "queue" => Some(SetpointOrigin::Queue),
        _ => None,
    }
}

/// Which encoders close the loop.
pub(in crate::runfile) fn feedback(v: &Values) -> Option<Feedback> {
    match v.choice("controller", "feedback")? {
        "motor" => Some(Feedback::Motor),
        "dual" => Some(Feedback::Dual),
        _ => None,
    }
}

/// The encoder on the load side, per radian of the screw.
pub(in crate::runfile) fn load_encoder(v: &Values) -> Option<Encoder> {
    let counts_per_rad = match v.number("load_encoder", "counts_per_rad") {
        Some(counts_per_rad) => counts_per_rad,
        // counts/mm → counts/m, and m/rad of the screw
        None => {
            let counts_per_m = 1e3 * v.number("load_encoder", "counts_per_mm")?;
            counts_per_m * transmission(v)?.screw_pitch_m_per_rad
        }
    };
    Some(Encoder { counts_per_rad })
}

fn limits(v: &Values) -> Option<Limits> {
    let following_error = |counts| FollowingErrorLimit {
        counts,
        per_speed_s: v
            .number("limits", "following_error_per_speed_s")
            .unwrap_or(0.0),
    };
    let codes = v.whole("limits", "encoder_loss_codes")?;
    let encoder_loss = |after_ns| EncoderLoss { after_ns, codes };
    Some(Limits {
        following_error: v
            .whole("limits", "following_error_counts")
            .map(following_error),
        count_jump_counts: v.whole("limits", "count_jump_counts"),
        encoder_loss: v.nanoseconds("limits", "encoder_loss_s").map(encoder_loss),
        saturation_ns: v.nanoseconds("limits", "saturation_s"),
        missed_ticks: v.flag("limits", "missed_ticks")?,
        velocity_mps: v.number("limits", "velocity_mps"),
        acceleration_mps2: v.number("limits", "acceleration_mps2"),
    })
}

fn backlash(v: &Values) -> Option<BacklashSettings> {
    Some(BacklashSettings {
        compensation: compensation(v)?,
        // deg → rad
        half_gap_rad: v
            .number("backlash", "half_gap_deg")
            .map(|half_deg| half_deg * PI / 180.0),
        gap: match v.choice("backlash", "gap")? {
            "given" => GapSource::Given,
            "measured" => GapSource::Measured,
            _ => return None,
        },
        backlash_measurement_detection: match v
            .choice("backlash", "backlash_measurement_detection")?
        {
            "load-encoder" => FlankDetection::LoadEncoder,
            "effort" => FlankDetection::Effort,
            _ => return None,
        },
        backlash_measurement_speed_counts_per_s: v
            .number("backlash", "backlash_measurement_speed_counts_per_s")?,
        backlash_measurement_effort_codes: v
            .whole("backlash", "backlash_measurement_effort_codes")?,
    })
}

/// What makes the reference cross the gap.
pub(in crate::runfile) fn compensation(v: &Values) -> Option<Compensation> {
    match v.choice("backlash", "compensation")? {
        "none" => Some(Compensation::None),
        "velocity" => Some(Compensation::Velocity),
        "acceleration" => Some(Compensation::Acceleration),
        _ => None,
    }
}

fn requests(v: &Values) -> Requests {
    let at = |key: &str| v.nanoseconds("sequence", key);
    Requests {
        disable_ns: at("disable_s"),
        enable_ns: at("enable_s"),
        emergency_stop_ns: at("emergency_stop_s"),
        emergency_stop_release_ns: at("emergency_stop_release_s"),
        reset_ns: at("reset_s"),
    }
}

fn gain_change(v: &Values) -> Option<GainChange> {
    Some(GainChange {
        at_ns: v.nanoseconds("gain_change", "at_s")?,
        kp: v.number("gain_change", "kp"),
        ki_per_s: v.number("gain_change", "ki_per_s"),
        kd_s: v.number("gain_change", "kd_s"),
    })
}

fn injections(v: &Values) -> Injections {
    let at = |key: &str| v.nanoseconds("inject", key);
    let counts: Option<i32> = v.whole("inject", "encoder_glitch_counts");
    let glitch = |(at_ns, counts)| EncoderGlitch { at_ns, counts };
    Injections {
        encoder_glitch: at("encoder_glitch_s").zip(counts).map(glitch),
        encoder_freeze_ns: at("encoder_freeze_s"),
        missed_tick_ns: at("missed_tick_s"),
        bus_error_ns: at("bus_error_s"),
        setpoint_underrun_ns: at("setpoint_underrun_s"),
    }
}
