//! What the rows of a run leave behind for the figures of encoder, converter
//! and rest.

use super::ripple::count;
use super::{RestError, Ripple, Window};
use crate::case::Case;
use crate::controllers::whole;
use crate::time::seconds;

/// Lowest and highest of whole numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub(crate) lowest: f64,
    pub(crate) highest: f64,
}

impl Range {
    /// Of nothing yet.
    pub(crate) const EMPTY: Self = Self {
        lowest: f64::INFINITY,
        highest: f64::NEG_INFINITY,
    };

    pub(crate) fn add(&mut self, value: f64) {
        self.lowest = self.lowest.min(value);
        self.highest = self.highest.max(value);
    }

    /// The range of both.
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            lowest: self.lowest.min(other.lowest),
            highest: self.highest.max(other.highest),
        }
    }

    /// Highest less lowest; 0 of nothing.
    pub(crate) fn width(&self) -> u64 {
        u64::try_from(whole(self.highest - self.lowest)).unwrap_or(0)
    }

    /// The smallest n with all of it in −2^(n−1) … 2^(n−1) − 1, at least 1.
    pub(crate) fn signed_bits(&self) -> u32 {
        // A negative number −m − 1 takes as many bits as m.
        let bits = |n: f64| {
            let n = whole(n);
            i64::BITS - if n < 0 { !n } else { n }.leading_zeros()
        };
        bits(self.lowest).max(bits(self.highest)) + 1
    }

    /// Bits that tell all values from lowest to highest apart,
    /// `ceil(log2(highest − lowest + 1))`.
    pub(crate) fn bits_of_width(&self) -> u32 {
        u64::BITS - self.width().leading_zeros()
    }
}

/// Codes and counts so far, and the carriage in the window of rest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Seen {
    window: Option<Window>,
    /// Before the window, and in it.
    codes: [Range; 2],
    counts: [Range; 2],
    positions_m: Vec<f64>,
}

impl Seen {
    /// Nothing of a run yet.
    pub(crate) fn new(case: &Case) -> Self {
        Self::from_parts(
            Window::of(case),
            [Range::EMPTY; 2],
            [Range::EMPTY; 2],
            Vec::new(),
        )
    }

    /// From what was collected elsewhere, before the window and in it.
    pub(crate) fn from_parts(
        window: Option<Window>,
        codes: [Range; 2],
        counts: [Range; 2],
        positions_m: Vec<f64>,
    ) -> Self {
        Self {
            window,
            codes,
            counts,
            positions_m,
        }
    }

    /// Takes in row number `row`: code and count, where there are any, and the
    /// carriage.
    pub(crate) fn add(&mut self, row: u64, sample: Option<[f64; 2]>, position_m: f64) {
        let inside = self.window.is_some_and(|window| row >= window.first);
        if let Some([code, count]) = sample {
            let place = usize::from(inside);
            self.codes[place].add(code);
            self.counts[place].add(count);
        }
        if inside {
            self.positions_m.push(position_m);
        }
    }

    /// Codes of the whole run.
    pub(crate) fn codes(&self) -> Range {
        self.codes[0].with(self.codes[1])
    }

    /// Counts of the whole run.
    pub(crate) fn counts(&self) -> Range {
        self.counts[0].with(self.counts[1])
    }

    /// Codes and counts in the window, if there is one.
    pub(crate) fn at_rest(&self) -> Option<[Range; 2]> {
        self.window.map(|_| [self.codes[1], self.counts[1]])
    }

    /// How far the carriage is from where it should rest, if there is a window.
    pub(crate) fn rest_error(&self, x_ref_m: f64) -> Option<RestError> {
        self.window?;
        let errors_um = self.positions_m.iter().map(|x_m| 1e6 * (x_ref_m - x_m));
        let (mut max_um, mut squares) = (0.0_f64, 0.0);
        for error_um in errors_um {
            max_um = max_um.max(error_um.abs());
            squares += error_um * error_um;
        }
        Some(RestError {
            max_um,
            rms_um: (squares / count(self.positions_m.len())).sqrt(),
        })
    }

    /// How the carriage rests, if there is a window.
    pub(crate) fn ripple(&self) -> Option<Ripple> {
        let interval_s = seconds(self.window?.interval_ns);
        Some(Ripple::of(&self.positions_m, interval_s))
    }
}
