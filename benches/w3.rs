//! W3 (see `workload.rs`) with the project's own solvers. With other people's
//! in the same run: `cargo bench --bench w3` in `benches/yardsticks`.

use bench_benches::groups::{self, or_exit};
use criterion::{Criterion, criterion_group, criterion_main};

fn w3(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w3");
    group.sample_size(20);
    groups::bench(&mut group, or_exit(groups::w3()));
    group.finish();
}

criterion_group!(benches, w3);
criterion_main!(benches);
