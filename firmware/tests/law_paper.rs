//! With every addition off the axis' law is the paper's: the sums of `Pid`
//! bit for bit, and its codes, for the same words.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_words::random_words;
use exact::errors::{Errors, Shape};
use firmware::law::{AntiWindup, Derivative, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord, Pid, PidState, PidWords};

/// Words that both laws accept.
fn accepted_by_both(random: &mut Random) -> (Pid, Law, Dac) {
    loop {
        let (words, dac) = random_words(random);
        let e = words.error_bits;
        let no_finer = |word: GainWord, least: u8| {
            GainWord::new(word.mantissa, word.fraction_bits.clamp(least, 32))
        };
        let kp = no_finer(words.kp, e + 2);
        let kd_per_dt = no_finer(words.kd_per_dt, 0);
        let ki_dt = words.ki_dt;
        let words = LawWords {
            kp,
            ki_dt: GainWord::new(ki_dt.mantissa, ki_dt.fraction_bits.max(e + 11)),
            kd_per_dt,
            velocity_ff: GainWord::new(0, 0),
            acceleration_ff: GainWord::new(0, 0),
            friction_ff: GainWord::new(0, 0),
            derivative: Derivative::Error,
            filter: None,
            anti_windup: AntiWindup::None,
            ..words
        };
        let paper = PidWords {
            kp: words.kp,
            ki_dt: words.ki_dt,
            kd_per_dt: words.kd_per_dt,
            error_bits: e,
        };
        if let (Ok(pid), Ok(law)) = (Pid::accept(paper), Law::accept(words, dac)) {
            return (pid, law, dac);
        }
    }
}

#[test]
fn sums_and_codes_are_the_papers_bit_for_bit() {
    let mut random = Random(61);
    let [mut steps, mut held, mut moved] = [0_u32; 3];
    for seed in 0..2_100_u64 {
        let (pid, law, dac) = accepted_by_both(&mut random);
        let f = law.words().sum_fraction_bits;
        let output = Output::new(dac, None, Quantiser::Nearest).expect("no limit");
        let shape = Shape::ALL[usize::try_from(seed % 7).expect("below 7")];
        let dac_bits = 1 + (dac.max_code() + 1).ilog2();
        let sum_limit = law.error_sum_limit().min(pid.error_sum_limit());
        let mut errors = Errors::new(shape, seed, &pid, dac_bits).narrowed(sum_limit);
        let (mut paper, mut axis, mut codes) =
            (PidState::default(), LawState::default(), output.start());
        let within = i64::from(pid.slope_limit().min(law.slope_limit()));
        let (mut previous, mut code) = (None, 0);
        for _ in 0..1_000 {
            let e = errors.next(code);
            let error = i32::try_from(e).expect("at most 2^29");
            let wanted = pid.step(&mut paper, error).sum;
            let window = output.window(&codes);
            let input = LawInput {
                error,
                ..LawInput::default()
            };
            let given = law.step(&mut axis, &input, window);
            let flags = [
                given.error_limited,
                given.difference_limited,
                given.integral_limited,
            ];
            assert_eq!(flags, [false; 3], "{law:?}");
            // Differences beyond D differ in size, not in the code.
            let slope: i64 = e - previous.replace(e).unwrap_or(e);
            if slope.abs() <= within {
                let sum = i128::from(given.sum) << (40 - f);
                assert_eq!(sum, wanted.to_bits(), "{law:?}");
            } else {
                held += 1;
            }
            let given = output.code(&mut codes, given.sum, f, window);
            assert_eq!(given, dac.code(wanted), "{law:?}");
            code = i64::from(given);
            moved += u32::from(code != 0);
            steps += 1;
        }
    }
    println!("{steps} steps, {held} beyond D, {moved} with a code other than 0");
    assert!(steps > 2_000_000 && held > 10_000 && moved > steps / 4);
}

#[test]
fn contrast_one_addition_shows() {
    let mut random = Random(62);
    let (pid, law, dac) = loop {
        let (pid, law, dac) = accepted_by_both(&mut random);
        if pid.words().kd_per_dt.mantissa > 0 {
            break (pid, law, dac);
        }
    };
    let words = LawWords {
        derivative: Derivative::Measurement,
        ..*law.words()
    };
    let law = Law::accept(words, dac).expect("accepted with either derivative");
    let (mut paper, mut axis) = (PidState::default(), LawState::default());
    let window = firmware::output::Window::of(dac);
    let differ = [0, 100].into_iter().any(|error| {
        let wanted = pid.step(&mut paper, error).sum;
        let input = LawInput {
            error,
            ..LawInput::default()
        };
        let given = law.step(&mut axis, &input, window).sum;
        i128::from(given) << (40 - words.sum_fraction_bits) != wanted.to_bits()
    });
    assert!(differ);
}
