//! W4 (see `workload.rs`): 10,000 runs of W1 with random b, K_p and K_d, with
//! all figures, in runs per second. One iteration is all of them. The draws
//! are the rows of `w4.csv`.
//!
//! Ids are `w4/<rung>/threads-<n>`.

use std::error::Error;
use std::hint::black_box;
use std::num::NonZeroUsize;
use std::path::Path;

use bench_benches::groups::or_exit;
use bench_benches::workload::{self, W1, W1_TOLERANCE};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hil_core::case::Case;
use hil_runner::host;
use plant::Joint;

/// Numbers of threads to be measured.
const THREADS: [usize; 2] = [1, 2];

fn w4(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w4");
    group.sample_size(10);
    for law in ["quantised", "firmware"] {
        let cases = or_exit(cases(law));
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

/// The draws as cases.
fn cases(law: &str) -> Result<Vec<Case>, Box<dyn Error>> {
    let case = workload::case(law, W1, "exact", W1_TOLERANCE)?;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("w4.csv");
    let text = std::fs::read_to_string(file)?;
    let mut cases = Vec::new();
    for line in text.lines().skip(1) {
        let mut numbers = line.split(',').map(str::parse::<f64>);
        let mut next = || numbers.next().ok_or("a row is too short");
        let mut case = case.clone();
        let Joint::Elastic(joint) = &mut case.axis.transmission.joint else {
            return Err("a rigid joint".into());
        };
        joint.backlash_half_rad = next()??;
        case.controller.gains.kp = next()??;
        case.controller.gains.kd_s = next()??;
        case.run.events = false;
        cases.push(case);
    }
    Ok(cases)
}

criterion_group!(benches, w4);
criterion_main!(benches);
