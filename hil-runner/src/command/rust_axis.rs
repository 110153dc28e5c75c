//! An axis as Rust source: a constant to paste into an image, with the limits and
//! ranges that it was accepted for.

use firmware::axis::{Axis, Feedback};
use firmware::backlash_compensation::BacklashCompensation;
use firmware::law::{AntiWindup, FilterWords};
use firmware::monitor::{EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor};
use firmware::output::Quantiser;
use firmware::position::CounterParameters;
use firmware::word::GainWord;
use hil_core::scaling::ScalingRequest;

/// The constant `AXIS` of the case `name`, whose gains were made from `request`.
pub(super) fn source(name: &str, request: &ScalingRequest, axis: &Axis) -> String {
    let (law, output) = (axis.law(), axis.output());
    let words = law.words();
    let gain = |key: &str, word| format!("        {key}: {},\n", literal(word));
    let gains = [
        gain("kp", words.kp),
        gain("ki_dt", words.ki_dt),
        gain("kd_per_dt", words.kd_per_dt),
        gain("velocity_ff", words.velocity_ff),
        gain("acceleration_ff", words.acceleration_ff),
        gain("friction_ff", words.friction_ff),
    ];
    format!(
        "/// The axis of {name}, a sample every {sample_time_ns} ns, by `hil-runner scaling --rust`.\n\
         ///\n{ranges}\
         pub const AXIS: firmware::Axis = {{\n    \
             use firmware::*;\n\
         \n    \
             let words = law::LawWords {{\n{gains}        \
                 error_bits: {error_bits},\n        \
                 integral_bits: {integral_bits},\n        \
                 derivative: law::Derivative::{derivative:?},\n        \
                 filter: {filter},\n        \
                 anti_windup: law::AntiWindup::{anti_windup},\n    \
             }};\n    \
             let Ok(dac) = Dac::with_bits({bits}) else {{ panic!() }};\n    \
             let Ok(law) = law::Law::accept(words, dac) else {{ panic!() }};\n    \
             let Ok(output) = output::Output::new(dac, {slew:?}, output::Quantiser::{quantiser}) else {{ panic!() }};\n    \
             {rest}\n\
         }};\n",
        sample_time_ns = request.sample_time_ns,
        ranges = commented("/// ", &declared(request, axis)),
        gains = gains.concat(),
        error_bits = words.error_bits,
        integral_bits = words.integral_bits,
        derivative = words.derivative,
        filter = filter(words.filter),
        anti_windup = match words.anti_windup {
            AntiWindup::None => "None".to_owned(),
            AntiWindup::Clamp => "Clamp".to_owned(),
            AntiWindup::BackCalculation { tracking } =>
                format!("BackCalculation {{ tracking: {tracking} }}"),
        },
        bits = law.dac().bits(),
        slew = output.slew_codes(),
        quantiser = match output.quantiser() {
            Quantiser::Nearest => "Nearest".to_owned(),
            Quantiser::ErrorFeedback => "ErrorFeedback".to_owned(),
            Quantiser::Dither { seed } => format!("Dither {{ seed: {seed} }}"),
        },
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
    let mut field = |name: &str, value: String| lines.push(format!("axis.{name} = {value};"));
    if axis.counter != CounterParameters::WORD {
        field("counter", counter(axis.counter));
    }
    if let Feedback::Load(load) = axis.feedback {
        let load = counter(load);
        field("feedback", format!("axis::Feedback::Load({load})"));
    }
    if let Some(plan) = axis.backlash_compensation {
        field("backlash_compensation", compensation(&plan));
    }
    if axis.rest.dead_band != 0 {
        field("rest.dead_band", axis.rest.dead_band.to_string());
    }
    if axis.rest.hold_integral {
        field("rest.hold_integral", "true".to_owned());
    }
    let monitors = &axis.monitors;
    if let Some(monitor) = monitors.following_error {
        field("monitors.following_error", following_error(&monitor));
    }
    if let Some(monitor) = monitors.encoder_loss {
        field("monitors.encoder_loss", encoder_loss(&monitor));
    }
    if let Some(monitor) = monitors.saturation {
        field("monitors.saturation", saturation(&monitor));
    }
    if monitors.ticks.is_some() {
        field("monitors.ticks", "Some(monitor::TickMonitor)".to_owned());
    }
    if lines.len() == 1 {
        return "Axis::new(law, output)".to_owned();
    }
    lines.push("axis".to_owned());
    lines.join("\n    ")
}

fn literal(word: GainWord) -> String {
    format!("GainWord::new({}, {})", word.mantissa, word.fraction_bits)
}

fn filter(words: Option<FilterWords>) -> String {
    match words {
        None => "None".to_owned(),
        Some(filter) => format!("Some(law::{filter:?})"),
    }
}

/// What an acceptance that cannot fail gives, in a constant.
fn accepted(call: &str) -> String {
    format!("match {call} {{ Ok(accepted) => accepted, Err(_) => panic!() }}")
}

fn counter(counter: CounterParameters) -> String {
    let (bits, jump) = (counter.bits(), counter.largest_jump());
    accepted(&format!("CounterParameters::accept({bits}, {jump:?})"))
}

fn compensation(plan: &BacklashCompensation) -> String {
    format!(
        "BacklashCompensation::planned({}, {}, Trigger::{:?})",
        plan.half_gap_counts(),
        plan.samples(),
        plan.trigger(),
    )
}

fn following_error(monitor: &FollowingErrorMonitor) -> String {
    let (counts, per_speed) = monitor.limits();
    let call = format!(
        "monitor::FollowingErrorMonitor::accept({counts}, {}, {})",
        literal(per_speed),
        monitor.velocity_fraction_bits(),
    );
    format!("Some({})", accepted(&call))
}

fn encoder_loss(monitor: &EncoderLossMonitor) -> String {
    let (code, ticks) = monitor.limits();
    let call = format!("monitor::EncoderLossMonitor::accept({code}, {ticks})");
    format!("Some({})", accepted(&call))
}

fn saturation(monitor: &SaturationMonitor) -> String {
    let call = format!("monitor::SaturationMonitor::accept({})", monitor.limit());
    format!("Some({})", accepted(&call))
}
