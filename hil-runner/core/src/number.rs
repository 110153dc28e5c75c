//! Numbers as people read them, in every table, page, caption and line: digits,
//! powers of ten, signs.

use serde::ser::{SerializeSeq, Serializer};

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
    let text = rounded(value, 2);
    if value > 0.0 {
        format!("+{text}")
    } else {
        text
    }
}

/// Digits that [`table`] shows of a number: all of an integer below 10⁷.
pub fn digits_shown(value: f64) -> usize {
    if value.fract() == 0.0 && value.abs() < 1e7 {
        format!("{:.0}", value.abs()).len()
    } else {
        TABLE_DIGITS
    }
}

/// The unit of a number's first digit, a power of ten; 0 for 0.
pub fn leading_place(value: f64) -> f64 {
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
    let raise = |digit| match digit {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        other => other,
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
            #[allow(
                clippy::cast_possible_truncation,
                reason = "an integer below 10¹⁵ is exact in i64"
            )]
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
}
