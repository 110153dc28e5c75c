//! A mirrored move is the mirror image on `continuous` and `sampled`; the
//! encoder's floor breaks that from `quantised` on.

use bench_tests::{case, rows};
use hil_core::trace::Row;
use hil_runner::host::LinkKind;

fn move_of(name: &str, law: &str, travel_mm: f64, more: &[&str]) -> Vec<Row> {
    let law = format!("controller.law={law}");
    let travel = format!("motion.travel_mm={travel_mm}");
    let sets: Vec<&str> = [law.as_str(), travel.as_str()]
        .iter()
        .chain(more)
        .copied()
        .collect();
    rows(&case(name, &sets), LinkKind::InProcess).0
}

fn mirrored(forth: &[Row], back: &[Row]) -> bool {
    forth.len() == back.len()
        && forth.iter().zip(back).all(|(f, b)| {
            f.beta_rad == -b.beta_rad
                && f.gamma_dot_radps == -b.gamma_dot_radps
                && f.acc_mps2 == -b.acc_mps2
                && f.current_a == -b.current_a
                && f.contact == -b.contact
        })
}

#[test]
fn mirrored_move_is_symmetric_to_the_bit() {
    for law in ["continuous", "sampled"] {
        for name in ["paper-1", "paper-2", "paper-3", "paper-4"] {
            let (forth, back) = (
                move_of(name, law, 250.0, &[]),
                move_of(name, law, -250.0, &[]),
            );
            assert!(mirrored(&forth, &back), "{name} {law}");
            assert!(forth.iter().any(|row| row.contact != 0));
        }
        let friction = [
            "carriage.resistance_constant_n=60 carriage.resistance_opposes_motion=true \
             transmission.no_pull=true",
        ];
        let forth = move_of("paper-3", law, 250.0, &friction);
        let back = move_of("paper-3", law, -250.0, &friction);
        assert!(mirrored(&forth, &back), "{law} with friction");
    }
}

#[test]
fn floor_breaks_the_symmetry() {
    for law in ["quantised", "firmware"] {
        let (forth, back) = (
            move_of("paper-2", law, 250.0, &[]),
            move_of("paper-2", law, -250.0, &[]),
        );
        assert!(!mirrored(&forth, &back), "{law}");
    }
}

/// A resistance that does not know its direction is not symmetric either.
#[test]
fn resistance_as_written_breaks_the_symmetry() {
    let constant = ["carriage.resistance_constant_n=60"];
    let forth = move_of("paper-2", "sampled", 250.0, &constant);
    let back = move_of("paper-2", "sampled", -250.0, &constant);
    assert!(!mirrored(&forth, &back));
}
