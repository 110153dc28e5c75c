//! Quantisation noise against the difference of two simulations: the same run
//! with steps and without.

use super::super::noise::NoiseFigures;
use super::super::quantisation_noise;
use super::{case, rows, scale};
use crate::case::{Case, Law};
use crate::trace::Row;

/// Mean and standard deviations of what the steps add, over a stretch of time.
fn difference(case: &Case, from_s: f64, to_s: f64) -> (f64, NoiseFigures) {
    let mut smooth = case.clone();
    smooth.controller.law = Law::Sampled;
    let (with, without) = (rows(case), rows(&smooth));
    let pitch = case.axis.transmission.screw_pitch_m_per_rad;
    let of = |f: &dyn Fn(&Row) -> f64| -> (f64, f64) {
        let both = with.iter().zip(&without);
        let stretch = both.filter(|(row, _)| row.t_s >= from_s && row.t_s <= to_s);
        let values: Vec<f64> = stretch.map(|(a, b)| f(a) - f(b)).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        (mean, (squares / n).sqrt())
    };
    let (mean_m, position_m) = of(&|row| pitch * row.gamma_rad);
    let (_, acceleration_mps2) = of(&|row| row.acc_mps2);
    let (_, voltage_v) = of(&|row| row.motor_voltage_v);
    let figures = NoiseFigures {
        position_um: 1e6 * position_m,
        acceleration_mps2,
        command: voltage_v,
    };
    (1e6 * mean_m, figures)
}

fn ratios(name: &str, predicted: &NoiseFigures, measured: &NoiseFigures) -> [f64; 3] {
    let ratios = [
        predicted.position_um / measured.position_um,
        predicted.acceleration_mps2 / measured.acceleration_mps2,
        predicted.command / measured.command,
    ];
    println!(
        "{name}: position {:.4} µm for {:.4} ({:.2}), acceleration {:.5} m/s² for {:.5} ({:.2}), \
         voltage {:.4} V for {:.4} ({:.2})",
        predicted.position_um,
        measured.position_um,
        ratios[0],
        predicted.acceleration_mps2,
        measured.acceleration_mps2,
        ratios[1],
        predicted.command,
        measured.command,
        ratios[2]
    );
    ratios
}

/// The case with an encoder so fine that only the codes are left, or the other
/// way round. The codes keep their size in volts.
fn with_fine_encoder(mut case: Case) -> Case {
    let fine = 1000.0;
    case.encoder.counts_per_rad *= fine;
    scale(&mut case.controller.gains, 1.0 / fine);
    case
}

fn with_fine_codes(mut case: Case) -> Case {
    let fine = 1000.0;
    case.dac.step_v /= fine;
    case.dac.bits = 24;
    scale(&mut case.controller.gains, fine);
    case
}

/// Each source by itself and all together, in motion at up to 200 counts a
/// sample; at rest, the contrast, it is no noise.
///
/// Measured in motion, predicted over simulated, all sources: acceleration 0.98
/// to 1.00, voltage 0.99 to 1.02, position, of which 4.6 s hold few independent
/// values, 0.95 to 1.16; at rest 1.1 to 6.3.
#[test]
fn noise_of_an_axis_in_motion() {
    let cases: [&[&str]; 5] = [
        &[],
        &["controller.sample_time_s=0.00025"],
        &["controller.sample_time_s=0.004"],
        &["controller.computation_delay_s=0.001"],
        &["transmission.joint=rigid", "controller.kp=10"],
    ];
    let common = [
        "controller.law=quantised",
        "transmission.backlash_half_deg=0",
        "motion.travel_mm=1250",
        "motion.total_time_s=5",
        "run.duration_s=7",
        "run.events=false",
    ];
    let mut at_rest = Vec::new();
    for sets in cases {
        let case = case("paper-2", &[&common[..], sets].concat());
        let noise = quantisation_noise(&case).unwrap();
        let (mean_um, all) = difference(&case, 0.2, 4.8);
        println!("{sets:?}: mean {:.3} µm for {mean_um:.3}", noise.mean_um);
        assert!((noise.mean_um / mean_um - 1.0).abs() < 0.1);
        let (_, codes) = difference(&with_fine_encoder(case.clone()), 0.2, 4.8);
        let (_, counts) = difference(&with_fine_codes(case.clone()), 0.2, 4.8);
        let both = both(&noise.encoder, &noise.setpoint);
        let all = ratios("  all", &noise.together, &all);
        let counts = ratios("  counts", &both, &counts);
        let codes = ratios("  codes", &noise.dac, &codes);
        for [position, acceleration, voltage] in [all, counts] {
            assert!((acceleration - 1.0).abs() < 0.1 && (voltage - 1.0).abs() < 0.1);
            assert!((position - 1.0).abs() < 0.3);
        }
        assert!(codes.iter().all(|ratio| (ratio - 1.0).abs() < 0.5));
        let (_, rest) = difference(&case, 6.0, 7.0);
        at_rest.push(ratios("  all, at rest", &noise.together, &rest));
    }
    let far = |ratios: &&[f64; 3]| ratios.iter().any(|ratio| !(0.5..2.0).contains(ratio));
    assert!(at_rest.iter().filter(far).count() >= 3);
}

/// The root of the sum of squares.
fn both(a: &NoiseFigures, b: &NoiseFigures) -> NoiseFigures {
    NoiseFigures {
        position_um: a.position_um.hypot(b.position_um),
        acceleration_mps2: a.acceleration_mps2.hypot(b.acceleration_mps2),
        command: a.command.hypot(b.command),
    }
}

/// The variance by doubling is that of the sum, sample by sample: the impulse
/// response of the simulated axis, squared and summed.
#[test]
fn variance_is_the_sum_of_the_squared_impulse_response() {
    let mut impulse = case(
        "paper-2",
        &[
            "controller.law=quantised",
            "transmission.backlash_half_deg=0",
            "controller.ki_per_s=30",
        ],
    );
    let noise = quantisation_noise(&impulse).unwrap();
    // A step of the reference is the sum of impulses: a travel of one count in
    // no time, and the difference of neighbouring rows.
    impulse.controller.law = Law::Sampled;
    let transmission = impulse.axis.transmission;
    let count_m = transmission.screw_pitch_m_per_rad * transmission.gear_ratio
        / impulse.encoder.counts_per_rad;
    impulse.motion = plant::Motion::new(count_m, [0.0, 5e-5, 0.0, 0.0, 0.0, 5e-5, 0.0]).unwrap();
    impulse.run.duration_ns = 20_000_000_000;
    let rows = rows(&impulse);
    let sum = |f: &dyn Fn(&Row) -> f64| -> f64 {
        let changes = rows.windows(2).map(|pair| f(&pair[1]) - f(&pair[0]));
        changes.map(|change| change * change).sum::<f64>()
    };
    // At t = 0 the reference is still 0, so every row is there.
    let per_count = 1.0 / 12.0_f64.sqrt();
    let pitch = transmission.screw_pitch_m_per_rad;
    let expected = [
        (
            noise.encoder.position_um,
            1e6 * per_count * sum(&|row| pitch * row.gamma_rad).sqrt(),
        ),
        (
            noise.encoder.acceleration_mps2,
            per_count * sum(&|row| row.acc_mps2).sqrt(),
        ),
        (
            noise.encoder.command,
            per_count * sum(&|row| row.motor_voltage_v).sqrt(),
        ),
    ];
    for (predicted, summed) in expected {
        println!("{predicted:.6} for {summed:.6}");
        let off = (predicted / summed - 1.0).abs();
        assert!(off < 1e-6, "{predicted} {summed}");
    }
}

/// The theory is silent where it does not apply.
#[test]
fn no_noise_where_the_theory_does_not_apply() {
    let noise = |sets: &[&str]| quantisation_noise(&case("paper-2", sets));
    assert!(noise(&[]).is_some());
    assert!(noise(&["controller.quantiser=dither"]).is_none());
    assert!(noise(&["controller.quantiser=dither", "controller.law=quantised"]).is_some());
    assert!(noise(&["controller.law=sampled"]).is_none());
    assert!(noise(&["controller.kp=1000"]).is_none());
    assert!(noise(&["controller.derivative_filter_s=0.001"]).is_none());
}
