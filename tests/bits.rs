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
//! copied here after an intended change, and only then.

use bench_tests::digest::Digest;
use bench_tests::solvers::run_exactly;
use bench_tests::{case, rows};
use hil_core::case::{Case, Law};
use hil_runner::host::LinkKind;

/// Keeps the exact solver away from a variant.
const DOPRI5: &str = "run.solver=dopri5";

/// A change of a built-in case: its name here, the case, its overrides.
const VARIANTS: [(&str, &str, &[&str]); 12] = [
    ("1", "paper-1", &[]),
    ("2", "paper-2", &[]),
    ("3", "paper-3", &[]),
    ("4", "paper-4", &[]),
    (
        "delay",
        "paper-4",
        &["controller.computation_delay_s=0.0003"],
    ),
    ("no pull", "paper-1", &["transmission.no_pull=true"]),
    (
        "friction",
        "paper-3",
        &[
            "carriage.resistance_constant_n=60 carriage.resistance_linear_ns_per_rad=0.5 \
             carriage.resistance_opposes_motion=true",
        ],
    ),
    ("rigid", "paper-2", &["transmission.joint=rigid"]),
    ("no gap", "paper-2", &["transmission.backlash_half_deg=0"]),
    ("limited", "paper-2", &["drive.voltage_limit_v=40"]),
    ("dopri5", "paper-2", &[DOPRI5]),
    (
        "dopri5, no affine plant",
        "paper-3",
        &[
            DOPRI5,
            "carriage.resistance_quadratic_ns2_per_rad2=0.001 \
             carriage.resistance_opposes_motion=true",
        ],
    ),
];

/// Digests by variant and, from the left, by rung.
const PINNED: &str = "
1: 33e7969dd2ce7b20 e6d58788a61a64c9 688b79f693b954b2 74cda2db6e18387a
2: e1983715d6f1db03 96b8869cd6fae09b 815d6d4ce7a30b97 8b5fded75e17b37f
3: 23cd1f3b0b5b8970 c217b9c0ee2c6cbb a05595d6693a1b6a a05595d6693a1b6a
4: 794003faa6553f8d 8198e7cfdf6706c7 719971fb90019111 2706b1c63bb3a10a
delay: 794003faa6553f8d be6084c69f2a0aa3 df0cf2be968f63cc 5d7db051272e3e55
no pull: 5939a413d48630a1 d8cade8b8decbfe8 29a0cb647acc3c6f dad1dcd5e07478df
friction: 45430d71a1823bc5 2ca270bbed88c0f5 ff7233a48fb66b8e 50df98ada38958e7
rigid: a0ca36130ba686bb d780d15156fe8416 dd6cd496ba2902af dc7d12f25fe92187
no gap: 36e04f5eeed262a9 be17852fbcecd127 da9b557035980ee0 da9b557035980ee0
limited: 5048e183f34b5de5 01e83cec5b9816e5 9ec5c4d4011f0f62 9ec5c4d4011f0f62
dopri5: 3b5a73a53af003ad b9df5747b4425c24 896940db75c08c84 7ce7904470c19db4
dopri5, no affine plant: 70db41a69bff5c4b 0622139ba9102ea0 b8f3286e4834c619 3da0830be3994023
";

fn digests(name: &str, sets: &[&str]) -> [u64; 4] {
    Law::ALL.map(|law| {
        let rung = format!("controller.law={}", law.name());
        let mut case = case(name, &[sets, &[rung.as_str()]].concat());
        if !sets.contains(&DOPRI5) {
            case = run_exactly(&case);
        }
        let (rows, outcome) = rows(&case, LinkKind::InProcess);
        Digest::of_run(&rows, &outcome)
    })
}

#[test]
fn bits_are_the_pinned_ones() {
    let found = VARIANTS.map(|(variant, name, sets)| {
        let digests = digests(name, sets).map(|digest| format!("{digest:016x}"));
        format!("{variant}: {}", digests.join(" "))
    });
    if std::env::var_os("BLESS").is_some() {
        println!("{}", found.join("\n"));
        return;
    }
    let pinned: Vec<&str> = PINNED.trim().lines().collect();
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
