//! Meaning of a margin, and the loops that have none.

use std::f64::consts::PI;

use nalgebra::Complex;
use plant::{Amplifier, AxisParameters, Control, Joint};

use super::super::characteristic::LoopGains;
use super::super::family::{FamilyKey, LoopFamily};
use super::super::linear_axis::{JointState, LinearAxis};
use super::super::loops::{JOINT_STATES, margin};
use super::case;
use crate::case::{Case, ComputationDelay};
use crate::number::seconds;
use crate::options::Feedback;

/// Gains so small that the loop crosses over below the grid.
#[test]
fn a_slow_loop_is_read_below_the_grid() {
    let case = case("paper-2", &[]);
    let family = LoopFamily::of(&case, JointState::Contact).unwrap();
    let gains = LoopGains {
        kp_v_per_rad: 1e-3,
        ki_v_per_rads: 0.0,
        kd_vs_per_rad: 0.0,
        smoothing: 1.0,
    };
    let margin = family.margin(&gains);
    // Far below the run-up L = K/(k_m·s).
    let crossover = 1e-3 / 0.25;
    assert!((margin.crossover_radps.unwrap() / crossover - 1.0).abs() < 1e-6);
    assert!((margin.phase_rad.unwrap() - PI / 2.0).abs() < 1e-3);
    assert!(margin.stable && margin.modulus > 0.99 && margin.modulus <= 1.0);
}

/// The margin alone is that of the whole look, to the last bit.
#[test]
fn the_modulus_alone_is_the_same() {
    let case = case("paper-2", &[]);
    let mut unstable = 0;
    for joint in [JointState::Contact, JointState::Gap] {
        let family = LoopFamily::of(&case, joint).unwrap();
        for step in 0..200 {
            let size = 1.05_f64.powi(step - 60);
            let gains = LoopGains::of(&case).times(size);
            let whole = family.margin(&gains);
            assert_eq!(family.signed_modulus(&gains), whole.signed(), "{size}");
            unstable += u32::from(!whole.stable);
        }
    }
    assert!((10..390).contains(&unstable), "{unstable}");
}

/// Without K_p and K_i nothing holds the axis; without K_i an idle integrator
/// does not count against it.
#[test]
fn a_loop_without_position_is_not_stable() {
    let case = case("paper-2", &[]);
    let family = LoopFamily::of(&case, JointState::Contact).unwrap();
    let gains = |kp, ki, kd| LoopGains {
        kp_v_per_rad: kp,
        ki_v_per_rads: ki,
        kd_vs_per_rad: kd,
        smoothing: 1.0,
    };
    assert!(!family.is_stable(&gains(0.0, 0.0, 0.5)));
    assert!(!family.is_stable(&gains(0.0, 0.0, 0.0)));
    assert!(family.is_stable(&gains(30.0, 0.0, 0.5)));
    assert!(!family.is_stable(&gains(0.0, 30.0, 0.5)));
}

/// Gain and phase margin bring the loop to the border.
#[test]
fn gain_and_phase_margin_lead_to_the_border() {
    for sets in [
        &[][..],
        &["controller.sample_time_s=0.004"],
        &["controller.kp=8", "controller.ki_per_s=100"],
    ] {
        let case = case("paper-2", sets);
        let family = LoopFamily::of(&case, JointState::Contact).unwrap();
        let gains = LoopGains::of(&case);
        let margin = family.margin(&gains);
        println!("{sets:?}: {margin:.3?}");
        let factor = margin.gain.unwrap();
        assert!(family.is_stable(&gains.times(0.9999 * factor)));
        assert!(!family.is_stable(&gains.times(1.0001 * factor)));
        let theta =
            margin.crossover_radps.unwrap() * seconds(case.controller.sample_time_ns.unwrap());
        let l = family.at(&gains, theta);
        assert!((l.norm_sqr() - 1.0).abs() < 1e-6);
        let lag = margin.phase_rad.unwrap();
        let turned = l * Complex::new(lag.cos(), -lag.sin());
        assert!((turned + 1.0).norm_sqr().sqrt() < 1e-6, "{turned}");
        // |1 + L| on the unit circle is 2·sin(φ/2), no less than the modulus.
        assert!(2.0 * (0.5 * lag).sin() >= margin.modulus);
    }
}

#[test]
fn what_cannot_be_has_no_family() {
    let has_family = |sets: &[&str], [period_ns, delay_ns]: [u64; 2], joint| {
        let mut case = case("paper-2", sets);
        case.controller.sample_time_ns = Some(period_ns);
        case.controller.computation_delay = ComputationDelay::Fixed(delay_ns);
        LoopFamily::of(&case, joint).is_some()
    };
    let (contact, gap) = (JointState::Contact, JointState::Gap);
    assert!(has_family(&[], [1000, 1000], gap));
    assert!(!has_family(&[], [0, 0], contact));
    assert!(!has_family(&[], [1000, 1001], contact));
    let rigid = &["transmission.joint=rigid"];
    assert!(has_family(rigid, [1000, 0], contact));
    assert!(!has_family(rigid, [1000, 0], gap));
}

/// Equal keys for equal families, and no other.
#[test]
fn keys_tell_families_apart() {
    let case = case("paper-2", &[]);
    let (contact, amplifier) = (JointState::Contact, case.amplifier);
    let of = |change: &dyn Fn(&mut Case), joint: JointState| {
        let mut case = case.clone();
        case.controller.sample_time_ns = Some(1000);
        change(&mut case);
        FamilyKey::of(&case, joint).unwrap()
    };
    let key = |axis: &AxisParameters| of(&|case| case.axis = *axis, contact);
    let ideal = Amplifier {
        control: Control::Current {
            current_limit_a: 1.0,
            bandwidth_radps: None,
        },
        ..amplifier
    };
    let mut axis = case.axis;
    if let Joint::Elastic(joint) = &mut axis.transmission.joint {
        joint.backlash_half_rad = 0.0;
    }
    axis.carriage.resistance.constant_n = 5.0;
    assert_eq!(key(&axis), key(&case.axis));
    // Two masses of one inertia, to the last bit, are one family.
    let family = |axis: &AxisParameters| {
        let axis = LinearAxis::new(axis, &amplifier, contact).unwrap();
        LoopFamily::of_axis(&axis, 1e-6, 0.0)
    };
    for change in [1e-15, 1e-12] {
        axis.carriage.mass_kg = case.axis.carriage.mass_kg * (1.0 + change);
        let same = key(&axis) == key(&case.axis);
        assert_eq!(same, family(&axis) == family(&case.axis), "{change}");
    }
    assert_ne!(key(&axis), key(&case.axis));
    let other = [
        of(&|case| case.controller.sample_time_ns = Some(1001), contact),
        of(
            &|case| case.controller.computation_delay = ComputationDelay::Fixed(1),
            contact,
        ),
        of(&|_| (), JointState::Gap),
        of(&|case| case.amplifier = ideal, contact),
        of(&|case| case.options.law.feedback = Feedback::Dual, contact),
    ];
    assert!(other.iter().all(|other| *other != key(&case.axis)));
}

/// A part of the axis that is fast beside a sample leaves the margins as they are, however fast it
/// is. The contrast: a slow one shows.
#[test]
fn what_is_fast_beside_a_sample_hardly_shows() {
    let of = |key: &str, value: f64, joint: JointState| {
        let set = format!("{key}={value:e}");
        let case = case("paper-2", &["controller.law=sampled", &set]);
        margin(&case, joint).unwrap().signed()
    };
    let contact = &JOINT_STATES[..1];
    for (key, slow, fast, joints) in [
        (
            "motor.inductance_h",
            6.5e-3,
            [1e-8, 1e-20],
            &JOINT_STATES[..],
        ),
        ("motor.inertia_kg_m2", 2e-4, [1e-8, 1e-12], contact),
        (
            "transmission.stiffness_nm_per_rad",
            350.0,
            [1e8, 1e12],
            contact,
        ),
        ("transmission.damping_nms_per_rad", 0.2, [1e4, 1e8], contact),
    ] {
        for &joint in joints {
            let [slow, fast, faster] = [slow, fast[0], fast[1]].map(|value| of(key, value, joint));
            println!("{key}, {joint:?}: {slow}, {fast}, {faster}");
            assert!((fast - faster).abs() < 1e-4, "{key}");
            assert!((slow - fast).abs() > 2e-4, "{key}");
        }
    }
}
