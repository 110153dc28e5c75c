//! The criterion groups `w1` to `w3` of the project's own solvers, and the
//! fixed-step Runge-Kutta beside them. One iteration is one whole run from
//! rest; the run file is read and the setpoints of the comparators are
//! computed before the clock starts.

use std::error::Error;
use std::hint::black_box;

use criterion::BenchmarkGroup;
use criterion::measurement::WallTime;
use hil_runner::run::{RunOptions, run};

use crate::elastic_axis::ElasticAxis;
use crate::lockstep::Plan;
use crate::rk4_axis::Rk4Axis;
use crate::workload::{self, W1, W2, W3};

/// Solvers of the plant, as run files name them.
const SOLVERS: [&str; 1] = ["dopri5"];

/// Step of the fixed-step comparators \[ns\].
pub const RK4_STEP_NS: u64 = 10_000;

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// `w1/<rung>/<solver>`, and `w1/quantised/rk4`.
///
/// # Errors
/// What the run file's checks say.
pub fn w1(group: &mut Group<'_>) -> Result<(), Box<dyn Error>> {
    for law in ["quantised", "firmware"] {
        own(group, law, W1, workload::W1_TOLERANCE)?;
    }
    rk4(group, W1)
}

/// `w2/<rung>/<solver>`, and `w2/quantised/rk4`.
///
/// # Errors
/// What the run file's checks say.
pub fn w2(group: &mut Group<'_>) -> Result<(), Box<dyn Error>> {
    own(group, "quantised", W2, workload::W2_TOLERANCE)?;
    rk4(group, W2)
}

/// `w3/continuous/<solver>`.
///
/// # Errors
/// What the run file's checks say.
pub fn w3(group: &mut Group<'_>) -> Result<(), Box<dyn Error>> {
    own(group, "continuous", W3, workload::W3_TOLERANCE)
}

/// Our own solvers, with all figures of the summary.
fn own(
    group: &mut Group<'_>,
    law: &str,
    workload: &str,
    tolerance: f64,
) -> Result<(), Box<dyn Error>> {
    for solver in SOLVERS {
        let case = workload::case(law, workload, solver, tolerance)?;
        group.bench_function(format!("{law}/{solver}"), |bencher| {
            bencher.iter(|| run(black_box(&case), RunOptions::default(), &mut |_| Ok(())));
        });
    }
    Ok(())
}

/// The paper's way, without figures.
fn rk4(group: &mut Group<'_>, workload: &str) -> Result<(), Box<dyn Error>> {
    let case = workload::case("quantised", workload, "rk4", workload::W1_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let axis = ElasticAxis::new(&case).ok_or("a rigid joint")?;
    group.bench_function("quantised/rk4", |bencher| {
        bencher.iter(|| {
            let mut axis = Rk4Axis::new(*black_box(&axis), RK4_STEP_NS);
            let result = plan.run(&mut axis, |_, _, _| ());
            (axis.y, result)
        });
    });
    Ok(())
}

/// Ends the program with a message: a benchmark without its case is none.
pub fn or_exit<T>(result: Result<T, Box<dyn Error>>) -> T {
    result.unwrap_or_else(|error| {
        eprintln!("{error}");
        std::process::exit(2)
    })
}
