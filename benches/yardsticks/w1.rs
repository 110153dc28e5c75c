//! W1 with the project's own solvers and other people's, all in one run.

use std::path::Path;

use bench_benches::groups::{self, or_exit};
use criterion::{Criterion, criterion_group, criterion_main};
use yardsticks::programs;

fn w1(criterion: &mut Criterion) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut group = criterion.benchmark_group("w1");
    group.sample_size(20);
    groups::bench(&mut group, or_exit(programs::w1(folder)));
    group.finish();
}

criterion_group!(benches, w1);
criterion_main!(benches);
