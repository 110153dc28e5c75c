//! Checks that concern several keys at once.
//!
//! Only rung `firmware` takes its setpoints from a table, generator or queue;
//! what hangs on that choice is judged there alone, so that one file serves
//! all rungs.

use plant::{Course, Motion, MotionError, MotionLimits};

use super::check::{Part, Values};
use super::errors::{Findings, Place, Problem};
use super::keys::{Key, Need, Way, path};
use super::table::{self, gains, pitch_m_per_rad};
use super::tree::Table;
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

fn refused(key: &str, because: impl Into<String>) -> Refusal {
    (key.to_owned(), because.into())
}

/// The refusal of a value that is wrong.
fn refused_if(wrong: bool, key: &str, because: impl FnOnce() -> String) -> Option<Refusal> {
    wrong.then(|| refused(key, because()))
}

/// Reports what does not go together, and gives the motion. A value that was
/// refused on its own is left out of it.
pub(super) fn check(
    v: &Values,
    tree: &Table,
    profile: &ProfilePoints<'_>,
    findings: &mut Findings,
) -> Option<Motion> {
    let mut refusals = two_ways(v);
    refusals.extend(partners(v));
    refusals.extend(resistance(v));
    refusals.extend(drive(v));
    refusals.extend(loads(v));
    refusals.extend(exact_needs_affine(v));
    let must = "the delay must be at most the sample time";
    refusals.extend(times(v, [DELAY, SAMPLE_TIME], u64::gt, must));
    refusals.extend(gain_change(v));
    refusals.extend(count_jump(v));
    let must = "the release must come after the stop";
    refusals.extend(times(v, [STOP_RELEASE, STOP], u64::le, must));
    let lacks_encoder = is_dual(v) && !has_load_encoder(v);
    let because = || format!("\"dual\" needs {LOAD_ENCODER}");
    refusals.extend(refused_if(lacks_encoder, FEEDBACK, because));
    refusals.extend(compensation(v));
    refusals.extend(measured_gap(v));
    refusals.extend(enable(v));
    if law(v) == Some(Law::Firmware) {
        refusals.extend(underrun(v));
        refusals.extend(damping(v));
        refusals.extend(gap_before_the_chip(v));
    }
    let motion = motion(v, tree, profile);
    let motion = motion.and_then(|motion| motion.map_err(|why| refusals.push(why)).ok());
    if let Some(motion) = &motion {
        refusals.extend(travel(v, motion));
        refusals.extend(planned_on_the_chip(v, motion));
    }
    refusals.extend(rows(v));
    if v.get("run.solver") == Some(SolverChoice::Rk4) {
        refusals.extend(limit_count(v, "run.rk4_step_s", 0, MOST_RK4_STEPS, "steps"));
    }
    for (key, because) in refusals {
        let (place, problem) = refusal(v, &key, because);
        findings.push(place, problem);
    }
    motion
}

/// The points of the profile at a path, or the sentence that says why there are none.
type ProfilePoints<'a> = dyn Fn(&str) -> Result<Vec<(f64, f64)>, String> + 'a;

/// The motion command, or why there is none.
fn motion(
    v: &Values,
    tree: &Table,
    profile: &ProfilePoints<'_>,
) -> Option<Result<Motion, Refusal>> {
    let mut rows = v.row_names("move").peekable();
    if rows.peek().is_some() {
        let moves = rows.map(|row| {
            let dwell_s = v.get(&format!("{row}.dwell_s"))?;
            Some(one_move(v, row)?.map(|motion| (motion, dwell_s)))
        });
        let moves: Option<Result<Vec<_>, Refusal>> = moves.collect();
        let row =
            |moves: Vec<_>| Motion::row(&moves).map_err(|error| refused("move", error.to_string()));
        return Some(moves?.and_then(row));
    }
    let key = "motion.profile";
    if v.value(key).is_none() {
        return one_move(v, "motion");
    }
    let path = tree.section("motion")?.get("profile")?.value.text()?;
    let spline = |points: Vec<_>| Motion::profile(&points).map_err(|error| error.to_string());
    let motion = profile(path).and_then(spline);
    Some(motion.map_err(|because| refused(key, because)))
}

/// The command of `[motion]` or of a row. Intervals are judged even while the travel is
/// missing.
fn one_move(v: &Values, at: &str) -> Option<Result<Motion, Refusal>> {
    let number = |name| v.get::<f64>(&path(at, name));
    let refuse = |name, error: MotionError| refused(&path(at, name), error.to_string());
    // mm → m
    let travel_m = number("travel_mm").map(|travel_mm| travel_mm * 1e-3);
    if let Some(Value::Intervals(mut intervals_s)) = v.value(&path(at, "intervals_s")) {
        let sum_s: f64 = intervals_s.iter().sum();
        if let Some(total_s) = number("total_time_s")
            && sum_s > 0.0
        {
            intervals_s = intervals_s.map(|interval_s| interval_s * (total_s / sum_s));
        }
        return match Motion::new(travel_m.unwrap_or(1e-3), intervals_s) {
            Ok(_) if travel_m.is_none() => None,
            motion => Some(motion.map_err(|error| refuse("intervals_s", error))),
        };
    }
    let limits = MotionLimits {
        acceleration_mps2: number("max_acceleration_mps2")?,
        velocity_mps: number("max_velocity_mps").unwrap_or(f64::INFINITY),
        jerk_mps3: number("max_jerk_mps3").unwrap_or(f64::INFINITY),
    };
    let motion = Motion::limited(travel_m?, limits);
    Some(motion.map_err(|error| refuse("max_acceleration_mps2", error)))
}

/// The firmware's generator plans single moves; a queue brings any command.
fn planned_on_the_chip(v: &Values, motion: &Motion) -> Option<Refusal> {
    let what = match motion.course() {
        _ if motion.intervals_s().is_some() => return None,
        Course::Profile(_) => "a profile",
        _ => "several moves",
    };
    let key = "controller.setpoints";
    let is_planned = v.get(key) == Some(SetpointOrigin::Generator);
    refused_if(law(v) == Some(Law::Firmware) && is_planned, key, || {
        format!(
            "the firmware plans one move at a time, and this motion is {what}; use \"table\" or \"queue\""
        )
    })
}

fn law(v: &Values) -> Option<Law> {
    v.get("controller.law")
}

/// Keys of two ways to give one quantity.
fn two_ways(v: &Values) -> Vec<Refusal> {
    let of_part = |part: &Part| -> Vec<Refusal> {
        let ways = part.section.ways.iter();
        ways.filter_map(|ways| one_way(v, part, ways)).collect()
    };
    v.parts.iter().flat_map(of_part).collect()
}

fn one_way(v: &Values, part: &Part, ways: &[Way]) -> Option<Refusal> {
    let (section, at) = (part.section, &part.name);
    let keys = part.entries.iter();
    let keys = keys.filter(|(key, _)| ways.iter().any(|way| way.contains(&key.name)));
    let given = keys.filter_map(|(key, entry)| Some((entry.place.as_ref()?.order(), key.name)));
    let mut given: Vec<(usize, &str)> = given.collect();
    given.sort_by_key(|(line, _)| *line);
    // The message stands with the later line.
    let (other, key) = given.iter().enumerate().find_map(|(place, (_, key))| {
        let mut before = given.iter().take(place);
        let other = before.find(|(_, other)| section.excludes(key, other))?;
        Some((other.1, *key))
    })?;
    let quoted = v.quote(&path(at, other));
    let ways = section.ways_words(ways);
    let because = format!("{quoted} gives the same in another way; give {ways}");
    Some(refused(&path(at, key), because))
}

/// Loads that end before they begin.
fn loads(v: &Values) -> Vec<Refusal> {
    let must = "the load must end after it begins";
    let ends = v.row_names("load").filter_map(|row| {
        let keys = ["to_s", "from_s"].map(|key| format!("{row}.{key}"));
        times(v, [&keys[0], &keys[1]], u64::le, must)
    });
    ends.collect()
}

/// Keys of the other kind of drive.
fn drive(v: &Values) -> Vec<Refusal> {
    let is_current = v.value("drive.kind") == Some(Value::Choice("current"));
    let (of_drive, gains, because): (&[&str], _, _) = if is_current {
        let because = "drive.kind = \"current\" commands amperes: give amplifier_gain_a_per_v, and gains as \
                       kp_a_per_rad …, velocity_gain_as_per_rad or in codes";
        (&["amplifier_gain"], gains::OF_VOLTAGE_DRIVE, because)
    } else {
        let of_drive = &["amplifier_gain_a_per_v", "current_bandwidth_hz"];
        let because = "it needs drive.kind = \"current\"";
        (of_drive, gains::OF_CURRENT_DRIVE, because)
    };
    let of_drive = of_drive.iter().map(|key| path("drive", key));
    let of_gains = ["controller", "gain_change"].into_iter();
    let of_gains =
        of_gains.flat_map(|section| gains.concat().into_iter().map(|key| path(section, key)));
    let given = of_drive.chain(of_gains).filter(|key| v.is_given(key));
    given.map(|key| refused(&key, because)).collect()
}

/// Keys that mean something only beside another one.
fn partners(v: &Values) -> Vec<Refusal> {
    let of_key = |(section, key, _): (&str, &Key, _)| {
        let Need::OnlyWith(partner) = key.need else {
            return None;
        };
        let (key, partner) = (path(section, key.name), path(section, partner));
        let because = || format!("it needs {partner}");
        refused_if(!v.is_given(&partner), &key, because)
    };
    v.given().filter_map(of_key).collect()
}

fn resistance(v: &Values) -> Vec<Refusal> {
    let switch = "carriage.resistance_opposes_motion";
    let terms = [
        ("carriage.resistance_constant_n", "constant resistance a0"),
        (A2, "quadratic resistance a2"),
    ];
    let negative = |key| v.get(switch) == Some(true) && v.get(key).is_some_and(|a: f64| a < 0.0);
    let refused_term = |(key, meaning)| {
        let because = || format!("the {meaning} must be at least 0 with {}", v.quote(switch));
        refused_if(negative(key), key, because)
    };
    terms.into_iter().filter_map(refused_term).collect()
}

const A2: &str = "carriage.resistance_quadratic_ns2_per_rad2";

fn exact_needs_affine(v: &Values) -> Option<Refusal> {
    let is_exact = v.get("run.solver") == Some(SolverChoice::Exact);
    refused_if(is_exact && v.get::<f64>(A2)? != 0.0, "run.solver", || {
        format!(
            "the exact solution exists only without quadratic resistance, and {}; \"auto\" and \"dopri5\" solve it",
            v.quote(A2)
        )
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
    let because = || format!("{must}, {}", v.quote(other));
    refused_if(wrong(&v.get(key)?, &v.get(other)?), key, because)
}

fn gain_change(v: &Values) -> Option<Refusal> {
    let section = table::find("gain_change")?;
    let given = |key: &Key| v.is_given(&path(section.name, key.name));
    let mut gains = section.keys.iter().filter(|key| key.name != "at_s");
    let at = "gain_change.at_s";
    refused_if(v.is_given(at) && !gains.any(given), at, || {
        let ways = section.ways.iter().map(|ways| section.ways_words(ways));
        format!("no gain changes; give {}", ways.collect::<String>())
    })
}

/// A counter of n bits wraps around: it tells jumps below 2^(n−1) from their
/// complement, longer ones it shows as others.
fn count_jump(v: &Values) -> Option<Refusal> {
    let (jump, bits) = ("limits.count_jump_counts", "encoder.counter_bits");
    let half = 1_u32.checked_shl(v.get::<u32>(bits)?.saturating_sub(1))?;
    refused_if(v.get::<u32>(jump)? >= half, jump, || {
        let counter = v.quote(bits);
        format!("it must be less than {half}, half the range of {counter}")
    })
}

const FEEDBACK: &str = "controller.feedback";

fn is_dual(v: &Values) -> bool {
    v.get(FEEDBACK) == Some(Feedback::Dual)
}

fn has_load_encoder(v: &Values) -> bool {
    v.is_given("load_encoder.counts_per_rad") || v.is_given("load_encoder.counts_per_mm")
}

const COMPENSATION: &str = "backlash.compensation";

fn compensation(v: &Values) -> Vec<Refusal> {
    if matches!(v.get(COMPENSATION), None | Some(Compensation::None)) {
        return Vec::new();
    }
    let needless = refused_if(is_dual(v), COMPENSATION, || {
        format!(
            "with {} the position behind the gap is controlled already; use \"none\" or feedback = \"motor\"",
            v.quote(FEEDBACK)
        )
    });
    let mut missing = vec!["limits.velocity_mps", "limits.acceleration_mps2"];
    missing.retain(|key| !v.is_given(key));
    let because = || format!("the backlash compensation needs {}", missing.join(" and "));
    let lacking = refused_if(!missing.is_empty(), COMPENSATION, because);
    needless.into_iter().chain(lacking).collect()
}

const GAP: &str = "backlash.gap";

fn is_gap_measured(v: &Values) -> bool {
    v.get(GAP) == Some(GapSource::Measured)
}

fn measured_gap(v: &Values) -> Option<Refusal> {
    let key = "backlash.backlash_measurement_detection";
    let by_load_encoder = v.get(key) == Some(FlankDetection::LoadEncoder);
    let lacks = is_gap_measured(v) && by_load_encoder && !has_load_encoder(v);
    let because = || format!("{} needs {LOAD_ENCODER}", v.quote(key));
    refused_if(lacks, GAP, because)
}

/// The axis is enabled from the start: asking again makes sense only after
/// something has ended that.
fn enable(v: &Values) -> Option<Refusal> {
    let key = "sequence.enable_s";
    let enable_ns: u64 = v.get(key)?;
    let before = ["sequence.disable_s", "sequence.reset_s"].map(|key| v.get::<u64>(key));
    let because = "the axis is enabled from the start; it needs an earlier sequence.disable_s or \
                   sequence.reset_s";
    let is_enabled = !before.into_iter().flatten().any(|ns| ns <= enable_ns);
    is_enabled.then(|| refused(key, because))
}

fn underrun(v: &Values) -> Option<Refusal> {
    let (origin, underrun) = ("controller.setpoints", "inject.setpoint_underrun_s");
    let is_queue = v.get::<SetpointOrigin>(origin)? == SetpointOrigin::Queue;
    refused_if(!is_queue && v.is_given(underrun), underrun, || {
        let quoted = v.quote(origin);
        format!("{quoted} cannot run dry; it needs setpoints = \"queue\"")
    })
}

/// With two encoders the error is the load's, and its derivative no damping of
/// the motor.
fn damping(v: &Values) -> Option<Refusal> {
    let key = "controller.derivative";
    let measured = v.get(key) == Some(Derivative::Measurement);
    let is_undamped = is_dual(v) && has_load_encoder(v) && !measured;
    refused_if(is_undamped, FEEDBACK, || {
        format!(
            "\"dual\" takes its damping from the motor, and {}; use derivative = \"measurement\" \
             (velocity_ff_s = kd_s then gives back the reference's part)",
            v.quote(key)
        )
    })
}

/// The gap is measured before the chip has made a step whose time could be
/// known.
fn gap_before_the_chip(v: &Values) -> Option<Refusal> {
    let by_chip = v.get(DELAY) == Some(ComputationDelay::Measured);
    refused_if(is_gap_measured(v) && by_chip, GAP, || {
        format!(
            "the gap is measured before the chip's first step, where {} is not known yet; \
             use \"given\", or a delay in seconds",
            v.quote(DELAY)
        )
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
    let screw_rad = motion.largest_displacement_m() / pitch_m;
    let shaft_rad = screw_rad / number("transmission.gear_ratio")?;
    let of_motor = (per_rad * shaft_rad).abs();
    // Only rung `firmware` has a second encoder.
    let of_scale = || Some(1e3 * number("load_encoder.counts_per_mm")? * pitch_m);
    let of_load = number("load_encoder.counts_per_rad")
        .or_else(of_scale)
        .filter(|_| law(v) == Some(Law::Firmware))
        .map_or(0.0, |per_rad| (per_rad * screw_rad).abs());
    let counts = of_motor.max(of_load);
    let is_beyond = law(v)? >= Law::Quantised && counts > MOST_COUNTS;
    refused_if(is_beyond, motion_key(motion), || {
        let (counts, most) = (show_number(counts), show_number(MOST_COUNTS));
        format!("it makes {counts} encoder counts; at most {most} are allowed")
    })
}

/// The key that says how far a motion goes.
pub(crate) fn motion_key(motion: &Motion) -> &'static str {
    match motion.course() {
        Course::Intervals(_) | Course::Limits(..) => "motion.travel_mm",
        Course::Profile(_) => "motion.profile",
        Course::Row(_) => "move.1.travel_mm",
    }
}

fn rows(v: &Values) -> Option<Refusal> {
    let key = match law(v)? {
        Law::Continuous => "run.row_interval_s",
        _ => SAMPLE_TIME,
    };
    // The row at t = 0 comes on top.
    limit_count(v, key, 1, MOST_ROWS, "rows")
}

/// Refuses a duration that makes more than `most` rows or steps.
fn limit_count(v: &Values, key: &str, extra: u64, most: u64, what: &str) -> Option<Refusal> {
    let duration = "run.duration_s";
    let count = v.get::<u64>(duration)?.checked_div(v.get(key)?)? + extra;
    refused_if(count > most, duration, || {
        let quoted = v.quote(key);
        format!("with {quoted} it makes {count} {what}; at most {most} are allowed")
    })
}

/// Place and words for a value that is refused after its own check.
pub(super) fn refusal(values: &Values, key: &str, because: String) -> (Place, Problem) {
    let entry = values.entry(key);
    let (place, text) = match entry.map(|entry| (&entry.place, &entry.text)) {
        Some((Some(place), text)) => (place.clone(), text.clone()),
        Some((None, text)) => (Place::File, format!("{text} (the default)")),
        None => (Place::File, "(not given)".to_owned()),
    };
    let key = key.to_owned();
    (place, Problem::NotAllowed { key, text, because })
}
