//! The setpoint table: what it holds, what it refuses, what it holds on to;
//! and the controller's walk through it.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use firmware::law::{Law, LawWords};
use firmware::refusal::What;
use firmware::{
    CAPACITY, CAPACITY_SMALLEST, Controller, ControllerState, Dac, GainWord, Refusal, SetpointTable,
};

#[test]
fn the_capacities_are_those_of_the_host_and_of_the_smallest_chip() {
    assert_eq!((CAPACITY, CAPACITY_SMALLEST), (16_384, 2_048));
}

#[test]
fn a_full_table_is_accepted_and_one_more_is_refused() {
    let counts: Vec<i32> = (0..2_049).collect();
    let table = SetpointTable::<CAPACITY_SMALLEST>::from_counts(&counts[..2_048]);
    let mut table = table.expect("as many as there is room for");
    assert_eq!(table.as_counts(), &counts[..2_048]);

    let error = Refusal {
        what: What::Setpoints,
        value: 2_049,
        least: 1,
        most: 2_048,
    };
    assert_eq!(table.push(2_048), Err(error));
    assert_eq!(
        table.at(u64::MAX),
        2_047,
        "a refused setpoint must not be held"
    );
    let found = SetpointTable::<CAPACITY_SMALLEST>::from_counts(&counts);
    assert_eq!(found, Err(error));
    assert_eq!(
        error.to_string(),
        "the motion needs 2049 setpoints but the table holds 2048; \
         a longer sample time or a shorter motion needs fewer"
    );
}

#[test]
fn an_empty_table_is_refused() {
    let error = SetpointTable::<4>::from_counts(&[]).expect_err("nothing to hold");
    assert_eq!((error.what, error.value), (What::Setpoints, 0));
    assert_eq!(
        error.to_string(),
        "the setpoint table is empty; it needs at least the setpoint of the first sample"
    );
}

#[test]
fn pushing_and_filling_give_the_same_table() {
    let mut pushed = SetpointTable::<8>::from_counts(&[5]).expect("there is room");
    for setpoint in [6, -7, i32::MIN] {
        pushed.push(setpoint).expect("there is room");
    }
    let filled = SetpointTable::<8>::from_counts(&[5, 6, -7, i32::MIN]);
    assert_eq!(filled, Ok(pushed));
}

#[test]
fn the_last_setpoint_is_held_for_ever() {
    let table = SetpointTable::<3>::from_counts(&[1, 2, 3]).expect("there is room");
    let expected = [1, 2, 3, 3, 3];
    for (k, setpoint) in (0..).zip(expected) {
        assert_eq!(table.at(k), setpoint);
    }
    for k in [1 << 31, 1 << 32, (1 << 32) + 1, 1 << 63, u64::MAX] {
        assert_eq!(table.at(k), 3, "sample {k}");
    }
}

/// `Kp` = 1 with 12 bits.
fn controller<const N: usize>(setpoints: &[i32]) -> Controller<N> {
    let words = LawWords {
        kp: GainWord::new(1 << 30, 30),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(12).expect("12 bits are supported");
    let table = SetpointTable::from_counts(setpoints).expect("there is room");
    Controller::new(Law::accept(words, dac).expect("accepted"), table)
}

#[test]
fn the_controller_takes_one_setpoint_a_sample_and_starts_anew_with_a_new_state() {
    let controller = controller::<4>(&[10, 20, 30]);
    for _ in 0..2 {
        let mut state = ControllerState::start(&controller);
        for (k, error) in [10, 20, 30, 30, 30].into_iter().enumerate() {
            assert_eq!(state.sample(), u64::try_from(k).expect("small"));
            let output = controller.tick(&mut state, 0);
            assert_eq!((output.error_counts, output.code), (error, error));
            assert!(!output.out_of_range);
        }
    }
}

#[test]
fn an_error_beyond_its_range_is_told_and_held() {
    let controller = controller::<1>(&[0]);
    let mut state = ControllerState::start(&controller);
    for (count, beyond) in [
        (-131_072, false),
        (-131_073, true),
        (131_072, false),
        (i32::MIN, true),
    ] {
        let output = controller.tick(&mut state, count);
        assert_eq!(output.out_of_range, beyond);
        assert_eq!(
            output.error_counts,
            count.wrapping_neg(),
            "as it was measured"
        );
    }
}
