//! W2 (see `workload.rs`) with the project's own solvers. With other people's
//! in the same run: `cargo bench --bench w2` in `benches/yardsticks`.

use bench_benches::groups::{self, or_exit};
use criterion::{Criterion, criterion_group, criterion_main};

fn w2(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w2");
    group.sample_size(20);
    groups::bench(&mut group, or_exit(groups::w2()));
    group.finish();
}

criterion_group!(benches, w2);
criterion_main!(benches);
