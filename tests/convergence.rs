//! Orders of convergence of the plant's solvers, each with its contrast.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use bench_tests::paper_axis;
use plant::{Drive, ElasticJoint, Joint, Plant, Resistance, Solver, Span, State, Watch};

fn elastic(stiffness_nm_per_rad: f64, backlash_half_rad: f64) -> Joint {
    damped(stiffness_nm_per_rad, 0.2, backlash_half_rad)
}

fn damped(stiffness_nm_per_rad: f64, damping_nms_per_rad: f64, backlash_half_rad: f64) -> Joint {
    Joint::Elastic(ElasticJoint {
        stiffness_nm_per_rad,
        damping_nms_per_rad,
        backlash_half_rad,
        no_pull: false,
    })
}

/// Counts the solver's accepted steps.
#[derive(Default)]
struct Steps(u32);

impl Watch for Steps {
    fn span(&mut self, _: &Span<'_>) {
        self.0 += 1;
    }
    fn contact_change(&mut self, _: &plant::ContactChange) {}
}

/// State after 60 ms: 20 V for 30 ms, then −20 V, so that the gap is crossed
/// on the way there and back; and the number of steps that it took.
fn there_and_back(joint: Joint, solver: Solver) -> (State, u32) {
    let mut plant = Plant::new(&paper_axis(joint, Resistance::default()), solver);
    let mut steps = Steps::default();
    for (voltage_v, until_ns) in [(20.0, 30_000_000), (-20.0, 60_000_000)] {
        plant
            .advance(&Drive::Held(voltage_v), until_ns, &mut steps)
            .unwrap();
    }
    (plant.state(), steps.0)
}

fn distance(a: &State, b: &State) -> f64 {
    (a.beta_rad - b.beta_rad).abs() + (a.epsilon_rad - b.epsilon_rad).abs()
}

fn truth(joint: Joint) -> State {
    there_and_back(joint, Solver::Exact).0
}

/// Order of rk4 from two step lengths a factor of four apart. Where a step
/// falls on a contact is chance, so the worst of a few close lengths counts.
fn rk4_order(joint: Joint) -> f64 {
    let truth = truth(joint);
    let error = |step_ns: u64| {
        let lengths_ns = [1000, 990, 980, 970, 960].map(|share| step_ns * share / 1000);
        let errors = lengths_ns.map(|step_ns| {
            let (state, _) = there_and_back(joint, Solver::Rk4 { step_ns });
            distance(&state, &truth)
        });
        errors.into_iter().fold(0.0, f64::max)
    };
    (error(160_000) / error(40_000)).log2() / 2.0
}

/// Order of dopri5: the slope of the error over the number of steps it took,
/// both as logarithms, fitted over seven tolerances from `loose` on, each half
/// a decade finer. Two points alone would leave it to where the steps happen
/// to end.
fn dopri5_order(joint: Joint, loose: f64) -> f64 {
    let truth = truth(joint);
    let shares = [1.0, 3e-1, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3];
    let works = shares.map(|share| {
        let tolerance = share * loose;
        let (state, steps) = there_and_back(joint, Solver::Dopri5 { tolerance });
        (f64::from(steps).ln(), -distance(&state, &truth).ln())
    });
    let mean = |of: fn(&(f64, f64)) -> f64| works.iter().map(of).sum::<f64>() / 7.0;
    let (x0, y0) = (mean(|w| w.0), mean(|w| w.1));
    let slope = works.iter().map(|(x, y)| (x - x0) * (y - y0)).sum::<f64>();
    slope / works.iter().map(|(x, _)| (x - x0) * (x - x0)).sum::<f64>()
}

#[test]
fn rk4_has_order_four_without_a_gap_and_loses_it_at_a_contact() {
    let smooth = rk4_order(elastic(350.0, 0.0));
    let contact = rk4_order(elastic(350.0, 0.01));
    assert!((3.7..4.3).contains(&smooth), "order {smooth}");
    assert!(contact < 2.2, "order {contact}");
}

/// Order 8 of the Dormand-Prince pair 8(5,3). The joints hardly damp, or the
/// errors would die away with the oscillation, and the second is stiff, or
/// there would be too few steps to count. Looser, steps are few and their ends
/// chance; tighter, rounding shows. Across contacts a little more than 8 is
/// seen: the short steps after each change are as many at any tolerance.
#[test]
fn dopri5_keeps_its_order_across_contacts() {
    let smooth = dopri5_order(damped(350.0, 1e-3, 0.0), 1e-5);
    let contact = dopri5_order(damped(35_000.0, 0.05, 0.01), 1e-8);
    println!("order {smooth}, across contacts {contact}");
    assert!((7.3..8.7).contains(&smooth), "order {smooth}");
    assert!((7.5..10.5).contains(&contact), "order {contact}");
}

/// The contrast: a solver that locates nothing leaves the error of a contact
/// proportional to no power of its step worth the name, however small.
#[test]
fn unlocated_contacts_cost_more_than_the_order() {
    let joint = elastic(350.0, 0.01);
    let truth = truth(joint);
    let (located, steps) = there_and_back(joint, Solver::Dopri5 { tolerance: 1e-9 });
    let (unlocated, many) = there_and_back(joint, Solver::Rk4 { step_ns: 2_000 });
    assert!(steps * 100 < many, "{steps} {many}");
    assert!(distance(&located, &truth) * 1e4 < distance(&unlocated, &truth));
}

/// A stiffer joint approaches the rigid axis with 1/k.
#[test]
fn stiff_joint_approaches_the_rigid_axis() {
    let rigid = truth(Joint::Rigid);
    let error = |k| (truth(elastic(k, 0.0)).gamma_rad() - rigid.gamma_rad()).abs();
    let (soft, stiff) = (error(1e5), error(1e6));
    assert!((8.0..12.0).contains(&(soft / stiff)), "{soft} {stiff}");
    assert!(stiff < 1e-6, "{stiff}");
}

/// A shrinking gap approaches the joint without one, proportionally.
#[test]
fn small_gap_approaches_the_joint_without_one() {
    let gapless = truth(elastic(350.0, 0.0));
    let error = |b| distance(&truth(elastic(350.0, b)), &gapless);
    let (wide, narrow) = (error(1e-5), error(1e-6));
    assert!((7.0..14.0).contains(&(wide / narrow)), "{wide} {narrow}");
    assert!(error(1e-15) < 1e-10, "{}", error(1e-15));
}
