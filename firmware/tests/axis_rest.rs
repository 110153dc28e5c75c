//! At rest: what an integrator hunts for behind a quantiser and behind static
//! friction, and what makes it stand still.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod rig;

use firmware::axis::Rest;
use firmware::law::{AntiWindup, Derivative, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Axis, Event, GainWord, Next, State};
use rig::{Loop, PAPER, Script, at, dac, position, ramp, with_output};

/// A motor in 2^−16 counts and samples: `v ← v + g·(code − load) − v/20`, with
/// static friction of twice the dry friction where there is any.
#[derive(Debug, Clone, Copy, Default)]
struct Rig {
    position: i64,
    velocity: i64,
    /// `g`: acceleration of one code.
    gain: i64,
    /// Load \[hundredths of a code\].
    load: i64,
    /// Dry friction as an acceleration.
    friction: i64,
}

impl Rig {
    fn step(&mut self, code: i32) {
        let drive = self.gain * (100 * i64::from(code) - self.load) / 100;
        if self.velocity == 0 && drive.abs() <= 2 * self.friction {
            return;
        }
        let before = self.velocity;
        let direction = if before == 0 {
            drive.signum()
        } else {
            before.signum()
        };
        // Rounded up in size: what coasts comes to rest.
        let drag = (before + 19 * before.signum()) / 20;
        self.velocity += drive - drag - self.friction * direction;
        // Friction stops, it does not turn round.
        if self.friction > 0 && self.velocity * direction < 0 {
            self.velocity = 0;
        }
        self.position += self.velocity;
    }
}

/// Record of the last third of a long rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Seen {
    /// Peak to peak of the position \[2^−16 counts\].
    peak_to_peak: i64,
    /// Largest distance from the setpoint \[counts\].
    distance: u32,
    /// Largest and smallest integral differ.
    integral_moves: bool,
}

/// A step to 500 counts, and then rest.
fn rest(axis: Axis, mut rig: Rig) -> Seen {
    const SAMPLES: u64 = 60_000;
    let mut run = Loop::new(axis, 0);
    run.request(Event::Enable);
    run.request(Event::Start);
    let mut source = Script::new(|_| Next::Last(position(500)));
    let (mut low, mut high) = (i64::MAX, i64::MIN);
    let (mut distance, mut integral, mut integral_moves) = (0, None, false);
    for tick in 0..SAMPLES {
        let counts = i32::try_from(rig.position >> 16).expect("a short move");
        let output = run.state.tick(&at(tick, counts), &mut source);
        assert_eq!(output.state, State::Holding);
        rig.step(output.code);
        if tick >= SAMPLES * 2 / 3 {
            low = low.min(rig.position);
            high = high.max(rig.position);
            distance = distance.max(output.error_counts.unsigned_abs());
            let now = run.state.law().integral();
            integral_moves |= integral.replace(now).is_some_and(|last| last != now);
        }
    }
    Seen {
        peak_to_peak: high - low,
        distance,
        integral_moves,
    }
}

/// Counts with one decimal.
fn counts(peak_to_peak: i64) -> String {
    let tenths = peak_to_peak * 10 / 65_536;
    format!("{}.{} counts", tenths / 10, tenths % 10)
}

/// The load of 0.37 codes has no code of its own. The nearest one is wrong by
/// 0.37 or 0.63, and the integral goes to and fro between the two; the mean of
/// the codes with error feedback is right.
#[test]
fn error_feedback_shrinks_the_limit_cycle_of_a_fractional_code() {
    // Kp = 0.02, Ki·Δt = 0.0001, Kd/Δt = 0.4 codes per count.
    let words = LawWords {
        kp: GainWord::new(85_899_346, 32),
        ki_dt: GainWord::new(429_497, 32),
        kd_per_dt: GainWord::new(107_374_182, 28),
        derivative: Derivative::Measurement,
        ..LawWords::NONE
    };
    let peak_to_peak = |quantiser, load| {
        let rig = Rig {
            gain: 20_000,
            load,
            ..Rig::default()
        };
        rest(with_output(words, None, quantiser), rig).peak_to_peak
    };
    let nearest = peak_to_peak(Quantiser::Nearest, 37);
    let feedback = peak_to_peak(Quantiser::ErrorFeedback, 37);
    println!(
        "0.37 codes: nearest {}, error feedback {}",
        counts(nearest),
        counts(feedback)
    );
    assert!(nearest > 3 << 16, "{nearest}");
    assert!(feedback < nearest / 2, "{feedback} against {nearest}");

    // Contrast: it is the integral that hunts. Without one a load of a whole
    // code is held by that code, and nothing moves.
    let words = LawWords {
        ki_dt: GainWord::new(0, 0),
        ..words
    };
    let rig = Rig {
        gain: 20_000,
        load: 100,
        ..Rig::default()
    };
    assert_eq!(
        rest(with_output(words, None, Quantiser::Nearest), rig).peak_to_peak,
        0
    );
}

/// Static friction holds the axis a little off; the integral grows until it
/// breaks away and lands on the other side.
#[test]
fn a_dead_band_ends_the_hunting_of_static_friction() {
    // Kp = 3.2, Ki·Δt = 0.02, Kd/Δt = 50 codes per count.
    let words = LawWords {
        kp: GainWord::new(1_717_986_918, 29),
        ki_dt: GainWord::new(85_899_346, 32),
        kd_per_dt: GainWord::new(1_677_721_600, 25),
        derivative: Derivative::Measurement,
        ..LawWords::NONE
    };
    let rig = Rig {
        gain: 131,
        friction: 2_620,
        ..Rig::default()
    };
    let with = |dead_band, hold_integral, anti_windup| {
        let words = LawWords {
            anti_windup,
            ..words
        };
        let rest_words = Rest {
            dead_band,
            hold_integral,
        };
        let mut axis = with_output(words, None, Quantiser::Nearest);
        axis.rest = rest_words;
        rest(axis, rig)
    };
    let hunting = with(0, false, AntiWindup::None);
    println!(
        "static friction: {} without a dead band",
        counts(hunting.peak_to_peak)
    );
    assert!(hunting.peak_to_peak > 4 << 16, "{hunting:?}");
    assert!(hunting.integral_moves);

    for anti_windup in [AntiWindup::None, AntiWindup::Clamp] {
        let still = with(3, false, anti_windup);
        assert_eq!(still.peak_to_peak, 0, "{still:?}");
        assert!(!still.integral_moves && still.distance <= 3, "{still:?}");
    }
    // The integral held without a band: the axis stands where friction left it.
    let held = with(0, true, AntiWindup::None);
    println!("integral held: {} from its setpoint", held.distance);
    assert_eq!(held.peak_to_peak, 0, "{held:?}");
    assert!(!held.integral_moves, "{held:?}");
}

/// The dead band is for rest: a move is followed to the count.
#[test]
fn the_dead_band_does_nothing_in_motion() {
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let mut axis = with_output(words, None, Quantiser::Nearest);
    axis.rest = Rest {
        dead_band: 5,
        hold_integral: true,
    };
    let code = |last: bool| {
        let mut run = Loop::new(axis, 0);
        run.request(Event::Enable);
        run.request(Event::Start);
        let setpoint = position(5);
        let mut source = Script::new(|_| {
            if last {
                Next::Last(setpoint)
            } else {
                Next::Setpoint(setpoint)
            }
        });
        let output = run.tick(&mut source);
        // What is reported is what was measured.
        assert_eq!(output.error_counts, 5);
        output.code
    };
    assert_eq!(code(false), 10);
    assert_eq!(code(true), 0);
}

/// Largest step of the code while the axis comes to rest in a band of 12
/// counts, where the derivative of the error sees steps of 0 and 1 count.
fn largest_step(derivative: Derivative) -> i32 {
    let words = LawWords {
        derivative,
        ..PAPER
    };
    let rest = Rest {
        dead_band: 12,
        hold_integral: false,
    };
    let mut axis = with_output(words, None, Quantiser::Nearest);
    axis.rest = rest;
    let mut run = Loop::new(axis, 0);
    run.request(Event::Enable);
    run.request(Event::Start);
    let mut source = ramp(0, 400, 2);
    let (mut step, mut code) = (0, 0);
    for _ in 0..2_500 {
        let output = run.tick(&mut source);
        step = step.max((output.code - code).abs());
        code = output.code;
    }
    assert_eq!(run.state.state(), State::Holding);
    step
}

/// The edge of the band is a step of the proportional term, not one of the
/// derivative: that one would be twelve counts at once.
#[test]
fn the_edge_of_the_dead_band_gives_no_kick() {
    // Kp·13 for the edge, and Kd/Δt for a difference of 2 counts that comes
    // and one that goes: 41.6 + 200.
    for derivative in [Derivative::Error, Derivative::Measurement] {
        let step = largest_step(derivative);
        println!("{derivative:?}: largest step {step} codes");
        assert!(step <= 242, "{step} with {derivative:?}");
    }

    // Contrast: the same law, told that the error is 0 from one sample to the next.
    let law = Law::accept(PAPER, dac(14)).expect("accepted words");
    let output = Output::unlimited(dac(14), Quantiser::Nearest);
    let codes = |second: LawInput| {
        let mut state = LawState::start(&output);
        let first = LawInput {
            error: 13,
            ..LawInput::default()
        };
        law.step(&output, &mut state, &first);
        law.terms(&mut state, &second).direct
    };
    let within = LawInput {
        error: 12,
        within_dead_band: true,
        ..LawInput::default()
    };
    assert_eq!(codes(within), -50);
    assert_eq!(codes(LawInput::default()), -650);
}
