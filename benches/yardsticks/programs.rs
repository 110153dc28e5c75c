//! All programs of a workload, our own and other people's, ready to be timed.
//! Whoever gives another result than our own solver is not timed.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;

use bench_benches::elastic_axis::ElasticAxis;
use bench_benches::groups::{self, Program, or_exit};
use bench_benches::lockstep::Plan;
use bench_benches::workload::{self, W1, W1_TOLERANCE, W2, W2_TOLERANCE, W3, W3_TOLERANCE};

use crate::odeint::{self, Odeint};
use crate::{diffsol_axis, diffsol_continuous};

/// W1; what has to be built first goes to `folder`.
///
/// # Errors
/// Those of the run file's checks; a program that fails or does not agree.
pub fn w1(folder: &Path) -> Result<Vec<Program>, Box<dyn Error>> {
    let mut programs = groups::w1()?;
    programs.push(diffsol(W1, W1_TOLERANCE)?);
    programs.extend(odeint(folder, "quantised", W1, odeint::W1_TOLERANCE)?);
    Ok(programs)
}

/// W2; see [`w1`].
///
/// # Errors
/// As [`w1`].
pub fn w2(folder: &Path) -> Result<Vec<Program>, Box<dyn Error>> {
    let mut programs = groups::w2()?;
    programs.push(diffsol(W2, W2_TOLERANCE)?);
    programs.extend(odeint(folder, "quantised", W2, odeint::W2_TOLERANCE)?);
    Ok(programs)
}

/// W3; see [`w1`]. `diffsol` delivers a row every millisecond.
///
/// # Errors
/// As [`w1`].
pub fn w3(folder: &Path) -> Result<Vec<Program>, Box<dyn Error>> {
    let mut programs = groups::w3()?;
    let case = workload::case("continuous", W3, "auto", W3_TOLERANCE)?;
    // A run that fails would be quick.
    diffsol_continuous::run(&case, W3_TOLERANCE, |_| ())?;
    programs.push(Program::new("diffsol", move || {
        diffsol_continuous::run(black_box(&case), W3_TOLERANCE, |y| {
            black_box(y);
        })
    }));
    programs.extend(odeint(folder, "continuous", W3, odeint::W3_TOLERANCE)?);
    Ok(programs)
}

fn diffsol(workload: &str, tolerance: f64) -> Result<Program, Box<dyn Error>> {
    let case = workload::case("quantised", workload, "auto", tolerance)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let axis = ElasticAxis::new(&case).ok_or("a rigid joint")?;
    // A run that fails would be quick.
    diffsol_axis::run(&plan, axis, tolerance, |_, _, _| ())?;
    Ok(Program::new("diffsol", move || {
        diffsol_axis::run(&plan, black_box(axis), tolerance, |_, _, _| ())
    }))
}

/// None, and a sentence, where it cannot be built.
fn odeint(
    folder: &Path,
    law: &str,
    workload: &str,
    tolerance: f64,
) -> Result<Option<Program>, Box<dyn Error>> {
    let case = workload::case(law, workload, "exact", W1_TOLERANCE)?;
    let odeint = match Odeint::new(folder, &case, tolerance) {
        Ok(odeint) => odeint,
        Err(error) => {
            eprintln!(
                "left out: Boost odeint, which wants g++ and Boost's headers (libboost-dev): {error}"
            );
            return Ok(None);
        }
    };
    let agreement = odeint.agreement(&case)?;
    eprintln!(
        "odeint, {law}: {} changes of contact as ours, the last state off by {:.1e} of its largest",
        agreement.changes, agreement.deviation
    );
    Ok(Some(Program {
        id: "odeint".into(),
        runs: Box::new(move |runs| or_exit(odeint.run(runs)).times.iter().sum()),
    }))
}
