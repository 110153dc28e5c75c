//! The axis at rest: dead band and held integral.

use super::{FRICTION, Ran, largest};

/// Friction holds the load: the error at the end \[counts\], and the last
/// change of the code after the motion's end \[s\].
fn at_rest(set: &str) -> (f64, f64) {
    let ran = Ran::of("paper-2", &[&FRICTION, &[set]]);
    let codes = ran.codes();
    let last = (1..codes.len()).rev().find(|&k| codes[k] != codes[k - 1]);
    let error = ran.samples().last().unwrap().error_counts;
    (error, ran.rows[last.unwrap()].t_s - ran.case.motion.end_s())
}

/// Without a band the integrator works until the error is 0; with one it stops
/// within it, and earlier the wider the band is. Held at rest, it leaves the
/// axis where the motion's end did, 60 counts away, and the code is still
/// first.
#[test]
fn a_dead_band_ends_the_work_of_the_integrator_earlier() {
    let [none, narrow, wide, held] = [
        "controller.rest_dead_band_counts=0",
        "controller.rest_dead_band_counts=2",
        "controller.rest_dead_band_counts=8",
        "controller.rest_integrator=hold",
    ]
    .map(at_rest);
    println!("error and quiet from: {none:?}, band 2 {narrow:?}, 8 {wide:?}, held {held:?}");
    assert_eq!(none.0, 0.0);
    assert!(narrow.0.abs() <= 2.0 && narrow.0 != 0.0);
    assert!(wide.0.abs() <= 8.0 && wide.0.abs() > 2.0);
    assert!(held.0.abs() > 30.0);
    assert!(held.1 < wide.1 && wide.1 < narrow.1 && narrow.1 < none.1);
}

/// The contrast: a weight rests on nothing, and the band is only room to swing.
#[test]
fn a_dead_band_under_a_weight_makes_the_swing_wider() {
    let file = format!("{}/cases/limit-cycle.toml", env!("CARGO_MANIFEST_DIR"));
    let [none, band] = [0, 3].map(|counts| {
        let band = format!("controller.rest_dead_band_counts={counts}");
        let ran = Ran::of(&file, &[&[&band]]);
        let errors: Vec<f64> = ran.samples().iter().map(|s| s.error_counts).collect();
        largest(&errors[4_000..])
    });
    println!("|e| up to {none} counts, with a band of 3 counts up to {band}");
    assert!(band > none + 3.0);
}

/// The band is for rest: in motion it changes nothing.
#[test]
fn in_motion_there_is_no_dead_band() {
    let [none, band] = ["0", "300"].map(|counts| {
        let band = format!("controller.rest_dead_band_counts={counts}");
        Ran::of("paper-2", &[&["limits.missed_ticks=true", &band]]).rows
    });
    assert_eq!(none[..1_000], band[..1_000]);
    assert_ne!(none, band);
}
