//! Every cause, from every state in which it can occur: the safe output in the
//! same sample, the latch, and the way back.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod provocations;
mod rig;

use firmware::axis::Monitors;
use firmware::law::LawWords;
use firmware::monitor::TickMonitor;
use firmware::{
    Axis, AxisState, CounterParameters, Event, Fault, FaultCause, GainWord, Next, State,
};
use provocations::{HOME, Provocation, provocations, stay};
use rig::{Loop, Script, Silent, axis, position, ramp};

/// A proportional axis of 2 codes per count with what the provocation needs.
fn guarded(provocation: &Provocation) -> Axis {
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let mut axis = axis(words);
    axis.monitors = provocation.monitors;
    axis.counter = provocation.counter;
    axis
}

/// A loop that stands at [`HOME`] in `state`, its motor blocked.
fn brought_to(axis: Axis, state: State) -> Loop {
    let mut run = Loop::new(axis, i64::from(HOME));
    if state != State::Disabled {
        run.request(Event::Enable);
    }
    let last = if state == State::Holding { 3 } else { 1_000 };
    let mut source = Script::new(|k| {
        if k < last {
            stay()
        } else {
            Next::Last(position(HOME))
        }
    });
    for sample in 0..6 {
        if sample == 1 && matches!(state, State::Moving | State::Holding) {
            run.request(Event::Start);
        }
        let output = run.tick(&mut source);
        assert_eq!((output.code, output.error_counts), (0, 0));
    }
    assert_eq!(run.state.state(), state);
    run
}

/// Runs the provocation; the fault that it left, checked sample by sample.
fn provoke(run: &mut Loop, provocation: &Provocation) -> Option<Fault> {
    let mut code_before = 0;
    for sample in 0..=provocation.last {
        assert_eq!(run.state.fault(), None, "too early, at {sample}");
        let mut source = Script::new(|_| (provocation.next)());
        let output = run.tick_with(&mut source, |inputs| (provocation.inputs)(sample, inputs));
        run.motor = rig::Motor::at(i64::from(HOME));
        if let Some(fault) = run.state.fault() {
            assert_eq!((output.code, output.power), (0, false), "{fault}");
            assert_eq!(output.state, State::Fault);
            if fault.cause != FaultCause::SaturationTooLong {
                assert_eq!(fault.values.code, code_before);
            }
        }
        code_before = output.code;
    }
    run.state.fault().copied()
}

#[test]
fn every_cause_acts_in_its_sample_from_every_state_and_is_kept_until_the_reset() {
    let mut trips = 0;
    for provocation in provocations() {
        for &state in provocation.from {
            let mut run = brought_to(guarded(&provocation), state);
            let tick = run.tick + u64::try_from(provocation.last).expect("a sample");
            let fault = provoke(&mut run, &provocation).expect("a fault");
            assert_eq!(fault.cause, provocation.cause, "from {state:?}");
            let late = u64::from(provocation.cause == FaultCause::MissedTick) * 2;
            assert_eq!(fault.tick, tick + late);
            assert_eq!(fault.values.measured, provocation.measured, "{fault}");
            assert_eq!(fault.values.limit, provocation.limit, "{fault}");
            let values = fault.values;
            assert_eq!(values.error, values.setpoint.wrapping_sub(values.position));

            stays_safe(&mut run, &fault);
            comes_back(&mut run);
            trips += 1;
        }
    }
    // 4 causes from 4 states, 3 from 3, the underrun and a speed from 1.
    assert_eq!(trips, 4 * 4 + 3 * 3 + 2);
}

/// Later causes and requests other than the reset change nothing.
fn stays_safe(run: &mut Loop, first: &Fault) {
    for sample in 0..8 {
        let output = run.tick_with(&mut Silent, |inputs| {
            inputs.emergency_stop = sample == 3;
            inputs.failed_transfers = u32::from(sample == 4);
            inputs.tick += u64::from(sample >= 5);
        });
        assert_eq!((output.code, output.power), (0, false));
        assert_eq!(output.state, State::Fault);
        assert_eq!(run.state.fault(), Some(first), "the first fault is kept");
        for event in Event::ALL
            .into_iter()
            .filter(|event| *event != Event::Reset)
        {
            let before = run.state;
            assert!(run.state.request(event).is_err());
            assert_eq!(run.state, before);
        }
    }
    run.tick += 1;
}

/// Reset, enable and a whole move.
fn comes_back(run: &mut Loop) {
    run.request(Event::Reset);
    assert_eq!(
        (run.state.state(), run.state.fault()),
        (State::Disabled, None)
    );
    let output = run.tick(&mut Silent);
    assert_eq!(
        (output.code, output.power, output.state),
        (0, false, State::Disabled)
    );
    run.request(Event::Enable);
    let output = run.tick(&mut Silent);
    assert_eq!(
        (output.code, output.power, output.state),
        (0, true, State::Enabled)
    );
    run.request(Event::Start);
    let home = i64::from(HOME);
    let mut source = ramp(home, home + 400, 2);
    for _ in 0..200 {
        assert!(run.tick(&mut source).power);
    }
    assert_eq!(run.state.state(), State::Moving);
    run.tick(&mut source);
    assert_eq!(
        (run.state.state(), run.state.fault()),
        (State::Holding, None)
    );
}

/// Contrast: without the monitor, or without the input, the same samples leave
/// the axis as it was.
#[test]
fn without_its_watch_nothing_trips() {
    for mut provocation in provocations() {
        provocation.monitors = Monitors::default();
        provocation.counter = CounterParameters::WORD;
        match provocation.cause {
            FaultCause::EmergencyStop | FaultCause::HardwareBus => provocation.inputs = |_, _| {},
            FaultCause::SetpointUnderrun => provocation.next = stay,
            _ => {}
        }
        for &state in provocation.from {
            let mut run = brought_to(guarded(&provocation), state);
            assert_eq!(
                provoke(&mut run, &provocation),
                None,
                "{:?}",
                provocation.cause
            );
            assert_eq!(run.state.state(), state);
        }
    }
}

/// Two provocations in one sample name the more urgent one, whichever monitor
/// looks first.
#[test]
fn the_more_urgent_of_two_causes_is_named() {
    let at_once = |cause: &Provocation| cause.last == 0;
    let provocations = provocations();
    let at_once: Vec<_> = provocations.iter().filter(|cause| at_once(cause)).collect();
    let mut pairs = 0;
    for one in &at_once {
        for other in &at_once {
            let mut axis = guarded(one);
            axis.monitors.ticks = Some(TickMonitor);
            axis.counter = CounterParameters::accept(16, Some(500)).expect("a counter");
            let mut run = brought_to(axis, State::Moving);
            let underrun = [one.cause, other.cause].contains(&FaultCause::SetpointUnderrun);
            let mut source = Script::new(|_| if underrun { Next::Underrun } else { stay() });
            run.tick_with(&mut source, |inputs| {
                (one.inputs)(0, inputs);
                if other.cause != one.cause {
                    (other.inputs)(0, inputs);
                }
            });
            let fault = run.state.fault().expect("a fault");
            assert_eq!(fault.cause, one.cause.min(other.cause));
            pairs += 1;
        }
    }
    assert_eq!(pairs, 5 * 5);
}

/// A cause that is still there at the reset trips again in the next sample.
#[test]
fn an_emergency_stop_that_is_still_pressed_trips_again() {
    let provocation = &provocations()[0];
    let mut run = brought_to(guarded(provocation), State::Moving);
    let first = provoke(&mut run, provocation).expect("a fault");
    run.request(Event::Reset);
    let second = provoke(&mut run, provocation).expect("a fault");
    assert_eq!((second.cause, second.tick), (first.cause, first.tick + 1));
}

/// A motion that starts in the same breath as the axis is enabled, and has no setpoint yet:
/// the record has the place where the axis stands, not the end of some motion before.
#[test]
fn an_underrun_at_the_start_tells_where_the_axis_stands() {
    let mut state = AxisState::start(&axis(LawWords::NONE));
    for event in [Event::Enable, Event::Start] {
        state.request(event).expect("it is disabled");
    }
    let output = state.tick(&rig::at(0, 4_711), &mut Script::new(|_| Next::Underrun));
    let fault = state.fault().expect("an underrun");
    assert_eq!(fault.cause, FaultCause::SetpointUnderrun);
    let values = fault.values;
    assert_eq!(
        (values.setpoint, values.position, values.error),
        (4_711, 4_711, 0)
    );
    assert_eq!((output.error_counts, state.peak_error_counts()), (0, 0));
}
