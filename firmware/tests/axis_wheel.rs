//! Positions on the wheel: a move across the end of a counter is a move like
//! any other; and two encoders, each in its place.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;
mod rig;

use exact::Random;
use exact::model::Model;
use firmware::axis::{Feedback, Monitors};
use firmware::law::{Begin, Derivative, LawInput, LawWords};
use firmware::monitor::FollowingErrorMonitor;
use firmware::output::Quantiser;
use firmware::{
    Axis, CounterParameters, Event, GainWord, Inputs, Next, Observed, Setpoint, SetpointSource,
};
use rig::{Loop, Motor, PAPER, Silent, at, axis, dac, position};

/// A move by 600 counts and back, from wherever the axis stands at its start.
#[derive(Default)]
struct ThereAndBack {
    start: Option<i32>,
    sample: i32,
}

impl SetpointSource for ThereAndBack {
    fn next(&mut self, observed: &Observed) -> Next {
        let start = *self.start.get_or_insert(observed.position);
        let k = self.sample;
        self.sample += 1;
        let along = 600 - (9 * k - 600).abs();
        Next::Setpoint(position(start.wrapping_add(along.max(-100))))
    }
}

/// The codes of the move from `start`, the register cut to `shown` bits and
/// read as a counter of `read` bits.
fn codes(start: i64, shown: u32, read: u8) -> Vec<i32> {
    let counter = CounterParameters::accept(read, None).expect("a width");
    let mut axis = axis(PAPER);
    axis.counter = counter;
    let mut run = Loop::new(axis, start);
    run.request(Event::Enable);
    run.tick(&mut Silent);
    run.request(Event::Start);
    let mut source = ThereAndBack::default();
    (0..700)
        .map(|_| {
            let output = run.tick_with(&mut source, |inputs| {
                inputs.motor_register &= u32::MAX >> (u32::BITS - shown);
            });
            output.code
        })
        .collect()
}

#[test]
fn a_move_across_the_wrap_gives_the_codes_of_any_other() {
    let here = codes(1_000, 32, 32);
    assert!(here.iter().any(|code| code.abs() > 300), "a lively move");
    let mut compared = 0;
    for bits in [8_u8, 12, 16, 24, 32] {
        let wheel = 1_i64 << bits;
        for end in [0, wheel / 2, wheel, -wheel / 2, 5 * wheel, 1 << 16, 1 << 31] {
            for before in [300, 1, 0, -50] {
                let there = codes(end - before, u32::from(bits), bits);
                assert_eq!(here, there, "{bits} bits, {before} counts before {end}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 5 * 7 * 4);
}

/// Contrast: the register of 16 bits as a plain number jumps by 65 536 counts.
#[test]
fn a_register_of_16_bits_is_no_plain_number() {
    let here = codes(1_000, 32, 32);
    let across = codes((1 << 16) - 300, 16, 32);
    assert_ne!(here, across);
    assert!(
        across.contains(&8_191) || across.contains(&-8_192),
        "driven to a limit"
    );
    // Away from the end it happens to work.
    assert_eq!(here, codes(10_000, 16, 32));
}

/// Number of 5000 codes that differ from the exact law; motor and load are two
/// unrelated walks. `swapped` gives each the other's place.
fn dual_loop_differs(swapped: bool) -> (usize, usize) {
    let words = LawWords {
        derivative: Derivative::Measurement,
        ..PAPER
    };
    let mut model = Model::new(words, 14, None, Quantiser::Nearest);
    let mut axis = axis(words);
    axis.feedback = Feedback::Load(CounterParameters::accept(12, None).expect("a width"));
    axis.counter = CounterParameters::accept(16, None).expect("a width");
    let mut state = rig::started(&axis);
    let mut random = Random(4);
    let (mut motor, mut reference) = (0_i64, 0_i64);
    let mut last_motor = None;
    let (mut different, mut limited) = (0, 0);
    for tick in 0..5_000 {
        motor += random.between(-30, 33);
        reference += random.between(-9, 12);
        // The load stays around its setpoint, so that the integral does.
        let load = reference - random.between(-200, 200);
        let (shown_motor, shown_load) = if swapped {
            (load, motor)
        } else {
            (motor, load)
        };
        let low =
            |counts: i64, bits: u32| u32::try_from(counts & ((1 << bits) - 1)).expect("low bits");
        let inputs = Inputs {
            load_register: Some(low(shown_load, 12)),
            ..at(tick, low(shown_motor, 16).cast_signed())
        };
        let setpoint = position(i32::try_from(reference).expect("a short walk"));
        let mut source = rig::Script::new(|_| Next::Setpoint(setpoint));
        let output = state.tick(&inputs, &mut source);

        let small = |counts: i64| i32::try_from(counts).expect("a short walk");
        let input = LawInput {
            error: small(reference - load),
            difference: small(last_motor.map_or(0, |last| motor - last)),
            ..LawInput::default()
        };
        let begin = last_motor.is_none().then_some(Begin::AtRest);
        last_motor = Some(motor);
        let exact = i32::try_from(model.step(&input, begin).code).expect("14 bits");
        different += usize::from(output.code != exact);
        limited += usize::from(dac(14).is_limit(exact));
    }
    (different, limited)
}

#[test]
fn position_from_the_load_and_damping_from_the_motor() {
    let (different, limited) = dual_loop_differs(false);
    assert_eq!(different, 0);
    assert!(
        limited < 500,
        "{limited} of 5000 codes at a limit show nothing"
    );
    // Contrast: the encoders in each other's place.
    let (different, _) = dual_loop_differs(true);
    assert!(different > 4_000, "{different}");
}

#[test]
fn the_peak_of_the_following_error_is_kept_and_can_be_reset() {
    let monitor = FollowingErrorMonitor::accept(1_000, GainWord::new(0, 0), 0).expect("a monitor");
    let mut guarded = axis(PAPER);
    guarded.monitors = Monitors {
        following_error: Some(monitor),
        ..Monitors::default()
    };
    let peaks = |axis: Axis| {
        let mut run = Loop::new(axis, 0);
        // Contrast: before there is power nothing is kept.
        for counts in [0, 700, -80_000] {
            run.motor = Motor::at(counts);
            run.tick(&mut Silent);
            assert_eq!(run.state.peak_error_counts(), 0);
        }
        run.motor = Motor::at(0);
        run.request(Event::Enable);
        run.request(Event::Start);
        let mut source = ThereAndBack::default();
        let mut largest = 0;
        for _ in 0..250 {
            largest = largest.max(run.tick(&mut source).error_counts.unsigned_abs());
        }
        let first = run.state.peak_error_counts();
        run.state.reset_peak_error();
        let cleared = run.state.peak_error_counts();
        run.motor = Motor::at(run.motor.position >> 16);
        let next = run.tick(&mut source).error_counts.unsigned_abs();
        (largest, first, cleared, next, run.state.peak_error_counts())
    };
    let (largest, first, cleared, next, second) = peaks(guarded);
    assert!(largest > 10, "{largest}");
    assert_eq!((first, cleared, second), (largest, 0, next));
    assert_ne!(next, largest);
    // Without the monitor too.
    assert_eq!(peaks(axis(PAPER)), peaks(guarded));
}

/// The setpoint of `Setpoint::default()` is used nowhere: an axis far away that
/// holds knows its own.
#[test]
fn holding_keeps_the_last_setpoint_of_the_motion() {
    let mut run = Loop::new(axis(PAPER), 40_000);
    run.request(Event::Enable);
    run.request(Event::Start);
    let last = Setpoint {
        velocity: 5,
        acceleration: 6,
        position: 40_007,
        ahead: None,
    };
    run.tick(&mut rig::Script::new(|_| Next::Last(last)));
    for _ in 0..5 {
        let stood = run.motor.counts();
        let output = run.tick(&mut Silent);
        assert_eq!(output.error_counts, 40_007 - stood);
    }
}
