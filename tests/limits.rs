//! The rungs approach each other where their difference vanishes.

use bench_tests::{case, rows};
use hil_runner::host::LinkKind;

/// Carriage at 1 ms intervals \[m\] of a rigid axis (no chance of contacts) on
/// one rung.
fn carriage(law: &str, sample_time_s: f64, more: &[&str]) -> Vec<f64> {
    let law = format!("controller.law={law}");
    let sample_time = format!("controller.sample_time_s={sample_time_s}");
    let sets: Vec<&str> = ["transmission.joint=rigid", &law, &sample_time]
        .iter()
        .chain(more)
        .copied()
        .collect();
    let case = case("paper-2", &sets);
    let pitch = case.axis.transmission.screw_pitch_m_per_rad;
    let on_grid = |t_s: f64| (1e3 * t_s - (1e3 * t_s).round()).abs() < 1e-9;
    let (rows, _) = rows(&case, LinkKind::InProcess);
    let rows = rows.iter().filter(|row| on_grid(row.t_s));
    rows.map(|row| pitch * row.gamma_rad).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// Zero-order hold and backward differences are first-order: halving Δt
/// halves the distance to the continuous law.
#[test]
fn sampled_approaches_continuous_with_first_order() {
    let continuous = carriage("continuous", 1e-3, &[]);
    let errors = [1e-3, 5e-4, 2.5e-4, 1.25e-4]
        .map(|dt| largest_difference(&carriage("sampled", dt, &[]), &continuous));
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((0.9..1.1).contains(&order), "{errors:?}");
    }
    // The contrast: a delay of half a sample does not vanish any faster, and
    // the order is lost if the delay stays.
    let delayed = [1e-3, 5e-4].map(|dt| {
        let delay = "controller.computation_delay_s=5e-4";
        largest_difference(&carriage("sampled", dt, &[delay]), &continuous)
    });
    let order = (delayed[0] / delayed[1]).log2();
    assert!(order < 0.8, "{delayed:?}");
}

/// With a thousand times finer encoder and DAC the quantised law is the
/// sampled one.
#[test]
fn quantised_approaches_sampled_with_finer_steps() {
    let sampled = carriage("sampled", 1e-3, &[]);
    let difference = |finer: f64| {
        // The gains are per count and per code: both finer leaves them alone.
        let counts = format!("encoder.counts_per_rad={}", 636.0 * finer);
        let step = format!("drive.dac_lsb_v={}", 0.00488 / finer);
        let sets = [counts.as_str(), step.as_str(), "drive.dac_bits=24"];
        largest_difference(&carriage("quantised", 1e-3, &sets), &sampled)
    };
    let (coarse, fine) = (difference(1.0), difference(1000.0));
    assert!(fine < coarse / 100.0, "{coarse} {fine}");
}

/// An interval with a contact that ends exactly where the command changes its
/// segment (here at 1 s, the motion's end) carries nothing of the old segment
/// on. It once did: the current was off by 1e-5 A one row later.
#[test]
fn a_row_on_a_break_of_the_command_carries_nothing_on() {
    let b_deg = 0.043_090_561_694_861_42_f64.to_degrees();
    let draw = [
        "controller.law=continuous".to_owned(),
        format!("transmission.backlash_half_deg={b_deg}"),
        "controller.kp=5.701951475199062".to_owned(),
        "controller.kd_s=0.005660709196294134".to_owned(),
    ];
    let current_a = |solver: &str| {
        let solver = format!("run.solver={solver}");
        let sets: Vec<&str> = draw.iter().map(String::as_str).chain([&*solver]).collect();
        let (rows, _) = rows(&case("paper-2", &sets), LinkKind::InProcess);
        rows[1001].current_a
    };
    let difference_a = (current_a("exact") - current_a("dopri5")).abs();
    assert!(difference_a < 1e-8, "{difference_a}");
}
