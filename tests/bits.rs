//! The bits of whole runs: the same on every machine, at every level of
//! optimisation and with every set of instructions.
//!
//! ```text
//! cargo test -p bench-tests --test bits                      as tests are built
//! cargo test -p bench-tests --test bits --profile bits       not optimised
//! cargo test -p bench-tests --test bits --release            as it is shipped
//! ```
//!
//! `BLESS=1` prints the table of a build instead of comparing it: to be
//! copied to `bits/pinned.txt` after an intended change, and only then.

use bench_tests::digest::Digest;
use bench_tests::solvers::run_exactly;
use bench_tests::{case, rows};
use hil_core::case::{Case, Law};
use hil_runner::host::LinkKind;

/// Keeps the exact solver away from a variant.
const DOPRI5: &str = "run.solver=dopri5";

/// Changes of built-in cases, one a line: its name, the case and its overrides.
const VARIANTS: &str = include_str!("bits/variants.txt");

/// Digests by variant and, from the left, by rung.
const PINNED: &str = include_str!("bits/pinned.txt");

fn digests(name: &str, sets: &str) -> [u64; 4] {
    Law::ALL.map(|law| {
        let rung = format!("controller.law={}", law.name());
        let mut case = case(name, &[sets, &rung]);
        if !sets.contains(DOPRI5) {
            case = run_exactly(&case);
        }
        let (rows, outcome) = rows(&case, LinkKind::InProcess);
        Digest::of_run(&rows, &outcome)
    })
}

#[test]
fn bits_are_the_pinned_ones() {
    let found = VARIANTS.lines().map(|line| {
        let (variant, changed) = line.split_once(": ").unwrap();
        let (name, sets) = changed.split_once(' ').unwrap_or((changed, ""));
        let digests = digests(name, sets).map(|digest| format!("{digest:016x}"));
        format!("{variant}: {}", digests.join(" "))
    });
    let found: Vec<String> = found.collect();
    if std::env::var_os("BLESS").is_some() {
        println!("{}", found.join("\n"));
        return;
    }
    let pinned: Vec<&str> = PINNED.lines().collect();
    assert_eq!(found.len(), pinned.len());
    for (found, pinned) in found.iter().zip(pinned) {
        assert_eq!(found, pinned);
    }
}

/// The contrast: the last bit of one parameter changes the digest.
#[test]
fn the_last_bit_of_a_parameter_shows() {
    let mut case = run_exactly(&case("paper-2", &[]));
    let digest = |case: &Case| {
        let (rows, outcome) = rows(case, LinkKind::InProcess);
        Digest::of_run(&rows, &outcome)
    };
    let before = digest(&case);
    assert_eq!(before, digest(&case));
    let resistance_ohm = &mut case.axis.motor.resistance_ohm;
    *resistance_ohm = resistance_ohm.next_up();
    assert_ne!(before, digest(&case));
}
