//! W4: 10,000 runs of W1 with random b, K_p and K_d, in runs per second.
//! The draws are rows of `backlash_half_rad,kp,kd_s` in the file that the
//! environment variable `W4_CSV` names.
//!
//! Ids are `w4/<rung>/threads-<n>`. Until runs can be made in batches this
//! makes them one after the other on one thread, the first few only.

use std::error::Error;
use std::hint::black_box;

use bench_benches::groups::or_exit;
use bench_benches::workload::{self, W1, W1_TOLERANCE};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hil_runner::case::Case;
use hil_runner::run::{RunOptions, run};
use plant::Joint;

/// Draws of one iteration; all 10,000 once there is a batch interface.
const RUNS: usize = 16;

fn w4(criterion: &mut Criterion) {
    let Some(file) = std::env::var_os("W4_CSV") else {
        eprintln!("w4 is left out: W4_CSV names no file");
        return;
    };
    let cases = or_exit(cases(file.as_ref()));
    let mut group = criterion.benchmark_group("w4");
    group.sample_size(10);
    group.throughput(Throughput::Elements(RUNS as u64));
    group.bench_function("quantised/threads-1", |bencher| {
        bencher.iter(|| {
            for case in black_box(&cases) {
                let _ = black_box(run(case, RunOptions::default(), &mut |_| Ok(())));
            }
        });
    });
    group.finish();
}

/// The first draws as cases.
fn cases(file: &std::path::Path) -> Result<Vec<Case>, Box<dyn Error>> {
    let case = workload::case("quantised", W1, "auto", W1_TOLERANCE)?;
    let text = std::fs::read_to_string(file)?;
    let mut cases = Vec::new();
    for line in text.lines().skip(1).take(RUNS) {
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
