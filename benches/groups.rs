//! The criterion groups `w1` to `w3` of the project's own solvers, and the
//! fixed-step Runge-Kutta beside them. One iteration is one whole run from
//! rest; the run file is read and the setpoints of the comparators are
//! computed before the clock starts.

use std::convert::Infallible;
use std::error::Error;
use std::hint::black_box;

use criterion::BenchmarkGroup;
use criterion::measurement::WallTime;
use hil_core::lanes::Runs;
use hil_core::run::{RunOptions, run};
use plant::{Joint, Plant, Solver};

use crate::elastic_axis::ElasticAxis;
use crate::lockstep::{Axis, ContinuousPlan, Plan};
use crate::rk4_axis::Rk4Axis;
use crate::workload::{self, W1, W2, W3};

/// Solvers of the plant, as run files name them.
const SOLVERS: [&str; 2] = ["exact", "dopri5"];

/// Step of the fixed-step comparators \[ns\].
pub const RK4_STEP_NS: u64 = 10_000;

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// `w1/<rung>/<solver>`, `w1/quantised/rk4`, and what of the exact solver's
/// time is not the plant's motion.
///
/// # Errors
/// Those of the run file's checks.
pub fn w1(group: &mut Group<'_>) -> Result<(), Box<dyn Error>> {
    for law in ["quantised", "firmware"] {
        own(group, law, W1, workload::W1_TOLERANCE)?;
    }
    bare(group, W1)?;
    law_alone(group, W1)?;
    gapless(group, W1)?;
    rk4(group, W1)
}

/// `w2/<rung>/<solver>`, `w2/quantised/exact-bare`, `…/law-alone` and `…/rk4`.
///
/// # Errors
/// Those of the run file's checks.
pub fn w2(group: &mut Group<'_>) -> Result<(), Box<dyn Error>> {
    own(group, "quantised", W2, workload::W2_TOLERANCE)?;
    bare(group, W2)?;
    law_alone(group, W2)?;
    rk4(group, W2)
}

/// `w3/continuous/<solver>` and `w3/continuous/exact-bare`.
///
/// # Errors
/// Those of the run file's checks.
pub fn w3(group: &mut Group<'_>) -> Result<(), Box<dyn Error>> {
    own(group, "continuous", W3, workload::W3_TOLERANCE)?;
    let case = workload::case("continuous", W3, "exact", workload::W3_TOLERANCE)?;
    let plan = ContinuousPlan::new(&case);
    // As a study has it: the matrices are made before.
    let mut plant = Plant::new(&case.axis, Solver::Exact);
    group.bench_function("continuous/exact-bare", |bencher| {
        bencher.iter(|| {
            plant.reset();
            let result = plan.run(black_box(&mut plant));
            (plant.state(), result)
        });
    });
    Ok(())
}

/// Our own solvers, with all figures of the summary. The exact one's sampled
/// runs are prepared as a study's are: the matrices are made before.
fn own(
    group: &mut Group<'_>,
    law: &str,
    workload: &str,
    tolerance: f64,
) -> Result<(), Box<dyn Error>> {
    for solver in SOLVERS {
        let case = workload::case(law, workload, solver, tolerance)?;
        let id = format!("{law}/{solver}");
        if solver == "exact" && law != "continuous" {
            let mut runs = Runs::new();
            // A run that fails would be quick.
            runs.single(&case)?;
            group.bench_function(id, |bencher| bencher.iter(|| runs.single(black_box(&case))));
            continue;
        }
        group.bench_function(id, |bencher| {
            bencher.iter(|| run(black_box(&case), RunOptions::default(), &mut |_| Ok(())));
        });
    }
    Ok(())
}

/// The exact solver without figures, as the comparators are.
fn bare(group: &mut Group<'_>, workload: &str) -> Result<(), Box<dyn Error>> {
    let case = workload::case("quantised", workload, "exact", workload::W1_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let mut plant = Plant::new(&case.axis, Solver::Exact);
    group.bench_function("quantised/exact-bare", |bencher| {
        bencher.iter(|| {
            plant.reset();
            let result = plan.run(black_box(&mut plant), |_, _, _| ());
            (plant.state(), result)
        });
    });
    Ok(())
}

/// The law as written with the shortest of all plants, β = β₀ + Γ·V: each sample
/// needs the one before it.
fn law_alone(group: &mut Group<'_>, workload: &str) -> Result<(), Box<dyn Error>> {
    struct Shortest(f64);
    impl Axis for Shortest {
        type Error = Infallible;
        fn beta_rad(&self) -> f64 {
            self.0
        }
        fn hold(&mut self, voltage_v: f64, _: u64) -> Result<(), Infallible> {
            self.0 = 0.5 + 1e-3 * voltage_v;
            Ok(())
        }
    }
    let case = workload::case("quantised", workload, "exact", workload::W1_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    group.bench_function("quantised/law-alone", |bencher| {
        bencher.iter(|| {
            let mut axis = Shortest(black_box(0.0));
            let result = plan.run(&mut axis, |_, _, _| ());
            (axis.0, result)
        });
    });
    Ok(())
}

/// The same axis without a gap, figures and all: nothing to detect. What the
/// contacts cost is the difference to `exact`.
fn gapless(group: &mut Group<'_>, workload: &str) -> Result<(), Box<dyn Error>> {
    let mut case = workload::case("quantised", workload, "exact", workload::W1_TOLERANCE)?;
    if let Joint::Elastic(joint) = &mut case.axis.transmission.joint {
        joint.backlash_half_rad = 0.0;
    }
    let mut runs = Runs::new();
    let contacts = runs.single(&case)?.contact_changes;
    if contacts > 0 {
        return Err(format!("{contacts} changes of contact without a gap").into());
    }
    group.bench_function("quantised/exact-gapless", |bencher| {
        bencher.iter(|| runs.single(black_box(&case)));
    });
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
