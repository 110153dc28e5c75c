//! What a tune tells: keys, starts, requirements, front and all that the settings seen have
//! to say, in rows that a terminal, a page and a script show alike.

use serde::Serialize;

use super::archive::{self, front, other_optima};
use super::prepare::{NeededKey, Prepared};
use super::problem::{Problem, Seen};
use super::search::Found;
use super::start::Start;
use super::variable::Variable;
use crate::budget::{Verdict, judged};
use crate::case::{Case, Limit};
use crate::error::RunError;
use crate::runfile::tune_settings::{Bound, Requirement};
use crate::summary::Summary;

/// Everything that a tune tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TuneOutcome {
    /// Name of the case.
    pub name: String,
    /// Settings looked at, and runs made for them.
    pub settings: u64,
    /// Simulated runs.
    pub runs: u64,
    /// Seed of the search.
    pub seed: u64,
    /// True if the setting keeps every requirement.
    pub feasible: bool,
    /// The tuned keys.
    pub keys: Vec<KeyRow>,
    /// Keys that are set besides.
    pub needed: Vec<NeededKey>,
    /// The axes that the setting has to serve.
    pub corners: Vec<String>,
    /// The figures that the search makes small.
    pub aims: Vec<AimRow>,
    /// The requirements.
    pub requirements: Vec<RequirementRow>,
    /// The starts.
    pub starts: Vec<StartReport>,
    /// The front of the first two aims, by the first.
    pub front: Vec<Point>,
    /// Optima of other searches that are nearly as good.
    pub others: Vec<Point>,
    /// Change of each aim for a key that is a tenth smaller or larger.
    pub sensitivity: Vec<SensitivityRow>,
    /// Yield on axes drawn from the tolerance, before and after.
    pub tolerance: Option<Tolerance>,
}

/// A tuned key.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeyRow {
    /// Its path.
    pub key: String,
    /// Its unit.
    pub unit: &'static str,
    /// Lowest and highest value, numbers or words.
    pub range: [String; 2],
    /// Where the range comes from; empty where the file gives it.
    pub origin: &'static str,
    /// The value before and after, as a file has it.
    pub before: String,
    /// See `before`.
    pub after: String,
}

/// A figure that the search makes small, or large where more is better.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AimRow {
    /// Its key.
    pub figure: &'static str,
    /// Its weight.
    pub weight: f64,
    /// The worst over the corners before and after; none where there is none.
    pub before: Option<f64>,
    /// See `before`.
    pub after: Option<f64>,
}

/// A requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RequirementRow {
    /// Key of the figure.
    pub figure: &'static str,
    /// True if the limit is a least value.
    pub at_least: bool,
    /// True if limit and values are parts of what the figure was before on the same axis.
    pub of_before: bool,
    /// The limit.
    pub limit: f64,
    /// The worst over the corners before and after.
    pub before: Option<f64>,
    /// See `before`.
    pub after: Option<f64>,
    /// True if it is kept.
    pub kept: bool,
    /// What a part of the limit less would buy, where it binds.
    pub price: Option<PriceRow>,
    /// The value that it would have to give way to for all others to be kept; of a tune
    /// without a feasible setting.
    pub gives_way_at: Option<f64>,
}

/// What a requirement costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriceRow {
    /// Part of the limit that is given up.
    pub relaxed_by: f64,
    /// Change of each aim, in its unit.
    pub change: Vec<Option<f64>>,
}

/// A start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartReport {
    /// Its name.
    pub name: String,
    /// Where it comes from.
    pub source: &'static str,
    /// Why there is none.
    pub none: Option<String>,
    /// The setting.
    pub point: Option<Point>,
}

/// A setting: its keys, the aims' figures, and those of the requirements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// Values of the keys, as a file has them.
    pub values: Vec<String>,
    /// The aims' figures.
    pub aims: Vec<Option<f64>>,
    /// The requirements' figures.
    pub requirements: Vec<Option<f64>>,
    /// True if all requirements are kept.
    pub feasible: bool,
}

/// How the aims follow a key.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensitivityRow {
    /// Its path.
    pub key: String,
    /// Change of each aim for a value that is a tenth smaller, and a tenth larger \[%\]; none
    /// where that makes no run.
    pub change_percent: Vec<[Option<f64>; 2]>,
    /// Keys of the requirements that the smaller value breaks, and the larger one.
    pub breaks: [Vec<&'static str>; 2],
}

/// Yield on axes drawn from the tolerance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tolerance {
    /// Axes drawn.
    pub axes: usize,
    /// What they are drawn from, a key each.
    pub drawn: Vec<String>,
    /// Parts that keep all requirements and all limits of the budget, before and after \[%\].
    pub yield_percent: [f64; 2],
    /// The same of each requirement and each limit.
    pub each: Vec<ToleranceRow>,
}

/// The yield in one figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToleranceRow {
    /// Its key.
    pub figure: &'static str,
    /// True if the limit is a least value.
    pub at_least: bool,
    /// The limit.
    pub limit: f64,
    /// Parts of the axes that keep it, before and after \[%\].
    pub kept_percent: [f64; 2],
    /// The value that 95 of 100 axes keep, before and after.
    pub of_95: [Option<f64>; 2],
}

impl TuneOutcome {
    /// All that is to be told of a search.
    pub fn new(
        prepared: &Prepared,
        found: &Found,
        seed: u64,
        tolerance: Option<Tolerance>,
    ) -> Self {
        let Prepared {
            problem,
            starts,
            needed,
        } = prepared;
        let Found { best, archive, .. } = found;
        let points = |seen: Vec<&Seen>| seen.into_iter().map(|seen| point(problem, seen)).collect();
        let others = other_optima(problem, &found.ends, best);
        Self {
            name: problem.template.base().name.clone(),
            settings: archive.len() as u64,
            runs: archive.iter().map(|seen| seen.runs).sum(),
            seed,
            feasible: best.is_feasible(),
            keys: keys(problem, &found.own, best),
            needed: needed.clone(),
            corners: (problem.corners.iter())
                .map(|corner| corner.label.clone())
                .collect(),
            aims: (problem.aims.iter().enumerate())
                .map(|(place, aim)| AimRow {
                    figure: aim.figure,
                    weight: aim.weight,
                    before: figure(&found.own, place),
                    after: figure(best, place),
                })
                .collect(),
            requirements: requirements(problem, found),
            starts: (starts.iter())
                .map(|start| start_report(problem, found, start))
                .collect(),
            front: points(front(problem, archive)),
            others: points(others.iter().collect()),
            sensitivity: (found.sides.iter())
                .map(|(place, sides)| sensitivity(problem, best, *place, sides))
                .collect(),
            tolerance,
        }
    }
}

/// A figure of a setting by its place.
fn figure(seen: &Seen, place: usize) -> Option<f64> {
    *seen.figures.get(place)?
}

/// The requirements, with what those cost that bind, or where they would have to give way.
fn requirements(problem: &Problem, found: &Found) -> Vec<RequirementRow> {
    let Found { best, archive, .. } = found;
    let row = |(place, required): (usize, &Requirement)| {
        let at = problem.aims.len() + place;
        let price = |relaxed: &Seen| {
            let change = |aim: usize| Some(figure(relaxed, aim)? - figure(best, aim)?);
            PriceRow {
                relaxed_by: relaxed.missed[place],
                change: (0..problem.aims.len()).map(change).collect(),
            }
        };
        RequirementRow {
            figure: required.figure,
            at_least: required.bound == Bound::AtLeast,
            of_before: required.bound == Bound::OfBefore,
            limit: required.limit,
            before: figure(&found.own, at),
            after: figure(best, at),
            kept: figure(best, at).is_some_and(|value| required.left(value) >= 0.0),
            price: archive::price(problem, archive, best, place).map(price),
            gives_way_at: match best.is_feasible() {
                true => None,
                false => way_out(problem, archive, place),
            },
        }
    };
    problem.requirements.iter().enumerate().map(row).collect()
}

/// A start as it is shown.
fn start_report(problem: &Problem, found: &Found, start: &Start<Vec<f64>>) -> StartReport {
    let values = start.with.as_ref().ok();
    let seen = values.and_then(|values| found.starts.iter().find(|seen| seen.values == *values));
    let refused = seen.is_some_and(|seen| seen.figures.iter().all(Option::is_none));
    StartReport {
        name: start.name.clone(),
        source: start.source,
        none: match &start.with {
            Err(why) => Some(why.clone()),
            Ok(_) => refused.then(|| "the firmware refuses its gains".to_owned()),
        },
        point: seen.map(|seen| point(problem, seen)),
    }
}

/// What a key that is a tenth smaller, and a tenth larger, does, in runs.
fn sensitivity(problem: &Problem, best: &Seen, place: usize, sides: &[Seen; 2]) -> SensitivityRow {
    let change = |aim: usize| {
        sides.each_ref().map(|side| {
            let change = 100.0 * (figure(side, aim)? / figure(best, aim)? - 1.0);
            change.is_finite().then_some(change)
        })
    };
    let breaks = sides.each_ref().map(|side| {
        let requirements = problem.requirements.iter().zip(&side.missed);
        let broken = requirements.filter(|(_, missed)| **missed > 0.0);
        broken.map(|(required, _)| required.figure).collect()
    });
    SensitivityRow {
        key: problem.variables[place].path(),
        change_percent: (0..problem.aims.len()).map(change).collect(),
        breaks,
    }
}

/// Where a requirement would have to give way: the best of its figure among the settings that
/// keep all others.
fn way_out(problem: &Problem, archive: &[Seen], place: usize) -> Option<f64> {
    let others_kept = |seen: &&Seen| {
        let requirements = seen.figures.iter().skip(problem.aims.len());
        let mut each = seen.missed.iter().zip(requirements).enumerate();
        each.all(|(k, (missed, figure))| k == place || *missed <= 0.0 && figure.is_some())
    };
    let at = problem.aims.len() + place;
    let values = archive
        .iter()
        .filter(others_kept)
        .filter_map(|seen| *seen.figures.get(at)?);
    match problem.requirements.get(place)?.bound {
        Bound::AtLeast => values.reduce(f64::max),
        Bound::AtMost | Bound::OfBefore => values.map(f64::abs).reduce(f64::min),
    }
}

/// Values of the keys, as a file has them.
fn values(problem: &Problem, seen: &Seen) -> Vec<String> {
    let values = problem.variables.iter().zip(&seen.values);
    let shown = values.map(|(variable, value)| variable.key_value(*value).to_toml());
    shown.collect()
}

fn keys(problem: &Problem, own: &Seen, best: &Seen) -> Vec<KeyRow> {
    let values = values(problem, own).into_iter().zip(values(problem, best));
    let rows = problem.variables.iter().zip(values);
    let row = |(variable, (before, after)): (&Variable, _)| KeyRow {
        key: variable.path(),
        unit: variable.tuned.key.key.unit,
        range: (variable.ends()).map(|end| variable.key_value(end).to_toml()),
        origin: variable.origin,
        before,
        after,
    };
    rows.map(row).collect()
}

/// A setting as it is shown.
fn point(problem: &Problem, seen: &Seen) -> Point {
    let (aims, requirements) = seen.figures.split_at(problem.aims.len());
    Point {
        values: values(problem, seen),
        aims: aims.to_vec(),
        requirements: requirements.to_vec(),
        feasible: seen.is_feasible(),
    }
}

/// The yield of the runs of some axes, before and after, in the requirements and the limits
/// of the budget.
pub fn tolerance(
    problem: &Problem,
    case: &Case,
    drawn: Vec<String>,
    runs: [Vec<&Result<Summary, RunError>>; 2],
) -> Tolerance {
    let requirements = problem.requirements.iter();
    let of_requirements = requirements.filter(|required| required.bound != Bound::OfBefore);
    let mut limits: Vec<Limit> = of_requirements
        .map(|required| Limit::new(required.figure, required.limit))
        .collect();
    for limit in judged(case).0 {
        if !limits.contains(&limit) {
            limits.push(limit);
        }
    }
    let keeps = |summary: &Summary, limit: &Limit| {
        Verdict::new(limit, summary.figure(limit.figure), false).pass
    };
    let percent = |kept: &dyn Fn(&Summary) -> bool| {
        runs.each_ref().map(|runs| {
            let made = runs.iter().filter(|run| run.as_ref().is_ok_and(kept));
            100.0 * made.count() as f64 / runs.len().max(1) as f64
        })
    };
    let row = |limit: &Limit| ToleranceRow {
        figure: limit.figure,
        at_least: limit.is_least(),
        limit: limit.limit,
        kept_percent: percent(&|summary| keeps(summary, limit)),
        of_95: (runs.each_ref()).map(|runs| of_95(runs, limit.figure, limit.is_least())),
    };
    Tolerance {
        axes: runs[0].len(),
        drawn,
        yield_percent: percent(&|summary| limits.iter().all(|limit| keeps(summary, limit))),
        each: limits.iter().map(row).collect(),
    }
}

/// The value that 95 of 100 runs keep: nearest rank, runs without the figure the worst.
fn of_95(runs: &[&Result<Summary, RunError>], figure: &str, at_least: bool) -> Option<f64> {
    let made = runs.iter().filter_map(|run| run.as_ref().ok());
    let values = made.filter_map(|summary| summary.figure(figure));
    let mut values: Vec<f64> = match at_least {
        true => values.map(|value| -value).collect(),
        false => values.map(f64::abs).collect(),
    };
    values.sort_by(f64::total_cmp);
    let rank = (95 * runs.len()).div_ceil(100);
    let value = *values.get(rank.checked_sub(1)?)?;
    Some(if at_least { -value } else { value })
}
