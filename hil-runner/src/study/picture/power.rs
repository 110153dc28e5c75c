//! Powers of ten, exact.

/// Largest k with 10^k ≤ `magnitude`, for a finite number above 0; exact, since
/// it is read from the decimal digits.
pub(super) fn decade_below(magnitude: f64) -> i32 {
    let text = format!("{magnitude:e}");
    let exponent = text.split_once('e').map_or("0", |(_, exponent)| exponent);
    exponent.parse().unwrap_or(0)
}

/// 10^k, correctly rounded.
pub(super) fn power_of_ten(k: i32) -> f64 {
    format!("1e{k}").parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_are_exact_at_their_ends() {
        for k in -20..20 {
            let power = power_of_ten(k);
            assert_eq!(decade_below(power), k);
            assert_eq!(decade_below(power.next_down()), k - 1);
        }
    }
}
