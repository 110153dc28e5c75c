//! From a run file and what `[tune]` asks for to a problem with its starts: ranges, other keys
//! that a tuned one needs, requirements that hold for the axis.

use super::corners::corners;
use super::problem::{Aim, Problem, feed_forward, is_of_loop};
use super::start::{Start, starts};
use super::variable::{Span, Variable, is_feed_forward, is_gain, number_of};
use crate::budget::limits;
use crate::case::{CascadeGains, Case, Law};
use crate::number;
use crate::options::{Derivative, FeedForward, FeedForwardGain};
use crate::runfile::tune_settings::{Bound, Objective, Requirement, TuneSettings, TunedKey};
use crate::runfile::{Kind, Range, RunFileErrors, Template};
use crate::theory::{JointState, no_figure, no_loop};

use plant::PidGains;
use serde::Serialize;

/// Another key that a tuned one needs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NeededKey {
    /// Its path.
    pub key: String,
    /// Its value, as a file has it.
    pub value: String,
    /// The sentence that says why.
    pub because: String,
}

/// A tune that can begin.
#[derive(Debug)]
pub struct Prepared {
    /// The problem.
    pub problem: Problem,
    /// Its starts, the file's own first.
    pub starts: Vec<Start<Vec<f64>>>,
    /// Keys that are set besides the tuned ones.
    pub needed: Vec<NeededKey>,
}

/// A tune that cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum TuneError {
    /// The file with the needed keys is wrong.
    #[error(transparent)]
    File(#[from] RunFileErrors),
    /// One sentence.
    #[error("{0}")]
    Sentence(String),
}

/// Factor from a gain of a start to the ends of its range.
const AROUND_GAIN: f64 = 8.0;
/// Factor from a value to the ends of its range, for want of a theory.
const AROUND_VALUE: f64 = 2.0;
/// Longest filter, in sample times.
const LONGEST_FILTER: f64 = 10.0;
/// Largest feed-forward, in those of the plant.
const MOST_OF_PLANT: f64 = 1.5;

/// Prepares a tune.
///
/// # Errors
/// [`TuneError`]: what in the file or in `[tune]` is in the way.
pub fn prepare(file: &Template, settings: &TuneSettings) -> Result<Prepared, TuneError> {
    if file.base().controller.sample_time_ns.is_none() {
        let sentence = "a tune ends on rung firmware, which needs controller.sample_time_s";
        return Err(TuneError::Sentence(sentence.to_owned()));
    }
    let needed = needed(file.base(), settings);
    let mut sets = file.sets().to_vec();
    let each = needed.iter();
    sets.extend(each.map(|need| format!("{}={}", need.key, need.value)));
    let template = file.with_sets(&sets)?;
    let base = template.base();

    let requirements = requirements(base, settings);
    for required in &requirements {
        if let Some(why) = no_figure(base, required.figure) {
            let sentence = format!("tune.require has {}, but {why}", required.figure);
            return Err(TuneError::Sentence(sentence));
        }
    }
    let least = ["modulus_margin_contact", "modulus_margin_gap"].map(|figure| {
        let is_least = |of: &&Requirement| of.figure == figure && of.bound == Bound::AtLeast;
        let required = requirements.iter().find(is_least);
        required.map(|required| required.limit)
    });
    let rules: Vec<Start<Case>> = (starts(base, least).into_iter())
        .map(|rule| rule.map(|gains| with_gains(base, gains)))
        .collect();

    // Kessler's and the relay's gains may be far off: the ranges are those around the file's
    // own and the largest K_i, the first of the rules.
    let largest_ki = rules.first().and_then(|rule| rule.with.as_ref().ok());
    let known: Vec<&Case> = core::iter::once(base).chain(largest_ki).collect();
    let keys = settings.keys.iter();
    let variables: Vec<Variable> = keys
        .map(|tuned| variable(*tuned, &known, &template))
        .collect::<Result<_, String>>()
        .map_err(TuneError::Sentence)?;

    let budget = limits(base).0;
    let gear = &base.axis.transmission;
    let count_m = gear.screw_pitch_m_per_rad * gear.gear_ratio / base.encoder.counts_per_rad;
    let aim = |aim: &Objective| {
        let limit = budget.iter().find(|limit| limit.figure == aim.figure);
        let limit = limit.map(|limit| limit.limit);
        Aim {
            figure: aim.figure,
            weight: aim.weight,
            limit: limit.filter(|limit| *limit > 0.0).unwrap_or(1.0),
            floor: match crate::figures::unit(aim.figure) {
                "µm" => 1e6 * count_m,
                "mm" => 1e3 * count_m,
                _ => 0.0,
            },
        }
    };
    let aims = settings.minimise.iter().map(aim).collect();
    let corners = corners(&template, &settings.over, settings.draws, settings.seed);
    let corners = corners.map_err(TuneError::Sentence)?;
    Ok(Prepared {
        starts: rows(base, &variables, rules),
        problem: Problem::new(template, variables, aims, requirements, corners),
        needed,
    })
}

/// The requirements, the usual ones where none are given: those of loops that the case has,
/// and over several axes that no aim gets worse on any of them.
fn requirements(base: &Case, settings: &TuneSettings) -> Vec<Requirement> {
    if let Some(given) = &settings.require {
        return given.clone();
    }
    let required = |figure, bound, limit| Requirement {
        figure,
        bound,
        limit,
    };
    let mut usual = vec![required("modulus_margin_contact", Bound::AtLeast, 0.5)];
    if no_loop(base, JointState::Gap).is_none() {
        usual.push(required("modulus_margin_gap", Bound::AtLeast, 0.3));
    }
    usual.push(required("voltage_saturated_s", Bound::AtMost, 0.0));
    usual.push(required("rest_ripple_um", Bound::AtMost, 10.0));
    if !settings.over.is_empty() {
        let aims = settings.minimise.iter().map(|aim| aim.figure);
        let of_runs = aims.filter(|figure| !is_of_loop(figure));
        usual.extend(of_runs.map(|figure| required(figure, Bound::OfBefore, 1.0)));
    }
    usual
}

/// Other keys that the tuned ones need.
fn needed(case: &Case, settings: &TuneSettings) -> Vec<NeededKey> {
    let mut needed = Vec::new();
    let mut need = |key: &str, value: &str, because: &str| {
        let [key, value, because] = [key, value, because].map(str::to_owned);
        needed.push(NeededKey {
            key,
            value,
            because,
        });
    };
    if case.controller.law != Law::Firmware {
        let because = "what is tuned is judged on rung firmware";
        need("controller.law", "\"firmware\"", because);
    }
    let tunes = |path: &str| settings.keys.iter().any(|tuned| tuned.key.path() == path);
    if tunes("controller.feedback") && case.options.law.derivative != Derivative::Measurement {
        let because = "feedback \"dual\" takes its damping from the motor";
        need("controller.derivative", "\"measurement\"", because);
    }
    if tunes("backlash.compensation") {
        let motion = &case.motion;
        let because = "the backlash compensation needs room above the motion's own peaks";
        let mut need_room = |key: &str, value: f64| {
            need(key, &format!("{:?}", two_digits(value)), because);
        };
        if case.options.limits.velocity_mps.is_none() {
            need_room("limits.velocity_mps", 2.0 * motion.peak_velocity_mps());
        }
        if case.options.limits.acceleration_mps2.is_none() {
            let end_s = number::seconds(case.run.duration_ns);
            let peak_mps2 = motion.peak_acceleration_until_mps2(end_s);
            need_room("limits.acceleration_mps2", 4.0 * peak_mps2);
        }
    }
    needed
}

/// A number of two digits.
fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// The case with other gains, and where it has a cascade the one that they make.
fn with_gains(base: &Case, gains: PidGains) -> Case {
    let mut case = base.clone();
    case.controller.gains = gains;
    if case.controller.cascade.is_some() {
        case.controller.cascade = Some(cascade(&case, gains));
    }
    case
}

/// The cascade with `k·(k_v + 1/T_n) = K_p`, `k·k_v/T_n = K_i`, `k = K_d`: k_v and 1/T_n are the
/// roots of `x² − K_p/K_d·x + K_i/K_d`, the position loop the slower; of a complex pair both
/// get half the sum.
fn cascade(case: &Case, gains: PidGains) -> CascadeGains {
    let per_rad = case.output_per_rad();
    let (sum, product) = (gains.kp / gains.kd_s, gains.ki_per_s / gains.kd_s);
    let root = (0.25 * sum * sum - product).max(0.0).sqrt();
    CascadeGains {
        kv_per_s: 0.5 * sum - root,
        velocity_gain_vs_per_rad: gains.kd_s * per_rad,
        velocity_reset_s: 1.0 / (0.5 * sum + root),
    }
}

/// A variable with its range: the given one, or one from theory.
///
/// # Errors
/// The sentence that asks for a range where there is none to go by.
fn variable(tuned: TunedKey, known: &[&Case], template: &Template) -> Result<Variable, String> {
    let is_factor = is_gain(&tuned.key) || is_factor_like(&tuned);
    let span = |ends: [f64; 2]| match is_factor && ends[0] > 0.0 {
        true => Span::Log(ends),
        false => Span::Linear(ends),
    };
    let (span, origin) = match (tuned.key.key.kind, tuned.range) {
        (Kind::Choice(words), _) => (Span::Words(words), "its words"),
        (_, Some(range)) => (span(range), ""),
        (kind, None) => {
            let (range, origin) = usual_range(&tuned, known, template)?;
            (span(within(kind, range.map(two_digits))), origin)
        }
    };
    Ok(Variable {
        tuned,
        span,
        origin,
    })
}

/// The range of a number that has none of its own, and where it comes from.
///
/// # Errors
/// As [`variable`].
fn usual_range(
    tuned: &TunedKey,
    known: &[&Case],
    template: &Template,
) -> Result<([f64; 2], &'static str), String> {
    let base = template.base();
    let key = tuned.key.key;
    if is_gain(&tuned.key) {
        let values = known.iter().filter_map(|case| number_of(tuned, case));
        let values = values.filter(|value| *value > 0.0 && value.is_finite());
        let least = values.clone().reduce(f64::min);
        if let (Some(least), Some(most)) = (least, values.reduce(f64::max)) {
            let origin = "an eighth to eight times the file's value and that of the largest K_i";
            return Ok(([least / AROUND_GAIN, most * AROUND_GAIN], origin));
        }
    }
    if key.name == "derivative_filter_s"
        && let Some(period_ns) = base.controller.sample_time_ns
    {
        let longest_s = LONGEST_FILTER * number::seconds(period_ns);
        return Ok(([0.0, longest_s], "up to ten sample times"));
    }
    let (value, [least, most], origin, why) = match is_feed_forward(key) {
        true => (
            number_of(tuned, &with_plant(base)),
            [0.0, MOST_OF_PLANT],
            "up to 1.5 times the plant's value",
            ": the plant asks for none of it",
        ),
        false => (
            number_of(tuned, base).or_else(|| template.own_number(&tuned.key)),
            [1.0 / AROUND_VALUE, AROUND_VALUE],
            "half to twice the file's value",
            " and no value in the file to go by",
        ),
    };
    match value.filter(|value| *value > 0.0) {
        Some(value) => Ok(([value * least, value * most], origin)),
        None => {
            let path = tuned.path();
            Err(format!(
                "{path} has no range{why}; give one in [tune.range]"
            ))
        }
    }
}

/// True of a positive quantity whose ratios count: times and limits.
fn is_factor_like(tuned: &TunedKey) -> bool {
    tuned.element.is_none() && matches!(tuned.key.key.kind, Kind::Number(Range::Positive))
}

/// A range within what the key allows.
fn within(kind: Kind, [low, high]: [f64; 2]) -> [f64; 2] {
    match kind {
        Kind::Number(Range::Between(least, most)) => [low.max(least), high.min(most)],
        _ => [low, high],
    }
}

/// The case with all feed-forward from the plant, in numbers.
fn with_plant(base: &Case) -> Case {
    let mut case = base.clone();
    case.options.law.feed_forward = FeedForward {
        velocity_s: FeedForwardGain::Plant,
        acceleration_s2: FeedForwardGain::Plant,
        friction_codes: FeedForwardGain::Plant,
    };
    case.options.law.feed_forward = feed_forward(&case);
    case
}

/// The starts: the file's own setting, then each rule's gains; where some feed-forward is
/// tuned with the plant's, and the file's own setting once more with it.
fn rows(base: &Case, variables: &[Variable], rules: Vec<Start<Case>>) -> Vec<Start<Vec<f64>>> {
    let own = Start {
        name: "as in the file".to_owned(),
        source: "",
        with: Ok(base.clone()),
    };
    // A start outside of a range begins at its end.
    let within = |variable: &Variable, case: &Case| {
        let value = variable.of(case).unwrap_or(0.0);
        variable.within(value)
    };
    // The file's own setting is what it is, whatever the ranges are.
    let as_it_is = |variable: &Variable| {
        let value = variable.of(base);
        value.unwrap_or_else(|| within(variable, base))
    };
    let first = (own.clone()).map(|_| variables.iter().map(as_it_is).collect());
    let mut keys = variables.iter().map(|variable| variable.tuned.key.key);
    let ahead = keys.any(is_feed_forward);
    let once_more = ahead.then_some(own);
    let others = once_more.into_iter().chain(rules).map(|mut start| {
        if ahead {
            start.name += ", plant's ff";
            start = start.map(|case| with_plant(&case));
        }
        start.map(|case| variables.iter().map(|of| within(of, &case)).collect())
    });
    core::iter::once(first).chain(others).collect()
}
