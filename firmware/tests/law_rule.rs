//! The whole rule of acceptance against its own tables, over random words: what
//! `firmware::law::words` promises is what `Law::accept` does.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_law::{Ranges, two};
use exact::axis_words::{allowed, largest, random_words};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::{Dac, GainWord};
use proptest::prelude::*;

fn some_gain<'a>(words: &'a mut LawWords, random: &mut Random) -> &'a mut GainWord {
    match random.between(0, 5) {
        0 => &mut words.kp,
        1 => &mut words.ki_dt,
        2 => &mut words.kd_per_dt,
        3 => &mut words.velocity_ff,
        4 => &mut words.acceleration_ff,
        _ => &mut words.friction_ff,
    }
}

#[test]
fn the_rule_is_that_of_its_tables() {
    let mut random = Random(17);
    let [mut accepted, mut refused] = [0, 0];
    for round in 0..400_000_u32 {
        let (mut words, dac) = random_words(&mut random);
        if round % 2 == 1 {
            // One thing moved a little: beside a limit more often than not.
            match random.between(0, 4) {
                0 => words.integral_bits = words.integral_bits.wrapping_add(1),
                1 => words.sum_fraction_bits -= 1,
                2 => words.error_bits += 1,
                3 => *some_gain(&mut words, &mut random) = GainWord::new(1, random.bits(0, 41)),
                _ => {
                    *some_gain(&mut words, &mut random) =
                        GainWord::new(i32::MAX, random.bits(0, 41))
                }
            }
        }
        let law = Law::accept(words, dac);
        assert_eq!(
            law.is_ok(),
            allowed(&words, dac),
            "{law:?} for {words:?}, {dac:?}"
        );
        let Ok(law) = law else {
            refused += 1;
            continue;
        };
        accepted += 1;
        let ranges = Ranges::of(&words, dac);
        assert_eq!(i128::from(law.slope_limit()), ranges.slope);
        assert_eq!(i128::from(law.error_limit()), ranges.error);
        assert!(law.headroom_bits() <= 30);
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 40_000 && refused > 40_000);
}

fn any_word() -> impl Strategy<Value = GainWord> {
    let mantissa = prop_oneof![any::<i32>(), 0..=1000_i32, Just(i32::MAX), Just(i32::MIN)];
    let bits = prop_oneof![any::<u8>(), 0..=41_u8];
    (mantissa, bits).prop_map(|(mantissa, bits)| GainWord::new(mantissa, bits))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn no_words_at_all_panic_or_pass_62_bits(
        gains in prop::array::uniform6(any_word()),
        error_bits in prop_oneof![any::<u8>(), 17..=29_u8],
        sum_fraction_bits in prop_oneof![any::<u8>(), 33..=40_u8],
        integral_bits in prop_oneof![any::<u8>(), 0..=30_u8],
        filter in any::<Option<(i32, u8)>>(),
        tracking in any::<Option<i32>>(),
        measured in any::<bool>(),
        dac_bits in 2..=24_u32,
    ) {
        let [kp, ki_dt, kd_per_dt, velocity_ff, acceleration_ff, friction_ff] = gains;
        let words = LawWords {
            kp, ki_dt, kd_per_dt, velocity_ff, acceleration_ff, friction_ff,
            error_bits, sum_fraction_bits, integral_bits,
            derivative: if measured { Derivative::Measurement } else { Derivative::Error },
            filter: filter.map(|(smoothing, fraction_bits)| FilterWords { smoothing, fraction_bits }),
            anti_windup: tracking.map_or(AntiWindup::Clamp, |tracking| AntiWindup::BackCalculation { tracking }),
        };
        let dac = Dac::with_bits(dac_bits).expect("2 to 24 bits");
        match Law::accept(words, dac) {
            Ok(_) => prop_assert!(largest(&words, &Ranges::of(&words, dac)) < two(62)),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
        prop_assert_eq!(Law::accept(words, dac).is_ok(), allowed(&words, dac));
    }
}
