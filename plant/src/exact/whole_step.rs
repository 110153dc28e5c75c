//! A whole step under a held voltage in one mode, of one run or of many side by side: the
//! states at its end, the rates at its start, and what these make of bounds and heat.
//!
//! From x = (β̇, δ, ε̇, I) under V
//!
//! ```text
//! x(T) = Φ·x + ψ(T)·load + ψ(T)·(0, 0, 0, 1/L)·V,   v = A·x + u
//! ```
//!
//! are sums of one shape: five for the states, three for the rates of β̇, ε̇ and I; those of β
//! and δ are states. The sums stand as columns, as those of neighbours then run beside each other.

use super::levels::BOUND_MARGIN;
use super::loss::{DRIVING, Dissipation, PARTS, squared};
use super::sketch::cubic_strays;
use super::system::{AxisSystem, Column, DELTA, HELD, Matrix};
use super::table::{Quantity, Table};
use crate::model::axis::Axis;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON_DOT};
use crate::numerics::width::Width;
use crate::observe::extremes::ENERGIES;

/// The states whose rates are no states.
const ACCELERATED: [usize; 3] = [BETA_DOT, EPSILON_DOT, CURRENT];

/// Sums of a step.
const ROWS: usize = HELD + ACCELERATED.len();

/// The numbers of a whole step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WholeStep {
    /// What every sum has per β̇, δ, ε̇ and I, its constant, and what it has per volt.
    columns: [[f64; ROWS]; DRIVING + 2],
    /// T/3 \[s\].
    third_s: f64,
    /// How far δ may stray from the cubic with its values and slopes at both ends, and the
    /// current (where it is limited) and what the guide's guard looks at from their chords,
    /// per rate of β̇, δ, ε̇ and I.
    strays: [[f64; DRIVING]; 3],
    /// c and R of the damper's heat, where there is one.
    joint: Option<(f64, Matrix<DRIVING>)>,
    /// Those of the armature's.
    armature: (f64, Matrix<PARTS>),
}

impl WholeStep {
    /// Of an axis in a mode of its guide, with the heat of damper and armature.
    pub(super) fn new(
        axis: &Axis,
        (system, table): (&AxisSystem, &Table<HELD>),
        guide: GuideMode,
        (joint, armature): (Option<&Dissipation<DRIVING>>, &Dissipation<PARTS>),
    ) -> Self {
        let whole = &table.levels.steps[0];
        let mut volt = Column::<HELD>::zeros();
        volt[CURRENT] = system.per_volt;
        let (drift, per_volt) = (whole.integral * system.load, whole.integral * volt);
        let mut columns = [[0.0; ROWS]; DRIVING + 2];
        for row in 0..HELD {
            for (j, column) in columns.iter_mut().take(DRIVING).enumerate() {
                column[row] = whole.transition[(row, BETA_DOT + j)];
            }
            columns[DRIVING][row] = drift[row];
            columns[DRIVING + 1][row] = per_volt[row];
        }
        for (row, state) in (HELD..).zip(ACCELERATED) {
            for (j, column) in columns.iter_mut().take(DRIVING).enumerate() {
                column[row] = system.a[(state, BETA_DOT + j)];
            }
            columns[DRIVING][row] = system.load[state];
            columns[DRIVING + 1][row] = volt[state];
        }
        let strays = |quantity: Option<Quantity>| {
            quantity.map_or([0.0; DRIVING], |quantity| {
                table.quantity(quantity).chords(BOUND_MARGIN)
            })
        };
        let limited = axis.stage.limits().map(|_| Quantity::Current);
        let delta = table.row(Quantity::Delta);
        let gap = match &table.grid {
            Some(grid) => {
                let strays = cubic_strays(grid, &table.levels.a, delta) * BOUND_MARGIN;
                core::array::from_fn(|j| strays[j + 1])
            }
            // The points of the cubic lie about the ends: its chord is no worse.
            None => strays(Some(Quantity::Delta)),
        };
        Self {
            columns,
            third_s: whole.length_s / 3.0,
            strays: [gap, strays(limited), strays(Quantity::of_guide(guide))],
            joint: joint.map(Dissipation::whole),
            armature: armature.whole(),
        }
    }

    /// Sum number `row`. The voltage comes last because it is known last.
    #[inline(always)]
    fn sum<W: Width>(
        &self,
        w: W,
        row: usize,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> W::Vector {
        let [a, b, c, d, constants, volts] = &self.columns;
        let rotor = w.splat(a[row]) * x[BETA_DOT] + w.splat(b[row]) * x[DELTA];
        let joint = w.splat(c[row]) * x[EPSILON_DOT] + w.splat(d[row]) * x[CURRENT];
        let mut constant = w.splat(constants[row]);
        if row == BETA {
            constant = x[BETA] + constant;
        }
        ((rotor + joint) + constant) + w.splat(volts[row]) * voltage_v
    }

    /// x(T) from x = (β, β̇, δ, ε̇, I).
    #[inline(always)]
    pub(crate) fn end<W: Width>(
        &self,
        w: W,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> [W::Vector; HELD] {
        let mut end = *x;
        for (row, end) in end.iter_mut().enumerate() {
            *end = self.sum(w, row, x, voltage_v);
        }
        end
    }

    /// The rates of all states at x.
    #[inline(always)]
    pub(crate) fn rates<W: Width>(
        &self,
        w: W,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> [W::Vector; HELD] {
        let mut rates = [
            x[BETA_DOT],
            x[BETA_DOT],
            x[EPSILON_DOT],
            x[EPSILON_DOT],
            x[CURRENT],
        ];
        for (row, state) in (HELD..).zip(ACCELERATED) {
            rates[state] = self.sum(w, row, x, voltage_v);
        }
        rates
    }

    /// The control points of δ's cubic between its ends, in Bernstein form: all four bound it.
    #[inline(always)]
    pub(crate) fn inner_points<W: Width>(
        &self,
        w: W,
        [delta, end]: [W::Vector; 2],
        [speed, end_speed]: [W::Vector; 2],
    ) -> [W::Vector; 2] {
        let third_s = w.splat(self.third_s);
        [delta + third_s * speed, end - third_s * end_speed]
    }

    /// How far δ strays from its cubic at most, by the magnitudes of the rates of β̇, δ, ε̇
    /// and I.
    #[inline(always)]
    pub(crate) fn gap_strays<W: Width>(&self, w: W, sizes: &[W::Vector; DRIVING]) -> W::Vector {
        times_sizes(w, &self.strays[0], sizes)
    }

    /// The same of a limited current.
    #[inline(always)]
    pub(crate) fn current_strays<W: Width>(&self, w: W, sizes: &[W::Vector; DRIVING]) -> W::Vector {
        times_sizes(w, &self.strays[1], sizes)
    }

    /// The same of what the guide's guard looks at.
    #[inline(always)]
    pub(crate) fn guide_strays<W: Width>(&self, w: W, sizes: &[W::Vector; DRIVING]) -> W::Vector {
        times_sizes(w, &self.strays[2], sizes)
    }

    /// The energies of the step \[J\] from where the current and the rates are these.
    #[inline(always)]
    pub(crate) fn energies<W: Width>(
        &self,
        w: W,
        (current, rates): (W::Vector, &[W::Vector; DRIVING]),
        voltage_v: W::Vector,
    ) -> [W::Vector; ENERGIES] {
        let mut joint_j = w.splat(0.0);
        if let Some((damping_nms_per_rad, factor)) = &self.joint {
            joint_j = w.splat(*damping_nms_per_rad) * squared(w, factor, rates).0;
        }
        let [a, b, c, d] = *rates;
        let (resistance_ohm, factor) = &self.armature;
        let (sum, first) = squared(w, factor, &[current, a, b, c, d]);
        let charge_as = w.splat(factor[(0, 0)]) * first;
        let armature_j = w.splat(*resistance_ohm) * sum;
        [joint_j, armature_j, voltage_v * charge_as]
    }

    /// Sum of the magnitudes of the terms that make up δ at the end.
    #[inline(always)]
    pub(crate) fn terms_of_delta<W: Width>(
        &self,
        w: W,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> W::Vector {
        let term = |j: usize| w.abs(w.splat(self.columns[j][DELTA]) * x[BETA_DOT + j]);
        let volts = w.splat(self.columns[DRIVING + 1][DELTA]);
        (((term(0) + term(1)) + term(2)) + term(3)) + w.abs(volts * voltage_v)
    }
}

/// `Σ c_j·|v_j|`.
#[inline(always)]
pub(crate) fn times_sizes<W: Width>(
    w: W,
    row: &[f64; DRIVING],
    sizes: &[W::Vector; DRIVING],
) -> W::Vector {
    let [a, b, c, d] = row.map(
        #[inline(always)]
        |number| w.splat(number),
    );
    (a * sizes[0] + b * sizes[1]) + (c * sizes[2] + d * sizes[3])
}
