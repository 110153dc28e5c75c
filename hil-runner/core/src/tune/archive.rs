//! What the settings that a search has looked at tell together: the front of the first two
//! aims, what each requirement costs, and other optima.

use super::problem::{Aim, NEARLY, Problem, Seen, is_of_loop};

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
        let is_another = |(last, _): &([f64; 2], &Seen)| {
            let alike = |k: usize| (worth[k] - last[k]).abs() <= ALIKE * last[k].abs();
            worth[1] < last[1] && !(alike(0) && alike(1))
        };
        if front.last().is_none_or(is_another) {
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
    let less_is_better = |aim: &Aim| !is_of_loop(aim.figure);
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

/// Part of a limit within which a requirement is said to bind.
const BINDS: f64 = 0.02;

/// What the requirement at a place costs, where it binds at the best setting: the best one
/// seen that misses it by no more than [`NEARLY`] and keeps all others; none that is no
/// better.
pub fn price<'s>(
    problem: &Problem,
    archive: &'s [Seen],
    best: &Seen,
    place: usize,
) -> Option<&'s Seen> {
    let value = (*best.figures.get(problem.aims.len() + place)?)?;
    if problem.requirements.get(place)?.left(value) > BINDS {
        return None;
    }
    let others_kept = |seen: &&Seen| {
        let mut missed = seen.missed.iter().enumerate();
        missed.all(|(k, missed)| *missed <= if k == place { NEARLY } else { 0.0 })
    };
    let candidates = archive.iter().filter(others_kept);
    let (_, relaxed) = candidates
        .filter_map(|seen| Some((seen.objective?, seen)))
        .min_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (relaxed.objective < best.objective && relaxed.missed[place] > 0.0).then_some(relaxed)
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
    let is_close = |end: &Seen| end.objective.is_some_and(|at| at - objective <= CLOSE);
    let ends = ends.iter().filter(|end| end.is_feasible());
    let mut close: Vec<&Seen> = ends.filter(|end| is_close(end) && far(end, best)).collect();
    close.sort_by(|a, b| a.judged().compare(&b.judged()));
    let mut others: Vec<Seen> = Vec::new();
    for end in close {
        if others.iter().all(|known| far(known, end)) {
            others.push(end.clone());
        }
    }
    others
}
