//! Checks that concern several keys at once.
//!
//! Only rung `firmware` takes its setpoints from a table, generator or queue;
//! what hangs on that choice is judged there alone, so that one file serves
//! all rungs.

use plant::{Motion, MotionError};

use super::check::Values;
use super::errors::{Findings, Place, Problem};
use super::keys::{Key, Need, Section, path};
use super::table::{SECTIONS, pitch_m_per_rad};
use super::values::{Value, show_number};
use crate::case::{ComputationDelay, Law, SolverChoice};
use crate::options::{
    Compensation, Derivative, Feedback, FlankDetection, GapSource, SetpointOrigin,
};

/// Most rows that a run may have: a day at 1 ms. More are rather a slip of the
/// keyboard than a wish for tens of gigabytes of trace.
pub const MOST_ROWS: u64 = 100_000_000;

/// Most steps that solver `rk4` may take in a run: minutes of computing.
pub const MOST_RK4_STEPS: u64 = 1_000_000_000;

/// Most encoder counts that a motion may cover, far above any axis: 2^50. Up
/// there `f64` still resolves a quarter of a count.
pub const MOST_COUNTS: f64 = 1_125_899_906_842_624.0;

/// The keys that a load encoder needs.
const LOAD_ENCODER: &str = "load_encoder.counts_per_rad or load_encoder.counts_per_mm";

/// A key, and the sentence that says why its value is refused.
type Refusal = (String, String);

fn refused(key: &str, because: String) -> Refusal {
    (key.to_owned(), because)
}

/// Reports what does not go together, and gives the motion. A value that was
/// refused on its own is left out of it.
pub(super) fn check(v: &Values, findings: &mut Findings) -> Option<Motion> {
    let mut refusals = pairs(v);
    refusals.extend(resistance(v));
    refusals.extend(exact_needs_affine(v));
    let must = "the delay must be at most the sample time";
    refusals.extend(times(v, [DELAY, SAMPLE_TIME], u64::gt, must));
    refusals.extend(gain_change(v));
    refusals.extend(count_jump(v));
    let must = "the release must come after the stop";
    refusals.extend(times(v, [STOP_RELEASE, STOP], u64::le, must));
    refusals.extend(feedback(v));
    refusals.extend(compensation(v));
    refusals.extend(measured_gap(v));
    refusals.extend(enable(v));
    if law(v) == Some(Law::Firmware) {
        refusals.extend(setpoint_origin(v));
        refusals.extend(damping(v));
        refusals.extend(gap_before_the_chip(v));
    }
    let motion = motion(v).and_then(|motion| {
        let refuse = |error: MotionError| refused("motion.intervals_s", error.to_string());
        motion.map_err(|error| refusals.push(refuse(error))).ok()
    });
    if let Some(motion) = &motion {
        refusals.extend(setpoint_table(v, motion));
        refusals.extend(travel(v, motion));
    }
    refusals.extend(rows(v));
    refusals.extend(rk4_steps(v));
    for (key, because) in refusals {
        let (place, problem) = refusal(v, &key, because);
        findings.push(place, problem);
    }
    motion
}

/// The motion command, or why the intervals make none. They are judged even
/// while the travel is missing.
fn motion(v: &Values) -> Option<Result<Motion, MotionError>> {
    let Some(Value::Intervals(mut intervals_s)) = v.value("motion.intervals_s") else {
        return None;
    };
    let sum_s: f64 = intervals_s.iter().sum();
    if let Some(total_s) = v.get::<f64>("motion.total_time_s")
        && sum_s > 0.0
    {
        intervals_s = intervals_s.map(|interval_s| interval_s * (total_s / sum_s));
    }
    let travel_mm: Option<f64> = v.get("motion.travel_mm");
    // mm → m
    match Motion::new(travel_mm.unwrap_or(1.0) * 1e-3, intervals_s) {
        Ok(_) if travel_mm.is_none() => None,
        motion => Some(motion),
    }
}

fn law(v: &Values) -> Option<Law> {
    v.get("controller.law")
}

/// Keys that exclude each other, and keys that mean something only beside
/// another one.
fn pairs(v: &Values) -> Vec<Refusal> {
    let keys = SECTIONS
        .iter()
        .flat_map(|section| section.keys.iter().map(move |key| (section, key)));
    let of_key = |(section, key): (&Section, &Key)| {
        let name = path(section.name, key.name);
        match key.need {
            Need::OneOf(partner) | Need::NotWith(partner) if section.leads(key) => {
                only_one_of(v, &name, &path(section.name, partner))
            }
            Need::OnlyWith(partner) => {
                let partner = path(section.name, partner);
                (v.is_given(&name) && !v.is_given(&partner))
                    .then(|| refused(&name, format!("it needs {partner}")))
            }
            _ => None,
        }
    };
    keys.filter_map(of_key).collect()
}

fn only_one_of(v: &Values, key: &str, partner: &str) -> Option<Refusal> {
    let line = |key: &str| match v.entry(key)?.place.as_ref()? {
        Place::Line(line) => Some(*line),
        _ => Some(usize::MAX),
    };
    // The message stands with the later line.
    let (key, partner) = if line(key)? > line(partner)? {
        (key, partner)
    } else {
        (partner, key)
    };
    let quoted = v.quote(partner);
    let because = format!("{quoted} sets the same quantity; give one of the two");
    Some(refused(key, because))
}

fn resistance(v: &Values) -> Vec<Refusal> {
    let switch = "carriage.resistance_opposes_motion";
    let mut terms = vec![
        ("carriage.resistance_constant_n", "constant resistance a0"),
        (A2, "quadratic resistance a2"),
    ];
    let negative = |key| v.get(switch) == Some(true) && v.get(key).is_some_and(|a: f64| a < 0.0);
    terms.retain(|(key, _)| negative(key));
    let refused_term = |(key, meaning)| {
        let switch = v.quote(switch);
        let because = format!("the {meaning} must be at least 0 with {switch}");
        refused(key, because)
    };
    terms.into_iter().map(refused_term).collect()
}

const A2: &str = "carriage.resistance_quadratic_ns2_per_rad2";

fn exact_needs_affine(v: &Values) -> Option<Refusal> {
    let is_exact = v.get("run.solver") == Some(SolverChoice::Exact);
    (is_exact && v.get::<f64>(A2)? != 0.0).then(|| {
        let because = format!(
            "the exact solution exists only without quadratic resistance, and {}; \"auto\" and \"dopri5\" solve it",
            v.quote(A2)
        );
        refused("run.solver", because)
    })
}

const SAMPLE_TIME: &str = "controller.sample_time_s";
const DELAY: &str = "controller.computation_delay_s";
const STOP: &str = "sequence.emergency_stop_s";
const STOP_RELEASE: &str = "sequence.emergency_stop_release_s";

/// Refuses a time that stands to another one as it must not.
fn times(
    v: &Values,
    [key, other]: [&str; 2],
    wrong: fn(&u64, &u64) -> bool,
    must: &str,
) -> Option<Refusal> {
    wrong(&v.get(key)?, &v.get(other)?).then(|| refused(key, format!("{must}, {}", v.quote(other))))
}

fn gain_change(v: &Values) -> Option<Refusal> {
    let given = |key| v.is_given(key);
    let gains = ["gain_change.kp", "gain_change.ki_per_s", "gain_change.kd_s"];
    (given("gain_change.at_s") && !gains.into_iter().any(given)).then(|| {
        let because = "no gain changes; give gain_change.kp, ki_per_s or kd_s".to_owned();
        refused("gain_change.at_s", because)
    })
}

/// A counter of n bits wraps around: it tells jumps below 2^(n−1) from their
/// complement, longer ones it shows as others.
fn count_jump(v: &Values) -> Option<Refusal> {
    let (jump, bits) = ("limits.count_jump_counts", "encoder.counter_bits");
    let half = 1_u32.checked_shl(v.get::<u32>(bits)?.saturating_sub(1))?;
    (v.get::<u32>(jump)? >= half).then(|| {
        let counter = v.quote(bits);
        let because = format!("it must be less than {half}, half the range of {counter}");
        refused(jump, because)
    })
}

const FEEDBACK: &str = "controller.feedback";

fn is_dual(v: &Values) -> bool {
    v.get(FEEDBACK) == Some(Feedback::Dual)
}

fn has_load_encoder(v: &Values) -> bool {
    v.is_given("load_encoder.counts_per_rad") || v.is_given("load_encoder.counts_per_mm")
}

fn feedback(v: &Values) -> Option<Refusal> {
    (is_dual(v) && !has_load_encoder(v))
        .then(|| refused(FEEDBACK, format!("\"dual\" needs {LOAD_ENCODER}")))
}

const COMPENSATION: &str = "backlash.compensation";

fn compensation(v: &Values) -> Vec<Refusal> {
    let mut refusals = Vec::new();
    if matches!(v.get(COMPENSATION), None | Some(Compensation::None)) {
        return refusals;
    }
    if is_dual(v) {
        let because = format!(
            "with {} the position behind the gap is controlled already; use \"none\" or feedback = \"motor\"",
            v.quote(FEEDBACK)
        );
        refusals.push(refused(COMPENSATION, because));
    }
    let mut missing = vec!["limits.velocity_mps", "limits.acceleration_mps2"];
    missing.retain(|key| !v.is_given(key));
    if !missing.is_empty() {
        let because = format!("the backlash compensation needs {}", missing.join(" and "));
        refusals.push(refused(COMPENSATION, because));
    }
    refusals
}

const GAP: &str = "backlash.gap";

fn is_gap_measured(v: &Values) -> bool {
    v.get(GAP) == Some(GapSource::Measured)
}

fn measured_gap(v: &Values) -> Option<Refusal> {
    let key = "backlash.backlash_measurement_detection";
    let by_load_encoder = v.get(key) == Some(FlankDetection::LoadEncoder);
    (is_gap_measured(v) && by_load_encoder && !has_load_encoder(v))
        .then(|| refused(GAP, format!("{} needs {LOAD_ENCODER}", v.quote(key))))
}

/// The axis is enabled from the start: asking again makes sense only after
/// something has ended that.
fn enable(v: &Values) -> Option<Refusal> {
    let key = "sequence.enable_s";
    let enable_ns: u64 = v.get(key)?;
    let before = ["sequence.disable_s", "sequence.reset_s"].map(|key| v.get::<u64>(key));
    (!before.into_iter().flatten().any(|ns| ns <= enable_ns)).then(|| {
        let because = "the axis is enabled from the start; it needs an earlier \
                       sequence.disable_s or sequence.reset_s"
            .to_owned();
        refused(key, because)
    })
}

fn setpoint_origin(v: &Values) -> Vec<Refusal> {
    let mut refusals = Vec::new();
    let Some(origin) = v.get::<SetpointOrigin>("controller.setpoints") else {
        return refusals;
    };
    let quoted = v.quote("controller.setpoints");
    if origin == SetpointOrigin::Table {
        let because =
            format!("{quoted} knows positions only; use setpoints = \"generator\" or \"queue\"");
        for key in ["velocity_ff_s", "acceleration_ff_s2", "friction_ff_codes"] {
            let key = path("controller", key);
            if v.get(&key).is_some_and(|gain: f64| gain > 0.0) {
                refusals.push(refused(&key, because.clone()));
            }
        }
        if v.get(COMPENSATION) == Some(Compensation::Acceleration) {
            refusals.push(refused(COMPENSATION, because));
        }
    }
    let underrun = "inject.setpoint_underrun_s";
    if origin != SetpointOrigin::Queue && v.is_given(underrun) {
        let because = format!("{quoted} cannot run dry; it needs setpoints = \"queue\"");
        refusals.push(refused(underrun, because));
    }
    refusals
}

/// With two encoders the error is the load's, and its derivative no damping of
/// the motor.
fn damping(v: &Values) -> Option<Refusal> {
    let key = "controller.derivative";
    let measured = v.get(key) == Some(Derivative::Measurement);
    (is_dual(v) && has_load_encoder(v) && !measured).then(|| {
        let because = format!(
            "\"dual\" takes its damping from the motor, and {}; use derivative = \"measurement\" \
             (velocity_ff_s = kd_s then gives back the reference's part)",
            v.quote(key)
        );
        refused(FEEDBACK, because)
    })
}

/// The gap is measured before the chip has made a step whose time could be
/// known.
fn gap_before_the_chip(v: &Values) -> Option<Refusal> {
    let by_chip = v.get(DELAY) == Some(ComputationDelay::Measured);
    (is_gap_measured(v) && by_chip).then(|| {
        let because = format!(
            "the gap is measured before the chip's first step, where {} is not known yet; \
             use \"given\", or a delay in seconds",
            v.quote(DELAY)
        );
        refused(GAP, because)
    })
}

/// One setpoint a sample from k = 0 to the motion's end must fit into the
/// firmware's table.
fn setpoint_table(v: &Values, motion: &Motion) -> Option<Refusal> {
    let sample_ns: u64 = v.get(SAMPLE_TIME)?;
    // The sum of seven decimal intervals may miss a whole sample by a few
    // units in the last place; a millionth of a sample is rounding.
    let samples = motion.end_s() * 1e9 / sample_ns as f64 - 1e-6;
    let needed = samples.ceil().max(0.0) + 1.0;
    let capacity = firmware::CAPACITY;
    let from_table =
        law(v)? == Law::Firmware && v.get("controller.setpoints") == Some(SetpointOrigin::Table);
    (from_table && needed > capacity as f64).then(|| {
        let end = show_number(motion.end_s());
        let because = format!(
            "the motion of {end} s would make {needed} setpoints; the firmware's table holds {capacity}; \
             controller.setpoints = \"generator\" needs none"
        );
        refused(SAMPLE_TIME, because)
    })
}

/// On the rungs with an encoder every position is a whole number of counts,
/// which `f64` must be able to tell from its neighbours.
fn travel(v: &Values, motion: &Motion) -> Option<Refusal> {
    let number = |key| v.get::<f64>(key);
    let of_lines =
        || Some(plant::Encoder::with_lines(v.value("encoder.lines")?.number()?).counts_per_rad);
    let per_rad = number("encoder.counts_per_rad").or_else(of_lines)?;
    // γ = x/p and α = γ/z, eq. 3
    let pitch_m = pitch_m_per_rad(number("transmission.screw_pitch_mm_per_rev")?);
    let screw_rad = motion.travel_m() / pitch_m;
    let shaft_rad = screw_rad / number("transmission.gear_ratio")?;
    let of_motor = (per_rad * shaft_rad).abs();
    // Only rung `firmware` has a second encoder.
    let of_scale = || Some(1e3 * number("load_encoder.counts_per_mm")? * pitch_m);
    let of_load = number("load_encoder.counts_per_rad")
        .or_else(of_scale)
        .filter(|_| law(v) == Some(Law::Firmware))
        .map_or(0.0, |per_rad| (per_rad * screw_rad).abs());
    let counts = of_motor.max(of_load);
    (law(v)? >= Law::Quantised && counts > MOST_COUNTS).then(|| {
        let (counts, most) = (show_number(counts), show_number(MOST_COUNTS));
        let because = format!("it makes {counts} encoder counts; at most {most} are allowed");
        refused("motion.travel_mm", because)
    })
}

fn rows(v: &Values) -> Option<Refusal> {
    let key = match law(v)? {
        Law::Continuous => "run.row_interval_s",
        _ => SAMPLE_TIME,
    };
    // The row at t = 0 comes on top.
    limit_count(v, key, 1, MOST_ROWS, "rows")
}

fn rk4_steps(v: &Values) -> Option<Refusal> {
    let is_rk4 = v.get("run.solver") == Some(SolverChoice::Rk4);
    limit_count(v, "run.rk4_step_s", 0, MOST_RK4_STEPS, "steps").filter(|_| is_rk4)
}

/// Refuses a duration that makes more than `most` rows or steps.
fn limit_count(v: &Values, key: &str, extra: u64, most: u64, what: &str) -> Option<Refusal> {
    let duration = "run.duration_s";
    let count = v.get::<u64>(duration)?.checked_div(v.get(key)?)? + extra;
    (count > most).then(|| {
        let quoted = v.quote(key);
        let because = format!("with {quoted} it makes {count} {what}; at most {most} are allowed");
        refused(duration, because)
    })
}

/// Place and words for a value that is refused after its own check.
pub(super) fn refusal(values: &Values, key: &str, because: String) -> (Place, Problem) {
    let entry = values.entry(key);
    let place = entry.and_then(|entry| entry.place.clone());
    let text = match entry {
        Some(entry) if entry.place.is_none() => format!("{} (the default)", entry.text),
        Some(entry) => entry.text.clone(),
        None => "(not given)".to_owned(),
    };
    let key = key.to_owned();
    let problem = Problem::NotAllowed { key, text, because };
    (place.unwrap_or(Place::File), problem)
}
