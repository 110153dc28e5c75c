//! W1: simulation 2 of the paper at Δt = 1 ms over 1.5 s, about ten contact
//! changes. Ids are `w1/<rung>/<solver>`; one iteration is one whole run,
//! without a trace, summary figures included.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use hil_runner::run::{RunOptions, run};
use hil_runner::runfile;

fn w1(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("w1");
    group.sample_size(20);
    for (law, solver) in [
        ("quantised", "dopri5"),
        ("firmware", "dopri5"),
        ("quantised", "rk4"),
    ] {
        let sets = [
            format!("controller.law={law}"),
            format!("run.solver={solver}"),
            // The tolerance at which the other programs were measured.
            "run.tolerance=1e-10".to_owned(),
        ];
        let case = runfile::load("paper-2", &sets).unwrap_or_else(|errors| {
            eprintln!("{errors}");
            std::process::exit(2)
        });
        group.bench_function(format!("{law}/{solver}"), |bencher| {
            bencher.iter(|| run(black_box(&case), RunOptions::default(), &mut |_| Ok(())));
        });
    }
    group.finish();
}

criterion_group!(benches, w1);
criterion_main!(benches);
