//! The dead band at rest and what the integrator does in it.

use super::{FRICTION, Ran, peak_to_peak};

/// Swing of the motor \[µm at the carriage\] and of the code over the last
/// second.
fn swings(sets: &[&str]) -> (f64, f64) {
    let ran = Ran::of("paper-2", &[&FRICTION, sets, &["run.duration_s=6"]]);
    let last = ran.rows.len() - 1_000;
    let pitch = ran.case.axis.transmission.screw_pitch_m_per_rad;
    let motor_um: Vec<f64> = ran.rows[last..]
        .iter()
        .map(|row| 1e6 * pitch * row.beta_rad)
        .collect();
    (peak_to_peak(&motor_um), peak_to_peak(&ran.codes()[last..]))
}

/// Inside the dead band the P term is silent. An integrator that runs on
/// without it drives the motor from one side of the band to the other, across
/// the free gap, for ever (23 µm at 4 counts); one that holds its value leaves
/// the axis alone: not a code changes.
#[test]
fn an_integrator_that_holds_leaves_the_axis_alone() {
    for counts in [1, 4] {
        let band = format!("controller.rest_dead_band_counts={counts}");
        let [running, held] = ["run", "hold"].map(|integrator| {
            let integrator = format!("controller.rest_integrator={integrator}");
            swings(&[&band, &integrator])
        });
        println!("dead band {counts}: run {running:?}, hold {held:?} (µm, codes)");
        assert!(running.0 > 5.0 && running.1 > 50.0);
        assert_eq!(held.1, 0.0);
        assert!(held.0 < 0.01);
    }
}

/// The derivative damps in the band as outside it: with an integrator that
/// holds, the axis comes to rest in the band at once, not at its edge with a
/// kick of Kd·e/Δt = 50 codes a count.
#[test]
fn the_edge_of_the_band_gives_no_kick() {
    let sets = [
        "controller.rest_dead_band_counts=8",
        "controller.rest_integrator=hold",
    ];
    let ran = Ran::of("paper-2", &[&FRICTION, &sets]);
    let codes = ran.codes();
    let errors: Vec<f64> = ran.samples().iter().map(|s| s.error_counts).collect();
    let mut crossings = 0;
    for k in 1_001..codes.len() {
        let inside = |k: usize| errors[k].abs() <= 8.0;
        if inside(k) != inside(k - 1) {
            crossings += 1;
            // Kp·9 comes or goes, and the derivative sees the count that moved:
            // not the nine counts, which would be 450 codes.
            let moved = (errors[k] - errors[k - 1]).abs();
            let step = (codes[k] - codes[k - 1]).abs();
            println!(
                "edge at {} s: e by {moved}, the code by {step}",
                ran.rows[k].t_s
            );
            assert!(step <= 3.2 * 10.0 + 50.0 * (moved + 1.0));
        }
    }
    assert!(crossings > 0);
}
