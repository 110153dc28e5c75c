//! Two symmetries that no word length may break: the sum is exactly odd in the
//! error, and a shift of the wheel of 2^32 counts changes nothing.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::words::accepted_words;
use firmware::{
    CodeSum, Controller, ControllerState, Dac, GainWord, Pid, PidState, PidWords, SetpointTable,
};
use proptest::prelude::*;

/// Errors of every size, beyond the declared range too; all but `i32::MIN`,
/// which has no opposite.
fn errors() -> impl Strategy<Value = Vec<i32>> {
    let any = (0..31_u32, any::<i32>()).prop_map(|(shift, error)| (error >> shift).max(-i32::MAX));
    let extreme = prop_oneof![Just(i32::MAX), Just(-i32::MAX), Just(1), Just(-1), Just(0)];
    prop::collection::vec(prop_oneof![4 => any, 1 => extreme], 1..200)
}

proptest! {
    #[test]
    fn the_sum_is_exactly_odd(pid in accepted_words(), errors in errors(), repeat in 1..20) {
        let (mut up, mut down) = (PidState::default(), PidState::default());
        for _ in 0..repeat {
            for &error in &errors {
                let (plus, minus) = (pid.step(&mut up, error), pid.step(&mut down, -error));
                prop_assert_eq!(plus.sum, -minus.sum);
                prop_assert_eq!(plus.error_limited, minus.error_limited);
                prop_assert_eq!(plus.error_sum_beyond_range, minus.error_sum_beyond_range);
                prop_assert_eq!(up.integral(), -down.integral());
            }
        }
    }

    #[test]
    fn shifting_setpoints_and_counts_alike_changes_nothing(
        pid in accepted_words(),
        samples in prop::collection::vec(any::<(i32, i32)>(), 1..64),
        shift in any::<i32>(),
        dac_bits in 2..=24_u32,
    ) {
        let dac = Dac::with_bits(dac_bits).unwrap();
        let controller = |shift: i32| {
            let setpoints: Vec<i32> =
                samples.iter().map(|&(setpoint, _)| setpoint.wrapping_add(shift)).collect();
            let setpoints = SetpointTable::<64>::from_counts(&setpoints).unwrap();
            (Controller::new(pid, dac, setpoints), ControllerState::default())
        };
        let (here, mut at_here) = controller(0);
        let (there, mut at_there) = controller(shift);
        // Some samples more than setpoints: the last one is held.
        for &(_, count) in samples.iter().chain(samples.iter().take(9)) {
            let one = here.tick(&mut at_here, count);
            let other = there.tick(&mut at_there, count.wrapping_add(shift));
            prop_assert_eq!(one, other);
        }
    }
}

/// Unit gains: `Kp` = 1, `Ki·Δt` = 2^−10, no derivative.
fn simple() -> Pid {
    Pid::accept(PidWords {
        kp: GainWord::new(1 << 20, 20),
        ki_dt: GainWord::new(1 << 30, 40),
        kd_per_dt: GainWord::new(0, 32),
        error_bits: 17,
    })
    .expect("accepted")
}

#[test]
fn a_held_error_is_flagged_and_counts_as_its_limit() {
    let pid = simple();
    let (mut beyond, mut at_limit) = (PidState::default(), PidState::default());
    for (error, limited) in [(131_073, true), (-131_073, true), (i32::MIN, true)] {
        let held = pid.step(&mut beyond, error);
        let limit = pid.step(&mut at_limit, error.signum() * 131_072);
        assert_eq!(held.error_limited, limited);
        assert!(!limit.error_limited);
        assert_eq!(held.sum, limit.sum);
    }
}

#[test]
fn the_integral_goes_on_exactly_beyond_its_declared_range_and_says_so() {
    // The declared sum is 2^(40−3) = 2^37, that is 2^20 errors of 2^17.
    let pid = simple();
    assert_eq!(pid.error_sum_limit(), 1 << 37);
    let mut state = PidState::default();
    for k in 1..=(1_u64 << 20) + 3 {
        let output = pid.step(&mut state, 1 << 17);
        assert_eq!(output.error_sum_beyond_range, k > 1 << 20, "sample {k}");
    }
    // Ki·Δt·Σe = 2^−10·(2^20 + 3)·2^17
    let codes = ((1_i128 << 20) + 3) << 7;
    assert_eq!(state.integral(), CodeSum::from_num(codes));
    // And back: the way out and the way in end at zero exactly.
    for _ in 1..=(1_u64 << 20) + 3 {
        pid.step(&mut state, -(1 << 17));
    }
    assert_eq!(state.integral(), CodeSum::ZERO);
}

#[test]
fn contrast_a_truncating_shift_is_not_odd_and_creeps() {
    // The same law with a product shifted to whole codes: floor(Ki·Δt·e).
    let truncating = |error: i64| (error * (1 << 30)) >> 40;
    assert_ne!(truncating(-511), -truncating(511));
    let creep: i64 = (0..1_000).map(|_| truncating(511) + truncating(-511)).sum();
    assert_eq!(creep, -1_000);

    let pid = simple();
    let mut state = PidState::default();
    for _ in 0..1_000 {
        pid.step(&mut state, 511);
        pid.step(&mut state, -511);
    }
    assert_eq!(state.integral(), CodeSum::ZERO);
}
