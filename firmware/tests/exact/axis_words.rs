//! Random words of the axis' law, near and far from every limit, and the
//! rule that decides which of them are accepted, written from the tables of
//! `firmware::law::words`.

use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord};

use super::Random;
use super::axis_law::{Ranges, two};

impl Random {
    /// Uniform between `low` and `high`, both included, for small numbers.
    pub(crate) fn bits(&mut self, low: u8, high: u8) -> u8 {
        let bits = self.between(i64::from(low), i64::from(high.max(low)));
        u8::try_from(bits).expect("a small number")
    }

    /// True once in `n`.
    pub(crate) fn one_in(&mut self, n: i64) -> bool {
        self.between(1, n) == 1
    }
}

/// A word whose term with integers up to `2^limit_bits` has at most `most`
/// bits in units of 2^−F codes.
fn word(random: &mut Random, f: u8, least: u8, limit_bits: u8, most: u8) -> GainWord {
    let fraction_bits = if random.one_in(3) {
        least.min(f)
    } else {
        random.bits(least, f)
    };
    let room = most.saturating_sub(f.saturating_sub(fraction_bits) + limit_bits);
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

/// Words of which a good part is accepted, by a converter of the given bits.
pub(crate) fn random_words(random: &mut Random) -> (LawWords, Dac) {
    let f = random.bits(33, 40);
    let error_bits = random.bits(17, 29);
    let dac_bits = random.bits(2, 24.min(60 - f));
    let integral_bits = random.bits(0, 60 - f);
    let most = random.bits(30, 61);
    let rate = |random: &mut Random| {
        let least = if f < 35 { f } else { 35 };
        let word = word(random, f, least, 30, most);
        // Below F = 35 no word is fine enough but 0.
        if f < 35 && !random.one_in(30) {
            GainWord::new(0, f)
        } else {
            word
        }
    };
    let kp = word(random, f, error_bits + 2, error_bits, most);
    let ki_dt = word(
        random,
        f,
        error_bits + 9,
        error_bits,
        (integral_bits + f).saturating_sub(8),
    );
    let least_d = if random.one_in(2) { error_bits + 1 } else { 3 };
    let slope_bits = random.bits(0, error_bits);
    let mut kd_per_dt = word(random, f, least_d, slope_bits, most);
    let velocity_ff = rate(random);
    let acceleration_ff = rate(random);
    let friction_ff = word(random, f, 5, 0, most);
    let filter = random.one_in(2).then(|| {
        let h = random.bits(0, 29.min(f.saturating_sub(kd_per_dt.fraction_bits)));
        // (Kd/Δt)·2^−h ≤ 1/16
        let room = (kd_per_dt.fraction_bits + h).saturating_sub(4).min(30);
        kd_per_dt.mantissa = kd_per_dt.mantissa.min(1 << room);
        let fraction_bits = h;
        let smoothing = i32::MAX >> random.between(0, 30);
        FilterWords {
            smoothing,
            fraction_bits,
        }
    });
    let words = LawWords {
        kp,
        ki_dt,
        kd_per_dt,
        velocity_ff,
        acceleration_ff,
        friction_ff,
        error_bits,
        sum_fraction_bits: f,
        integral_bits,
        derivative: if random.one_in(2) {
            Derivative::Error
        } else {
            Derivative::Measurement
        },
        filter,
        anti_windup: match random.between(0, 2) {
            0 => AntiWindup::None,
            1 => AntiWindup::Clamp,
            _ => AntiWindup::BackCalculation {
                tracking: i32::MAX >> random.between(0, 30),
            },
        },
    };
    let dac = Dac::with_bits(u32::from(dac_bits)).expect("2 to 24 bits");
    (words, dac)
}

/// Any output of this converter.
pub(crate) fn random_output(random: &mut Random, dac: Dac) -> (Output, Option<u32>, Quantiser) {
    let slew = match random.between(0, 3) {
        0 => None,
        1 => Some(1),
        _ => Some(1_u32 << random.between(0, 24)),
    };
    let seed = u32::try_from(random.next() >> 32).expect("32 bits");
    let quantiser = match random.between(0, 2) {
        0 => Quantiser::Nearest,
        1 => Quantiser::ErrorFeedback,
        _ => Quantiser::Dither { seed },
    };
    let output = Output::new(dac, slew, quantiser).expect("1 to 2^24 codes");
    (output, slew, quantiser)
}

/// The next accepted words, with the number of tries that they took.
pub(crate) fn accepted(random: &mut Random) -> (Law, Dac) {
    loop {
        let (words, dac) = random_words(random);
        if let Ok(law) = Law::accept(words, dac) {
            return (law, dac);
        }
    }
}

/// Tells whether the tables of `firmware::law::words` allow these words.
pub(crate) fn allowed(words: &LawWords, dac: Dac) -> bool {
    let f = words.sum_fraction_bits;
    let all = [
        (words.kp, words.error_bits.saturating_add(2)),
        (words.ki_dt, 0),
        (words.kd_per_dt, 0),
        (words.velocity_ff, 35),
        (words.acceleration_ff, 35),
        (words.friction_ff, 5),
    ];
    let plain = (33..=40).contains(&f)
        && (17..=29).contains(&words.error_bits)
        && all.iter().all(|&(word, least)| {
            let fine_enough = word.mantissa == 0 || word.fraction_bits >= least;
            word.mantissa >= 0 && word.fraction_bits <= f && fine_enough
        });
    let tracked = !matches!(words.anti_windup,
        AntiWindup::BackCalculation { tracking } if tracking < 1);
    if !plain || !tracked || words.integral_bits > 62 - f {
        return false;
    }
    let ranges = Ranges::of(words, dac);
    let largest = largest(words, &ranges);
    let kd = words.kd_per_dt;
    let fd = u32::from(kd.fraction_bits);
    let filter = words.filter.is_none_or(|filter| {
        let h = u32::from(filter.fraction_bits);
        filter.smoothing >= 1
            && fd + h <= u32::from(f)
            && h <= 29
            && ranges.slope * two(h) <= two(29)
            && 16 * i128::from(kd.mantissa) <= two(fd + h)
    });
    let ki = super::axis_law::value(words, words.ki_dt);
    let sum_of_errors = ki == 0 || {
        let by_range = ranges.integral.div_euclid(ki);
        let by_rounding = two(u32::from(words.ki_dt.fraction_bits)).div_euclid(2);
        by_range.min(by_rounding) >= 256 * ranges.error
    };
    let slope = kd.mantissa == 0 || ranges.slope <= two(fd);
    filter && sum_of_errors && slope && largest < two(62) && factors(words, &ranges)
}

/// `Kp·E + FF + D-term + 3·Q + 3·R` \[2^−F codes\], for words no finer than
/// the sum.
pub(crate) fn largest(words: &LawWords, ranges: &Ranges) -> i128 {
    let kd = super::axis_law::value(words, words.kd_per_dt);
    // With a filter its value may be a unit of 2^−h beyond D.
    let unit = words.filter.map_or(0, |filter| {
        let h = u32::from(filter.fraction_bits).min(100);
        (kd + two(h) - 1).div_euclid(two(h))
    });
    ranges.direct + kd * ranges.slope + unit + 3 * (ranges.integral + ranges.code)
}

/// Every term is one product of factors below 2^31, whichever way the shift is
/// shared between them.
fn factors(words: &LawWords, ranges: &Ranges) -> bool {
    let h = words.filter.map_or(0, |filter| filter.fraction_bits);
    let kd = words.kd_per_dt;
    let kd = GainWord::new(kd.mantissa, kd.fraction_bits + h);
    let filtered = ranges.slope * two(u32::from(h)) + i128::from(words.filter.is_some());
    [
        (words.kp, ranges.error),
        (words.ki_dt, ranges.error),
        (kd, filtered),
        (words.velocity_ff, two(30)),
        (words.acceleration_ff, two(30)),
        (words.friction_ff, 1),
    ]
    .into_iter()
    .all(|(word, limit)| {
        let shift = u32::from(words.sum_fraction_bits - word.fraction_bits);
        word.mantissa == 0
            || (0..=shift).any(|m| {
                i128::from(word.mantissa) * two(m) < two(31) && limit * two(shift - m) < two(31)
            })
    })
}
