//! Keys of the controller: its encoders, its law, what it allows, what it is
//! asked for, and what goes wrong.

use core::f64::consts::{FRAC_PI_2, PI};

use plant::Encoder;

use super::super::keys::Access::Own;
use super::super::keys::Range::{NotNegative, Positive};
use super::super::keys::{Acts, Key, Need, choice, flag, number, of_firmware, time, whole};
use super::super::values::Value::{Nanoseconds, Number, Whole};
use super::super::values::{MEASURED, PLANT};
use super::gains::{NEW_PER_RAD, OF_CASCADE, PER_RAD};
use crate::case::{Case, Law};
use crate::number::table;
use crate::options::{
    AntiWindup, Compensation, Derivative, Feedback, FlankDetection, GainChange, GapSource,
    Quantiser, RestIntegrator, SetpointOrigin,
};

pub(super) const ENCODER: &[Key] = &[
    number("counts_per_rad", Positive, "counts/rad")
        .named("encoder resolution K_enc", "Encoder K_enc")
        .needing(Need::Always, "636.0")
        .at(|c| Some(&mut c.encoder.counts_per_rad))
        .note(&["K_enc"]),
    whole("lines", 1, 1_000_000_000, "")
        .meaning("number N of encoder lines per revolution")
        .needing(Need::Always, "1000")
        .access(Own(
            |c, lines| c.encoder = Encoder::with_lines(lines),
            // Four counts a line.
            |c| Some(c.encoder.counts_per_rad * FRAC_PI_2),
        ))
        .note(&["instead of counts_per_rad"]),
    whole("counter_bits", 8, 32, "bits")
        .meaning("width of the motor's counter, and of the load's where it closes the loop,")
        .or(Whole(32))
        .firmware_at(|c| Some(&mut c.options.encoders.counter_bits))
        .field("counter.bits")
        .shown("Encoder counter")
        .note(&["width of the counters, on law \"firmware\""]),
];

pub(super) const LOAD_ENCODER: &[Key] = &of_firmware([
    number("counts_per_rad", Positive, "counts/rad")
        .named("resolution of an encoder on the screw", "Load encoder")
        .optional("1600.0")
        .access(Own(
            |c, counts_per_rad| c.options.encoders.load = Some(Encoder { counts_per_rad }),
            |c| Some(c.options.encoders.load?.counts_per_rad),
        ))
        .note(&["on the screw"]),
    number("counts_per_mm", Positive, "counts/mm")
        .meaning("resolution of a scale at the carriage")
        .optional("1000.0")
        .access(Own(
            |c, counts_per_mm| {
                // counts/mm → counts/m, and m/rad of the screw
                let counts_per_rad = 1e3 * counts_per_mm * pitch_m(c);
                c.options.encoders.load = Some(Encoder { counts_per_rad });
            },
            |c| Some(1e-3 * c.options.encoders.load?.counts_per_rad / pitch_m(c)),
        ))
        .note(&["instead of counts_per_rad: a scale at the carriage"]),
]);

pub(super) const CONTROLLER: &[Key] = &[
    choice::<Law>("law")
        .meaning("control law")
        .needed(Need::Always)
        .at(|c| Some(&mut c.controller.law)),
    number("kp", NotNegative, "codes/count")
        .named("proportional gain K_p", "Gain Kp")
        .needing(Need::Always, "3.2")
        .alone_at(|c| Some(&mut c.controller.gains.kp))
        .field("law.words.kp"),
    number("ki_per_s", NotNegative, "codes/(count s)")
        .named("integral gain K_i", "Gain Ki")
        .needing(Need::Always, "5.0")
        .alone_at(|c| Some(&mut c.controller.gains.ki_per_s))
        .field("law.words.ki_dt"),
    number("kd_s", NotNegative, "codes s/count")
        .named("derivative gain K_d", "Gain Kd")
        .needing(Need::Always, "0.05")
        .alone_at(|c| Some(&mut c.controller.gains.kd_s))
        .field("law.words.kd_per_dt"),
    PER_RAD[0]
        .alone()
        .note(&["instead of kp, ki_per_s, kd_s: volts per radian of the motor"]),
    PER_RAD[1].alone().note(&["volts per radian and second"]),
    PER_RAD[2].alone().note(&["volts per (radian per second)"]),
    PER_RAD[3].note(&["of a current drive: amperes per radian of the motor"]),
    PER_RAD[4],
    PER_RAD[5],
    OF_CASCADE[0],
    OF_CASCADE[1].alone(),
    OF_CASCADE[2],
    OF_CASCADE[3],
    time("sample_time_s", Positive)
        .meaning("sample time Δt")
        .needed(Need::SampledLaw)
        .acting(Acts::From(Law::Sampled))
        .at(|c| Some(&mut c.controller.sample_time_ns))
        .shown_in("Sample time Δt", 1e3, "ms"),
    time("computation_delay_s", NotNegative)
        .word(MEASURED)
        .meaning("delay from sample to new voltage")
        .or(Nanoseconds(0))
        .acting(Acts::From(Law::Sampled))
        .at(|c| Some(&mut c.controller.computation_delay))
        .shown_in("Computation delay", 1e3, "ms")
        .words(&[(MEASURED, "measured on the chip")])
        .note(&[
            "from sample to new voltage, at most Δt; on a chip",
            "also \"measured\": what each step takes there",
        ]),
    choice::<Derivative>("derivative")
        .named("quantity of which the derivative is taken", "Derivative of")
        .firmware_at(|c| Some(&mut c.options.law.derivative))
        .field("law.words.derivative")
        .words(&[("measurement", "the measurement")])
        .note(&["or \"measurement\": no kick when the setpoint jumps"]),
    number("derivative_filter_s", NotNegative, "s")
        .meaning("time constant of the derivative's first-order filter (0: none)")
        .or(Number(0.0))
        .firmware_at(|c| Some(&mut c.options.law.derivative_filter_s))
        .field("law.words.filter")
        .shown_in("Derivative filter T_f", 1e3, "ms")
        .note(&["first-order filter; 0: none"]),
    choice::<AntiWindup>("anti_windup")
        .named("treatment of integrator wind-up", "Anti-windup")
        .firmware_at(|c| Some(&mut c.options.law.anti_windup))
        .field("law.words.anti_windup")
        .words(&[("clamp", "clamp")]),
    number("tracking_time_s", Positive, "s")
        .meaning("time constant of anti_windup \"back-calculation\"")
        .or(Number(0.01))
        .firmware_at(|c| Some(&mut c.options.law.tracking_time_s))
        .field("law.words.anti_windup.tracking")
        .shown_in("Back-calculation T_t", 1e3, "ms")
        .when(|c| c.options.law.anti_windup == AntiWindup::BackCalculation)
        .note(&["of \"back-calculation\""]),
    whole("word_bits", 8, 31, "bits")
        .meaning(
            "width of the mantissas of the fixed-point gains; without it 24, or as many more as \
             these gains need to stay within one code of the exact law,",
        )
        .optional("24")
        .firmware_at(|c| Some(&mut c.options.law.word_bits))
        .note(&["mantissas of the fixed-point gains; default: 24, more where needed"]),
    whole("gain_fraction_bits", 0, 32, "bits")
        .meaning(
            "fraction bits that the gains per sample are rounded to before they become fixed-point \
             gains; without it as many as those hold,",
        )
        .optional("24")
        .firmware_at(|c| Some(&mut c.options.law.gain_fraction_bits))
        .note(&["of the gains per sample; default: all that fit"]),
    choice::<Quantiser>("quantiser")
        .named("way from the law's output to a whole code", "Quantiser")
        .firmware_at(|c| Some(&mut c.options.law.quantiser))
        .field("output.quantiser")
        .text(|c| match c.options.law.quantiser {
            Quantiser::Nearest => None,
            Quantiser::ErrorFeedback => Some("error feedback".to_owned()),
            Quantiser::Dither => Some(format!("dither, seed {}", c.options.law.dither_seed)),
        }),
    whole("dither_seed", 0, 4_294_967_295, "")
        .meaning("seed of quantiser \"dither\"")
        .or(Whole(1))
        .firmware_at(|c| Some(&mut c.options.law.dither_seed))
        .field("output.quantiser.seed"),
    number("slew_limit_codes_per_s", Positive, "codes/s")
        .meaning("limit on the rate of the output, rounded down to whole codes per sample,")
        .optional("1e6")
        .firmware_at(|c| Some(&mut c.options.law.slew_limit_codes_per_s))
        .field("output.slew")
        .shown("Slew limit")
        .note(&["default: no limit"]),
    ahead("velocity_ff_s", "codes s/count")
        .meaning("feed-forward per reference velocity")
        .firmware_at(|c| Some(&mut c.options.law.feed_forward.velocity_s))
        .field("law.words.velocity_ff")
        .shown("Velocity feed-forward")
        .text(|c| shown_ahead(c, 0))
        .note(&["feed-forward, codes per (count per second); or \"plant\": what the model needs"]),
    ahead("acceleration_ff_s2", "codes s²/count")
        .meaning("feed-forward per reference acceleration")
        .firmware_at(|c| Some(&mut c.options.law.feed_forward.acceleration_s2))
        .field("law.words.acceleration_ff")
        .shown("Acceleration feed-forward")
        .text(|c| shown_ahead(c, 1))
        .note(&["codes per (count per second squared), or \"plant\""]),
    ahead("friction_ff_codes", "codes")
        .meaning("feed-forward with the sign of the reference velocity")
        .firmware_at(|c| Some(&mut c.options.law.feed_forward.friction_codes))
        .field("law.words.friction_ff")
        .shown("Friction feed-forward")
        .text(|c| shown_ahead(c, 2))
        .note(&["codes with the sign of the velocity, or \"plant\""]),
    choice::<SetpointOrigin>("setpoints")
        .named("source of the setpoints", "Setpoints")
        .firmware_at(|c| Some(&mut c.options.law.setpoints))
        .words(&[
            ("generator", "generated on the chip"),
            ("queue", "streamed"),
        ]),
    choice::<Feedback>("feedback")
        .named("choice of encoders that close the loop", "Position from")
        .firmware_at(|c| Some(&mut c.options.law.feedback))
        .field("feedback")
        .words(&[("dual", "the load")])
        .note(&["or \"dual\": position from [load_encoder]"]),
    whole("rest_dead_band_counts", 0, 1_000_000, "counts")
        .meaning("largest error that counts as none at rest")
        .or(Whole(0))
        .firmware_at(|c| Some(&mut c.options.law.rest_dead_band_counts))
        .field("rest.dead_band")
        .shown("Dead band at rest"),
    choice::<RestIntegrator>("rest_integrator")
        .meaning("integrator's part while the axis stands")
        .firmware_at(|c| Some(&mut c.options.law.rest_integrator))
        .field("rest.hold_integral")
        .shown("Integrator at rest")
        .words(&[("hold", "held")])
        .note(&["or \"hold\": while the axis stands"]),
];

/// A feed-forward gain: a number, or what the model of the plant needs.
const fn ahead(name: &'static str, unit: &'static str) -> Key {
    let number = number(name, NotNegative, unit).word(PLANT);
    number.or(Number(0.0))
}

/// A feed-forward gain as a report shows it.
fn shown_ahead(case: &Case, part: usize) -> Option<String> {
    let (number, formula) = *case.with_formulas().get(part)?;
    let origin = formula.map_or("", |_| "from the plant: ");
    Some(format!("{origin}{}", table(number)))
}

/// Largest following error or glitch \[counts\]: beyond any axis, and below half
/// the range of a counter of 32 bits, so that neither wraps around.
const LARGEST_ERROR_COUNTS: i64 = 1_000_000_000;

/// The largest code that the widest converter has: 2^23 − 1.
const MOST_CODES: i64 = 8_388_607;

pub(super) const LIMITS: &[Key] = &of_firmware([
    whole("following_error_counts", 1, LARGEST_ERROR_COUNTS, "counts")
        .meaning("largest following error at standstill")
        .optional_at("2000", |c| Some(&mut c.options.limits.following_error))
        .field("monitors.following_error.limit_counts")
        .shown("Limit of the following error"),
    number(
        "following_error_per_speed_s",
        NotNegative,
        "counts/(counts/s)",
    )
    .meaning("following error allowed on top per reference speed, 0 if left out,")
    .needing(Need::OnlyWith("following_error_counts"), "0.01")
    .at(|c| Some(&mut c.options.limits.following_error.as_mut()?.per_speed_s))
    .field("monitors.following_error.per_speed.mantissa")
    .shown_in("… and per speed", 1e3, "ms")
    .when(|c| matches!(c.options.limits.following_error, Some(limit) if limit.per_speed_s != 0.0))
    .note(&["on top, counts per (count per second)"]),
    whole("count_jump_counts", 1, i32::MAX as i64, "counts")
        .meaning("largest change of the motor's count in one sample")
        .optional_at("1000", |c| Some(&mut c.options.limits.count_jump_counts))
        .field("counter.largest_jump")
        .shown("Largest count jump")
        .note(&["between two samples"]),
    time("encoder_loss_s", Positive)
        .meaning("time for which the count may stand still under output")
        .optional_at("0.05", |c| Some(&mut c.options.limits.encoder_loss))
        .field("monitors.encoder_loss.ticks")
        .shown_in("Encoder lost after", 1e3, "ms")
        .note(&["count stands still for so long …"]),
    whole("encoder_loss_codes", 1, MOST_CODES, "codes")
        .named("output from which encoder_loss_s counts", "… under")
        .or(Whole(100))
        .at(|c| Some(&mut c.options.limits.encoder_loss.as_mut()?.codes))
        .field("monitors.encoder_loss.code_threshold")
        .when(|c| c.options.limits.encoder_loss.is_some())
        .note(&["… under at least this output"]),
    time("saturation_s", Positive)
        .meaning("time for which the output may stand at its limit")
        .optional_at("0.1", |c| Some(&mut c.options.limits.saturation_ns))
        .field("monitors.saturation.ticks")
        .shown_in("Longest saturation", 1e3, "ms"),
    flag("missed_ticks")
        .named("switch that makes a missed tick a fault", "Missed tick")
        .at(|c| Some(&mut c.options.limits.missed_ticks))
        .field("monitors.ticks")
        .words(&[("true", "a fault")])
        .note(&["true: a missed tick is a fault"]),
    number("velocity_mps", Positive, "m/s")
        .meaning("largest speed of the axis, for the backlash compensation,")
        .optional_at("1.0", |c| Some(&mut c.options.limits.velocity_mps))
        .shown("Axis velocity limit")
        .note(&[
            "the axis's limits, which [backlash] needs and keeps to;",
            "[motion] max_velocity_mps makes a command",
        ]),
    number("acceleration_mps2", Positive, "m/s²")
        .meaning("largest acceleration of the axis, for the backlash compensation,")
        .optional_at("5.0", |c| Some(&mut c.options.limits.acceleration_mps2))
        .shown("Axis acceleration limit"),
]);

/// `p` \[m/rad\].
pub(super) fn pitch_m(case: &Case) -> f64 {
    case.axis.transmission.screw_pitch_m_per_rad
}

pub(super) fn radians(angle_deg: f64) -> f64 {
    angle_deg * PI / 180.0
}

fn compensates(case: &Case, gap: GapSource) -> bool {
    let backlash = &case.options.backlash;
    backlash.compensation != Compensation::None && backlash.gap == gap
}

pub(super) const BACKLASH: &[Key] = &of_firmware([
    choice::<Compensation>("compensation")
        .meaning("reference quantity whose sign decides on the flank")
        .at(|c| Some(&mut c.options.backlash.compensation))
        .field("backlash_compensation.trigger")
        .shown("Backlash compensation")
        .words(&[
            ("velocity", "by the velocity's sign"),
            ("acceleration", "by the acceleration's sign"),
        ])
        .note(&["or by the sign of \"velocity\", \"acceleration\""]),
    number("half_gap_deg", NotNegative, "deg")
        .meaning("half gap to be compensated, the joint's own if left out,")
        .optional("3.0")
        .access(Own(
            |c, half_deg| c.options.backlash.half_gap_rad = Some(radians(half_deg)),
            |c| c.options.backlash.half_gap_rad.map(f64::to_degrees),
        ))
        .field("backlash_compensation.half_gap_counts")
        .shown_in("Half gap compensated", 1.0, "°")
        .when(|c| compensates(c, GapSource::Given))
        .note(&["default: the joint's backlash_half_deg"]),
    choice::<GapSource>("gap")
        .meaning("source of the gap's width")
        .at(|c| Some(&mut c.options.backlash.gap))
        .note(&["or \"measured\", before the motion"]),
    choice::<FlankDetection>("backlash_measurement_detection")
        .meaning("evidence of a flank in the backlash measurement")
        .at(|c| Some(&mut c.options.backlash.backlash_measurement_detection))
        .shown("Half gap compensated")
        .words(&[
            ("load-encoder", "measured by the load encoder"),
            ("effort", "measured by the effort"),
        ])
        .when(|c| compensates(c, GapSource::Measured)),
    number(
        "backlash_measurement_speed_counts_per_s",
        Positive,
        "counts/s",
    )
    .meaning("motor speed of the backlash measurement")
    .or(Number(200.0))
    .at(|c| Some(&mut c.options.backlash.backlash_measurement_speed_counts_per_s)),
    whole("backlash_measurement_effort_codes", 1, MOST_CODES, "codes")
        .meaning("output that backlash_measurement_detection \"effort\" takes for a flank")
        .or(Whole(50))
        .at(|c| Some(&mut c.options.backlash.backlash_measurement_effort_codes)),
]);

pub(super) const SEQUENCE: &[Key] = &of_firmware([
    time("disable_s", NotNegative)
        .named("time at which the axis is disabled", "Disabled at")
        .optional_at("1.3", |c| Some(&mut c.options.requests.disable_ns)),
    time("enable_s", NotNegative)
        .named("time at which the axis is enabled", "Enabled at")
        .optional_at("1.4", |c| Some(&mut c.options.requests.enable_ns)),
    time("emergency_stop_s", NotNegative)
        .meaning("time at which the emergency stop goes on")
        .optional_at("0.4", |c| Some(&mut c.options.requests.emergency_stop_ns))
        .shown("Emergency stop at"),
    time("emergency_stop_release_s", Positive)
        .named("time at which the emergency stop goes off", "… released at")
        .needing(Need::OnlyWith("emergency_stop_s"), "0.6")
        .at(|c| Some(&mut c.options.requests.emergency_stop_release_ns)),
    time("reset_s", NotNegative)
        .named("time at which the faults are reset", "Faults reset at")
        .optional_at("0.7", |c| Some(&mut c.options.requests.reset_ns)),
]);

fn gain_change(case: &mut Case) -> Option<&mut GainChange> {
    case.options.gain_change.as_mut()
}

pub(super) const GAIN_CHANGE: &[Key] = &of_firmware([
    time("at_s", NotNegative)
        .named("time of the change", "Gains changed at")
        .optional_at("0.5", |c| Some(&mut c.options.gain_change)),
    number("kp", NotNegative, "codes/count")
        .meaning("new proportional gain K_p")
        .needing(Need::OnlyWith("at_s"), "4.0")
        .at(|c| Some(&mut gain_change(c)?.kp)),
    number("ki_per_s", NotNegative, "codes/(count s)")
        .meaning("new integral gain K_i")
        .needing(Need::OnlyWith("at_s"), "8.0")
        .at(|c| Some(&mut gain_change(c)?.ki_per_s)),
    number("kd_s", NotNegative, "codes s/count")
        .meaning("new derivative gain K_d")
        .needing(Need::OnlyWith("at_s"), "0.06")
        .at(|c| Some(&mut gain_change(c)?.kd_s)),
    NEW_PER_RAD[0].note(&["instead of kp, ki_per_s, kd_s: volts per radian of the motor"]),
    NEW_PER_RAD[1],
    NEW_PER_RAD[2],
    NEW_PER_RAD[3].note(&["of a current drive: amperes"]),
    NEW_PER_RAD[4],
    NEW_PER_RAD[5],
]);

pub(super) const INJECT: &[Key] = &of_firmware([
    time("encoder_glitch_s", NotNegative)
        .named("time of one wrong encoder count", "Injected: glitch at")
        .needing(Need::OnlyWith("encoder_glitch_counts"), "0.5")
        .at(|c| Some(&mut c.options.injections.encoder_glitch)),
    whole(
        "encoder_glitch_counts",
        -LARGEST_ERROR_COUNTS,
        LARGEST_ERROR_COUNTS,
        "counts",
    )
    .meaning("error of the one wrong encoder count")
    .needing(Need::OnlyWith("encoder_glitch_s"), "-4096")
    .at(|c| Some(&mut c.options.injections.encoder_glitch.as_mut()?.counts)),
    time("encoder_freeze_s", NotNegative)
        .meaning("time from which the encoder count stands still")
        .optional_at("0.5", |c| Some(&mut c.options.injections.encoder_freeze_ns))
        .shown("Injected: frozen encoder at"),
    time("missed_tick_s", NotNegative)
        .meaning("time at which a tick does not come")
        .optional_at("0.5", |c| Some(&mut c.options.injections.missed_tick_ns))
        .shown("Injected: missed tick at"),
    time("bus_error_s", NotNegative)
        .meaning("time at which a transfer on the bus fails")
        .optional_at("0.5", |c| Some(&mut c.options.injections.bus_error_ns))
        .shown("Injected: bus error at"),
    time("setpoint_underrun_s", NotNegative)
        .meaning("time from which the queue of setpoints is not filled")
        .optional("0.5")
        .at(|c| Some(&mut c.options.injections.setpoint_underrun_ns))
        .shown("Injected: dry queue at")
        .note(&["with setpoints = \"queue\""]),
]);
