//! A table for the continuous law: the axis with its command over one length in one mode.

use std::sync::OnceLock;

use nalgebra::SMatrix;

use super::levels::{BOUND_MARGIN, Levels, NOISE_ULPS};
use super::loss::Dissipation;
use super::system::{
    Column, DELTA, FEEDBACK, Matrix, OWN, V_REF, demand_row, feedback_system, from_command,
};
use super::table::{Quantity, Table, held_rows};
use crate::model::amplifier::AmplifierMode;
use crate::model::axis::{Axis, Mode};
use crate::model::motion::{Coupling, OscillatorStep};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON_DOT};
use crate::numerics::seconds;

/// Quantities of it.
const OF_FEEDBACK: usize = 9;

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
        let inverse = table.levels.inverse();
        let bounds = |quantity, scale: f64| {
            let row = table.row(quantity);
            let scale = scale.abs() * BOUND_MARGIN;
            let [chord, slope] = table.levels.bounds_per_change(row, inverse.as_ref());
            (chord * scale, slope * scale)
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
        let row = self.table.row(Quantity::ScrewAcceleration);
        let own = (row[BETA_DOT] * x[BETA_DOT] + row[DELTA] * x[DELTA])
            + (row[EPSILON_DOT] * x[EPSILON_DOT] + row[CURRENT] * x[CURRENT]);
        own + row[V_REF] * x[V_REF]
    }

    /// The law's demand \[V\].
    #[inline]
    pub(crate) fn demand_v(&self, x: &Column<FEEDBACK>) -> f64 {
        let row = self.table.row(Quantity::Demand);
        (row[BETA] * x[BETA] + row[BETA_DOT] * x[BETA_DOT]) + row[BETA_INTEGRAL] * x[BETA_INTEGRAL]
    }
}
