//! The emergency stop in the middle of a move, in a closed loop; and runs of
//! samples that the power has interrupted.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod rig;

use firmware::axis::{Feedback, Monitors};
use firmware::monitor::{EncoderLossMonitor, SaturationMonitor};
use firmware::{AxisState, CounterParameters, Event, FaultCause, Inputs, Next, Refused, State};
use rig::{Loop, PAPER, Script, Silent, at, axis, position, ramp};

/// A move of 4000 counts at 10 per sample; the stop comes at sample 200. Where
/// the motor ends, and how it moved in the last sample \[2^−16 counts\].
fn moved(stop: bool) -> (Loop, i64) {
    let mut run = Loop::new(axis(PAPER), 0);
    run.request(Event::Enable);
    run.request(Event::Start);
    let mut source = ramp(0, 4_000, 10);
    let mut at_the_stop = 0;
    for sample in 0..6_000 {
        let pressed = stop && sample >= 200;
        if sample == 200 {
            at_the_stop = run.motor.position >> 16;
            assert!(run.motor.velocity > 9 << 16, "in full motion");
        }
        let output = run.tick_with(&mut source, |inputs| inputs.emergency_stop = pressed);
        assert_eq!(output.power, !pressed);
        if pressed {
            assert_eq!((output.code, output.state), (0, State::Fault));
        }
    }
    let ran_on = (run.motor.position >> 16) - at_the_stop;
    (run, ran_on)
}

#[test]
fn an_emergency_stop_in_a_move_ends_it() {
    let (run, ran_on) = moved(true);
    let fault = run.state.fault().expect("a fault");
    assert_eq!((fault.cause, fault.tick), (FaultCause::EmergencyStop, 200));
    assert_eq!(fault.values.setpoint, 2_000);
    assert!(fault.values.code > 0, "the code that drove it is kept");
    // Without drive the motor runs on by v/drag = 10/0.05 counts and no more.
    assert!((190..=210).contains(&ran_on), "{ran_on}");

    // Contrast: without the stop the move ends where it should.
    let (run, _) = moved(false);
    assert_eq!(run.state.fault(), None);
    assert_eq!(run.state.state(), State::Holding);
    assert!((run.motor.counts() - 4_000).abs() <= 1);
}

/// The monitor counts samples in a row; the power was off in between.
#[test]
fn runs_of_samples_start_anew_when_the_axis_is_enabled() {
    let mut axis = axis(PAPER);
    axis.monitors = Monitors {
        saturation: Some(SaturationMonitor::accept(3).expect("a monitor")),
        encoder_loss: Some(EncoderLossMonitor::accept(8_000, 5).expect("a monitor")),
        ..Monitors::default()
    };
    let mut state = AxisState::start(&axis);
    let mut tick = 0;
    let mut sample = |state: &mut AxisState| {
        tick += 1;
        let mut far = Script::new(|_| Next::Setpoint(position(50_000)));
        state.tick(&at(tick, 0), &mut far)
    };
    for _ in 0..20 {
        rig::start(&mut state);
        for _ in 0..3 {
            assert_eq!(sample(&mut state).code, 8_191);
            assert_eq!(state.fault(), None, "three samples are allowed");
        }
        state.request(Event::Disable).expect("moving");
        sample(&mut state);
    }
    // Contrast: four in a row.
    rig::start(&mut state);
    for _ in 0..4 {
        sample(&mut state);
    }
    let fault = state.fault().expect("a fault");
    assert_eq!(fault.cause, FaultCause::SaturationTooLong);
}

/// The load's position comes from its register or not at all: a missing one is
/// no position 0, to which the axis would run.
#[test]
fn a_load_register_that_does_not_come_stops_the_axis() {
    let mut axis = axis(PAPER);
    axis.feedback = Feedback::Load(CounterParameters::WORD);
    let mut state = AxisState::start(&axis);
    state.request(Event::Enable).expect("disabled");
    let sample = |state: &mut AxisState, tick, load_register| {
        let inputs = Inputs {
            load_register,
            ..at(tick, 70_000)
        };
        state.tick(&inputs, &mut Silent)
    };
    assert_eq!(sample(&mut state, 0, Some(35_000)).error_counts, 0);
    let output = sample(&mut state, 1, None);
    assert_eq!(
        (output.code, output.power, output.state),
        (0, false, State::Fault)
    );
    let fault = *state.fault().expect("a fault");
    assert_eq!(fault.cause, FaultCause::HardwareBus);
    assert_eq!((fault.values.position, fault.values.error), (35_000, 0));

    // Contrast: a register that reads 0 is a position, far from the setpoint.
    state.request(Event::Reset).expect("a fault");
    state.request(Event::Enable).expect("disabled");
    assert_eq!(sample(&mut state, 2, Some(35_000)).error_counts, 0);
    assert_eq!(sample(&mut state, 3, Some(0)).error_counts, 35_000);
}

/// A fault has a record and a motion ends with its source: nobody asks for either.
#[test]
fn what_the_axis_finds_out_itself_cannot_be_requested() {
    for event in [Event::Fail, Event::MotionEnded] {
        let mut run = Loop::new(axis(PAPER), 0);
        run.request(Event::Enable);
        run.request(Event::Start);
        run.tick(&mut ramp(0, 100, 1));
        let before = run.state;
        let refused = run.state.request(event);
        assert_eq!(
            refused,
            Err(Refused {
                state: State::Moving,
                event
            })
        );
        assert_eq!(run.state, before);
        // Contrast: the transition itself exists.
        assert!(State::Moving.after(event).is_ok());
    }
}
