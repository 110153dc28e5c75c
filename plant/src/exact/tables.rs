//! Everything about a step that the state does not change: matrices, rows of
//! the quantities that guards and figures look at, and their bounds.
//!
//! Under a held voltage none of it depends on b, on the voltage or on which
//! flank carries: two tables serve an axis, six one with dry friction.

use super::grid::Grid;
use super::levels::{BOUND_MARGIN, ChordBounds, ExactStep, Levels};
use super::loss::{DRIVING, Dissipation};
use super::sketch::Sketch;
use super::system::{
    AxisSystem, Column, DELTA, FEEDBACK, HELD, Matrix, demand_row, feedback_system, from_command,
};
use crate::model::axis::{Axis, Mode};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON_DOT, Vector};
use crate::numerics::seconds;

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
}

/// Quantities under a held voltage, and all of them.
const OF_HELD: usize = 8;
const OF_FEEDBACK: usize = 9;

/// A quantity's coefficients and bounds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linear<const D: usize> {
    pub(crate) row: Column<D>,
    pub(crate) bounds: ChordBounds<D>,
    /// On a table with a grid.
    pub(crate) sketch: Option<Sketch<D>>,
}

impl<const D: usize> Linear<D> {
    /// `f·x`, summed in the order of the states.
    #[inline]
    pub(crate) fn value(&self, x: &Column<D>) -> f64 {
        let mut sum = 0.0;
        for (f, x) in self.row.iter().zip(x.iter()) {
            sum += f * x;
        }
        sum
    }
}

/// A system with its exact steps and quantities.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table<const D: usize> {
    pub(crate) levels: Levels<D>,
    pub(crate) grid: Option<Grid<D>>,
    quantities: Vec<Linear<D>>,
}

impl<const D: usize> Table<D> {
    fn new(levels: Levels<D>, grid: Option<Grid<D>>, rows: &[Column<D>]) -> Self {
        let linear = |row: &Column<D>| Linear {
            row: *row,
            bounds: levels.bounds(row),
            sketch: grid.as_ref().map(|grid| Sketch::over(grid, &levels.a, row)),
        };
        let quantities = rows.iter().map(linear).collect();
        Self {
            levels,
            grid,
            quantities,
        }
    }

    pub(crate) fn quantity(&self, quantity: Quantity) -> &Linear<D> {
        &self.quantities[quantity as usize]
    }
}

/// A table for a held voltage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldTable {
    length_ns: u64,
    /// Of a joint that carries torque.
    pub(crate) closed: bool,
    guide: GuideMode,
    pub(crate) system: AxisSystem,
    pub(crate) table: Table<HELD>,
    pub(crate) kernel: Kernel,
    /// Of a closed joint with damping.
    pub(crate) loss: Option<Box<Dissipation<DRIVING>>>,
}

/// A table for the continuous law over one length in one mode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FeedbackTable {
    length_ns: u64,
    pub(super) mode: Mode,
    omega: f64,
    pub(crate) table: Table<FEEDBACK>,
    pub(crate) input: Column<FEEDBACK>,
    /// Constant part of γ̈.
    pub(crate) screw_load: f64,
    /// `e^{AT} − 1`, the rounding of which is that of what a step changes and
    /// not of the whole state, and `ψ(T)·u`.
    pub(crate) growth: Matrix<FEEDBACK>,
    pub(crate) drift: Column<FEEDBACK>,
    /// Of a closed joint with damping.
    pub(crate) loss: Option<Box<Dissipation<FEEDBACK>>>,
}

/// The whole state at the end of the last interval, to go on from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Carried {
    pub(super) pid: ContinuousPid,
    pub(super) time_ns: u64,
    pub(super) length_ns: u64,
    /// The plant's own vector, which must not have been touched.
    pub(super) y: Vector,
    pub(super) x: Column<FEEDBACK>,
    /// Place of the table.
    pub(super) place: usize,
    /// Until when the command keeps to its interval \[s\].
    pub(super) until_s: f64,
}

/// The tables made so far. They are made when first needed; a sampled run
/// needs two, one for each state of the joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tables {
    held: Vec<HeldTable>,
    pub(crate) feedback: Vec<FeedbackTable>,
    pid: Option<Box<ContinuousPid>>,
    pub(crate) carried: Option<Box<Carried>>,
}

/// Tables kept at most of each kind; a run with a delay uses twice three, a
/// continuous one with all modes and segments about twenty.
const MOST_TABLES: usize = 64;

impl Tables {
    /// The table for `mode` and `length_ns`, made if need be.
    #[inline]
    pub(crate) fn held(&mut self, axis: &Axis, mode: &Mode, length_ns: u64) -> &HeldTable {
        let key = (mode.joint.carries(), mode.guide, length_ns);
        let mut tables = self.held.iter();
        let found = tables.position(|t| (t.closed, t.guide, t.length_ns) == key);
        let place = found.unwrap_or_else(|| self.make_held(axis, mode, length_ns));
        &self.held[place]
    }

    #[cold]
    fn make_held(&mut self, axis: &Axis, mode: &Mode, length_ns: u64) -> usize {
        if self.held.len() >= MOST_TABLES {
            self.held.clear();
        }
        self.held.push(HeldTable::new(axis, mode, length_ns));
        self.held.len() - 1
    }

    /// The place of that for the continuous law; `omega` is that of the command's
    /// interval.
    pub(crate) fn feedback(
        &mut self,
        axis: &Axis,
        mode: &Mode,
        pid: &ContinuousPid,
        omega: f64,
        length_ns: u64,
    ) -> usize {
        if self.pid.as_deref() != Some(pid) {
            self.feedback.clear();
            self.pid = Some(Box::new(*pid));
        }
        let key = (*mode, omega, length_ns);
        let mut tables = self.feedback.iter();
        if let Some(place) = tables.position(|t| (t.mode, t.omega, t.length_ns) == key) {
            return place;
        }
        if self.feedback.len() >= MOST_TABLES {
            self.feedback.clear();
        }
        self.feedback
            .push(FeedbackTable::new(axis, mode, pid, omega, length_ns));
        self.feedback.len() - 1
    }
}

/// The rows of the quantities that need no command.
fn held_rows(axis: &Axis, mode: &Mode, system: &AxisSystem) -> [Column<HELD>; OF_HELD] {
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

impl HeldTable {
    /// Length of the step \[s\].
    pub(crate) fn length_s(&self) -> f64 {
        seconds(self.length_ns)
    }

    fn new(axis: &Axis, mode: &Mode, length_ns: u64) -> Self {
        let system = axis.system(mode);
        let rows = held_rows(axis, mode, &system);
        let levels = Levels::new(&system.a, seconds(length_ns));
        let grid = Grid::new(&levels);
        let closed = mode.joint.carries();
        let loss = closed.then(|| Dissipation::held(axis, &levels)).flatten();
        let table = Table::new(levels, grid, &rows);
        Self {
            length_ns,
            closed,
            guide: mode.guide,
            kernel: Kernel::new(
                &system,
                &table.levels.steps[0],
                &table.quantity(Quantity::Delta).bounds,
            ),
            system,
            table,
            loss,
        }
    }
}

impl FeedbackTable {
    fn new(axis: &Axis, mode: &Mode, pid: &ContinuousPid, omega: f64, length_ns: u64) -> Self {
        let (a, input) = feedback_system(axis, mode, pid, omega);
        let system = axis.system(mode);
        let mut rows = [Column::<FEEDBACK>::zeros(); OF_FEEDBACK];
        for (row, held) in rows.iter_mut().zip(held_rows(axis, mode, &system)) {
            row.fixed_rows_mut::<HELD>(0).copy_from(&held);
        }
        rows[Quantity::Demand as usize] = demand_row(pid);
        let p = axis.pitch_m_per_rad;
        let rows = rows.map(|row| from_command(&row, p));
        let levels = Levels::new(&a, seconds(length_ns));
        let closed = mode.joint.carries();
        let loss = closed
            .then(|| Dissipation::feedback(axis, &levels))
            .flatten();
        let table = Table::new(levels, None, &rows);
        let whole = &table.levels.steps[0];
        let (growth, drift) = (whole.integral * a, whole.integral * input);
        Self {
            length_ns,
            mode: *mode,
            omega,
            table,
            input,
            screw_load: system.screw_load,
            growth,
            drift,
            loss,
        }
    }
}

/// The exact step over the whole length, `x(T) = Φ·x + ψ(T)·load + Γ·V`, with
/// the entries that are not zero: β drives nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kernel {
    /// Φ, the columns of β̇, δ, ε̇ and I.
    pub(crate) transition: [[f64; 4]; HELD],
    /// `ψ(T)·load`.
    pub(crate) drift: [f64; HELD],
    /// `Γ = ψ(T)·(0, 0, 0, 0, 1/L)`.
    pub(crate) per_volt: [f64; HELD],
    /// `G` of δ, raised by its rounding, for β̇, δ, ε̇ and I.
    pub(crate) gap_bound: [f64; 4],
}

impl Kernel {
    pub(super) fn new(
        system: &AxisSystem,
        whole: &ExactStep<HELD>,
        gap: &ChordBounds<HELD>,
    ) -> Self {
        let mut volt = Column::<HELD>::zeros();
        volt[CURRENT] = system.per_volt;
        let (drift, per_volt) = (whole.integral * system.load, whole.integral * volt);
        let column = |j: usize| whole.transition.column(j).into_owned();
        let (w, d, e, i) = (
            column(BETA_DOT),
            column(DELTA),
            column(EPSILON_DOT),
            column(CURRENT),
        );
        Self {
            transition: core::array::from_fn(|row| [w[row], d[row], e[row], i[row]]),
            drift: drift.into(),
            per_volt: per_volt.into(),
            gap_bound: core::array::from_fn(|j| BOUND_MARGIN * gap.per_change[j + 1]),
        }
    }

    /// Sum of the magnitudes of the terms that make up δ after a step.
    pub(crate) fn terms_of_delta(&self, x: &Column<HELD>, voltage_v: f64) -> f64 {
        let phi = &self.transition[DELTA];
        let terms = [
            phi[0] * x[BETA_DOT],
            phi[1] * x[DELTA],
            phi[2] * x[EPSILON_DOT],
            phi[3] * x[CURRENT],
            self.per_volt[DELTA] * voltage_v,
        ];
        terms.iter().map(|term| term.abs()).sum()
    }

    /// One step. The order of the sums is part of the results: the voltage
    /// comes last because it is known last.
    #[inline(always)]
    pub(crate) fn step(&self, x: &Column<HELD>, voltage_v: f64) -> Column<HELD> {
        Column::<HELD>::from_fn(|row, _| {
            let phi = &self.transition[row];
            let base = if row == BETA {
                x[BETA] + self.drift[row]
            } else {
                self.drift[row]
            };
            let rotor = phi[0] * x[BETA_DOT] + phi[1] * x[DELTA];
            let joint = phi[2] * x[EPSILON_DOT] + phi[3] * x[CURRENT];
            ((rotor + joint) + base) + self.per_volt[row] * voltage_v
        })
    }

    /// Bound of how far δ strays from its chord over the step.
    #[inline(always)]
    pub(crate) fn gap_strays(&self, from: &Column<HELD>, to: &Column<HELD>) -> f64 {
        let change = |state: usize| (to[state] - from[state]).abs();
        let g = &self.gap_bound;
        (g[0] * change(BETA_DOT) + g[1] * change(DELTA))
            + (g[2] * change(EPSILON_DOT) + g[3] * change(CURRENT))
    }
}
