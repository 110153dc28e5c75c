//! The solution around a change of contact, lane by lane: the numbers of one
//! step with the joint open or closed, and the operations of `exact::grid` on
//! them in their order, so that every lane sees those of the single run.
//!
//! Numbers that are zero for every axis are left out: β drives nothing, and the
//! slopes of β and δ are states.

use crate::exact::{
    BOUND_MARGIN, CELLS, Column, DRIVING, Dissipation, HELD, HeldTable, MOST_POLISHING, Matrix,
    PARTS, Quantity, SLOPES, TERMS, heat_of_part,
};
use crate::model::axis::Axis;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT};
use crate::numerics::width::Width;
use crate::observe::extremes::{ENERGIES, FIGURES};

/// States in lanes: β, β̇, δ, ε̇ and I.
pub(super) type States<W> = [<W as Width>::Vector; HELD];

/// The states whose rates are no states themselves.
const ACCELERATED: [usize; 3] = [BETA_DOT, EPSILON_DOT, CURRENT];

/// The numbers of one step.
#[derive(Debug, Clone)]
pub(super) struct LaneGrid {
    pub(super) length_s: f64,
    half_s: f64,
    /// The rates of [`ACCELERATED`] per driving state.
    a: [[f64; DRIVING]; 3],
    /// `ψ` at the points of the grid: β per β̇, and all states per rate of the
    /// driving ones.
    points: Vec<(f64, [[f64; DRIVING]; HELD])>,
    /// `Aⁿ·hⁿ⁺¹/(n + 1)!` from n = 1 on.
    terms: [[[f64; DRIVING]; HELD]; TERMS - 1],
    /// δ over the step as a sketch.
    pub(super) slopes: [[f64; DRIVING]; SLOPES],
    pub(super) stray: [f64; DRIVING],
    /// Bounds of how far the figures stray from their chords over the step, or twice
    /// that over a part of it.
    pub(super) chords: [[f64; DRIVING]; FIGURES],
    guide: GuideMode,
    /// a0 against the motion \[N\].
    resistance_n: f64,
    /// Bound of how far what the guide's guard looks at strays from its chord over the step,
    /// or twice that over a part of it; 0 without friction.
    guide_chord: [f64; DRIVING],
    /// k and c while a flank carries, else 0.
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// See `Axis::current_noise`.
    pub(super) current_noise: f64,
    /// What makes the energies of a part of the step.
    loss: Option<Dissipation<DRIVING>>,
    armature: Dissipation<PARTS>,
}

impl LaneGrid {
    /// The numbers of a table; `None` where a sample has no sketch, or the joint
    /// no gap.
    pub(super) fn of(table: &HeldTable, axis: &Axis) -> Option<Self> {
        let joint = axis.joint?;
        let grid = table.table.grid.as_ref()?;
        let gap = table.table.quantity(Quantity::Delta);
        let sketch = gap.sketch.as_ref()?;
        let system = &table.system;
        let driving = |row: &Column<HELD>| core::array::from_fn(|j| row[j + 1]);
        let rows = |matrix: &Matrix<HELD>| {
            core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j + 1)]))
        };
        let mut terms = [[[0.0; DRIVING]; HELD]; TERMS - 1];
        for (to, matrix) in terms.iter_mut().zip(&grid.terms[1..]) {
            *to = rows(matrix);
        }
        let carries = if table.closed { 1.0 } else { 0.0 };
        let mut noisy = *axis;
        noisy.set_parting_noise(0.0, table.length_s());
        Some(Self {
            current_noise: noisy.current_noise,
            length_s: grid.length_s,
            half_s: grid.length_s / 32.0 / 2.0,
            a: ACCELERATED.map(|i| core::array::from_fn(|j| system.a[(i, j + 1)])),
            points: grid
                .integrals
                .iter()
                .map(|psi| (psi[(BETA, BETA)], rows(psi)))
                .collect(),
            terms,
            slopes: sketch.slopes.each_ref().map(driving),
            stray: driving(&sketch.stray),
            chords: figures(axis).map(|(quantity, scale)| {
                let linear = table.table.quantity(quantity);
                linear.chords(scale.abs() * BOUND_MARGIN)
            }),
            guide: table.guide,
            resistance_n: table.guide.direction() * axis.resistance.constant_n,
            guide_chord: Quantity::of_guide(table.guide).map_or([0.0; DRIVING], |quantity| {
                table.table.quantity(quantity).chords(BOUND_MARGIN)
            }),
            stiffness: carries * joint.stiffness_nm_per_rad,
            damping: carries * joint.damping_nms_per_rad,
            loss: table.loss.clone(),
            armature: table.armature.clone(),
        })
    }

    /// The energies of a part of the step from where the current and the rates are these.
    #[inline(always)]
    pub(super) fn energies<W: Width>(
        &self,
        w: W,
        (current, rate): (W::Vector, &States<W>),
        voltage_v: W::Vector,
        length_s: W::Vector,
    ) -> [W::Vector; ENERGIES] {
        let [_, rates @ ..] = *rate;
        let heat = (self.loss.as_ref(), &self.armature);
        let [joint_j, armature_j, charge_as] = heat_of_part(w, heat, (current, &rates), length_s);
        [joint_j, armature_j, voltage_v * charge_as]
    }

    /// ẍ \[m/s²\] with δ counted from an offset, in the order of
    /// `Axis::carriage_acceleration_mps2`.
    #[inline(always)]
    pub(super) fn acceleration<W: Width>(
        &self,
        w: W,
        axis: &Axis,
        offset: W::Vector,
        y: &States<W>,
    ) -> W::Vector {
        if self.guide == GuideMode::Stuck {
            return w.splat(0.0);
        }
        let p = w.splat(axis.pitch_m_per_rad);
        let linear = w.splat(axis.resistance.linear_ns_per_rad);
        let speed = y[BETA_DOT] - y[EPSILON_DOT];
        let force = w.splat(self.resistance_n) + linear * speed;
        let force = force + w.splat(axis.load_force_n);
        // No torque is 0, not −0.
        let torque = self.flank_torque(w, offset, y) + w.splat(0.0);
        (torque - p * force) * w.splat(axis.pitch_per_inertia)
    }

    /// Ψ while a flank carries, else 0.
    #[inline(always)]
    fn flank_torque<W: Width>(&self, w: W, offset: W::Vector, y: &States<W>) -> W::Vector {
        let delta = y[EPSILON] - offset;
        w.splat(self.stiffness) * delta + w.splat(self.damping) * y[EPSILON_DOT]
    }

    /// The lanes in which guide and current keep their modes over a part of the step between
    /// two states; the magnitudes of the rates at its start, and how far the current may
    /// stray from its chord, are these.
    #[inline(always)]
    pub(super) fn others_hold<W: Width>(
        &self,
        w: W,
        (axis, offset): (&Axis, W::Vector),
        [from, to]: [&States<W>; 2],
        (sizes, current_strays): (&States<W>, W::Vector),
    ) -> u64 {
        let mut holds = (1 << W::LANES) - 1;
        let two = w.splat(2.0);
        if let Some([_, limit_a]) = axis.stage.limits() {
            let ends = w.max(w.abs(from[CURRENT]), w.abs(to[CURRENT]));
            let within = w.splat(limit_a) - ends;
            holds &= w.bits(w.greater(within, two * current_strays));
        }
        if self.guide != GuideMode::AsWritten {
            let strays = two * sum(w, &self.guide_chord, sizes);
            let (from, to) = (
                self.guide_guard(w, (axis, offset), from),
                self.guide_guard(w, (axis, offset), to),
            );
            holds &= w.bits(w.greater(w.min(from, to), strays));
        }
        holds
    }

    /// The guard of a guide with friction.
    #[inline(always)]
    fn guide_guard<W: Width>(
        &self,
        w: W,
        (axis, offset): (&Axis, W::Vector),
        y: &States<W>,
    ) -> W::Vector {
        if self.guide == GuideMode::Stuck {
            let torque = self.flank_torque(w, offset, y) - w.splat(axis.load_torque_nm());
            return w.splat(axis.holding_torque_nm) - w.abs(torque);
        }
        w.splat(self.guide.direction()) * (y[BETA_DOT] - y[EPSILON_DOT])
    }

    /// Makes γ̇ = 0 to the last bit where friction holds the screw.
    #[inline(always)]
    pub(super) fn hold<W: Width>(&self, y: &mut States<W>) {
        if self.guide == GuideMode::Stuck {
            y[EPSILON_DOT] = y[BETA_DOT];
        }
    }

    /// `A·x` but for what are states.
    #[inline(always)]
    fn driven<W: Width>(&self, w: W, x: &States<W>) -> [W::Vector; 3] {
        let [a, b, c] = &self.a;
        [sum(w, a, x), sum(w, b, x), sum(w, c, x)]
    }

    /// The solution around `time_s`, from `x` with that rate.
    #[inline(always)]
    pub(super) fn near<W: Width>(
        &self,
        w: W,
        x: &States<W>,
        rate: &States<W>,
        time_s: W::Vector,
    ) -> Local<W> {
        let cell_s = w.splat(self.length_s / 32.0);
        let mut cells = w.splat(0.0);
        for count in [16.0, 8.0, 4.0, 2.0, 1.0, 1.0] {
            let further = cells + w.splat(count);
            let beyond = w.greater(time_s, (further - w.splat(0.5)) * cell_s);
            cells = w.select(beyond, further, cells);
        }
        // The lanes' points of the grid, gathered.
        let numbers = w.stored(cells);
        let mut own = W::array(0.0);
        let mut psi = [[W::array(0.0); DRIVING]; HELD];
        for (lane, &cell) in numbers.as_ref().iter().enumerate() {
            let Some((beta, rows)) = self.points.get(index(cell)) else {
                continue;
            };
            own.as_mut()[lane] = *beta;
            for (to, from) in psi.iter_mut().zip(rows) {
                for (to, from) in to.iter_mut().zip(from) {
                    to.as_mut()[lane] = *from;
                }
            }
        }
        let mut change = *rate;
        for (state, (change, row)) in change.iter_mut().zip(&psi).enumerate() {
            let mut sum = w.load(&row[0]) * rate[1];
            if state == BETA {
                sum = w.load(&own) * rate[BETA] + sum;
            }
            for j in 1..DRIVING {
                sum = sum + w.load(&row[j]) * rate[j + 1];
            }
            *change = sum;
        }
        let mut centre = *x;
        for (x, change) in centre.iter_mut().zip(&change) {
            *x = *x + *change;
        }
        // A·x(t) + u = v + A·ψ(t)·v
        let driven = self.driven(w, &change);
        let more = [
            change[BETA_DOT],
            driven[0],
            change[EPSILON_DOT],
            driven[1],
            driven[2],
        ];
        let mut here = *rate;
        for (rate, more) in here.iter_mut().zip(more) {
            *rate = *rate + more;
        }
        let half_s = w.splat(self.half_s);
        let mut terms = [centre; TERMS + 1];
        for (term, rate) in terms[1].iter_mut().zip(&here) {
            *term = half_s * *rate;
        }
        for (slot, matrix) in terms[2..].iter_mut().zip(&self.terms) {
            for (to, row) in slot.iter_mut().zip(matrix) {
                *to = sum(w, row, &here);
            }
        }
        Local {
            centre_s: cells * cell_s,
            half_s,
            terms,
        }
    }
}

/// `Σ row_j·x_j` over the driving states, in their order.
#[inline(always)]
pub(super) fn sum<W: Width>(w: W, row: &[f64; DRIVING], x: &States<W>) -> W::Vector {
    let mut sum = w.splat(row[0]) * x[1];
    for j in 1..DRIVING {
        sum = sum + w.splat(row[j]) * x[j + 1];
    }
    sum
}

/// The number of a point of the grid.
// A whole number from 0 to the number of cells.
fn index(cell: f64) -> usize {
    (cell as usize).min(CELLS)
}

/// The solution around one point of the grid, in `σ = (t − centre)/half`.
pub(super) struct Local<W: Width> {
    centre_s: W::Vector,
    half_s: W::Vector,
    terms: [States<W>; TERMS + 1],
}

impl<W: Width> Local<W> {
    /// σ of a time.
    #[inline(always)]
    pub(super) fn sigma(&self, time_s: W::Vector) -> W::Vector {
        (time_s - self.centre_s) / self.half_s
    }

    /// The time at σ \[s\].
    #[inline(always)]
    pub(super) fn time_s(&self, sigma: W::Vector) -> W::Vector {
        self.centre_s + sigma * self.half_s
    }

    /// The state at σ.
    #[inline(always)]
    pub(super) fn at(&self, sigma: W::Vector) -> States<W> {
        let mut x = self.terms[TERMS];
        for term in self.terms.iter().rev().skip(1) {
            for (x, term) in x.iter_mut().zip(term) {
                *x = *x * sigma + *term;
            }
        }
        x
    }

    /// A zero of `sign·δ + offset` near σ, and the lanes of `asked` in which
    /// there is one.
    #[inline(always)]
    pub(super) fn zero_near(
        &self,
        w: W,
        (sign, offset): (W::Vector, W::Vector),
        mut sigma: W::Vector,
        asked: u64,
    ) -> (W::Vector, u64) {
        let mut coefficients = [sign; TERMS + 1];
        for (coefficient, term) in coefficients.iter_mut().zip(&self.terms) {
            *coefficient = sign * term[EPSILON];
        }
        coefficients[0] = coefficients[0] + offset;
        let mut rounding = w.splat(0.0);
        for c in &coefficients {
            rounding = rounding + w.splat(f64::EPSILON) * w.abs(*c);
        }
        let (mut done, mut left) = (w.greater(w.splat(0.0), w.splat(0.0)), asked);
        let mut found = 0;
        for _ in 0..MOST_POLISHING {
            let (mut value, mut slope) = (coefficients[TERMS], w.splat(0.0));
            for c in coefficients.iter().rev().skip(1) {
                slope = slope * sigma + value;
                value = value * sigma + *c;
            }
            let step = value / slope;
            sigma = w.select(done, sigma, sigma - step);
            left &= w.bits(w.at_most(w.abs(sigma), w.splat(1.25)));
            let small = w.at_most(w.abs(step), w.splat(8.0 * f64::EPSILON));
            done = w.either(done, w.either(w.at_most(w.abs(value), rounding), small));
            found = left & w.bits(done);
            if found == left {
                break;
            }
        }
        (sigma, found)
    }
}

/// The quantities behind the figures, and what they are multiplied with.
pub(super) fn figures(axis: &Axis) -> [(Quantity, f64); FIGURES] {
    let p = axis.pitch_m_per_rad;
    [
        (Quantity::ScrewAcceleration, p),
        (Quantity::Current, 1.0),
        (Quantity::ScrewAngle, p),
        (Quantity::GearAngle, p),
        // The power, per volt.
        (Quantity::Current, 1.0),
    ]
}
