//! The yardsticks compute the same run as `hil-runner`, and `diffsol`'s
//! presence changes no bit of ours.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use hil_runner::files;
use std::path::Path;

use bench_benches::elastic_axis::ElasticAxis;
use bench_benches::groups::RK4_STEP_NS;
use bench_benches::lockstep::Plan;
use bench_benches::rk4_axis::Rk4Axis;
use bench_benches::workload::{self, W1, W2, W3};
use hil_core::case::Case;
use hil_core::run::{Outcome, RunOptions, run};
use hil_core::runfile::builtin_names;
use plant::{Plant, Solver};
use yardsticks::contact::Change;
use yardsticks::odeint::{self, Odeint};
use yardsticks::{diffsol_axis, diffsol_continuous};

/// Codes and outcome of the project's own run.
fn own(case: &Case) -> (Vec<f64>, Outcome) {
    let mut codes = Vec::new();
    let outcome = run(case, RunOptions::default(), &mut |row| {
        codes.extend(row.sample.map(|sample| sample.dac_code));
        Ok(())
    });
    (codes, outcome.unwrap())
}

/// Same changes in the same order, at most 10 µs apart: exits are shallow.
fn assert_same_events(changes: &[Change], outcome: &Outcome) {
    let own = &outcome.contact_changes;
    assert_eq!(changes.len(), own.len());
    for (change, own) in changes.iter().zip(own) {
        let signs = (own.from.sign().into(), own.to.sign().into());
        assert_eq!((change.from, change.to), signs);
        let apart_s = (change.time_s - own.time_s).abs();
        assert!(apart_s < 1e-5, "{change:?}: {apart_s} s apart");
    }
}

#[test]
fn diffsol_gives_the_codes_and_events_of_w1_and_w2() {
    for (workload, tolerance) in [(W1, 1e-10), (W2, 1e-8)] {
        let case = workload::case("quantised", workload, "dopri5", 1e-11).unwrap();
        let (plan, axis) = (Plan::new(&case).unwrap(), ElasticAxis::new(&case).unwrap());
        let mut codes = Vec::new();
        let (_, changes) =
            diffsol_axis::run(&plan, axis, tolerance, |_, code, _| codes.push(code)).unwrap();
        let (own_codes, outcome) = own(&case);
        let differ = codes.iter().zip(&own_codes).filter(|(a, b)| a != b).count();
        assert_eq!(codes.len(), own_codes.len());
        assert_eq!(differ, 0, "{workload}: codes differ");
        assert_same_events(&changes, &outcome);
    }
}

#[test]
fn diffsol_gives_the_events_of_w3() {
    let case = workload::case("continuous", W3, "dopri5", 1e-11).unwrap();
    let mut rows = 0;
    let changes = diffsol_continuous::run(&case, 1e-8, |_| rows += 1).unwrap();
    assert_eq!(rows, 1501);
    assert_same_events(&changes, &own(&case).1);
}

/// Its own bound, and the contrast: a tolerance of 1e-4 does not pass.
#[test]
fn odeint_ends_where_the_exact_solver_does() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (law, workload, tolerance) in [
        ("quantised", W1, odeint::W1_TOLERANCE),
        ("quantised", W2, odeint::W2_TOLERANCE),
        ("continuous", W3, odeint::W3_TOLERANCE),
    ] {
        let case = workload::case(law, workload, "exact", 1e-10).unwrap();
        let odeint = match Odeint::new(folder, &case, tolerance) {
            Ok(odeint) => odeint,
            Err(error) => return eprintln!("left out: Boost odeint: {error}"),
        };
        let agreement = odeint.agreement(&case).unwrap();
        eprintln!("{workload}: {agreement:?}");
        let loose = Odeint::new(folder, &case, 1e-4).unwrap();
        assert!(loose.agreement(&case).is_err(), "{workload}");
    }
}

/// Another order of the sums, so not the same bits, but the same method.
#[test]
fn the_plain_rk4_is_that_of_the_plant() {
    let case = workload::case("sampled", W1, "rk4", 1e-10).unwrap();
    let plan = Plan::new(&case).unwrap();
    let mut plain = Rk4Axis::new(ElasticAxis::new(&case).unwrap(), RK4_STEP_NS);
    plan.run(&mut plain, |_, _, _| ()).unwrap();
    let solver = Solver::Rk4 {
        step_ns: RK4_STEP_NS,
    };
    let mut plant = Plant::new(&case.axis, solver);
    plan.run(&mut plant, |_, _, _| ()).unwrap();
    let state = plant.state();
    let far = (plain.y[0] - state.gamma_rad())
        .abs()
        .max((plain.y[2] - state.epsilon_rad).abs());
    assert!(far < 1e-9, "{far} rad apart");
}

/// `diffsol` switches features of `nalgebra` on (`std`, `matrixmultiply`);
/// the summaries stay those of the main workspace, to the last digit.
#[test]
fn golden_summaries_hold_beside_diffsol() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
    for name in builtin_names() {
        let case = files::case(name, &[]).unwrap();
        let summary = serde_json::to_string_pretty(&own(&case).1.summary).unwrap() + "\n";
        let file = golden.join(format!("{name}.json"));
        assert_eq!(summary, std::fs::read_to_string(file).unwrap(), "{name}");
    }
}
