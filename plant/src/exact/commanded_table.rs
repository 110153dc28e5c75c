//! A table for whatever gives the voltage but a held voltage itself: the continuous law
//! (eq. 27-37), and the amplifiers beyond the paper's ([`crate::model::amplifier`]) behind that
//! or behind a held command. In each mode voltage, İ and q̇ are affine in the state and in a held
//! command.

use core::array;
use std::sync::OnceLock;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

use super::levels::{BOUND_MARGIN, Levels, NOISE_ULPS};
use super::loss::Dissipation;
use super::system::{
    A_REF, AxisSystem, COMMANDED, Column, DELTA, HELD, LOOP, Matrix, V_REF, W_REF,
    commanded_system, demand_row, from_command, set_command,
};
use super::table::{Quantity, Table, held_rows};
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::{Axis, Mode};
use crate::model::motion::{Coupling, Oscillator, OscillatorStep};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON_DOT};
use crate::numerics::seconds;
use crate::observe::extremes::FIGURES;

/// `row·x + constant + per_command·c`, c being a held command: the row, then the other two.
type Affine = Column<{ COMMANDED + 2 }>;
const CONSTANT: usize = COMMANDED;
const PER_COMMAND: usize = COMMANDED + 1;

/// A row alone.
fn affine(row: &Column<COMMANDED>) -> Affine {
    row.fixed_resize(0.0)
}

/// What a table depends on besides axis and law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Key {
    /// True of a joint that carries torque.
    pub(super) carries: bool,
    pub(super) guide: GuideMode,
    pub(super) amplifier: AmplifierMode,
    pub(super) stage: StageMode,
    /// How fast the command changes; none where it is held.
    pub(super) coupling: Option<Coupling>,
    pub(super) length_ns: u64,
}

/// The axis with its amplifier in one mode, over one length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CommandedTable {
    pub(super) key: Key,
    pub(super) table: Table<COMMANDED>,
    /// `1/p`, which makes r of x_ref.
    pub(super) rad_per_m: f64,
    /// Constant part of γ̈.
    pub(super) screw_load: f64,
    /// u without a held command, and what that adds to it.
    pub(super) input: [Column<COMMANDED>; 2],
    voltage: Affine,
    beyond: Affine,
    /// `e^{AT} − 1`, the rounding of which is that of what a step changes and not of the whole
    /// state, without the command's part: the axis' own states and q. Last the rows of A whose
    /// rates are no states.
    step: Beside<3>,
    /// `ψ(T)·u` of the same states, without a held command and what that adds to it.
    drift: [[[f64; 4]; 2]; 2],
    pub(super) command: OscillatorStep,
    /// Bounds of how far guards and figures stray from their chords over the whole step, per
    /// rate. In the place of the power the voltage is looked at.
    guards: Beside<1>,
    figures: Beside<2>,
    /// The figures' slopes times the step, per rate.
    slopes: Beside<2>,
    /// Of a closed joint with damping.
    loss: Option<Heat<COMMANDED>>,
    /// Of the armature, and of a guide with linear friction, made when first asked for.
    behind: OnceLock<Box<(Heat<BEHIND>, Option<Heat<BEHIND>>)>>,
}

/// Rates of all states with a quantity ahead of them.
const BEHIND: usize = COMMANDED + 1;

/// A heat over a piece of the step, and R of the whole of it: per rate, and per quantity ahead of
/// the rates, of which the first row alone is made.
#[derive(Debug, Clone, PartialEq)]
struct Heat<const N: usize> {
    of: Dissipation<N>,
    rates: Beside<3>,
    ahead: [f64; 4],
}

impl<const N: usize> Heat<N> {
    fn new(of: Dissipation<N>) -> Self {
        let (_, factor) = of.whole();
        let first = N - COMMANDED;
        let rates = |i| Column::from_fn(|j, _| factor[(i, first + j)]);
        let rates: [Column<COMMANDED>; N] = array::from_fn(rates);
        let ahead = if first > 0 { factor[(0, 0)] } else { 0.0 };
        Self {
            rates: Beside::new(&rates),
            ahead: [ahead, 0.0, 0.0, 0.0],
            of,
        }
    }

    /// The heat of the whole step or a piece of it, where the quantity begins with this \[J\].
    #[inline(always)]
    fn over<S: Simd>(
        &self,
        simd: S,
        (whole, length_s): (bool, f64),
        ahead: f64,
        rates: &Column<COMMANDED>,
    ) -> f64 {
        let first = N - COMMANDED;
        if !whole {
            let mut z = Column::<N>::repeat(ahead);
            z.rows_mut(first, COMMANDED).copy_from(rates);
            return self.of.over(z, length_s);
        }
        let mut sums = [f64x4::splat(simd, 0.0); 3];
        for j in 0..COMMANDED {
            let rate = f64x4::splat(simd, rates[j]);
            for (i, sum) in sums.iter_mut().enumerate() {
                // R is an upper triangle.
                if 4 * i <= first + j {
                    *sum += f64x4::from_slice(simd, &self.rates.0[j][i]) * rate;
                }
            }
        }
        sums[0] += f64x4::from_slice(simd, &self.ahead) * f64x4::splat(simd, ahead);
        let [x, y, z] = sums;
        let [a, b, c, d] = *(x * x + y * y + z * z);
        self.of.coefficient * ((a + b) + (c + d))
    }
}

/// Quantities side by side, N fours of them, the coefficients of each state together: their
/// sums run beside each other and none waits for the other.
#[derive(Debug, Clone, PartialEq)]
struct Beside<const N: usize>([[[f64; 4]; N]; COMMANDED]);

impl<const N: usize> Beside<N> {
    /// Of no more than 4·N rows.
    fn new(rows: &[Column<COMMANDED>]) -> Self {
        let of = |i: usize, j: usize| rows.get(i).map_or(0.0, |row| row[j]);
        let four = |i: usize, j: usize| array::from_fn(|k| of(4 * i + k, j));
        Self(array::from_fn(|j| array::from_fn(|i| four(i, j))))
    }

    /// Each quantity's value.
    #[inline(always)]
    fn times<S: Simd>(&self, simd: S, x: &Column<COMMANDED>) -> [f64x4<S>; N] {
        let mut sums = [f64x4::splat(simd, 0.0); N];
        for (column, x) in self.0.iter().zip(x.iter()) {
            let x = f64x4::splat(simd, *x);
            for (sum, coefficients) in sums.iter_mut().zip(column) {
                *sum += f64x4::from_slice(simd, coefficients) * x;
            }
        }
        sums
    }
}

impl Beside<2> {
    /// The same of the figures.
    #[inline(always)]
    fn five(&self, simd: impl Simd, x: &Column<COMMANDED>) -> [f64; FIGURES] {
        let [four, rest] = self.times(simd, x);
        let ([a, b, c, d], [e, ..]) = (*four, *rest);
        [a, b, c, d, e]
    }
}

/// The states whose rates are neither states nor the command's.
const ACCELERATED: [usize; 4] = [BETA_DOT, EPSILON_DOT, CURRENT, LOOP];

/// The states that a step changes by more than the command does, and one of the command's, which
/// fills up the fours.
const STEPPED: [usize; 8] = [0, 1, 2, 3, 4, 5, LOOP, W_REF];

impl CommandedTable {
    pub(super) fn new(axis: &Axis, mode: &Mode, pid: Option<&ContinuousPid>, key: Key) -> Self {
        let length_s = seconds(key.length_ns);
        let system = axis.system(mode);
        let rad_per_m = 1.0 / axis.pitch_m_per_rad;
        let Behind {
            a,
            input,
            voltage,
            beyond,
        } = Behind::new(axis, mode, pid, (&system, key.coupling));
        let held = held_rows(axis, mode, &system);
        let mut rows = held.map(|row| from_command(&row, rad_per_m)).to_vec();
        // In the order of `Quantity`.
        rows.push(pid.map_or(Column::zeros(), demand_row));
        rows.extend([voltage, beyond].map(|of| of.fixed_resize::<COMMANDED, 1>(0.0)));
        let levels = Levels::new(&a, length_s);
        let loss = key.carries.then(|| Dissipation::of_all(axis, &levels));
        let whole = &levels.steps[0].integral;
        let (growth, drift) = (whole * a, input.map(|input| whole * input));
        let rows_of = |m: &Matrix<COMMANDED>, state: usize| m.row(state).transpose();
        let mut stepped = STEPPED.map(|state| rows_of(&growth, state)).to_vec();
        stepped.extend(ACCELERATED.map(|state| rows_of(&a, state)));
        let table = Table::new(levels, None, &rows);
        let p = axis.pitch_m_per_rad;
        let figures = [
            (Quantity::ScrewAcceleration, p),
            (Quantity::Current, 1.0),
            (Quantity::ScrewAngle, -p),
            (Quantity::GearAngle, -p),
            (Quantity::Voltage, 1.0),
        ];
        let guards = [
            Quantity::Delta,
            Quantity::Demand,
            Quantity::Beyond,
            Quantity::Current,
        ];
        let strays = |quantity| table.quantity(quantity).bounds.per_rate[0] * BOUND_MARGIN;
        Self {
            key,
            step: Beside::new(&stepped),
            drift: drift
                .map(|drift| array::from_fn(|i| array::from_fn(|k| drift[STEPPED[4 * i + k]]))),
            command: OscillatorStep::new(key.coupling.unwrap_or_default(), length_s),
            guards: Beside::new(&guards.map(strays)),
            figures: Beside::new(&figures.map(|(of, scale)| strays(of) * scale.abs())),
            slopes: Beside::new(&figures.map(|(of, scale)| table.row(of) * (scale * length_s))),
            table,
            rad_per_m,
            input,
            voltage,
            beyond,
            screw_load: system.screw_load,
            loss: loss.flatten().map(Heat::new),
            behind: OnceLock::new(),
        }
    }

    /// What voltage and [`Quantity::Beyond`] are besides their rows' part.
    #[inline]
    pub(super) fn offsets(&self, held: f64) -> [f64; 2] {
        [&self.voltage, &self.beyond].map(|of| of[CONSTANT] + of[PER_COMMAND] * held)
    }

    /// Length of the step \[s\].
    pub(super) fn length_s(&self) -> f64 {
        seconds(self.key.length_ns)
    }

    /// u behind a held command.
    pub(super) fn input(&self, held: f64) -> Column<COMMANDED> {
        self.input[0] + self.input[1] * held
    }

    /// The rates of all states under u, `A·x + u`.
    #[inline(always)]
    pub(super) fn rates(
        &self,
        simd: impl Simd,
        x: &Column<COMMANDED>,
        input: &Column<COMMANDED>,
    ) -> Column<COMMANDED> {
        // Of the inlined sums only these are made, and none twice.
        let [.., sums] = self.step.times(simd, x);
        let coupling = self.key.coupling.unwrap_or_default();
        let mut rates = Column::<COMMANDED>::zeros();
        rates[BETA] = x[BETA_DOT];
        rates[DELTA] = x[EPSILON_DOT];
        if self.key.coupling.is_some() {
            // β̂ is the continuous law's memory.
            rates[BETA_INTEGRAL] = x[BETA];
        }
        rates[V_REF] = x[A_REF];
        rates[A_REF] = coupling.up_per_s * x[W_REF];
        rates[W_REF] = -coupling.down_per_s * x[A_REF];
        for (&state, sum) in ACCELERATED.iter().zip(*sums) {
            rates[state] = sum + input[state];
        }
        rates
    }

    /// What the whole step makes of a state behind a held command, the motion's command being
    /// this afterwards; and the rates at its start, under u.
    #[inline(always)]
    pub(super) fn step<S: Simd>(
        &self,
        simd: S,
        x: &Column<COMMANDED>,
        (held, input): (f64, &Column<COMMANDED>),
        command: &Oscillator,
    ) -> [Column<COMMANDED>; 2] {
        let rates = self.rates(simd, x, input);
        let ([first, second, _], mut end) = (self.step.times(simd, x), *x);
        let of = |four: &[f64; 4]| f64x4::from_slice(simd, four);
        let ([drift, per_command], held) = (&self.drift, f64x4::splat(simd, held));
        for (i, change) in [first, second].into_iter().enumerate() {
            let places: [usize; 4] = array::from_fn(|k| STEPPED[4 * i + k]);
            let change = change + (of(&drift[i]) + of(&per_command[i]) * held);
            let ends = of(&places.map(|state| x[state])) + change;
            for (state, value) in places.into_iter().zip(*ends) {
                end[state] = value;
            }
        }
        set_command(&mut end, command);
        [end, rates]
    }

    /// How far what the guards look at (δ, the law's demand, what those of the amplifier do, I)
    /// may stray over the whole step that begins with these rates; not a number where one of
    /// them is none.
    #[inline(always)]
    pub(super) fn strays_of_guards(&self, simd: impl Simd, rates: &Column<COMMANDED>) -> [f64; 4] {
        let [strays] = self.guards.times(simd, &rates.abs());
        *strays
    }

    /// The same of the figures.
    #[inline(always)]
    pub(super) fn strays(&self, simd: impl Simd, rates: &Column<COMMANDED>) -> [f64; FIGURES] {
        self.figures.five(simd, &rates.abs())
    }

    /// The figures' slopes where these are the rates, at the ends of the whole step or a part of
    /// it, and how far they stray from their chords over the whole; all of it times the step.
    /// The rates are a solution too, `v̇ = A·v`, and the slope of `f·x` is `f·v`.
    #[inline(always)]
    pub(super) fn slopes(
        &self,
        simd: impl Simd,
        [from, to]: [&Column<COMMANDED>; 2],
    ) -> [[f64; FIGURES]; 3] {
        let bends = self.rates(simd, from, &Column::zeros());
        let strays = self.strays(simd, &(bends * self.length_s()));
        [
            self.slopes.five(simd, from),
            self.slopes.five(simd, to),
            strays,
        ]
    }

    /// Heat of joint, armature and guide over a piece from `x` with these rates \[J\].
    #[inline(always)]
    pub(super) fn heat_j(
        &self,
        simd: impl Simd,
        axis: &Axis,
        (x, rates): (&Column<COMMANDED>, &Column<COMMANDED>),
        length_s: f64,
    ) -> [f64; 3] {
        let times = (length_s == self.length_s(), length_s);
        let (mut joint_j, mut guide_j) = (0.0, 0.0);
        if let Some(loss) = &self.loss {
            joint_j = loss.over(simd, times, 0.0, rates);
        }
        let (armature, guide) = &**self.behind.get_or_init(|| self.heat_behind(axis));
        let armature_j = armature.over(simd, times, x[CURRENT], rates);
        if let Some(guide) = guide {
            let speed_radps = self.table.quantity(Quantity::ScrewSpeed).value(x);
            guide_j = guide.over(simd, times, speed_radps, rates);
        }
        [joint_j, armature_j, guide_j]
    }

    #[cold]
    fn heat_behind(&self, axis: &Axis) -> Box<(Heat<BEHIND>, Option<Heat<BEHIND>>)> {
        let of = |coefficient, quantity| {
            let (levels, row) = (&self.table.levels, self.table.row(quantity));
            Heat::new(Dissipation::of_quantity(coefficient, levels, row))
        };
        let guide = axis.pitch_m_per_rad * axis.resistance.linear_ns_per_rad;
        Box::new((
            of(axis.motor.resistance_ohm, Quantity::Current),
            (guide != 0.0).then(|| of(guide, Quantity::ScrewSpeed)),
        ))
    }

    /// Rounding of δ after the whole step.
    pub(super) fn rounding_of_delta(&self, x: &Column<COMMANDED>) -> f64 {
        let mut terms = x[DELTA].abs();
        for (column, x) in self.step.0.iter().zip(x.iter()) {
            terms += (column[0][DELTA] * x).abs();
        }
        NOISE_ULPS * terms
    }

    /// ẍ without its constant part, per pitch; no more than five states make it.
    #[inline(always)]
    pub(super) fn screw_acceleration(&self, x: &Column<COMMANDED>) -> f64 {
        let row = self.table.row(Quantity::ScrewAcceleration);
        let own = (row[BETA_DOT] * x[BETA_DOT] + row[DELTA] * x[DELTA])
            + (row[EPSILON_DOT] * x[EPSILON_DOT] + row[CURRENT] * x[CURRENT]);
        own + row[V_REF] * x[V_REF]
    }

    /// The law's demand \[V, or A with a current drive\].
    #[inline(always)]
    pub(super) fn demand(&self, x: &Column<COMMANDED>) -> f64 {
        let row = self.table.row(Quantity::Demand);
        (row[BETA] * x[BETA] + row[BETA_DOT] * x[BETA_DOT]) + row[BETA_INTEGRAL] * x[BETA_INTEGRAL]
    }
}

/// The axis behind its amplifier in one mode.
struct Behind {
    a: Matrix<COMMANDED>,
    /// u without a held command, and what that adds to it.
    input: [Column<COMMANDED>; 2],
    /// At the motor.
    voltage: Affine,
    /// What the guards of the stage look at: u of a current loop; how far the commanded
    /// voltage is above the one that holds the current.
    beyond: Affine,
}

impl Behind {
    fn new(
        axis: &Axis,
        mode: &Mode,
        pid: Option<&ContinuousPid>,
        (system, coupling): (&AxisSystem, Option<Coupling>),
    ) -> Self {
        let (motor, z) = (&axis.motor, axis.gear_ratio);
        let (r, l) = (motor.resistance_ohm, motor.inductance_h);
        let (limit_v, _, w) = axis.stage.numbers();
        let (constant, none) = (|value| Affine::ith(CONSTANT, value), Affine::zeros());
        let (current, memory) = (Affine::ith(CURRENT, 1.0), Affine::ith(LOOP, 1.0));
        let command = match (pid, mode.amplifier) {
            (None, _) => Affine::ith(PER_COMMAND, 1.0),
            (Some(pid), AmplifierMode::Linear) => affine(&demand_row(pid)),
            (Some(pid), AmplifierMode::AtLimit(d)) => constant(d.sign() * pid.limit()),
        };
        // V_h = R·I + k_m·β̇/z
        let mut own = Column::<HELD>::zeros();
        (own[BETA_DOT], own[CURRENT]) = (motor.torque_constant_nm_per_a / z, r);
        let holding = affine(&from_command(&own, 1.0 / axis.pitch_m_per_rad));
        // u = ω_c·L·(i_cmd − I) + ω_c·R·q
        let error = command - current;
        let demanded = error * (w * l) + memory * (w * r);
        let (voltage, beyond) = match (axis.stage, mode.stage) {
            (Stage::CurrentLoop { .. }, StageMode::Saturated(d)) => {
                (constant(d.sign() * limit_v), demanded)
            }
            (Stage::CurrentLoop { .. }, _) => (demanded, demanded),
            (Stage::IdealCurrent, _) => (holding, none),
            (_, StageMode::Holding(_)) => (holding, command - holding),
            (_, StageMode::Overrun(d)) => (constant(-d.sign() * limit_v), command - holding),
            (_, StageMode::Follows | StageMode::Saturated(_)) => (command, command - holding),
        };
        let (mut a, load) = commanded_system(axis, system, coupling.unwrap_or_default());
        let mut input = [load, Column::zeros()];
        if coupling.is_none() {
            // β̂ is the continuous law's memory.
            a[(BETA_INTEGRAL, BETA)] = 0.0;
        }
        let row = |state: usize| affine(&a.row(state).transpose());
        let current_rate = match (axis.stage, mode.stage) {
            // That of the demand, from those of its states.
            (Stage::IdealCurrent, _) => match (pid, mode.amplifier) {
                (Some(pid), AmplifierMode::Linear) => {
                    let demand = demand_row(pid);
                    let rate = |state: usize| (row(state) + constant(load[state])) * demand[state];
                    none + rate(BETA) + rate(BETA_DOT) + rate(BETA_INTEGRAL)
                }
                _ => none,
            },
            (Stage::LimitedVoltage { .. }, StageMode::Holding(_)) => none,
            _ => row(CURRENT) + voltage * system.per_volt,
        };
        let loop_rate = match (axis.stage, mode.stage) {
            (Stage::CurrentLoop { .. }, StageMode::Saturated(_)) => {
                (voltage + memory * (-w * r)) * (1.0 / (w * l))
            }
            (Stage::CurrentLoop { .. }, _) => error,
            _ => none,
        };
        for (state, rate) in [(CURRENT, current_rate), (LOOP, loop_rate)] {
            let row = rate.fixed_resize::<COMMANDED, 1>(0.0);
            a.set_row(state, &row.transpose());
            (input[0][state], input[1][state]) = (rate[CONSTANT], rate[PER_COMMAND]);
        }
        Self {
            a,
            input,
            voltage,
            beyond,
        }
    }
}
