//! W1 (see `workload.rs`) with the project's own solvers. With `diffsol` in
//! the same run: `cargo bench --bench w1` in `benches/yardsticks`.

use bench_benches::groups::{self, or_exit};
use criterion::{Criterion, criterion_group, criterion_main};

fn w1(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w1");
    group.sample_size(20);
    or_exit(groups::w1(&mut group));
    group.finish();
}

criterion_group!(benches, w1);
criterion_main!(benches);
