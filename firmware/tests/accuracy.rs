//! The codes against the law in exact rationals, at every sample.
//!
//! Theory (`firmware::gains`): the sum before rounding is off by at most 7/8
//! of a code, so the code by at most 1. Both are measured here, over the whole
//! accepted range of gains. That the measure can fail is shown in `contrast.rs`.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::errors::{Errors, Shape, within_half_a_unit};
use exact::{
    Exact, ExactLaw, Gains, Random, exact_code, half_a_unit_beside, millionths_apart, power_of_two,
    ratio, sum_value, word_with,
};
use firmware::{Dac, GainWord, Pid, PidState, PidWords};

/// 7/8 of a code.
const SUM_BOUND_MILLIONTHS: i64 = 875_000;

/// Largest deviations from the exact law.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Deviation {
    /// Of the code.
    code: i64,
    /// Of the sum where the difference of errors was not held \[codes/10^6\].
    sum_millionths: i64,
    /// Number of samples that gave another code than the exact law.
    other_codes: u32,
}

/// Runs controller and exact law side by side over the errors that `next`
/// gives for the last code.
fn deviation(
    pid: &Pid,
    gains: &Gains,
    dac_bits: u32,
    samples: u32,
    mut next: impl FnMut(i64) -> i64,
) -> Deviation {
    let dac = Dac::with_bits(dac_bits).expect("2 to 24 bits");
    let mut state = PidState::default();
    let mut law = ExactLaw::new(gains);
    let mut worst = Deviation::default();
    let mut code = 0;
    let mut previous = None;
    for _ in 0..samples {
        let error = next(code);
        let output = pid.step(&mut state, i32::try_from(error).expect("an error in range"));
        assert!(!output.error_limited);
        code = i64::from(dac.code(output.sum));

        let y = law.step(error);
        let in_range = law.error_sum().unsigned_abs() <= u128::from(pid.error_sum_limit());
        assert!(in_range, "the sequence left the declared range");
        assert!(!output.error_sum_beyond_range);

        let apart = (code - exact_code(&y, dac_bits)).abs();
        worst.code = worst.code.max(apart);
        worst.other_codes += u32::from(apart > 0);
        let slope: i64 = error - previous.replace(error).unwrap_or(error);
        if slope.abs() <= i64::from(pid.slope_limit()) {
            let millionths = millionths_apart(&y, &sum_value(output.sum));
            worst.sum_millionths = worst.sum_millionths.max(millionths);
        }
    }
    worst
}

fn assert_promise(worst: Deviation, what: &dyn core::fmt::Debug) {
    assert!(worst.code <= 1, "{worst:?} for {what:?}");
    assert!(
        worst.sum_millionths <= SUM_BOUND_MILLIONTHS,
        "{worst:?} for {what:?}"
    );
}

/// Random gains up to the limits of an error range; `None` where rounding
/// takes the largest of them just beyond a limit.
fn random_pid(random: &mut Random) -> Option<(Gains, Pid)> {
    let error_bits = u8::try_from(random.between(17, 29)).ok()?;
    let top = f64::from(error_bits);
    let mut gain = |limit: f64| {
        // One in eight is zero, one in eight within 1 % of the limit.
        match random.between(0, 7) {
            0 => "0".to_owned(),
            1 => random.decimal_between(limit - 0.015, limit),
            _ => random.decimal_between(limit - 40.0, limit),
        }
    };
    let texts = [gain(29.0 - top), gain(20.0 - top), gain(27.0)];
    // A sample time of 1 s leaves the decimals as they are.
    let gains = Gains::of(&texts[0], &texts[1], &texts[2], 1_000_000_000);
    let mut words = gains.words(error_bits)?;
    if random.between(0, 1) == 1 {
        // Also words that are coarser than they would have to be.
        let coarser = |gain: &Exact, finest: GainWord, min: u8, random: &mut Random| {
            let bits = random.between(i64::from(min), i64::from(finest.fraction_bits.max(min)));
            word_with(gain, u8::try_from(bits).ok()?)
        };
        words.kp = coarser(&gains.kp, words.kp, error_bits + 2, random)?;
        words.ki_dt = coarser(&gains.ki_dt, words.ki_dt, error_bits + 11, random)?;
        if words.kd_per_dt.fraction_bits > error_bits {
            words.kd_per_dt = coarser(&gains.kd_per_dt, words.kd_per_dt, error_bits + 1, random)?;
        }
    }
    Some((gains, Pid::accept(words).ok()?))
}

#[test]
fn random_gains_keep_the_promise_over_the_whole_accepted_range() {
    let mut random = Random(1);
    let (mut worst, mut accepted) = (Deviation::default(), 0);
    for seed in 0..2_100 {
        let Some((gains, pid)) = random_pid(&mut random) else {
            continue;
        };
        accepted += 1;
        assert!(within_half_a_unit(&gains, &pid), "{:?}", pid.words());
        let shape = Shape::ALL[usize::try_from(seed % 7).expect("below 7")];
        let dac_bits = u32::try_from(random.between(2, 24)).expect("a small number");
        let mut errors = Errors::new(shape, seed, &pid, dac_bits);
        let run = deviation(&pid, &gains, dac_bits, 700, |code| errors.next(code));
        assert_promise(run, &(shape, dac_bits, pid.words()));
        worst.code = worst.code.max(run.code);
        worst.sum_millionths = worst.sum_millionths.max(run.sum_millionths);
        worst.other_codes += run.other_codes;
    }
    println!("{accepted} sets of gains, 700 samples each: {worst:?}");
    assert!(
        accepted > 1_900,
        "only {accepted} sets of gains were accepted"
    );
    assert_eq!(worst.code, 1, "some roundings must show");
}

#[test]
fn the_papers_gains_keep_the_promise_over_long_runs() {
    // 1 ms, 0.1 ms and 10 µs; the paper's converter, and of 12 and 24 bits.
    for (sample_time_ns, dac_bits, samples) in [
        (1_000_000, 14, 1_000_000),
        (100_000, 12, 100_000),
        (10_000, 24, 100_000),
    ] {
        let gains = Gains::of("3.2", "5", "0.05", sample_time_ns);
        let pid = Pid::accept(gains.words(18).expect("words")).expect("accepted");
        for shape in [Shape::ClosedLoop, Shape::Steered, Shape::Walk] {
            // The long run is the one that looks like an axis.
            let samples = match shape {
                Shape::ClosedLoop => samples,
                _ => samples / 10,
            };
            let mut errors = Errors::new(shape, 7, &pid, dac_bits);
            let run = deviation(&pid, &gains, dac_bits, samples, |code| errors.next(code));
            println!("Δt = {sample_time_ns} ns, {shape:?}, {samples} samples: {run:?}");
            assert_promise(run, &(sample_time_ns, shape));
        }
    }
}

#[test]
fn the_promise_holds_up_to_the_declared_sum_of_errors() {
    // Up to the limit and back to 0 with the largest errors.
    for (gains, error_bits) in [
        (Gains::of("3.2", "5", "0.05", 10_000), 18),
        (Gains::of("0.1", "900", "0", 1_000_000), 18),
        (Gains::of("0.4", "1.9", "0.001", 1_000_000), 29),
    ] {
        for sign in [1, -1] {
            let pid = Pid::accept(gains.words(error_bits).expect("words")).expect("accepted");
            let limit = i64::from(pid.error_limit());
            let stretch = i64::try_from(pid.error_sum_limit()).expect("at most 2^39") / limit;
            if sign < 0 && stretch > 1 << 20 {
                // Two million samples each way are enough for one sign.
                continue;
            }
            let samples = u32::try_from(2 * stretch).expect("at most 2^23");
            let mut k = 0;
            let run = deviation(&pid, &gains, 24, samples, |_| {
                k += 1;
                if k <= stretch {
                    sign * limit
                } else {
                    -sign * limit
                }
            });
            let sum = pid.error_sum_limit();
            println!("|Σe| to {sum}, {samples} samples: {run:?}");
            assert_promise(run, pid.words());
        }
    }
}

#[test]
fn held_differences_end_where_the_exact_law_ends() {
    // Largest Kp and Ki·Δt against the derivative, differences around D.
    let error_bits = 18;
    for kd_per_dt in ["1600.1", "5000", "77777.7", "3e6", "1.3e8"] {
        let kp = ratio(i64::from(i32::MAX), 1) * power_of_two(-20);
        let ki_dt = ratio(i64::from(i32::MAX), 1) * power_of_two(-29);
        let kd_per_dt = exact::decimal(kd_per_dt);
        let gains = Gains {
            kp,
            ki_dt,
            kd_per_dt,
        };
        let pid = Pid::accept(gains.words(error_bits).expect("words")).expect("accepted");
        let (limit, d) = (i64::from(pid.error_limit()), i64::from(pid.slope_limit()));
        let sum_limit = i64::try_from(pid.error_sum_limit()).expect("at most 2^39");
        assert!(d < 2 * limit, "the difference must be held somewhere");
        let mut random = Random(3);
        for dac_bits in [2, 14, 24] {
            for sign in [1, -1] {
                let mut sum = 0;
                let mut k = 0;
                let run = deviation(&pid, &gains, dac_bits, 2_000, |_| {
                    k += 1;
                    // The integral goes to its limit; then come jumps against
                    // it and against the proportional term, and an error of
                    // the other sign wherever the limit is too near.
                    let jump = d + random.between(-2, 2);
                    let wish = match k {
                        1..=250 => limit,
                        _ if k % 2 == 0 => limit,
                        _ => (limit - jump).max(-limit),
                    };
                    let error = if sum + wish > sum_limit { -wish } else { wish };
                    sum += error;
                    sign * error
                });
                assert_promise(run, &(pid.words(), dac_bits));
            }
        }
    }
}

/// Takes `Σe` to its limit with +E, then jumps from −E to +E: all three
/// roundings at their largest, with one sign.
fn worst_sequence(pid: &Pid) -> (u32, impl FnMut(i64) -> i64 + use<>) {
    let limit = i64::from(pid.error_limit());
    let stretch = i64::try_from(pid.error_sum_limit()).expect("at most 2^39") / limit;
    let mut k = 0;
    let next = move |_| {
        k += 1;
        if k <= stretch || k % 2 == 0 {
            limit
        } else {
            -limit
        }
    };
    (u32::try_from(stretch + 100).expect("at most 2^22"), next)
}

#[test]
fn the_bound_is_nearly_reached_by_the_coarsest_words() {
    // E = 2^24: fp = 26 and fd = 25 are the fewest; the limit of Σe is then
    // 2^39 with fi = 40, and 2^15 samples reach it. Small mantissas keep the
    // sum within the code range, where a code can show the difference.
    let words = PidWords {
        kp: GainWord::new(1, 26),
        ki_dt: GainWord::new(1, 40),
        kd_per_dt: GainWord::new(1, 25),
        error_bits: 24,
    };
    let pid = Pid::accept(words).expect("accepted");
    let gains = half_a_unit_beside(&words);
    let (samples, next) = worst_sequence(&pid);
    let run = deviation(&pid, &gains, 24, samples, next);
    println!("coarsest words: {run:?}");
    assert_promise(run, &words);
    assert!(run.sum_millionths > 870_000, "{run:?}");
    assert_eq!(run.code, 1);
}

#[test]
fn the_sum_is_the_law_of_the_words_exactly() {
    let mut random = Random(11);
    for seed in 0..300 {
        let Some((_, pid)) = random_pid(&mut random) else {
            continue;
        };
        let shape = Shape::ALL[usize::try_from(seed % 7).expect("below 7")];
        let mut errors = Errors::new(shape, seed, &pid, 16);
        let mut law = ExactLaw::new(&Gains::of_words(pid.words()));
        let (mut state, mut previous) = (PidState::default(), None);
        for _ in 0..300 {
            let error = errors.next(0);
            let sum = pid
                .step(&mut state, i32::try_from(error).expect("in range"))
                .sum;
            let y = law.step(error);
            let slope: i64 = error - previous.replace(error).unwrap_or(error);
            if slope.abs() <= i64::from(pid.slope_limit()) {
                assert_eq!(
                    millionths_apart(&y, &sum_value(sum)),
                    0,
                    "{:?}",
                    pid.words()
                );
            }
        }
    }
}
