//! The same axis under the paper's continuous law (eq. 27-31), solved by
//! `diffsol`'s `tsit45` with root finding: workload W3. The integral of β is
//! a sixth state; the breaks of the motion are stops; rows come from the
//! dense output.

use std::marker::PhantomData;

use bench_benches::elastic_axis::{EPSILON, ElasticAxis, State, beta_rad};
use bench_benches::lockstep::seconds;
use diffsol::{
    NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverStopReason,
};
use hil_core::case::Case;
use plant::Motion;

use crate::contact::{Change, Contact, GUARDS, YardstickError};

type Matrix = NalgebraMat<f64>;
type Vector = NalgebraVec<f64>;

/// First step, and the first after a break of the motion \[s\].
const FIRST_STEP_S: f64 = 1e-5;

/// Index of `β̂ = ∫β dt` after the five states of the axis.
const BETA_INTEGRAL: usize = 5;

/// The law of eq. 27-31.
#[derive(Debug)]
struct Law {
    motion: Motion,
    /// `K_0·K_p/z` and so on, so that each error is `z·α_ref − β` and its kin.
    proportional: f64,
    integral: f64,
    derivative: f64,
    /// Carriage displacement to gear angle, `1/p` \[rad/m\].
    radians_per_m: f64,
    limit_v: f64,
}

impl Law {
    fn new(case: &Case) -> Self {
        let (transmission, gains) = (&case.axis.transmission, &case.controller.gains);
        let k0 = case.amplifier.gain * case.encoder.counts_per_rad * case.dac.step_v
            / transmission.gear_ratio;
        Self {
            motion: case.motion.clone(),
            proportional: k0 * gains.kp,
            integral: k0 * gains.ki_per_s,
            derivative: k0 * gains.kd_s,
            radians_per_m: 1.0 / transmission.screw_pitch_m_per_rad,
            limit_v: case.amplifier.voltage_limit_v,
        }
    }

    #[inline]
    fn voltage_v(&self, time_s: f64, y: &State, beta_integral: f64) -> f64 {
        let (r, s) = (self.motion.at(time_s), self.radians_per_m);
        let e = r.displacement_m * s - beta_rad(y);
        let e_dot = r.velocity_mps * s - (y[1] + y[3]);
        let e_hat = r.displacement_integral_ms * s - beta_integral;
        (self.proportional * e + self.integral * e_hat + self.derivative * e_dot)
            .clamp(-self.limit_v, self.limit_v)
    }
}

/// Runs a case from rest. `observe` gets the state of each row; returned are
/// the changes of contact.
///
/// # Errors
/// [`YardstickError`] if `diffsol` gives up or a contact is missed.
pub fn run(
    case: &Case,
    tolerance: f64,
    observe: impl FnMut(&State),
) -> Result<Vec<Change>, YardstickError> {
    let Some(axis) = ElasticAxis::new(case) else {
        return Ok(Vec::new());
    };
    let (law, contact) = (Law::new(case), Contact::new(axis));
    let problem = OdeBuilder::<Matrix>::new()
        .rtol(tolerance)
        .atol([tolerance])
        .h0(FIRST_STEP_S)
        .rhs(|y: &[f64], _: &[f64], t: f64, dy: &mut [f64]| {
            let ([states @ .., integral], [rates @ .., beta]) = (y, dy) else {
                return;
            };
            if let (Ok(y), Ok(dy)) = (states.try_into(), <&mut State>::try_from(rates)) {
                let voltage_v = law.voltage_v(t, y, *integral);
                *dy = axis.derivative(&contact.flank(), voltage_v, y);
                *beta = beta_rad(y);
            }
        })
        .root(
            |y: &[f64], _: &[f64], _: f64, g: &mut [f64]| {
                g.copy_from_slice(&contact.guards(y[EPSILON]));
            },
            GUARDS,
        )
        .init(
            |_: &[f64], _: f64, y: &mut [f64]| y.fill(0.0),
            BETA_INTEGRAL + 1,
        )
        .build()?;
    let solver = problem.tsit45()?;
    let mut driven = Driven {
        scratch: solver.state().y.clone(),
        solver,
        law: &law,
        contact: &contact,
        interval_ns: case.run.row_interval_ns,
        next_row_ns: 0,
        observe,
        changes: Vec::new(),
        equations: PhantomData,
    };
    let duration_s = seconds(case.run.duration_ns);
    let mut stops_s = case.motion.breaks_s().to_vec();
    stops_s.push(duration_s);
    stops_s.retain(|&stop_s| stop_s <= duration_s);
    for stop_s in stops_s {
        // Intervals of no length have their break at that of the next.
        if stop_s > driven.solver.state().t + 1e-12 {
            driven.advance(stop_s)?;
        }
    }
    Ok(driven.changes)
}

/// A solver with what it is driven by.
struct Driven<'a, E, S, O> {
    solver: S,
    law: &'a Law,
    contact: &'a Contact,
    interval_ns: u64,
    next_row_ns: u64,
    observe: O,
    scratch: Vector,
    changes: Vec<Change>,
    equations: PhantomData<&'a E>,
}

impl<'a, E, S, O> Driven<'a, E, S, O>
where
    E: OdeEquations<T = f64, V = Vector, M = Matrix> + 'a,
    S: OdeSolverMethod<'a, E>,
    O: FnMut(&State),
{
    /// Hands out the rows of the last step up to `until_s`.
    fn rows(&mut self, until_s: f64) -> Result<(), YardstickError> {
        while seconds(self.next_row_ns) <= until_s {
            let row_s = seconds(self.next_row_ns);
            self.solver.interpolate_inplace(row_s, &mut self.scratch)?;
            (self.observe)(&std::array::from_fn(|i| self.scratch[i]));
            self.next_row_ns += self.interval_ns;
        }
        Ok(())
    }

    /// Changes the mode at a root and starts again from there.
    fn switch(&mut self, root_s: f64, guard: usize) -> Result<(), YardstickError> {
        let step_s = self.solver.state().h;
        self.solver.state_mut_back(root_s)?;
        let (change, epsilon) = self.contact.switch(guard, root_s);
        self.changes.push(change);
        let state = self.solver.state_mut();
        state.y[EPSILON] = epsilon;
        let y: State = std::array::from_fn(|i| state.y[i]);
        let voltage_v = self.law.voltage_v(root_s, &y, state.y[BETA_INTEGRAL]);
        let rates = self
            .contact
            .axis
            .derivative(&self.contact.flank(), voltage_v, &y);
        for (i, rate) in rates.into_iter().enumerate() {
            state.dy[i] = rate;
        }
        state.dy[BETA_INTEGRAL] = beta_rad(&y);
        *state.h = step_s;
        Ok(())
    }

    /// Steps until `stop_s`; the motion is smooth until then.
    fn advance(&mut self, stop_s: f64) -> Result<(), YardstickError> {
        if *self.solver.state_mut().h < FIRST_STEP_S {
            *self.solver.state_mut().h = FIRST_STEP_S;
        }
        self.solver.set_stop_time(stop_s)?;
        let mut fresh = false;
        loop {
            let reason = self.solver.step()?;
            let state = self.solver.state();
            let time_s = state.t;
            if fresh && self.contact.guards(state.y[EPSILON])[0] < 0.0 {
                return Err(YardstickError::MissedContact { time_s });
            }
            fresh = false;
            match reason {
                OdeSolverStopReason::RootFound(root_s, guard) => {
                    self.rows(root_s)?;
                    self.switch(root_s, guard)?;
                    fresh = true;
                }
                OdeSolverStopReason::InternalTimestep => self.rows(time_s)?,
                OdeSolverStopReason::TstopReached => {
                    self.rows(time_s)?;
                    *self.solver.state_mut().t = stop_s;
                    // A row at the stop itself, should rounding have left it out.
                    return self.rows(stop_s);
                }
            }
        }
    }
}
