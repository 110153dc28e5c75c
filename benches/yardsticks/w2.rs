//! W2 with the project's own solvers, the paper's fixed-step Runge-Kutta and
//! `diffsol`, all in one run.

use std::error::Error;
use std::hint::black_box;

use bench_benches::elastic_axis::ElasticAxis;
use bench_benches::groups::{self, or_exit};
use bench_benches::lockstep::Plan;
use bench_benches::workload::{self, W2, W2_TOLERANCE};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use yardsticks::diffsol_axis;

fn w2(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w2");
    group.sample_size(20);
    or_exit(groups::w2(&mut group));
    or_exit(diffsol(&mut group));
    group.finish();
}

fn diffsol(group: &mut BenchmarkGroup<'_, WallTime>) -> Result<(), Box<dyn Error>> {
    let case = workload::case("quantised", W2, "auto", W2_TOLERANCE)?;
    let plan = Plan::new(&case).ok_or("no sample time")?;
    let axis = ElasticAxis::new(&case).ok_or("a rigid joint")?;
    // A run that fails would be quick.
    diffsol_axis::run(&plan, axis, W2_TOLERANCE, |_, _, _| ())?;
    group.bench_function("diffsol", |bencher| {
        bencher.iter(|| diffsol_axis::run(&plan, black_box(axis), W2_TOLERANCE, |_, _, _| ()));
    });
    Ok(())
}

criterion_group!(benches, w2);
criterion_main!(benches);
