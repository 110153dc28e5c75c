//! The border of stability against the simulated axis.

use super::super::characteristic::LoopGains;
use super::super::family::LoopFamily;
use super::super::linear_axis::JointState;
use super::matrices::Loop;
use super::{case, rows, scale};
use crate::number::seconds;

/// Growth of the closed loop's slowest mode in a sample, from the screw's
/// distance to its command long after the motion.
fn growth_per_sample(case: &crate::case::Case) -> f64 {
    let rows = rows(case);
    let pitch = case.axis.transmission.screw_pitch_m_per_rad;
    let error = |row: &crate::trace::Row| row.x_ref_m / pitch - row.gamma_rad;
    // Two windows of 400 samples, 800 apart; the motion is over in both.
    let size = |from: usize| -> f64 {
        let window = &rows[from..from + 400];
        window.iter().map(|row| error(row) * error(row)).sum()
    };
    let from = rows.len() - 1201;
    (size(from + 800) / size(from)).powf(0.5 / 800.0)
}

/// A gain 2 % inside the border decays, 2 % outside it grows, each at the rate
/// of the largest pole: on rung `sampled` without gap and limit.
#[test]
fn two_per_cent_beside_the_border() {
    let cases: [&[&str]; 4] = [
        &["controller.sample_time_s=0.004"],
        &[
            "controller.sample_time_s=0.001",
            "controller.computation_delay_s=0.001",
        ],
        &[
            "controller.sample_time_s=0.002",
            "controller.computation_delay_s=0.0005",
        ],
        &["controller.sample_time_s=0.002", "transmission.joint=rigid"],
    ];
    for sets in cases {
        let common = [
            "controller.law=sampled",
            "transmission.backlash_half_deg=0",
            "drive.voltage_limit_v=1e12",
            "motion.total_time_s=0.1",
            "run.duration_s=8",
            "run.events=false",
        ];
        let mut case = case("paper-2", &[&common[..], sets].concat());
        let family = LoopFamily::of(&case, JointState::Contact).unwrap();
        let gains = LoopGains::of(&case);
        let border = family.margin(&gains).gain.unwrap();
        let written = case.controller.gains;
        let mut linear = Loop {
            axis: case.axis,
            amplifier: case.amplifier,
            joint: JointState::Contact,
            dual: false,
            gains,
            period_s: seconds(case.controller.sample_time_ns.unwrap()),
            delay_s: seconds(case.controller.computation_delay.fixed_ns().unwrap()),
        };
        for factor in [0.98 * border, 1.02 * border] {
            case.controller.gains = written;
            scale(&mut case.controller.gains, factor);
            linear.gains = gains.times(factor);
            let predicted = linear.radius().unwrap();
            let measured = growth_per_sample(&case);
            println!(
                "{sets:?}: {:.2} of the border, pole {predicted:.6}, simulated {measured:.6}",
                factor / border
            );
            assert_eq!(measured < 1.0, factor < border);
            assert!((measured - predicted).abs() < 0.02 * (predicted - 1.0).abs());
        }
    }
}
