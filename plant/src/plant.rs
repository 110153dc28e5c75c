//! The plant: an axis with its state and the solver that advances it from one
//! voltage update to the next.

use crate::exact::Tables;
use crate::hybrid::{Automaton, PlantError};
use crate::model::amplifier::AmplifierMode;
use crate::model::axis::{Axis, AxisParameters, Drive};
use crate::model::joint::Contact;
use crate::model::state::State;
use crate::numerics::seconds;
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
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    now: Automaton,
    solver: Solver,
    /// Steps that the error control of solver `dopri5` would take.
    steps: StepSize,
    /// Memory of solver `exact`: all that it has computed about the axis.
    tables: Option<Box<Tables>>,
}

impl Plant {
    /// At rest at zero, the joint centred in its gap, time 0.
    ///
    /// ```
    /// use plant::{AxisParameters, Carriage, Drive, Joint, Motor, Plant, Resistance, Solver};
    /// let motor = Motor {
    ///     inertia_kg_m2: 2e-4,
    ///     torque_constant_nm_per_a: 0.25,
    ///     resistance_ohm: 1.5,
    ///     inductance_h: 0.0065,
    /// };
    /// let transmission = plant::Transmission {
    ///     gear_ratio: 2.0,
    ///     joint: Joint::Rigid,
    ///     screw_inertia_kg_m2: 8.5e-4,
    ///     screw_pitch_m_per_rad: 5e-3 / (2.0 * std::f64::consts::PI),
    /// };
    /// let carriage = Carriage { mass_kg: 50.0, resistance: Resistance::default() };
    /// let axis = AxisParameters { motor, transmission, carriage };
    /// let mut plant = Plant::new(&axis, Solver::Dopri5 { tolerance: 1e-11 });
    /// // 10 V for two seconds: the motor runs up to V/k_m = 40 rad/s.
    /// plant.advance(&Drive::Held(10.0), 2_000_000_000, &mut ())?;
    /// assert!((plant.state().beta_dot_radps / 2.0 - 40.0).abs() < 1e-3);
    /// # Ok::<(), plant::PlantError>(())
    /// ```
    pub fn new(parameters: &AxisParameters, solver: Solver) -> Self {
        let tolerance = match solver {
            Solver::Dopri5 { tolerance } => tolerance,
            Solver::Exact | Solver::Rk4 { .. } => 0.0,
        };
        Self {
            now: Automaton::new(Axis::new(parameters, tolerance)),
            solver,
            steps: StepSize::new(),
            tables: None,
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
        self.now = Automaton::new(self.now.axis);
        self.steps = StepSize::new();
    }

    /// A plant that goes on from here with another solver: state, mode and
    /// time are this one's, `parameters` as in [`Plant::new`].
    pub fn resolved_with(&self, parameters: &AxisParameters, solver: Solver) -> Self {
        let mut plant = Self::new(parameters, solver);
        plant.now = Automaton {
            axis: plant.now.axis,
            ..self.now
        };
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
        if let (Drive::Feedback(pid), AmplifierMode::Linear) = (drive, now.mode.amplifier)
            && let Some(carried) = self.tables.as_ref().and_then(|t| t.carried.as_ref())
            && carried.is_at(now, pid)
        {
            return carried.demand_v;
        }
        now.axis
            .voltage_v(&now.mode, drive, seconds(now.time_ns), &now.y)
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
        let now = &mut self.now;
        match self.solver {
            Solver::Exact => {
                let tables = self.tables.get_or_insert_default();
                now.advance_exactly(tables, drive, length_ns, watch)?;
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
