//! Cycles by the steps of encoder and converter against simulated ones. The
//! bounds are what the method is worth, not what the solver can do.

use super::super::{
    Cycle, CycleStability, JointState, dac_cycle, dac_cycles, encoder_cycle, encoder_cycles, margin,
};
use super::swing::{off, report, swing};
use super::{case, rows, scale};
use crate::case::Case;
use crate::runfile;

/// A loop of the rigid axis on rung `quantised` whose gain margin is `margin`,
/// with one of the two staircases; the other's steps are 30 times as fine.
fn on_the_edge(sets: &[&str], gain_margin: f64, coarse_encoder: bool) -> Case {
    let common = [
        "controller.law=quantised",
        "transmission.joint=rigid",
        "drive.voltage_limit_v=1e9",
        "drive.dac_bits=24",
        "run.duration_s=40",
    ];
    let mut case = case("paper-2", &[&common[..], sets].concat());
    let reserve = margin(&case, JointState::Contact).unwrap().gain.unwrap();
    let fine = 30.0;
    let mut factor = reserve / gain_margin;
    if coarse_encoder {
        factor *= fine;
        case.dac.step_v /= fine;
    } else {
        factor /= fine;
        case.encoder.counts_per_rad *= fine;
    }
    scale(&mut case.controller.gains, factor);
    case
}

const SLOW: [&[&str]; 5] = [
    &["controller.kd_s=0"],
    &["controller.kd_s=0", "controller.sample_time_s=0.0005"],
    &[
        "controller.kd_s=0.02",
        "controller.sample_time_s=0.0005",
        "controller.computation_delay_s=0.0005",
    ],
    &[
        "controller.kd_s=0.02",
        "controller.sample_time_s=0.00025",
        "controller.computation_delay_s=0.00025",
    ],
    &[],
];

/// A gain margin below 4/π: the axis cycles by a count or two. Between 4/π and
/// 1.1 there is one amplitude, below there are several, one a count, and the
/// axis stays on one of them, or on one more.
///
/// Measured: amplitude −3 to −16 %, period −10 to +1 %; at a gain margin of 1.05
/// two of five are a count off.
#[test]
fn steps_of_the_encoder() {
    for sets in SLOW {
        for gain_margin in [1.05, 1.15, 1.25] {
            let case = on_the_edge(sets, gain_margin, true);
            let predicted = encoder_cycle(&case).unwrap();
            let swing = swing(&case, 4.0, predicted.period_s);
            let attracting = encoder_cycles(&case)
                .into_iter()
                .filter(|cycle| cycle.stability == CycleStability::Attracting);
            let near = |cycle: &Cycle| off(swing.motor_um, cycle.motor_amplitude_um).abs();
            let cycle = attracting
                .min_by(|a, b| near(a).total_cmp(&near(b)))
                .unwrap();
            if gain_margin > 1.1 {
                assert_eq!(cycle, predicted);
            }
            let name = format!("{sets:?}, gain margin {gain_margin}");
            let [_, motor, period] = report(&name, &cycle, &swing);
            assert!(period.abs() < 0.12, "{name}");
            if gain_margin > 1.1 {
                assert!(motor.abs() < 0.2, "{name}");
            } else {
                let count_um = 1e6 * case.axis.transmission.screw_pitch_m_per_rad * 2.0 / 636.0;
                let off_um = cycle.motor_amplitude_um - swing.motor_um;
                assert!(off_um.abs() < count_um, "{name}");
            }
        }
    }
}

/// The contrast: a gain margin above 4/π has no predicted cycle, and from 1.8 on
/// the axis without K_d rests. With K_d it need not: the jump of one count is a
/// pulse of K_d/Δt codes, no sine, and it can keep the axis going by about half
/// a count, here up to a gain margin between 1.8 and 5.
#[test]
fn a_gain_margin_above_4_over_pi_has_no_cycle() {
    let edge = 4.0 / std::f64::consts::PI;
    for sets in SLOW {
        assert_eq!(encoder_cycles(&on_the_edge(sets, 1.01 * edge, true)), []);
        assert!(encoder_cycle(&on_the_edge(sets, 0.99 * edge, true)).is_some());
        let motor_um = [1.3, 1.8, 3.0, 5.0, 10.0].map(|gain_margin| {
            let calm = on_the_edge(sets, gain_margin, true);
            swing(&calm, 4.0, 0.1).motor_um
        });
        println!("{sets:?}: motor {motor_um:.3?} µm at gain margins 1.3, 1.8, 3, 5, 10");
        let derivative = on_the_edge(sets, 2.0, true).controller.gains.kd_s > 0.0;
        assert_eq!(motor_um[1] > 0.5, derivative);
        assert!(motor_um[4] < 1e-3);
    }
}

/// A weight between two codes: the converter is a relay.
///
/// Measured: amplitude −13 to +15 %, period −16 to +11 %.
#[test]
fn steps_of_the_converter_under_a_weight() {
    let file = include_str!("../../../../../tests/cases/limit-cycle.toml");
    let cases: [&[&str]; 6] = [
        &["carriage.resistance_constant_n=306"],
        &["carriage.resistance_constant_n=302"],
        &["carriage.resistance_constant_n=300"],
        &[
            "carriage.resistance_constant_n=306",
            "controller.sample_time_s=0.002",
        ],
        &[
            "carriage.resistance_constant_n=306",
            "controller.sample_time_s=0.004",
        ],
        &[
            "carriage.resistance_constant_n=306",
            "controller.kd_s=0.0005",
        ],
    ];
    for sets in cases {
        let sets: Vec<String> = ["controller.law=quantised", "run.duration_s=30"]
            .iter()
            .chain(sets)
            .map(|&set| set.to_owned())
            .collect();
        let mut case = runfile::parse("limit-cycle.toml", file, &sets).unwrap();
        let fine = 1000.0;
        case.encoder.counts_per_rad *= fine;
        scale(&mut case.controller.gains, 1.0 / fine);
        let cycle = dac_cycle(&case).unwrap();
        let swing = swing(&case, 6.0, cycle.period_s);
        let [carriage, motor, period] = report(&format!("{:?}", &sets[2..]), &cycle, &swing);
        assert!(carriage.abs() < 0.25 && motor.abs() < 0.25 && period.abs() < 0.2);

        if sets.len() == 3 {
            // Both staircases at once are beyond it: with the case's own encoder
            // the axis swings by counts, not by fractions of a micrometre.
            let coarse = runfile::parse("limit-cycle.toml", file, &sets).unwrap();
            let amplitude_um = dac_cycle(&coarse).unwrap().amplitude_um;
            // But for rounding: the gains per count are a thousandth.
            assert!((amplitude_um / cycle.amplitude_um - 1.0).abs() < 1e-12);
            let rows = rows(&coarse);
            let tail = rows.iter().filter(|row| row.t_s > 24.0);
            let x_um = tail.map(|row| 1e6 * pitch_m_per_rad(&coarse) * row.gamma_rad);
            let (low, high) = x_um.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
            println!(
                "  with an encoder of 636 counts/rad: {:.2} µm",
                0.5 * (high - low)
            );
            assert!(0.5 * (high - low) > 10.0 * cycle.amplitude_um);
        }

        // The contrast: a weight of whole codes has no relay. p·a0·z/k_m·R of
        // 12 codes.
        let transmission = &case.axis.transmission;
        let newton_per_code = case.dac.step_v * case.amplifier.gain / 1.5 * 0.25
            / (transmission.screw_pitch_m_per_rad * transmission.gear_ratio);
        case.axis.carriage.resistance.constant_n = 12.0 * newton_per_code;
        assert!(dac_cycles(&case).is_empty(), "{:?}", dac_cycles(&case));
    }
}

fn pitch_m_per_rad(case: &Case) -> f64 {
    case.axis.transmission.screw_pitch_m_per_rad
}

/// Without a weight and with a gap the motor cycles alone, within the gap.
#[test]
fn a_motor_in_its_gap_leaves_the_carriage_alone() {
    let sets = ["controller.law=quantised"];
    let case = case("paper-2", &sets);
    let open = margin(&case, JointState::Gap).unwrap();
    let factor = open.gain.unwrap() / 1.2;
    let mut edge = case.clone();
    scale(&mut edge.controller.gains, factor);
    let all = encoder_cycles(&edge);
    println!("{all:?}");
    assert!(!all.is_empty());
    assert!(all.iter().all(|cycle| cycle.amplitude_um == 0.0));
    assert!(all.iter().all(|cycle| cycle.motor_amplitude_um > 0.0));
    // A gap of a count leaves no room.
    edge.axis.transmission.joint = match edge.axis.transmission.joint {
        plant::Joint::Elastic(joint) => plant::Joint::Elastic(plant::ElasticJoint {
            backlash_half_rad: 0.2 * 2.0 / edge.encoder.counts_per_rad,
            ..joint
        }),
        plant::Joint::Rigid => plant::Joint::Rigid,
    };
    assert!(encoder_cycles(&edge).is_empty());
}

/// Steps are needed, and an axis that does not stick.
#[test]
fn no_cycle_where_the_theory_does_not_apply() {
    let mut edge = on_the_edge(&[], 1.2, true);
    assert!(encoder_cycle(&edge).is_some());
    edge.controller.law = crate::case::Law::Sampled;
    assert!(encoder_cycle(&edge).is_none() && dac_cycle(&edge).is_none());
    edge.controller.law = crate::case::Law::Quantised;
    edge.axis.carriage.resistance.constant_n = 10.0;
    edge.axis.carriage.resistance.opposes_motion = true;
    assert!(encoder_cycle(&edge).is_none() && dac_cycle(&edge).is_none());
}
