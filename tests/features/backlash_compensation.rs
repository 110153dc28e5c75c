//! Crossing the gap, and measuring it.

use bench_tests::case;
use hil_core::controllers::{IoKind, measure_gap};

use super::backlash::LIMITS;
use super::{Ran, largest, steps};

/// An encoder that resolves the backlash compensation: 25 nm a count, gains per count
/// accordingly.
const FINE: [&str; 1] = [
    "encoder.counts_per_rad=63600 controller.kp=0.032 controller.ki_per_s=0.05 \
     controller.kd_s=0.0005",
];

/// Largest velocity \[m/s\] and acceleration \[m/s²\] of the reference that
/// the controller follows, from differences of whole counts.
fn reference_peaks(limits: &[&str], trigger: &str) -> (f64, f64) {
    let trigger = format!("backlash.compensation={trigger}");
    let ran = Ran::of("paper-2", &[&FINE, &LIMITS, limits, &[&trigger]]);
    let transmission = &ran.case.axis.transmission;
    let pitch = transmission.screw_pitch_m_per_rad * transmission.gear_ratio;
    let metres_per_count = pitch / ran.case.encoder.counts_per_rad;
    let first = steps(&ran.references());
    let second = steps(&first);
    (
        largest(&first) * metres_per_count / 1e-3,
        largest(&second) * metres_per_count / 1e-6,
    )
}

/// Motion and compensation together stay within the limits of the axis. Motion and
/// offset are each nearest to their exact value, so a reference is within 1.25
/// counts and its second difference within 5 counts of 25 nm: 0.125 m/s².
#[test]
fn the_reference_stays_within_the_limits() {
    for trigger in ["velocity", "acceleration"] {
        for (v, a) in [(2.0, 20.0), (0.6, 4.0), (0.51, 3.3)] {
            let limits = format!("limits.velocity_mps={v} limits.acceleration_mps2={a}");
            let (mps, mps2) = reference_peaks(&[&limits], trigger);
            println!("{trigger}, limits {v} m/s and {a} m/s²: {mps:.4} m/s and {mps2:.3} m/s²");
            assert!(mps <= v + 0.000_1);
            assert!(mps2 <= a + 0.125);
        }
    }
    // The contrast: what is within 20 m/s² is not within 4.
    let (_, hasty) = reference_peaks(&LIMITS[..1], "acceleration");
    assert!(hasty > 4.125);
}

/// Limits that the motion alone uses up leave no room, and that is said.
#[test]
fn without_room_the_run_is_refused() {
    for set in [
        "limits.velocity_mps=0.4999",
        "limits.acceleration_mps2=1.57",
    ] {
        let sets = [&LIMITS[..], &["backlash.compensation=velocity", set]].concat();
        let error = Ran::of_case(case("paper-2", &sets), IoKind::Direct).unwrap_err();
        let sentence = error.to_string();
        println!("{sentence}");
        let room = "the backlash compensation needs room above it";
        for words in [&set.replace('=', " = "), room] {
            assert!(sentence.contains(words), "{sentence}");
        }
    }
}

/// After its move the axis swings around its goal, and crosses the gap while
/// doing so. The reference stands still: it does not follow error or output.
#[test]
fn an_overshoot_takes_nothing_up_again() {
    for trigger in ["velocity", "acceleration"] {
        let trigger = format!("backlash.compensation={trigger}");
        let swinging = ["controller.kd_s=0.005", "run.duration_s=3"];
        let ran = Ran::of("paper-2", &[&LIMITS, &swinging, &[&trigger]]);
        let after = 1_100;
        let motor = steps(&ran.counts()[after..]);
        let motor: Vec<f64> = motor.into_iter().filter(|step| *step != 0.0).collect();
        let turned = motor.windows(2).filter(|pair| pair[0] * pair[1] < 0.0);
        let turns = turned.count();
        let changes = ran.rows[after..].windows(2);
        let changes = changes.filter(|pair| pair[0].contact != pair[1].contact);
        let changes = changes.count();
        let moved = largest(&steps(&ran.references()[after..]));
        println!("{trigger}: the motor turns {turns} times, {changes} contact changes");
        assert!(turns >= 10 && changes >= 10);
        assert_eq!(moved, 0.0);
    }
}

/// The backlash measurement finds the gap of the joint from either evidence, to 2 counts, for
/// narrow gaps and wide ones.
#[test]
fn the_measured_gap_is_the_joints() {
    let stick = ["carriage.resistance_constant_n=250 carriage.resistance_opposes_motion=true"];
    for detection in ["load-encoder", "effort"] {
        for half_gap_deg in [0.3, 1.0, 3.0, 6.0] {
            let joint = format!("transmission.backlash_half_deg={half_gap_deg}");
            let detection = format!("backlash.backlash_measurement_detection={detection}");
            let sets = ["load_encoder.counts_per_rad=1600", &joint, &detection];
            let found = measure_gap(&case("paper-2", &[&sets[..], &stick].concat())).unwrap();
            println!(
                "{detection}, {half_gap_deg}°: {} counts for {:.2}, {:.1} s",
                found.half_counts, found.true_half_counts, found.duration_s
            );
            assert!((f64::from(found.half_counts) - found.true_half_counts).abs() <= 2.0);
        }
    }
}

/// The routine is the firmware's on every rung: its encoder has whole counts, also
/// below zero, where a rung without an encoder would round the other way.
#[test]
fn the_measured_gap_is_the_same_on_every_rung() {
    let found = ["continuous", "sampled", "quantised", "firmware"].map(|law| {
        let sets = [
            "carriage.resistance_constant_n=250 carriage.resistance_opposes_motion=true \
             load_encoder.counts_per_mm=1000",
            &format!("controller.law={law}"),
        ];
        measure_gap(&case("paper-2", &sets)).unwrap()
    });
    assert_eq!(found, [found[3]; 4]);
    assert_eq!(found[0].full_counts, [34, 33, 34]);
}

/// With the measured gap the axis ends where it ends with the given one.
#[test]
fn a_measured_gap_serves_like_a_given_one() {
    let error_um = |sets: &[&str]| {
        let both = ["backlash.compensation=acceleration load_encoder.counts_per_mm=1000"];
        let ran = Ran::of("paper-2", &[&LIMITS, &super::FRICTION, &both, sets]);
        ran.summary().final_error_um
    };
    let given = error_um(&[]);
    let measured = error_um(&["backlash.gap=measured"]);
    println!("given {given:.2} µm, measured {measured:.2} µm");
    // A count of half gap is 2.5 µm.
    assert!((given - measured).abs() < 2.0 * 2.6);
    // The contrast: a setting of twice the gap is overruled by the measurement.
    let wrong = "backlash.half_gap_deg=6";
    assert_eq!(error_um(&[wrong, "backlash.gap=measured"]), measured);
    assert!((error_um(&[wrong]) - given).abs() > 30.0);
}
