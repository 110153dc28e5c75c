//! Random words, near and far from every limit, and the rule that decides
//! which of them are accepted, written from the tables of
//! `firmware::law::words`.

use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord};

use super::Random;
use super::model::{CODE, MOST, Ranges, two, value};

/// Gains in the order of the law's equation.
pub(crate) fn gains(words: &LawWords) -> [GainWord; 6] {
    [
        words.kp,
        words.ki_dt,
        words.kd_per_dt,
        words.velocity_ff,
        words.acceleration_ff,
        words.friction_ff,
    ]
}

/// A word whose term with integers up to `2^limit_bits` has at most `most` bits.
fn word(random: &mut Random, least: u8, limit_bits: u8, most: u8) -> GainWord {
    if least > 32 && !random.one_in(30) {
        return GainWord::new(0, 32);
    }
    let fraction_bits = if random.one_in(3) {
        least.min(32)
    } else {
        random.bits(least, 32)
    };
    let room = most.saturating_sub(32_u8.saturating_sub(fraction_bits) + limit_bits);
    let bits = match random.between(0, 7) {
        0 => 0,
        1..=3 => room.min(31),
        _ => random.bits(0, room.min(31)),
    };
    let mantissa = (1_i64 << bits) - 1;
    let mantissa = if random.one_in(4) {
        mantissa
    } else {
        random.between((mantissa + 1) / 2, mantissa)
    };
    GainWord::new(i32::try_from(mantissa).expect("31 bits"), fraction_bits)
}

/// Words of which a good part is accepted, by a converter of random bits.
pub(crate) fn random_words(random: &mut Random) -> (LawWords, Dac) {
    // Beyond 2^23 counts no word of Ki·Δt is fine enough but 0.
    let error_bits = if random.one_in(4) {
        random.bits(17, 29)
    } else {
        random.bits(17, 23)
    };
    let dac_bits = random.bits(2, 24);
    let integral_bits = random.bits(0, 30);
    let most = random.bits(30, 62);
    let least_d = if random.one_in(2) { error_bits + 1 } else { 3 };
    let difference_bits = random.bits(0, error_bits);
    let mut kd_per_dt = word(random, least_d, difference_bits, most);
    let filter = random.one_in(2).then(|| {
        let h = random.bits(0, 29.min(32_u8.saturating_sub(kd_per_dt.fraction_bits)));
        // (Kd/Δt)·2^−h ≤ 1/16
        let room = (kd_per_dt.fraction_bits + h).saturating_sub(4).min(30);
        kd_per_dt.mantissa = kd_per_dt.mantissa.min(1 << room);
        FilterWords {
            smoothing: i32::MAX >> random.between(0, 30),
            fraction_bits: h,
        }
    });
    let forward = if random.one_in(2) { most } else { 0 };
    let words = LawWords {
        kp: word(random, error_bits + 2, error_bits, most),
        ki_dt: word(random, error_bits + 9, error_bits, integral_bits + 32 - 8),
        kd_per_dt,
        velocity_ff: word(random, 29, 24, forward),
        acceleration_ff: word(random, 29, 24, forward),
        friction_ff: word(random, 5, 0, forward),
        error_bits,
        integral_bits,
        derivative: random.one_of(&[Derivative::Error, Derivative::Measurement]),
        filter,
        anti_windup: match random.between(0, 2) {
            0 => AntiWindup::None,
            1 => AntiWindup::Clamp,
            _ => AntiWindup::BackCalculation {
                tracking: i32::MAX >> random.between(0, 30),
            },
        },
    };
    let dac = Dac::with_bits(dac_bits.into()).expect("2 to 24 bits");
    (words, dac)
}

/// Any output of this converter.
pub(crate) fn random_output(random: &mut Random, dac: Dac) -> (Output, Option<u32>, Quantiser) {
    let any = 1_u32 << random.between(0, 24);
    let slew = random.one_of(&[None, Some(1), Some(any), Some(any)]);
    let seed = u32::try_from(random.next() >> 32).expect("32 bits");
    let quantiser = random.one_of(&[
        Quantiser::Nearest,
        Quantiser::ErrorFeedback,
        Quantiser::Dither { seed },
    ]);
    let output = Output::new(dac, slew, quantiser).expect("1 to 2^24 codes");
    (output, slew, quantiser)
}

/// The next accepted words.
pub(crate) fn accepted(random: &mut Random) -> Law {
    loop {
        let (words, dac) = random_words(random);
        if let Ok(law) = Law::accept(words, dac) {
            return law;
        }
    }
}

/// Tells whether the tables of `firmware::law::words` allow these words.
pub(crate) fn allowed(words: &LawWords, dac: Dac) -> bool {
    let least = [words.error_bits.saturating_add(2), 0, 0, 29, 29, 5];
    let plain = (17..=29).contains(&words.error_bits)
        && words.integral_bits <= 30
        && gains(words).iter().zip(least).all(|(word, least)| {
            let fine_enough = word.mantissa == 0 || word.fraction_bits >= least;
            word.mantissa >= 0 && word.fraction_bits <= 32 && fine_enough
        });
    let tracked = !matches!(words.anti_windup,
        AntiWindup::BackCalculation { tracking } if tracking < 1);
    if !plain || !tracked {
        return false;
    }
    let ranges = Ranges::of(words, dac.bits());
    let kd = words.kd_per_dt;
    // Two factors below 2^31, whichever way the shift is shared between them;
    // the other terms are by the other demands.
    let term = |h: u8, limit: i128| {
        let shift = 32 - kd.fraction_bits - h;
        kd.mantissa == 0
            || (0..=shift).any(|m| {
                i128::from(kd.mantissa) * two(m) < two(31) && limit * two(shift - m) < two(31)
            })
    };
    let filter = words.filter.map_or(term(0, ranges.difference), |filter| {
        let h = filter.fraction_bits;
        filter.smoothing >= 1
            && h <= 29
            && kd.fraction_bits + h <= 32
            && ranges.difference * two(h) <= two(29)
            && 16 * i128::from(kd.mantissa) <= two(kd.fraction_bits + h)
            && term(h, ranges.difference * two(h) + 1)
    });
    let ki = value(words.ki_dt);
    let sum_of_errors = ki == 0 || {
        let by_range = ranges.integral.div_euclid(ki);
        let by_rounding = two(words.ki_dt.fraction_bits).div_euclid(2);
        by_range.min(by_rounding) >= 256 * ranges.error
    };
    let difference = kd.mantissa == 0 || ranges.difference <= two(kd.fraction_bits);
    filter && sum_of_errors && difference && ranges.largest <= MOST
}

/// Words whose terms and range are 2^30 codes to the last unit: every gain
/// large, and `Kp` and friction take what is left.
pub(crate) fn brim_full(anti_windup: AntiWindup) -> (LawWords, Dac) {
    let dac = Dac::with_bits(2).expect("2 bits");
    let mut words = LawWords {
        kp: GainWord::new(0, 19),
        ki_dt: GainWord::new(i32::MAX, 26),
        kd_per_dt: GainWord::new(i32::MAX, 20),
        velocity_ff: GainWord::new(i32::MAX, 29),
        acceleration_ff: GainWord::new(i32::MAX, 29),
        friction_ff: GainWord::new(0, 32),
        integral_bits: 30,
        anti_windup,
        ..LawWords::NONE
    };
    let left = MOST - Ranges::of(&words, dac.bits()).largest;
    // One unit of Kp is 2^30 of the sum.
    let word = |x: i128, bits| GainWord::new(i32::try_from(x).expect("31 bits"), bits);
    words.kp = word(left.div_euclid(two(30)), 19);
    words.friction_ff = word(left.rem_euclid(two(30)), 32);
    assert_eq!(Ranges::of(&words, dac.bits()).largest, (1 << 30) * CODE);
    (words, dac)
}
