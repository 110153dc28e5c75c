//! Units of axes: what a suffix stands for, the prefix that reads best, and
//! powers of ten, which are exact.

use super::PictureError;
use hil_core::number::superscript;

/// Suffix of a column's name and its symbol, as in `NOTATION.md`, and those of
/// figures. The longest that fits counts.
const SUFFIXES: &str = "\
    _s s, _us µs, _m m, _mm mm, _um µm, _mps m/s, _mps2 m/s², _ms m s, _rad rad, _radps rad/s, \
    _rads rad s, _deg °, _m_per_rad m/rad, _mm_per_rev mm/rev, _kg kg, _kg_m2 kg m², _n N, \
    _ns_per_rad N s/rad, _ns2_per_rad2 N s²/rad², _nm N m, _nm_per_rad N m/rad, \
    _nms_per_rad N m s/rad, _nm_per_a N m/A, _kg_cm2 kg cm², _n_per_um N/µm, _ns_per_m N s/m, \
    _v_per_rad V/rad, _v_per_rad_s V/(rad s), _vs_per_rad V s/rad, _j J, _v V, _a A, _ohm Ω, _h H, _w W, _hz Hz, \
    _per_s 1/s, _counts counts, _counts_per_rad counts/rad, _counts_per_mm counts/mm, \
    _counts_per_s counts/s, _codes codes, _codes_per_s codes/s, _bits bits, _bytes bytes, \
    _percent %, _db dB, _mv mV, _ma mA";

/// The suffix with its symbol that ends a name, if any.
pub(super) fn suffix(name: &str) -> Option<(&'static str, &'static str)> {
    let name = format!("_{name}");
    let suffixes = SUFFIXES.split(", ");
    suffixes
        .filter_map(|suffix| suffix.split_once(' '))
        .filter(|(suffix, _)| name.ends_with(suffix))
        .max_by_key(|(suffix, _)| suffix.len())
}

/// Units that take prefixes, by the largest power of ten that is in use: km
/// and ks are no units of an axis.
const WITH_PREFIX: [(i32, &[&str]); 3] = [
    (0, &["s", "m", "m/s", "m/s²", "rad", "rad/s", "H"]),
    (3, &["V", "A", "J", "N", "N m"]),
    (6, &["Ω", "Hz"]),
];

/// A unit that takes prefixes, and the largest power of ten that is in use.
fn with_prefix(symbol: &str) -> Option<(&'static str, i32)> {
    WITH_PREFIX.iter().find_map(|(most, symbols)| {
        let base = symbols.iter().find(|base| **base == symbol)?;
        Some((*base, *most))
    })
}

/// Prefixes with their powers of ten.
fn prefixes() -> impl Iterator<Item = (&'static str, i32)> {
    ["p", "n", "µ", "m", "", "k", "M"]
        .into_iter()
        .zip((-12..).step_by(3))
}

/// A unit as a number of another: `mm` is 10⁻³ of `m`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Unit {
    /// Symbol as written.
    pub(super) symbol: String,
    /// Base unit and power of ten, where prefixes are in use.
    base: Option<(&'static str, i32)>,
}

/// Form in which numbers of a unit are shown: the power of ten that they are
/// multiplied by, and the symbol of the shown unit, which may begin with one.
pub(super) type Shown = (i32, String);

impl Unit {
    /// The unit with that symbol. `m` is the metre: a base unit goes first.
    pub(super) fn of(symbol: &str) -> Self {
        let of = |(prefix, power): (&str, i32)| {
            let (base, _) = with_prefix(symbol.strip_prefix(prefix)?)?;
            Some((base, power))
        };
        Self {
            symbol: symbol.to_owned(),
            base: of(("", 0)).or_else(|| prefixes().find_map(of)),
        }
    }

    /// Power of ten from this unit to another of the same base.
    pub(super) fn shift_to(&self, other: &Unit) -> Option<i32> {
        match (self.base, other.base) {
            (Some((base, from)), Some((other, to))) if base == other => Some(from - to),
            _ => (self.symbol == other.symbol).then_some(0),
        }
    }

    /// The unit that a picture asks for.
    pub(super) fn asked(&self, column: &str, symbol: &str) -> Result<Shown, PictureError> {
        // The two signs for micro, and what a keyboard has for it.
        let symbol = symbol.replace('\u{3bc}', "µ");
        let symbol = match symbol.strip_prefix('u') {
            Some(rest) if Unit::of(&format!("µ{rest}")).base.is_some() => format!("µ{rest}"),
            _ => symbol,
        };
        let other = Unit::of(&symbol);
        let apart = || PictureError::units([(column, &self.symbol), (&symbol, &symbol)]);
        let shift = self.shift_to(&other).ok_or_else(apart)?;
        Ok((shift, symbol))
    }

    /// The unit that suits numbers up to `largest` in magnitude: numbers from
    /// 0.1 to 10⁴ stay as they are, others take a prefix or, `by_power`, a power of ten.
    pub(super) fn suited(&self, largest: f64, by_power: bool) -> Shown {
        let plain = (0, self.symbol.clone());
        if !largest.is_finite() || largest == 0.0 || (0.1..1e4).contains(&largest) {
            return plain;
        }
        let decade = decade_below(largest);
        // The power of 1000 at or below a decade.
        let thousands = |decade: i32| decade.div_euclid(3) * 3;
        if let Some((base, from)) = self.base {
            // In the base unit.
            let decade = decade + from;
            let most = with_prefix(base).map_or(0, |(_, most)| most);
            let power = thousands(decade).clamp(-12, most);
            if decade - power <= 4 {
                let prefix = prefixes().find(|(_, of)| *of == power);
                let prefix = prefix.map_or("", |(prefix, _)| prefix);
                return (from - power, format!("{prefix}{base}"));
            }
        } else if (-2..5).contains(&decade) {
            return plain;
        }
        if !by_power {
            return plain;
        }
        let power = thousands(decade);
        let space = if self.symbol.is_empty() { "" } else { " " };
        let symbol = format!("10{}{space}{}", superscript(power), self.symbol);
        (-power, symbol)
    }
}

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
    fn the_longest_suffix_counts() {
        for (name, symbol) in [
            ("peak_following_error_mm", Some("mm")),
            ("stiffness_nm_per_rad", Some("N m/rad")),
            ("peak_abs_acc_mps2", Some("m/s²")),
            ("damping_nms_per_rad", Some("N m s/rad")),
            ("dac_bits", Some("bits")),
            ("s", Some("s")),
            ("impacts", None),
            ("gains", None),
        ] {
            assert_eq!(suffix(name).map(|(_, symbol)| symbol), symbol, "{name}");
        }
    }

    #[test]
    fn prefixes_suit_the_numbers() {
        for (symbol, largest, shift, text) in [
            ("s", 0.02, 3, "ms"),
            ("s", 0.5, 0, "s"),
            ("s", 9e4, 0, "s"),
            ("s", 1e6, -6, "10⁶ s"),
            ("V", 1e6, -3, "kV"),
            ("mm", 0.05, 3, "µm"),
            ("µm", 12_000.0, -3, "mm"),
            ("mm", 12_000.0, -3, "m"),
            ("N m", 0.002, 3, "mN m"),
            ("m/s²", 0.03, 3, "mm/s²"),
            ("N m/rad", 2.5e4, 0, "N m/rad"),
            ("N m/rad", 2.5e5, -3, "10³ N m/rad"),
            ("kg m²", 4e-6, 6, "10⁻⁶ kg m²"),
            ("", 1e6, -6, "10⁶"),
            ("%", 0.0, 0, "%"),
        ] {
            let found = Unit::of(symbol).suited(largest, true);
            assert_eq!(found, (shift, text.into()), "{largest} {symbol}");
        }
    }

    #[test]
    fn a_picture_may_ask_for_a_unit() {
        let seconds = Unit::of("s");
        assert_eq!(seconds.asked("t_s", "us"), Ok((6, "µs".into())));
        let error = seconds.asked("t_s", "mm").unwrap_err().to_string();
        assert_eq!(
            error,
            "\"t_s\" is in s and \"mm\" in mm: they cannot share an axis"
        );
    }

    #[test]
    fn decades_are_exact_at_their_ends() {
        for k in -20..20 {
            let power = power_of_ten(k);
            assert_eq!(decade_below(power), k);
            assert_eq!(decade_below(power.next_down()), k - 1);
        }
    }
}
