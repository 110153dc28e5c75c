//! The plant: advanced from one voltage update to the next, with every change
//! of contact, of sliding and sticking, and of the amplifier's limit located.

use crate::error::PlantError;
use crate::exact::{FIGURES, Tables, figures_at};
use crate::hybrid::mode::{Guard, Mode};
use crate::model::axis::{Axis, Drive};
use crate::model::joint::{Contact, Flank, JointMode};
use crate::model::parameters::AxisParameters;
use crate::model::state::{State, Vector};
use crate::observe::span::Watch;
use crate::stepped::adaptive::Interval;
use crate::stepped::step_size::StepSize;

/// How the equations are solved.
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
    pub(crate) axis: Axis,
    solver: Solver,
    pub(crate) mode: Mode,
    pub(crate) y: Vector,
    pub(crate) time_ns: u64,
    /// The guard whose surface the state lies on since the last mode change.
    pub(crate) fresh: Option<Guard>,
    /// Steps that the error control of solver `dopri5` would take.
    pub(crate) steps: StepSize,
    /// What solver `exact` has computed about the axis.
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
            solver,
            ..Self::of_axis(Axis::new(parameters, tolerance))
        }
    }

    /// As [`Plant::new`], from any other state.
    pub fn with_state(parameters: &AxisParameters, solver: Solver, state: &State) -> Self {
        let mut plant = Self::new(parameters, solver);
        plant.y = state.to_vector();
        plant.mode = plant.axis.mode_of_state(&Drive::Held(0.0), 0.0, &plant.y);
        plant
    }

    /// At rest at zero, solver `exact`.
    pub(crate) fn of_axis(axis: Axis) -> Self {
        Self {
            axis,
            solver: Solver::Exact,
            mode: axis.mode_at_rest(),
            y: Vector::zeros(),
            time_ns: 0,
            fresh: None,
            steps: StepSize::new(),
            tables: None,
        }
    }

    /// Takes over a state within the present mode.
    pub(crate) fn set(&mut self, state: &State, time_ns: u64) {
        self.y = state.to_vector();
        self.time_ns = time_ns;
    }

    /// A copy in the same mode at another state and time.
    pub(crate) fn at(&self, state: &State, time_ns: u64) -> Self {
        Self {
            y: state.to_vector(),
            time_ns,
            tables: None,
            ..*self
        }
    }

    /// Puts a joint with a gap into contact with the flank of this sign, or
    /// opens it at 0.
    pub(crate) fn set_contact(&mut self, sign: f64) {
        if matches!(self.mode.joint, JointMode::Open | JointMode::Loaded(_)) {
            self.mode.joint = match sign {
                s if s > 0.0 => JointMode::Loaded(Flank::Drive),
                s if s < 0.0 => JointMode::Loaded(Flank::Coast),
                _ => JointMode::Open,
            };
        }
    }

    pub(crate) fn axis(&self) -> &Axis {
        &self.axis
    }

    pub(crate) fn mode(&self) -> &Mode {
        &self.mode
    }

    /// The figures now, x_ref being `x_ref_m`.
    pub(crate) fn figures(&self, x_ref_m: f64) -> [f64; FIGURES] {
        figures_at(&self.axis, &self.mode, &self.y, x_ref_m)
    }

    /// ẍ in a state, the flank of this sign being in contact \[m/s²\].
    pub(crate) fn acceleration_at_mps2(&self, state: &State, flank: f64) -> f64 {
        let mut plant = self.at(state, self.time_ns);
        plant.set_contact(flank);
        plant.acceleration_mps2()
    }

    /// Whether the state lies on the surface of the last change of mode.
    pub(crate) fn is_fresh(&self) -> bool {
        self.fresh.is_some()
    }

    /// Back to the start, at rest at zero; what solver `exact` has computed
    /// about the axis is kept.
    pub fn reset(&mut self) {
        self.mode = self.axis.mode_at_rest();
        self.y = Vector::zeros();
        self.time_ns = 0;
        self.fresh = None;
        self.steps = StepSize::new();
    }

    /// A plant that goes on from here with another solver: state, mode and
    /// time are this one's, `parameters` as in [`Plant::new`].
    pub fn resolved_with(&self, parameters: &AxisParameters, solver: Solver) -> Self {
        Self {
            mode: self.mode,
            y: self.y,
            time_ns: self.time_ns,
            fresh: self.fresh,
            ..Self::new(parameters, solver)
        }
    }

    /// State now.
    pub fn state(&self) -> State {
        State::from_vector(&self.y)
    }

    /// Time now \[ns\].
    pub fn time_ns(&self) -> u64 {
        self.time_ns
    }

    /// Contact of the joint now.
    pub fn contact(&self) -> Contact {
        self.mode.joint.contact()
    }

    /// Carriage acceleration `ẍ = p·γ̈` now \[m/s²\].
    pub fn acceleration_mps2(&self) -> f64 {
        self.axis.carriage_acceleration_mps2(&self.mode, &self.y)
    }

    /// Motor voltage that `drive` gives now \[V\].
    pub fn voltage_v(&self, drive: &Drive<'_>) -> f64 {
        self.axis
            .voltage_v(&self.mode, drive, seconds(self.time_ns), &self.y)
    }

    /// Kinetic energy of both sides and the energy stored in the joint \[J\].
    pub fn mechanical_energy_j(&self) -> f64 {
        self.axis.mechanical_energy_j(&self.state())
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
        let length_ns = until_ns.saturating_sub(self.time_ns);
        if length_ns == 0 {
            return Ok(());
        }
        match self.solver {
            Solver::Exact => {
                let mut tables = self.tables.take().unwrap_or_default();
                let result = self.advance_exactly(&mut tables, drive, length_ns, watch);
                self.tables = Some(tables);
                result?;
            }
            Solver::Dopri5 { tolerance } => {
                let (start_s, length_s) = (seconds(self.time_ns), seconds(length_ns));
                let mut interval = Interval::new(start_s, length_s);
                self.advance_smoothly(drive, &mut interval, tolerance, watch)?;
            }
            Solver::Rk4 { step_ns } => self.advance_fixed(drive, length_ns, step_ns, watch)?,
        }
        self.time_ns = until_ns;
        Ok(())
    }
}

/// Nanoseconds as seconds, correctly rounded.
pub(crate) fn seconds(ns: u64) -> f64 {
    count(ns) / 1e9
}

/// A count as a float; exact below 2^53, which is 104 days in nanoseconds.
#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
pub(crate) fn count(n: u64) -> f64 {
    n as f64
}
