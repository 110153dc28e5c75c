//! An affine system with its exact steps, and everything about the quantities that guards and
//! figures look at that the state does not change: rows, bounds and polynomials.

use std::sync::OnceLock;

use super::curve::Curve;
use super::grid::{Grid, product};
use super::levels::{ChordBounds, Levels};
use super::loss::DRIVING;
use super::sketch::Sketch;
use super::system::{AxisSystem, Column, DELTA, HELD};
use crate::model::axis::{Axis, Mode};
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, CURRENT};
use crate::numerics::width::{One, Width};

/// Quantities that guards and figures look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// `δ = ε − m·b`.
    Delta,
    /// `k·δ + c·ε̇`, whether or not the flank carries.
    FlankTorque,
    /// Torque that turns the screw: Ψ, or `k_m·I/z` without a joint.
    MovingTorque,
    /// γ̇.
    ScrewSpeed,
    /// I.
    Current,
    /// `β − δ`: γ and the flank's offset.
    ScrewAngle,
    /// β.
    GearAngle,
    /// `γ̈` less its constant part.
    ScrewAcceleration,
    /// The continuous law's demand.
    Demand,
    /// Voltage at the motor, and what the guards of the amplifier look at, both less
    /// their constant part: of drives beyond the paper's.
    Voltage,
    Beyond,
}

impl Quantity {
    /// What the guard of a guide with friction looks at.
    pub(crate) fn of_guide(guide: GuideMode) -> Option<Self> {
        match guide {
            GuideMode::AsWritten => None,
            GuideMode::Slides(_) => Some(Self::ScrewSpeed),
            GuideMode::Stuck => Some(Self::MovingTorque),
        }
    }
}

/// Quantities under a held voltage.
const OF_HELD: usize = 8;

/// A quantity's coefficients and bounds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linear<const D: usize> {
    pub(crate) row: Column<D>,
    pub(crate) bounds: ChordBounds<D>,
    /// On a table with a grid.
    pub(crate) sketch: Option<Sketch<D>>,
    /// Without one, made when first asked for.
    about_middle: OnceLock<Option<Sketch<D>>>,
}

impl<const D: usize> Linear<D> {
    /// `f·x`, summed in the order of the states.
    #[inline]
    pub(crate) fn value(&self, x: &Column<D>) -> f64 {
        product(One, &self.row, &(*x).into())
    }

    /// The sketch over the step that has these levels, if that is not too long for one.
    pub(super) fn sketch(&self, levels: &Levels<D>) -> Option<&Sketch<D>> {
        let made = || Sketch::about_middle(levels, &self.row);
        let without_grid = || self.about_middle.get_or_init(made).as_ref();
        self.sketch.as_ref().or_else(without_grid)
    }

    /// `scale·f·x + offset` as a sketch over the step that begins with x and its rate; none
    /// where that is too long.
    #[inline(always)]
    pub(crate) fn curve<W: Width>(
        &self,
        w: W,
        levels: &Levels<D>,
        (x, rate): (&[W::Vector; D], &[W::Vector; D]),
        (scale, offset): (W::Vector, W::Vector),
    ) -> Option<Curve<W>> {
        let start = scale * product(w, &self.row, x) + offset;
        Some(self.sketch(levels)?.curve(w, rate, (scale, start)))
    }
}

/// A system with its exact steps and quantities.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table<const D: usize> {
    pub(crate) levels: Levels<D>,
    pub(crate) grid: Option<Grid<D>>,
    rows: Vec<Column<D>>,
    /// Made when first asked for.
    quantities: Vec<OnceLock<Linear<D>>>,
}

impl<const D: usize> Table<D> {
    pub(super) fn new(levels: Levels<D>, grid: Option<Grid<D>>, rows: &[Column<D>]) -> Self {
        Self {
            levels,
            grid,
            rows: rows.to_vec(),
            quantities: vec![OnceLock::new(); rows.len()],
        }
    }

    /// A quantity's coefficients.
    #[inline]
    pub(super) fn row(&self, quantity: Quantity) -> &Column<D> {
        &self.rows[quantity as usize]
    }

    /// A quantity with its bounds.
    #[inline]
    pub(crate) fn quantity(&self, quantity: Quantity) -> &Linear<D> {
        let place = quantity as usize;
        self.quantities[place].get_or_init(|| self.linear(&self.rows[place]))
    }

    #[cold]
    fn linear(&self, row: &Column<D>) -> Linear<D> {
        let (levels, grid) = (&self.levels, self.grid.as_ref());
        Linear {
            row: *row,
            bounds: levels.bounds(row),
            sketch: grid.map(|grid| Sketch::over(grid, &levels.a, row)),
            about_middle: OnceLock::new(),
        }
    }
}

impl Linear<HELD> {
    /// How far the quantity may stray from its chord over the whole step, per rate of β̇, δ,
    /// ε̇ and I: β drives nothing.
    pub(crate) fn chords(&self, scale: f64) -> [f64; DRIVING] {
        of_driving(&self.bounds.per_rate[0], scale)
    }

    /// The change above which it is monotone, likewise.
    pub(crate) fn slopes(&self, scale: f64) -> [f64; DRIVING] {
        of_driving(&self.bounds.slope_per_rate[0], scale)
    }
}

/// The coefficients of the driving states.
fn of_driving(row: &Column<HELD>, scale: f64) -> [f64; DRIVING] {
    core::array::from_fn(|j| scale * row[j + 1])
}

/// The rows of the quantities that need no command.
pub(super) fn held_rows(axis: &Axis, mode: &Mode, system: &AxisSystem) -> [Column<HELD>; OF_HELD] {
    let unit = |place: usize| {
        let mut row = Column::<HELD>::zeros();
        row[place] = 1.0;
        row
    };
    // In the order of `Quantity`.
    [
        unit(DELTA),
        axis.flank_torque_row(),
        axis.moving_torque_row(mode),
        axis.screw_speed_row(),
        unit(CURRENT),
        unit(BETA) - unit(DELTA),
        unit(BETA),
        system.screw,
    ]
}
