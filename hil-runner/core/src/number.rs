//! Numbers as people read them, in every table, page, caption and line: digits,
//! powers of ten, signs.
//!
//! # Digits that hold
//!
//! Those of a figure that a second run confirms, in which the carriage is heavier by
//! 10⁻¹² of its mass ([`Case::nudged`](crate::case::Case::nudged)), which nobody could
//! measure.
//!
//! A well-conditioned run gives the same figures to eight digits and more. One
//! that rattles, or whose loop is unstable, makes of 10⁻¹² whatever there is
//! room for, and of its figures only the digits that both runs share say
//! anything.
//!
//! The rule: n digits hold if the second value differs from the first by at
//! most half a unit of the first one's n-th digit. A difference below 1 pm, and
//! in other units than lengths below 10⁻⁹, is rounding and none.

use serde::ser::{SerializeSeq, Serializer};

/// Nanoseconds as seconds, correctly rounded: time is counted, and turned into seconds
/// only to be shown or to evaluate the motion command.
// Exact below 2^53 ns, which is 104 days.
pub fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// The upper 53 of 64 bits as a number in \[0, 1).
pub fn of_bits(bits: u64) -> f64 {
    // 2^-53
    (bits >> 11) as f64 / 9_007_199_254_740_992.0
}

/// Significant digits of plot data. A plot is about 10³ pixels high; 10⁻⁷ of
/// full scale survives a zoom by 10³ with a tenth of a pixel to spare.
pub const PLOT_DIGITS: usize = 7;

/// Significant digits in tables; integers are written out instead.
pub const TABLE_DIGITS: usize = 5;

/// Stands for a figure that a run does not have.
pub const MISSING: &str = "–";

/// Rounds to `digits` significant decimal digits, ties as the standard
/// library's formatting decides. Numbers that are not finite pass unchanged.
pub fn significant(value: f64, digits: usize) -> f64 {
    if !value.is_finite() {
        return value;
    }
    let precision = digits.saturating_sub(1);
    // Through decimal text: multiplying by a power of ten would round twice
    // and leave 0.30000000000000004 in the file.
    format!("{value:.precision$e}").parse().unwrap_or(value)
}

/// A number as tables show it: [`TABLE_DIGITS`] significant digits, integers
/// below 10⁷ in full, powers of ten outside 10⁻⁴…10⁷, a true minus sign and
/// [`MISSING`] for what is not finite.
///
/// ```
/// use hil_core::number::table;
///
/// assert_eq!(table(-650.535923826634), "−650.54");
/// assert_eq!(table(16_383.0), "16383");
/// assert_eq!(table(1.25e-6), "1.25·10⁻⁶");
/// assert_eq!(table(f64::NAN), "–");
/// ```
pub fn table(value: f64) -> String {
    if !value.is_finite() {
        return MISSING.to_owned();
    }
    // Adding zero turns −0 into 0.
    let value = value + 0.0;
    let size = value.abs();
    let text = if value.fract() == 0.0 && size < 1e7 {
        format!("{value:.0}")
    } else {
        let rounded = significant(value, TABLE_DIGITS);
        if (1e-4..1e7).contains(&rounded.abs()) {
            rounded.to_string()
        } else {
            power_of_ten(rounded)
        }
    };
    text.replace('-', "−")
}

/// Stands for a figure of which no digit holds.
pub const UNKNOWN: &str = "?";

/// A number as [`table`] shows it, but `digits` of it alone where fewer hold:
/// a power of ten where an integer would end in zeros that say nothing, and
/// [`UNKNOWN`] without any.
///
/// ```
/// use hil_core::number::held;
///
/// assert_eq!(held(-650.535923826634, None), "−650.54");
/// assert_eq!(held(-650.535923826634, Some(4)), "−650.5");
/// assert_eq!(held(-650.535923826634, Some(2)), "−6.5·10²");
/// assert_eq!(held(29.0, Some(1)), "3·10¹");
/// assert_eq!(held(29.0, Some(0)), "?");
/// ```
pub fn held(value: f64, digits: Option<usize>) -> String {
    let Some(digits) = digits.filter(|&digits| digits < digits_shown(value)) else {
        return table(value);
    };
    if digits == 0 && value.is_finite() {
        return UNKNOWN.to_owned();
    }
    let rounded = significant(value, digits);
    let last_place = leading_place(rounded) / 10_f64.powi(i32::try_from(digits).unwrap_or(0) - 1);
    // Above 1, but for the rounding of powers.
    if last_place > 2.0 {
        power_of_ten(rounded).replace('-', "−")
    } else {
        table(rounded)
    }
}

/// [`held`], or [`MISSING`] without a value.
pub fn shown(value: Option<f64>, digits: Option<usize>) -> String {
    value.map_or_else(|| MISSING.to_owned(), |value| held(value, digits))
}

/// A number as [`table`] shows it, rounded to `digits` before.
///
/// ```
/// use hil_core::number::rounded;
///
/// assert_eq!(rounded(12.3456, 3), "12.3");
/// assert_eq!(rounded(0.5, 3), "0.5");
/// ```
pub fn rounded(value: f64, digits: usize) -> String {
    table(significant(value, digits))
}

/// A small relative error: two digits and its sign.
///
/// ```
/// use hil_core::number::relative_error;
///
/// assert_eq!(relative_error(-2.34e-10), "−2.3·10⁻¹⁰");
/// assert_eq!(relative_error(0.064), "+0.064");
/// assert_eq!(relative_error(0.0), "0");
/// ```
pub fn relative_error(value: f64) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", rounded(value, 2))
}

/// Digits that [`table`] shows of a number: all of an integer below 10⁷.
fn digits_shown(value: f64) -> usize {
    if value.fract() == 0.0 && value.abs() < 1e7 {
        format!("{:.0}", value.abs()).len()
    } else {
        TABLE_DIGITS
    }
}

/// The unit of a number's first digit, a power of ten; 0 for 0.
fn leading_place(value: f64) -> f64 {
    let text = format!("{value:e}");
    match text.split_once('e') {
        Some((_, exponent)) if value != 0.0 => format!("1e{exponent}").parse().unwrap_or(0.0),
        _ => 0.0,
    }
}

/// A mantissa and a power of ten.
fn power_of_ten(value: f64) -> String {
    let scientific = format!("{value:e}");
    match scientific.split_once('e') {
        Some((mantissa, exponent)) => format!("{mantissa}·10{}", raised(exponent)),
        None => scientific,
    }
}

/// A whole number in superscript characters.
pub fn superscript(integer: i32) -> String {
    raised(&integer.to_string())
}

fn raised(integer: &str) -> String {
    let digits: Vec<char> = "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().collect();
    let raise = |character: char| match character.to_digit(10) {
        Some(digit) => digits[digit as usize],
        None if character == '-' => '⁻',
        None => character,
    };
    integer.chars().map(raise).collect()
}

/// Magnitude over limit in percent; `None` where either says nothing (no
/// value, or a limit of zero).
pub fn share_percent(value: f64, limit: f64) -> Option<f64> {
    let share = 100.0 * value.abs() / limit;
    (limit > 0.0 && share.is_finite()).then_some(share)
}

/// Serialises a column rounded to [`PLOT_DIGITS`], not-finite numbers as null.
pub(crate) fn column<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    let mut sequence = serializer.serialize_seq(Some(values.len()))?;
    for &value in values {
        let value = significant(value, PLOT_DIGITS) + 0.0;
        // Integers without ".0": a third of a code column's size.
        if value.fract() == 0.0 && value.abs() < 1e15 {
            // An integer below 10¹⁵ is exact in i64.
            sequence.serialize_element(&(value as i64))?;
        } else {
            sequence.serialize_element(&value.is_finite().then_some(value))?;
        }
    }
    sequence.end()
}

/// [`column`] for one that may be absent (null).
pub(crate) fn column_option<S: Serializer>(
    values: &Option<Vec<f64>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match values {
        Some(values) => column(values, serializer),
        None => serializer.serialize_none(),
    }
}

/// Digits of the first value that the second confirms; `None` where these are
/// all that tables show.
pub fn confirmed([first, second]: [Option<f64>; 2], unit: &str) -> Option<usize> {
    let (first, second) = match (first, second) {
        (None, None) => return None,
        (Some(first), Some(second)) => (first, second),
        _ => return Some(0),
    };
    let difference = (first - second).abs();
    if difference <= rounding(unit) {
        return None;
    }
    let shown = digits_shown(first);
    let mut half_unit = 0.5 * leading_place(first);
    let mut digits = 0;
    while digits < shown && difference <= half_unit {
        digits += 1;
        half_unit /= 10.0;
    }
    (digits < shown).then_some(digits)
}

/// Differences up to this are rounding, in the unit of the figure.
fn rounding(unit: &str) -> f64 {
    if unit == "µm" { 1e-6 } else { 1e-9 }
}

/// Digits that hold of what a value leaves of a limit: down to the same place.
pub fn of_margin(margin: f64, value: f64, digits: usize) -> usize {
    let mut left = digits;
    let (mut place, leading) = (leading_place(value), leading_place(margin));
    // A place is a power of ten, if not to the last bit.
    while place > 2.0 * leading && left > 0 {
        place /= 10.0;
        left -= 1;
    }
    while place < 0.5 * leading && digits > 0 {
        place *= 10.0;
        left += 1;
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plot_numbers_keep_seven_digits() {
        assert_eq!(significant(1.040_633_016_219, 7), 1.040_633);
        assert_eq!(significant(-2.056_066_118e-7, 7), -2.056_066e-7);
        assert_eq!(significant(0.1 + 0.2, 7), 0.3);
        assert!(significant(f64::NAN, 7).is_nan());
    }

    #[test]
    fn rounding_keeps_times_ascending() {
        // Rounding is monotonic: the plots need that and nothing sorts again.
        let times: Vec<f64> = (0..20_000_u32)
            .map(|i| significant(f64::from(i) * 7.3e-5, PLOT_DIGITS))
            .collect();
        assert!(times.is_sorted());
    }

    #[test]
    fn table_numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.588_165_799, "1.5882"),
            (0.5, "0.5"),
            (-1e-9, "−1·10⁻⁹"),
            (1_234_567.0, "1234567"),
            (12_345_678.0, "1.2346·10⁷"),
            (9_999_999.9, "1·10⁷"),
            (f64::INFINITY, MISSING),
        ] {
            assert_eq!(table(value), text, "{value}");
        }
    }

    #[test]
    fn columns_become_json() {
        let values = [0.0, -0.0, 119.0, 0.123_456_789, f64::NAN, f64::INFINITY];
        let mut json = Vec::new();
        column(&values, &mut serde_json::Serializer::new(&mut json)).unwrap();
        assert_eq!(json, b"[0,0,119,0.1234568,null,null]");
    }

    #[test]
    fn a_limit_of_zero_has_no_share() {
        assert_eq!(share_percent(-1.0, 4.0), Some(25.0));
        assert_eq!(share_percent(0.0, 0.0), None);
        assert_eq!(share_percent(f64::NAN, 1.0), None);
    }

    fn of(first: f64, second: f64) -> Option<usize> {
        confirmed([Some(first), Some(second)], "m/s²")
    }

    #[test]
    fn half_a_unit_of_the_last_digit_is_allowed() {
        assert_eq!(of(1.6457, 1.645_740), None);
        assert_eq!(of(1.6457, 1.645_760), Some(4));
        assert_eq!(of(-650.5, -651.5), Some(2));
        assert_eq!(of(650.5, -650.5), Some(0));
        assert_eq!(of(0.0, 0.3), Some(0));
    }

    #[test]
    fn whole_numbers_hold_to_their_last_digit() {
        assert_eq!(of(29.0, 31.0), Some(1));
        assert_eq!(of(123_456.0, 123_457.0), Some(5));
        assert_eq!(of(123_456.0, 123_456.0), None);
    }

    #[test]
    fn rounding_is_no_difference_and_no_value_is_one() {
        assert_eq!(confirmed([Some(1e-9), Some(-2e-9)], "µm"), None);
        assert_eq!(confirmed([Some(1e-3), Some(2e-3)], "µm"), Some(0));
        assert_eq!(confirmed([None, None], "µm"), None);
        assert_eq!(confirmed([Some(1.0), None], "µm"), Some(0));
    }

    #[test]
    fn a_margin_holds_down_to_the_same_place() {
        // 1.6(457) of 3.1416 leaves 1.5, of 1.7 it leaves nothing that is known.
        assert_eq!(of_margin(1.4959, 1.6457, 2), 2);
        assert_eq!(of_margin(0.0543, 1.6457, 2), 0);
        assert_eq!(of_margin(998.35, 1.6457, 2), 4);
        assert_eq!(of_margin(0.0, 1.6457, 2), 0);
    }
}
