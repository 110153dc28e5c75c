//! The numbers of one step over all lanes: what a lane's mode decides.

use super::loss::LaneLoss;
use super::width::Width;
pub(crate) use crate::exact::DRIVING;
use crate::exact::{AxisSystem, BOUND_MARGIN, FIGURES, HELD, HeldTable, Quantity, SLOPES, Sketch};
use crate::state::{BETA_DOT, CURRENT, EPSILON_DOT};

/// Coefficients of the four driving states, one number per lane.
pub(crate) type Row<W> = [<W as Width>::Array; DRIVING];

/// One step of all lanes.
#[derive(Debug, Clone)]
pub(crate) struct Phase<W: Width> {
    pub(crate) length_ns: u64,
    pub(crate) transition: [Row<W>; HELD],
    pub(crate) drift: [W::Array; HELD],
    pub(crate) per_volt: [W::Array; HELD],
    /// How far δ may stray from its chord, per change of the states.
    pub(crate) gap_bound: Row<W>,
    /// Changes of ẍ, I, p·γ and p·β above which they are monotone, likewise.
    pub(crate) slopes: [Row<W>; FIGURES],
    /// How far they may stray from their chords, likewise.
    pub(crate) chords: [Row<W>; FIGURES],
    /// 1 where the joint is closed, else 0.
    pub(crate) closed: W::Array,
    /// Whether what follows has the numbers of the open and the closed joint.
    known: [bool; 2],
    pub(crate) rates: LaneRates,
    /// δ and the figures as polynomials over the step.
    pub(crate) gap: LaneSketch,
    pub(crate) figures: [LaneSketch; FIGURES],
    /// What the joint's damper takes.
    pub(crate) loss: LaneLoss,
}

/// β̈, ε̈ and İ at the start of a step with the joint open and closed: per
/// driving state, constant, and per volt.
#[derive(Debug, Clone)]
pub(crate) struct LaneRates {
    rows: [[[f64; 2]; DRIVING]; 3],
    load: [[f64; 2]; 3],
    per_volt: f64,
}

/// A quantity over the step in Bernstein form (see [`Sketch`]), with the joint
/// open and closed: a joint that changes is frequent, a look at this is not.
#[derive(Debug, Clone)]
pub(crate) struct LaneSketch {
    /// What each coefficient adds to the one before it, per rate.
    increments: [[[f64; 2]; HELD]; SLOPES],
    /// What the polynomial may be off by, per |rate|. At first a bound that
    /// excludes nothing, and so it stays without a sketch.
    stray: [[f64; 2]; HELD],
}

/// The states that [`LaneRates`] has numbers for.
const ACCELERATED: [usize; 3] = [BETA_DOT, EPSILON_DOT, CURRENT];

impl<W: Width> Phase<W> {
    pub(crate) fn new(length_ns: u64) -> Self {
        let zero = W::array(0.0);
        let sketch = LaneSketch {
            increments: [[[0.0; 2]; HELD]; SLOPES],
            stray: [[f64::INFINITY; 2]; HELD],
        };
        Self {
            length_ns,
            transition: [[zero; DRIVING]; HELD],
            drift: [zero; HELD],
            per_volt: [zero; HELD],
            gap_bound: [zero; DRIVING],
            slopes: [[zero; DRIVING]; FIGURES],
            chords: [[zero; DRIVING]; FIGURES],
            rates: LaneRates {
                rows: [[[0.0; 2]; DRIVING]; 3],
                load: [[0.0; 2]; 3],
                per_volt: 0.0,
            },
            figures: core::array::from_fn(|_| sketch.clone()),
            gap: sketch,
            loss: LaneLoss::default(),
            closed: zero,
            known: [false; 2],
        }
    }

    /// A state at the end of the step, in the order of `Kernel::step`.
    #[inline(always)]
    pub(crate) fn row(
        &self,
        w: W,
        state: usize,
        from: &[W::Vector; DRIVING],
        base: W::Vector,
        voltage_v: W::Vector,
    ) -> W::Vector {
        let phi = &self.transition[state];
        let rotor = w.load(&phi[0]) * from[0] + w.load(&phi[1]) * from[1];
        let joint = w.load(&phi[2]) * from[2] + w.load(&phi[3]) * from[3];
        ((rotor + joint) + base) + w.load(&self.per_volt[state]) * voltage_v
    }

    /// Sets one lane to the step of a table.
    pub(crate) fn set(&mut self, lane: usize, table: &HeldTable, pitch_m_per_rad: f64) {
        let kernel = &table.kernel;
        for row in 0..HELD {
            for (to, from) in self.transition[row].iter_mut().zip(&kernel.transition[row]) {
                to.as_mut()[lane] = *from;
            }
            self.drift[row].as_mut()[lane] = kernel.drift[row];
            self.per_volt[row].as_mut()[lane] = kernel.per_volt[row];
        }
        let gap = table.table.quantity(Quantity::Delta);
        for j in 0..DRIVING {
            self.gap_bound[j].as_mut()[lane] = BOUND_MARGIN * gap.bounds.per_change[j + 1];
        }
        let closed = table.is_closed();
        let known = self.known[usize::from(closed)];
        self.closed.as_mut()[lane] = f64::from(u8::from(closed));
        self.known[usize::from(closed)] = true;
        if !known {
            self.rates.set(closed, &table.system);
            self.gap.set(closed, gap.sketch.as_ref(), 1.0);
            if closed {
                self.loss = LaneLoss::new(table);
            }
        }
        let p = pitch_m_per_rad;
        let figures = [
            (Quantity::ScrewAcceleration, p),
            (Quantity::Current, 1.0),
            (Quantity::ScrewAngle, p),
            (Quantity::GearAngle, p),
        ];
        for (i, (quantity, scale)) in figures.into_iter().enumerate() {
            let linear = table.table.quantity(quantity);
            for j in 0..DRIVING {
                let slope = linear.bounds.slope_per_change[j + 1];
                let chord = linear.bounds.per_change[j + 1];
                self.slopes[i][j].as_mut()[lane] = BOUND_MARGIN * scale.abs() * slope;
                self.chords[i][j].as_mut()[lane] = BOUND_MARGIN * scale.abs() * chord;
            }
            if !known {
                self.figures[i].set(closed, linear.sketch.as_ref(), scale);
            }
        }
    }
}

impl LaneRates {
    /// Sets the numbers of the open or the closed joint.
    fn set(&mut self, closed: bool, system: &AxisSystem) {
        let place = usize::from(closed);
        for (i, state) in ACCELERATED.into_iter().enumerate() {
            for (j, to) in self.rows[i].iter_mut().enumerate() {
                to[place] = system.a[(state, j + 1)];
            }
            self.load[i][place] = system.load[state];
        }
        self.per_volt = system.per_volt;
    }

    /// The rates of all states: β, β̇, δ, ε̇ and I.
    #[inline(always)]
    pub(crate) fn at<W: Width>(
        &self,
        w: W,
        closed: W::Mask,
        from: &[W::Vector; DRIVING],
        voltage_v: W::Vector,
    ) -> [W::Vector; HELD] {
        let mut rates = [from[0]; 3];
        for (rate, (row, load)) in rates.iter_mut().zip(self.rows.iter().zip(&self.load)) {
            let [a, b, c, d] = row;
            let rotor = paired(w, closed, a) * from[0] + paired(w, closed, b) * from[1];
            let joint = paired(w, closed, c) * from[2] + paired(w, closed, d) * from[3];
            *rate = (rotor + joint) + paired(w, closed, load);
        }
        let current = rates[2] + w.splat(self.per_volt) * voltage_v;
        [from[0], rates[0], from[2], rates[1], current]
    }
}

impl LaneSketch {
    /// Sets the numbers of the open or the closed joint.
    fn set(&mut self, closed: bool, sketch: Option<&Sketch<HELD>>, scale: f64) {
        let Some(sketch) = sketch else { return };
        let place = usize::from(closed);
        for (increment, slopes) in self.increments.iter_mut().zip(&sketch.slopes) {
            for (to, slope) in increment.iter_mut().zip(slopes.iter()) {
                to[place] = scale * slope / 11.0;
            }
        }
        for (to, stray) in self.stray.iter_mut().zip(sketch.stray.iter()) {
            to[place] = BOUND_MARGIN * scale.abs() * stray;
        }
    }

    /// What each coefficient adds to the one before it.
    #[inline(always)]
    pub(crate) fn rises<W: Width>(
        &self,
        w: W,
        closed: W::Mask,
        rates: &[W::Vector; HELD],
    ) -> [W::Vector; SLOPES] {
        let mut rises = [rates[0]; SLOPES];
        for (place, increment) in rises.iter_mut().zip(&self.increments) {
            let [a, b, c, d, e] = increment;
            let rotor = paired(w, closed, a) * rates[0] + paired(w, closed, b) * rates[1];
            let joint = paired(w, closed, c) * rates[2] + paired(w, closed, d) * rates[3];
            *place = (rotor + joint) + paired(w, closed, e) * rates[4];
        }
        rises
    }

    /// What the polynomial may be off by, its own rounding and that of a start
    /// of the given size included.
    #[inline(always)]
    pub(crate) fn stray<W: Width>(
        &self,
        w: W,
        closed: W::Mask,
        rates: &[W::Vector; HELD],
        size: W::Vector,
    ) -> W::Vector {
        let mut sum = size * w.splat(ROUNDING);
        for (pair, rate) in self.stray.iter().zip(rates) {
            sum = sum + paired(w, closed, pair) * w.abs(*rate);
        }
        sum
    }
}

/// The lanes in which `closed` is 1 and not 0.
#[inline(always)]
pub(crate) fn closed_lanes<W: Width>(w: W, closed: &W::Array) -> W::Mask {
    w.greater(w.load(closed), w.splat(0.5))
}

/// The number of the open or the closed joint, lane by lane.
#[inline(always)]
fn paired<W: Width>(w: W, closed: W::Mask, pair: &[f64; 2]) -> W::Vector {
    w.select(closed, w.splat(pair[1]), w.splat(pair[0]))
}

/// Twelve additions, and what the terms at the start have lost.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// `Σ row_j·x_j` over the driving states.
#[inline(always)]
pub(crate) fn dot<W: Width>(w: W, row: &Row<W>, x: &[W::Vector; DRIVING]) -> W::Vector {
    (w.load(&row[0]) * x[0] + w.load(&row[1]) * x[1])
        + (w.load(&row[2]) * x[2] + w.load(&row[3]) * x[3])
}
