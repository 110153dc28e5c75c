//! The workloads. W1: simulation 2 of the paper, law `quantised`, Δt = 1 ms,
//! 1.5 s, about ten contact changes. W2: the same at 0.1 ms. W3: the same move
//! under the `continuous` law. W4: 10,000 runs of W1 with random b, K_p, K_d, the rows of
//! `w4.csv`. W5: the ball screw of the templates, with friction, and the first 1,000 of the
//! draws as shares of its gap, its K_p and its K_d.

use std::error::Error;
use std::path::Path;

use hil_core::case::Case;
use hil_runner::files;
use plant::Joint;

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

/// The largest draws of `w4.csv`.
const LARGEST: [f64; 3] = [0.0698, 6.0, 0.1];

/// The runs of W4.
///
/// # Errors
/// Those of the run file's checks, or of the file of draws.
pub fn w4(law: &str) -> Result<Vec<Case>, Box<dyn Error>> {
    let mut case = case(law, W1, "exact", W1_TOLERANCE)?;
    case.run.events = false;
    let cases = draws()?.into_iter().map(|[backlash_half_rad, kp, kd_s]| {
        let mut case = with_backlash(&case, |_| backlash_half_rad)?;
        (case.controller.gains.kp, case.controller.gains.kd_s) = (kp, kd_s);
        Ok(case)
    });
    cases.collect()
}

/// The runs of W5.
///
/// # Errors
/// As [`w4`].
pub fn w5(law: &str) -> Result<Vec<Case>, Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/templates/ballscrew.toml");
    let set = format!("controller.law={law}");
    let read = files::case(&file.to_string_lossy(), &[set]);
    let mut case = read.map_err(|errors| errors.to_string())?;
    case.run.events = false;
    let cases = draws()?.into_iter().take(1000).map(|draw| {
        let [gap, kp, kd] = [0, 1, 2].map(|i| draw[i] / LARGEST[i]);
        let mut case = with_backlash(&case, |half_rad| 2.0 * gap * half_rad)?;
        case.controller.gains.kp *= 0.5 + kp;
        case.controller.gains.kd_s *= 0.5 + kd;
        Ok(case)
    });
    cases.collect()
}

/// The case with another b, made from its own.
fn with_backlash(case: &Case, of: impl Fn(f64) -> f64) -> Result<Case, Box<dyn Error>> {
    let mut case = case.clone();
    let Joint::Elastic(joint) = &mut case.axis.transmission.joint else {
        return Err("a rigid joint".into());
    };
    joint.backlash_half_rad = of(joint.backlash_half_rad);
    Ok(case)
}

/// b \[rad\], K_p and K_d of the draws.
fn draws() -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("w4.csv");
    let text = std::fs::read_to_string(file)?;
    let draws = text.lines().skip(1).map(|line| {
        let mut numbers = line.split(',').map(str::parse::<f64>);
        let mut next = || numbers.next().ok_or("a row is too short");
        Ok([next()??, next()??, next()??])
    });
    draws.collect()
}
