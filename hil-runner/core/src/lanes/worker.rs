//! Tables that one thread keeps from run to run.

use std::collections::BTreeMap;
use std::sync::Arc;

use fearless_simd::{Level, Simd};
use plant::{Eight, Four, Single, Width, widest};

use super::alone::alone;
use super::family::{AT_A_TIME, Commands, Family, OneByOne, Parcel, groups};
use super::side_by_side::{Lanes, Outcome};
use crate::case::Case;
use crate::error::RunError;
use crate::summary::Summary;
use crate::theory::Loops;

/// A number of cases for which whole groups of lanes are not worth it.
const MOST_ALONE: usize = 2;

/// Families whose tables are kept.
const MOST_FAMILIES: usize = 4;

/// Evaluates an expression with one of the sets of instructions that runs are compiled for,
/// the widest that the level has: each makes the whole of them once more.
macro_rules! with_instructions {
    ($level:expr, $simd:ident => $op:expr, none: $none:expr) => {{
        #[cfg(target_arch = "x86_64")]
        let result = if let Some($simd) = $level.as_avx2() {
            $simd.vectorize(
                #[inline(always)]
                || $op,
            )
        } else if let Some($simd) = $level.as_sse2() {
            $simd.vectorize(
                #[inline(always)]
                || $op,
            )
        } else {
            $none
        };
        #[cfg(not(target_arch = "x86_64"))]
        let result = fearless_simd::dispatch!($level, $simd => $op);
        result
    }};
}

/// Figures of many runs at a time, side by side, on one thread: what a thread
/// of a study keeps.
///
/// What depends on axis, command and timing alone is computed for the first run and
/// kept from call to call, for the last few axes; gains, backlash, encoder and drive
/// may change from run to run at no cost. A call is best given some
/// hundreds of cases; [`Runs::AT_A_TIME`] of one axis are computed at a time,
/// and of a smaller number some lanes stay empty.
///
/// ```
/// use hil_core::{lanes::Runs, runfile};
///
/// let mut case = runfile::builtin("paper-2", &["controller.law=quantised".to_owned()])?;
/// let mut runs = Runs::new();
/// let mut figures = Vec::new();
/// for ki_per_s in [0.0, 10.0] {
///     case.controller.gains.ki_per_s = ki_per_s;
///     let cases: Vec<_> = (1..=4)
///         .map(|gain| {
///             let mut case = case.clone();
///             case.controller.gains.kp = f64::from(gain);
///             case
///         })
///         .collect();
///     runs.figures(&cases, &mut figures);
/// }
/// assert_eq!(figures.len(), 8);
/// assert!(figures.iter().all(Result::is_ok));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Runs {
    level: Level,
    /// The last one used comes last.
    families: Vec<Box<dyn SideBySide>>,
    /// The commands that were asked for last.
    commands: Option<Arc<Commands>>,
    loops: Loops,
    one_by_one: BTreeMap<OneByOne, u64>,
}

impl Default for Runs {
    fn default() -> Self {
        Self::new()
    }
}

impl Runs {
    /// Runs of one axis that are computed at a time.
    pub const AT_A_TIME: usize = AT_A_TIME;

    /// Nothing computed yet.
    pub fn new() -> Self {
        Self::with(widest())
    }

    /// With given instructions.
    pub(crate) fn with(level: Level) -> Self {
        Self {
            level,
            families: Vec::new(),
            commands: None,
            loops: Loops::default(),
            one_by_one: BTreeMap::new(),
        }
    }

    /// The figures of a run, bit for bit those of [`crate::run::run`] with
    /// `run.events = false`.
    ///
    /// # Errors
    /// As [`crate::run::run`].
    pub fn single(&mut self, case: &Case) -> Result<Summary, RunError> {
        let family = match Family::of(case) {
            Ok(family) => family,
            Err(why) => return self.alone(case, why),
        };
        let Ok((lanes, loops)) = self.prepared(&family, true) else {
            return self.alone(case, OneByOne::Stiff);
        };
        let mut figures = Some(Err(RunError::Lost));
        let cases = std::slice::from_ref(case);
        lanes.run(cases, &[0], loops, &mut |_, of_case| figures = of_case);
        figures.unwrap_or_else(|| self.alone(case, OneByOne::Work))
    }

    /// The figures of a run that is made by itself, which is counted.
    fn alone(&mut self, case: &Case, why: OneByOne) -> Result<Summary, RunError> {
        *self.one_by_one.entry(why).or_default() += 1;
        alone(case, &mut self.loops)
    }

    /// How many runs were made by themselves since this was last asked, and why: they
    /// take some times as long.
    pub fn take_one_by_one(&mut self) -> BTreeMap<OneByOne, u64> {
        std::mem::take(&mut self.one_by_one)
    }

    /// Appends the figures of every case, in their order: bit for bit those of
    /// [`crate::run::run`] with `run.events = false`.
    pub fn figures(&mut self, cases: &[Case], figures: &mut Vec<Result<Summary, RunError>>) {
        let first = figures.len();
        figures.extend(cases.iter().map(|_| Err(RunError::Lost)));
        for parcel in groups(cases) {
            self.of_parcel(cases, &parcel, |place, result| {
                figures[first + place] = result;
            });
        }
    }

    /// The figures of a parcel of the cases, each with its place.
    pub fn of_parcel(
        &mut self,
        cases: &[Case],
        parcel: &Parcel,
        mut each: impl FnMut(usize, Result<Summary, RunError>),
    ) {
        for places in parcel.places.chunks(Self::AT_A_TIME) {
            let prepared = match &parcel.family {
                Ok(family) if places.len() > MOST_ALONE => self.prepared(family, false).ok(),
                _ => None,
            };
            if let Some((lanes, loops)) = prepared {
                let mut left = Vec::new();
                lanes.run(cases, places, loops, &mut |place, outcome| match outcome {
                    Some(figures) => each(place, figures),
                    None => left.push(place),
                });
                for place in left {
                    each(place, self.alone(&cases[place], OneByOne::Work));
                }
                continue;
            }
            for &place in places {
                each(place, self.single(&cases[place]));
            }
        }
    }

    /// The lanes for a family, or the one for runs one at a time: those at hand if there are
    /// such. And the loops.
    fn prepared(
        &mut self,
        family: &Family,
        alone: bool,
    ) -> Result<(&mut dyn SideBySide, &mut Loops), RunError> {
        let mut known = self.families.iter();
        let known = known.position(|lanes| (lanes.family(), lanes.is_alone()) == (family, alone));
        let lanes = match known {
            Some(place) => self.families.remove(place),
            None => side_by_side(self.level, alone, family.clone(), &mut self.commands)?,
        };
        if self.families.len() >= MOST_FAMILIES {
            self.families.remove(0);
        }
        self.families.push(lanes);
        let last = self.families.last_mut().ok_or(RunError::Lost)?;
        Ok((last.as_mut(), &mut self.loops))
    }
}

/// The runs of a family with one kind of instructions.
trait SideBySide: std::fmt::Debug + Send {
    fn family(&self) -> &Family;
    /// True of one lane.
    fn is_alone(&self) -> bool;
    /// Runs some of the cases, no more than [`Runs::AT_A_TIME`].
    fn run(
        &mut self,
        cases: &[Case],
        places: &[usize],
        loops: &mut Loops,
        each: &mut dyn FnMut(usize, Outcome),
    );
}

/// One lane, or as many as a vector holds: a narrower one would need more steps, of a wider one
/// too few halves fit in the registers. One lane has its numbers in fours; wider instructions
/// have not made it quicker.
fn side_by_side(
    level: Level,
    alone: bool,
    family: Family,
    known: &mut Option<Arc<Commands>>,
) -> Result<Box<dyn SideBySide>, RunError> {
    #[cfg(target_arch = "x86_64")]
    if let (Level::Avx512(simd), false) = (level, alone) {
        return Ok(Box::new(Lanes::new(Eight(simd), family, known)?));
    }
    with_instructions!(level, simd => four(simd, alone, family, known), none: Err(RunError::Lost))
}

#[inline(always)]
fn four<S: Simd>(
    simd: S,
    alone: bool,
    family: Family,
    known: &mut Option<Arc<Commands>>,
) -> Result<Box<dyn SideBySide>, RunError> {
    Ok(match alone {
        true => Box::new(Lanes::new(Single(simd), family, known)?),
        false => Box::new(Lanes::new(Four(simd), family, known)?),
    })
}

/// As [`SideBySide`], for a width with instructions of its own.
macro_rules! in_lanes {
    ($width:ident) => {
        impl<S: Simd> SideBySide for Lanes<$width<S>> {
            fn family(&self) -> &Family {
                &self.family
            }

            fn is_alone(&self) -> bool {
                $width::<S>::LANES == 1
            }

            fn run(
                &mut self,
                cases: &[Case],
                places: &[usize],
                loops: &mut Loops,
                each: &mut dyn FnMut(usize, Outcome),
            ) {
                self.width.0.vectorize(
                    #[inline(always)]
                    || run_places(self, cases, places, loops, each),
                );
            }
        }
    };
}

in_lanes!(Single);
in_lanes!(Four);
in_lanes!(Eight);

#[inline(always)]
fn run_places<W: Width>(
    lanes: &mut Lanes<W>,
    cases: &[Case],
    places: &[usize],
    loops: &mut Loops,
    each: &mut dyn FnMut(usize, Outcome),
) {
    let mut done = places.iter();
    let chosen = places.iter().map(|&place| &cases[place]);
    lanes.run(chosen, loops, |figures| {
        if let Some(&place) = done.next() {
            each(place, figures);
        }
    });
}
