//! Numbers at the end of a step under a held voltage, as sums over the state at its start.

use super::loss::DRIVING;
use super::system::{Column, DELTA, HELD};
use crate::model::state::{BETA_DOT, CURRENT, EPSILON_DOT};

/// N numbers that state and voltage decide: the columns of their coefficients of β̇, δ, ε̇
/// and I, of their constants and of their coefficients of the voltage. As columns, as the
/// sums of neighbours then run beside each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeldRows<const N: usize>(pub(crate) [[f64; N]; PER_ROW]);

/// Numbers of a row.
pub(crate) const PER_ROW: usize = DRIVING + 2;

impl<const N: usize> HeldRows<N> {
    pub(super) fn new(row: impl Fn(usize) -> [f64; PER_ROW]) -> Self {
        let rows: [_; N] = core::array::from_fn(row);
        Self(core::array::from_fn(|j| rows.map(|row| row[j])))
    }

    /// The coefficients of row `i`.
    pub(crate) fn row(&self, i: usize) -> [f64; PER_ROW] {
        self.0.map(|column| column[i])
    }

    /// The numbers with these constants. The order of the sums is part of the results: the
    /// voltage comes last because it is known last.
    #[inline(always)]
    pub(super) fn times(&self, x: &Column<HELD>, constants: &[f64; N], voltage_v: f64) -> [f64; N] {
        let [w, d, e, c, _, v] = &self.0;
        core::array::from_fn(|i| {
            let rotor = w[i] * x[BETA_DOT] + d[i] * x[DELTA];
            let joint = e[i] * x[EPSILON_DOT] + c[i] * x[CURRENT];
            ((rotor + joint) + constants[i]) + v[i] * voltage_v
        })
    }
}
