//! An axis as Rust source: a constant to paste into an image, with the limits and
//! ranges that it was accepted for.

use firmware::axis::{Axis, Feedback};
use firmware::monitor::{EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor};
use firmware::position::CounterParameters;
use firmware::word::GainWord;
use hil_core::quantise::FixedPointGain;
use hil_core::scaling::ScalingRequest;

/// The constant `AXIS` of the case `name`, whose gains were made from `request`.
pub(super) fn source(name: &str, request: &ScalingRequest, axis: &Axis) -> String {
    let (law, output) = (axis.law(), axis.output());
    let words = law.words();
    let (derivative, anti_windup) = (words.derivative, words.anti_windup);
    let filter = words.filter.map(|filter| format!("Some(law::{filter:?})"));
    let words = [
        ("kp", literal(words.kp)),
        ("ki_dt", literal(words.ki_dt)),
        ("kd_per_dt", literal(words.kd_per_dt)),
        ("velocity_ff", literal(words.velocity_ff)),
        ("acceleration_ff", literal(words.acceleration_ff)),
        ("friction_ff", literal(words.friction_ff)),
        ("error_bits", words.error_bits.to_string()),
        ("integral_bits", words.integral_bits.to_string()),
        ("derivative", format!("law::Derivative::{derivative:?}")),
        ("filter", filter.unwrap_or_else(|| "None".to_owned())),
        ("anti_windup", format!("law::AntiWindup::{anti_windup:?}")),
    ];
    format!(
        "/// The axis of {name}, a sample every {sample_time_ns} ns, by `hil-runner scaling --rust`.\n\
         ///\n{ranges}\
         pub const AXIS: firmware::Axis = {{\n    \
             use firmware::*;\n\
         \n    \
             let words = law::LawWords {{\n{words}    \
             }};\n    \
             let Ok(dac) = Dac::with_bits({bits}) else {{ panic!() }};\n    \
             let Ok(law) = law::Law::accept(words, dac) else {{ panic!() }};\n    \
             let Ok(output) = output::Output::new(dac, {slew:?}, output::Quantiser::{quantiser:?}) else {{ panic!() }};\n    \
             {rest}\n\
         }};\n",
        sample_time_ns = request.sample_time_ns,
        ranges = commented("/// ", &declared(request, axis)),
        words = words
            .map(|(key, word)| format!("        {key}: {word},\n"))
            .concat(),
        bits = law.dac().bits(),
        slew = output.slew_codes(),
        quantiser = output.quantiser(),
        rest = additions(axis),
    )
}

/// What was declared, a sentence a line.
pub(super) fn declared(request: &ScalingRequest, axis: &Axis) -> Vec<String> {
    let (law, dac) = (axis.law(), axis.law().dac());
    let sums = match law.error_sum_limit() {
        u64::MAX => String::new(),
        limit => format!(" and |Σe| ≤ {limit}"),
    };
    let (errors, differences) = (law.error_limit(), law.difference_limit());
    let (lowest, highest) = (dac.min_code(), dac.max_code());
    let mut lines = vec![
        format!("Within |e| ≤ {errors}{sums} counts a code is at most 1 from the exact law's."),
        format!(
            "Differences beyond {differences} counts are held there. Codes are {lowest} to {highest}."
        ),
    ];
    lines.extend(rates(request, axis));
    let scaled = request.scaled_law().map(|scaled| scaled.rows);
    let of_plant = |gain: &FixedPointGain| Some(format!("{}: {}.", gain.word, gain.of_plant()?));
    lines.extend(scaled.iter().flatten().filter_map(of_plant));
    lines
}

/// Lines behind the mark of a comment.
pub(super) fn commented(mark: &str, lines: &[String]) -> String {
    lines.iter().map(|line| format!("{mark}{line}\n")).collect()
}

/// The unit of the setpoints' rates, where something reads them.
fn rates(request: &ScalingRequest, axis: &Axis) -> Option<String> {
    let [.., velocity, acceleration, _] = request.gains;
    let monitor = axis.monitors.following_error;
    let lag = monitor.map(|monitor| monitor.limits().1);
    if velocity == 0.0 && acceleration == 0.0 && lag.is_none_or(|lag| lag.mantissa == 0) {
        return None;
    }
    let bits = request.rates;
    Some(format!(
        "Setpoints come with velocities in 2^-{} counts/sample and accelerations in 2^-{} counts/sample².",
        bits.velocity, bits.acceleration
    ))
}

/// The axis with a line for everything that is not off.
fn additions(axis: &Axis) -> String {
    let mut lines = vec!["let mut axis = Axis::new(law, output);".to_owned()];
    let mut field = |name: &str, value: Option<String>| {
        lines.extend(value.map(|value| format!("axis.{name} = {value};")));
    };
    let (rest, monitors) = (axis.rest, axis.monitors);
    let own_counter = Some(axis.counter).filter(|counter| *counter != CounterParameters::WORD);
    field("counter", own_counter.map(counter));
    let load = match axis.feedback {
        Feedback::Load(load) => Some(format!("axis::Feedback::Load({})", counter(load))),
        Feedback::Motor => None,
    };
    field("feedback", load);
    let compensation = axis.backlash_compensation.map(|plan| {
        let (half_gap, samples) = (plan.half_gap_counts(), plan.samples());
        let trigger = plan.trigger();
        format!("BacklashCompensation::planned({half_gap}, {samples}, Trigger::{trigger:?})")
    });
    field("backlash_compensation", compensation);
    let dead_band = Some(rest.dead_band).filter(|counts| *counts != 0);
    field("rest.dead_band", dead_band.map(|counts| counts.to_string()));
    let holds = rest.hold_integral.then(|| "true".to_owned());
    field("rest.hold_integral", holds);
    let following_error = monitors.following_error.map(following_error);
    field("monitors.following_error", following_error);
    let encoder_loss = monitors.encoder_loss.map(encoder_loss);
    field("monitors.encoder_loss", encoder_loss);
    field("monitors.saturation", monitors.saturation.map(saturation));
    let ticks = monitors.ticks.map(|_| "Some(monitor::TickMonitor)");
    field("monitors.ticks", ticks.map(str::to_owned));
    if lines.len() == 1 {
        return "Axis::new(law, output)".to_owned();
    }
    lines.push("axis".to_owned());
    lines.join("\n    ")
}

fn literal(word: GainWord) -> String {
    format!("GainWord::new({}, {})", word.mantissa, word.fraction_bits)
}

/// What an acceptance that cannot fail gives, in a constant.
fn accepted(call: &str) -> String {
    format!("match {call} {{ Ok(accepted) => accepted, Err(_) => panic!() }}")
}

fn counter(counter: CounterParameters) -> String {
    let (bits, jump) = (counter.bits(), counter.largest_jump());
    accepted(&format!("CounterParameters::accept({bits}, {jump:?})"))
}

/// A monitor of that name, with its limits.
fn monitor(name: &str, limits: &str) -> String {
    let call = format!("monitor::{name}::accept({limits})");
    format!("Some({})", accepted(&call))
}

fn following_error(monitored: FollowingErrorMonitor) -> String {
    let ((counts, per_speed), bits) = (monitored.limits(), monitored.velocity_fraction_bits());
    let limits = format!("{counts}, {}, {bits}", literal(per_speed));
    monitor("FollowingErrorMonitor", &limits)
}

fn encoder_loss(monitored: EncoderLossMonitor) -> String {
    let (code, ticks) = monitored.limits();
    monitor("EncoderLossMonitor", &format!("{code}, {ticks}"))
}

fn saturation(monitored: SaturationMonitor) -> String {
    monitor("SaturationMonitor", &monitored.limit().to_string())
}
