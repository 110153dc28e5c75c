//! From a run file and what `[tune]` asks for to a problem with its starts: ranges, other keys
//! that a tuned one needs, requirements that hold for the axis.

use super::corners::corners;
use super::problem::{Aim, Problem, is_of_loop};
use super::start::starts;
use super::variable::{Span, Variable, is_feed_forward, is_gain};
use crate::budget::limits;
use crate::case::{CascadeGains, Case, Law};
use crate::number;
use crate::options::{Derivative, FeedForward, FeedForwardGain};
use crate::runfile::tune_settings::{Bound, Requirement, TuneSettings, TunedKey};
use crate::runfile::{KeyPath, KeyValue, Kind, Range, RunFileErrors, Template};
use crate::theory::{JointState, no_figure, no_loop};

use plant::PidGains;

/// A start of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct StartRow {
    /// Its name.
    pub name: String,
    /// Where it comes from.
    pub source: String,
    /// Values of the variables, or why there are none.
    pub values: Result<Vec<f64>, String>,
}

/// Another key that a tuned one needs.
#[derive(Debug, Clone)]
pub struct NeededKey {
    /// The key.
    pub key: KeyPath,
    /// Its value.
    pub value: KeyValue,
    /// The sentence that says why.
    pub because: String,
}

/// A tune that can begin.
#[derive(Debug)]
pub struct Prepared {
    /// The problem.
    pub problem: Problem,
    /// Its starts, the file's own first.
    pub starts: Vec<StartRow>,
    /// Keys that are set besides the tuned ones.
    pub needed: Vec<NeededKey>,
    /// The case as the search begins with it: the needed keys set, on rung `firmware`.
    pub template: Template,
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
    sets.extend(
        needed
            .iter()
            .map(|need| format!("{}={}", need.key.path(), need.value.to_toml())),
    );
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
        let mut required = requirements
            .iter()
            .filter(|required| required.figure == figure);
        required
            .find(|required| required.bound == Bound::AtLeast)
            .map(|required| required.limit)
    });
    let rules: Vec<Rule> = (starts(base, least).into_iter())
        .map(|rule| Rule {
            name: rule.name,
            source: rule.source,
            case: rule.gains.map(|gains| with_gains(base, gains)),
        })
        .collect();

    // Kessler's and the relay's gains may be far off: the ranges are those around the file's
    // own and the largest K_i, the first of the rules.
    let largest_ki = rules.first().and_then(|rule| rule.case.as_ref().ok());
    let known: Vec<&Case> = core::iter::once(base).chain(largest_ki).collect();
    let variables = settings
        .keys
        .iter()
        .map(|tuned| variable(*tuned, &known, &template));
    let variables: Vec<Variable> = variables
        .collect::<Result<_, String>>()
        .map_err(TuneError::Sentence)?;

    let budget = limits(base).0;
    let gear = &base.axis.transmission;
    let count_m = gear.screw_pitch_m_per_rad * gear.gear_ratio / base.encoder.counts_per_rad;
    let aim = |aim: &crate::runfile::tune_settings::Objective| {
        let limit = budget.iter().find(|limit| limit.figure == aim.figure);
        Aim {
            figure: aim.figure,
            weight: aim.weight,
            limit: limit
                .map(|limit| limit.limit)
                .filter(|limit| *limit > 0.0)
                .unwrap_or(1.0),
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
    let starts = rows(base, &variables, rules);
    let problem = Problem::new(template.clone(), variables, aims, requirements, corners);
    Ok(Prepared {
        problem,
        starts,
        needed,
        template,
    })
}

/// The requirements, the usual ones where none are given: those of loops that the case has,
/// and over several axes that no aim gets worse on any of them.
fn requirements(base: &Case, settings: &TuneSettings) -> Vec<Requirement> {
    if let Some(given) = &settings.require {
        return given.clone();
    }
    let least = |figure, limit| Requirement {
        figure,
        bound: Bound::AtLeast,
        limit,
    };
    let most = |figure, limit| Requirement {
        figure,
        bound: Bound::AtMost,
        limit,
    };
    let mut usual = vec![least("modulus_margin_contact", 0.5)];
    if no_loop(base, JointState::Gap).is_none() {
        usual.push(least("modulus_margin_gap", 0.3));
    }
    usual.push(most("voltage_saturated_s", 0.0));
    usual.push(most("rest_ripple_um", 10.0));
    if !settings.over.is_empty() {
        let aims = settings
            .minimise
            .iter()
            .filter(|aim| !is_of_loop(aim.figure));
        usual.extend(aims.map(|aim| Requirement {
            figure: aim.figure,
            bound: Bound::OfBefore,
            limit: 1.0,
        }));
    }
    usual
}

/// Other keys that the tuned ones need.
fn needed(case: &Case, settings: &TuneSettings) -> Vec<NeededKey> {
    let mut needed = Vec::new();
    let mut need = |path: &str, value: KeyValue, because: String| {
        if let Ok(key) = KeyPath::find(path) {
            needed.push(NeededKey {
                key,
                value,
                because,
            });
        }
    };
    let word = |word: &str| KeyValue::Toml(format!("\"{word}\""));
    let law = case.controller.law;
    if law != Law::Firmware {
        let because = "what is tuned is judged on rung firmware".to_owned();
        need("controller.law", word("firmware"), because);
    }
    let tunes = |path: &str| settings.keys.iter().any(|tuned| tuned.key.path() == path);
    if tunes("controller.feedback") && case.options.law.derivative != Derivative::Measurement {
        let because = "feedback \"dual\" takes its damping from the motor".to_owned();
        need("controller.derivative", word("measurement"), because);
    }
    if tunes("backlash.compensation") {
        let motion = &case.motion;
        let because =
            || "the backlash compensation needs room above the motion's own peaks".to_owned();
        if case.options.limits.velocity_mps.is_none() {
            let value = KeyValue::Number(two_digits(2.0 * motion.peak_velocity_mps()));
            need("limits.velocity_mps", value, because());
        }
        if case.options.limits.acceleration_mps2.is_none() {
            let end_s = number::seconds(case.run.duration_ns);
            let value = 4.0 * motion.peak_acceleration_until_mps2(end_s);
            need(
                "limits.acceleration_mps2",
                KeyValue::Number(two_digits(value)),
                because(),
            );
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
    let base = template.base();
    let key = tuned.key.key;
    if let Kind::Choice(words) = key.kind {
        return Ok(Variable {
            tuned,
            span: Span::Words(words),
            origin: "its words".to_owned(),
        });
    }
    let logarithmic = is_gain(&tuned.key) || is_factor_like(&tuned);
    let span = |[low, high]: [f64; 2]| match logarithmic && low > 0.0 {
        true => Span::Log { low, high },
        false => Span::Linear { low, high },
    };
    if let Some(range) = tuned.range {
        return Ok(Variable {
            tuned,
            span: span(range),
            origin: String::new(),
        });
    }
    let bare = Variable {
        tuned,
        span: Span::Linear {
            low: 0.0,
            high: 1.0,
        },
        origin: String::new(),
    };
    let found = |range: [f64; 2], origin: &str| {
        let range = within(key.kind, range.map(two_digits));
        Ok(Variable {
            tuned,
            span: span(range),
            origin: origin.to_owned(),
        })
    };
    if is_gain(&tuned.key) {
        let values = known.iter().filter_map(|case| bare.of(case));
        let values: Vec<f64> = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .collect();
        let least = values.iter().copied().reduce(f64::min);
        let most = values.iter().copied().reduce(f64::max);
        if let (Some(least), Some(most)) = (least, most) {
            let origin = "an eighth to eight times the file's value and that of the largest K_i";
            return found([least / AROUND_GAIN, most * AROUND_GAIN], origin);
        }
    }
    if is_feed_forward(key) {
        let of_plant = bare
            .of(&with_plant(base))
            .filter(|of_plant| *of_plant > 0.0);
        let Some(of_plant) = of_plant else {
            return Err(format!(
                "{} has no range: the plant asks for none of it; give one in [tune.range]",
                tuned.path()
            ));
        };
        return found(
            [0.0, MOST_OF_PLANT * of_plant],
            "up to 1.5 times the plant's value",
        );
    }
    if key.name == "derivative_filter_s"
        && let Some(period_ns) = base.controller.sample_time_ns
    {
        return found(
            [0.0, LONGEST_FILTER * number::seconds(period_ns)],
            "up to ten sample times",
        );
    }
    let own = bare.of(base).or_else(|| template.own_number(&tuned.key));
    match own.filter(|own| *own > 0.0) {
        Some(own) => found(
            [own / AROUND_VALUE, own * AROUND_VALUE],
            "half to twice the file's value",
        ),
        None => Err(format!(
            "{} has no range and no value in the file to go by; give one in [tune.range]",
            tuned.path()
        )),
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
    let all = [FeedForwardGain::Plant; 3];
    let [velocity_s, acceleration_s2, friction_codes] = all;
    case.options.law.feed_forward = FeedForward {
        velocity_s,
        acceleration_s2,
        friction_codes,
    };
    let [velocity_s, acceleration_s2, friction_codes] =
        case.feed_forward().map(FeedForwardGain::Given);
    case.options.law.feed_forward = FeedForward {
        velocity_s,
        acceleration_s2,
        friction_codes,
    };
    case
}

/// A rule, and the case with its gains, or why it has none.
struct Rule {
    name: &'static str,
    source: &'static str,
    case: Result<Case, String>,
}

/// The starts: the file's own setting, then each rule's gains; where some feed-forward is
/// tuned with the plant's, and the file's own setting once more with it.
fn rows(base: &Case, variables: &[Variable], rules: Vec<Rule>) -> Vec<StartRow> {
    const OWN: &str = "as in the file";
    // A start outside of a range begins at its end.
    let within = |variable: &Variable, case: &Case| {
        let value = variable.of(case).unwrap_or(0.0);
        variable.within(value)
    };
    // The file's own setting is what it is, whatever the ranges are.
    let own = |variable: &Variable| {
        let value = variable.of(base);
        value.unwrap_or_else(|| within(variable, base))
    };
    let mut rows = vec![StartRow {
        name: OWN.to_owned(),
        source: String::new(),
        values: Ok(variables.iter().map(own).collect()),
    }];
    let mut variables_ahead = variables.iter().map(|variable| variable.tuned.key.key);
    let ahead = variables_ahead.any(is_feed_forward);
    let once_more = ahead.then(|| Rule {
        name: OWN,
        source: "",
        case: Ok(base.clone()),
    });
    for Rule { name, source, case } in once_more.into_iter().chain(rules) {
        let (name, case) = match ahead {
            true => (
                format!("{name}, plant's ff"),
                case.map(|case| with_plant(&case)),
            ),
            false => (name.to_owned(), case),
        };
        let values = |case: &Case| variables.iter().map(|of| within(of, case)).collect();
        rows.push(StartRow {
            name,
            source: source.to_owned(),
            values: case.as_ref().map(values).map_err(Clone::clone),
        });
    }
    rows
}
