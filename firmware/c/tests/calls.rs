//! Calls as C makes them, right and wrong ones; rows of the golden vectors are
//! `scripts/c-example`'s.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "all of it is calls of C")]

use std::ffi::CStr;
use std::mem::zeroed;
use std::ptr::{null, null_mut};

use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Axis, Counts, Dac, Event, FaultCause, GainWord, Settings, State, Stretch};
use servo::*;

/// Kp = 2 codes per count behind 12 bits.
fn settings() -> Settings {
    let dac = Dac::with_bits(12).unwrap();
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let law = Law::accept(words, dac).unwrap();
    Settings::of(&Axis::new(
        law,
        Output::new(dac, None, Quantiser::Nearest).unwrap(),
    ))
}

fn started() -> servo_axis {
    let mut axis = servo_axis {
        words: [u64::MAX; SERVO_AXIS_WORDS],
    };
    unsafe {
        assert_eq!(servo_axis_start(&mut axis, &settings()), SERVO_OK);
        assert_eq!(
            servo_axis_request(&mut axis, Event::Enable as u32),
            SERVO_OK
        );
        assert_eq!(servo_axis_request(&mut axis, Event::Start as u32), SERVO_OK);
    }
    axis
}

/// A call without what it needs says so, and no more happens.
#[test]
fn what_is_not_there_is_told() {
    let (good, inputs) = (settings(), servo_inputs::default());
    unsafe {
        let (mut axis, mut fault): (servo_axis, servo_fault) = (zeroed(), zeroed());
        let odd = (&raw mut axis).byte_add(4);
        for none in [null_mut(), &raw mut axis, odd] {
            assert_eq!(servo_axis_change(none, &good), SERVO_NO_POINTER);
            assert_eq!(servo_axis_request(none, 0), SERVO_NO_POINTER);
            assert_eq!(servo_axis_state(none), SERVO_NO_POINTER);
            assert_eq!(servo_axis_fault(none, &mut fault), SERVO_NO_POINTER);
            let outputs = [
                servo_axis_tick(none, &inputs, null()),
                servo_axis_play(none, &inputs, null_mut()),
                servo_axis_output_failed(none, 0, 1),
            ];
            for output in outputs {
                assert_eq!((output.code, output.power), (0, false));
                assert_eq!(output.state, State::Fault as u32);
            }
        }
        assert_eq!(servo_axis_start(null_mut(), &good), SERVO_NO_POINTER);
        assert_eq!(servo_axis_start(odd, &good), SERVO_NO_POINTER);
        assert_eq!(servo_axis_start(&mut axis, null()), SERVO_NO_POINTER);
        assert_eq!(axis.words, [0; SERVO_AXIS_WORDS]);

        // Started: no inputs, no setpoint, no such request.
        axis = started();
        assert_eq!(
            servo_axis_tick(&mut axis, null(), null()).state,
            State::Fault as u32
        );
        assert_eq!(servo_axis_state(&axis), State::Moving as i32);
        assert_eq!(servo_axis_fault(&axis, null_mut()), SERVO_NO_POINTER);
        assert_eq!(servo_axis_fault(&axis, &mut fault), 0);
        for event in [Event::Enable as u32, Event::Fail as u32, 6, u32::MAX] {
            assert_eq!(servo_axis_request(&mut axis, event), SERVO_REFUSED);
        }
        let output = servo_axis_tick(&mut axis, &inputs, null());
        assert_eq!((output.power, output.state), (false, State::Fault as u32));
        assert_eq!(servo_axis_fault(&axis, &mut fault), 1);
        assert_eq!(fault.cause, FaultCause::SetpointUnderrun as u32);
        assert_eq!((fault.measured, fault.limit), (0, 1));
    }
}

/// A word that is not accepted is named; the axis goes on with what it had.
#[test]
fn a_word_is_named() {
    let name = |place| unsafe { CStr::from_ptr(servo_settings_name(place)).to_str().unwrap() };
    for (place, wanted) in Settings::NAMES.iter().enumerate() {
        assert_eq!(name(i32::try_from(place).unwrap()), *wanted);
    }
    let beyond = i32::try_from(Settings::WORDS).unwrap();
    assert!(
        [-1, beyond, i32::MIN]
            .iter()
            .all(|place| servo_settings_name(*place).is_null())
    );
    let unfit = Settings {
        dac_bits: 25,
        ..settings()
    };
    let mut axis = started();
    let before = axis.words;
    for refused in unsafe {
        [
            servo_axis_start(&mut axis, &unfit),
            servo_axis_change(&mut axis, &unfit),
        ]
    } {
        assert_eq!((name(refused - 1), axis.words), ("dac_bits", before));
    }
    let other = Settings {
        dead_band_counts: 7,
        ..settings()
    };
    unsafe {
        assert_eq!(servo_axis_change(&mut axis, &other), SERVO_OK);
    }
    assert_ne!(axis.words, before);
}

/// Stretches are taken off one by one, and the target is held; a sample at a time
/// gives the same.
#[test]
fn stretches_are_played() {
    let stretch = |position, velocity: i64, samples| {
        let Stretch { position, .. } = Stretch::resting_at(position);
        let velocity = Counts::from_num(velocity);
        servo_stretch {
            position: position.to_bits(),
            velocity: velocity.to_bits(),
            samples,
            ..Default::default()
        }
    };
    let stretches = [stretch(0, 2, 3), stretch(6, -1, 0)];
    let mut motion = servo_motion {
        next: stretches.as_ptr(),
        left: 2,
        target: 5,
    };
    let (mut playing, mut stepping) = (started(), started());
    for (tick, position) in (0..).zip([0, 2, 4, 6, 5, 5]) {
        let inputs = servo_inputs {
            tick,
            ..Default::default()
        };
        let next = servo_setpoint {
            position,
            last: u8::from(tick == 4),
            ..Default::default()
        };
        let [played, stepped] = unsafe {
            [
                servo_axis_play(&mut playing, &inputs, &mut motion),
                servo_axis_tick(&mut stepping, &inputs, &next),
            ]
        };
        assert_eq!((played.code, played.power), (2 * position, true));
        assert_eq!(played, stepped);
        assert_eq!(motion.left, u32::from(tick < 3));
    }
    assert_eq!(unsafe { servo_axis_state(&playing) }, State::Holding as i32);
    // The output was not taken: a fault of that sample.
    let failed = unsafe { servo_axis_output_failed(&mut playing, 5, 3) };
    assert_eq!(
        (failed.code, failed.power, failed.state),
        (0, false, State::Fault as u32)
    );
}
