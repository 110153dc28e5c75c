//! A table for whatever gives the voltage but a held voltage itself: the continuous law
//! (eq. 27-37), and the amplifiers beyond the paper's ([`crate::model::amplifier`]) behind that
//! or behind a held command. In each mode voltage, İ and q̇ are affine in the state and in a held
//! command.

use std::sync::OnceLock;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

use super::levels::{BOUND_MARGIN, Levels, NOISE_ULPS};
use super::loss::Dissipation;
use super::system::{
    A_REF, AxisSystem, COMMANDED, Column, DELTA, HELD, LOOP, Matrix, OWN, V_REF, W_REF,
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

/// `row·x + constant + per_command·c`, c being a held command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Affine {
    row: Column<COMMANDED>,
    constant: f64,
    per_command: f64,
}

impl Affine {
    fn of(row: Column<COMMANDED>) -> Self {
        Self {
            row,
            constant: 0.0,
            per_command: 0.0,
        }
    }

    fn state(place: usize) -> Self {
        let mut row = Column::zeros();
        row[place] = 1.0;
        Self::of(row)
    }

    fn constant(constant: f64) -> Self {
        Self {
            constant,
            ..Self::of(Column::zeros())
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            row: self.row * factor,
            constant: self.constant * factor,
            per_command: self.per_command * factor,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            row: self.row + other.row,
            constant: self.constant + other.constant,
            per_command: self.per_command + other.per_command,
        }
    }

    /// What it is besides `row·x`.
    pub(super) fn offset(&self, held: f64) -> f64 {
        self.constant + self.per_command * held
    }
}

/// What a table depends on besides axis and law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Key {
    carries: bool,
    guide: GuideMode,
    amplifier: AmplifierMode,
    stage: StageMode,
    /// How fast the command changes; none where it is held.
    coupling: Option<Coupling>,
    length_ns: u64,
}

impl Key {
    pub(super) fn new(mode: &Mode, coupling: Option<Coupling>, length_ns: u64) -> Self {
        Self {
            carries: mode.joint.carries(),
            guide: mode.guide,
            amplifier: mode.amplifier,
            stage: mode.stage,
            coupling,
            length_ns,
        }
    }
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
    input: [Column<COMMANDED>; 2],
    pub(super) voltage: Affine,
    pub(super) beyond: Affine,
    /// The rows of A whose rates are no states.
    accelerated: Beside<1>,
    /// `e^{AT} − 1`, the rounding of which is that of what a step changes and
    /// not of the whole state, and `ψ(T)·u`, without the command's part: the axis' own states
    /// and q.
    growth: Beside<2>,
    drift: [[f64; OWN + 1]; 2],
    pub(super) command: OscillatorStep,
    /// Bounds of how far guards and figures stray from their chords over the whole step, per
    /// rate.
    guards: Beside<1>,
    figures: Beside<2>,
    /// The figures' slopes times the step, per rate.
    slopes: Beside<2>,
    /// Of a closed joint with damping.
    loss: Option<Heat<COMMANDED>>,
    /// Of the armature, and of a guide with linear friction, made when first asked for.
    behind: OnceLock<Box<(Heat<BEHIND>, Option<Heat<BEHIND>>)>>,
}

/// What a piece looks at first: ẍ, I, p·γ, p·β and the voltage.
pub(super) const FIGURES: usize = 5;

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
        let entry = |i: usize, j: usize| if i < N { factor[(i, j)] } else { 0.0 };
        let first = N - COMMANDED;
        let ahead = if first > 0 { entry(0, 0) } else { 0.0 };
        Self {
            rates: Beside::new(|i| Column::from_fn(|j, _| entry(i, first + j))),
            ahead: [ahead, 0.0, 0.0, 0.0],
            of,
        }
    }

    /// The heat of the whole step \[J\].
    #[inline(always)]
    fn over_whole<S: Simd>(&self, simd: S, ahead: f64, rates: &Column<COMMANDED>) -> f64 {
        let [mut first, second, third] = match N - COMMANDED {
            0 => self.rates.triangle::<_, 0>(simd, rates),
            _ => self.rates.triangle::<_, 1>(simd, rates),
        };
        first += f64x4::from_slice(simd, &self.ahead) * f64x4::splat(simd, ahead);
        let [a, b, c, d] = numbers(first * first + second * second + third * third);
        self.of.coefficient * ((a + b) + (c + d))
    }
}

impl Heat<BEHIND> {
    /// The heat of the whole step or a piece of it, where the quantity begins with this \[J\].
    #[inline(always)]
    fn over_piece(
        &self,
        simd: impl Simd,
        (whole, length_s): (bool, f64),
        ahead: f64,
        rates: &Column<COMMANDED>,
    ) -> f64 {
        if whole {
            return self.over_whole(simd, ahead, rates);
        }
        let mut z = Column::<BEHIND>::zeros();
        z[0] = ahead;
        z.rows_mut(1, COMMANDED).copy_from(rates);
        self.of.over(z, length_s)
    }
}

/// Quantities side by side, N fours of them, the coefficients of each state together: their
/// sums run beside each other and none waits for the other.
#[derive(Debug, Clone, PartialEq)]
struct Beside<const N: usize>([[[f64; 4]; N]; COMMANDED]);

impl<const N: usize> Beside<N> {
    fn new(row: impl Fn(usize) -> Column<COMMANDED>) -> Self {
        let of = |i: usize, j: usize| core::array::from_fn(|k| row(4 * i + k)[j]);
        Self(core::array::from_fn(|j| core::array::from_fn(|i| of(i, j))))
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

impl Beside<3> {
    /// The same of an upper triangle: quantity number i has no part of the states before number
    /// `i − FIRST`.
    #[inline(always)]
    fn triangle<S: Simd, const FIRST: usize>(
        &self,
        simd: S,
        x: &Column<COMMANDED>,
    ) -> [f64x4<S>; 3] {
        let mut sums = [f64x4::splat(simd, 0.0); 3];
        for j in 0..COMMANDED {
            let x = f64x4::splat(simd, x[j]);
            for (i, sum) in sums.iter_mut().enumerate() {
                if 4 * i <= FIRST + j {
                    *sum += f64x4::from_slice(simd, &self.0[j][i]) * x;
                }
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
        let ([a, b, c, d], [e, ..]) = (numbers(four), numbers(rest));
        [a, b, c, d, e]
    }
}

/// The numbers of a vector.
#[inline(always)]
fn numbers<S: Simd>(vector: f64x4<S>) -> [f64; 4] {
    let mut numbers = [0.0; 4];
    vector.store_slice(&mut numbers);
    numbers
}

/// The states whose rates are neither states nor the command's.
const ACCELERATED: [usize; 4] = [BETA_DOT, EPSILON_DOT, CURRENT, LOOP];

/// The states that a step changes by more than the command does.
const STEPPED: [usize; OWN + 1] = [0, 1, 2, 3, 4, 5, LOOP];

impl CommandedTable {
    pub(super) fn new(axis: &Axis, mode: &Mode, pid: Option<&ContinuousPid>, key: Key) -> Self {
        let Key {
            carries, coupling, ..
        } = key;
        let length_s = seconds(key.length_ns);
        let system = axis.system(mode);
        let rad_per_m = 1.0 / axis.pitch_m_per_rad;
        let armature = Armature::new(axis, mode, pid);
        let (a, input) = armature.system(axis, &system, coupling);
        let held = held_rows(axis, mode, &system);
        let mut rows: Vec<_> = held
            .iter()
            .map(|row| from_command(row, rad_per_m))
            .collect();
        // In the order of `Quantity`.
        let demand = pid.map_or(Column::zeros(), demand_row);
        rows.extend([demand, armature.voltage.row, armature.beyond.row]);
        let levels = Levels::new(&a, length_s);
        let loss = carries.then(|| Dissipation::of_all(axis, &levels));
        let whole = &levels.steps[0].integral;
        let (growth, drift) = (whole * a, input.map(|input| whole * input));
        let row_of = |m: &Matrix<COMMANDED>, i: usize| m.row(i).transpose();
        let accelerated = ACCELERATED.map(|state| row_of(&a, state));
        let table = Table::new(levels, None, &rows);
        let p = axis.pitch_m_per_rad;
        let of_figures = [
            (Quantity::ScrewAcceleration, p),
            (Quantity::Current, 1.0),
            (Quantity::ScrewAngle, -p),
            (Quantity::GearAngle, -p),
            (Quantity::Voltage, 1.0),
        ];
        let strays = |quantity| table.quantity(quantity).bounds.per_rate[0] * BOUND_MARGIN;
        let guards = [
            Quantity::Delta,
            Quantity::Demand,
            Quantity::Beyond,
            Quantity::Current,
        ];
        let guards = guards.map(strays);
        let figures = of_figures.map(|(quantity, scale)| {
            let strays = strays(quantity) * scale.abs();
            (strays, table.row(quantity) * (scale * length_s))
        });
        let none = (Column::zeros(), Column::zeros());
        let figure = |i: usize| *figures.get(i).unwrap_or(&none);
        Self {
            key,
            accelerated: Beside::new(|i| accelerated[i]),
            growth: Beside::new(|i| {
                STEPPED
                    .get(i)
                    .map_or(none.0, |&state| row_of(&growth, state))
            }),
            drift: drift.map(|drift| STEPPED.map(|state| drift[state])),
            command: OscillatorStep::new(coupling.unwrap_or_default(), length_s),
            guards: Beside::new(|i| guards[i]),
            figures: Beside::new(|i| figure(i).0),
            slopes: Beside::new(|i| figure(i).1),
            table,
            rad_per_m,
            input,
            voltage: armature.voltage,
            beyond: armature.beyond,
            screw_load: system.screw_load,
            loss: loss.flatten().map(Heat::new),
            behind: OnceLock::new(),
        }
    }

    /// Length of the step \[s\].
    pub(super) fn length_s(&self) -> f64 {
        seconds(self.key.length_ns)
    }

    /// u without a held command.
    pub(super) fn own_input(&self) -> &Column<COMMANDED> {
        &self.input[0]
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
        let [sums] = self.accelerated.times(simd, x);
        let Coupling {
            up_per_s,
            down_per_s,
        } = self.key.coupling.unwrap_or_default();
        // β̂ is the continuous law's memory.
        let counted = if self.key.coupling.is_some() {
            x[BETA]
        } else {
            0.0
        };
        let mut rates = Column::<COMMANDED>::from([
            x[BETA_DOT],
            0.0,
            x[EPSILON_DOT],
            0.0,
            0.0,
            counted,
            x[A_REF],
            up_per_s * x[W_REF],
            -down_per_s * x[A_REF],
            0.0,
        ]);
        for (&state, sum) in ACCELERATED.iter().zip(numbers(sums)) {
            rates[state] = sum + input[state];
        }
        rates
    }

    /// What the whole step makes of a state behind a held command; the motion's command is
    /// this afterwards.
    #[inline(always)]
    pub(super) fn step(
        &self,
        simd: impl Simd,
        x: &Column<COMMANDED>,
        held: f64,
        command: &Oscillator,
    ) -> Column<COMMANDED> {
        let ([four, rest], mut end) = (self.growth.times(simd, x), *x);
        let changes = [numbers(four), numbers(rest)];
        let [drift, per_command] = &self.drift;
        for ((i, &state), change) in STEPPED.iter().enumerate().zip(changes.as_flattened()) {
            end[state] = x[state] + (change + (drift[i] + per_command[i] * held));
        }
        set_command(&mut end, command);
        end
    }

    /// How far what the guards look at (δ, the law's demand, what those of the amplifier do, I)
    /// may stray over the whole step that begins with these rates; not a number where one of
    /// them is none.
    #[inline(always)]
    pub(super) fn strays_of_guards(&self, simd: impl Simd, rates: &Column<COMMANDED>) -> [f64; 4] {
        let [strays] = self.guards.times(simd, &rates.abs());
        numbers(strays)
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
        let whole = length_s == self.length_s();
        let joint_j = match &self.loss {
            None => 0.0,
            Some(loss) if whole => loss.over_whole(simd, 0.0, rates),
            Some(loss) => loss.of.over(*rates, length_s),
        };
        let (armature, guide) = &**self.behind.get_or_init(|| self.heat_behind(axis));
        let armature_j = armature.over_piece(simd, (whole, length_s), x[CURRENT], rates);
        let mut guide_j = 0.0;
        if let Some(guide) = guide {
            let speed_radps = self.table.quantity(Quantity::ScrewSpeed).value(x);
            guide_j = guide.over_piece(simd, (whole, length_s), speed_radps, rates);
        }
        [joint_j, armature_j, guide_j]
    }

    #[cold]
    fn heat_behind(&self, axis: &Axis) -> Box<(Heat<BEHIND>, Option<Heat<BEHIND>>)> {
        let of = |coefficient, quantity| {
            let row = self.table.row(quantity);
            Heat::new(Dissipation::of_quantity(
                coefficient,
                &self.table.levels,
                row,
            ))
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
        for (column, x) in self.growth.0.iter().zip(x.iter()) {
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
    #[inline]
    pub(super) fn demand(&self, x: &Column<COMMANDED>) -> f64 {
        let row = self.table.row(Quantity::Demand);
        (row[BETA] * x[BETA] + row[BETA_DOT] * x[BETA_DOT]) + row[BETA_INTEGRAL] * x[BETA_INTEGRAL]
    }
}

/// Voltage and current behind the command in one mode.
#[derive(Debug, Clone, Copy)]
struct Armature<'a> {
    stage: Stage,
    mode: &'a Mode,
    pid: Option<&'a ContinuousPid>,
    command: Affine,
    /// At the motor.
    voltage: Affine,
    /// What the guards of the stage look at: u of a current loop; how far the commanded
    /// voltage is above the one that holds the current.
    beyond: Affine,
}

impl<'a> Armature<'a> {
    fn new(axis: &Axis, mode: &'a Mode, pid: Option<&'a ContinuousPid>) -> Self {
        let (motor, z) = (&axis.motor, axis.gear_ratio);
        let (r, l) = (motor.resistance_ohm, motor.inductance_h);
        let command = match (pid, mode.amplifier) {
            (None, _) => Affine {
                per_command: 1.0,
                ..Affine::constant(0.0)
            },
            (Some(pid), AmplifierMode::Linear) => Affine::of(demand_row(pid)),
            (Some(pid), AmplifierMode::AtLimit(d)) => Affine::constant(d.sign() * pid.limit()),
        };
        // V_h = R·I + k_m·β̇/z
        let mut own = Column::<HELD>::zeros();
        (own[BETA_DOT], own[CURRENT]) = (motor.torque_constant_nm_per_a / z, r);
        let holding = Affine::of(from_command(&own, 1.0 / axis.pitch_m_per_rad));
        let (limit_v, _, w) = axis.stage.numbers();
        // u = ω_c·L·(i_cmd − I) + ω_c·R·q
        let error = command.plus(Affine::state(CURRENT).times(-1.0));
        let demanded = error.times(w * l).plus(Affine::state(LOOP).times(w * r));
        let (voltage, beyond) = match (axis.stage, mode.stage) {
            (Stage::CurrentLoop { .. }, StageMode::Saturated(d)) => {
                (Affine::constant(d.sign() * limit_v), demanded)
            }
            (Stage::CurrentLoop { .. }, _) => (demanded, demanded),
            (Stage::IdealCurrent, _) => (holding, Affine::constant(0.0)),
            (_, of_limit) => {
                let voltage = match of_limit {
                    StageMode::Holding(_) => holding,
                    StageMode::Overrun(d) => Affine::constant(-d.sign() * limit_v),
                    StageMode::Follows | StageMode::Saturated(_) => command,
                };
                (voltage, command.plus(holding.times(-1.0)))
            }
        };
        Self {
            stage: axis.stage,
            mode,
            pid,
            command,
            voltage,
            beyond,
        }
    }

    /// `A`, the constant input and what a held command adds to it.
    fn system(
        &self,
        axis: &Axis,
        system: &AxisSystem,
        coupling: Option<Coupling>,
    ) -> (Matrix<COMMANDED>, [Column<COMMANDED>; 2]) {
        let (mut a, load) = commanded_system(axis, system, coupling.unwrap_or_default());
        let mut inputs = [load, Column::zeros()];
        if coupling.is_none() {
            // β̂ is the continuous law's memory.
            a[(BETA_INTEGRAL, BETA)] = 0.0;
        }
        let free = Affine::of(a.row(CURRENT).transpose());
        let current_rate = match (self.stage, self.mode.stage) {
            (Stage::IdealCurrent, _) => self.demand_rate(&a, &inputs[0]),
            (Stage::LimitedVoltage { .. }, StageMode::Holding(_)) => Affine::constant(0.0),
            _ => free.plus(self.voltage.times(system.per_volt)),
        };
        let motor = &axis.motor;
        let (r, l) = (motor.resistance_ohm, motor.inductance_h);
        let loop_rate = match (self.stage, self.mode.stage) {
            (Stage::CurrentLoop { omega_radps, .. }, StageMode::Saturated(_)) => self
                .voltage
                .plus(Affine::state(LOOP).times(-omega_radps * r))
                .times(1.0 / (omega_radps * l)),
            (Stage::CurrentLoop { .. }, _) => self.command.plus(Affine::state(CURRENT).times(-1.0)),
            _ => Affine::constant(0.0),
        };
        for (state, rate) in [(CURRENT, current_rate), (LOOP, loop_rate)] {
            a.set_row(state, &rate.row.transpose());
            inputs[0][state] = rate.constant;
            inputs[1][state] = rate.per_command;
        }
        (a, inputs)
    }

    /// Rate of the demand of the continuous law, from those of its states.
    fn demand_rate(&self, a: &Matrix<COMMANDED>, input: &Column<COMMANDED>) -> Affine {
        let (Some(pid), AmplifierMode::Linear) = (self.pid, self.mode.amplifier) else {
            return Affine::constant(0.0);
        };
        let demand = demand_row(pid);
        let mut rate = Affine::constant(0.0);
        for state in [BETA, BETA_DOT, BETA_INTEGRAL] {
            let of_state = Affine {
                constant: input[state],
                ..Affine::of(a.row(state).transpose())
            };
            rate = rate.plus(of_state.times(demand[state]));
        }
        rate
    }
}
