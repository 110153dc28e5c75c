//! The plant: an axis with its state and the solver that advances it from one
//! voltage update to the next.

use fearless_simd::Level;

use crate::exact::Tables;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::amplifier::AmplifierMode;
use crate::model::axis::{Axis, AxisParameters, Drive};
use crate::model::direction::Direction;
use crate::model::joint::Contact;
use crate::model::state::{CURRENT, State};
use crate::model::surroundings::Surroundings;
use crate::numerics::seconds;
use crate::numerics::vectors::{in_fours, widest};
use crate::observe::Watch;
use crate::stepped::adaptive::StepSize;

/// Method that solves the equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solver {
    /// Without discretisation error, every event found: for plants without
    /// quadratic resistance.
    Exact,
    /// Adaptive, events located: the Dormand-Prince pair of order 8(5,3)
    /// (`dop853`). The 5 of the name is that of the family's first pair.
    Dopri5 {
        /// Error that is aimed at; a step may add a tenth of it to states
        /// below 100 (rad, rad/s, A), a thousandth relative to larger ones.
        tolerance: f64,
    },
    /// Fixed-step Runge-Kutta of order 4 that locates nothing.
    Rk4 {
        /// Largest step \[ns\], at least 1; an interval is cut into equal steps
        /// no longer than this.
        step_ns: u64,
    },
}

/// The servo axis with its state.
#[derive(Debug, Clone)]
pub struct Plant {
    now: Automaton,
    solver: Solver,
    /// Steps that the error control of solver `dopri5` would take.
    steps: StepSize,
    /// The flank that the joint starts on.
    flank: Option<Direction>,
    /// Force of the loads from each instant on at which it changes \[ns, N\], the first at 0.
    forces: Vec<(u64, f64)>,
    /// Place of the next change.
    next_force: usize,
    /// Memory of solver `exact`: all that it has computed about the axis.
    tables: Option<Box<Tables>>,
    /// The same for each other force.
    other_tables: Vec<(f64, Box<Tables>)>,
    /// The vector instructions in use, which no result depends on.
    level: Level,
}

/// What a motor and its carriage have just after a command was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Motor voltage \[V\].
    pub voltage_v: f64,
    /// Armature current \[A\].
    pub current_a: f64,
    /// Carriage acceleration \[m/s²\].
    pub acceleration_mps2: f64,
    /// Contact of the joint.
    pub contact: Contact,
}

impl Plant {
    /// With the paper's surroundings: a voltage drive, no load; at rest at zero, the joint
    /// centred in its gap, time 0.
    ///
    /// ```
    /// use plant::{AxisParameters, Drive, Motor, Plant, Solver};
    /// let motor = Motor {
    ///     inertia_kg_m2: 2e-4,
    ///     torque_constant_nm_per_a: 0.25,
    ///     resistance_ohm: 1.5,
    ///     inductance_h: 0.0065,
    /// };
    /// let mut axis = AxisParameters { motor, ..AxisParameters::default() };
    /// axis.transmission.gear_ratio = 2.0;
    /// axis.transmission.screw_inertia_kg_m2 = 8.5e-4;
    /// axis.transmission.screw_pitch_m_per_rad = 5e-3 / (2.0 * std::f64::consts::PI);
    /// axis.carriage.mass_kg = 50.0;
    /// let mut plant = Plant::new(&axis, Solver::Dopri5 { tolerance: 1e-11 });
    /// // 10 V for two seconds: the motor runs up to V/k_m = 40 rad/s.
    /// plant.advance(&Drive::Held(10.0), 2_000_000_000, &mut ())?;
    /// assert!((plant.state().beta_dot_radps / 2.0 - 40.0).abs() < 1e-3);
    /// # Ok::<(), plant::PlantError>(())
    /// ```
    pub fn new(parameters: &AxisParameters, solver: Solver) -> Self {
        Self::within(parameters, &Surroundings::default(), solver)
    }

    /// Within these surroundings, at rest at their start, time 0.
    ///
    /// ```
    /// use plant::{Amplifier, AxisParameters, Control, Drive, Motor, Plant, Solver, Surroundings};
    /// let motor = Motor {
    ///     inertia_kg_m2: 2e-4,
    ///     torque_constant_nm_per_a: 0.25,
    ///     resistance_ohm: 1.5,
    ///     inductance_h: 0.0065,
    /// };
    /// let mut axis = AxisParameters { motor, ..AxisParameters::default() };
    /// axis.transmission.gear_ratio = 1.0;
    /// axis.transmission.screw_pitch_m_per_rad = 1e-3;
    /// axis.carriage.mass_kg = 1.0;
    /// let control = Control::Current { current_limit_a: 5.0, bandwidth_radps: None };
    /// let amplifier = Amplifier { gain: 1.0, voltage_limit_v: 48.0, control };
    /// let surroundings = Surroundings { amplifier, ..Surroundings::default() };
    /// let mut plant = Plant::within(&axis, &surroundings, Solver::Exact);
    /// // 1 A for a second: J·β̈ = k_m·I.
    /// plant.advance(&Drive::Held(1.0), 1_000_000_000, &mut ())?;
    /// let expected = 0.25 / (2e-4 + 1e-6);
    /// assert!((plant.state().beta_dot_radps / expected - 1.0).abs() < 1e-12);
    /// # Ok::<(), plant::PlantError>(())
    /// ```
    pub fn within(
        parameters: &AxisParameters,
        surroundings: &Surroundings,
        solver: Solver,
    ) -> Self {
        let tolerance = match solver {
            Solver::Dopri5 { tolerance } => tolerance,
            Solver::Exact | Solver::Rk4 { .. } => 0.0,
        };
        let axis = Axis::new(parameters, surroundings, tolerance);
        let flank = surroundings.start.flank(axis.backlash_half_rad());
        Self {
            now: Automaton::new(axis, flank),
            solver,
            steps: StepSize::new(),
            flank,
            forces: surroundings.forces(),
            next_force: 1,
            tables: None,
            other_tables: Vec::new(),
            level: widest(),
        }
    }

    /// As [`Plant::new`], from any other state.
    pub fn with_state(parameters: &AxisParameters, solver: Solver, state: &State) -> Self {
        let mut plant = Self::new(parameters, solver);
        let now = &mut plant.now;
        now.y = state.to_vector();
        now.mode = now.axis.mode_of_state(&Drive::Held(0.0), 0.0, &now.y);
        plant
    }

    /// Back to the start, at rest at zero; what solver `exact` has computed
    /// about the axis is kept.
    pub fn reset(&mut self) {
        self.change_force(0);
        if let Some(tables) = &mut self.tables {
            tables.carried = None;
        }
        self.now = Automaton::new(self.now.axis, self.flank);
        self.steps = StepSize::new();
    }

    /// A plant that goes on from here with another solver: state, mode and
    /// time are this one's, `parameters` as in [`Plant::new`].
    pub fn resolved_with(&self, parameters: &AxisParameters, solver: Solver) -> Self {
        let mut plant = Self::new(parameters, solver);
        plant.now = Automaton {
            axis: Axis {
                stage: self.now.axis.stage,
                load_force_n: self.now.axis.load_force_n,
                start_rad: self.now.axis.start_rad,
                ..plant.now.axis
            },
            ..self.now
        };
        plant.flank = self.flank;
        plant.forces = self.forces.clone();
        plant.next_force = self.next_force;
        plant
    }

    /// State now.
    pub fn state(&self) -> State {
        self.now.state()
    }

    /// Time now \[ns\].
    pub fn time_ns(&self) -> u64 {
        self.now.time_ns
    }

    /// Contact of the joint now.
    pub fn contact(&self) -> Contact {
        self.now.contact()
    }

    /// Carriage acceleration `ẍ = p·γ̈` now \[m/s²\].
    pub fn acceleration_mps2(&self) -> f64 {
        self.now.acceleration_mps2()
    }

    /// Motor voltage that `drive` gives now \[V\].
    pub fn voltage_v(&self, drive: &Drive<'_>) -> f64 {
        let now = &self.now;
        if !now.axis.stage.is_papers() {
            return self.just_after(drive).voltage_v;
        }
        if let (Drive::Feedback(pid), AmplifierMode::Linear) = (drive, now.mode.amplifier)
            && let Some(tables) = &self.tables
            && let Some(carried) = tables.carried_at(now.time_ns, pid)
        {
            return carried.demand;
        }
        now.axis
            .voltage_v(&now.mode, drive, seconds(now.time_ns), &now.y)
    }

    /// What motor and carriage have just after `drive` has given its command, with the
    /// changes of mode that it and the loads make at once.
    pub fn just_after(&self, drive: &Drive<'_>) -> Moment {
        let (mut there, time_s) = (self.now, seconds(self.now.time_ns));
        there.take_up(drive);
        if let Solver::Rk4 { .. } = self.solver {
            there.mode = there.axis.mode_of_state(drive, time_s, &there.y);
        } else {
            // Modes without end are an error of the interval that follows.
            let _ = there.settle(drive, &Interval::new(time_s, 0.0), &mut ());
        }
        Moment {
            voltage_v: there.axis.voltage_v(&there.mode, drive, time_s, &there.y),
            current_a: there.y[CURRENT],
            acceleration_mps2: there.acceleration_mps2(),
            contact: there.contact(),
        }
    }

    /// Kinetic energy of both sides and the energy stored in the joint \[J\].
    pub fn mechanical_energy_j(&self) -> f64 {
        self.now.axis.mechanical_energy_j(&self.state())
    }

    /// Advances to `until_ns` (no earlier than now) under `drive`.
    ///
    /// # Errors
    /// [`PlantError`] if a state leaves the finite numbers, the plant is too
    /// stiff for the solver, or its mode changes without end; the state is
    /// then that of the last completed step.
    #[inline(always)]
    pub fn advance(
        &mut self,
        drive: &Drive<'_>,
        until_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let length_ns = until_ns.saturating_sub(self.now.time_ns);
        if length_ns == 0 {
            return Ok(());
        }
        if until_ns >= self.force_until_ns() {
            return self.advance_past_loads(drive, until_ns, watch);
        }
        self.advance_under_force(drive, length_ns, watch)
    }

    /// The same where loads come or go on the way.
    #[cold]
    #[inline(never)]
    fn advance_past_loads(
        &mut self,
        drive: &Drive<'_>,
        until_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        while self.now.time_ns < until_ns {
            let end_ns = until_ns.min(self.force_until_ns());
            self.advance_under_force(drive, end_ns - self.now.time_ns, watch)?;
            if end_ns == self.force_until_ns() {
                self.change_force(self.next_force);
            }
        }
        Ok(())
    }

    /// The instant at which the force changes next \[ns\].
    #[inline(always)]
    fn force_until_ns(&self) -> u64 {
        let next = self.forces.get(self.next_force);
        next.map_or(u64::MAX, |(from_ns, _)| *from_ns)
    }

    /// From now on the force of that place acts.
    fn change_force(&mut self, place: usize) {
        // None changes at the last nanosecond that can be counted.
        let Some(&(_, to_n)) = self.forces.get(place) else {
            return;
        };
        let from_n = self.now.axis.load_force_n;
        self.next_force = place + 1;
        if from_n == to_n {
            return;
        }
        self.now.axis.load_force_n = to_n;
        let others = &mut self.other_tables;
        others.extend(self.tables.take().map(|mut tables| {
            tables.carried = None;
            (from_n, tables)
        }));
        let known = others.iter().position(|(force_n, _)| *force_n == to_n);
        self.tables = known.map(|place| others.swap_remove(place).1);
    }

    /// Advances under the force that acts now.
    #[inline(always)]
    fn advance_under_force(
        &mut self,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let until_ns = self.now.time_ns + length_ns;
        let now = &mut self.now;
        match self.solver {
            Solver::Exact => {
                let tables = self.tables.get_or_insert_default();
                in_fours!(
                    self.level,
                    simd => now.advance_exactly(simd, tables, drive, length_ns, watch)
                )?;
            }
            Solver::Dopri5 { tolerance } => {
                now.advance_smoothly(&mut self.steps, drive, length_ns, tolerance, watch)?;
            }
            Solver::Rk4 { step_ns } => now.advance_fixed(drive, length_ns, step_ns, watch)?,
        }
        now.time_ns = until_ns;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;
    use crate::exact::tests::of_the_paper;

    /// The last nanosecond that can be counted is an end like any other.
    #[test]
    fn no_load_comes_at_the_end_of_time() {
        let solver = Solver::Rk4 { step_ns: u64::MAX };
        let mut plant = Plant::new(&of_the_paper(Joint::Rigid), solver);
        plant.advance(&Drive::Held(0.0), u64::MAX, &mut ()).unwrap();
        assert_eq!(plant.time_ns(), u64::MAX);
    }
}
