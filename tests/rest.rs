//! Explore.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
use bench_tests::case;
use hil_runner::case::Case;
use hil_runner::lanes::SingleRuns;
use hil_runner::rest::feeding::{baseline, counterfactuals, fed_by};
use hil_runner::run::{RunOptions, run};

fn show(name: &str, case: &Case) {
    let s = run(case, RunOptions::default(), &mut |_| Ok(()))
        .unwrap()
        .summary;
    println!(
        "{name}: {} ripple {:?} cycle {:?} period {:?} codes {:?} counts {:?} dac {:?} enc {:?} final {:.2} contacts {}",
        s.law,
        s.rest_ripple_um,
        s.limit_cycle_um,
        s.limit_cycle_period_s,
        s.rest_dac_codes,
        s.rest_encoder_counts,
        s.dac_bits_used,
        s.encoder_bits_used,
        s.final_error_um,
        s.contact_changes
    );
}
fn feed(name: &str, case: &Case) {
    let mut runs = SingleRuns::new();
    let b = baseline(case);
    show(name, &b);
    let amp = runs.figures(&b).unwrap().rest_ripple_um.unwrap();
    let mut results = vec![];
    for c in counterfactuals(case) {
        show(c.without.name(), &c.case);
        results.push((
            c.without,
            runs.figures(&c.case).ok().and_then(|s| s.rest_ripple_um),
        ));
    }
    println!("==> {name}: fed by {}", fed_by(amp, &results));
}

#[test]
fn explore() {
    let file = format!("{}/cases/limit-cycle.toml", env!("CARGO_MANIFEST_DIR"));
    for q in ["nearest", "error-feedback", "dither"] {
        show(q, &case(&file, &[&format!("controller.quantiser={q}")]));
    }
    feed("limit-cycle", &case(&file, &[]));
    for p in ["paper-1", "paper-2", "paper-3", "paper-4"] {
        for law in ["continuous", "sampled", "quantised", "firmware"] {
            show(
                p,
                &case(p, &[&format!("controller.law={law}"), "run.duration_s=8"]),
            );
        }
        feed(p, &case(p, &["run.duration_s=8"]));
    }
    let extra: Vec<Vec<String>> = std::env::var("SETS")
        .unwrap_or_default()
        .split(';')
        .filter(|s| !s.is_empty())
        .map(|s| s.split(',').map(str::to_owned).collect())
        .collect();
    for sets in extra {
        let refs: Vec<&str> = sets[1..].iter().map(String::as_str).collect();
        let name = if sets[0] == "lc" {
            file.clone()
        } else {
            sets[0].clone()
        };
        feed(&format!("{sets:?}"), &case(&name, &refs));
    }
}
#[test]
fn dump() {
    let Ok(sets) = std::env::var("DUMP") else {
        return;
    };
    let sets: Vec<&str> = sets.split(',').collect();
    let file = format!("{}/cases/limit-cycle.toml", env!("CARGO_MANIFEST_DIR"));
    let c = case(if sets[0] == "lc" { &file } else { sets[0] }, &sets[1..]);
    let p = c.axis.transmission.screw_pitch_m_per_rad;
    let mut out = String::new();
    run(&c, RunOptions::default(), &mut |r| {
        out += &format!(
            "{} {} {} {:?}\n",
            r.t_s,
            1e6 * (p * r.gamma_rad - c.motion.travel_m()),
            1e6 * (p * r.beta_rad - c.motion.travel_m()),
            r.sample.map(|s| (s.error_counts, s.dac_code))
        );
        Ok(())
    })
    .unwrap();
    std::fs::write("/tmp/h2-dump.txt", out).unwrap();
}
