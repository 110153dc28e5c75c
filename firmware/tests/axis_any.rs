//! Whatever comes: no panic, no code outside the converter, no power in a
//! fault.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod any;
mod rig;

use any::{axes, samples};
use firmware::{Axis, AxisOutput, AxisState, Inputs, State};
use proptest::prelude::*;
use rig::Script;

/// Demands after every sample.
fn holds(
    axis: &Axis,
    before: &AxisState,
    state: &AxisState,
    output: AxisOutput,
) -> Result<(), TestCaseError> {
    let dac = axis.output().dac();
    prop_assert!((dac.min_code()..=dac.max_code()).contains(&output.code));
    prop_assert_eq!(output.state, state.state());
    let fault = state.state() == State::Fault;
    prop_assert_eq!(
        fault,
        state.fault().is_some(),
        "a fault has its record, and only a fault"
    );
    if fault {
        prop_assert_eq!((output.code, output.power), (0, false));
    }
    prop_assert!(output.power || output.code == 0, "a code without power");
    prop_assert!(output.power || !state.state().is_powered());
    // A fault is left by a reset only, and the first one is kept.
    if let Some(first) = before.fault() {
        prop_assert_eq!(state.fault(), Some(first));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3_000))]

    #[test]
    fn anything_at_all_ends_in_a_code_or_in_safety(
        axis in axes(),
        samples in prop::collection::vec(samples(), 1..120),
    ) {
        let mut state = AxisState::start(&axis);
        let mut tick = 0_u64;
        for sample in samples {
            if let Some(event) = sample.request {
                let before = state;
                if state.request(event).is_err() {
                    prop_assert_eq!(state, before, "a refused request changes nothing");
                }
            }
            if sample.gains_changed {
                state.change(&axis);
            }
            tick = tick.wrapping_add(sample.inputs.tick);
            let before = state;
            let inputs = Inputs { tick, ..sample.inputs };
            let mut source = Script::new(|_| sample.next);
            let output = state.tick(&inputs, &mut source);
            holds(&axis, &before, &state, output)?;
        }
    }
}

/// Contrast: the measure sees a code outside, a fault with power, and a power
/// that went before its code.
#[test]
fn what_must_hold_can_fail() {
    let axis = rig::axis(rig::PAPER);
    let mut state = AxisState::start(&axis);
    let fine = state.tick(&Inputs::default(), &mut rig::Silent);
    assert!(holds(&axis, &state, &state, fine).is_ok());
    for wrong in [
        AxisOutput {
            code: 8_192,
            power: true,
            ..fine
        },
        AxisOutput {
            code: 5,
            power: false,
            ..fine
        },
        AxisOutput {
            state: State::Fault,
            ..fine
        },
    ] {
        assert!(holds(&axis, &state, &state, wrong).is_err(), "{wrong:?}");
    }
    let mut stopped = state;
    let stop = Inputs {
        emergency_stop: true,
        ..Inputs::default()
    };
    let safe = stopped.tick(&stop, &mut rig::Silent);
    assert!(holds(&axis, &state, &stopped, safe).is_ok());
    assert!(
        holds(
            &axis,
            &state,
            &stopped,
            AxisOutput {
                power: true,
                ..safe
            }
        )
        .is_err()
    );
    assert!(
        holds(&axis, &stopped, &state, fine).is_err(),
        "a fault that went away"
    );
}

/// Random words that only ever ended in a law without gains would show little.
#[test]
fn the_random_laws_are_mostly_whole() {
    use proptest::strategy::ValueTree as _;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut whole, mut forward, mut filtered) = (0, 0, 0);
    for _ in 0..1_000 {
        let axis = axes().new_tree(&mut runner).expect("an axis").current();
        let words = axis.law().words();
        whole += i32::from(words.kp.mantissa != 0);
        forward += i32::from(words.velocity_ff.mantissa != 0);
        filtered += i32::from(words.filter.is_some());
    }
    println!("of 1000 laws: {whole} with Kp, {forward} with feed-forward, {filtered} filtered");
    assert!(whole > 300 && forward > 100 && filtered > 50);
}
