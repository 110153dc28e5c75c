//! Seconds in decimal notation to a count of nanoseconds, without a detour
//! over `f64`.
//!
//! A time of the run must be a whole number of nanoseconds to 1e-6 ns. An
//! `f64` near 100 s is 1.4e-5 ns wide, so the decimal text itself is judged:
//! 100.001 is exact, 100.0010000000001 is not.

/// Largest part of a nanosecond that is taken for rounding, as a fraction and
/// as its complement.
const TOLERANCE: (f64, f64) = (0.000_001, 0.999_999);

/// Digits that are looked at on either side of the point. Times are at most
/// 1e9 s, that is 19 digits of nanoseconds; the rest leaves room for zeros.
const LONGEST: i64 = 400;

/// The nanoseconds in `decimal` seconds; `None` if they are not whole, or are
/// negative or too many for 64 bits.
pub(super) fn from_decimal_seconds(decimal: &str) -> Option<u64> {
    let unsigned = decimal.strip_prefix('+').unwrap_or(decimal);
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i64>().ok()?),
        None => (unsigned, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{whole}{fraction}");
    if digits.is_empty() || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let leading = digits.len() - digits.trim_start_matches('0').len();
    let significant = digits.trim_start_matches('0').trim_end_matches('0');
    if significant.is_empty() {
        return Some(0);
    }
    // How many significant digits stand before the point, in nanoseconds.
    let point = i64::try_from(whole.len()).ok()? - i64::try_from(leading).ok()?;
    let point = point.checked_add(exponent)?.checked_add(9)?;
    if !(-LONGEST..=LONGEST).contains(&point) {
        // Either far below the tolerance or far above every allowed time.
        return (point < 0).then_some(0);
    }
    let length = i64::try_from(significant.len()).ok()?;
    let (whole_ns, part) = if point <= 0 {
        let zeros = "0".repeat(usize::try_from(-point).ok()?);
        (0, format!("0.{zeros}{significant}"))
    } else if point >= length {
        let zeros = "0".repeat(usize::try_from(point - length).ok()?);
        (format!("{significant}{zeros}").parse().ok()?, String::new())
    } else {
        let (before, after) = significant.split_at(usize::try_from(point).ok()?);
        (before.parse::<u64>().ok()?, format!("0.{after}"))
    };
    let part: f64 = if part.is_empty() {
        0.0
    } else {
        part.parse().ok()?
    };
    if part <= TOLERANCE.0 {
        Some(whole_ns)
    } else if part >= TOLERANCE.1 {
        whole_ns.checked_add(1)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::from_decimal_seconds;

    #[test]
    fn whole_nanoseconds_are_counted() {
        for (text, ns) in [
            ("0", 0),
            ("0.0", 0),
            ("0e9", 0),
            ("1", 1_000_000_000),
            ("+1.5", 1_500_000_000),
            ("0.001", 1_000_000),
            ("1e-3", 1_000_000),
            ("1E-9", 1),
            ("0.000000001", 1),
            ("123456789.987654321", 123_456_789_987_654_321),
            // Sums of f64 as scripts print them.
            ("0.30000000000000004", 300_000_000),
            ("0.09999999999999999", 100_000_000),
            ("100.001", 100_001_000_000),
            ("00.1e1", 1_000_000_000),
            ("1e9", 1_000_000_000_000_000_000),
            ("1e-500", 0),
        ] {
            assert_eq!(from_decimal_seconds(text), Some(ns), "{text}");
        }
    }

    #[test]
    fn the_tolerance_is_a_millionth_of_a_nanosecond() {
        assert_eq!(from_decimal_seconds("0.001000000000001"), Some(1_000_000));
        assert_eq!(from_decimal_seconds("0.0010000000000011"), None);
        assert_eq!(
            from_decimal_seconds("0.000999999999999999"),
            Some(1_000_000)
        );
        assert_eq!(from_decimal_seconds("0.0009999999999989"), None);
        assert_eq!(from_decimal_seconds("100.0010000000001"), None);
        assert_eq!(from_decimal_seconds("5e-10"), None);
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        for text in [
            "-1",
            "nan",
            "inf",
            "",
            ".",
            "e5",
            "1e20",
            "1e400",
            "1e99999999999999999999",
            "1e9223372036854775807",
        ] {
            assert_eq!(from_decimal_seconds(text), None, "{text}");
        }
    }
}
