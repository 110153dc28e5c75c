//! Fed the same counts, the firmware and the law in f64 (`quantised`) give the
//! same codes except at exact ties: samples at which `y + ½` of the decimal
//! gains is an integer, which the rounding of a word or of a product decides.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use bench_tests::case;
use hil_core::controllers::{Controller, IoKind};
use hil_core::message::Measurement;
use hil_core::run::{RunOptions, run};
use num_rational::Ratio;

/// Measurements of a run on rung `quantised`.
fn inputs(name: &str) -> Vec<Measurement> {
    let case = case(name, &["controller.law=quantised"]);
    let options = RunOptions {
        inputs: true,
        ..RunOptions::default()
    };
    run(&case, options, &mut |_| Ok(())).unwrap().inputs
}

/// Error and code of every sample that a rung computes from `inputs`.
fn codes(name: &str, law: &str, inputs: &[Measurement]) -> Vec<(f64, f64)> {
    let case = case(name, &[&format!("controller.law={law}")]);
    let mut controller = Controller::new(&case, IoKind::Direct).unwrap().unwrap();
    let commands = inputs.iter().map(|&input| controller.step(input));
    commands
        .map(|c| (c.error_counts.real(), c.dac_code.real()))
        .collect()
}

/// `y` of the paper's gains at 1 ms, exactly: Kp = 16/5, Ki·Δt = 1/200,
/// Kd/Δt = 50.
fn exact_outputs(errors: &[i64]) -> Vec<Ratio<i64>> {
    let (mut sum, mut previous) = (0, None);
    let outputs = errors.iter().map(|&e| {
        sum += e;
        let slope = e - previous.replace(e).unwrap_or(e);
        Ratio::new(16, 5) * e + Ratio::new(1, 200) * sum + Ratio::from(50 * slope)
    });
    outputs.collect()
}

#[test]
fn firmware_and_f64_part_only_at_exact_ties() {
    // The numbers of ties are those that the README gives.
    for (name, expected) in [
        ("paper-1", 11),
        ("paper-2", 11),
        ("paper-3", 6),
        ("paper-4", 10),
    ] {
        let inputs = inputs(name);
        let firmware = codes(name, "firmware", &inputs);
        let quantised = codes(name, "quantised", &inputs);
        #[expect(clippy::cast_possible_truncation, reason = "whole counts")]
        let errors: Vec<i64> = quantised.iter().map(|(e, _)| *e as i64).collect();
        let outputs = exact_outputs(&errors);
        let half = Ratio::new(1, 2);
        let ties = outputs.iter().filter(|y| (*y + half).is_integer()).count();
        assert_eq!(ties, expected, "{name}");
        for ((f, q), y) in firmware.iter().zip(&quantised).zip(&outputs) {
            assert_eq!(f.0, q.0, "{name}: the errors are the same counts");
            if f.1 != q.1 {
                assert!(
                    (y + half).is_integer(),
                    "{name}: {} for {} at {y}",
                    f.1,
                    q.1
                );
                assert_eq!((f.1 - q.1).abs(), 1.0);
            }
        }
    }
}
