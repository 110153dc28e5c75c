//! What the settings that a search has looked at tell together: the front of the first two
//! aims, what each requirement costs, and other optima.

use super::problem::{NEARLY, Problem, Seen, is_of_loop};

/// Points of a front that are nearer to each other than this, in parts of both figures, tell
/// the same.
const ALIKE: f64 = 2e-3;

/// The feasible settings of which no other one is better in one of the first two aims and
/// no worse in the other, by the first of them; of those that tell the same the first.
pub fn unbeaten<'s>(problem: &Problem, archive: &'s [Seen]) -> Vec<&'s Seen> {
    let worth = |seen: &Seen| -> Option<[f64; 2]> {
        let of = |place: usize| {
            let more_is_better = is_of_loop(problem.aims.get(place)?.figure);
            let value = (*seen.figures.get(place)?)?;
            Some(if more_is_better { -value } else { value })
        };
        Some([of(0)?, of(1)?])
    };
    let feasible = archive.iter().filter(|seen| seen.is_feasible());
    let mut known: Vec<([f64; 2], &Seen)> = feasible
        .filter_map(|seen| Some((worth(seen)?, seen)))
        .collect();
    known.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut front: Vec<([f64; 2], &Seen)> = Vec::new();
    for (worth, seen) in known {
        let Some((last, _)) = front.last() else {
            front.push((worth, seen));
            continue;
        };
        let alike = |k: usize| (worth[k] - last[k]).abs() <= ALIKE * last[k].abs();
        if worth[1] < last[1] && !(alike(0) && alike(1)) {
            front.push((worth, seen));
        }
    }
    front.into_iter().map(|(_, seen)| seen).collect()
}

/// Height above the hull, in the logarithm of the second figure, from which a point is a dent
/// that the search has not filled.
const DENT: f64 = 5e-3;

/// Slope of the hull in logarithms at which the front ends: a per cent of one figure for half
/// of the other.
const FLAT: f64 = 0.02;

/// The front: of the settings that none beats those near their lower convex hull in the
/// logarithms of both figures, as far as a step buys anything; all of them where a figure
/// has no logarithm.
pub fn front<'s>(problem: &Problem, archive: &'s [Seen]) -> Vec<&'s Seen> {
    let all = unbeaten(problem, archive);
    let logs = |seen: &&Seen| -> Option<[f64; 2]> {
        let log = |place: usize| Some(libm::log((*seen.figures.get(place)?)?));
        Some([log(0)?, log(1)?]).filter(|logs| logs.iter().all(|log| log.is_finite()))
    };
    let less_is_better = |aim: &super::problem::Aim| !is_of_loop(aim.figure);
    let points: Option<Vec<[f64; 2]>> = all.iter().map(logs).collect();
    let points = points.filter(|_| problem.aims.iter().take(2).all(less_is_better));
    let Some(points) = points else { return all };
    let slope = |a: &[f64; 2], b: &[f64; 2]| (b[1] - a[1]) / (b[0] - a[0]);
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for point in &points {
        while let [.., a, b] = hull.as_slice()
            && slope(a, b) >= slope(b, point)
        {
            hull.pop();
        }
        hull.push(*point);
    }
    let counts = |pair: &&[[f64; 2]]| (FLAT..=1.0 / FLAT).contains(&-slope(&pair[0], &pair[1]));
    let parts: Vec<&[[f64; 2]]> = hull.windows(2).filter(counts).collect();
    let is_near = |point: &[f64; 2]| {
        parts.iter().any(|part| {
            let across = point[0] - part[0][0];
            let height = point[1] - part[0][1] - across * slope(&part[0], &part[1]);
            (part[0][0]..=part[1][0]).contains(&point[0]) && height <= DENT
        })
    };
    let near: Vec<&Seen> = (all.iter().zip(&points))
        .filter(|(_, point)| is_near(point))
        .map(|(seen, _)| *seen)
        .collect();
    if near.is_empty() { all } else { near }
}

/// What a requirement costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Price {
    /// Its place among the requirements.
    pub requirement: usize,
    /// Part of the limit by which the setting misses it that is the best without it; none
    /// where no setting seen would be better.
    pub relaxed: Option<(f64, Vec<Option<f64>>)>,
}

/// Part of a limit within which a requirement is said to bind.
const BINDS: f64 = 0.02;

/// The requirements that bind at a setting, each with the best setting seen that misses it
/// by no more than [`NEARLY`] and keeps all others.
pub fn prices(problem: &Problem, archive: &[Seen], best: &Seen) -> Vec<Price> {
    let figures = best.figures.iter().skip(problem.aims.len());
    let pairs = problem.requirements.iter().zip(figures).enumerate();
    let priced = pairs.filter_map(|(place, (required, value))| {
        if required.left((*value)?) > BINDS {
            return None;
        }
        let others_kept = |seen: &&Seen| {
            let mut missed = seen.missed.iter().enumerate();
            missed.all(|(k, missed)| *missed <= if k == place { NEARLY } else { 0.0 })
        };
        let candidates = archive.iter().filter(|seen| seen.objective.is_some());
        let relaxed = candidates
            .filter(others_kept)
            .min_by(|a, b| {
                f64::total_cmp(
                    &a.objective.unwrap_or(f64::INFINITY),
                    &b.objective.unwrap_or(f64::INFINITY),
                )
            })
            .filter(|seen| seen.objective < best.objective && seen.missed[place] > 0.0)
            .map(|seen| (seen.missed[place], seen.figures.clone()));
        Some(Price {
            requirement: place,
            relaxed,
        })
    });
    priced.collect()
}

/// Difference in the objective up to which two optima are said side by side.
const CLOSE: f64 = 0.1;

/// Distance in the unit box, and part of a figure, from which an optimum is another one: along
/// a key that hardly matters the keys differ and the figures do not.
const APART: f64 = 0.05;
const ANOTHER: f64 = 0.02;

/// Feasible settings of other searches that end nearly as well and far from the best, the
/// best of them first.
pub fn other_optima(problem: &Problem, ends: &[Seen], best: &Seen) -> Vec<Seen> {
    let Some(objective) = best.objective else {
        return Vec::new();
    };
    let far = |a: &Seen, b: &Seen| {
        let units = (problem.units(&a.values), problem.units(&b.values));
        let mut units = units.0.iter().zip(&units.1);
        let mut figures = a.figures.iter().zip(&b.figures).take(problem.aims.len());
        units.any(|(a, b)| (a - b).abs() > APART)
            && figures.any(|pair| match pair {
                (Some(a), Some(b)) => (a - b).abs() > ANOTHER * b.abs(),
                _ => true,
            })
    };
    let mut close: Vec<&Seen> = ends
        .iter()
        .filter(|end| end.is_feasible() && far(end, best))
        .filter(|end| {
            end.objective
                .is_some_and(|of_end| of_end - objective <= CLOSE)
        })
        .collect();
    close.sort_by(|a, b| a.judged().compare(&b.judged()));
    let mut others: Vec<Seen> = Vec::new();
    for end in close {
        if others.iter().all(|known| far(known, end)) {
            others.push(end.clone());
        }
    }
    others
}
