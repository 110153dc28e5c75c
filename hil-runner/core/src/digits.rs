//! Digits of a figure that hold: those that a second run confirms in which
//! the carriage is heavier by 10⁻¹² of its mass, which nobody could measure.
//!
//! A well-conditioned run gives the same figures to eight digits and more. One
//! that rattles, or whose loop is unstable, makes of 10⁻¹² whatever there is
//! room for, and of its figures only the digits that both runs share say
//! anything.
//!
//! The rule: n digits hold if the second value differs from the first by at
//! most half a unit of the first one's n-th digit. A difference below 1 pm, and
//! in other units than lengths below 10⁻⁹, is rounding and none.

use crate::case::Case;
use crate::number;

/// By how much of its mass the carriage is heavier in the second run.
pub const MASS_CHANGE: f64 = 1e-12;

/// The case of the second run.
pub fn nudged(case: &Case) -> Case {
    let mut case = case.clone();
    case.axis.carriage.mass_kg *= 1.0 + MASS_CHANGE;
    case
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
    let shown = number::digits_shown(first);
    let mut half_unit = 0.5 * number::leading_place(first);
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
    let (mut place, leading) = (number::leading_place(value), number::leading_place(margin));
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
