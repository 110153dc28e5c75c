//! Hold and delay to first order against the sampled loop.

use super::super::delay::DelayedLoop;
use super::super::delay::margin_by_delay;
use super::super::linear_axis::{JointState, LinearAxis};
use super::super::margin;
use super::super::{LoopFamily, LoopGains};
use super::{Draw, case};
use crate::case::ComputationDelay;

/// The difference between the pure delay and the sampled loop is of second
/// order: halving Δt quarters it. The contrast: without the delay it is of
/// first order, and halves.
#[test]
fn halving_the_sample_time_quarters_the_difference() {
    let sets = [
        &["controller.ki_per_s=0"][..],
        &["controller.kd_s=0", "controller.kp=1"],
        &["controller.ki_per_s=60", "controller.kp=5"],
        &["transmission.joint=rigid"],
    ];
    for sets in sets {
        for delay_share in [0.0, 0.5, 1.0] {
            let differences: Vec<[f64; 2]> = [250_000, 125_000, 62_500]
                .map(|period_ns| {
                    let mut case = case("paper-2", &[sets, &["controller.law=sampled"]].concat());
                    case.controller.sample_time_ns = Some(period_ns);
                    let delay_ns = (delay_share * period_ns as f64) as u64;
                    case.controller.computation_delay = ComputationDelay::Fixed(delay_ns);
                    let sampled = margin(&case, JointState::Contact).unwrap().modulus;
                    let delayed = margin_by_delay(&case).unwrap().modulus;
                    let axis =
                        LinearAxis::new(&case.axis, &case.amplifier, JointState::Contact).unwrap();
                    let continuous = DelayedLoop {
                        axis,
                        gains: LoopGains::of(&case),
                        period_s: 0.0,
                        delay_s: 0.0,
                    };
                    [delayed - sampled, continuous.margin().modulus - sampled]
                })
                .to_vec();
            println!("{sets:?}, delay {delay_share}: {differences:?}");
            for pair in differences.windows(2) {
                let ratio = pair[0][0] / pair[1][0];
                assert!((3.8..4.2).contains(&ratio), "{ratio}");
                let without = pair[0][1] / pair[1][1];
                assert!((1.8..2.2).contains(&without), "{without}");
            }
        }
    }
}

/// Error of the first order on the paper's axis: modulus and phase margin
/// to 1 % up to a sample time of 1/40 of the crossover's period, the gain margin,
/// which lies near the middle of the spectrum, not at all.
#[test]
fn the_papers_axis_at_longer_sample_times() {
    for period_ms in [1.0, 2.0, 4.0, 8.0, 16.0] {
        let sample_time = format!("controller.sample_time_s={}", 1e-3 * period_ms);
        let case = case("paper-2", &["controller.law=sampled", &sample_time]);
        let sampled = margin(&case, JointState::Contact).unwrap();
        let delayed = margin_by_delay(&case).unwrap();
        let open = margin(&case, JointState::Gap).unwrap();
        println!(
            "{period_ms} ms: {sampled:.4?}\n  by delay {delayed:.4?}\n  in the gap {:.3}",
            open.signed()
        );
        let off = delayed.modulus / sampled.modulus - 1.0;
        if period_ms <= 4.0 {
            assert!(off.abs() < 0.01, "{off}");
        }
        if period_ms <= 1.0 {
            let gain_off = delayed.gain.unwrap() / sampled.gain.unwrap() - 1.0;
            assert!(gain_off.abs() > 0.1);
        }
    }
}

/// Nyquist's count for the loop with a delay against Routh's for the sampled one,
/// at 1 µs, where the two are the same loop.
#[test]
fn nyquist_agrees_with_a_very_short_sample_time() {
    let mut draw = Draw::new(5);
    let (mut counts, mut worst, mut left_out) = ([0; 2], 0.0_f64, 0);
    for trial in 0..2000 {
        let axis = draw.axis();
        let amplifier = draw.amplifier(trial % 3);
        let gains = draw.gains();
        let linear = LinearAxis::new(&axis, &amplifier, JointState::Contact).unwrap();
        let continuous = DelayedLoop {
            axis: linear,
            gains,
            period_s: 1e-6,
            delay_s: 0.0,
        };
        let continuous = continuous.margin();
        let sampled = LoopFamily::of_axis(&linear, 1e-6, 0.0).margin(&gains);
        counts[usize::from(continuous.stable)] += 1;
        let near = sampled.modulus < 0.01;
        assert!(
            near || continuous.stable == sampled.stable,
            "{continuous:?} {sampled:?}"
        );
        let off = (continuous.modulus - sampled.modulus).abs();
        // A current drive's loop may be weakest where even this sample time is long, or at
        // the needle of a joint that nothing damps.
        let undamped = axis
            .transmission
            .joint
            .elastic()
            .unwrap()
            .damping_nms_per_rad
            == 0.0;
        if trial % 3 != 0 && (sampled.weakest_radps > 1e5 || undamped) {
            left_out += 1;
            continue;
        }
        worst = worst.max(off);
        assert!(off < 0.01, "{continuous:?} {sampled:?}");
    }
    println!("unstable, stable: {counts:?}; modulus within {worst:.4}; {left_out} left out");
    assert!(
        counts.iter().all(|&n| n > 40) && left_out < 400,
        "{counts:?}, {left_out}"
    );
}

/// The field is the case's margin at its own gains, and changes its sign where
/// the loop becomes unstable, without a jump.
#[test]
fn the_field_crosses_zero_at_the_border() {
    let case = case("paper-2", &["controller.sample_time_s=0.004"]);
    let family = LoopFamily::of(&case, JointState::Contact).unwrap();
    let signed = |kp: f64, kd_s: f64| {
        let mut case = case.clone();
        (case.controller.gains.kp, case.controller.gains.kd_s) = (kp, kd_s);
        family.margin(&LoopGains::of(&case)).signed()
    };
    let at_home = margin(&case, JointState::Contact).unwrap().signed();
    assert_eq!(signed(3.2, 0.05), at_home);
    let mut signs = [0; 2];
    for column in 0..40 {
        let kp = 1.0 + f64::from(column);
        let values: Vec<f64> = (0..4000)
            .map(|row| signed(kp, 1e-3 * f64::from(row)))
            .collect();
        for pair in values.windows(2) {
            assert!((pair[0] - pair[1]).abs() < 0.02, "{kp} {pair:?}");
            signs[usize::from(pair[0] > 0.0)] += 1;
        }
    }
    assert!(signs.iter().all(|&n| n > 1000), "{signs:?}");
}

/// A loop that is not the paper's has no margin of this theory, but one of its own.
#[test]
fn another_law_has_no_margin_by_delay() {
    let cases: [(&[&str], bool); 6] = [
        (&[], true),
        (&["controller.derivative_filter_s=0.002"], false),
        (&["controller.rest_integrator=hold"], false),
        (&["controller.anti_windup=clamp"], true),
        (
            &[
                "controller.derivative_filter_s=0.002",
                "controller.law=quantised",
            ],
            true,
        ),
        (&["limits.saturation_s=0.1"], true),
    ];
    for (sets, has) in cases {
        let case = case("paper-2", sets);
        assert!(margin(&case, JointState::Contact).is_some(), "{sets:?}");
        assert_eq!(margin_by_delay(&case).is_some(), has, "{sets:?}");
    }
    let rigid = case("paper-2", &["transmission.joint=rigid"]);
    assert_eq!(margin(&rigid, JointState::Gap), None);
}
