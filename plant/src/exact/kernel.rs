//! The step over a whole sample under a held voltage, as the entries that are
//! not zero.

use super::levels::{ChordBounds, ExactStep};
use super::system::{AxisSystem, Column, DELTA, HELD};
use super::walk::BOUND_MARGIN;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON_DOT};

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

    /// How far δ may stray from its chord over the step.
    #[inline(always)]
    pub(crate) fn gap_strays(&self, from: &Column<HELD>, to: &Column<HELD>) -> f64 {
        let change = |state: usize| (to[state] - from[state]).abs();
        let g = &self.gap_bound;
        (g[0] * change(BETA_DOT) + g[1] * change(DELTA))
            + (g[2] * change(EPSILON_DOT) + g[3] * change(CURRENT))
    }
}
