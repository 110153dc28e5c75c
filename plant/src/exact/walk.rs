//! The exact solution from one state, for as long as a mode lasts, and the
//! walk along it in the longest steps that will do.
//!
//! A step that the chord bound of [`super::levels`] settles costs two products
//! with a small matrix. One that it does not settle is halved; the shortest is
//! handed over as a Taylor series, whose polynomials decide.

use super::levels::Levels;
use super::system::Column;
use super::tables::Table;
use super::taylor::Taylor;

/// Steps of one walk after which the plant is called too stiff: a sample of
/// the stiffest axis that was tried takes some thousands.
const MOST_STEPS: u32 = 4_000_000;

/// The walk took too many steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooManySteps;

/// The solution of `dx/dt = A·x + u` from `start`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flow<'a, const D: usize> {
    pub(crate) table: &'a Table<D>,
    pub(crate) input: &'a Column<D>,
    pub(crate) start: &'a Column<D>,
}

/// One step along the solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg<const D: usize> {
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    pub(crate) from: Column<D>,
    /// dx/dt at the start.
    pub(crate) rate: Column<D>,
    pub(crate) to: Column<D>,
    /// Which of the table's steps this is.
    pub(crate) level: usize,
}

/// A leg that the bound has settled, or one of the shortest with its series.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Stretch<const D: usize> {
    Settled(Leg<D>),
    /// `end` is the θ of the series at which the leg ends.
    Leaf {
        leg: Leg<D>,
        series: Taylor<D>,
        end: f64,
    },
}

/// A walk of a given length, and where it stands.
#[derive(Debug, Clone)]
pub(crate) struct Walk<'a, const D: usize> {
    levels: &'a Levels<D>,
    input: &'a Column<D>,
    length_s: f64,
    time_s: f64,
    level: usize,
    steps: u32,
    pub(crate) x: Column<D>,
}

impl<'a, const D: usize> Flow<'a, D> {
    /// A walk that tries steps from `first_level` on.
    pub(crate) fn walk(&self, length_s: f64, first_level: usize) -> Walk<'a, D> {
        let levels = &self.table.levels;
        Walk {
            levels,
            input: self.input,
            length_s,
            time_s: 0.0,
            level: first_level.min(levels.steps.len() - 1),
            steps: 0,
            x: *self.start,
        }
    }

    /// The state after `time_s`. Every leg is settled, so that the number of
    /// steps is at most that of the halvings.
    pub(crate) fn at(&self, time_s: f64) -> Column<D> {
        if let Some(grid) = &self.table.grid {
            let a = &self.table.levels.a;
            let rate = a * self.start + self.input;
            let local = grid.near(a, self.start, &rate, time_s);
            return local.at(local.sigma(time_s));
        }
        let mut walk = self.walk(time_s, 0);
        while let Ok(Some(_)) = walk.next(|_| true) {}
        walk.x
    }
}

/// Ends are compared with this much of the length to spare: binary fractions
/// of it are exact, but what is left of an interval after an event is not.
const SPARE: f64 = 4.0 * f64::EPSILON;

impl<const D: usize> Walk<'_, D> {
    /// The next stretch, `None` at the end of the walk.
    pub(crate) fn next(
        &mut self,
        settled: impl Fn(&Leg<D>) -> bool,
    ) -> Result<Option<Stretch<D>>, TooManySteps> {
        let steps = &self.levels.steps;
        let last = steps.len() - 1;
        let left_s = self.length_s - self.time_s;
        let spare_s = SPARE * self.length_s;
        if left_s <= spare_s {
            return Ok(None);
        }
        let rate = self.levels.a * self.x + self.input;
        loop {
            self.steps += 1;
            if self.steps > MOST_STEPS {
                return Err(TooManySteps);
            }
            let step = &steps[self.level];
            let whole = step.length_s <= left_s + spare_s;
            if !whole && self.level < last {
                self.level += 1;
                continue;
            }
            let mut leg = Leg {
                start_s: self.time_s,
                length_s: step.length_s,
                from: self.x,
                rate,
                to: self.x + step.integral * rate,
                level: self.level,
            };
            if whole && settled(&leg) {
                self.move_to(&leg);
                self.level = self.level.saturating_sub(1);
                return Ok(Some(Stretch::Settled(leg)));
            }
            if self.level < last {
                self.level += 1;
                continue;
            }
            let series = Taylor::new(&self.levels.a, &leg.from, &rate, step.length_s);
            let mut end = 1.0;
            if !whole {
                leg.length_s = left_s;
                end = left_s / step.length_s;
                leg.to = series.at(end);
            }
            self.move_to(&leg);
            return Ok(Some(Stretch::Leaf { leg, series, end }));
        }
    }

    fn move_to(&mut self, leg: &Leg<D>) {
        self.time_s = leg.start_s + leg.length_s;
        self.x = leg.to;
    }
}
