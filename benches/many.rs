//! Many runs of one axis on threads: one iteration is all of them.

use std::error::Error;
use std::hint::black_box;
use std::num::NonZeroUsize;

use criterion::{Criterion, Throughput};
use hil_core::case::Case;
use hil_runner::host;

use crate::groups::{or_exit, vectors};

/// Numbers of threads to be measured.
const THREADS: [usize; 2] = [1, 2];

/// Measures the runs of a workload on both rungs with codes.
pub fn bench(
    criterion: &mut Criterion,
    name: &str,
    workload: impl Fn(&str) -> Result<Vec<Case>, Box<dyn Error>>,
) {
    println!("vectors: {}", or_exit(vectors()));
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    for law in ["quantised", "firmware"] {
        let cases = or_exit(workload(law));
        group.throughput(Throughput::Elements(cases.len() as u64));
        for threads in THREADS.into_iter().filter_map(NonZeroUsize::new) {
            // A run that fails would be quick.
            let failed = or_exit(host::figures(&cases, threads).map_err(Into::into))
                .into_iter()
                .find_map(Result::err);
            or_exit(failed.map_or(Ok(()), |error| Err(error.into())));
            group.bench_function(format!("{law}/threads-{threads}"), |bencher| {
                bencher.iter(|| host::figures(black_box(&cases), threads));
            });
        }
    }
    group.finish();
}
