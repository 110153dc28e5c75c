//! The exact solver and what it is held against. Everything that the tests
//! need to know of how either is chosen stands here.

use hil_core::case::{Case, SolverChoice};
use plant::{AxisParameters, Plant, Solver};

/// The solver under test.
pub const fn exact() -> Solver {
    Solver::Exact
}

/// Tolerance of the `dopri5` that the exact solver is held against: a step
/// may add 1e-15 rad, rad/s or A, the last bit of a number near 10.
pub const REFERENCE_TOLERANCE: f64 = 1e-14;

/// Tolerance with which the reference is repeated where the two disagree: a
/// hundred thousand steps of 1e-15 are more than what is asked for.
pub const FINER_TOLERANCE: f64 = 1e-15;

/// `plant` as it stands (state, mode, time), to be advanced by `dopri5`.
pub fn with_dopri5(plant: &Plant, axis: &AxisParameters, tolerance: f64) -> Plant {
    plant.resolved_with(axis, Solver::Dopri5 { tolerance })
}

/// `case` with the solver under test.
pub fn run_exactly(case: &Case) -> Case {
    let mut case = case.clone();
    case.run.solver = SolverChoice::Exact;
    case
}

/// `case` with the reference.
pub fn run_with_dopri5(case: &Case, tolerance: f64) -> Case {
    let mut case = case.clone();
    case.run.solver = SolverChoice::Dopri5;
    case.run.tolerance = tolerance;
    case
}

/// `case` with the paper's fixed steps, which locate nothing.
pub fn run_with_rk4(case: &Case) -> Case {
    let mut case = case.clone();
    case.run.solver = SolverChoice::Rk4;
    case
}
