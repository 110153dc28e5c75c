//! The plant: advanced from one voltage update to the next, with every change
//! of contact, of sliding and sticking, and of the amplifier's limit located.

use crate::axis::{Axis, Drive, Instant};
use crate::dopri5::{self, Step};
use crate::error::PlantError;
use crate::joint::Contact;
use crate::mode::{Guard, Mode};
use crate::parameters::AxisParameters;
use crate::pid::Side;
use crate::quartic::Samples;
use crate::rk4;
use crate::span::{ContactChange, Interior, Span, Watch};
use crate::state::{State, Vector};

/// Mode changes within one interval after which the plant gives up. The
/// liveliest rattle seen changes a few times per sample.
const MAX_EVENTS: u32 = 10_000;

/// Mode changes at one and the same instant after which the plant gives up: a
/// contact, a break of stiction and a limit can coincide, more cannot.
const MAX_EVENTS_AT_ONCE: u32 = 8;

/// Steps within one interval after which the plant is called too stiff.
const MAX_STEPS: u32 = 1_000_000;

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solver {
    /// Adaptive Dormand-Prince 5(4), events located.
    Dopri5 {
        /// Local error per step, absolute for states near 1 (rad, rad/s, A),
        /// relative to a hundredth of larger ones.
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
    axis: Axis,
    solver: Solver,
    mode: Mode,
    y: Vector,
    time_ns: u64,
    /// The guard whose surface the state lies on since the last mode change.
    fresh: Option<Guard>,
    /// Step that the error control would take next \[s\].
    next_step_s: f64,
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
    /// assert!((plant.state().beta_dot_radps() / 2.0 - 40.0).abs() < 1e-3);
    /// # Ok::<(), plant::PlantError>(())
    /// ```
    pub fn new(parameters: &AxisParameters, solver: Solver) -> Self {
        let axis = Axis::new(parameters);
        Self {
            axis,
            solver,
            mode: axis.mode_at_rest(),
            y: Vector::zeros(),
            time_ns: 0,
            fresh: None,
            next_step_s: 1e-5,
        }
    }

    /// As [`Plant::new`], from any other state.
    pub fn with_state(parameters: &AxisParameters, solver: Solver, state: &State) -> Self {
        let mut plant = Self::new(parameters, solver);
        plant.y = state.to_vector();
        plant.mode = plant.axis.mode_of_state(&Drive::Held(0.0), 0.0, &plant.y);
        plant
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
            Solver::Dopri5 { tolerance } => {
                let mut interval = Interval {
                    start_s: seconds(self.time_ns),
                    length_s: seconds(length_ns),
                    done_s: 0.0,
                    events: 0,
                    steps: 0,
                };
                self.advance_smoothly(drive, &mut interval, tolerance, watch)?;
            }
            Solver::Rk4 { step_ns } => self.advance_fixed(drive, length_ns, step_ns, watch)?,
        }
        self.time_ns = until_ns;
        Ok(())
    }

    /// Solver `dopri5`: piece by piece between the breaks of the command.
    fn advance_smoothly(
        &mut self,
        drive: &Drive<'_>,
        interval: &mut Interval,
        tolerance: f64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        if let Drive::Feedback(pid) = drive {
            for break_s in pid.motion().breaks_s() {
                let offset_s = break_s - interval.start_s;
                if offset_s > interval.done_s && offset_s < interval.length_s {
                    self.advance_piece(drive, interval, offset_s, tolerance, watch)?;
                }
            }
        }
        self.advance_piece(drive, interval, interval.length_s, tolerance, watch)
    }

    /// Advances to `end_s` after the interval's start; the right-hand side is
    /// smooth in time until then.
    fn advance_piece(
        &mut self,
        drive: &Drive<'_>,
        interval: &mut Interval,
        end_s: f64,
        tolerance: f64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let mut f0 = self.settle(drive, interval, watch)?;
        while interval.done_s < end_s {
            let left_s = end_s - interval.done_s;
            // A remainder too short to matter is joined to this step.
            let last = self.next_step_s >= left_s * 0.999;
            let h = if last { left_s } else { self.next_step_s };
            let time_s = interval.now_s();
            let (axis, mode) = (self.axis, self.mode);
            let f = |t: f64, y: &Vector| axis.derivative(&mode, drive, t, y);
            let step = dopri5::step(f, time_s, &self.y, &f0, h);
            let error = error_norm(&step, tolerance);
            interval.steps += 1;
            if !step.y1.iter().all(|v| v.is_finite()) && h < 1e-12 {
                return Err(PlantError::NonFinite { time_s });
            }
            if h < 1e-15 && !last || interval.steps > MAX_STEPS {
                return Err(PlantError::TooStiff { time_s });
            }
            if error.is_nan() || error > 1.0 {
                self.next_step_s = h * growth(error).min(0.9);
                continue;
            }
            let wanted_s = h * growth(error);
            match self.first_event(drive, time_s, &step) {
                None => {
                    self.accept(drive, time_s, &step, watch);
                    interval.done_s = if last { end_s } else { interval.done_s + h };
                    self.fresh = None;
                    f0 = step.f1;
                    // A step cut short by the interval's end says little.
                    self.next_step_s = if last {
                        wanted_s.max(self.next_step_s)
                    } else {
                        wanted_s
                    };
                }
                Some((guard, theta)) => {
                    let (shorter, hit) = self.locate(drive, time_s, &step, guard, theta);
                    self.accept(drive, time_s, &shorter, watch);
                    interval.done_s += shorter.h;
                    self.fresh = None;
                    f0 = shorter.f1;
                    if hit {
                        interval.count_event()?;
                        self.switch(guard, drive, interval, watch);
                        f0 = self.settle(drive, interval, watch)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Hands the step to the observer and moves to its end.
    fn accept(&mut self, drive: &Drive<'_>, time_s: f64, step: &Step, watch: &mut impl Watch) {
        watch.span(&Span {
            axis: &self.axis,
            drive,
            modes: (self.mode, self.mode),
            start_s: time_s,
            length_s: step.h,
            y: (&step.y0, &step.y1),
            dy: (&step.f0, &step.f1),
            interior: Interior::Dense(step),
        });
        self.y = step.y1;
    }

    /// The guard that is first to fall below zero within the step, and where.
    fn first_event(&self, drive: &Drive<'_>, time_s: f64, step: &Step) -> Option<(Guard, f64)> {
        let mut first: Option<(Guard, f64)> = None;
        let middle = step.at(0.5);
        for guard in self.guards(drive).into_iter().flatten() {
            let look = |time_s, side, y, dy| {
                let instant = Instant {
                    time_s,
                    side,
                    y,
                    dy,
                };
                self.axis.guard(guard, &self.mode, drive, instant)
            };
            let (start, start_rate) = look(time_s, Side::After, &step.y0, &step.f0);
            let (end, end_rate) = look(time_s + step.h, Side::Before, &step.y1, &step.f1);
            // The rate in the middle is not used; any derivative will do.
            let (value, _) = look(time_s + 0.5 * step.h, Side::After, &middle, &step.f0);
            let samples = Samples {
                start,
                start_slope: start_rate * step.h,
                middle: value,
                end,
                end_slope: end_rate * step.h,
            };
            let root = if self.fresh == Some(guard) {
                samples.without_root_at_start().first_negative()
            } else {
                samples.quartic().first_negative()
            };
            if let Some(theta) = root
                && first.is_none_or(|(_, earliest)| theta < earliest)
            {
                first = Some((guard, theta));
            }
        }
        first
    }

    /// Shortens the step so that it ends where `guard` reaches zero: Newton
    /// on the length of the step itself, so that the root is as good as the
    /// solution and not merely as its dense output. Where the guard turns out
    /// to stay positive (it only grazes zero), the shorter step is still
    /// valid; `false` says that nothing switches.
    fn locate(
        &self,
        drive: &Drive<'_>,
        time_s: f64,
        step: &Step,
        guard: Guard,
        theta: f64,
    ) -> (Step, bool) {
        let f = |t: f64, y: &Vector| self.axis.derivative(&self.mode, drive, t, y);
        let look = |step: &Step| {
            let instant = Instant {
                time_s: time_s + step.h,
                side: Side::Before,
                y: &step.y1,
                dy: &step.f1,
            };
            self.axis.guard(guard, &self.mode, drive, instant)
        };
        let mut h = theta * step.h;
        let (mut low_s, mut high_s) = (0.0, None);
        let mut trial = dopri5::step(f, time_s, &step.y0, &step.f0, h);
        for _ in 0..50 {
            let (value, rate) = look(&trial);
            if value > 0.0 {
                low_s = h;
            } else {
                high_s = Some(h);
            }
            let correction_s = -value / rate;
            // Below the resolution of the clock there is nothing to gain.
            if value == 0.0 || correction_s.abs() < 1e-16 {
                return (trial, true);
            }
            if rate >= 0.0 && high_s.is_none() {
                return (trial, false);
            }
            let top_s = high_s.unwrap_or(step.h);
            let mut next_s = h + correction_s;
            if !(next_s > low_s && next_s < top_s) {
                next_s = match high_s {
                    Some(high_s) => 0.5 * (low_s + high_s),
                    None if h < step.h => step.h,
                    None => return (trial, false),
                };
            }
            if next_s == h {
                break;
            }
            h = next_s;
            trial = dopri5::step(f, time_s, &step.y0, &step.f0, h);
        }
        (trial, true)
    }

    /// Changes the mode at `guard` and reports a change of contact.
    fn switch(
        &mut self,
        guard: Guard,
        drive: &Drive<'_>,
        interval: &Interval,
        watch: &mut impl Watch,
    ) {
        let from = self.contact();
        let acceleration_before_mps2 = self.acceleration_mps2();
        self.mode = self.axis.switch(guard, &self.mode, &mut self.y);
        let opposite = guard.opposite(&self.mode);
        self.fresh = self
            .guards(drive)
            .contains(&Some(opposite))
            .then_some(opposite);
        let to = self.contact();
        if from != to {
            watch.contact_change(&ContactChange {
                time_s: interval.now_s(),
                from,
                to,
                impact: matches!(guard, Guard::Meet(_)),
                acceleration_before_mps2,
                acceleration_after_mps2: self.acceleration_mps2(),
            });
        }
    }

    /// Changes modes until every guard holds at this very instant: a contact
    /// may break the stick, a new voltage may move a rigid axis off rest.
    /// Returns the derivative.
    fn settle(
        &mut self,
        drive: &Drive<'_>,
        interval: &Interval,
        watch: &mut impl Watch,
    ) -> Result<Vector, PlantError> {
        let time_s = interval.now_s();
        for _ in 0..MAX_EVENTS_AT_ONCE {
            let dy = self.axis.derivative(&self.mode, drive, time_s, &self.y);
            let instant = Instant {
                time_s,
                side: Side::After,
                y: &self.y,
                dy: &dy,
            };
            let broken = self.guards(drive).into_iter().flatten().find(|&guard| {
                let (value, rate) = self.axis.guard(guard, &self.mode, drive, instant);
                self.fresh != Some(guard) && (value < 0.0 || value == 0.0 && rate < 0.0)
            });
            match broken {
                None => return Ok(dy),
                Some(guard) => self.switch(guard, drive, interval, watch),
            }
        }
        Err(PlantError::TooManyEvents { time_s })
    }

    fn guards(&self, drive: &Drive<'_>) -> crate::mode::Guards {
        let feedback = matches!(drive, Drive::Feedback(_));
        self.mode.guards(self.axis.releases(), feedback)
    }

    /// Solver `rk4`: equal steps, the mode from the state at every stage.
    fn advance_fixed(
        &mut self,
        drive: &Drive<'_>,
        length_ns: u64,
        step_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let axis = self.axis;
        let f = |t: f64, y: &Vector| axis.derivative(&axis.mode_of_state(drive, t, y), drive, t, y);
        let start_s = seconds(self.time_ns);
        let steps = length_ns.div_ceil(step_ns.max(1));
        let h = seconds(length_ns) / count(steps);
        let mut dy0 = f(start_s, &self.y);
        self.mode = axis.mode_of_state(drive, start_s, &self.y);
        for i in 0..steps {
            let time_s = start_s + count(i) * h;
            let y0 = self.y;
            let y1 = rk4::step(f, time_s, &y0, h);
            if !y1.iter().all(|v| v.is_finite()) {
                return Err(PlantError::NonFinite { time_s });
            }
            let (before, end_s) = (self.mode, time_s + h);
            let acceleration_before_mps2 = self.acceleration_mps2();
            let dy1 = f(end_s, &y1);
            self.y = y1;
            self.mode = axis.mode_of_state(drive, end_s, &y1);
            watch.span(&Span {
                axis: &axis,
                drive,
                modes: (before, self.mode),
                start_s: time_s,
                length_s: h,
                y: (&y0, &y1),
                dy: (&dy0, &dy1),
                interior: Interior::Unknown,
            });
            let (from, to) = (before.joint.contact(), self.contact());
            if from != to {
                watch.contact_change(&ContactChange {
                    time_s: end_s,
                    from,
                    to,
                    impact: before.joint == crate::joint::JointMode::Open,
                    acceleration_before_mps2,
                    acceleration_after_mps2: self.acceleration_mps2(),
                });
            }
            dy0 = dy1;
        }
        Ok(())
    }
}

/// Where an advance stands.
#[derive(Debug)]
struct Interval {
    start_s: f64,
    length_s: f64,
    done_s: f64,
    events: u32,
    steps: u32,
}

impl Interval {
    fn now_s(&self) -> f64 {
        self.start_s + self.done_s
    }

    fn count_event(&mut self) -> Result<(), PlantError> {
        self.events += 1;
        if self.events > MAX_EVENTS {
            return Err(PlantError::TooManyEvents {
                time_s: self.now_s(),
            });
        }
        Ok(())
    }
}

/// Largest error of a component relative to what the tolerance allows it.
fn error_norm(step: &Step, tolerance: f64) -> f64 {
    let mut norm = 0.0_f64;
    for (error, y) in step.error.iter().zip(step.y1.iter()) {
        let allowed = tolerance * (1.0 + 0.01 * y.abs());
        let share = error.abs() / allowed;
        // `max` would hide a NaN.
        norm = if share > norm || share.is_nan() {
            share
        } else {
            norm
        };
    }
    norm
}

/// Factor for the next step: the error goes with h⁵.
fn growth(error: f64) -> f64 {
    if error.is_nan() {
        return 0.2;
    }
    (0.9 * libm::pow(error, -0.2)).clamp(0.2, 5.0)
}

/// Nanoseconds as seconds, correctly rounded.
fn seconds(ns: u64) -> f64 {
    count(ns) / 1e9
}

/// A count as a float; exact below 2^53, which is 104 days in nanoseconds.
#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
fn count(n: u64) -> f64 {
    n as f64
}
