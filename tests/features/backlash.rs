//! Compensation of the backlash: which trigger is right is a matter of what
//! keeps the load on its flank.

use super::{FRICTION, PAPER, Ran};

/// Limits of the axis; the paper's moves need 0.5 m/s and 3.1 m/s².
pub(crate) const LIMITS: [&str; 2] = [
    "limits.velocity_mps=2 limits.acceleration_mps2=20",
    "controller.setpoints=generator",
];

const TRIGGERS: [&str; 3] = ["none", "velocity", "acceleration"];

/// Final error of the carriage \[µm\] and its peak acceleration \[m/s²\] with
/// every trigger.
fn with_every_trigger(name: &str, sets: &[&[&str]]) -> [(f64, f64); 3] {
    TRIGGERS.map(|trigger| {
        let trigger = format!("backlash.compensation={trigger}");
        let ran = Ran::of(name, &[&LIMITS[..], &sets.concat(), &[&trigger]]);
        let summary = ran.summary();
        (summary.final_error_um, summary.peak_abs_acc_mps2)
    })
}

fn show(name: &str, figures: &[(f64, f64); 3]) {
    for (trigger, (error_um, peak_mps2)) in TRIGGERS.iter().zip(figures) {
        println!("{name}, {trigger}: carriage {error_um:.1} µm, peak {peak_mps2:.2} m/s²");
    }
}

/// The paper's axis is thrown by its inertia: when it brakes, the load runs
/// ahead to the other flank and friction leaves it there. Where that happens
/// (simulations 2 and 4) the sign of the acceleration is right and brings half
/// a gap, 42 and 35 µm, back; the velocity's makes a whole one of it.
///
/// Measured, none → velocity → acceleration: −45.0, −87.5, −2.4 µm and −38.1,
/// −73.1, −3.0 µm.
#[test]
fn a_load_that_is_thrown_wants_the_acceleration() {
    for (name, half_gap_um) in [("paper-2", 41.7), ("paper-4", 34.7)] {
        let figures = with_every_trigger(name, &[&FRICTION]);
        show(name, &figures);
        let [none, velocity, acceleration] = figures.map(|(error_um, _)| error_um);
        assert!((none.abs() - half_gap_um).abs() < 5.0, "{none}");
        assert!(acceleration.abs() < none.abs() / 5.0);
        assert!(velocity.abs() > 1.5 * none.abs());
        // It costs no acceleration: the gap is crossed within the limits.
        let [before, .., after] = figures.map(|(_, peak_mps2)| peak_mps2);
        assert!(after < 1.1 * before);
    }
}

/// The same axis moved slowly, over 4 s: friction (250 N) is 50 times the
/// force of inertia and keeps the load on the flank that pushes it. Now the
/// sign of the velocity is right and the other one wrong.
///
/// Measured: 34.5, −8.0, 77.1 µm. Simulation 3 stops on that flank as it
/// stands, after a swing back: 26.9, −0.5, 54.4 µm.
#[test]
fn a_load_that_is_pushed_wants_the_velocity() {
    let slow = [
        "motion.total_time_s=4 run.duration_s=6 limits.velocity_mps=0.2 \
         limits.acceleration_mps2=1",
    ];
    for (name, sets) in [("paper-2", &slow[..]), ("paper-3", &[])] {
        let figures = with_every_trigger(name, &[&FRICTION, sets]);
        show(name, &figures);
        let [none, velocity, acceleration] = figures.map(|(error_um, _)| error_um);
        assert!(none > 20.0);
        assert!(velocity.abs() < none / 3.0);
        assert!(acceleration > 1.5 * none);
    }
}

/// Without friction nothing keeps the load anywhere: the carriage floats in
/// the gap, and what is left at the end is the integrator's lag of some
/// 650 µm, which no compensation touches. It moves the end by half a gap.
#[test]
fn without_friction_it_moves_the_end_by_half_a_gap() {
    for (name, half_gap_um) in PAPER.into_iter().zip([4.2, 41.7, 27.8, 34.7]) {
        let figures = with_every_trigger(name, &[]);
        show(name, &figures);
        let [none, velocity, acceleration] = figures.map(|(error_um, _)| error_um);
        for (moved_um, sign) in [(velocity - none, -1.0), (acceleration - none, 1.0)] {
            let off_um = (moved_um - sign * half_gap_um).abs();
            assert!(off_um < 8.0, "{name}: {moved_um}");
        }
        let [before, _, after] = figures.map(|(_, peak_mps2)| peak_mps2);
        assert!(after < 2.0 * before, "{name}");
    }
}

/// The width that is taken up is the one that is set: twice the gap is half a
/// gap too far the other way.
#[test]
fn the_gap_that_is_given_is_taken_up() {
    let error_um = |half_gap_deg: f64| {
        let gap = format!("backlash.half_gap_deg={half_gap_deg}");
        let sets = ["backlash.compensation=acceleration", &gap];
        let ran = Ran::of("paper-2", &[&LIMITS, &FRICTION, &sets]);
        ran.summary().final_error_um
    };
    let [none, half, whole, twice] = [0.0, 1.5, 3.0, 6.0].map(error_um);
    println!("half gap 0, 1.5, 3, 6°: {none:.1}, {half:.1}, {whole:.1}, {twice:.1} µm");
    // p·b/2 = 20.8 µm for every 1.5°, to a count or two (2.5 µm each).
    for (to, expected) in [(half, 20.8), (whole, 41.7), (twice, 83.3)] {
        let moved = to - none;
        assert!((moved - expected).abs() < 5.0, "{moved}");
    }
}
