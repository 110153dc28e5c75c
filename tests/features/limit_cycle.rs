//! A vertical axis at rest behind a converter of 8 bits
//! (`cases/limit-cycle.toml`).

use super::{Ran, peak_to_peak};

/// The carriage's swing over the last 2 s \[µm\].
fn swing_um(quantiser: &str, more: &[&str]) -> f64 {
    let file = format!("{}/cases/limit-cycle.toml", env!("CARGO_MANIFEST_DIR"));
    let quantiser = format!("controller.quantiser={quantiser}");
    let ran = Ran::of(&file, &[&[&quantiser], more]);
    let at_rest = ran.rows.iter().position(|row| row.t_s >= 4.0).unwrap();
    peak_to_peak(&ran.carriage_um()[at_rest..])
}

/// With the nearest code the P term must carry the code from one half to the
/// next, 1/Kp = 5 counts of 2.5 µm: 12.5 µm. With error feedback the mean of
/// the codes is right and the carriage moves by less than one count of its
/// encoder. Dither is right in the mean too, and shakes the axis meanwhile.
///
/// Measured: nearest 12.48, error feedback 0.30, dither 8.82 µm.
#[test]
fn error_feedback_ends_the_limit_cycle() {
    let [nearest, feedback, dither] =
        ["nearest", "error-feedback", "dither"].map(|quantiser| swing_um(quantiser, &[]));
    println!(
        "swing: nearest {nearest:.2} µm, error feedback {feedback:.2} µm, dither {dither:.2} µm"
    );
    let count_um = 2.5;
    assert!((nearest - 5.0 * count_um).abs() < 0.5 * count_um);
    assert!(feedback < 0.5 * count_um);
    assert!(nearest > 20.0 * feedback);
    assert!(dither < nearest && dither > feedback);
}

/// The contrast: a weight that is worth exactly 12 codes needs no other code,
/// and the nearest one is as good as any. Measured: 0.59 µm.
#[test]
fn a_weight_of_whole_codes_makes_no_cycle() {
    let swing_um = swing_um("nearest", &["carriage.resistance_constant_n=294.6"]);
    println!("swing with 12 codes: {swing_um:.2} µm");
    assert!(swing_um < 2.5);
}
