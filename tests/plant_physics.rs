//! Laws of physics that the plant must keep whatever its parameters.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use bench_tests::paper_axis;
use plant::{AxisParameters, Drive, ElasticJoint, Joint, Plant, Resistance, Solver, State};
use proptest::prelude::*;

/// The paper's axis with another joint and resistance.
fn axis(joint: ElasticJoint, resistance: Resistance) -> AxisParameters {
    paper_axis(Joint::Elastic(joint), resistance)
}

fn joint(k: f64, c: f64, b: f64, no_pull: bool) -> ElasticJoint {
    ElasticJoint {
        stiffness_nm_per_rad: k,
        damping_nms_per_rad: c,
        backlash_half_rad: b,
        no_pull,
    }
}

/// Mechanical energy and the energy in the armature's field \[J\]. With the
/// terminals shorted nothing feeds it.
fn energy_j(axis: &AxisParameters, plant: &Plant) -> f64 {
    let current_a = plant.state().current_a;
    plant.mechanical_energy_j() + 0.5 * axis.motor.inductance_h * current_a * current_a
}

/// Largest gain of energy between two of 200 instants 100 µs apart, relative
/// to the energy at the start.
fn largest_gain(axis: &AxisParameters, solver: Solver, state: &State) -> f64 {
    let mut plant = Plant::with_state(axis, solver, state);
    let start_j = energy_j(axis, &plant);
    let (mut before_j, mut gain) = (start_j, 0.0_f64);
    for i in 1..=200 {
        plant
            .advance(&Drive::Held(0.0), i * 100_000, &mut ())
            .unwrap();
        gain = gain.max((energy_j(axis, &plant) - before_j) / start_j);
        before_j = energy_j(axis, &plant);
    }
    gain
}

fn states() -> impl Strategy<Value = State> {
    (-0.1..0.1, -20.0..20.0, -20.0..20.0, -5.0..5.0_f64).prop_map(
        |(epsilon_rad, epsilon_dot_radps, gamma_dot_radps, current_a)| State {
            beta_rad: epsilon_rad,
            beta_dot_radps: gamma_dot_radps + epsilon_dot_radps,
            epsilon_rad,
            epsilon_dot_radps,
            current_a,
            ..State::default()
        },
    )
}

const DOPRI5: Solver = Solver::Dopri5 { tolerance: 1e-11 };

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The joint, the guide and the armature only take energy.
    #[test]
    fn shorted_axis_never_gains_energy(
        state in states(),
        k in 10.0..1e5_f64,
        c in 0.0..2.0_f64,
        b in 0.0..0.08_f64,
        no_pull: bool,
        friction_n in prop_oneof![Just(0.0), 0.0..200.0_f64],
    ) {
        let resistance = Resistance {
            constant_n: friction_n,
            opposes_motion: true,
            ..Resistance::default()
        };
        let axis = axis(joint(k, c, b, no_pull), resistance);
        let gain = largest_gain(&axis, DOPRI5, &state);
        prop_assert!(gain < 1e-9, "energy grew by {gain}");
    }

    /// Without damping and current the joint gives back all that it takes.
    #[test]
    fn undamped_joint_keeps_its_energy(
        mut state in states(),
        k in 10.0..1e5_f64,
        b in 0.0..0.08_f64,
    ) {
        state.current_a = 0.0;
        let mut axis = axis(joint(k, 0.0, b, false), Resistance::default());
        // A motor that neither drives nor brakes.
        axis.motor.torque_constant_nm_per_a = 1e-12;
        let mut plant = Plant::with_state(&axis, DOPRI5, &state);
        let start_j = energy_j(&axis, &plant);
        plant.advance(&Drive::Held(0.0), 20_000_000, &mut ()).unwrap();
        prop_assert!((energy_j(&axis, &plant) / start_j - 1.0).abs() < 1e-8);
    }
}

/// The contrast: a fixed step that is too long for the joint makes energy out
/// of nothing, and the measure shows it.
#[test]
fn a_fixed_step_too_long_for_the_joint_gains_energy() {
    let axis = axis(joint(2e4, 0.0, 0.01, false), Resistance::default());
    let state = State {
        beta_dot_radps: 10.0,
        epsilon_dot_radps: 10.0,
        ..State::default()
    };
    let coarse = Solver::Rk4 { step_ns: 100_000 };
    assert!(largest_gain(&axis, coarse, &state) > 1e-3);
    assert!(largest_gain(&axis, DOPRI5, &state) < 1e-9);
}

/// With friction the shorted axis comes to rest and stays there.
#[test]
fn dry_friction_holds_the_screw() {
    let resistance = Resistance {
        constant_n: 60.0,
        opposes_motion: true,
        ..Resistance::default()
    };
    let axis = axis(joint(350.0, 0.2, 0.03, false), resistance);
    let state = State {
        beta_dot_radps: 3.0,
        ..State::default()
    };
    let mut plant = Plant::with_state(&axis, DOPRI5, &state);
    plant
        .advance(&Drive::Held(0.0), 300_000_000, &mut ())
        .unwrap();
    let rest = plant.state();
    assert_eq!(rest.gamma_dot_radps(), 0.0);
    assert!(rest.gamma_rad() > 0.0);
    plant
        .advance(&Drive::Held(0.0), 400_000_000, &mut ())
        .unwrap();
    // γ = β − ε: what the gear still does leaves its rounding.
    assert_eq!(plant.state().gamma_dot_radps(), 0.0);
    assert!((plant.state().gamma_rad() - rest.gamma_rad()).abs() < 1e-15);
    // 60 N at the screw is 0.048 N m; the motor at 1 A gives 0.125 N m.
    plant
        .advance(&Drive::Held(1.5), 800_000_000, &mut ())
        .unwrap();
    assert!(plant.state().gamma_dot_radps() > 0.0);
}

/// A flank that can only push never pulls; the paper's flank does.
#[test]
fn no_pull_cuts_the_torque_at_zero() {
    struct Pull {
        worst_mps2: f64,
    }
    impl plant::Watch for Pull {
        fn span(&mut self, span: &plant::Span<'_>) {
            for theta in [0.0, 0.5, 1.0] {
                let pull = -f64::from(span.contact().sign()) * span.acceleration_at_mps2(theta);
                self.worst_mps2 = self.worst_mps2.max(pull);
            }
        }
        fn contact_change(&mut self, _: &plant::ContactChange) {}
    }
    let state = State {
        epsilon_dot_radps: 5.0,
        ..State::default()
    };
    let worst = |no_pull| {
        let axis = axis(joint(350.0, 0.05, 0.02, no_pull), Resistance::default());
        let mut plant = Plant::with_state(&axis, DOPRI5, &state);
        let mut pull = Pull { worst_mps2: 0.0 };
        plant
            .advance(&Drive::Held(0.0), 50_000_000, &mut pull)
            .unwrap();
        pull.worst_mps2
    };
    assert!(worst(false) > 0.01, "{}", worst(false));
    assert!(worst(true) < 1e-9, "{}", worst(true));
}
