//! Places and numbers of an axis' ticks.

use super::text::{TICK_PX, width};
use super::unit::{decade_below, power_of_ten, prefixed};
use hil_core::number::superscript;

/// A place on an axis with its number; empty for a place in the grid only.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// In the axis' shown unit.
    pub(super) at: f64,
    pub(super) label: String,
}

impl Tick {
    pub(super) fn new(at: f64, label: String) -> Self {
        Self { at, label }
    }

    pub(super) fn width(&self) -> f64 {
        width(&self.label, TICK_PX)
    }
}

/// Form of the numbers of a logarithmic axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LogNumbers {
    /// 0.01, 0.1, 1, 10.
    Decimal,
    /// 10⁻⁶, 10⁻⁴, 10⁻².
    Powers,
    /// 10 µs, 1 ms, 100 ms: the axis is in this base unit.
    Prefixes(&'static str),
}

/// Ticks at multiples of 1, 2 or 5 times a power of ten: the densest that fit,
/// of at most `most`.
pub(super) fn linear(
    low: f64,
    high: f64,
    most: usize,
    fits: &dyn Fn(&[Tick]) -> bool,
) -> Vec<Tick> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let first = decade_below(span / most.max(1) as f64);
    // Three decades of steps: the last leaves less than two ticks.
    let steps = (first..first + 4).flat_map(|decade| [1, 2, 5].map(|digit| (digit, decade)));
    let mut last = Vec::new();
    for (digit, decade) in steps {
        let ticks = multiples(low, high, digit, decade);
        if ticks.len() < 2 {
            break;
        }
        if ticks.len() <= most && fits(&ticks) {
            return ticks;
        }
        last = ticks;
    }
    // No set fits: the ends of the coarsest.
    if last.len() > 2 {
        last.drain(1..last.len() - 1);
    }
    last
}

/// Multiples of `digit · 10^decade` from `low` to `high`.
fn multiples(low: f64, high: f64, digit: u8, decade: i32) -> Vec<Tick> {
    let step = f64::from(digit) * power_of_ten(decade);
    // Rounding must not lose a tick at the very end.
    let slack = 1e-9;
    let (first, last) = ((low / step - slack).ceil(), (high / step + slack).floor());
    // Beyond 10¹² steps from 0 they cannot be told apart.
    if last - first >= 200.0 || first.abs().max(last.abs()) > 1e12 {
        return vec![];
    }
    let decimals = usize::try_from(-decade).unwrap_or(0);
    let counts = (0_u8..200).map(|n| first + f64::from(n));
    counts
        .take_while(|count| *count <= last)
        .map(|count| {
            // Adding zero turns −0 into 0.
            let at = count * step + 0.0;
            let label = format!("{at:.decimals$}").replace('-', "−");
            Tick { at, label }
        })
        .collect()
}

/// Ticks of a logarithmic axis: the densest of some usual sets that fits, of at
/// most `most`, and the places between that the grid has too.
pub(super) fn logarithmic(
    low: f64,
    high: f64,
    numbers: LogNumbers,
    most: usize,
    fits: &dyn Fn(&[Tick]) -> bool,
) -> (Vec<Tick>, Vec<f64>) {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return (Vec::new(), Vec::new());
    }
    let decades = (decade_below(low) - 1)..=(decade_below(high) + 1);
    let within = |at: f64| at >= low * (1.0 - 1e-9) && at <= high * (1.0 + 1e-9);
    let set = |digits: &[u8], every: i32| -> Vec<Tick> {
        let chosen = decades.clone().filter(|decade| decade % every == 0);
        chosen
            .flat_map(|decade| digits.iter().map(move |&digit| (digit, decade)))
            .filter(|&(digit, decade)| within(value(digit, decade)))
            .map(|(digit, decade)| Tick::new(value(digit, decade), number(digit, decade, numbers)))
            .collect()
    };
    let digits: &[u8] = match high / low < 2e6 {
        true => &[2, 3, 4, 5, 6, 7, 8, 9],
        false => &[1],
    };
    let fine: Vec<f64> = set(digits, 1).iter().map(|tick| tick.at).collect();
    let within_decades: [&[u8]; 4] = [&[1, 2, 3, 5, 7], &[1, 2, 3, 5], &[1, 2, 5], &[1, 3]];
    let dense = within_decades.map(|digits| set(digits, 1));
    let sparse = [1, 2, 3, 6, 12, 24, 48, 96].map(|every| set(&[1], every));
    let sets = [dense.as_slice(), &sparse].concat();
    // Less than three numbers say little about an axis that is not even.
    let fitting = |ticks: &&Vec<Tick>| ticks.len() <= most && fits(ticks);
    let several = sets.iter().filter(|ticks| ticks.len() >= 3).find(fitting);
    let two = || sets.iter().filter(|ticks| ticks.len() == 2).find(fitting);
    let chosen = several.or_else(two);
    let narrow = high / low < 4.0;
    match chosen {
        Some(ticks) if !narrow => (ticks.clone(), fine),
        // Within a few octaves even steps read better, whatever the prefix.
        _ if matches!(numbers, LogNumbers::Prefixes(_)) => {
            (chosen.cloned().unwrap_or_default(), fine)
        }
        _ => (linear(low, high, most.min(6), fits), Vec::new()),
    }
}

fn value(digit: u8, decade: i32) -> f64 {
    f64::from(digit) * power_of_ten(decade)
}

/// `digit · 10^decade` in words of the axis.
fn number(digit: u8, decade: i32, numbers: LogNumbers) -> String {
    match numbers {
        LogNumbers::Decimal => decimal(digit, decade),
        LogNumbers::Powers => match (digit, decade) {
            (digit, 0) => digit.to_string(),
            (1, 1) => "10".to_owned(),
            (1, decade) => format!("10{}", superscript(decade)),
            (digit, decade) => format!("{digit}·10{}", superscript(decade)),
        },
        LogNumbers::Prefixes(base) => {
            let (power, unit) = prefixed(base, decade);
            format!("{} {unit}", decimal(digit, decade - power))
        }
    }
}

/// `digit · 10^decade` without a power.
fn decimal(digit: u8, decade: i32) -> String {
    let zeros = "0".repeat(usize::try_from(decade.unsigned_abs()).unwrap_or(0));
    match decade < 0 {
        true => format!("0.{}{digit}", &zeros[1..]),
        false => format!("{digit}{zeros}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn even_axes_have_round_numbers() {
        let any = |_: &[Tick]| true;
        let ticks = linear(0.0, 1.0, 6, &any);
        assert_eq!(labels(&ticks), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&linear(-3.0, 4.0, 5, &any)), ["−2", "0", "2", "4"]);
        let ticks = linear(1e6, 1e6 + 0.3, 4, &any);
        assert_eq!(
            labels(&ticks),
            ["1000000.0", "1000000.1", "1000000.2", "1000000.3"]
        );
        assert!(linear(1.0, 1.0, 5, &any).is_empty());
        assert!(linear(0.0, f64::INFINITY, 5, &any).is_empty());
        // Places that cannot be told apart: once a loop without an end.
        assert!(linear(50.0, 50.0_f64.next_up(), 5, &any).is_empty());
        assert!(linear(1e300, 1.0001e300, 5, &any).len() > 2);
    }

    #[test]
    fn ticks_that_do_not_fit_become_fewer() {
        let two = |ticks: &[Tick]| ticks.len() <= 2;
        assert_eq!(linear(0.0, 1.0, 10, &two).len(), 2);
        assert!(linear(0.0, 1.0, 10, &|_| true).len() > 2);
        assert!(linear(0.0, 1.0, 10, &|_| false).len() <= 2);
    }

    #[test]
    fn decades_are_written_to_be_read() {
        let any = |_: &[Tick]| true;
        let (ticks, fine) = logarithmic(0.05, 20.0, LogNumbers::Decimal, 4, &any);
        assert_eq!(labels(&ticks), ["0.1", "1", "10"]);
        assert!(fine.contains(&0.2) && fine.contains(&20.0));
        let (ticks, _) = logarithmic(1e-6, 1.0, LogNumbers::Prefixes("s"), 7, &any);
        assert_eq!(
            labels(&ticks),
            ["1 µs", "10 µs", "100 µs", "1 ms", "10 ms", "100 ms", "1 s"]
        );
        let (ticks, _) = logarithmic(1e-6, 1e6, LogNumbers::Powers, 5, &any);
        assert_eq!(labels(&ticks), ["10⁻⁶", "10⁻³", "1", "10³", "10⁶"]);
    }

    #[test]
    fn less_than_a_decade_has_more_than_its_end() {
        let any = |_: &[Tick]| true;
        let (ticks, _) = logarithmic(0.25, 4.0, LogNumbers::Decimal, 6, &any);
        assert_eq!(labels(&ticks), ["0.3", "0.5", "0.7", "1", "2", "3"]);
        let (ticks, _) = logarithmic(11.0, 14.0, LogNumbers::Decimal, 6, &any);
        assert_eq!(labels(&ticks), ["11", "12", "13", "14"]);
    }
}
