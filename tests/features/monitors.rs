//! The monitors that judge the control itself: following error and saturation.

use super::Ran;

/// The paper's move needs 1356 counts, most of them speed. A limit that does
/// not know the speed must allow them everywhere; one that does may be tight
/// where the axis is slow.
#[test]
fn following_error_static_and_with_the_speed() {
    let limit = |counts: u32| {
        let set = format!("limits.following_error_counts={counts}");
        Ran::of("paper-2", &[&[&set]])
    };
    // On the limit is not beyond it.
    let passes = limit(1_356);
    assert_eq!(passes.axis().fault, None);
    assert_eq!(passes.axis().peak_error_counts, 1_356);
    let trips = limit(1_355);
    let fault = trips.fault();
    println!("{}", fault.message);
    let told = (fault.cause, fault.measured, fault.limit);
    assert_eq!(told, ("following-error", 1_356, 1_355));
    assert_eq!(trips.rows[fault.tick as usize].motor_voltage_v, 0.0);

    // Without an integral the error is the speed's, 0.0084 s of it, and the
    // acceleration's: 1806 counts at most, but 284 beyond 0.009 s of speed.
    let lag = ["controller.ki_per_s=0"];
    // An encoder that stands still from `at` on is an axis that is stuck.
    let found_after_s = |sets: &[&str], at: &str| {
        let freeze = format!("inject.encoder_freeze_s={at}");
        let ran = Ran::of("paper-2", &[&lag, sets, &[&freeze]]);
        let from_s: f64 = at.parse().unwrap();
        Some(ran.axis().fault.as_ref()?.t_s - from_s)
    };
    let fixed = ["limits.following_error_counts=1950"];
    let scaled = ["limits.following_error_counts=300 limits.following_error_per_speed_s=0.009"];
    for sets in [&fixed[..], &scaled] {
        let ran = Ran::of("paper-2", &[&lag, sets]);
        assert_eq!(ran.axis().fault, None, "{sets:?}");
    }
    for at in ["0.05", "0.8", "0.85", "0.9"] {
        let [fixed_s, scaled_s] = [&fixed[..], &scaled].map(|sets| found_after_s(sets, at));
        println!("stuck at {at} s: found after {fixed_s:.3?} s, with the speed {scaled_s:.3?} s");
        let within_s = fixed_s.map_or(f64::INFINITY, |fixed_s| 0.5 * fixed_s);
        assert!(scaled_s.unwrap() < within_s);
    }
}

/// The honest converter stands at its limit from sample 139 on; 50 samples are
/// allowed. Without the watch the axis does so for two seconds.
#[test]
fn saturation_for_too_long() {
    let ran = Ran::of("paper-2-12bit", &[&["limits.saturation_s=0.05"]]);
    let fault = ran.fault();
    println!("{}", fault.message);
    let told = (fault.cause, fault.measured, fault.limit);
    assert_eq!(told, ("saturation-too-long", 51, 50));
    let tick = fault.tick as usize;
    let codes = ran.codes();
    assert!(codes[tick - 50..tick].iter().all(|code| *code == 2_047.0));
    assert_ne!(codes[tick - 51], 2_047.0);
    assert_eq!((codes[tick], ran.rows[tick].motor_voltage_v), (0.0, 0.0));
    let without = Ran::of("paper-2-12bit", &[&["limits.saturation_s=10"]]);
    assert_eq!(without.axis().fault, None);
    let [with_s, without_s] = [&ran, &without].map(|ran| ran.summary().voltage_saturated_s);
    println!("at the limit for {with_s:.3} s, without the watch {without_s:.3} s");
    assert!(with_s < 0.051 && without_s > 0.5);
    // 14 bits never get there.
    let wide = Ran::of("paper-2", &[&["limits.saturation_s=0.001"]]);
    assert_eq!(wide.axis().fault, None);
}
