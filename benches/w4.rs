//! W4 (see `workload.rs`): 10,000 runs of W1 with random b, K_p and K_d, with
//! all figures, in runs per second.
//!
//! Ids are `w4/<rung>/threads-<n>`.

use bench_benches::many;
use bench_benches::workload;
use criterion::{Criterion, criterion_group, criterion_main};

fn w4(criterion: &mut Criterion) {
    many::bench(criterion, "w4", workload::w4);
}

criterion_group!(benches, w4);
criterion_main!(benches);
