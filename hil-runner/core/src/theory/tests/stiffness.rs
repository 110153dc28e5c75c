//! Dynamic stiffness against a simulated force, and its least value.

use std::f64::consts::{PI, TAU};

use super::super::Loops;
use super::super::characteristic::LoopGains;
use super::super::family::{LoopFamily, Room};
use super::super::linear_axis::JointState;
use super::super::stiffness::Compliance;
use super::loops::DUAL;
use super::matrices::{Loop, settling};
use super::{Draw, case};
use plant::Joint;

fn family_of(case: &Loop) -> LoopFamily {
    LoopFamily::of_axis(&case.linear(), case.period_s, case.delay_s)
}

/// `F/x` against the fundamental of the simulated steady state; without the hold's half
/// sample, or the filter, it is another.
#[test]
fn stiffness_is_that_of_a_simulated_force() {
    const FINE: u32 = 64;
    const MOST: f64 = 1e-5;
    let mut draw = Draw::new(31);
    let (mut worst, mut loops) = (0.0_f64, 0);
    // Loops with a filter, and of these those that are another without it; likewise of all
    // with another delay.
    let (mut filtered, mut without, mut late) = (0, 0, 0);
    for trial in 0..1500 {
        let period_s = draw.decades(1e-4, 1e-2);
        let mut case = Loop::draw(&mut draw, trial, period_s);
        case.joint = JointState::Contact;
        // The simulation puts a code where it has a step.
        case.delay_s =
            (case.delay_s / period_s * f64::from(FINE)).round() * period_s / f64::from(FINE);
        let Some(radius) = case.radius().filter(|radius| *radius < 0.99) else {
            continue;
        };
        let samples = 7 + (draw.uniform() * 40.0) as u32;
        let turns = 1 + (draw.uniform() * f64::from(samples / 2 - 1)) as u32;
        let theta = TAU * f64::from(turns) / f64::from(samples);
        let measured = case.measured_stiffness(turns, samples, settling(radius), FINE);
        let family = family_of(&case);
        let off = |gains: &LoopGains, theta: f64| {
            let found = Compliance::at(&family, gains, theta).inv();
            ((found - measured) / measured).norm_sqr().sqrt()
        };
        worst = worst.max(off(&case.gains, theta));
        loops += 1;
        if case.gains.smoothing < 1.0 && case.gains.kd_vs_per_rad > 0.0 {
            let mut gains = case.gains;
            gains.smoothing = 1.0;
            filtered += 1;
            without += u32::from(off(&gains, theta) > 100.0 * MOST);
        }
        let mut other = case;
        other.delay_s = if case.delay_s > 0.0 { 0.0 } else { period_s };
        let found = Compliance::at(&family_of(&other), &case.gains, theta).inv();
        let off = ((found - measured) / measured).norm_sqr().sqrt();
        late += u32::from(off > 100.0 * MOST);
    }
    println!(
        "{loops} loops within {worst:.1e}; others without the filter {without} of {filtered}, \
         with another delay {late}"
    );
    assert!(loops > 5, "{loops}");
    assert!(worst < MOST, "{worst}");
    assert!(2 * without > filtered && 2 * late > loops);
}

/// The least stiffness is that of no place among 4000 that is lower by more than 0.2 %.
#[test]
fn least_stiffness_agrees_with_brute_force() {
    let mut draw = Draw::new(32);
    let (mut loops, mut missed, mut above) = (0, 0.0_f64, 0.0_f64);
    for trial in 0..400 {
        let period_s = draw.decades(1e-5, 1e-2);
        let mut case = Loop::draw(&mut draw, trial, period_s);
        case.joint = JointState::Contact;
        let family = family_of(&case);
        if !family.is_stable(&case.gains) {
            continue;
        }
        let room = &mut Room::default();
        let least = Compliance::new(&family).least_n_per_um(&family, room, &[case.gains])[0];
        let size = |theta: f64| {
            let x = Compliance::at(&family, &case.gains, theta);
            1e-6 / x.norm_sqr().sqrt()
        };
        let n = 4000;
        let angle = |k: i32| PI * libm::pow(1e-6, 1.0 - f64::from(k) / f64::from(n));
        let lowest = (0..=n)
            .map(|k| size(angle(k)))
            .fold(f64::INFINITY, f64::min);
        missed = missed.max(least / lowest - 1.0);
        above = above.max(lowest / least - 1.0);
        loops += 1;
    }
    println!("{loops} loops: at most {missed:.1e} above the lowest found, {above:.1e} below");
    assert!(loops > 150, "{loops}");
    assert!(missed < 2e-3, "{missed}");
}

/// Without K_i the least stiffness of a soft loop is its static one: the position loop's in
/// series with the joint's; from the load's encoder the loop's alone.
#[test]
fn without_an_integrator_there_is_a_static_stiffness() {
    for (sets, dual) in [(&[][..], false), (&DUAL[..], true)] {
        let soft = [
            "controller.ki_per_s=0",
            "controller.kp=0.5",
            "controller.kd_s=0.05",
        ];
        let case = case("paper-2", &[sets, &soft].concat());
        let (motor, transmission) = (&case.axis.motor, &case.axis.transmission);
        let Joint::Elastic(joint) = transmission.joint else {
            panic!();
        };
        let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
        // Torque on the gear per radian of it.
        let kp = LoopGains::of(&case).kp_v_per_rad / z;
        let held = motor.torque_constant_nm_per_a / z / motor.resistance_ohm * kp;
        let series = if dual {
            0.0
        } else {
            1.0 / joint.stiffness_nm_per_rad
        };
        let wanted = 1e-6 / (p * p * (1.0 / held + series));
        let family = LoopFamily::of(&case, JointState::Contact).unwrap();
        let gains = LoopGains::of(&case);
        let at_rest = Compliance::at(&family, &gains, 1e-6);
        let off = 1e-6 / at_rest.norm_sqr().sqrt() / wanted - 1.0;
        let least = Loops::default().figures(&case).least_stiffness_n_per_um;
        println!("{wanted} N/µm, least {least:?}, off by {off:.1e}");
        assert!(off.abs() < 1e-6, "{off}");
        assert!(least.unwrap() < wanted * (1.0 + 1e-7));
    }
}
