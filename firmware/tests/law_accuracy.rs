//! The axis' law against decimal gains, feed-forward and filter included.
//!
//! Theory (`firmware::law::words`): with gains up to half a unit beside their
//! words the sum before rounding is off by at most 63/64 of a code, 31/32
//! without a friction, over the declared ranges.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_law::{Model, Ranges, value};
use exact::axis_words::accepted;
use exact::decimal_law::{BILLION, Beside, Decimal, HALF, farthest, gains, within};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawInput, LawState, LawWords};
use firmware::output::{Quantiser, Window};
use firmware::{Dac, GainWord};

/// The firmware's law; nothing may leave its range.
fn firmware_law(law: Law, dac: Dac) -> impl FnMut(&LawInput) -> i128 {
    let mut state = LawState::default();
    move |input| {
        let given = law.step(&mut state, input, Window::of(dac));
        let limited = [
            given.error_limited,
            given.difference_limited,
            given.integral_limited,
        ];
        assert_eq!(limited, [false; 3], "{input:?}, {law:?}");
        i128::from(given.sum)
    }
}

/// 63/64 code, and 31/32 where no friction is fed forward, in billionths;
/// the exact filter's own cutting-off is less than a millionth.
fn bound(words: &LawWords) -> i128 {
    let sixty_fourths = if words.friction_ff.mantissa == 0 {
        62
    } else {
        63
    };
    sixty_fourths * BILLION / 64 + 1_000
}

#[test]
fn random_gains_keep_the_bound_over_the_declared_ranges() {
    let mut random = Random(91);
    let [mut worst, mut worst_filtered] = [0; 2];
    for seed in 0..2_500 {
        let (law, dac) = accepted(&mut random);
        let mut words = LawWords {
            anti_windup: AntiWindup::None,
            ..*law.words()
        };
        if let Some(filter) = &mut words.filter {
            filter.smoothing = filter.smoothing.max(1 << 15);
        }
        let law = Law::accept(words, dac).expect("the same gains");
        let beside = [0; 6].map(|_| match random.between(0, 2) {
            0 => HALF,
            1 => -HALF,
            _ => random.between(-HALF, HALF),
        });
        let beside = Beside::new(&words, beside);
        let apart = farthest(
            words,
            beside,
            800,
            firmware_law(law, dac),
            within(law, Random(seed)),
        );
        assert!(apart <= bound(&words), "{apart} for {words:?}");
        worst = worst.max(apart);
        if words.filter.is_some() {
            worst_filtered = worst_filtered.max(apart);
        }
    }
    println!("2 million samples: {worst} billionths of a code, {worst_filtered} with a filter");
    assert!(worst > BILLION / 2);
}

/// The coarsest words of E = 2^24, F = 35, with every term on and their gains
/// half a unit above; `filter` is slow enough to reach its largest rounding.
fn coarsest() -> (LawWords, Dac) {
    let words = LawWords {
        kp: GainWord::new(1, 26),
        // Σe to 2^32, 2^8 errors.
        ki_dt: GainWord::new(1, 33),
        // Kd/Δt = 1, differences to 2^25 with h = 4: 1/16 code a unit.
        kd_per_dt: GainWord::new(1 << 25, 25),
        velocity_ff: GainWord::new(1, 35),
        acceleration_ff: GainWord::new(1, 35),
        friction_ff: GainWord::new(1, 5),
        error_bits: 24,
        sum_fraction_bits: 35,
        integral_bits: 24,
        derivative: Derivative::Measurement,
        filter: Some(FilterWords {
            smoothing: 1 << 21,
            fraction_bits: 4,
        }),
        anti_windup: AntiWindup::None,
    };
    (words, Dac::with_bits(24).expect("24 bits"))
}

/// Everything to its end with one sign: `Σe` and the filter first, then the
/// largest error, and differences that keep the filter beside its end.
fn all_to_the_end(words: &LawWords, dac: Dac) -> impl FnMut(&Decimal) -> LawInput {
    let ranges = Ranges::of(words, dac);
    assert_eq!(ranges.slope, 2 * ranges.error, "the difference is not held");
    let ends = [ranges.error, ranges.slope].map(|x| i32::try_from(x).expect("at most 2^30"));
    let mut k = 0_u32;
    move |_| {
        k += 1;
        // 2^8 errors fill the sum; before and between, errors that cancel.
        let up = k > 24_000 && (k <= 24_256 || k % 2 == 1);
        let idle = k <= 24_000 && k.is_multiple_of(2);
        LawInput {
            error: if up || idle { ends[0] } else { -ends[0] },
            difference: -(ends[1] - i32::from(k.is_multiple_of(3))),
            velocity: 1 << 30,
            acceleration: 1 << 30,
            within_dead_band: false,
            hold_integral: false,
        }
    }
}

#[test]
fn the_bound_is_nearly_reached_by_the_coarsest_words() {
    let (words, dac) = coarsest();
    let law = Law::accept(words, dac).expect("the coarsest that are accepted");
    let apart = [1, -1].map(|sign| {
        let beside = Beside::new(&words, [sign * HALF; 6]);
        let inputs = all_to_the_end(&words, dac);
        let apart = farthest(words, beside, 25_000, firmware_law(law, dac), inputs);
        println!("coarsest words, {sign:+}: {apart} billionths of a code");
        assert!(apart <= bound(&words));
        apart
    });
    // 59/64 come from the words alone; the filter gives more than a half of
    // the other 4.
    assert!(apart.iter().all(|&apart| apart > 59 * BILLION / 64));
    assert!(apart.iter().any(|&apart| apart > 61 * BILLION / 64));
}

#[test]
fn contrast_words_one_bit_coarser_break_the_bound() {
    // Refused by the firmware, so the model of `exact` runs them.
    let (fine, dac) = coarsest();
    let one = |fraction_bits| GainWord::new(1, fraction_bits);
    let coarser = [
        LawWords {
            kp: one(25),
            ..fine
        },
        // By a rule of S ≤ 2^fi, which leaves it 2^32.
        LawWords {
            ki_dt: one(32),
            ..fine
        },
        LawWords {
            kd_per_dt: GainWord::new(1 << 24, 24),
            ..fine
        },
        // F = 32, which would leave the rates 32 bits.
        LawWords {
            velocity_ff: one(32),
            acceleration_ff: one(32),
            ..fine
        },
    ];
    for words in coarser {
        assert!(Law::accept(words, dac).is_err());
        let mut model = Model::new(words, dac, None, Quantiser::Nearest);
        let beside = Beside::new(&words, [HALF; 6]);
        let inputs = all_to_the_end(&words, dac);
        let law = |input: &LawInput| model.step(input).sum;
        let apart = farthest(words, beside, 25_000, law, inputs);
        println!(
            "{:?}: {apart} billionths",
            gains(&words).map(|word| word.fraction_bits)
        );
        assert!(apart > BILLION, "{apart}");
    }
}

#[test]
fn beyond_d_both_stand_at_the_same_end() {
    // Kp and Ki·Δt against the derivative: the code is that of the exact law
    // wherever the difference is held.
    let mut random = Random(92);
    let mut held = 0;
    for _ in 0..4_000 {
        let (law, dac) = accepted(&mut random);
        let ranges = Ranges::of(law.words(), dac);
        if law.words().filter.is_some() || ranges.slope >= ranges.error {
            continue;
        }
        let words = LawWords {
            anti_windup: AntiWindup::None,
            ..*law.words()
        };
        let law = Law::accept(words, dac).expect("the same gains");
        let beside = [0; 6].map(|_| if random.one_in(2) { HALF } else { -HALF });
        let mut exact = Decimal::new(words, Beside::new(&words, beside));
        let mut state = LawState::default();
        let (limit, slope) = (law.error_limit(), law.slope_limit());
        let code = BILLION << (u32::from(words.sum_fraction_bits) + 32);
        for k in 0..60 {
            // 40 errors one way, then jumps against them of D or a little more.
            let jump = slope + i32::from(random.bits(0, 2));
            let error = if k < 40 || k % 2 == 0 {
                limit
            } else {
                limit - jump
            };
            let input = LawInput {
                error,
                difference: if random.one_in(2) { jump } else { -jump },
                velocity: -(1 << 30),
                acceleration: 1 << 30,
                within_dead_band: false,
                hold_integral: false,
            };
            let previous = exact
                .previous
                .map_or(error, |e| i32::try_from(e).expect("29 bits"));
            let delta = match words.derivative {
                Derivative::Error => error - previous,
                Derivative::Measurement => -input.difference,
            };
            let sum = i128::from(law.step(&mut state, &input, Window::of(dac)).sum);
            let y = exact.step(&input);
            if delta.abs() > slope {
                held += 1;
                let end = i128::from(if delta > 0 {
                    dac.max_code()
                } else {
                    dac.min_code()
                });
                let sign = i128::from(delta.signum());
                let unit = value(&words, GainWord::new(1, 0));
                assert!(sum * sign >= end * sign * unit, "{words:?}");
                assert!(y.div_euclid(code) * sign >= end * sign, "{words:?}");
            }
        }
    }
    println!("{held} samples beyond D");
    assert!(held > 10_000);
}
