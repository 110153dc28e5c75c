//! Bumpless transfer: enabling, switching off in motion, and other gains in motion.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod rig;

use firmware::law::{Begin, Derivative, FilterWords, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Event, GainWord, Next, Setpoint, State};
use rig::{Loop, PAPER, Script, Silent, at, axis, dac, position, ramp, started, with_output};

/// The law's first code for an error and a difference without a take-over.
fn naive(words: LawWords, error: i32, difference: i32) -> i32 {
    let law = Law::accept(words, dac(14)).expect("accepted words");
    let output = Output::unlimited(dac(14), Quantiser::Nearest);
    let input = LawInput {
        error,
        difference,
        ..LawInput::default()
    };
    law.begin(
        &output,
        &mut LawState::start(&output),
        &input,
        Begin::AtRest,
    )
}

#[test]
fn enabling_far_from_0_holds_where_the_axis_stands() {
    let mut run = Loop::new(axis(PAPER), 5_000);
    for _ in 0..10 {
        let output = run.tick(&mut Silent);
        assert_eq!((output.code, output.power), (0, false));
    }
    run.request(Event::Enable);
    for _ in 0..500 {
        let output = run.tick(&mut Silent);
        assert_eq!(
            (output.code, output.error_counts, output.state),
            (0, 0, State::Enabled)
        );
    }
    assert_eq!(run.motor.counts(), 5_000);
    // Contrast: a law that starts with its setpoint at 0 drives to its limit.
    assert_eq!(naive(PAPER, -5_000, 0), -8_192);
}

/// Enabled and started in one breath it starts from rest, whatever gains come before its
/// first sample.
#[test]
fn gains_that_change_before_the_first_sample_are_those_it_starts_with() {
    let other = axis(LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..PAPER
    });
    let mut changed = started(&axis(PAPER));
    changed.change(&other);
    let first = |mut state: firmware::AxisState| {
        let mut ahead = Script::new(|_| Next::Setpoint(position(100)));
        state.tick(&at(0, 0), &mut ahead).code
    };
    assert_eq!(first(changed), first(started(&other)));
    // Contrast: 2 codes a count, not the code 0 of before.
    assert!((200..=201).contains(&first(changed)), "{}", first(changed));
}

/// An axis that coasts at 8 counts per sample is caught where it was enabled.
#[test]
fn enabling_in_motion_starts_from_code_0() {
    for derivative in [Derivative::Error, Derivative::Measurement] {
        let words = LawWords {
            derivative,
            ..PAPER
        };
        let mut run = Loop::new(axis(words), -70_000);
        run.motor.velocity = 8 << 16;
        for _ in 0..5 {
            run.tick(&mut Silent);
        }
        let speed = i32::try_from(run.motor.velocity >> 16).expect("a small speed");
        assert!(speed > 4, "still in motion");
        run.request(Event::Enable);
        let caught = run.motor.counts();
        let first = run.tick(&mut Silent);
        assert_eq!((first.code, first.error_counts, first.power), (0, 0, true));
        for _ in 0..8_000 {
            run.tick(&mut Silent);
        }
        assert!((run.motor.counts() - caught).abs() <= 1, "{derivative:?}");
    }
    // Contrast: the derivative of the measurement alone is a jump.
    let words = LawWords {
        derivative: Derivative::Measurement,
        ..PAPER
    };
    assert_eq!(naive(words, 0, 6), -300);
}

/// A loop in steady motion at 20 counts per sample, under about 500 codes.
fn in_motion(axis: firmware::Axis) -> Loop {
    let mut run = Loop::new(axis, 0);
    run.request(Event::Enable);
    run.request(Event::Start);
    let mut source = ramp(0, 1 << 30, 20);
    for _ in 0..300 {
        run.tick(&mut source);
    }
    assert!(run.motor.velocity > 19 << 16);
    run
}

#[test]
fn switching_off_runs_the_code_down_and_then_takes_the_power() {
    let slew = 30;
    let mut run = in_motion(with_output(PAPER, Some(slew), Quantiser::Nearest));
    let mut code = run.tick(&mut ramp(6_000, 1 << 30, 20)).code;
    assert!(code > 300, "{code}");
    run.request(Event::Disable);
    let mut samples = 0;
    while code > 0 {
        let output = run.tick(&mut Silent);
        let expected = (code - 30).max(0);
        assert_eq!(output.code, expected);
        assert_eq!(
            (output.state, output.power),
            (State::Disabled, expected != 0)
        );
        code = output.code;
        samples += 1;
    }
    assert!(samples > 10, "{samples}");
    for _ in 0..10 {
        let output = run.tick(&mut Silent);
        assert_eq!((output.code, output.power), (0, false));
    }

    // Contrast: without the limit the code is 0 at once.
    let mut run = in_motion(axis(PAPER));
    run.request(Event::Disable);
    let output = run.tick(&mut Silent);
    assert_eq!((output.code, output.power), (0, false));
}

/// The emergency stop does not wait for the slew limit.
#[test]
fn a_stop_while_the_code_runs_down_acts_at_once() {
    let mut run = in_motion(with_output(PAPER, Some(30), Quantiser::Nearest));
    run.request(Event::Disable);
    let output = run.tick(&mut Silent);
    assert!(output.code > 200 && output.power);
    let output = run.tick_with(&mut Silent, |inputs| inputs.emergency_stop = true);
    assert_eq!((output.code, output.power), (0, false));
}

/// Enabled again before the code has come to 0, the law goes on from it; also
/// where the start is asked for in the same breath.
#[test]
fn enabling_while_the_code_runs_down_goes_on_from_it() {
    for started in [false, true] {
        let mut run = in_motion(with_output(PAPER, Some(30), Quantiser::Nearest));
        run.request(Event::Disable);
        let before = run.tick(&mut Silent).code;
        assert!(before > 200, "{before}");
        run.request(Event::Enable);
        let here = run.motor.counts();
        let mut stay = Script::new(|_| Next::Setpoint(position(here)));
        if started {
            run.request(Event::Start);
        }
        let after = run.tick(&mut stay).code;
        assert_eq!(after, before, "started: {started}");
    }
    // Contrast: a law from rest asks for the derivative of nothing: code 0.
    assert_eq!(naive(PAPER, 0, 20), 0);
}

/// Other gains, half as stiff and twice as damped.
fn other(words: LawWords) -> LawWords {
    LawWords {
        kp: GainWord::new(1_717_986_918, 30),
        ki_dt: GainWord::new(10_737_418, 32),
        kd_per_dt: GainWord::new(104_857_600, 20),
        ..words
    }
}

/// Largest step of the code in the sample of the change, over every phase of a
/// motion that accelerates; the largest one of the samples before; and that of
/// the other gains if they met the same memory without being told.
fn steps(words: LawWords, quantiser: Quantiser) -> [i32; 3] {
    let (mut largest, mut usual, mut untold) = (0, 0, 0);
    let law = Law::accept(other(words), dac(14)).expect("accepted words");
    for change in 20..120 {
        let mut run = Loop::new(with_output(words, None, quantiser), 0);
        run.request(Event::Enable);
        run.request(Event::Start);
        // x = k²/16 counts.
        let mut source = Script::new(|k| {
            Next::Setpoint(Setpoint {
                velocity: i32::try_from(k << 13).expect("a speed"),
                ..position(i32::try_from(k * k / 16).expect("a position"))
            })
        });
        let (mut code, mut counts) = (0, 0);
        for sample in 0..=change {
            let mut memory = *run.state.law();
            let mut input = LawInput {
                difference: run.motor.counts() - counts,
                ..LawInput::default()
            };
            counts = run.motor.counts();
            if sample == change {
                run.axis.set_law(law);
                run.state.change(&run.axis);
            }
            let output = run.tick(&mut source);
            let step = (output.code - code).abs();
            if sample == change {
                largest = largest.max(step);
                input.error = output.error_counts;
                let jump = law.step(run.axis.output(), &mut memory, &input) - code;
                untold = untold.max(jump.abs());
            } else {
                usual = usual.max(step);
            }
            code = output.code;
        }
    }
    [largest, usual, untold]
}

#[test]
fn other_gains_in_motion_go_on_from_the_code_in_force() {
    let filter = FilterWords {
        smoothing: 1 << 29,
        fraction_bits: 12,
    };
    let quantisers = [
        Quantiser::Nearest,
        Quantiser::ErrorFeedback,
        Quantiser::Dither { seed: 7 },
    ];
    for derivative in [Derivative::Error, Derivative::Measurement] {
        for filter in [None, Some(filter)] {
            for quantiser in quantisers {
                let words = LawWords {
                    derivative,
                    filter,
                    ..PAPER
                };
                let [step, usual, jump] = steps(words, quantiser);
                assert!(step <= 1, "{step} at {words:?}, {quantiser:?}");
                // Contrast: untold, a jump far beyond the steps of the motion itself.
                println!(
                    "{derivative:?} {filter:?} {quantiser:?}: {step}, untold {jump}, usual {usual}"
                );
                assert!(jump > 100, "{jump} at {words:?}, {quantiser:?}");
            }
        }
    }
}

/// A steady motion of 0.3 counts per sample, followed exactly, under a slow
/// filter; the words change to `after` at `change`. Largest departure of the
/// code from the one before, in 150 samples.
fn departure(before: LawWords, after: LawWords, change: i32) -> i32 {
    let mut axis_now = axis(before);
    let mut state = rig::started(&axis_now);
    let (mut code, mut departure) = (0, 0);
    for k in 0..change + 150 {
        if k == change {
            axis_now = axis(after);
            state.change(&axis_now);
        }
        let counts = 3 * k / 10;
        let mut source = Script::new(|_| Next::Setpoint(position(counts)));
        let tick = u64::try_from(k).expect("a sample");
        let output = state.tick(&at(tick, counts), &mut source);
        if k < change {
            code = output.code;
        } else {
            departure = departure.max((output.code - code).abs());
        }
    }
    departure
}

/// The speed is what it was: with other gains the filter goes on from what it
/// knows, and the samples after the change are as quiet as it is.
#[test]
fn other_gains_leave_the_filter_its_memory() {
    let filter = |fraction_bits| FilterWords {
        smoothing: 1 << 26,
        fraction_bits,
    };
    let words = LawWords {
        ki_dt: GainWord::new(1 << 20, 32),
        derivative: Derivative::Measurement,
        filter: Some(filter(12)),
        ..PAPER
    };
    let stiffer = LawWords {
        kp: GainWord::new(1_932_735_283, 29),
        ..words
    };
    // Contrast: a filter of another format starts anew, from the difference of
    // one sample, 0 or 1 count instead of 0.3.
    let anew = LawWords {
        filter: Some(filter(11)),
        ..words
    };
    for change in 300..310 {
        let goes_on = departure(words, stiffer, change);
        assert!(goes_on <= 2, "{goes_on} at {change}");
        let starts = departure(words, anew, change);
        assert!(starts > 10, "{starts} at {change}");
    }
}
