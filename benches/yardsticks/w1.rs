//! W1 with the project's own solvers, the paper's fixed-step Runge-Kutta and
//! `diffsol`, all in one run.

use std::error::Error;
use std::hint::black_box;

use bench_benches::elastic_axis::ElasticAxis;
use bench_benches::groups::{self, or_exit};
use bench_benches::lockstep::Plan;
use bench_benches::workload::{self, W1, W1_TOLERANCE};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use yardsticks::diffsol_axis;

fn w1(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w1");
    group.sample_size(20);
    or_exit(groups::w1(&mut group));
    or_exit(diffsol(&mut group));
    group.finish();
}

fn diffsol(group: &mut BenchmarkGroup<'_, WallTime>) -> Result<(), Box<dyn Error>> {
    let case = workload::case("quantised", W1, "auto", W1_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let axis = ElasticAxis::new(&case).ok_or("a rigid joint")?;
    // A run that fails would be quick.
    diffsol_axis::run(&plan, axis, W1_TOLERANCE, |_, _, _| ())?;
    group.bench_function("diffsol", |bencher| {
        bencher.iter(|| diffsol_axis::run(&plan, black_box(axis), W1_TOLERANCE, |_, _, _| ()));
    });
    Ok(())
}

criterion_group!(benches, w1);
criterion_main!(benches);
