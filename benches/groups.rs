//! The programs of the workloads W1 to W3 that are the project's own, and the
//! fixed-step Runge-Kutta and the reference loop beside them. One run is one
//! move from rest; the run file is read and the setpoints of the comparators are
//! computed before the clock starts.

use std::error::Error;
use std::fmt;
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::BenchmarkGroup;
use criterion::measurement::WallTime;
use hil_core::lanes::{Runs, Vectors};
use hil_core::run::{RunOptions, run};
use plant::{Plant, Solver, widest, with_four};

use crate::elastic_axis::ElasticAxis;
use crate::lockstep::{ContinuousPlan, Plan};
use crate::reference_loop;
use crate::rk4_axis::Rk4Axis;
use crate::workload::{self, W1, W2, W3};

/// Solvers of the plant, as run files name them.
const SOLVERS: [&str; 2] = ["exact", "dopri5"];

/// Step of the fixed-step comparators \[ns\].
pub const RK4_STEP_NS: u64 = 10_000;

/// Something to be timed, ready to run.
pub struct Program {
    /// Its name within the workload, `<rung>/<solver>` for our own.
    pub id: String,
    /// Runs it so many times and returns the time of all.
    pub runs: Box<dyn FnMut(u64) -> Duration>,
}

impl Program {
    /// The program whose one run is `once`.
    pub fn new<T>(id: impl Into<String>, mut once: impl FnMut() -> T + 'static) -> Self {
        let runs = move |runs| {
            let start = Instant::now();
            for _ in 0..runs {
                black_box(once());
            }
            start.elapsed()
        };
        Self {
            id: id.into(),
            runs: Box::new(runs),
        }
    }
}

impl fmt::Debug for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Program")
            .field("id", &self.id)
            .finish_non_exhaustive()
    }
}

/// Measures programs with criterion.
pub fn bench(group: &mut BenchmarkGroup<'_, WallTime>, programs: Vec<Program>) {
    println!("vectors: {}", or_exit(vectors()));
    for Program { id, mut runs } in programs {
        group.bench_function(id, |bencher| bencher.iter_custom(&mut runs));
    }
}

/// `w1/<rung>/<solver>`, `w1/quantised/rk4`, what a run without contacts takes, with
/// figures and without, and one of a current drive.
///
/// # Errors
/// Those of the run file's checks; a comparator that does not agree.
pub fn w1() -> Result<Vec<Program>, Box<dyn Error>> {
    let mut programs = own("quantised", W1, workload::W1_TOLERANCE)?;
    programs.extend(own("firmware", W1, workload::W1_TOLERANCE)?);
    programs.push(bare(W1)?);
    programs.push(reference(W1)?);
    programs.push(gapless(W1)?);
    programs.push(limited(W1)?);
    programs.push(rk4(W1)?);
    Ok(programs)
}

/// `w2/quantised/<solver>`, `w2/quantised/exact-bare`, `…/reference-loop` and `…/rk4`.
///
/// # Errors
/// Those of the run file's checks; a comparator that does not agree.
pub fn w2() -> Result<Vec<Program>, Box<dyn Error>> {
    let mut programs = own("quantised", W2, workload::W2_TOLERANCE)?;
    programs.push(bare(W2)?);
    programs.push(reference(W2)?);
    programs.push(rk4(W2)?);
    Ok(programs)
}

/// `w3/continuous/<solver>` and `w3/continuous/exact-bare`.
///
/// # Errors
/// Those of the run file's checks.
pub fn w3() -> Result<Vec<Program>, Box<dyn Error>> {
    let mut programs = own("continuous", W3, workload::W3_TOLERANCE)?;
    let case = workload::case("continuous", W3, "exact", workload::W3_TOLERANCE)?;
    let plan = ContinuousPlan::new(&case);
    // As a study has it: the matrices are made before.
    let mut plant = Plant::new(&case.axis, Solver::Exact);
    programs.push(Program::new("continuous/exact-bare", move || {
        plant.reset();
        let result = plan.run(black_box(&mut plant));
        (plant.state(), result)
    }));
    Ok(programs)
}

/// Our own solvers, with all figures of the summary. The exact one's sampled
/// runs are prepared as a study's are: the matrices are made before.
fn own(law: &str, workload: &str, tolerance: f64) -> Result<Vec<Program>, Box<dyn Error>> {
    vectors()?;
    let mut programs = Vec::new();
    for solver in SOLVERS {
        let case = workload::case(law, workload, solver, tolerance)?;
        let id = format!("{law}/{solver}");
        programs.push(if solver == "exact" && law != "continuous" {
            let mut runs = Runs::new();
            // A run that fails would be quick.
            runs.single(&case)?;
            Program::new(id, move || runs.single(black_box(&case)))
        } else {
            Program::new(id, move || {
                run(black_box(&case), RunOptions::default(), &mut |_| Ok(()))
            })
        });
    }
    Ok(programs)
}

/// The exact solver without figures, as the comparators are.
fn bare(workload: &str) -> Result<Program, Box<dyn Error>> {
    let case = workload::case("quantised", workload, "exact", workload::W1_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let (mut plant, level) = (Plant::new(&case.axis, Solver::Exact), widest());
    Ok(Program::new("quantised/exact-bare", move || {
        plant.reset();
        // As a single run of the project.
        let result = with_four(
            level,
            #[inline(always)]
            || plan.run(black_box(&mut plant), |_, _, _| ()),
        );
        (plant.state(), result)
    }))
}

/// The law and the exact map of a sample alone: see [`crate::reference_loop`].
fn reference(workload: &str) -> Result<Program, Box<dyn Error>> {
    let case = workload::case("quantised", workload, "exact", workload::W1_TOLERANCE)?;
    let reference = reference_loop::checked(&case)?;
    Ok(Program::new("quantised/reference-loop", move || {
        black_box(&reference).run(|_| ())
    }))
}

/// The same axis without a gap, figures and all: nothing to detect. What the
/// contacts cost is the difference to `exact`.
fn gapless(workload: &str) -> Result<Program, Box<dyn Error>> {
    let case = workload::case("quantised", workload, "exact", workload::W1_TOLERANCE)?;
    let case = reference_loop::gapless(&case);
    let mut runs = Runs::new();
    let contacts = runs.single(&case)?.contact_changes;
    if contacts > 0 {
        return Err(format!("{contacts} changes of contact without a gap").into());
    }
    Ok(Program::new("quantised/exact-gapless", move || {
        runs.single(black_box(&case))
    }))
}

/// The axis with a current drive, figures and all, as a study makes it: a run that does not
/// go side by side with others.
fn limited(workload: &str) -> Result<Program, Box<dyn Error>> {
    let sets = [
        "controller.law=firmware",
        "drive.kind=current",
        "drive.amplifier_gain_a_per_v=2",
        "drive.current_limit_a=20",
        workload,
    ];
    let case = workload::paper_2(&sets)?;
    let mut runs = Runs::new();
    runs.single(&case)?;
    if runs.take_one_by_one().is_empty() {
        return Err("a run of a current drive went side by side".into());
    }
    Ok(Program::new("firmware/exact-current-drive", move || {
        runs.single(black_box(&case))
    }))
}

/// The paper's way, without figures.
fn rk4(workload: &str) -> Result<Program, Box<dyn Error>> {
    let case = workload::case("quantised", workload, "rk4", workload::W1_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let axis = ElasticAxis::new(&case).ok_or("a rigid joint")?;
    Ok(Program::new("quantised/rk4", move || {
        let mut axis = Rk4Axis::new(*black_box(&axis), RK4_STEP_NS);
        let result = plan.run(&mut axis, |_, _, _| ());
        (axis.y, result)
    }))
}

/// The vectors that the project's own programs use, no wider than the environment's
/// `VECTORS` says: criterion and libtest take no options of others.
///
/// # Errors
/// One sentence if that is no set of instructions.
pub fn vectors() -> Result<&'static str, Box<dyn Error>> {
    if let Some(name) = std::env::var_os("VECTORS") {
        let name = name.to_string_lossy();
        name.parse::<Vectors>()
            .map_err(|error| format!("VECTORS = {error}"))?
            .limit();
    }
    Ok(Vectors::in_use())
}

/// Ends the program with a message: a benchmark without its case is none.
pub fn or_exit<T>(result: Result<T, Box<dyn Error>>) -> T {
    result.unwrap_or_else(|error| {
        eprintln!("{error}");
        std::process::exit(2)
    })
}
