//! The numbers of one step: those that all lanes share, and those that a lane's
//! mode decides.

use super::grid::{LaneGrid, figures};
use super::width::Width;
use crate::exact::{
    AxisSystem, BOUND_MARGIN, DRIVING, HELD, HeldTable, PARTS, PER_ROW, Quantity, SLOPES, Sketch,
    VALUES,
};
use crate::hybrid::Automaton;
use crate::model::axis::Axis;
use crate::model::joint::JointMode;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON_DOT};
use crate::observe::extremes::FIGURES;

/// One step of all groups: what depends on the state of the joint alone.
#[derive(Debug, Clone)]
pub(super) struct Phase {
    pub(super) length_ns: u64,
    /// True where the numbers of the open and the closed joint are known.
    known: [bool; 2],
    /// Those of the step, for the lanes.
    numbers: [[f64; NUMBERS]; 2],
    pub(super) rates: LaneRates,
    /// δ and the figures as polynomials over the step.
    pub(super) gap: LaneSketch,
    pub(super) figures: [LaneSketch; FIGURES],
    /// Changes of ẍ, I, p·γ and p·β above which they are monotone, per change of
    /// the driving states, and how far they may stray from their chords, with
    /// the joint open and closed.
    pub(super) slopes: [[[f64; DRIVING]; 2]; FIGURES],
    pub(super) chords: [[[f64; DRIVING]; 2]; FIGURES],
    /// The numbers of changes of contact, with the joint open and closed, where
    /// they can be followed side by side.
    pub(super) grids: [Option<LaneGrid>; 2],
}

/// One step of the lanes of a group: what depends on each lane's mode, number
/// by number (see [`numbers_of`]).
#[derive(Debug, Clone)]
pub(super) struct Steps<W: Width> {
    numbers: [W::Constant; NUMBERS],
    /// Room for what [`Width::in_pairs`] stores.
    room: [f64; ROWS],
    /// Numbers of the energy that the joint's damper takes.
    pub(super) loss: LaneLoss<W>,
    pub(super) knows_loss: bool,
}

/// Numbers of a step: the driving states' coefficients, a constant and a coefficient of the
/// voltage, each for all states and then all parts of the armature's heat (`HeldArmature`);
/// how far δ may stray from its chord, per change of the driving states; and the charge per
/// first part.
const NUMBERS: usize = ROWS * PER_ROW + DRIVING + 1;
const ROWS: usize = HELD + PARTS;

/// The numbers of a table.
pub(super) fn numbers_of(table: &HeldTable, axis: &Axis) -> [f64; NUMBERS] {
    let (kernel, armature) = (&table.kernel, table.armature(axis));
    let mut numbers = [0.0; NUMBERS];
    let columns = kernel.rows.0.iter().zip(&armature.rows.0);
    for (to, (states, parts)) in numbers.chunks_exact_mut(ROWS).zip(columns) {
        to[..HELD].copy_from_slice(states);
        to[HELD..].copy_from_slice(parts);
    }
    let rest = &mut numbers[ROWS * PER_ROW..];
    rest[..DRIVING].copy_from_slice(&kernel.gap_bound);
    rest[DRIVING] = armature.charge_per_part;
    numbers
}

/// β̈, ε̈ and İ at the start of a step with the joint open and closed: per
/// driving state, constant, and per volt.
#[derive(Debug, Clone)]
pub(super) struct LaneRates {
    rows: [[[f64; DRIVING]; 3]; 2],
    load: [[f64; 3]; 2],
    per_volt: f64,
}

/// A quantity over the step in Bernstein form (see [`Sketch`]), with the joint
/// open and closed.
#[derive(Debug, Clone)]
pub(super) struct LaneSketch {
    /// Rise of each coefficient over the one before it, rate by rate.
    columns: [[[f64; VALUES]; HELD]; 2],
    /// Error of the polynomial, per |rate|. At first a bound that
    /// excludes nothing, and so it stays without a sketch.
    stray: [[f64; HELD]; 2],
}

/// The states that [`LaneRates`] has numbers for.
const ACCELERATED: [usize; 3] = [BETA_DOT, EPSILON_DOT, CURRENT];

impl Phase {
    pub(super) fn new(length_ns: u64) -> Self {
        let sketch = LaneSketch {
            columns: [[[0.0; VALUES]; HELD]; 2],
            stray: [[f64::INFINITY; HELD]; 2],
        };
        Self {
            length_ns,
            known: [false; 2],
            numbers: [[0.0; NUMBERS]; 2],
            rates: LaneRates {
                rows: [[[0.0; DRIVING]; 3]; 2],
                load: [[0.0; 3]; 2],
                per_volt: 0.0,
            },
            figures: core::array::from_fn(|_| sketch.clone()),
            gap: sketch,
            slopes: [[[0.0; DRIVING]; 2]; FIGURES],
            chords: [[[0.0; DRIVING]; 2]; FIGURES],
            grids: [None, None],
        }
    }

    /// Takes over the numbers of a table; `false` if they are there already.
    pub(super) fn learn(&mut self, table: &HeldTable, axis: &Axis) -> bool {
        let closed = table.closed;
        let known = &mut self.known[usize::from(closed)];
        if core::mem::replace(known, true) {
            return false;
        }
        self.numbers[usize::from(closed)] = numbers_of(table, axis);
        self.rates.set(closed, &table.system);
        let gap = table.table.quantity(Quantity::Delta);
        self.gap.set(closed, gap.sketch.as_ref(), 1.0);
        for (i, (quantity, scale)) in figures(axis).into_iter().enumerate() {
            let linear = table.table.quantity(quantity);
            self.figures[i].set(closed, linear.sketch.as_ref(), scale);
            let bounds = &linear.bounds;
            for j in 0..DRIVING {
                let (slope, chord) = (bounds.slope_per_change[j + 1], bounds.per_change[j + 1]);
                let place = usize::from(closed);
                self.slopes[i][place][j] = BOUND_MARGIN * scale.abs() * slope;
                self.chords[i][place][j] = BOUND_MARGIN * scale.abs() * chord;
            }
        }
        self.grids[usize::from(closed)] = LaneGrid::of(table, axis);
        true
    }

    /// True if a guard of δ stays positive over a step of one lane, by the sketch:
    /// `guard` of every coefficient exceeds what that may be off by.
    #[inline(always)]
    pub(super) fn gap_holds(
        &self,
        closed: bool,
        from: &[f64; DRIVING],
        voltage_v: f64,
        guard: impl Fn(f64) -> f64,
    ) -> bool {
        let rates = self.rates.at(closed, from, voltage_v);
        let rises = self.gap.rises(closed, &rates);
        let stray = self.gap.stray(closed, &rates, from[1].abs());
        let mut delta = from[1];
        let mut holds = guard(delta) > stray;
        for rise in &rises[..SLOPES] {
            delta += rise;
            holds &= guard(delta) > stray;
        }
        holds
    }

    /// The numbers of a step with the joint open or closed and nothing else that
    /// matters, if they are known.
    pub(super) fn numbers(&self, closed: bool) -> Option<&[f64; NUMBERS]> {
        self.known[usize::from(closed)].then(|| &self.numbers[usize::from(closed)])
    }
}

impl<W: Width> Steps<W> {
    pub(super) fn new() -> Self {
        Self {
            numbers: [W::constant(0.0); NUMBERS],
            room: [0.0; ROWS],
            loss: LaneLoss::none(),
            knows_loss: false,
        }
    }

    #[inline(always)]
    fn number(&self, w: W, place: usize) -> W::Vector {
        w.load_constant(&self.numbers[place])
    }

    /// The states at the end of the step, in the order of `Kernel::step`, from the driving
    /// states and β; and `∫ I² dt` \[A² s\] and the charge \[A s\], in that of
    /// `HeldArmature::over_whole`.
    #[inline(always)]
    pub(super) fn step(
        &mut self,
        w: W,
        beta: W::Vector,
        from: &[W::Vector; DRIVING],
        voltage_v: W::Vector,
    ) -> ([W::Vector; HELD], [W::Vector; 2]) {
        let mut rows = [beta; ROWS];
        for (i, row) in rows.iter_mut().enumerate() {
            let number = |j: usize| self.number(w, j * ROWS + i);
            let rotor = number(0) * from[0] + number(1) * from[1];
            let joint = number(2) * from[2] + number(3) * from[3];
            let drift = number(DRIVING);
            let base = if i == BETA { beta + drift } else { drift };
            *row = ((rotor + joint) + base) + number(DRIVING + 1) * voltage_v;
        }
        w.in_pairs(&rows, &mut self.room);
        let [a, b, c, d, e, first, parts @ ..] = rows;
        let mut sum = first * first;
        for part in parts {
            sum = sum + part * part;
        }
        ([a, b, c, d, e], [sum, self.number(w, NUMBERS - 1) * first])
    }

    /// Bound of how far δ strays from its chord.
    #[inline(always)]
    pub(super) fn gap_strays(&self, w: W, change: &[W::Vector; DRIVING]) -> W::Vector {
        let bound = |j: usize| self.number(w, ROWS * PER_ROW + j);
        (bound(0) * change[0] + bound(1) * change[1])
            + (bound(2) * change[2] + bound(3) * change[3])
    }

    /// Takes over what the damper takes, if the table is that of a closed joint.
    pub(super) fn learn_loss(&mut self, table: &HeldTable) {
        if table.closed && !self.knows_loss {
            self.loss.set(table);
            self.knows_loss = true;
        }
    }

    /// Sets one lane to numbers of its own.
    pub(super) fn set(&mut self, lane: usize, numbers: &[f64; NUMBERS]) {
        for (to, from) in self.numbers.iter_mut().zip(numbers) {
            to.as_mut()[lane] = *from;
        }
    }
}

impl LaneRates {
    /// Sets the numbers of the open or the closed joint.
    fn set(&mut self, closed: bool, system: &AxisSystem) {
        let place = usize::from(closed);
        for (i, state) in ACCELERATED.into_iter().enumerate() {
            for (j, to) in self.rows[place][i].iter_mut().enumerate() {
                *to = system.a[(state, j + 1)];
            }
            self.load[place][i] = system.load[state];
        }
        self.per_volt = system.per_volt;
    }

    /// The rates of all states: β, β̇, δ, ε̇ and I.
    pub(super) fn at(&self, closed: bool, from: &[f64; DRIVING], voltage_v: f64) -> [f64; HELD] {
        let place = usize::from(closed);
        let mut rates = self.load[place];
        for (rate, row) in rates.iter_mut().zip(&self.rows[place]) {
            let rotor = row[0] * from[0] + row[1] * from[1];
            *rate += rotor + (row[2] * from[2] + row[3] * from[3]);
        }
        let current = rates[2] + self.per_volt * voltage_v;
        [from[0], rates[0], from[2], rates[1], current]
    }
}

impl LaneSketch {
    /// Sets the numbers of the open or the closed joint.
    fn set(&mut self, closed: bool, sketch: Option<&Sketch<HELD>>, scale: f64) {
        let Some(sketch) = sketch else { return };
        let place = usize::from(closed);
        for (i, slopes) in sketch.slopes.iter().enumerate() {
            for (column, slope) in self.columns[place].iter_mut().zip(slopes.iter()) {
                column[i] = scale * slope / 11.0;
            }
        }
        for (to, stray) in self.stray[place].iter_mut().zip(sketch.stray.iter()) {
            *to = BOUND_MARGIN * scale.abs() * stray;
        }
    }

    /// Rise of each coefficient over the one before it; the last number is 0.
    pub(super) fn rises(&self, closed: bool, rates: &[f64; HELD]) -> [f64; VALUES] {
        let mut rises = [0.0; VALUES];
        for (column, rate) in self.columns[usize::from(closed)].iter().zip(rates) {
            for (rise, number) in rises.iter_mut().zip(column) {
                *rise += number * rate;
            }
        }
        rises
    }

    /// Error of the polynomial, its own rounding and that of a start
    /// of the given size included.
    pub(super) fn stray(&self, closed: bool, rates: &[f64; HELD], size: f64) -> f64 {
        let mut sum = size * ROUNDING;
        for (stray, rate) in self.stray[usize::from(closed)].iter().zip(rates) {
            sum += stray * rate.abs();
        }
        sum
    }
}

/// Twelve additions, and what the terms at the start have lost.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// `Σ row_j·x_j` over the driving states, with the numbers of the open or the
/// closed joint, lane by lane.
#[inline(always)]
pub(super) fn dot_pairs<W: Width>(
    w: W,
    closed: W::Mask,
    [open_row, closed_row]: &[[f64; DRIVING]; 2],
    x: &[W::Vector; DRIVING],
) -> W::Vector {
    let mut sum = w.splat(0.0);
    for j in 0..DRIVING {
        let number = w.select(closed, w.splat(closed_row[j]), w.splat(open_row[j]));
        sum = sum + number * x[j];
    }
    sum
}

/// Numbers of the closed joint, in the order in which they are needed: β̈ from
/// δ, ε̇ and I; ε̈ from β̇, δ, ε̇ and I, and its constant part; İ from β̇, I and V; R
/// row by row, upper triangular; c.
const LOSS_NUMBERS: usize = 3 + 5 + 3 + DRIVING * (DRIVING + 1) / 2 + 1;

/// The numbers, each in every lane: a vector in memory costs no instruction.
#[derive(Debug, Clone)]
pub(super) struct LaneLoss<W: Width>([W::Array; LOSS_NUMBERS]);

impl<W: Width> LaneLoss<W> {
    /// As long as no joint was closed.
    pub(super) fn none() -> Self {
        Self([W::array(0.0); LOSS_NUMBERS])
    }

    /// Takes over those of a table of the closed joint; without damping there are
    /// none.
    pub(super) fn set(&mut self, table: &HeldTable) {
        let Some(loss) = &table.loss else {
            return;
        };
        let (damping_nms_per_rad, factor) = loss.whole();
        let system = &table.system;
        let row = |state: usize| -> [f64; DRIVING] {
            core::array::from_fn(|j| system.a[(state, BETA_DOT + j)])
        };
        let ([_, delta, speed, current], joint) = (row(BETA_DOT), row(EPSILON_DOT));
        let [induced, _, _, resistive] = row(CURRENT);
        let triangle = (0..DRIVING).flat_map(|i| (i..DRIVING).map(move |j| factor[(i, j)]));
        let numbers = [delta, speed, current]
            .into_iter()
            .chain(joint)
            .chain([
                system.load[EPSILON_DOT],
                induced,
                resistive,
                system.per_volt,
            ])
            .chain(triangle)
            .chain([damping_nms_per_rad]);
        for (to, number) in self.0.iter_mut().zip(numbers) {
            *to = W::array(number);
        }
    }

    /// True if there is a damper that has been in contact.
    fn is_some(&self) -> bool {
        self.0[LOSS_NUMBERS - 1].as_ref()[0] != 0.0
    }

    /// Energy that the dampers take in a step \[J\]: `c·|R·v|²` with the rates v at its
    /// start, 0 where the joint is open, in the order of
    /// `Dissipation::over`.
    #[inline(always)]
    pub(super) fn over_step(
        &self,
        w: W,
        from: &[W::Vector; DRIVING],
        flank: &W::Array,
        voltage_v: W::Vector,
    ) -> W::Vector {
        let zero = w.splat(0.0);
        if !self.is_some() {
            return zero;
        }
        let [beta_dot, delta, epsilon_dot, current] = *from;
        let number = |place: usize| w.load(&self.0[place]);
        // Without the terms that are zero, which change no sum.
        let gear = number(0) * delta + (number(1) * epsilon_dot + number(2) * current);
        let joint = (number(3) * beta_dot + number(4) * delta)
            + (number(5) * epsilon_dot + number(6) * current)
            + number(7);
        let armature = (number(8) * beta_dot + number(9) * current) + number(10) * voltage_v;
        let rates = [gear, epsilon_dot, joint, armature];
        let (mut sum, mut place) = (zero, 11);
        for i in 0..DRIVING {
            let mut part = number(place) * rates[i];
            for rate in &rates[i + 1..] {
                place += 1;
                part = part + number(place) * *rate;
            }
            place += 1;
            sum = sum + part * part;
        }
        let flank = w.load(flank);
        let open = w.at_most(w.abs(flank), w.splat(0.5));
        w.select(open, zero, number(place) * sum)
    }
}

/// The numbers of every lane's mode.
#[derive(Debug, Clone)]
pub(super) struct ModeNumbers<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    pub(super) offset_rad: W::Array,
    /// The guard `base + side·δ − open·|δ|`, positive within the mode.
    pub(super) base: W::Array,
    side: W::Array,
    open: W::Array,
    /// `k` and `c` while a flank carries, else 0.
    pub(super) stiffness: W::Array,
    pub(super) damping: W::Array,
    /// a0 against the motion.
    pub(super) resistance_n: W::Array,
    /// The flank in contact: −1, 0 or 1.
    pub(super) joint: W::Array,
}

impl<W: Width> ModeNumbers<W> {
    pub(super) fn new() -> Self {
        let zero = W::array(0.0);
        Self {
            offset_rad: zero,
            base: zero,
            side: zero,
            open: zero,
            stiffness: zero,
            damping: zero,
            resistance_n: zero,
            joint: zero,
        }
    }

    /// The guard of the joint; where δ is not a number, neither is this.
    #[inline(always)]
    pub(super) fn guard(&self, w: W, delta: W::Vector) -> W::Vector {
        (w.load(&self.base) + w.load(&self.side) * delta) - w.load(&self.open) * w.abs(delta)
    }

    /// The guard of one lane.
    pub(super) fn guard_of(&self, lane: usize, delta: f64) -> f64 {
        let of = |array: &W::Array| array.as_ref()[lane];
        (of(&self.base) + of(&self.side) * delta) - of(&self.open) * delta.abs()
    }

    /// True if no bound can tell that the lane keeps its mode.
    pub(super) fn is_unsure(&self, lane: usize) -> bool {
        self.base.as_ref()[lane] == f64::NEG_INFINITY
    }

    /// Sets a lane's numbers to those of its mode.
    pub(super) fn set(&mut self, lane: usize, plant: &Automaton) {
        let (mode, axis) = (&plant.mode, &plant.axis);
        let never = f64::NEG_INFINITY;
        let simple =
            !axis.releases() && mode.guide == GuideMode::AsWritten && plant.fresh.is_none();
        let (base, side, open) = match mode.joint {
            _ if !simple => (never, 0.0, 0.0),
            JointMode::Rigid | JointMode::Gapless => (f64::INFINITY, 0.0, 0.0),
            JointMode::Open => (axis.backlash_half_rad(), 0.0, 1.0),
            JointMode::Loaded(flank) => (0.0, flank.sign(), 0.0),
            JointMode::Released(_) => (never, 0.0, 0.0),
        };
        let (stiffness, damping) = match (mode.joint, axis.joint) {
            (JointMode::Gapless | JointMode::Loaded(_), Some(joint)) => {
                (joint.stiffness_nm_per_rad, joint.damping_nms_per_rad)
            }
            _ => (0.0, 0.0),
        };
        let resistance_n = mode.guide.direction() * axis.resistance.constant_n;
        for (array, value) in [
            (&mut self.offset_rad, axis.offset_rad(mode)),
            (&mut self.base, base),
            (&mut self.side, side),
            (&mut self.open, open),
            (&mut self.stiffness, stiffness),
            (&mut self.damping, damping),
            (&mut self.resistance_n, resistance_n),
            (&mut self.joint, f64::from(mode.joint.contact().sign())),
        ] {
            array.as_mut()[lane] = value;
        }
    }
}
