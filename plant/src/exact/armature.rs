//! Heat of the armature and the charge through it over a step under a held voltage.
//!
//! [`super::loss`] makes both from `z = (I, v)` with the rates v. Over a whole step z
//! is written out in the state, one row for each of the parts of `R·z`, so that the lanes
//! of a batch, each in its own mode, need nothing but their rows. The energy is the
//! voltage times the charge.

use super::held_rows::HeldRows;
use super::levels::Levels;
use super::loss::{DRIVING, Dissipation};
use super::system::{AxisSystem, Column, HELD};
use crate::model::axis::Axis;
use crate::model::state::{BETA_DOT, CURRENT, EPSILON, EPSILON_DOT};
use crate::numerics::width::One;

/// Parts of `R·z`: I and the rates of what drives.
pub(crate) const PARTS: usize = DRIVING + 1;

/// The armature over one length in one mode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldArmature {
    pub(crate) of: Dissipation<PARTS>,
    /// The parts of the whole step.
    pub(crate) rows: HeldRows<PARTS>,
    /// The charge of the whole step per first part.
    pub(crate) charge_per_part: f64,
}

impl HeldArmature {
    pub(super) fn new(axis: &Axis, system: &AxisSystem, levels: &Levels<HELD>) -> Self {
        let mut current = Column::<HELD>::zeros();
        current[CURRENT] = 1.0;
        let of = Dissipation::of_quantity(axis.motor.resistance_ohm, levels, &current);
        let factor = of.whole().1;
        let row = |part: usize| {
            let sum = |of_rate: &dyn Fn(usize) -> f64| -> f64 {
                let rates = 1..PARTS;
                rates
                    .map(|i| factor[(part, i)] * of_rate(BETA_DOT + i - 1))
                    .sum()
            };
            let state = |j: usize| factor[(part, 0)] * current[j] + sum(&|i| system.a[(i, j)]);
            [
                state(BETA_DOT),
                state(EPSILON),
                state(EPSILON_DOT),
                state(CURRENT),
                sum(&|i| system.load[i]),
                factor[(part, PARTS - 1)] * system.per_volt,
            ]
        };
        Self {
            rows: HeldRows::new(row),
            charge_per_part: factor[(0, 0)],
            of,
        }
    }

    /// Heat \[J\] and charge \[A s\] over the whole step from `x`, in the order of the
    /// lanes.
    #[inline(always)]
    pub(super) fn over_whole(&self, x: &Column<HELD>, voltage_v: f64) -> [f64; 2] {
        let parts = self.rows.times(x, &self.rows.0[DRIVING], voltage_v);
        let mut sum = 0.0;
        for part in parts {
            sum += part * part;
        }
        [self.of.coefficient * sum, self.charge_per_part * parts[0]]
    }

    /// The same over a part of the step, with the rates at `x`.
    pub(super) fn over(
        &self,
        x: &Column<HELD>,
        rates: &Column<DRIVING>,
        length_s: f64,
    ) -> [f64; 2] {
        let mut z = [x[CURRENT]; PARTS];
        z[1..].copy_from_slice(rates.as_slice());
        self.of.with_integral(One, z, length_s)
    }
}
