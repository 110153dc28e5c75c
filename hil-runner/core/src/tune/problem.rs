//! What a setting is worth: the worst of its figures over all corners, the objective that
//! they make, and by how much the requirements are missed.
//!
//! ```text
//! f = Σ w·ln(|figure|/limit)      of a figure of which more is better −w·ln
//! ```
//!
//! A weight is an exponent: with weights of 1 a per cent of one figure is worth a per cent of
//! the other, whatever their units and limits are.

use super::cma::Judged;
use super::variable::{Span, Variable};
use crate::case::Case;
use crate::controllers::scaling_request;
use crate::error::RunError;
use crate::figures;
use crate::options::{FeedForward, FeedForwardGain};
use crate::quantise::key;
use crate::runfile::tune_settings::{Bound, Requirement};
use crate::runfile::{KeyPath, KeyValue, Kind, Template, Value};
use crate::summary::Summary;
use crate::theory::{FamilyKey, JOINT_STATES, LoopFigures, LoopGains, Loops};

/// Makes the runs of some cases, in their order.
pub type Runner<'r> = dyn FnMut(&[Case]) -> Vec<Result<Summary, RunError>> + 'r;

/// A figure to make small, or large where more is better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// Key of the figure.
    pub figure: &'static str,
    /// Its weight.
    pub weight: f64,
    /// What it is measured in: its limit in the budget, else 1.
    pub limit: f64,
    /// What less of it is worth nothing: of a distance a count of the encoder, below which a
    /// value is where the carriage happened to stop.
    pub floor: f64,
}

/// An axis that a setting has to serve.
#[derive(Debug)]
pub struct Corner {
    /// How it differs from the file's own, such as `backlash_half_deg × 0.5`.
    pub label: String,
    /// The case with the keys that are not tuned.
    pub case: Case,
    loops: Loops,
    /// Place of the first corner with the same loops: a wider gap does not change them.
    with_loops_of: usize,
}

impl Corner {
    /// A corner.
    pub fn new(label: String, mut case: Case) -> Self {
        case.run.events = false;
        Self {
            label,
            case,
            loops: Loops::default(),
            with_loops_of: 0,
        }
    }
}

/// Keys, aims, requirements and corners of a search.
#[derive(Debug)]
pub struct Problem {
    /// The tuned keys.
    pub variables: Vec<Variable>,
    /// What the search makes small.
    pub aims: Vec<Aim>,
    /// What a setting has to keep.
    pub requirements: Vec<Requirement>,
    /// The axes, the file's own first.
    pub corners: Vec<Corner>,
    /// The case as the search begins with it: the needed keys set, on rung `firmware`.
    pub template: Template,
    /// The runs of the file's own setting on each corner.
    before: Vec<Summary>,
}

/// A setting that was looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Values of the variables.
    pub values: Vec<f64>,
    /// The worst of each figure of [`Problem::figures`] over the corners; none where no run was
    /// made or one of them has none.
    pub figures: Vec<Option<f64>>,
    /// By how much each requirement is missed, in parts of its limit; 0 where it is kept.
    pub missed: Vec<f64>,
    /// The objective; none where a figure of it is missing.
    pub objective: Option<f64>,
    /// Runs that it took.
    pub runs: u64,
}

/// Part by which a search lets a setting miss a margin and runs it all the same: it tells what
/// a requirement costs.
pub const NEARLY: f64 = 0.05;

/// What counts as missed where a figure is not there, or the firmware refuses the gains.
const MISSING: f64 = 10.0;

impl Seen {
    /// True if every requirement is kept.
    pub fn is_feasible(&self) -> bool {
        self.objective.is_some() && self.missed.iter().all(|missed| *missed <= 0.0)
    }

    /// As the search ranks it.
    pub fn judged(&self) -> Judged {
        match self.objective {
            Some(objective) if self.is_feasible() => Judged::Feasible(objective),
            Some(_) => Judged::Infeasible(self.missed.iter().sum()),
            None => Judged::Infeasible(MISSING + self.missed.iter().sum::<f64>()),
        }
    }
}

impl Problem {
    /// A problem; the aims' figures and those of the requirements are asked for in each run.
    pub fn new(
        template: Template,
        variables: Vec<Variable>,
        aims: Vec<Aim>,
        requirements: Vec<Requirement>,
        mut corners: Vec<Corner>,
    ) -> Self {
        for place in 0..corners.len() {
            let own = &corners[place].case;
            let first = corners
                .iter()
                .position(|corner| has_same_loops(&corner.case, own));
            corners[place].with_loops_of = first.unwrap_or(place);
        }
        Self {
            variables,
            aims,
            requirements,
            corners,
            before: Vec::new(),
            template,
        }
    }

    /// Makes the runs of the file's own setting on every axis.
    ///
    /// # Errors
    /// The sentence that says which axis makes no run, or has no figure that a requirement
    /// goes by. Gains that the firmware refuses may be mended.
    pub fn run_before(&mut self, run: &mut Runner<'_>) -> Result<(), String> {
        let corners = self.corners.iter();
        let cases: Vec<Case> = corners.map(|corner| corner.case.clone()).collect();
        let mut made: Vec<Summary> = Vec::new();
        for (corner, result) in self.corners.iter().zip(run(&cases)) {
            match result {
                Ok(summary) => made.push(summary),
                Err(error) if error.is_refusal() => {}
                Err(error) => return Err(format!("{}: {error}", corner.label)),
            }
        }
        self.before = made;
        let has = |figure| {
            let known = self.before.iter().filter_map(|of| of.figure(figure));
            known.count() == cases.len()
        };
        let mut goes_by = self.requirements.iter();
        match goes_by.find(|of| of.bound == Bound::OfBefore && !has(of.figure)) {
            Some(Requirement { figure, .. }) => Err(format!(
                "tune.require has {figure} <= before, and the file's own setting has no {figure}"
            )),
            None => Ok(()),
        }
    }

    /// Keys of the figures that are asked for: those of the aims, then of the requirements.
    pub fn figures(&self) -> impl Iterator<Item = &'static str> {
        let of_aims = self.aims.iter().map(|aim| aim.figure);
        of_aims.chain(self.requirements.iter().map(|required| required.figure))
    }

    /// Values of the variables at a place of the unit box.
    pub fn values(&self, units: &[f64]) -> Vec<f64> {
        let each = self.variables.iter().zip(units);
        each.map(|(of, unit)| of.value(*unit)).collect()
    }

    /// The place of values in the unit box.
    pub fn units(&self, values: &[f64]) -> Vec<f64> {
        let each = self.variables.iter().zip(values);
        each.map(|(of, value)| of.unit(*value)).collect()
    }

    /// The file's own case with values of the variables; none where they make no run.
    pub fn tuned(&self, values: &[f64]) -> Option<Case> {
        let mut case = self.corners.first()?.case.clone();
        if !self.put(values, &mut case) {
            let changes = self.changes(values);
            let changes = changes.iter().map(|(key, value)| (key, value));
            case = self.template.case(changes).ok()?;
            case.run.events = false;
        }
        Some(case)
    }

    /// Puts values into a case; false if one of them needs the whole file to be read.
    fn put(&self, values: &[f64], case: &mut Case) -> bool {
        self.variables.iter().zip(values).all(|(variable, &value)| {
            let key = variable.tuned.key;
            let value = match (variable.span, key.key.kind) {
                // A motion is planned from all of its keys.
                _ if key.section == "motion" => None,
                (Span::Words(words), _) => {
                    words.get(value as usize).map(|word| Value::Choice(word))
                }
                (_, Kind::Number(_)) => Some(Value::Number(value)),
                _ => None,
            };
            value.map(|value| key.key.set(case, value)).is_some()
        })
    }

    /// The values as a file gives them: of a list with a tuned place the whole list.
    pub fn changes(&self, values: &[f64]) -> Vec<(KeyPath, KeyValue)> {
        let mut changes: Vec<(KeyPath, KeyValue)> = Vec::new();
        let motion = &self.template.base().motion;
        let mut intervals_s = motion.intervals_s().unwrap_or_default();
        for (variable, &value) in self.variables.iter().zip(values) {
            let key = variable.tuned.key;
            let Some(element) = variable.tuned.element else {
                changes.push((key, variable.key_value(value)));
                continue;
            };
            if let Some(place) = intervals_s.get_mut(element - 1) {
                *place = value;
            }
            changes.retain(|(known, _)| known.path() != key.path());
            changes.push((key, KeyValue::Toml(format!("{intervals_s:?}"))));
        }
        changes
    }

    /// Looks at settings: margins first, then the runs of all that miss none of them by more
    /// than a part `most` of its limit.
    pub fn look(&mut self, settings: Vec<Vec<f64>>, most: f64, run: &mut Runner<'_>) -> Vec<Seen> {
        let mut cases = Vec::new();
        let mut prepared = Vec::with_capacity(settings.len());
        for values in settings {
            let first = cases.len();
            let (loops, of_setting) = self.loops(&values).unzip();
            let of_loops = |figure: &str| worst_loop(loops.as_deref()?, figure);
            let missed = self.missed(&self.of_figures(of_loops, |_| None), false);
            if missed.iter().all(|missed| *missed <= most) {
                cases.extend(of_setting.into_iter().flatten());
            }
            prepared.push((values, loops, first..cases.len()));
        }
        let made = run(&cases);
        let seen = prepared.into_iter().map(|(values, loops, places)| {
            let made = made.get(places).unwrap_or_default();
            let summaries: Option<Vec<&Summary>> =
                made.iter().map(|made| made.as_ref().ok()).collect();
            let worst = |figure: &str| match is_of_loop(figure) {
                true => worst_loop(loops.as_deref()?, figure),
                false => worst_of(summaries.as_deref()?, figure),
            };
            let of_before = |figure: &str| self.of_before(summaries.as_deref()?, figure);
            self.judge(values, self.of_figures(worst, of_before), made.len() as u64)
        });
        seen.collect()
    }

    /// Figures in the order of [`Problem::figures`].
    fn of_figures(
        &self,
        worst: impl Fn(&str) -> Option<f64>,
        of_before: impl Fn(&str) -> Option<f64>,
    ) -> Vec<Option<f64>> {
        let of_requirement = |required: &Requirement| match required.bound {
            Bound::OfBefore => of_before(required.figure),
            Bound::AtLeast | Bound::AtMost => worst(required.figure),
        };
        let of_aims = self.aims.iter().map(|aim| worst(aim.figure));
        of_aims
            .chain(self.requirements.iter().map(of_requirement))
            .collect()
    }

    /// The largest part of a figure in what it was before on the same axis.
    fn of_before(&self, summaries: &[&Summary], figure: &str) -> Option<f64> {
        let part = |(now, before): (&&Summary, &Summary)| {
            let (now, before) = (now.figure(figure)?.abs(), before.figure(figure)?.abs());
            Some(if now == before { 1.0 } else { now / before })
        };
        let parts: Option<Vec<f64>> = summaries.iter().zip(&self.before).map(part).collect();
        parts?.into_iter().reduce(f64::max)
    }

    /// Figures of the loops of every corner, of the gains in fixed point, and the cases; none
    /// where the firmware refuses one of them.
    fn loops(&mut self, values: &[f64]) -> Option<(Vec<LoopFigures>, Vec<Case>)> {
        let tuned = self.tuned(values)?;
        let mut of_corners: Vec<LoopFigures> = Vec::with_capacity(self.corners.len());
        let mut cases = Vec::with_capacity(self.corners.len());
        for corner in &mut self.corners {
            let case = with_controller_of(&corner.case, &tuned);
            let here = match of_corners.get(corner.with_loops_of) {
                Some(known) => *known,
                None => corner.loops.figures(&in_fixed_point(&case)?),
            };
            of_corners.push(here);
            cases.push(case);
        }
        Some((of_corners, cases))
    }

    /// Judges a setting by its figures, in the order of [`Problem::figures`], of which those
    /// of runs are there only if some were made.
    pub fn judge(&self, values: Vec<f64>, figures: Vec<Option<f64>>, runs: u64) -> Seen {
        Seen {
            missed: self.missed(&figures, runs > 0),
            objective: self.objective(&figures, |aim| aim.weight),
            figures,
            runs,
            values,
        }
    }

    /// The objective with other weights.
    pub fn objective(&self, figures: &[Option<f64>], weight: impl Fn(&Aim) -> f64) -> Option<f64> {
        let of = |(aim, value): (&Aim, &Option<f64>)| {
            let part = libm::log(((*value)?.max(aim.floor) / aim.limit).max(f64::MIN_POSITIVE));
            Some(if is_of_loop(aim.figure) { -part } else { part } * weight(aim))
        };
        self.aims.iter().zip(figures).map(of).sum()
    }

    /// By how much each requirement is missed; those of runs only where these were made.
    fn missed(&self, figures: &[Option<f64>], of_runs: bool) -> Vec<f64> {
        let values = figures.iter().skip(self.aims.len());
        let of = |(required, value): (&Requirement, &Option<f64>)| match value {
            Some(value) => (-required.left(*value)).max(0.0),
            None if of_runs || is_of_loop(required.figure) => MISSING,
            None => 0.0,
        };
        self.requirements.iter().zip(values).map(of).collect()
    }
}

/// An axis with the controller of another: it does not know which axis it moves, so that its
/// gains stay in codes and counts, whatever drive or mass it meets.
pub fn with_controller_of(axis: &Case, tuned: &Case) -> Case {
    let mut case = axis.clone();
    case.controller = tuned.controller;
    case.options = tuned.options;
    case.options.law.feed_forward = feed_forward(tuned);
    case.motion = tuned.motion.clone();
    case
}

/// The feed-forward of a case in numbers.
pub(super) fn feed_forward(case: &Case) -> FeedForward {
    let [velocity_s, acceleration_s2, friction_codes] =
        case.feed_forward().map(FeedForwardGain::Given);
    FeedForward {
        velocity_s,
        acceleration_s2,
        friction_codes,
    }
}

/// True of two axes whose linear loops are the same with any controller.
fn has_same_loops(a: &Case, b: &Case) -> bool {
    let same = |joint| FamilyKey::of(a, joint) == FamilyKey::of(b, joint);
    JOINT_STATES.into_iter().all(same) && LoopGains::of(a) == LoopGains::of(b)
}

/// The least of a figure over the loops that have its state of the joint; none where one of
/// them has no such figure.
fn worst_loop(loops: &[LoopFigures], figure: &str) -> Option<f64> {
    let margin = |of: &&LoopFigures| match figure.contains("_gap") {
        true => of.modulus_margin_gap,
        false => of.modulus_margin_contact,
    };
    let with_state = loops.iter().filter(|of| margin(of).is_some());
    let values: Option<Vec<f64>> = with_state.map(|of| of.figure(figure)).collect();
    values?.into_iter().reduce(f64::min)
}

/// The largest magnitude of a figure of some runs.
fn worst_of(summaries: &[&Summary], figure: &str) -> Option<f64> {
    let values: Option<Vec<f64>> = summaries.iter().map(|of| of.figure(figure)).collect();
    values?.into_iter().map(f64::abs).reduce(f64::max)
}

/// True of a figure of the loop, which takes no run, and of which more is better.
pub fn is_of_loop(key: &str) -> bool {
    figures::find(key).is_some_and(|figure| figure.at_least)
}

/// The case with the gains that its fixed-point gains stand for; none where the firmware
/// refuses them.
fn in_fixed_point(case: &Case) -> Option<Case> {
    let mut exact = case.clone();
    let law = scaling_request(case).ok()?.scaled_law().ok()?;
    for gain in law.fixed_point().rows {
        let gains = &mut exact.controller.gains;
        let place = match key(gain.part) {
            "controller.kp" => &mut gains.kp,
            "controller.ki_per_s" => &mut gains.ki_per_s,
            "controller.kd_s" => &mut gains.kd_s,
            _ => continue,
        };
        *place *= 1.0 + gain.relative_error();
    }
    Some(exact)
}
