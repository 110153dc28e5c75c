//! With every option off, the axis is the paper's controller: the same words
//! give the same codes, bit for bit, from sample 0 on.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod rig;

use firmware::law::{AntiWindup, Derivative, Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::reference::TableSource;
use firmware::{Axis, Controller, ControllerState, GainWord, SetpointTable, State};
use proptest::prelude::*;
use rig::{Motor, PAPER, at, dac};

const ENTRIES: usize = 256;

/// Accepted words, gains from 0 to beyond stability.
fn words() -> impl Strategy<Value = LawWords> {
    let mantissa = || prop_oneof![6 => 0..=i32::MAX, 1 => Just(i32::MAX), 1 => Just(0)];
    let word =
        move |bits| (mantissa(), bits).prop_map(|(mantissa, bits)| GainWord::new(mantissa, bits));
    (word(28..=32_u8), word(30..=32), word(22..=32), 17..=20_u8).prop_filter_map(
        "not accepted",
        |(kp, ki_dt, kd_per_dt, error_bits)| {
            let words = LawWords {
                kp,
                ki_dt,
                kd_per_dt,
                error_bits,
                integral_bits: 26,
                ..LawWords::NONE
            };
            Law::accept(words, dac(20)).ok()?;
            Some(words)
        },
    )
}

/// Number of `samples` codes that differ in a closed loop, the motor driven by
/// the paper's code; and how many different codes there were.
fn differing(
    axis: Axis,
    words: LawWords,
    bits: u32,
    table: &[i32],
    samples: usize,
) -> (usize, usize) {
    let table = SetpointTable::<ENTRIES>::from_counts(table).expect("a table");
    let law = Law::accept(words, dac(bits)).expect("accepted words");
    let controller = Controller::new(law, table.clone());
    let mut controller_state = ControllerState::start(&controller);

    let mut source = TableSource::new(&table);
    let mut state = rig::started(&axis);
    let mut motor = Motor::at(i64::from(table.at(0)));
    let mut seen = std::collections::BTreeSet::new();
    let mut different = 0;
    for tick in 0..samples {
        let counts = motor.counts();
        let paper = controller.tick(&mut controller_state, counts);
        let output = state.tick(&at(tick as u64, counts), &mut source);
        assert!(output.power && state.fault().is_none());
        assert_eq!(output.error_counts, paper.error_counts);
        different += usize::from(output.code != paper.code);
        seen.insert(paper.code);
        motor.step(paper.code);
    }
    assert_eq!(state.state(), State::Holding);
    (different, seen.len())
}

fn plain(words: LawWords, bits: u32) -> Axis {
    let law = Law::accept(words, dac(bits)).expect("accepted words");
    let output = Output::new(dac(bits), None, Quantiser::Nearest).expect("no slew limit");
    Axis::new(law, output)
}

/// A walk over the wheel, across its end for some starts.
fn table() -> impl Strategy<Value = Vec<i32>> {
    let start = prop_oneof![any::<i32>(), Just(i32::MAX - 40), Just(0)];
    let steps = prop::collection::vec((-40..=40_i32, 1..40_usize), 1..20);
    (start, steps).prop_map(|(start, steps)| {
        let mut position = start;
        let walk = steps
            .iter()
            .flat_map(|&(step, samples)| [step].repeat(samples));
        let walk = walk.map(|step| {
            position = position.wrapping_add(step);
            position
        });
        [start].into_iter().chain(walk).take(ENTRIES).collect()
    })
}

proptest! {
    #[test]
    fn the_codes_are_those_of_the_paper(
        words in words(), bits in 2..=20_u32, table in table(),
    ) {
        let (different, _) = differing(plain(words, bits), words, bits, &table, 2_000);
        prop_assert_eq!(different, 0);
    }
}

/// A ramp, a reversal and a step that drives the output to its limit.
fn lively() -> Vec<i32> {
    let ramp = (0..150).map(|k| 7 * k);
    let back = (0..80).map(|k| 1_200 - 13 * k);
    ramp.chain(back).chain([6_000]).collect()
}

/// Contrast: the measure sees each option of the law and of the output.
#[test]
fn an_option_that_is_on_is_noticed() {
    let samples = 1_000;
    let (different, codes) = differing(plain(PAPER, 14), PAPER, 14, &lively(), samples);
    assert_eq!(different, 0);
    assert!(codes > 100, "{codes} different codes: too quiet to compare");

    let output = |slew, quantiser| {
        let output = Output::new(dac(14), slew, quantiser).expect("an accepted limit");
        Axis::new(*plain(PAPER, 14).law(), output)
    };
    let law = |words| plain(words, 14);
    let options = [
        output(Some(50), Quantiser::Nearest),
        output(None, Quantiser::ErrorFeedback),
        output(None, Quantiser::Dither { seed: 1 }),
        law(LawWords {
            derivative: Derivative::Measurement,
            ..PAPER
        }),
        law(LawWords {
            anti_windup: AntiWindup::Clamp,
            ..PAPER
        }),
        // The integral gain by less than one part in a thousand.
        law(LawWords {
            ki_dt: GainWord::new(PAPER.ki_dt.mantissa + (1 << 14), 32),
            ..PAPER
        }),
    ];
    for axis in options {
        let (different, _) = differing(axis, PAPER, 14, &lively(), samples);
        assert_ne!(different, 0, "{axis:?}");
    }
}
