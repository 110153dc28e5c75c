//! The armature behind each mode of an amplifier beyond the paper's
//! ([`crate::model::amplifier`]), and the table that it makes: voltage, İ and q̇ are affine
//! in the state and in a held command.

use std::sync::OnceLock;

use super::feedback_table::{Heat, ahead_of_rates};
use super::levels::{Levels, NOISE_ULPS};
use super::loss::Dissipation;
use super::system::{
    AxisSystem, Column, DELTA, FEEDBACK, HELD, Matrix, commanded_system, demand_row, from_command,
};
use super::table::{Quantity, Table, held_rows};
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::{Axis, Mode};
use crate::model::motion::Coupling;
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, BETA_INTEGRAL, CURRENT};
use crate::numerics::seconds;

/// States, and the place of q.
pub(super) const STAGE: usize = FEEDBACK + 1;
pub(super) const LOOP: usize = FEEDBACK;

/// `row·x + constant + per_command·c`, c being a held command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Affine {
    row: Column<STAGE>,
    constant: f64,
    per_command: f64,
}

impl Affine {
    fn of(row: Column<STAGE>) -> Self {
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

/// A row of the other states.
pub(super) fn wide(row: &Column<FEEDBACK>) -> Column<STAGE> {
    let mut all = Column::<STAGE>::zeros();
    all.fixed_rows_mut::<FEEDBACK>(0).copy_from(row);
    all
}

/// What a table depends on: a joint that carries, guide, amplifier, ω of the command (none
/// where it is held) and length.
pub(super) type Key = (
    bool,
    GuideMode,
    AmplifierMode,
    StageMode,
    Option<Coupling>,
    u64,
);

/// The axis with its amplifier in one mode, over one length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StageTable {
    pub(super) key: Key,
    pub(super) table: Table<STAGE>,
    pub(super) input: Column<STAGE>,
    pub(super) input_per_command: Column<STAGE>,
    pub(super) voltage: Affine,
    pub(super) beyond: Affine,
    pub(super) screw_load: f64,
    /// What the whole step makes of δ.
    growth_of_delta: Column<STAGE>,
    pub(super) loss: Option<Dissipation<STAGE>>,
    /// Of armature and guide, made when first asked for.
    heat: OnceLock<Box<Heat<Dissipation<BEHIND>>>>,
}

/// Rates of all states with a quantity ahead of them.
const BEHIND: usize = STAGE + 1;

impl StageTable {
    pub(super) fn new(axis: &Axis, mode: &Mode, pid: Option<&ContinuousPid>, key: Key) -> Self {
        let (carries, .., coupling, length_ns) = key;
        let system = axis.system(mode);
        let rad_per_m = 1.0 / axis.pitch_m_per_rad;
        let armature = Armature::new(axis, mode, pid);
        let (a, inputs) = armature.system(axis, &system, coupling);
        let [input, input_per_command] = inputs;
        let held = held_rows(axis, mode, &system);
        let mut rows: Vec<Column<STAGE>> = held
            .iter()
            .map(|row| wide(&from_command(row, rad_per_m)))
            .collect();
        // In the order of `Quantity`.
        let demand = pid.map_or(Column::zeros(), |pid| wide(&demand_row(pid)));
        rows.extend([demand, armature.voltage.row, armature.beyond.row]);
        let levels = Levels::new(&a, seconds(length_ns));
        let growth = levels.steps[0].integral * a;
        let loss = carries.then(|| Dissipation::of_all(axis, &levels));
        Self {
            key,
            growth_of_delta: growth.row(DELTA).transpose(),
            table: Table::new(levels, None, &rows),
            input,
            input_per_command,
            voltage: armature.voltage,
            beyond: armature.beyond,
            screw_load: system.screw_load,
            loss: loss.flatten(),
            heat: OnceLock::new(),
        }
    }

    /// Heat of armature and guide over a piece from `x` with these rates \[J\].
    pub(super) fn heat_j(
        &self,
        axis: &Axis,
        (x, rates): (&Column<STAGE>, &Column<STAGE>),
        length_s: f64,
    ) -> [f64; 2] {
        let heat = self.heat.get_or_init(|| {
            Box::new(Heat::new(axis, |coefficient, quantity: Quantity| {
                let f = &self.table.quantity(quantity).row;
                Dissipation::of_quantity(coefficient, &self.table.levels, f)
            }))
        });
        heat.over(|loss, quantity| {
            let q = self.table.quantity(quantity).value(x);
            loss.over(ahead_of_rates(q, rates), length_s)
        })
    }

    /// Rounding of δ after the whole step.
    pub(super) fn rounding_of_delta(&self, x: &Column<STAGE>) -> f64 {
        let terms = self.growth_of_delta.component_mul(x).abs().sum();
        NOISE_ULPS * (x[DELTA].abs() + terms)
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
            (Some(pid), AmplifierMode::Linear) => Affine::of(wide(&demand_row(pid))),
            (Some(pid), AmplifierMode::AtUpper) => Affine::constant(pid.limit()),
            (Some(pid), AmplifierMode::AtLower) => Affine::constant(-pid.limit()),
        };
        // V_h = R·I + k_m·β̇/z
        let mut own = Column::<HELD>::zeros();
        (own[BETA_DOT], own[CURRENT]) = (motor.torque_constant_nm_per_a / z, r);
        let holding = Affine::of(wide(&from_command(&own, 1.0 / axis.pitch_m_per_rad)));
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
    ) -> (Matrix<STAGE>, [Column<STAGE>; 2]) {
        let (counted, load) = commanded_system(axis, system, coupling.unwrap_or_default());
        let mut a = Matrix::<STAGE>::zeros();
        a.fixed_view_mut::<FEEDBACK, FEEDBACK>(0, 0)
            .copy_from(&counted);
        let mut inputs = [wide(&load), Column::zeros()];
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
    fn demand_rate(&self, a: &Matrix<STAGE>, input: &Column<STAGE>) -> Affine {
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
