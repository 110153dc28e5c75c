//! W3 with the project's own solvers and `diffsol`, all in one run. Both
//! deliver a row every millisecond.

use std::error::Error;
use std::hint::black_box;

use bench_benches::groups::{self, or_exit};
use bench_benches::workload::{self, W3, W3_TOLERANCE};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use yardsticks::diffsol_continuous;

fn w3(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w3");
    group.sample_size(20);
    or_exit(groups::w3(&mut group));
    or_exit(diffsol(&mut group));
    group.finish();
}

fn diffsol(group: &mut BenchmarkGroup<'_, WallTime>) -> Result<(), Box<dyn Error>> {
    let case = workload::case("continuous", W3, "auto", W3_TOLERANCE)?;
    // A run that fails would be quick.
    diffsol_continuous::run(&case, W3_TOLERANCE, |_| ())?;
    group.bench_function("diffsol", |bencher| {
        bencher.iter(|| {
            diffsol_continuous::run(black_box(&case), W3_TOLERANCE, |y| {
                black_box(y);
            })
        });
    });
    Ok(())
}

criterion_group!(benches, w3);
criterion_main!(benches);
