//! The output goes on from where it stands: other gains in motion, disabling
//! and enabling.

use firmware::State;

use super::{Ran, largest, steps};

/// The gains change at 0.3 s, where e = 1231 counts.
const CHANGE: usize = 300;

const GENERATOR: &str = "controller.setpoints=generator";

fn changed(gains: &[&str]) -> Ran {
    Ran::of("paper-2", &[&[GENERATOR, "gain_change.at_s=0.3"], gains])
}

/// At the change the code moves by nothing at all, while the new Kp's term
/// alone is 3939 codes larger than the old one's. One sample later the new
/// gains answer to new errors: no step is larger than twice the largest
/// before, as Kd, which makes the steps, is doubled.
#[test]
fn other_gains_make_no_step() {
    let plain = Ran::of("paper-2", &[&[GENERATOR]]);
    let before = largest(&steps(&plain.codes()[200..CHANGE]));
    let e = plain.samples()[CHANGE].error_counts;
    for gains in [
        &["gain_change.kp=6.4"][..],
        &["gain_change.kp=1.6"],
        &["gain_change.ki_per_s=10"],
        &["gain_change.kd_s=0.1"],
        &["gain_change.kp=6.4 gain_change.ki_per_s=10 gain_change.kd_s=0.1"],
    ] {
        let ran = changed(gains);
        let codes = ran.codes();
        assert_eq!(codes[..CHANGE], plain.codes()[..CHANGE]);
        assert_ne!(codes, plain.codes());
        let at = codes[CHANGE] - codes[CHANGE - 1];
        let after = largest(&steps(&codes[CHANGE - 1..CHANGE + 20]));
        println!("{gains:?}: step at the change {at}, after it up to {after}, before {before}");
        assert_eq!(at, 0.0, "{gains:?}");
        assert!(after <= 2.0 * before, "{gains:?}");
    }
    // The contrast: Kp·e with twice the Kp.
    let naive = 3.2 * e;
    println!("Kp's term alone would step by {naive}");
    assert!(naive > 10.0 * before);
}

/// Disabled in mid-move and enabled again: without a slew limit the code falls
/// to 0 in one sample and the brake comes back in one; with 100 codes per
/// sample the drive keeps its power until its output has run down, and no step
/// is larger than that.
#[test]
fn disabling_and_enabling_within_the_slew_limit() {
    let off_and_on = [GENERATOR, "sequence.disable_s=0.4", "sequence.enable_s=0.5"];
    let hard = Ran::of("paper-2", &[&off_and_on]);
    let slew = ["controller.slew_limit_codes_per_s=100000"];
    let soft = Ran::of("paper-2", &[&off_and_on, &slew]);
    let [hard_step, soft_step] = [&hard, &soft].map(|ran| largest(&steps(&ran.codes())));
    let [hard_mps2, soft_mps2] = [&hard, &soft].map(|ran| ran.summary().peak_abs_acc_mps2);
    println!("step {hard_step} → {soft_step} codes, peak {hard_mps2:.1} → {soft_mps2:.1} m/s²");
    assert!(hard_step > 5_000.0);
    assert_eq!(soft_step, 100.0);
    // 17.7 and 8.4 m/s².
    assert!(soft_mps2 < 0.7 * hard_mps2);

    let states = |ran: &Ran, at: usize| ran.samples()[at].axis_state.unwrap();
    for ran in [&hard, &soft] {
        assert_eq!(states(ran, 399), State::Moving);
        assert_eq!(states(ran, 400), State::Disabled);
        assert_eq!(states(ran, 500), State::Enabled);
        // It holds where it was enabled: the move is not taken up again.
        assert_eq!(ran.axis().state, "enabled");
        assert_eq!(ran.outcome.refused_requests, 0);
    }
    assert_eq!(hard.rows[400].motor_voltage_v, 0.0);
    assert!(soft.rows[400].motor_voltage_v > 80.0);
}

/// Enabled at rest, with friction: the output starts from 0 and nothing moves.
#[test]
fn enabling_at_rest_moves_nothing() {
    let sets = ["sequence.disable_s=2", "sequence.enable_s=2.2"];
    let ran = Ran::of("paper-2", &[&super::FRICTION, &sets]);
    let codes = ran.codes();
    assert!(codes[1_999].abs() > 100.0, "friction holds a load");
    assert_eq!(largest(&codes[2_000..]), 0.0);
    let carriage_um = ran.carriage_um();
    assert!(super::peak_to_peak(&carriage_um[2_200..]) < 1.0);
}
