//! A vertical axis at rest behind a converter of 8 bits
//! (`cases/limit-cycle.toml`).

use super::{Ran, peak_to_peak};

/// Windows in which the swing is taken: the last 2 s of the case, and longer \[s\].
const WINDOWS_S: [(f64, f64); 3] = [(4.0, 6.0), (6.0, 10.0), (10.0, 30.0)];

/// The carriage's swing in each of the windows \[µm\].
fn swings_um(quantiser: &str, more: &[&str]) -> [f64; 3] {
    let file = format!("{}/cases/limit-cycle.toml", env!("CARGO_MANIFEST_DIR"));
    let quantiser = format!("controller.quantiser={quantiser}");
    let ran = Ran::of(&file, &[&[&quantiser, "run.duration_s=30"], more]);
    let carriage_um = ran.carriage_um();
    WINDOWS_S.map(|(begin_s, end_s)| {
        let place = |t_s| ran.rows.partition_point(|row| row.t_s < t_s);
        peak_to_peak(&carriage_um[place(begin_s)..=place(end_s)])
    })
}

/// With the nearest code the P term must carry the code from one half to the
/// next, 1/Kp = 5 counts of 2.5 µm: 12.5 µm. With error feedback the mean of
/// the codes is right and the carriage creeps within one count of its encoder,
/// 0.15 µm a second, so that a short window sees a part of the count and a long
/// one all of it. Dither is right in the mean too, and shakes the axis meanwhile.
///
/// Measured from 4 to 6, 6 to 10, 10 to 30 s: nearest 12.71, 13.09, 12.73, error
/// feedback 0.31, 0.61, 2.50, dither 8.82, 7.62, 8.20 µm.
#[test]
fn error_feedback_ends_the_limit_cycle() {
    let [nearest, feedback, dither] =
        ["nearest", "error-feedback", "dither"].map(|quantiser| swings_um(quantiser, &[]));
    println!(
        "swing in µm from 4 to 6, 6 to 10, 10 to 30 s: nearest {nearest:.2?}, error feedback \
         {feedback:.2?}, dither {dither:.2?}"
    );
    let count_um = 2.5;
    for ((nearest, feedback), dither) in nearest.into_iter().zip(feedback).zip(dither) {
        assert!((nearest - 5.0 * count_um).abs() < 0.5 * count_um);
        assert!(feedback < 1.1 * count_um);
        assert!(dither < nearest && dither > feedback);
    }
    // The creep: no more than its part of the count before 10 s, all of it after.
    let [first, second, long] = feedback;
    assert!(nearest[0] > 20.0 * first && first < 0.2 * count_um);
    assert!((second / first - 2.0).abs() < 0.1);
    assert!(long > 0.9 * count_um);
}

/// The contrast: a weight that is worth exactly 12 codes needs no other code,
/// and the nearest one is as good as any. Measured: 0.59 µm.
#[test]
fn a_weight_of_whole_codes_makes_no_cycle() {
    let swings_um = swings_um("nearest", &["carriage.resistance_constant_n=294.6"]);
    println!("swing with 12 codes: {swings_um:.2?} µm");
    assert!(swings_um.iter().all(|swing_um| *swing_um < 2.6));
}
