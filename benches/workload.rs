//! The workloads. W1: simulation 2 of the paper, law `quantised`, Δt = 1 ms,
//! 1.5 s, about ten contact changes. W2: the same at 0.1 ms. W3: the same move
//! under the `continuous` law. W4: 10,000 runs of W1 with random b, K_p, K_d.

use hil_runner::files;
use std::error::Error;

use hil_core::case::Case;

/// Sample times by workload, as `--set` would have them.
pub const W1: &str = "controller.sample_time_s=0.001";
/// See [`W1`].
pub const W2: &str = "controller.sample_time_s=0.0001";
/// W3 has no samples, but a row every millisecond.
pub const W3: &str = "run.row_interval_s=0.001";

/// Tolerances at which adaptive programs are compared.
pub const W1_TOLERANCE: f64 = 1e-10;
/// See [`W1_TOLERANCE`].
pub const W2_TOLERANCE: f64 = 1e-8;
/// See [`W1_TOLERANCE`].
pub const W3_TOLERANCE: f64 = 1e-8;

/// Simulation 2 of the paper with further settings, as on the command line.
///
/// # Errors
/// Those of the run file's checks.
pub fn paper_2(sets: &[&str]) -> Result<Case, Box<dyn Error>> {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    files::case("paper-2", &sets).map_err(|errors| errors.to_string().into())
}

/// Simulation 2 of the paper for one law, workload, solver and tolerance.
///
/// # Errors
/// Those of the run file's checks.
pub fn case(
    law: &str,
    workload: &str,
    solver: &str,
    tolerance: f64,
) -> Result<Case, Box<dyn Error>> {
    paper_2(&[
        &format!("controller.law={law}"),
        workload,
        &format!("run.solver={solver}"),
        &format!("run.tolerance={tolerance:e}"),
    ])
}
