//! An axis that is a constant of the image is the one that is built at run time.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use core::hint::black_box;

use firmware::axis::{Feedback, Monitors, Rest};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::{
    Axis, AxisState, BacklashCompensation, CounterParameters, Dac, ErrorRange, Event, GainWord,
    Inputs, Motion, MotionPlan, PlannedMotion, Refusal, Room, Trigger,
};

const WORDS: LawWords = LawWords {
    kp: GainWord::new(13_421_773, 22),
    ki_dt: GainWord::new(10_737_418, 31),
    kd_per_dt: GainWord::new(13_107_200, 18),
    velocity_ff: GainWord::new(5_000, 32),
    acceleration_ff: GainWord::new(20_000, 32),
    friction_ff: GainWord::new(40 << 10, 10),
    derivative: Derivative::Measurement,
    filter: Some(FilterWords {
        smoothing: 1 << 29,
        fraction_bits: 10,
    }),
    anti_windup: AntiWindup::BackCalculation { tracking: 1 << 27 },
    ..LawWords::NONE
};

macro_rules! accepted {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(_) => panic!("the words are accepted"),
        }
    };
}

/// Everything on, from these words and this counter's bits.
const fn axis(words: LawWords, bits: u8) -> Axis {
    let dac = accepted!(Dac::with_bits(14));
    let output = accepted!(Output::new(dac, Some(900), Quantiser::ErrorFeedback));
    let mut axis = Axis::new(accepted!(Law::accept(words, dac)), output);
    let room = Room {
        velocity: 4 << 32,
        acceleration: 1 << 30,
    };
    axis.counter = accepted!(CounterParameters::accept(bits, Some(3_000)));
    axis.feedback = Feedback::Motor;
    axis.backlash_compensation = Some(accepted!(BacklashCompensation::plan(
        40,
        room,
        Trigger::Velocity
    )));
    axis.rest = Rest {
        dead_band: 2,
        ..Rest::NONE
    };
    let lag = GainWord::new(5, 1);
    axis.monitors = Monitors {
        following_error: Some(accepted!(FollowingErrorMonitor::accept(30_000, lag, 18))),
        encoder_loss: Some(accepted!(EncoderLossMonitor::accept(4_000, 400))),
        saturation: Some(accepted!(SaturationMonitor::accept(300))),
        ticks: Some(TickMonitor),
    };
    axis
}

const AXIS: Axis = axis(WORDS, 16);

/// The codes of a motion over `AXIS`, which stands still.
fn codes(axis: &Axis) -> Vec<i32> {
    let second_ps = 1_000_000_000_000 / 64;
    let plan = MotionPlan::new(6_000 << 32, [second_ps; 7], 1_000_000).expect("a motion");
    let planned = PlannedMotion::<64>::new(&plan, axis.law().words()).expect("few stretches");
    let mut source = Motion::new(&planned, 0);
    let mut state = AxisState::start(axis);
    state.request(Event::Enable).expect("disabled");
    state.request(Event::Start).expect("enabled");
    (0..200)
        .map(|tick| {
            let inputs = Inputs {
                tick,
                motor_register: 0xFFF0,
                ..Inputs::default()
            };
            state.tick(&inputs, &mut source).code
        })
        .collect()
}

#[test]
fn the_constant_is_what_is_built_at_run_time() {
    let built = axis(black_box(WORDS), black_box(16));
    assert_eq!(AXIS, built);
    let codes_of_constant = codes(&AXIS);
    assert_eq!(codes_of_constant, codes(&built));
    assert!(codes_of_constant.contains(&8_191), "driven to the limit");
    // Contrast: a gain that is one part in 2^13 less.
    let mut other = WORDS;
    other.kp.mantissa -= 1 << 11;
    assert_ne!(codes_of_constant, codes(&axis(other, 16)));
}

#[test]
fn constant_defaults_are_the_defaults() {
    const RANGE: Result<ErrorRange, Refusal> = ErrorRange::from_bits(17);
    assert_eq!(RANGE, ErrorRange::from_bits(black_box(17)));
    assert_eq!(Rest::NONE, Rest::default());
    assert_eq!(Monitors::NONE, Monitors::default());
}
