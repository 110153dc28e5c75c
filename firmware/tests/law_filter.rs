//! The filter of the derivative against the exact one, at every sample.
//!
//! Theory (`firmware::law::filter`): never further than one unit of 2^−h counts
//! from the exact filter, at the largest differences too. The law is made of the
//! filter alone: `Kd/Δt` is one unit of the sum per unit of the filter, so that
//! the sum is the filter's value.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_law::two;
use firmware::law::{Derivative, FilterWords, Law, LawInput, LawState, LawWords};
use firmware::output::Window;
use firmware::{Dac, GainWord};

/// Fraction bits of the exact filter below one unit of 2^−h. What cutting off
/// below them adds up to is at most 2^−60/a ≤ 2^−29 units.
const FINE: u32 = 60;

/// The exact filter in 2^−(h+60) counts.
struct ExactFilter {
    words: FilterWords,
    value: Option<i128>,
}

impl ExactFilter {
    fn step(&mut self, x: i32) -> i128 {
        let x = i128::from(x) << (u32::from(self.words.fraction_bits) + FINE);
        let before = self.value.unwrap_or(x);
        let value = before + ((i128::from(self.words.smoothing) * (x - before)) >> 31);
        self.value = Some(value);
        value
    }
}

/// A law that is a filter, for errors up to `2^error_bits` counts and
/// differences of twice that, or the largest of a filter.
fn filter_alone(error_bits: u8, smoothing: i32) -> (Law, FilterWords) {
    let filter = FilterWords {
        smoothing,
        fraction_bits: 28_u8.saturating_sub(error_bits),
    };
    let words = LawWords {
        kd_per_dt: GainWord::new(1, 36 - filter.fraction_bits),
        error_bits,
        sum_fraction_bits: 36,
        derivative: Derivative::Measurement,
        filter: Some(filter),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(12).expect("12 bits");
    (Law::accept(words, dac).expect("accepted"), filter)
}

/// Largest distance from the exact filter \[2^−60 units\].
fn farthest(law: &Law, filter: FilterWords, inputs: impl Iterator<Item = i32>) -> i128 {
    let window = Window::of(Dac::with_bits(12).expect("12 bits"));
    let (mut state, mut exact) = (
        LawState::default(),
        ExactFilter {
            words: filter,
            value: None,
        },
    );
    inputs.fold(0, |farthest: i128, x| {
        let input = LawInput {
            difference: -x,
            ..LawInput::default()
        };
        let given = law.step(&mut state, &input, window);
        assert!(!given.difference_limited);
        farthest.max(((i128::from(given.sum) << FINE) - exact.step(x)).abs())
    })
}

#[test]
fn never_further_than_a_unit_at_the_largest_differences() {
    let mut random = Random(23);
    let mut worst = 0;
    for round in 0..650_u32 {
        let error_bits = 17 + u8::try_from(round % 13).expect("below 13");
        let smoothing = match random.between(0, 4) {
            0 => i32::MAX,
            1 => 1,
            _ => (i32::MAX >> random.between(0, 30)) - i32::from(random.one_in(2)),
        };
        let (law, filter) = filter_alone(error_bits, smoothing.max(1));
        let limit = law.slope_limit();
        assert_eq!(i64::from(limit) << filter.fraction_bits, 1 << 29);
        let shape = random.between(0, 3);
        let (mut x, mut left) = (limit, 0);
        let inputs = (0..4_000).map(|_| {
            left -= 1;
            if left < 0 {
                let longest = 1 << random.between(0, 11);
                left = random.between(0, longest);
                x = match shape {
                    0 => -x.signum() * limit,
                    1 => [limit, -limit, 0, 1][usize::from(random.bits(0, 3))],
                    2 => i32::try_from(random.between(-3, 3)).expect("small"),
                    _ => i32::try_from(random.between(-i64::from(limit), i64::from(limit)))
                        .expect("at most 2^29"),
                };
            }
            x
        });
        worst = worst.max(farthest(&law, filter, inputs));
    }
    println!(
        "2.6 million samples: {} millionths of a unit",
        (worst * 1_000_000) >> FINE
    );
    assert!(worst <= two(FINE) + two(FINE - 29));
    // Half a unit comes from rounding alone, the rest from what it feeds back.
    assert!(worst > two(FINE) * 3 / 4);
}

#[test]
fn the_largest_jumps_of_the_largest_range_do_not_wrap() {
    // E = 2^29: from one end of the differences to the other and back. With
    // 2^30 for the end, the gap was 2^31 and a filter of a = ½ went the wrong way.
    let (law, _) = filter_alone(29, 1 << 30);
    assert_eq!(law.slope_limit(), 1 << 29);
    for smoothing in [1 << 30, i32::MAX, 1 << 20] {
        let (law, filter) = filter_alone(29, smoothing);
        let jumps = (0..1_000).map(|k| if k % 2 == 0 { -(1 << 29) } else { 1 << 29 });
        assert!(farthest(&law, filter, jumps) <= two(FINE) + two(FINE - 29));
    }
    // One count further is held, and said.
    let mut state = LawState::default();
    let window = Window::of(Dac::with_bits(12).expect("12 bits"));
    for difference in [(1 << 29) + 1, i32::MIN, i32::MAX] {
        let input = LawInput {
            difference,
            ..LawInput::default()
        };
        let given = law.step(&mut state, &input, window);
        assert!(given.difference_limited);
        assert!(given.sum.abs() <= (1 << 29) + 1);
    }
}

#[test]
fn contrast_a_filter_that_drops_its_remainder_is_units_away() {
    let (_, words) = filter_alone(17, 1 << 21);
    let mut exact = ExactFilter { words, value: None };
    let (mut value, mut farthest) = (0_i128, 0);
    for k in 0..20_000 {
        let x = i32::from(k > 0) * 3;
        let gap = (i128::from(x) << words.fraction_bits) - value;
        value += (i128::from(words.smoothing) * gap) >> 31;
        farthest = farthest.max(((value << FINE) - exact.step(x)).abs());
    }
    assert!(farthest > 100 * two(FINE), "{farthest}");
}
