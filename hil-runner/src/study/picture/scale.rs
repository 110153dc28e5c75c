//! From a number to its place on an axis.

/// Where an axis begins and ends if the picture does not say it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Margin {
    /// A little before and behind the data.
    Around,
    /// The same, but from 0 if the data come near it.
    FromZero,
    /// With the data.
    None,
}

/// Ends in the shown unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scale {
    Linear(f64, f64),
    Log(f64, f64),
    /// That many places of equal width.
    Places(usize),
}

/// Share of an axis that is left free at either end.
const FREE: f64 = 0.04;

impl Scale {
    /// An even scale for data that span from `low` to `high`.
    pub(super) fn linear(low: f64, high: f64, margin: Margin) -> Self {
        let size = low.abs().max(high.abs());
        // One value, or values that differ by rounding alone.
        let (low, high) = if high - low > 1e-12 * size {
            (low, high)
        } else if size == 0.0 {
            return Self::Linear(0.0, 1.0);
        } else {
            (low - 0.1 * size, high + 0.1 * size)
        };
        let free = FREE * (high - low);
        match margin {
            Margin::None => Self::Linear(low, high),
            Margin::FromZero if low >= 0.0 && low < 0.5 * high => {
                Self::Linear(0.0, high + FREE * high)
            }
            Margin::FromZero if high <= 0.0 && high > 0.5 * low => {
                Self::Linear(low + FREE * low, 0.0)
            }
            // No axis shows negative times because of a margin.
            Margin::Around | Margin::FromZero => {
                let start = if low >= 0.0 {
                    (low - free).max(0.0)
                } else {
                    low - free
                };
                Self::Linear(start, high + free)
            }
        }
    }

    /// A logarithmic scale for data above 0.
    pub(super) fn log(low: f64, high: f64, margin: Margin) -> Self {
        let span = libm::log10(high / low);
        let (low, high, span) = if span > 1e-9 {
            (low, high, span)
        } else {
            (low / 3.0, high * 3.0, 1.0)
        };
        let free = match margin {
            Margin::None => 1.0,
            Margin::Around | Margin::FromZero => libm::pow(10.0, FREE * span),
        };
        Self::Log(low / free, high * free)
    }

    /// Share of the axis at a number, 0 at its start and 1 at its end.
    pub(super) fn share(self, shown: f64) -> f64 {
        match self {
            Self::Linear(low, high) => (shown - low) / (high - low),
            Self::Log(low, high) => {
                let (from, to) = (libm::log10(low), libm::log10(high));
                (libm::log10(shown) - from) / (to - from)
            }
            Self::Places(count) => (shown + 0.5) / count as f64,
        }
    }
}

/// Smallest and largest of some numbers.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().fold(None, |found, value| match found {
        None => Some((value, value)),
        Some((low, high)) => Some((f64::min(low, value), f64::max(high, value))),
    })
}
