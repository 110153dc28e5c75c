//! From starts to a setting of a few digits: CMA-ES with restarts, other weights for the
//! front, and a descent on the grid of decimals.
//!
//! Everything that is looked at goes through one call, in an order that seed and answers
//! alone decide: answers that are known from before take the place of runs, and the search
//! goes on where it ended.

use super::archive::unbeaten;
use super::cma::{Cma, Judged, Restarts, default_population, rank};
use super::problem::{Aim, NEARLY, Problem, Seen};
use super::variable::{Span, Variable};

/// Looks at settings, each with the values of all variables; those that miss a margin by
/// more than this part are not run.
pub type Look<'l, E> = dyn FnMut(&mut Problem, Vec<Vec<f64>>, f64) -> Result<Vec<Seen>, E> + 'l;

/// Outcome of a search.
#[derive(Debug, Clone)]
pub struct Found {
    /// The best setting in decimals of the keys' digits: the last of the archive that no
    /// other one beats.
    pub best: Seen,
    /// The starts, in their order, the file's own first.
    pub starts: Vec<Seen>,
    /// The file's own setting.
    pub own: Seen,
    /// Every setting that was looked at, in order.
    pub archive: Vec<Seen>,
    /// The best setting of each search of the restarts.
    pub ends: Vec<Seen>,
    /// The best setting with one key [`SIDE`] smaller and larger: place of the key, both.
    pub sides: Vec<(usize, [Seen; 2])>,
}

/// Population of a search, rounded up to what fills the lanes of two threads.
const LANES: usize = 16;

/// Settings looked at for each run that the search may make, at most: those whose margins
/// are too small take none.
const SETTINGS_A_RUN: u64 = 4;

/// Part of the runs for the search itself; the rest is for the front.
const FOR_SEARCH: f64 = 0.6;

/// Gaps of the front that are searched.
const GAPS: usize = 8;

/// Standard deviation of a search with other weights, of the box's side.
const NEAR: f64 = 0.1;

/// Descents on the grid at most.
const MOST_DESCENTS: usize = 16;

/// The least runs with which a search can begin: a few populations.
pub fn fewest_runs(problem: &Problem) -> u64 {
    (10 * population(problem) * problem.corners.len()) as u64
}

fn population(problem: &Problem) -> usize {
    default_population(problem.variables.len()).next_multiple_of(LANES)
}

/// Distance in the unit box to which each variable is moved alone to see whether it acts.
const PROBED: f64 = 0.2;

/// The first start of which runs were made, each variable moved alone.
pub fn probes(problem: &Problem, starts: &[Seen]) -> Vec<Vec<f64>> {
    let Some(from) = starts.iter().find(|seen| seen.runs > 0) else {
        return Vec::new();
    };
    let moved = problem.variables.iter().enumerate().map(|(k, variable)| {
        let mut values = from.values.clone();
        let unit = variable.unit(values[k]);
        values[k] = match variable.span {
            Span::Words(words) => (values[k] + 1.0) % words.len() as f64,
            _ if unit < 0.5 => variable.value(unit + PROBED),
            _ => variable.value(unit - PROBED),
        };
        values
    });
    moved.collect()
}

/// The sentence about a key that moves none of the figures, or an aim that no key moves.
pub fn idle(problem: &Problem, starts: &[Seen], probed: &[Seen]) -> Option<String> {
    let from = starts.iter().find(|seen| seen.runs > 0)?;
    let pairs = problem.variables.iter().zip(probed);
    let made: Vec<(&Variable, &Seen)> = pairs.filter(|(_, seen)| seen.runs > 0).collect();
    if let Some((variable, _)) = made.iter().find(|(_, seen)| seen.figures == from.figures) {
        return Some(format!(
            "tune.keys has {}, which moves none of the figures that are asked for: it does not act \
             on this case",
            variable.path()
        ));
    }
    let stands = |place: usize| {
        let mut seen = made.iter().map(|(_, seen)| seen.figures[place]);
        seen.all(|figure| figure == from.figures[place])
    };
    let mut aims = problem.aims.iter().enumerate();
    let (_, aim) = aims.find(|(place, _)| !made.is_empty() && stands(*place))?;
    let figure = aim.figure;
    Some(format!(
        "tune.minimise has {figure}, which no key of tune.keys moves"
    ))
}

/// Searches from the file's own setting and other starts that were looked at, within about
/// so many runs.
///
/// # Errors
/// Those of `look`.
pub fn search<E>(
    problem: &mut Problem,
    (own, starts): (Seen, Vec<Seen>),
    [runs, seed]: [u64; 2],
    look: &mut Look<'_, E>,
) -> Result<Found, E> {
    let mut archive = starts.clone();
    let spent = |archive: &[Seen]| archive.iter().map(|seen| seen.runs).sum::<u64>();
    let first = best_of(&archive).unwrap_or(&own).clone();
    let settings = SETTINGS_A_RUN * runs / problem.corners.len().max(1) as u64;
    let settings = usize::try_from(settings).unwrap_or(usize::MAX);
    let from = problem.units(&first.values);
    let mut restarts = Restarts::new(&from, population(problem), settings, seed);
    let for_search = (FOR_SEARCH * runs as f64) as u64;
    let mut found = archive.iter().any(Seen::is_feasible);
    // Without a setting that keeps all requirements there is no front to look for.
    while spent(&archive) < if found { for_search } else { runs } {
        let Some(asked) = restarts.ask() else { break };
        let values = asked.iter().map(|units| problem.values(units)).collect();
        let seen = look(problem, values, NEARLY)?;
        restarts.tell(&seen.iter().map(Seen::judged).collect::<Vec<_>>());
        found |= seen.iter().any(Seen::is_feasible);
        archive.extend(seen);
    }

    if problem.aims.len() > 1 {
        let mut searched: Vec<[Vec<f64>; 2]> = Vec::new();
        for turn in 0..GAPS {
            let until = for_search + (runs - for_search) * (turn as u64 + 1) / GAPS as u64;
            let Some(Gap { ends, share }) = widest_gap(problem, &archive, &searched) else {
                break;
            };
            let [a, b] = ends.each_ref().map(|values| problem.units(values));
            let middle: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
            searched.push(ends);
            let seed = seed.wrapping_add(1 + turn as u64);
            let mut cma = Cma::new(&middle, NEAR, population(problem), seed);
            let mut left = settings / GAPS;
            while spent(&archive) < until && left > 0 {
                let asked = cma.ask();
                left = left.saturating_sub(asked.len());
                let values = asked.iter().map(|units| problem.values(units)).collect();
                let seen = look(problem, values, NEARLY)?;
                let judged: Vec<Judged> = seen
                    .iter()
                    .map(|seen| reweighted(problem, seen, share))
                    .collect();
                cma.tell(&rank(&judged));
                archive.extend(seen);
            }
        }
    }

    let from = best_of(&archive).unwrap_or(&first).clone();
    let best = descend(problem, &from, &mut archive, look)?;
    let end = |(units, _): &(Vec<f64>, Judged)| {
        let values = problem.values(units);
        archive.iter().find(|seen| seen.values == values).cloned()
    };
    let ends = restarts.bests().filter_map(end).collect();
    let sides = sides(problem, &best, look)?;
    Ok(Found {
        best,
        starts,
        own,
        archive,
        ends,
        sides,
    })
}

/// Part by which a key is moved to show what it does.
pub const SIDE: f64 = 0.1;

/// A setting with each key moved alone, in runs: a fit through settings seen elsewhere would tell
/// of another place, since figures bend and jump around an optimum.
fn sides<E>(
    problem: &mut Problem,
    best: &Seen,
    look: &mut Look<'_, E>,
) -> Result<Vec<(usize, [Seen; 2])>, E> {
    let is_number = |variable: &Variable| !matches!(variable.span, Span::Words(_));
    let moved: Vec<usize> = (problem.variables.iter().zip(&best.values).enumerate())
        .filter(|(_, (variable, value))| is_number(variable) && **value != 0.0)
        .map(|(place, _)| place)
        .collect();
    let values = moved.iter().flat_map(|&place| {
        [1.0 - SIDE, 1.0 + SIDE].map(|factor| {
            let mut values = best.values.clone();
            values[place] *= factor;
            values
        })
    });
    let values = values.collect();
    let mut seen = look(problem, values, f64::INFINITY)?.into_iter();
    let pairs = moved
        .into_iter()
        .filter_map(|place| Some((place, [seen.next()?, seen.next()?])));
    Ok(pairs.collect())
}

/// Two neighbours of the front, and the share of the first aim's weight with which both are
/// worth the same: the least of that sum lies between them where the front is convex (Kim and
/// de Weck, "Adaptive weighted-sum method for bi-objective optimization", 2005).
struct Gap {
    ends: [Vec<f64>; 2],
    share: f64,
}

/// The widest gap of the front in the logarithms of both figures, each in parts of its whole
/// span and as much less as its objective is worse than the best one, but for those that
/// have been searched.
fn widest_gap(problem: &Problem, archive: &[Seen], searched: &[[Vec<f64>; 2]]) -> Option<Gap> {
    let logs = |seen: &Seen| -> Option<[f64; 2]> {
        let log = |place: usize| Some(libm::log((*seen.figures.get(place)?)?.abs()));
        Some([log(0)?, log(1)?])
    };
    let points: Vec<([f64; 2], &Seen)> = (unbeaten(problem, archive).into_iter())
        .filter_map(|seen| Some((logs(seen)?, seen)))
        .filter(|(logs, _)| logs.iter().all(|log| log.is_finite()))
        .collect();
    let (first, last) = (points.first()?.0, points.last()?.0);
    let span = [0, 1].map(|k| (last[k] - first[k]).abs().max(f64::MIN_POSITIVE));
    let objective = |seen: &Seen| seen.objective.unwrap_or(f64::INFINITY);
    let best = points
        .iter()
        .map(|(_, seen)| objective(seen))
        .reduce(f64::min)?;
    let gaps = points.windows(2).filter_map(|pair| {
        let [(a, one), (b, other)] = pair else {
            return None;
        };
        let ends = [one.values.clone(), other.values.clone()];
        let across = [0, 1].map(|k| (b[k] - a[k]).abs());
        let worse = objective(one).min(objective(other)) - best;
        let width = libm::hypot(across[0] / span[0], across[1] / span[1]) * libm::exp(-worse);
        (!searched.contains(&ends)).then_some((width, across, ends))
    });
    let (_, across, ends) = gaps.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let [first, second] = [0, 1].map(|k| problem.aims[k].weight * across[k]);
    Some(Gap {
        ends,
        share: second / (first + second).max(f64::MIN_POSITIVE),
    })
}

/// A setting judged with another share of the first aim's weight in the sum of all.
fn reweighted(problem: &Problem, seen: &Seen, share: f64) -> Judged {
    let first = problem.aims.first().map(|aim| aim.figure);
    let weight = |aim: &Aim| match Some(aim.figure) == first {
        true => 2.0 * share * aim.weight,
        false => 2.0 * (1.0 - share) * aim.weight,
    };
    match problem.objective(&seen.figures, weight) {
        Some(objective) if seen.is_feasible() => Judged::Feasible(objective),
        _ => seen.judged(),
    }
}

/// The first of the best.
fn best_of(seen: &[Seen]) -> Option<&Seen> {
    let judged: Vec<Judged> = seen.iter().map(Seen::judged).collect();
    seen.get(*rank(&judged).first()?)
}

/// Rounds a setting to the digits of its keys and goes down from there: plain rounding can
/// break a requirement that binds.
fn descend<E>(
    problem: &mut Problem,
    from: &Seen,
    archive: &mut Vec<Seen>,
    look: &mut Look<'_, E>,
) -> Result<Seen, E> {
    let mut tried: Vec<Vec<f64>> = Vec::new();
    let mut next = roundings(problem, &from.values);
    let mut at: Option<Seen> = None;
    for _ in 0..MOST_DESCENTS {
        let known = tried.len();
        for values in next {
            if !tried.contains(&values) {
                tried.push(values);
            }
        }
        let seen = look(problem, tried[known..].to_vec(), NEARLY)?;
        archive.extend(seen.iter().cloned());
        let better = best_of(&seen).filter(|found| {
            let known = at.as_ref().map(Seen::judged);
            known.is_none_or(|known| found.judged().compare(&known).is_lt())
        });
        let Some(better) = better.cloned() else { break };
        next = neighbours(problem, &better.values);
        at = Some(better);
    }
    Ok(at.unwrap_or_else(|| from.clone()))
}

/// Variables of which every way to round up or down is tried.
const MOST_ROUNDED: usize = 6;

/// Every way to round the values up or down.
fn roundings(problem: &Problem, values: &[f64]) -> Vec<Vec<f64>> {
    let nearest: Vec<f64> = (problem.variables.iter().zip(values))
        .map(|(variable, value)| variable.rounded(*value))
        .collect();
    let other: Vec<f64> = (problem.variables.iter().zip(&nearest).zip(values))
        .map(|((variable, near), value)| variable.stepped(*near, if near > value { -1 } else { 1 }))
        .collect();
    let rounded = nearest.len().min(MOST_ROUNDED);
    let way = |bits: u32| {
        let mut values = nearest.clone();
        for i in (0..rounded).filter(|i| bits >> i & 1 == 1) {
            values[i] = other[i];
        }
        values
    };
    (0..1 << rounded).map(way).collect()
}

/// One or three units of the last digit of one variable, one of two.
fn neighbours(problem: &Problem, values: &[f64]) -> Vec<Vec<f64>> {
    let n = values.len();
    let moved = |steps: &[(usize, i32)]| {
        let mut moved = values.to_vec();
        for &(i, step) in steps {
            moved[i] = problem.variables[i].stepped(values[i], step);
        }
        moved
    };
    let single = (0..n).flat_map(|i| [-1, 1, -3, 3].map(|step| moved(&[(i, step)])));
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let signs = [(-1, -1), (-1, 1), (1, -1), (1, 1)];
    let pairs = pairs.flat_map(|(i, j)| signs.map(|(a, b)| moved(&[(i, a), (j, b)])));
    single.chain(pairs).collect()
}
