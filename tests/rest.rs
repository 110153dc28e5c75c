//! Axes at rest: ripple, limit cycles and their sources, and the share of
//! encoder and converter that is at work.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use bench_tests::{case, rows};
use hil_core::case::Case;
use hil_core::lanes::Runs;
use hil_core::rest::feeding::{baseline, counterfactuals, fed_by};
use hil_core::rest::{FEWEST, Window};
use hil_core::summary::Summary;
use hil_core::trace::Row;
use hil_runner::host::LinkKind;

/// A vertical axis behind a converter of 8 bits.
fn vertical(sets: &[&str]) -> Case {
    let file = format!("{}/cases/limit-cycle.toml", env!("CARGO_MANIFEST_DIR"));
    case(&file, sets)
}

fn summary(case: &Case) -> Summary {
    rows(case, LinkKind::InProcess).1.summary
}

/// The hunting that `tests/features/limit_cycle.rs` knows: 12.5 µm from end to
/// end with the nearest code, every other swing half as large. With error
/// feedback the carriage stands still, but for a creep.
///
/// Measured: 6.35 µm at 0.15 s; 0.020 µm with error feedback.
#[test]
fn the_known_hunting_is_a_limit_cycle() {
    let nearest = summary(&vertical(&[]));
    let feedback = summary(&vertical(&["controller.quantiser=error-feedback"]));
    let (ripple_um, period_s) = (
        nearest.rest_ripple_um.unwrap(),
        nearest.limit_cycle_period_s.unwrap(),
    );
    let feedback_um = feedback.rest_ripple_um.unwrap();
    println!("nearest {ripple_um:.3} µm, {period_s:.4} s; error feedback {feedback_um:.4} µm");
    assert!((ripple_um - 6.25).abs() < 0.6, "{ripple_um}");
    assert_eq!(nearest.limit_cycle_um, Some(ripple_um));
    assert!((0.13..0.18).contains(&period_s), "{period_s}");
    assert!(feedback_um < 0.05);
    // Four codes are at work, and five counts of 2.5 µm between the extremes.
    assert_eq!(nearest.rest_dac_codes, Some(3));
    assert_eq!(nearest.rest_encoder_counts, Some(5));
    // The contrast: a weight of whole codes makes none.
    let quiet = summary(&vertical(&["carriage.resistance_constant_n=294.6"]));
    assert!(quiet.limit_cycle_um.unwrap() < 0.1 * ripple_um, "{quiet:?}");
}

/// In the paper's second case the motor goes on hunting by two counts with a
/// hundred codes, within the gap; the carriage, without friction, floats there
/// at constant speed. The two sides are told apart.
#[test]
fn a_motor_that_hunts_within_the_gap_moves_no_carriage() {
    let sets = ["controller.law=quantised", "run.duration_s=8"];
    let figures = summary(&case("paper-2", &sets));
    assert_eq!(figures.rest_encoder_counts, Some(2));
    assert_eq!(figures.rest_dac_codes, Some(106));
    assert!(figures.rest_ripple_um.unwrap() < 1e-6);
    assert_eq!(figures.limit_cycle_um, Some(0.0));
    assert_eq!(figures.limit_cycle_period_s, None);
    // A code of 5887 takes 14 bits.
    assert_eq!(figures.dac_bits_used, Some(14));
}

/// A window that is not refused has its samples, whatever the run's last one.
#[test]
fn a_window_is_refused_or_has_its_samples() {
    let (mut refused, mut taken) = (0, 0);
    for duration_ms in 1500..1520 {
        for window_ms in [6.5, 7.0, 7.5, 8.0, 20.0, 499.5, 500.0, 515.5, 520.5] {
            let sets = [
                "controller.sample_time_s=0.001".to_owned(),
                format!("run.duration_s={}", f64::from(duration_ms) / 1e3 + 0.0005),
                format!("run.rest_window_s={}", window_ms / 1e3),
            ];
            match hil_runner::files::case("paper-2", &sets) {
                Ok(case) => {
                    let window = Window::of(&case).unwrap();
                    assert!(case.run.duration_ns / 1_000_000 + 1 - window.first >= FEWEST);
                    taken += 1;
                }
                Err(refusal) => {
                    let words = "run.rest_window_s";
                    assert!(refusal.to_string().contains(words), "{refusal}");
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > 20 && taken > 80, "{refused} {taken}");
    // The whole rest is a window, where roundings of long times part by 1e-12 s too.
    let whole = [
        "run.duration_s=14398.139".to_owned(),
        "sequence.disable_s=11558.127".to_owned(),
        "run.rest_window_s=2840.012".to_owned(),
        "controller.sample_time_s=0.004".to_owned(),
    ];
    let case = hil_runner::files::case("paper-2", &whole).unwrap();
    assert!(Window::of(&case).is_some());
}

/// The figures are those of the rows: the last 4,096 at most, from the middle
/// of the rest on, or those that `run.rest_window_s` asks for.
#[test]
fn the_window_is_the_second_half_of_the_rest() {
    // Samples of 2 ms: the motion ends at 1 s, the rest's middle is at 3.5 s or 11 s.
    for (duration, wanted, first, last) in [
        ("6", None, 1750, 3000),
        ("21", None, 10_500 - 4095, 10_500),
        ("6", Some("1.7"), 2150, 3000),
        ("6", Some("5"), 500, 3000),
        ("21", Some("10"), 5500, 10_500),
    ] {
        let mut sets = vec![
            "controller.sample_time_s=0.002".to_owned(),
            format!("run.duration_s={duration}"),
        ];
        sets.extend(wanted.map(|window| format!("run.rest_window_s={window}")));
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let case = vertical(&sets);
        let found = Window::of(&case).unwrap();
        assert_eq!(usize::try_from(found.first).unwrap(), first);
        let (rows, outcome) = rows(&case, LinkKind::InProcess);
        assert_eq!(rows.len(), last + 1);
        let window = &rows[first..];
        let codes = window.iter().map(|row| row.sample.unwrap().dac_code);
        let (low, high) = codes.fold((f64::MAX, f64::MIN), |(l, h), c| (l.min(c), h.max(c)));
        let figures = &outcome.summary;
        assert_eq!(figures.figure("rest_dac_codes"), Some(high - low));
        let p = case.axis.transmission.screw_pitch_m_per_rad;
        let x: Vec<f64> = window.iter().map(|row| 1e6 * p * row.gamma_rad).collect();
        let expected = amplitude(&x);
        let found = figures.rest_ripple_um.unwrap();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        // The contrast: another window, another ripple.
        assert!((found / amplitude(&x[100..]) - 1.0).abs() > 1e-9);
        // So are the errors at rest, to the last rounding.
        let errors_um = |rows: &[Row]| -> Vec<f64> {
            let carriage_m = rows.iter().map(|row| row.x_ref_m - p * row.gamma_rad);
            carriage_m.map(|error_m| 1e6 * error_m).collect()
        };
        let rms = |errors: &[f64]| {
            (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
        };
        let errors = errors_um(window);
        let largest = errors.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        assert_eq!(figures.rest_error_max_um, Some(largest));
        assert_eq!(figures.rest_error_rms_um, Some(rms(&errors)));
        assert_ne!(rms(&errors_um(&rows[first - 100..])), rms(&errors));
    }
}

/// Half of the swing about the weighted line, the sums in another way.
fn amplitude(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    let u = |i: usize| (2.0 * i as f64 + 1.0) / n - 1.0;
    let weight = |i: usize| (1.0 - u(i).powi(2)).powi(2);
    let mean = x.iter().sum::<f64>() / n;
    let sum = |of: &dyn Fn(usize) -> f64| (0..x.len()).map(of).sum::<f64>();
    let slope = sum(&|i| weight(i) * u(i) * (x[i] - mean)) / sum(&|i| weight(i) * u(i) * u(i));
    let rest: Vec<f64> = (0..x.len()).map(|i| x[i] - mean - slope * u(i)).collect();
    let highest = rest.iter().fold(f64::MIN, |a, b| a.max(*b));
    let lowest = rest.iter().fold(f64::MAX, |a, b| a.min(*b));
    0.5 * (highest - lowest)
}

/// Figures are null without anything to tell, and fail a budget.
#[test]
fn figures_without_a_window_are_null() {
    let keys = [
        "rest_error_max_um",
        "rest_error_rms_um",
        "rest_ripple_um",
        "limit_cycle_um",
        "rest_dac_codes",
        "rest_encoder_counts",
    ];
    // Rows 1.008 to 1.015 s make eight; one sample less does not.
    for (duration, some) in [("1.015", true), ("1.014", false), ("0.8", false)] {
        let case = vertical(&[
            &format!("run.duration_s={duration}"),
            "budget.rest_ripple_um=1000",
        ]);
        let figures = summary(&case);
        for key in keys {
            assert_eq!(figures.figure(key).is_some(), some, "{duration} {key}");
        }
        assert_eq!(figures.verdicts[0].pass, some, "{duration}");
        assert!(figures.dac_bits_used.is_some() && figures.encoder_bits_used.is_some());
    }
    // What happens to the axis ends a rest.
    let disturbed = ["sequence.emergency_stop_s=5.99"];
    assert_eq!(summary(&vertical(&disturbed)).rest_ripple_um, None);
    // The rungs below have no whole codes or counts, but a carriage.
    for law in ["continuous", "sampled"] {
        let figures = summary(&vertical(&[&format!("controller.law={law}")]));
        assert!(figures.rest_ripple_um.is_some(), "{law}");
        for key in ["dac_bits_used", "encoder_bits_used"]
            .iter()
            .chain(&keys[4..])
        {
            assert_eq!(figures.figure(key), None, "{law} {key}");
        }
    }
}

/// The source of a case's limit cycle, in words.
fn feeding(case: &Case) -> String {
    let mut runs = Runs::new();
    let base = runs.single(&baseline(case)).unwrap();
    assert!(base.limit_cycle_um > Some(0.0), "no cycle: {base:?}");
    let amplitude_um = base.rest_ripple_um.unwrap();
    let results: Vec<_> = counterfactuals(case)
        .iter()
        .map(|other| {
            let figures = runs.single(&other.case).unwrap();
            (other.without, figures.rest_ripple_um)
        })
        .collect();
    let fed = fed_by(amplitude_um, &results);
    println!("{amplitude_um:.3} µm, without one each {results:?}: fed by {fed}");
    fed
}

/// Cycles of which it is known what they come from.
#[test]
fn what_feeds_a_cycle_is_found() {
    // A weight of 12.2 codes. With a fine encoder the converter alone is left; with
    // that of the file (2.5 µm) its steps hold the swing up too.
    let fine = [
        "encoder.counts_per_rad=10176 controller.kp=0.0125 controller.ki_per_s=0.0625 \
         controller.kd_s=0.0000625",
    ];
    assert_eq!(feeding(&vertical(&fine)), "dac");
    assert_eq!(feeding(&vertical(&[])), "encoder+dac");
    // A count is 26 µm, a code nothing; the integrator takes the carriage from one
    // edge of a count to the other.
    let coarse = [
        "encoder.counts_per_rad=60 drive.dac_bits=20 drive.dac_lsb_v=1.9073486328125e-5 \
         controller.kp=9000 controller.ki_per_s=450000 controller.kd_s=450",
    ];
    assert_eq!(feeding(&vertical(&coarse)), "encoder");
    // A loop with an integrator that holds motor and carriage, but not the motor
    // alone: within the gap it swings from flank to flank.
    let loose = [
        "encoder.counts_per_rad=65000 drive.dac_bits=24 drive.dac_lsb_v=4.765625e-6 \
         controller.kp=32 controller.ki_per_s=300 controller.kd_s=2.5 run.duration_s=8",
    ];
    assert_eq!(feeding(&case("paper-2", &loose)), "gap");
}
