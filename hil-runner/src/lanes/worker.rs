//! What one thread keeps from run to run.

use fearless_simd::{Level, Simd, dispatch};
use plant::{Eight, One, Width};

use super::family::{Family, Key};
use super::lockstep::Lanes;
use crate::case::Case;
use crate::error::RunError;
use crate::run::{RunOptions, run};
use crate::summary::Summary;

/// A number of cases for which whole groups of lanes are not worth it: eight
/// runs side by side take about as long as two one after the other.
const MOST_ALONE: usize = 2;

/// Figures of one run after the other, on one thread.
///
/// What depends on axis, command and timing alone is computed for the first
/// run and kept as long as these stay the same; gains, backlash, encoder and
/// drive may change from run to run at no cost.
#[derive(Debug)]
pub struct SingleRuns {
    level: Level,
    lanes: Option<Lanes<One>>,
}

impl Default for SingleRuns {
    fn default() -> Self {
        Self::new()
    }
}

impl SingleRuns {
    /// Nothing computed yet.
    pub fn new() -> Self {
        Self {
            level: for_one(),
            lanes: None,
        }
    }

    /// The figures of a run, bit for bit those of [`run`] with
    /// `run.events = false`.
    ///
    /// # Errors
    /// As [`run`].
    pub fn figures(&mut self, case: &Case) -> Result<Summary, RunError> {
        let Some(family) = Family::of(case) else {
            return alone(case);
        };
        let lanes = prepared(One, &mut self.lanes, family)?;
        // The scalar code, too, is faster with an instruction for `floor`.
        dispatch!(self.level, simd => one(simd, lanes, case))
    }
}

/// Instructions for a single run: one with `floor`. The compiler uses wider
/// ones to gather what lies apart, which takes longer than it saves.
fn for_one() -> Level {
    let level = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(narrow) = level.as_sse4_2() {
        return Level::Sse4_2(narrow);
    }
    level
}

#[inline(always)]
fn one<S: Simd>(_: S, lanes: &mut Lanes<One>, case: &Case) -> Result<Summary, RunError> {
    let mut result = Err(RunError::Thread);
    lanes.run(std::iter::once(case), |figures| result = figures);
    result
}

/// The lanes for a family: those at hand if they are for it.
fn prepared<W: Width>(
    width: W,
    lanes: &mut Option<Lanes<W>>,
    family: Family,
) -> Result<&mut Lanes<W>, RunError> {
    let key: Key = family.key();
    let fitting = lanes.take().filter(|lanes| *lanes.key() == key);
    let fitting = match fitting {
        Some(fitting) => fitting,
        None => Lanes::new(width, family, key)?,
    };
    Ok(lanes.insert(fitting))
}

/// A case that has to be run by itself.
fn alone(case: &Case) -> Result<Summary, RunError> {
    let mut case = case.clone();
    case.run.events = false;
    run(&case, RunOptions::default(), &mut |_| Ok(())).map(|outcome| outcome.summary)
}

/// Cases of one family, or cases without one: a piece of work for one thread.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parcel<'a> {
    pub(crate) family: Option<Family>,
    /// Places in the list of all cases.
    pub(crate) places: &'a [usize],
}

/// Places and figures.
pub(crate) type Done = Vec<(usize, Result<Summary, RunError>)>;

/// Works through parcels until there are none left, with the widest
/// instructions of `level`.
pub(crate) fn work<'a>(
    level: Level,
    cases: &[Case],
    parcels: impl Iterator<Item = Parcel<'a>>,
) -> Done {
    dispatch!(level, simd => work_in_lanes(Eight(simd), cases, parcels))
}

#[inline(always)]
fn work_in_lanes<'a, W: Width>(
    width: W,
    cases: &[Case],
    parcels: impl Iterator<Item = Parcel<'a>>,
) -> Done {
    let mut done = Vec::new();
    let (mut lanes, mut single) = (None, None);
    for Parcel { family, places } in parcels {
        let Some(family) = family else {
            done.extend(places.iter().map(|&place| (place, alone(&cases[place]))));
            continue;
        };
        for group in places.chunks(W::LANES) {
            // No closures around `run`: a function of its own would not get
            // the instructions that this one is compiled for.
            if group.len() <= MOST_ALONE
                && let Ok(single) = prepared(One, &mut single, family)
            {
                for &place in group {
                    let case = std::iter::once(&cases[place]);
                    single.run(case, |figures| done.push((place, figures)));
                }
            } else if let Ok(lanes) = prepared(width, &mut lanes, family) {
                let group_cases = group.iter().map(|&place| &cases[place]);
                let mut places = group.iter();
                lanes.run(group_cases, |figures| {
                    done.extend(places.next().map(|&place| (place, figures)));
                });
            } else {
                // Not a family after all: the single run says why.
                done.extend(group.iter().map(|&place| (place, alone(&cases[place]))));
            }
        }
    }
    done
}
