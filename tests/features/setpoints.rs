//! Setpoints from the firmware's generator and from a queue, and the
//! feed-forward that they make possible.

use bench_tests::case;
use hil_runner::files;

use super::{PAPER, Ran};

const GENERATOR: &str = "controller.setpoints=generator";

/// The generator's stretches are within 1/8 count of what the table holds rounded
/// from `f64`: at most a quarter of the 4·1501 samples of the paper's cases can
/// differ, by one count, and the queue hands on what the generator gives.
#[test]
fn generator_and_queue_give_the_tables_codes() {
    let mut differing = 0;
    for name in PAPER {
        let [table, generator, queue] = ["table", "generator", "queue"].map(|source| {
            let set = format!("controller.setpoints={source}");
            Ran::of(name, &[&[&set]])
        });
        let pairs = table.references().into_iter().zip(generator.references());
        let distances: Vec<f64> = pairs.map(|(a, b)| (a - b).abs()).collect();
        // Both are nearest to the same real number: apart only near a half.
        assert!(super::largest(&distances) <= 1.0, "{name}");
        differing += distances.iter().filter(|distance| **distance > 0.0).count();
        let first = distances.iter().position(|distance| *distance > 0.0);
        let same = first.unwrap_or(table.rows.len());
        assert_eq!(table.codes()[..same], generator.codes()[..same], "{name}");
        assert_eq!(generator.rows, queue.rows, "{name}");
    }
    println!("setpoints that differ: {differing} of {}", 4 * 1_501);
    assert!(differing * 4 < 4 * 1_501, "{differing}");
}

/// 100 001 samples at 10 µs: six tables' worth.
#[test]
fn generator_and_queue_are_as_long_as_the_motion() {
    let fast = "controller.sample_time_s=1e-5";
    let generator = Ran::of("paper-2", &[&[fast, GENERATOR]]);
    let queue = Ran::of("paper-2", &[&[fast, "controller.setpoints=queue"]]);
    assert_eq!(generator.rows, queue.rows);
    assert_eq!(generator.rows.len(), 150_001);
    assert_eq!(generator.axis().state, "holding");
    let plain = Ran::of("paper-2", &[]);
    let [fast_mm, plain_mm] = [&generator, &plain].map(|r| r.summary().peak_following_error_mm);
    println!("following error at 10 µs {fast_mm:.3} mm, at 1 ms {plain_mm:.3} mm");
    assert!((fast_mm - plain_mm).abs() < 0.25 * plain_mm);

    let refused = files::case("paper-2", &[fast.to_owned()]).unwrap_err();
    let refused = refused.to_string();
    assert!(refused.contains("100001 setpoints"), "{refused}");
}

/// With a derivative of the measured position the axis lags by what its own
/// damping costs (9.1 mm); a feed-forward of 0.0769 codes s/count pays for it
/// (1.35 mm), and 0.0005 codes s²/count for the inertia (1.07 mm). The paper's
/// law is at 3.44 mm.
#[test]
fn feed_forward_takes_the_lag_away() {
    let base = [GENERATOR, "controller.derivative=measurement"];
    let velocity = ["controller.velocity_ff_s=0.0769"];
    let acceleration = ["controller.acceleration_ff_s2=0.0005"];
    let lag_mm = |sets: &[&[&str]]| Ran::of("paper-2", sets).summary().peak_following_error_mm;
    let paper_mm = lag_mm(&[]);
    let without_mm = lag_mm(&[&base]);
    let velocity_mm = lag_mm(&[&base, &velocity]);
    let both_mm = lag_mm(&[&base, &velocity, &acceleration]);
    println!(
        "lag: paper {paper_mm:.2}, measurement {without_mm:.2}, Kv {velocity_mm:.2}, Kv and Ka {both_mm:.2} mm"
    );
    assert!(both_mm < velocity_mm && velocity_mm < without_mm / 5.0);
    assert!(both_mm < paper_mm / 2.5);
    assert!(both_mm < without_mm / 7.0);
    // The contrast: twice as much is no better than none.
    let twice = ["controller.velocity_ff_s=0.1538"];
    assert!(lag_mm(&[&base, &twice]) > 5.0 * velocity_mm);
}

/// A friction that is known is paid for before the integrator finds it.
#[test]
fn friction_feed_forward_starts_the_axis() {
    let base = [
        GENERATOR,
        "controller.derivative=measurement controller.velocity_ff_s=0.0769 \
         controller.acceleration_ff_s2=0.0005",
    ];
    // a0·p/z·R/k_m over K_a·K_dac: 1000 N are 653 codes.
    let case = case("paper-2", &[]);
    let (motor, gear) = (case.axis.motor, case.axis.transmission);
    let torque_nm = 1_000.0 * gear.screw_pitch_m_per_rad * gear.gear_ratio;
    let volts = torque_nm * motor.resistance_ohm / motor.torque_constant_nm_per_a;
    let codes = volts / (3.0 * 0.00488);
    let stick = ["carriage.resistance_constant_n=1000 carriage.resistance_opposes_motion=true"];
    let known = format!("controller.friction_ff_codes={codes:.1}");
    let peak = |more: &[&str]| {
        let ran = Ran::of("paper-2", &[&base, &stick, more]);
        ran.axis().peak_error_counts
    };
    let (without, with) = (peak(&["controller.word_bits=31"]), peak(&[&known]));
    println!("{codes:.0} codes of friction: |e| up to {without} counts, fed forward {with}");
    assert!(with < without);
}
