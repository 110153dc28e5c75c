//! Wind-up in a closed loop of integers: how far an axis shoots past its target
//! after it stood at a limit, without treatment and with either of the two.
//!
//! Three ways to stand at a limit: the converter's range, a slew limit, and a
//! feed-forward that takes the whole range by itself. A treatment that looks at
//! the range alone, or at the sum without the feed-forward, winds up in the
//! last two; that is the contrast.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use firmware::law::{AntiWindup, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord};

/// `Δt/T_t` = 1/32.
const TREATMENTS: [AntiWindup; 2] = [
    AntiWindup::Clamp,
    AntiWindup::BackCalculation { tracking: 1 << 26 },
];

/// Knowledge that the law has of the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sees {
    /// The window of this sample, and a sum with the feed-forward.
    All,
    /// The converter's range only.
    RangeOnly,
    /// A sum without the feed-forward, which is added behind the law.
    NoFeedForward,
    /// All, but a step of the integral that would leave the window is refused
    /// whole.
    WholeSteps,
}

/// Results of a run.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// Distance that the axis went past the last reference \[counts\].
    past: i64,
    /// The largest integral \[codes\].
    integral: i64,
    /// The last sample more than 20 counts from the last reference.
    settled: i32,
    /// Position in the end, from the last reference \[counts\].
    apart: i64,
}

/// A loop: law and output of 12 bits, and an axis in 1/64 counts.
#[derive(Debug, Clone, Copy)]
struct Loop {
    words: LawWords,
    slew: Option<u32>,
    sees: Sees,
    /// From the position and the code to the next position \[1/64 counts\].
    axis: fn(i64, i64) -> i64,
    /// Reference and velocity at sample `k` \[counts, counts per sample\].
    reference: fn(i32) -> (i32, i32),
}

impl Loop {
    fn run(mut self, anti_windup: AntiWindup) -> Run {
        self.words.anti_windup = anti_windup;
        let feed_forward = self.words.velocity_ff;
        if self.sees == Sees::NoFeedForward {
            self.words.velocity_ff = GainWord::new(0, 0);
        }
        let dac = Dac::with_bits(12).expect("12 bits");
        let law = Law::accept(self.words, dac).expect("accepted");
        let seen = self.slew.filter(|_| self.sees != Sees::RangeOnly);
        let output = Output::new(dac, seen, Quantiser::Nearest).expect("a slew limit");
        let mut state = LawState::start(&output);
        let slew = self.slew.map_or(1 << 24, u32::cast_signed);
        let mut code = 0_i32;
        let (mut position, [mut past, mut integral], mut settled) = (0_i64, [0, 0], 0);
        const SAMPLES: i32 = 12_000;
        let (target, _) = (self.reference)(SAMPLES);
        for k in 0..SAMPLES {
            let (r, velocity) = (self.reference)(k);
            let count = i32::try_from(position >> 6).expect("a short travel");
            let mut input = LawInput {
                error: r - count,
                velocity,
                ..LawInput::default()
            };
            let range = |code: i32| code.clamp(dac.min_code(), dac.max_code());
            let window = [range(code - slew), range(code + slew)];
            if self.sees == Sees::WholeSteps {
                let terms = law.terms(&mut state.clone(), &input);
                let whole = (terms.direct + state.integral() + terms.step)
                    .round()
                    .to_num::<i32>();
                let excess = whole - whole.clamp(window[0], window[1]);
                input.hold_integral = excess != 0 && (excess > 0) == (input.error > 0);
            }
            let mut given = law.step(&output, &mut state, &input);
            if self.sees == Sees::NoFeedForward {
                let gain = i64::from(feed_forward.mantissa) * i64::from(velocity);
                given += i32::try_from(gain >> feed_forward.fraction_bits).expect("12 bits");
            }
            code = given.clamp(window[0], window[1]);
            position = (self.axis)(position, i64::from(code));
            let apart = (position >> 6) - i64::from(target);
            past = past.max(apart);
            settled = if apart.abs() > 20 { k } else { settled };
            integral = integral.max(state.integral().to_num());
        }
        let apart = (position >> 6) - i64::from(target);
        Run {
            past,
            integral,
            settled,
            apart,
        }
    }

    /// Asserts that both treatments cut what shoots over without any by
    /// `factor`, and that the axis comes to rest at its target.
    fn assert_cut_by(self, factor: i64) {
        let wound_up = self.run(AntiWindup::None);
        println!("none: {wound_up:?}");
        for treatment in TREATMENTS {
            let run = self.run(treatment);
            println!("{treatment:?}: {run:?}");
            assert!(
                run.past * factor <= wound_up.past,
                "{run:?}, {wound_up:?} with {treatment:?}"
            );
            assert!(run.apart.abs() <= 2, "{run:?} with {treatment:?}");
        }
    }
}

/// `Kp` = 1, `Ki·Δt` = 2^−`integral`.
fn gains(integral: u8) -> LawWords {
    LawWords {
        kp: GainWord::new(1 << 30, 30),
        ki_dt: GainWord::new(1 << (30 - integral), 30),
        ..LawWords::NONE
    }
}

/// A step of 20 000 counts, 32 counts a sample at most.
const RANGE: fn() -> Loop = || Loop {
    words: gains(8),
    slew: None,
    sees: Sees::All,
    axis: |position, code| position + code,
    reference: |_| (20_000, 0),
};

/// An axis that follows its code, which may move by 2 a sample.
const SLEW: fn() -> Loop = || Loop {
    words: LawWords {
        kp: GainWord::new(1 << 28, 30),
        ..gains(6)
    },
    slew: Some(2),
    sees: Sees::All,
    axis: |position, code| position + ((code << 6) - position) / 16,
    reference: |_| (1_500, 0),
};

/// An axis that follows its code, held for 6000 samples where no code takes it,
/// with a feed-forward that alone is more than the largest code; then 1000.
const FAR: fn() -> Loop = || Loop {
    words: LawWords {
        velocity_ff: GainWord::new(1 << 22, 32),
        ..SLEW().words
    },
    slew: None,
    reference: |k| {
        let there = if k < FAR_UNTIL { 2_300 } else { 1_000 };
        (there, there << 10)
    },
    ..SLEW()
};
const FAR_UNTIL: i32 = 6_000;

#[test]
fn at_the_end_of_the_range() {
    RANGE().assert_cut_by(10);
}

#[test]
fn under_a_slew_limit() {
    SLEW().assert_cut_by(10);
}

/// Samples from the time at which the target can be reached to its reaching.
fn late(run: Loop, treatment: AntiWindup) -> i32 {
    let run = run.run(treatment);
    assert!(run.apart.abs() <= 2, "{run:?} with {treatment:?}");
    run.settled - FAR_UNTIL
}

#[test]
fn under_a_feed_forward_that_takes_the_whole_range() {
    let wound_up = late(FAR(), AntiWindup::None);
    for treatment in TREATMENTS {
        let treated = late(FAR(), treatment);
        println!("{treatment:?}: {treated} samples late instead of {wound_up}");
        assert!(treated * 4 <= wound_up, "{treated} of {wound_up}");
    }
}

#[test]
fn contrast_a_treatment_that_sees_less_winds_up() {
    for treatment in TREATMENTS {
        let unseen = Loop {
            sees: Sees::RangeOnly,
            ..SLEW()
        };
        let [seen, unseen] = [SLEW(), unseen].map(|run| run.run(treatment).past);
        println!("slew, {treatment:?}: {unseen} counts past instead of {seen}");
        assert!(seen <= 5 && unseen >= 100);

        let unseen = Loop {
            sees: Sees::NoFeedForward,
            ..FAR()
        };
        let [seen, unseen] = [FAR(), unseen].map(|run| late(run, treatment));
        println!("feed-forward, {treatment:?}: {unseen} samples late instead of {seen}");
        // The integral it took on, 2000 codes, is paid back at 1047/64 a sample.
        assert!(unseen >= seen + 100);
    }
}

#[test]
fn contrast_a_clamp_of_whole_steps_never_arrives_under_a_slew_limit() {
    // (Ki·Δt)·e is 23 codes at first and the window 2 wide: no step is allowed,
    // and the axis stays where Kp·e holds it.
    let whole = Loop {
        sees: Sees::WholeSteps,
        ..SLEW()
    };
    let run = whole.run(AntiWindup::None);
    println!("{run:?}");
    assert_eq!(run.integral, 0);
    assert!(run.apart < -1_000);
}

#[test]
fn without_an_integral_gain_nothing_is_left_behind() {
    // What is drawn from an integral that nothing fills would stay for ever.
    let step = Loop {
        words: LawWords {
            ki_dt: GainWord::new(0, 0),
            ..gains(8)
        },
        ..RANGE()
    };
    for treatment in TREATMENTS {
        let run = step.run(treatment);
        assert_eq!(
            (run.past, run.integral, run.apart),
            (0, 0, 0),
            "{treatment:?}"
        );
    }
}
