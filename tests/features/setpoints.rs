//! Setpoints from the firmware's generator and from a queue, and the
//! feed-forward that they make possible.

use bench_tests::case;
use hil_core::controllers::IoKind;
use plant::Motion;

use super::{PAPER, Ran, largest};

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

/// 100 001 samples at 10 µs: six tables' worth of a chip.
#[test]
fn setpoints_are_as_long_as_the_motion() {
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

    let table = Ran::of("paper-2", &[&[fast, "limits.missed_ticks=true"]]);
    assert_eq!(table.axis().state, "holding");
    let paper = Ran::of("paper-2", &[&[fast]]);
    assert!(table.codes() == paper.codes(), "an axis with nothing on");
    let pairs = paper.references().into_iter().zip(generator.references());
    assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= 1.0));
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

/// With feedback off the codes are the feed-forward alone: `Kv·v + Ka·a + Kf·sign(v)` of
/// the command itself, from the table, and within a code from the generator. A difference of whole counts
/// is no velocity: it misses by up to a count per sample.
#[test]
fn a_table_gives_velocity_and_acceleration_of_the_command() {
    let [kv, ka, kf] = [0.02685, 0.0024, 40.0];
    let gains = format!(
        "controller.kp=0 controller.ki_per_s=0 controller.kd_s=0 controller.velocity_ff_s={kv} \
         controller.acceleration_ff_s2={ka} controller.friction_ff_codes={kf}"
    );
    let case = case("paper-2", &[&gains]);
    let transmission = case.axis.transmission;
    let metres_per_rad = transmission.screw_pitch_m_per_rad * transmission.gear_ratio;
    let counts_per_m = case.encoder.counts_per_rad / metres_per_rad;
    let codes = |velocity_counts: f64, acceleration_counts: f64| {
        let sign = if velocity_counts == 0.0 {
            0.0
        } else {
            velocity_counts.signum()
        };
        kv * velocity_counts + ka * acceleration_counts + kf * sign
    };
    let ahead = |k: usize| {
        let point = case.motion.at(k as f64 / 1e3);
        codes(
            point.velocity_mps * counts_per_m,
            point.acceleration_mps2 * counts_per_m,
        )
    };
    let farthest = |ran: &Ran, wanted: &dyn Fn(usize) -> f64| {
        // The generator gives the first sample the sign of the way ahead.
        let codes = ran.codes();
        let off = codes[1..]
            .iter()
            .zip(1..)
            .map(|(code, k)| (code - wanted(k)).abs());
        off.fold(0.0, f64::max)
    };
    // Half a code, and what 24 bits of gains and rates leave of 6000 codes.
    let table = Ran::of("paper-2", &[&[&gains]]);
    let off = farthest(&table, &ahead);
    println!("table: {off:.4} codes");
    assert!(off <= 0.502, "{off}");
    for source in ["generator", "queue"] {
        let source = format!("controller.setpoints={source}");
        let ran = Ran::of("paper-2", &[&[&gains, &source]]);
        let codes = ran.codes();
        assert!(farthest(&table, &|k| codes[k]) <= 1.0, "{source}");
    }
    assert!(largest(&table.codes()) > 5_000.0);
    let references = table.references();
    let of_differences = |k: usize| {
        let before = references[k.saturating_sub(1)];
        codes((references[k] - before) * 1e3, 0.0)
    };
    assert!(farthest(&table, &of_differences) > 20.0);
}

/// Two moves with a dwell, and a profile, with feed-forward: the queue brings the table's
/// setpoints, and the generator, which plans one move, says what would do.
#[test]
fn table_and_queue_take_every_command() {
    let there = Motion::new(0.12, [0.1, 0.1, 0.1, 0.05, 0.1, 0.1, 0.1]).unwrap();
    let back = Motion::new(-0.05, [0.12, 0.05, 0.12, 0.0, 0.12, 0.05, 0.12]).unwrap();
    let profile = [(0.0, 0.0), (0.21, 0.04), (0.52, 0.03), (0.8, 0.1)];
    let motions = [
        Motion::row(&[(there, 0.0507), (back, 0.1)]).unwrap(),
        Motion::profile(&profile).unwrap(),
    ];
    for motion in motions {
        let run = |sets: &[&str]| {
            let mut case = case("paper-2", sets);
            case.motion = motion.clone();
            Ran::of_case(case, IoKind::Direct)
        };
        let ahead = "controller.velocity_ff_s=0.02685 controller.acceleration_ff_s2=0.0024";
        let table = run(&[ahead]).unwrap();
        let queue = run(&[ahead, "controller.setpoints=queue"]).unwrap();
        assert!(table.rows == queue.rows, "{motion:?}");
        assert_eq!(table.axis().state, "holding");
        // The contrast: without feed-forward it is another run, and lags further behind.
        let without = run(&["controller.setpoints=queue"]).unwrap();
        let lag_mm = |ran: &Ran| ran.summary().peak_following_error_mm;
        let lags = [lag_mm(&table), lag_mm(&without)];
        println!("following error {lags:.3?} mm");
        assert!(lags[0] < 0.5 * lags[1]);
        let told = run(&["controller.setpoints=generator"]).err().unwrap();
        let wanted = "controller.setpoints = \"generator\" plans one move in seven intervals; a row of \
                      moves and a profile need \"table\" or \"queue\"";
        assert_eq!(told.to_string(), wanted);
    }
}
