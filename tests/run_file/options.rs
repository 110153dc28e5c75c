//! Keys of the run file for a controller beyond the paper's law.

use hil_runner::files;
use std::f64::consts::{PI, TAU};

use hil_core::options::{EncoderGlitch, EncoderLoss, FollowingErrorLimit};

use super::cases::load_reference;
use super::{BASE, parse};

#[test]
fn the_reference_cases_and_the_built_in_ones_have_the_papers_law() {
    for case in [
        load_reference("quantised-1"),
        load_reference("sampled-2"),
        files::case("paper-1", &[]).unwrap(),
        files::case("paper-2-12bit", &[]).unwrap(),
    ] {
        assert!(case.options.is_off(), "{}", case.name);
    }
}

/// Every section of the controller may be there and say nothing.
#[test]
fn empty_sections_turn_nothing_on() {
    let empty = "[load_encoder]\n[limits]\n[backlash]\n[sequence]\n[gain_change]\n[inject]\n";
    let case = parse(&format!("{BASE}{empty}"), &[]).unwrap();
    assert!(case.options.is_off());
}

#[test]
fn units_of_the_controllers_settings_are_converted() {
    let options = |sets: &[&str]| parse(BASE, sets).unwrap().options;
    let load = |set: &str| options(&[set]).encoders.load.unwrap().counts_per_rad;
    assert_eq!(load("load_encoder.counts_per_rad=1600"), 1600.0);
    // 5 mm a turn of the screw are 5000 counts a turn.
    let scale = load("load_encoder.counts_per_mm=1000");
    assert!((scale - 5000.0 / TAU).abs() < 1e-12 * scale, "{scale}");
    let backlash = options(&["backlash.half_gap_deg=3"]).backlash;
    assert_eq!(backlash.half_gap_rad, Some(3.0 * PI / 180.0));
    let requests = options(&[
        "sequence.emergency_stop_s=0.1",
        "sequence.emergency_stop_release_s=0.25",
    ])
    .requests;
    assert_eq!(requests.emergency_stop_ns, Some(100_000_000));
    assert_eq!(requests.emergency_stop_release_ns, Some(250_000_000));
    assert_eq!(requests.reset_ns, None);
    let change = options(&["gain_change.at_s=0.5", "gain_change.ki_per_s=0"]).gain_change;
    let change = change.unwrap();
    assert_eq!((change.at_ns, change.kp), (500_000_000, None));
    assert_eq!((change.ki_per_s, change.kd_s), (Some(0.0), None));
}

#[test]
fn what_belongs_together_is_one_setting() {
    let options = |sets: &[&str]| parse(BASE, sets).unwrap().options;
    let following_error = |sets: &[&str]| options(sets).limits.following_error;
    let counts = "limits.following_error_counts=500";
    assert_eq!(
        following_error(&[counts]),
        Some(FollowingErrorLimit {
            counts: 500,
            per_speed_s: 0.0
        })
    );
    assert_eq!(
        following_error(&[counts, "limits.following_error_per_speed_s=0.02"]),
        Some(FollowingErrorLimit {
            counts: 500,
            per_speed_s: 0.02
        })
    );
    let loss = options(&["limits.encoder_loss_s=0.05"]).limits.encoder_loss;
    let expected = EncoderLoss {
        after_ns: 50_000_000,
        codes: 100,
    };
    assert_eq!(loss, Some(expected));
    let glitch = options(&[
        "inject.encoder_glitch_s=0",
        "inject.encoder_glitch_counts=-1000000000",
    ]);
    let expected = EncoderGlitch {
        at_ns: 0,
        counts: -1_000_000_000,
    };
    assert_eq!(glitch.injections.encoder_glitch, Some(expected));
    assert!(options(&["limits.encoder_loss_codes=7"]).is_off());
    let seed = options(&["controller.dither_seed=4294967295"])
        .law
        .dither_seed;
    assert_eq!(seed, u32::MAX);
}
