//! Integrator wind-up: the honest converter of `paper-2-12bit` stands at its
//! limit for most of the move.

use super::{Ran, largest, steps};

/// Long enough to see how the axis comes back.
const LONG: &str = "run.duration_s=4";

fn windup(treatment: &str, more: &[&str]) -> Ran {
    let treatment = format!("controller.anti_windup={treatment}");
    Ran::of("paper-2-12bit", &[&[&treatment, LONG], more])
}

fn show(name: &str, ran: &Ran) {
    println!(
        "{name}: overshoot {:.2} mm, final error {:.1} µm, settled after {:?} s, {:.3} s at the limit",
        ran.overshoot_mm(),
        ran.summary().final_error_um,
        ran.summary().settling_time_s,
        ran.summary().voltage_saturated_s,
    );
}

/// Runs with every treatment, shown.
fn treatments(what: &str, more: &[&str]) -> [Ran; 3] {
    ["none", "clamp", "back-calculation"].map(|treatment| {
        let ran = windup(treatment, more);
        show(&format!("{treatment}{what}"), &ran);
        ran
    })
}

/// The paper's gains: 96.8 mm of overshoot and not at rest within 3 s; with
/// the clamp 3.3 mm and settled after 1.36 s.
///
/// Back-calculation with its 10 ms draws the integral so far back that the
/// carriage never overshoots, and then needs Kp/Ki = 0.64 s time constants to
/// creep up: 0.68 mm are left 3 s after the motion.
#[test]
fn windup_of_the_papers_gains() {
    let [none, clamp, back] = treatments("", &[]);
    assert!(none.overshoot_mm() > 50.0);
    assert_eq!(none.summary().settling_time_s, None);
    assert!(clamp.overshoot_mm() < none.overshoot_mm() / 10.0);
    assert!(clamp.summary().settling_time_s.unwrap() < 2.0);
    assert!(back.overshoot_mm() < 0.0);
    assert!(back.summary().final_error_um.abs() < 1_000.0);
}

/// With six times the integral gain the contrast is complete: without a
/// treatment the carriage swings by 162 mm and is still on its way at the end;
/// the clamp settles after 1.06 s, back-calculation, which its Ki suits,
/// after 0.84 s with 0.07 mm of overshoot.
#[test]
fn windup_of_a_quick_integrator() {
    let quick = ["controller.ki_per_s=30"];
    let [none, clamp, back] = treatments("", &quick);
    assert!(none.overshoot_mm() > 100.0);
    assert!(none.summary().final_error_um.abs() > 10_000.0);
    for (ran, overshoot_mm, settled_s) in [(&clamp, 8.0, 1.5), (&back, 0.5, 1.0)] {
        assert!(ran.overshoot_mm() < overshoot_mm);
        assert!(ran.summary().settling_time_s.unwrap() < settled_s);
    }
}

/// A slew limit is a limit like the converter's: the clamp knows it. 50 codes
/// a sample keep the axis 41 ms from its converter's end, and the treatments
/// keep their order.
#[test]
fn windup_behind_a_slew_limit() {
    let slew = ["controller.slew_limit_codes_per_s=50000"];
    let [none, clamp, back] = treatments(", slew", &slew);
    for ran in [&none, &clamp, &back] {
        assert_eq!(largest(&steps(&ran.codes())), 50.0);
    }
    assert!(largest(&steps(&windup("clamp", &[]).codes())) > 200.0);
    assert!(none.overshoot_mm() > 50.0);
    assert!(clamp.overshoot_mm() < none.overshoot_mm() / 5.0);
    assert!(clamp.summary().settling_time_s.unwrap() < 2.5);
    assert!(back.overshoot_mm() < 0.0);
}

/// A treatment changes nothing of an axis that never reaches a limit, to the
/// last bit.
#[test]
fn no_limit_no_treatment() {
    let run = |treatment: &str| {
        let treatment = format!("controller.anti_windup={treatment}");
        let sets = [&*treatment, "controller.setpoints=generator"];
        Ran::of("paper-2", &[&sets])
    };
    let none = run("none");
    assert_eq!(none.summary().voltage_saturated_s, 0.0);
    assert_eq!(none.rows, run("clamp").rows);
    assert_eq!(none.rows, run("back-calculation").rows);
}
