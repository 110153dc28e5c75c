//! W5 (see `workload.rs`): axes of one's own, 1,000 ball screws on rails with friction, their
//! gap and gains drawn, with all figures, in runs per second.
//!
//! Ids are `w5/<rung>/threads-<n>`.

use bench_benches::many;
use bench_benches::workload;
use criterion::{Criterion, criterion_group, criterion_main};

fn w5(criterion: &mut Criterion) {
    many::bench(criterion, "w5", workload::w5);
}

criterion_group!(benches, w5);
criterion_main!(benches);
