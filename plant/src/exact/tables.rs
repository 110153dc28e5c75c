//! Everything about a step that the state does not change: matrices, rows of
//! the quantities that guards and figures look at, and their bounds.
//!
//! Under a held voltage none of it depends on b, on the voltage or on which
//! flank carries: two tables serve an axis, six one with dry friction.

use std::sync::OnceLock;

use nalgebra::SMatrix;

use super::armature::HeldArmature;
use super::grid::Grid;
use super::held_rows::HeldRows;
use super::levels::{self, BOUND_MARGIN, ChordBounds, ExactStep, Levels, NOISE_ULPS};
use super::loss::{DRIVING, Dissipation};
use super::sketch::Sketch;
use super::system::{
    AxisSystem, Column, DELTA, FEEDBACK, HELD, Matrix, OWN, V_REF, demand_row, feedback_system,
    from_command,
};
use crate::model::amplifier::AmplifierMode;
use crate::model::axis::{Axis, Mode};
use crate::model::joint::{Flank, JointMode};
use crate::model::motion::{Coupling, OscillatorStep};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON_DOT};
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
    /// Voltage at the motor, and what the guards of the amplifier look at, both less
    /// their constant part: of drives beyond the paper's.
    Voltage,
    Beyond,
}

/// Quantities under a held voltage, and all of them.
const OF_HELD: usize = 8;
const OF_FEEDBACK: usize = 9;

/// A quantity's coefficients and bounds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linear<const D: usize> {
    pub(crate) row: Column<D>,
    pub(crate) bounds: ChordBounds<D>,
    /// On a table whose step is not too long for it.
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
            sketch: match grid {
                Some(grid) => Some(Sketch::over(grid, &levels.a, row)),
                None => Sketch::about_middle(levels, row),
            },
        }
    }
}

/// A table for a held voltage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldTable {
    pub(super) length_ns: u64,
    /// Of a joint that carries torque.
    pub(crate) closed: bool,
    pub(crate) guide: GuideMode,
    pub(crate) system: AxisSystem,
    pub(crate) table: Table<HELD>,
    pub(crate) kernel: Kernel,
    /// Of a closed joint with damping.
    pub(crate) loss: Option<Box<Dissipation<DRIVING>>>,
    /// Made when first asked for.
    armature: OnceLock<Box<HeldArmature>>,
}

/// A table for the continuous law over one length in one mode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FeedbackTable {
    pub(super) key: FeedbackKey,
    pub(crate) table: Table<FEEDBACK>,
    pub(crate) input: Column<FEEDBACK>,
    /// `1/p`, which makes r of x_ref.
    pub(crate) rad_per_m: f64,
    /// Constant part of γ̈.
    pub(crate) screw_load: f64,
    /// `e^{AT} − 1`, the rounding of which is that of what a step changes and
    /// not of the whole state, and `ψ(T)·u`, without the command's part.
    growth: Beside<OWN>,
    drift: Column<OWN>,
    pub(crate) command: OscillatorStep,
    /// Bounds of how far δ and the demand stray from their chords over the whole step,
    /// for the change of each state; not a number where there are none.
    pub(crate) guards: Beside<2>,
    /// The same of the figures and the demand.
    pub(crate) figures: Beside<5>,
    /// The changes above which these are monotone, for each state's.
    pub(crate) slopes: [Column<FEEDBACK>; 5],
    /// Of a closed joint with damping.
    pub(crate) loss: Option<FeedbackLoss<FEEDBACK>>,
    /// Of armature and guide, made when first asked for.
    heat: OnceLock<Box<Heat<FeedbackLoss<BEHIND>>>>,
}

/// Rates of all states with a quantity ahead of them.
const BEHIND: usize = FEEDBACK + 1;

/// Heat of the armature, and of a guide whose resistance has a linear part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heat<L> {
    armature: L,
    guide: Option<L>,
}

impl<L> Heat<L> {
    /// `of` makes one from its coefficient and the row of its quantity in a table.
    pub(super) fn new(axis: &Axis, of: impl Fn(f64, Quantity) -> L) -> Self {
        let guide = axis.pitch_m_per_rad * axis.resistance.linear_ns_per_rad;
        Self {
            armature: of(axis.motor.resistance_ohm, Quantity::Current),
            guide: (guide != 0.0).then(|| of(guide, Quantity::ScrewSpeed)),
        }
    }

    /// The heat of both \[J\], that of the armature first.
    pub(super) fn over(&self, of: impl Fn(&L, Quantity) -> f64) -> [f64; 2] {
        let guide = self.guide.as_ref();
        [
            of(&self.armature, Quantity::Current),
            guide.map_or(0.0, |guide| of(guide, Quantity::ScrewSpeed)),
        ]
    }
}

/// A loss, and R of the whole step times what it is made from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FeedbackLoss<const N: usize> {
    pub(crate) of: Dissipation<N>,
    whole: Beside<N>,
    constant: Column<N>,
}

impl<const N: usize> FeedbackLoss<N> {
    /// `of` is made from `from·x + constant`.
    fn new(of: Dissipation<N>, from: &SMatrix<f64, N, FEEDBACK>, constant: &Column<N>) -> Self {
        let factor = of.whole().1;
        let rows = factor * from;
        Self {
            of,
            whole: Beside::new(&core::array::from_fn(|i| rows.row(i).transpose())),
            constant: factor * constant,
        }
    }

    /// The energy that it takes over the whole step \[J\].
    pub(crate) fn over_whole(&self, x: &Column<FEEDBACK>) -> f64 {
        let mut sum = 0.0;
        for (part, constant) in self.whole.times(x).iter().zip(self.constant.iter()) {
            let part = part + constant;
            sum += part * part;
        }
        self.of.coefficient * sum
    }
}

/// What a table depends on: a joint that carries, guide, amplifier, the command and length.
pub(super) type FeedbackKey = (bool, GuideMode, AmplifierMode, Coupling, u64);

/// N quantities side by side, the coefficients of each state together: their sums run
/// beside each other and none waits for the other.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Beside<const N: usize>([[f64; N]; FEEDBACK]);

impl<const N: usize> Beside<N> {
    fn new(rows: &[Column<FEEDBACK>; N]) -> Self {
        Self(core::array::from_fn(|j| rows.map(|row| row[j])))
    }

    /// With the first columns of a matrix for coefficients.
    fn of_columns(rows: &Matrix<FEEDBACK>) -> Self {
        Self::new(&core::array::from_fn(|i| rows.column(i).into_owned()))
    }

    /// Each quantity's value.
    #[inline(always)]
    pub(crate) fn times(&self, x: &Column<FEEDBACK>) -> [f64; N] {
        let mut sums = [0.0; N];
        for (column, x) in self.0.iter().zip(x.iter()) {
            for (sum, coefficient) in sums.iter_mut().zip(column) {
                *sum += coefficient * x;
            }
        }
        sums
    }
}

/// A quantity and the rates of all states.
pub(super) fn ahead_of_rates<const D: usize, const N: usize>(
    q: f64,
    rates: &Column<D>,
) -> Column<N> {
    let mut z = Column::<N>::zeros();
    z[0] = q;
    z.rows_mut(1, D).copy_from(rates);
    z
}

/// True if a step over this length is stiff, the joint open or closed.
pub(crate) fn is_stiff(axis: &Axis, length_ns: u64) -> bool {
    let joints: &[JointMode] = match axis.joint {
        Some(_) => &[JointMode::Open, JointMode::Loaded(Flank::Drive)],
        None => &[JointMode::Rigid],
    };
    joints.iter().any(|&joint| {
        let mode = Mode {
            joint,
            guide: GuideMode::AsWritten,
            ..axis.mode_at_rest()
        };
        levels::is_stiff(&axis.system(&mode).a, seconds(length_ns))
    })
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

impl HeldTable {
    /// Length of the step \[s\].
    pub(crate) fn length_s(&self) -> f64 {
        seconds(self.length_ns)
    }

    pub(super) fn new(axis: &Axis, mode: &Mode, length_ns: u64) -> Self {
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
            armature: OnceLock::new(),
        }
    }

    /// The armature over the step.
    #[inline]
    pub(crate) fn armature(&self, axis: &Axis) -> &HeldArmature {
        self.armature
            .get_or_init(|| Box::new(HeldArmature::new(axis, &self.system, &self.table.levels)))
    }
}

impl FeedbackTable {
    pub(super) fn new(axis: &Axis, mode: &Mode, pid: &ContinuousPid, key: FeedbackKey) -> Self {
        let (carries, .., coupling, length_ns) = key;
        let length_s = seconds(length_ns);
        let rad_per_m = 1.0 / axis.pitch_m_per_rad;
        let (a, input) = feedback_system(axis, mode, pid, coupling);
        let system = axis.system(mode);
        let mut rows = [demand_row(pid); OF_FEEDBACK];
        for (row, held) in rows.iter_mut().zip(held_rows(axis, mode, &system)) {
            *row = from_command(&held, rad_per_m);
        }
        let levels = Levels::new(&a, length_s);
        let loss = carries.then(|| Dissipation::of_all(axis, &levels));
        let loss = loss.flatten().map(|of| FeedbackLoss::new(of, &a, &input));
        let whole = &levels.steps[0].integral;
        let (growth, drift) = ((whole * a).transpose(), whole * input);
        let table = Table::new(levels, None, &rows);
        let bounds = |quantity, scale: f64| {
            let bounds = &table.quantity(quantity).bounds;
            let scale = scale.abs() * BOUND_MARGIN;
            (bounds.per_change * scale, bounds.slope_per_change * scale)
        };
        let p = axis.pitch_m_per_rad;
        let demand = bounds(Quantity::Demand, 1.0);
        let of_figures = [
            bounds(Quantity::ScrewAcceleration, p),
            bounds(Quantity::Current, 1.0),
            bounds(Quantity::ScrewAngle, p),
            bounds(Quantity::GearAngle, p),
            demand,
        ];
        Self {
            key,
            growth: Beside::of_columns(&growth),
            drift: drift.fixed_rows::<OWN>(0).into_owned(),
            command: OscillatorStep::new(coupling, length_s),
            rad_per_m,
            guards: Beside::new(&[bounds(Quantity::Delta, 1.0).0, demand.0]),
            figures: Beside::new(&of_figures.map(|(chord, _)| chord)),
            slopes: of_figures.map(|(_, slope)| slope),
            table,
            loss,
            heat: OnceLock::new(),
            input,
            screw_load: system.screw_load,
        }
    }

    /// Heat of armature and guide over a piece from `x` \[J\].
    pub(crate) fn heat_j(&self, axis: &Axis, x: &Column<FEEDBACK>, length_s: f64) -> [f64; 2] {
        let heat = self.heat.get_or_init(|| {
            Box::new(Heat::new(axis, |coefficient, quantity| {
                let levels = &self.table.levels;
                let row = &self.table.quantity(quantity).row;
                let mut from = SMatrix::<f64, BEHIND, FEEDBACK>::zeros();
                from.set_row(0, &row.transpose());
                from.fixed_rows_mut::<FEEDBACK>(1).copy_from(&levels.a);
                let of = Dissipation::of_quantity(coefficient, levels, row);
                FeedbackLoss::new(of, &from, &ahead_of_rates(0.0, &self.input))
            }))
        });
        if length_s == self.length_s() {
            return heat.over(|loss, _| loss.over_whole(x));
        }
        let rates = self.table.levels.a * x + self.input;
        heat.over(|loss, quantity| {
            let q = self.table.quantity(quantity).value(x);
            loss.of.over(ahead_of_rates(q, &rates), length_s)
        })
    }

    /// Length of the step \[s\].
    pub(crate) fn length_s(&self) -> f64 {
        seconds(self.key.4)
    }

    /// What the whole step makes of the axis' own part of a state.
    #[inline(always)]
    pub(crate) fn step(&self, x: &Column<FEEDBACK>) -> Column<OWN> {
        let changes = self.growth.times(x);
        Column::<OWN>::from_fn(|i, _| x[i] + (changes[i] + self.drift[i]))
    }

    /// Rounding of δ after the whole step.
    pub(crate) fn rounding_of_delta(&self, x: &Column<FEEDBACK>) -> f64 {
        let mut terms = x[DELTA].abs();
        for (column, x) in self.growth.0.iter().zip(x.iter()) {
            terms += (column[DELTA] * x).abs();
        }
        NOISE_ULPS * terms
    }

    /// γ̈ without its constant part; no more than five states make it.
    #[inline(always)]
    pub(crate) fn screw_acceleration(&self, x: &Column<FEEDBACK>) -> f64 {
        let row = &self.table.rows[Quantity::ScrewAcceleration as usize];
        let own = (row[BETA_DOT] * x[BETA_DOT] + row[DELTA] * x[DELTA])
            + (row[EPSILON_DOT] * x[EPSILON_DOT] + row[CURRENT] * x[CURRENT]);
        own + row[V_REF] * x[V_REF]
    }

    /// The law's demand \[V\].
    #[inline]
    pub(crate) fn demand_v(&self, x: &Column<FEEDBACK>) -> f64 {
        let row = &self.table.rows[Quantity::Demand as usize];
        (row[BETA] * x[BETA] + row[BETA_DOT] * x[BETA_DOT]) + row[BETA_INTEGRAL] * x[BETA_INTEGRAL]
    }
}

/// The exact step over the whole length, `x(T) = Φ·x + ψ(T)·load + Γ·V`, with
/// the entries that are not zero: β drives nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kernel {
    /// Φ, `ψ(T)·load` and `Γ = ψ(T)·(0, 0, 0, 0, 1/L)`.
    pub(crate) rows: HeldRows<HELD>,
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
        Self {
            rows: HeldRows::new(|i| {
                let phi = |j: usize| whole.transition[(i, j)];
                let [w, d, e, c] = [BETA_DOT, DELTA, EPSILON_DOT, CURRENT].map(phi);
                [w, d, e, c, drift[i], per_volt[i]]
            }),
            gap_bound: core::array::from_fn(|j| BOUND_MARGIN * gap.per_change[j + 1]),
        }
    }

    /// Sum of the magnitudes of the terms that make up δ after a step.
    pub(crate) fn terms_of_delta(&self, x: &Column<HELD>, voltage_v: f64) -> f64 {
        let [w, d, e, c, _, v] = self.rows.row(DELTA);
        let terms = [
            w * x[BETA_DOT],
            d * x[DELTA],
            e * x[EPSILON_DOT],
            c * x[CURRENT],
            v * voltage_v,
        ];
        terms.iter().map(|term| term.abs()).sum()
    }

    /// One step.
    #[inline(always)]
    pub(crate) fn step(&self, x: &Column<HELD>, voltage_v: f64) -> Column<HELD> {
        let mut base = self.rows.0[DRIVING];
        base[BETA] += x[BETA];
        self.rows.times(x, &base, voltage_v).into()
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
