//! The paper's elastic axis solved by `diffsol`'s explicit Runge-Kutta method
//! `tsit45` with root finding, in lockstep with a sampled law.
//!
//! One problem and one solver serve the whole run. At a sample only İ changes
//! (the rest of the last derivative stays the first stage of the next step),
//! and the step size that the error control had found is handed on over the
//! samples, which cut it short.

use std::cell::Cell;

use bench_benches::elastic_axis::{CURRENT, EPSILON, State, beta_rad};
use bench_benches::elastic_axis::{ElasticAxis, Flank};
use bench_benches::lockstep::{Axis, Plan, seconds};
use diffsol::{
    NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverStopReason,
};

use crate::contact::{Change, Contact, GUARDS, YardstickError};

type Matrix = NalgebraMat<f64>;
type Vector = NalgebraVec<f64>;

/// First step of a run \[s\].
const FIRST_STEP_S: f64 = 1e-5;

/// A step that would reach this share of what is left of a sample takes all
/// of it: a sliver would cost as much as a whole step.
const LAST_SHARE: f64 = 0.95;

/// Runs a plan from rest. `observe` gets sample, code and state; returned are
/// the state at the end and the changes of contact.
///
/// # Errors
/// [`YardstickError`] if `diffsol` gives up or a contact is missed.
pub fn run(
    plan: &Plan,
    axis: ElasticAxis,
    tolerance: f64,
    mut observe: impl FnMut(u64, f64, &State),
) -> Result<(State, Vec<Change>), YardstickError> {
    let contact = Contact::new(axis);
    let voltage_v = Cell::new(0.0);
    let problem = OdeBuilder::<Matrix>::new()
        .rtol(tolerance)
        .atol([tolerance])
        .h0(FIRST_STEP_S)
        .rhs(|y: &[f64], _: &[f64], _: f64, dy: &mut [f64]| {
            if let Ok(y) = y.try_into() {
                let rates = axis.derivative(&contact.flank(), voltage_v.get(), y);
                dy.copy_from_slice(&rates);
            }
        })
        .root(
            |y: &[f64], _: &[f64], _: f64, g: &mut [f64]| {
                g.copy_from_slice(&contact.guards(y[EPSILON]));
            },
            GUARDS,
        )
        .init(|_: &[f64], _: f64, y: &mut [f64]| y.fill(0.0), 5)
        .build()?;
    let mut driven = Driven {
        solver: problem.tsit45()?,
        contact: &contact,
        voltage_v: &voltage_v,
        time_s: 0.0,
        wanted_step_s: FIRST_STEP_S,
        changes: Vec::new(),
        equations: std::marker::PhantomData,
    };
    plan.run(&mut driven, |tick, code, driven| {
        observe(tick, code, &driven.state());
    })?;
    Ok((driven.state(), driven.changes))
}

/// A solver with what it is driven by.
struct Driven<'a, E, S> {
    solver: S,
    contact: &'a Contact,
    voltage_v: &'a Cell<f64>,
    time_s: f64,
    /// Step that the error control would take if no sample cut it short \[s\].
    wanted_step_s: f64,
    changes: Vec<Change>,
    equations: std::marker::PhantomData<&'a E>,
}

impl<'a, E, S> Driven<'a, E, S>
where
    E: OdeEquations<T = f64, V = Vector, M = Matrix> + 'a,
    S: OdeSolverMethod<'a, E>,
{
    fn state(&self) -> State {
        let y = self.solver.state().y;
        std::array::from_fn(|i| y[i])
    }

    fn derivative(&self, flank: &Flank) -> State {
        let axis = &self.contact.axis;
        axis.derivative(flank, self.voltage_v.get(), &self.state())
    }

    /// Changes the mode at a root and starts again from there.
    fn switch(&mut self, root_s: f64, guard: usize) -> Result<(), YardstickError> {
        self.solver.state_mut_back(root_s)?;
        let (change, epsilon) = self.contact.switch(guard, root_s);
        self.changes.push(change);
        self.solver.state_mut().y[EPSILON] = epsilon;
        let rates = self.derivative(&self.contact.flank());
        let state = self.solver.state_mut();
        for (i, rate) in rates.into_iter().enumerate() {
            state.dy[i] = rate;
        }
        Ok(())
    }

    /// Steps until `end_s`. The last step is cut by hand: a stop time would
    /// hide the step that the error control asks for.
    fn advance(&mut self, end_s: f64) -> Result<(), YardstickError> {
        let mut fresh = false;
        loop {
            let left_s = end_s - self.solver.state().t;
            let last = self.wanted_step_s >= left_s * LAST_SHARE;
            if last || self.solver.state().h != self.wanted_step_s {
                let step_s = if last { left_s } else { self.wanted_step_s };
                *self.solver.state_mut().h = step_s;
            }
            let reason = self.solver.step()?;
            let state = self.solver.state();
            let time_s = state.t;
            if fresh && self.contact.guards(state.y[EPSILON])[0] < 0.0 {
                return Err(YardstickError::MissedContact { time_s });
            }
            fresh = false;
            let arrived = end_s - time_s <= left_s * 1e-9;
            // A step cut short by the sample says nothing against longer ones.
            if !(last && arrived && state.h < self.wanted_step_s) {
                self.wanted_step_s = state.h;
            }
            match reason {
                OdeSolverStopReason::RootFound(root_s, guard) => {
                    self.switch(root_s, guard)?;
                    fresh = true;
                }
                _ if arrived => return Ok(()),
                _ => {}
            }
        }
    }
}

impl<'a, E, S> Axis for Driven<'a, E, S>
where
    E: OdeEquations<T = f64, V = Vector, M = Matrix> + 'a,
    S: OdeSolverMethod<'a, E>,
{
    type Error = YardstickError;

    fn beta_rad(&self) -> f64 {
        let y = self.solver.state().y;
        beta_rad(&[y[0], 0.0, y[EPSILON]])
    }

    fn hold(&mut self, voltage_v: f64, until_ns: u64) -> Result<(), YardstickError> {
        self.voltage_v.set(voltage_v);
        let rates = self.derivative(&self.contact.flank());
        let end_s = seconds(until_ns);
        let state = self.solver.state_mut();
        // Counted, not summed.
        *state.t = self.time_s;
        state.dy[CURRENT] = rates[CURRENT];
        self.advance(end_s)?;
        self.time_s = end_s;
        Ok(())
    }
}
