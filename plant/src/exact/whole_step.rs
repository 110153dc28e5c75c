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
//! and δ are states. They stand as columns of two quads, which of one run are a vector each.

use core::array;

use super::levels::BOUND_MARGIN;
use super::loss::{DRIVING, Dissipation, PARTS};
use super::sketch::cubic_strays;
use super::system::{AxisSystem, Column, DELTA, HELD, Matrix};
use super::table::{Quantity, Table};
use crate::model::axis::Axis;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON_DOT};
use crate::numerics::width::Width;
use crate::observe::extremes::ENERGIES;

/// The sums of a step in two quads: β, β̇, δ and ε̇ at its end, and β̈ at its start, I at its
/// end, ε̈ and İ at its start. With ε̇ at the start in place of I the second has the rates of β̇,
/// δ, ε̇ and I.
const SUMS: [[Sum; 4]; 2] = [
    [
        Sum::End(BETA),
        Sum::End(BETA_DOT),
        Sum::End(DELTA),
        Sum::End(EPSILON_DOT),
    ],
    [
        Sum::Rate(BETA_DOT),
        Sum::End(CURRENT),
        Sum::Rate(EPSILON_DOT),
        Sum::Rate(CURRENT),
    ],
];

/// A state at the end of a step, or its rate at the start.
#[derive(Clone, Copy)]
enum Sum {
    End(usize),
    Rate(usize),
}

/// The numbers of a whole step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WholeStep {
    /// What every sum has per β̇, δ, ε̇ and I, its constant, and what it has per volt.
    columns: [[[f64; 4]; 2]; DRIVING + 2],
    /// T/3 \[s\].
    third_s: f64,
    /// How far δ may stray from the cubic with its values and slopes at both ends, and the
    /// current (where it is limited) and what the guide's guard looks at from their chords,
    /// per rate of β̇, δ, ε̇ and I.
    strays: [[f64; DRIVING]; 3],
    /// c and R of the damper's heat by columns, where there is one.
    joint: Option<(f64, [[f64; 4]; DRIVING])>,
    /// Those of the armature's, and R's last row.
    armature: (f64, [[f64; 4]; PARTS], f64),
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
        let mut columns = [[[0.0; 4]; 2]; DRIVING + 2];
        for (quad, sums) in SUMS.iter().enumerate() {
            for (place, sum) in sums.iter().enumerate() {
                let (m, drift, per_volt, row) = match *sum {
                    Sum::End(row) => (&whole.transition, &drift, &per_volt, row),
                    Sum::Rate(row) => (&system.a, &system.load, &volt, row),
                };
                for (j, column) in columns.iter_mut().take(DRIVING).enumerate() {
                    column[quad][place] = m[(row, BETA_DOT + j)];
                }
                columns[DRIVING][quad][place] = drift[row];
                columns[DRIVING + 1][quad][place] = per_volt[row];
            }
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
                array::from_fn(|j| strays[j + 1])
            }
            // The points of the cubic lie about the ends: its chord is no worse.
            None => strays(Some(Quantity::Delta)),
        };
        let (resistance_ohm, factor) = armature.whole();
        Self {
            columns,
            third_s: whole.length_s / 3.0,
            strays: [gap, strays(limited), strays(Quantity::of_guide(guide))],
            joint: joint.map(|joint| {
                let (damping_nms_per_rad, factor) = joint.whole();
                (damping_nms_per_rad, columns_of(&factor))
            }),
            armature: (
                resistance_ohm,
                columns_of(&factor),
                factor[(DRIVING, DRIVING)],
            ),
        }
    }

    /// Both quads of sums from x = (β, β̇, δ, ε̇, I). The voltage comes last because it is known
    /// last.
    #[inline(always)]
    pub(crate) fn sums<W: Width>(
        &self,
        w: W,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> [W::Quad; 2] {
        let [constants, others] = &self.columns[DRIVING];
        let beta = x[BETA] + w.splat(constants[0]);
        let constants = w.with_part(w.numbers(constants), 0, beta);
        [
            self.sums_of(w, 0, x, constants, voltage_v),
            self.sums_of(w, 1, x, w.numbers(others), voltage_v),
        ]
    }

    /// One of them with its constants.
    #[inline(always)]
    fn sums_of<W: Width>(
        &self,
        w: W,
        quad: usize,
        x: &[W::Vector; HELD],
        constants: W::Quad,
        voltage_v: W::Vector,
    ) -> W::Quad {
        let [a, b, c, d, _, volts] = &self.columns;
        let rotor = w.multiples(&a[quad], x[BETA_DOT]) + w.multiples(&b[quad], x[DELTA]);
        let joint = w.multiples(&c[quad], x[EPSILON_DOT]) + w.multiples(&d[quad], x[CURRENT]);
        ((rotor + joint) + constants) + w.multiples(&volts[quad], voltage_v)
    }

    /// x(T) from x = (β, β̇, δ, ε̇, I).
    #[inline(always)]
    pub(crate) fn end<W: Width>(
        &self,
        w: W,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> [W::Vector; HELD] {
        let [states, others] = self.sums(w, x, voltage_v);
        let [beta, beta_dot, delta, epsilon_dot] = w.parts(states);
        let [_, current, ..] = w.parts(others);
        [beta, beta_dot, delta, epsilon_dot, current]
    }

    /// The rates of all states at x.
    #[inline(always)]
    pub(crate) fn rates<W: Width>(
        &self,
        w: W,
        x: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> [W::Vector; HELD] {
        let [_, others] = self.sums(w, x, voltage_v);
        let [beta, _, epsilon, current] = w.parts(others);
        [x[BETA_DOT], beta, x[EPSILON_DOT], epsilon, current]
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
    pub(crate) fn gap_strays<W: Width>(&self, w: W, sizes: W::Quad) -> W::Vector {
        times_sizes(w, &self.strays[0], sizes)
    }

    /// The same of a limited current.
    #[inline(always)]
    pub(crate) fn current_strays<W: Width>(&self, w: W, sizes: W::Quad) -> W::Vector {
        times_sizes(w, &self.strays[1], sizes)
    }

    /// The same of what the guide's guard looks at.
    #[inline(always)]
    pub(crate) fn guide_strays<W: Width>(&self, w: W, sizes: W::Quad) -> W::Vector {
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
            let parts = w.upper_times(factor, rates);
            let [a, b, c, d] = w.parts(parts * parts);
            joint_j = w.splat(*damping_nms_per_rad) * (((a + b) + c) + d);
        }
        let [a, b, c, d] = *rates;
        let (resistance_ohm, factor, last) = &self.armature;
        let parts = w.upper_times(factor, &[current, a, b, c, d]);
        let last = w.splat(*last) * d;
        let [first, ..] = w.parts(parts);
        let [a, b, c, d] = w.parts(parts * parts);
        let charge_as = w.splat(factor[0][0]) * first;
        let armature_j = w.splat(*resistance_ohm) * ((((a + b) + c) + d) + last * last);
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
        let term = |j: usize| w.abs(w.splat(self.columns[j][0][DELTA]) * x[BETA_DOT + j]);
        let volts = w.splat(self.columns[DRIVING + 1][0][DELTA]);
        (((term(0) + term(1)) + term(2)) + term(3)) + w.abs(volts * voltage_v)
    }
}

/// The first four rows of a matrix, column by column.
fn columns_of<const N: usize>(m: &Matrix<N>) -> [[f64; 4]; N] {
    array::from_fn(|j| array::from_fn(|i| m[(i, j)]))
}

/// Magnitudes of the rates of β̇, δ, ε̇ and I, from the second quad of sums and ε̇ at the start.
#[inline(always)]
pub(crate) fn sizes_of<W: Width>(w: W, others: W::Quad, epsilon_dot: W::Vector) -> W::Quad {
    // In the place of I.
    w.quad_abs(w.with_part(others, 1, epsilon_dot))
}

/// `Σ c_j·|v_j|`.
#[inline(always)]
pub(crate) fn times_sizes<W: Width>(w: W, row: &[f64; DRIVING], sizes: W::Quad) -> W::Vector {
    let [a, b, c, d] = w.parts(w.numbers(row) * sizes);
    (a + b) + (c + d)
}
