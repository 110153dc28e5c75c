//! Two encoders: the load's for the position, the motor's for the derivative.

use super::{FRICTION, Ran};

const SCALE: [&str; 2] = [
    "load_encoder.counts_per_mm=1000",
    "controller.derivative=measurement controller.setpoints=generator \
     controller.velocity_ff_s=0.05",
];

const DUAL: [&str; 1] = ["controller.feedback=dual"];

/// With friction the carriage stops somewhere in the gap, 45 µm from where it
/// should; the scale at the carriage sees it: 0.2 µm, below its own count of
/// 1 µm, while the motor stands half a gap away.
#[test]
fn the_scale_at_the_carriage_sees_the_gap() {
    let motor = Ran::of("paper-2", &[&FRICTION, &SCALE]);
    let dual = Ran::of("paper-2", &[&FRICTION, &SCALE, &DUAL]);
    for (name, ran) in [("motor", &motor), ("dual", &dual)] {
        let summary = ran.summary();
        println!(
            "{name}: carriage {:.2} µm, motor {:.2} µm, peak {:.2} m/s²",
            summary.final_error_um, summary.final_motor_error_um, summary.peak_abs_acc_mps2
        );
    }
    let [of_motor, of_dual] = [&motor, &dual].map(|ran| ran.summary().final_error_um.abs());
    assert!(of_dual <= 1.0, "within a count of the scale");
    assert!(of_motor > 40.0 * of_dual);
    // p·b = 41.7 µm.
    let half_gap_um = 5e3 / 360.0 * 3.0;
    let motor_um = dual.summary().final_motor_error_um;
    assert!((motor_um - half_gap_um).abs() < 1.0, "{motor_um}");
    assert!(motor.summary().final_motor_error_um.abs() < 5.0);
}

/// The same from an encoder on the screw; the finer it is, the nearer.
#[test]
fn an_encoder_on_the_screw_does_too() {
    let error_um = |counts: f64| {
        let load = format!("load_encoder.counts_per_rad={counts}");
        let ran = Ran::of("paper-2", &[&FRICTION, &SCALE[1..], &DUAL, &[&load]]);
        ran.summary().final_error_um.abs()
    };
    // A count is p/K: 0.5 and 5 µm.
    let pitch_um = 5_000.0 / (2.0 * std::f64::consts::PI);
    for counts in [1_600.0, 160.0] {
        let error_um = error_um(counts);
        println!("{counts} counts/rad: {error_um:.2} µm");
        assert!(error_um <= pitch_um / counts);
    }
}

/// The contrast: with the derivative of the load as well (the joint's gap
/// inside every term) there would be no damping in the gap. Here the motor's
/// encoder damps: without its derivative the loop swings.
#[test]
fn the_motors_encoder_damps() {
    let none = ["controller.kd_s=0"];
    let undamped = Ran::of("paper-2", &[&FRICTION, &SCALE, &DUAL, &none]);
    let damped = Ran::of("paper-2", &[&FRICTION, &SCALE, &DUAL]);
    let [without, with] = [&undamped, &damped].map(|ran| ran.summary().peak_abs_acc_mps2);
    println!("peak acceleration {without:.1} m/s² without Kd, {with:.1} with");
    assert!(without > 2.0 * with);
}
