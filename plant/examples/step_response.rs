//! Step response of the plant alone: 10 V onto an axis that rests in the middle
//! of its gap, with every contact of its joint.
//!
//! ```text
//!   V [V]                                    Ψ = k·(ε ∓ b) + c·ε̇
//!                    armature      gear, J1         joint          screw and carriage, J2
//! 10 ┤   ┌──────►   ┌────────┐ k_m·I ┌───┐ β  ┌───────────────┐ γ  ┌───┐
//!    │   │     ────►│ R, L   ├──────►│   ├────┤ ⊏  ε = β−γ  ⊐ ├────┤   ├──► x = p·γ
//!  0 ┼───┘          └────────┘       └───┘    └───────────────┘    └───┘
//!        0     t [s]                            −b ≤ ε ≤ b: no torque
//! ```
//!
//! The motor runs through the gap alone, strikes the drive flank and rebounds
//! twice, each time less. Then it takes the carriage along, up to the speed
//! `V/k_m` at which no current is left.
//!
//! ```text
//! cargo run -p plant --example step_response
//! ```

use std::f64::consts::PI;

use plant::{
    AxisParameters, Carriage, Contact, ContactChange, Drive, ElasticJoint, Joint, Motor, Plant,
    PlantError, Resistance, Solver, Span, Transmission, Watch,
};

/// Height of the step \[V\].
const STEP_V: f64 = 10.0;

/// Instants of the table \[ms\].
const ROWS_MS: [u64; 11] = [0, 1, 2, 3, 4, 6, 10, 20, 100, 300, 700];

/// The axis of the paper's Table 1; its joint has the gap of the first
/// simulation and a twentieth of the damping, so that it rebounds.
fn axis() -> AxisParameters {
    AxisParameters {
        motor: Motor {
            inertia_kg_m2: 2e-4,
            torque_constant_nm_per_a: 0.25,
            resistance_ohm: 1.5,
            inductance_h: 6.5e-3,
        },
        transmission: Transmission {
            gear_ratio: 2.0,
            joint: Joint::Elastic(ElasticJoint {
                stiffness_nm_per_rad: 350.0,
                damping_nms_per_rad: 0.01,
                backlash_half_rad: 0.3 / 180.0 * PI,
                no_pull: false,
            }),
            screw_inertia_kg_m2: 8.5e-4,
            screw_pitch_m_per_rad: 5e-3 / (2.0 * PI),
        },
        carriage: Carriage {
            mass_kg: 50.0,
            resistance: Resistance::default(),
        },
    }
}

/// The changes of contact in their order.
#[derive(Default)]
struct Contacts(Vec<ContactChange>);

impl Watch for Contacts {
    fn span(&mut self, _: &Span<'_>) {}

    fn contact_change(&mut self, change: &ContactChange) {
        self.0.push(*change);
    }
}

/// Advances a plant through the rows of the table, calling `row` at each, and
/// returns it with its contacts.
fn respond(solver: Solver, row: impl Fn(&Plant)) -> Result<(Plant, Contacts), PlantError> {
    let (mut plant, mut contacts) = (Plant::new(&axis(), solver), Contacts::default());
    for ms in ROWS_MS {
        plant.advance(&Drive::Held(STEP_V), 1_000_000 * ms, &mut contacts)?;
        row(&plant);
    }
    Ok((plant, contacts))
}

fn main() -> Result<(), PlantError> {
    let axis = axis();
    let (motor, transmission) = (&axis.motor, &axis.transmission);
    let p = transmission.screw_pitch_m_per_rad;

    println!("  t [ms]   I [A]   β̇ [rad/s]   γ̇ [rad/s]   x [mm]   contact");
    let (plant, Contacts(changes)) = respond(Solver::Exact, |plant| {
        let y = plant.state();
        println!(
            "{:8} {:7.3} {:11.3} {:11.3} {:8.4} {:9}",
            plant.time_ns() / 1_000_000,
            y.current_a,
            y.beta_dot_radps,
            y.gamma_dot_radps(),
            1e3 * p * y.gamma_rad(),
            plant.contact().sign(),
        );
    })?;
    println!("\n  t [ms]   contact   ε̇ [rad/s]   ẍ before, after [m/s²]");
    for change in &changes {
        println!(
            "{:8.3} {:4} → {} {:12.3} {:10.4} {:8.4}",
            1e3 * change.time_s,
            change.from.sign(),
            change.to.sign(),
            change.epsilon_dot_radps,
            change.acceleration_before_mps2,
            change.acceleration_after_mps2,
        );
    }

    // Three impacts on the drive flank, each softer than the last.
    let impacts: Vec<_> = changes.iter().filter(|change| change.impact).collect();
    assert_eq!(impacts.len(), 3);
    assert!(impacts.iter().all(|impact| impact.to == Contact::Drive));
    let softer = |pair: &[&ContactChange]| pair[1].epsilon_dot_radps < pair[0].epsilon_dot_radps;
    assert!(impacts.windows(2).all(softer));

    // The damper acts at once: ẍ jumps by p·c·ε̇/J2, J2 = J_v + M·p² (eq. 10, 15).
    let Joint::Elastic(joint) = transmission.joint else {
        unreachable!("this axis has a joint")
    };
    let j2 = transmission.screw_inertia_kg_m2 + axis.carriage.mass_kg * p * p;
    for impact in &impacts {
        let expected_mps2 = p * joint.damping_nms_per_rad * impact.epsilon_dot_radps / j2;
        assert!((impact.acceleration_after_mps2 / expected_mps2 - 1.0).abs() < 1e-9);
        assert_eq!(impact.acceleration_before_mps2, 0.0);
    }

    // In the end the induced voltage k_m·α̇ is the step's, to within a per mille.
    let alpha_dot_radps = plant.state().beta_dot_radps / transmission.gear_ratio;
    let induced_v = motor.torque_constant_nm_per_a * alpha_dot_radps;
    assert!((induced_v / STEP_V - 1.0).abs() < 1e-3, "{induced_v}");
    assert_eq!(plant.contact(), Contact::Drive);

    // Another solver sees the same contacts, to within a nanosecond.
    let (_, Contacts(others)) = respond(Solver::Dopri5 { tolerance: 1e-11 }, |_| {})?;
    assert_eq!(others.len(), changes.len());
    for (other, change) in others.iter().zip(&changes) {
        assert!((other.time_s - change.time_s).abs() < 1e-9);
    }
    // The contrast: steps of 0.1 ms that locate nothing do not.
    let (_, Contacts(smeared)) = respond(Solver::Rk4 { step_ns: 100_000 }, |_| {})?;
    assert!((smeared[0].time_s - changes[0].time_s).abs() > 1e-6);
    Ok(())
}
