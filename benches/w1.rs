//! W1 (see `workload.rs`) with the project's own solvers. With other people's
//! in the same run: `cargo bench --bench w1` in `benches/yardsticks`.

use bench_benches::groups::{self, or_exit};
use criterion::{Criterion, criterion_group, criterion_main};

fn w1(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w1");
    group.sample_size(20);
    groups::bench(&mut group, or_exit(groups::w1()));
    group.finish();
}

criterion_group!(benches, w1);
criterion_main!(benches);
