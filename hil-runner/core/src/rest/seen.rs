//! What the rows of a run leave behind, of as many runs as there are lanes: the
//! ranges of codes and counts, and the carriage in the window of rest.

use plant::Width;

use super::ripple::{Line, Residual, Ripple, count};
use super::{Range, Window};
use crate::number::seconds;

/// Codes and counts so far, and the carriages in the window of rest. A lane
/// without a run sees something too; nobody asks it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SeenRows<W: Width> {
    window: Option<Window>,
    /// Lowest and highest codes and counts before the window, and in it.
    before: [W::Array; 4],
    now: [W::Array; 4],
    positions_m: Vec<W::Array>,
}

/// The first row that is in no window.
const NEVER: u64 = u64::MAX;

impl<W: Width> SeenRows<W> {
    /// No row yet.
    pub(crate) fn new(window: Option<Window>) -> Self {
        Self {
            window,
            before: Self::nothing(),
            now: Self::nothing(),
            positions_m: Vec::new(),
        }
    }

    fn nothing() -> [W::Array; 4] {
        let Range { lowest, highest } = Range::EMPTY;
        [lowest, highest, lowest, highest].map(W::array)
    }

    /// Forgets all rows.
    #[cfg(feature = "lanes")]
    pub(crate) fn restart(&mut self) {
        self.before = Self::nothing();
        self.now = Self::nothing();
        self.positions_m.clear();
    }

    /// Takes in row number `row`: code and count, which are no numbers where there
    /// are none, and carriage \[m\].
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        w: W,
        row: u64,
        [code, count]: [W::Vector; 2],
        position_m: W::Vector,
    ) {
        let first = self.window.map_or(NEVER, |window| window.first);
        if row >= first {
            if row == first {
                self.before = self.now;
                self.now = Self::nothing();
            }
            let mut array = W::array(0.0);
            w.store(position_m, &mut array);
            self.positions_m.push(array);
        }
        let [lowest_code, highest_code, lowest_count, highest_count] = &mut self.now;
        w.store(w.min(code, w.load(lowest_code)), lowest_code);
        w.store(w.max(code, w.load(highest_code)), highest_code);
        w.store(w.min(count, w.load(lowest_count)), lowest_count);
        w.store(w.max(count, w.load(highest_count)), highest_count);
    }

    /// The straight line through the positions so far, for all windows of as many.
    pub(crate) fn line(&self) -> Line {
        Line::of(self.positions_m.len())
    }

    /// Looks at all lanes at rest, where the command stands at `x_ref_m`.
    #[inline(always)]
    pub(crate) fn at_rest(&self, w: W, line: &Line, x_ref_m: f64) -> AtRest<W> {
        let (mut max_um, mut squares) = (w.splat(0.0), w.splat(0.0));
        for position_m in &self.positions_m {
            let error_um = w.splat(1e6) * (w.splat(x_ref_m) - w.load(position_m));
            max_um = w.larger(w.abs(error_um), max_um);
            squares = squares + error_um * error_um;
        }
        AtRest {
            residual: Residual::of(w, line, &self.positions_m),
            max_um: w.stored(max_um),
            squares: w.stored(squares),
        }
    }

    /// The run of a lane, of lanes looked at.
    pub(crate) fn of(&self, lane: usize, line: &Line, at_rest: &AtRest<W>) -> Seen {
        let range = |arrays: &[W::Array; 4], place: usize| Range {
            lowest: arrays[place].as_ref()[lane],
            highest: arrays[place + 1].as_ref()[lane],
        };
        // A run that ends before its window has seen nothing there.
        let both = |place: usize| match self.positions_m.is_empty() {
            false => [range(&self.before, place), range(&self.now, place)],
            true => [range(&self.now, place), Range::EMPTY],
        };
        let ([codes_before, codes], [counts_before, counts]) = (both(0), both(2));
        let rest = |window: Window| {
            let rows = count(self.positions_m.len());
            let interval_s = seconds(window.interval_ns);
            let residual = &at_rest.residual;
            Rest {
                codes,
                counts,
                error_max_um: at_rest.max_um.as_ref()[lane],
                error_rms_um: (at_rest.squares.as_ref()[lane] / rows).sqrt(),
                ripple: residual.ripple(lane, line, &self.positions_m, interval_s),
            }
        };
        Seen {
            codes: codes_before.with(codes),
            counts: counts_before.with(counts),
            rest: self.window.map(rest),
        }
    }
}

/// Carriages in the window of rest.
#[derive(Debug, Clone)]
pub(crate) struct AtRest<W: Width> {
    residual: Residual<W>,
    /// Largest magnitude of x_ref − x, and the sum of the squares.
    max_um: W::Array,
    squares: W::Array,
}

/// What the rows of one run leave behind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Seen {
    pub(crate) codes: Range,
    pub(crate) counts: Range,
    /// If there is a window.
    pub(crate) rest: Option<Rest>,
}

/// The same in the window of rest, and what its carriage does there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rest {
    pub(crate) codes: Range,
    pub(crate) counts: Range,
    /// Largest magnitude of x_ref − x \[µm\].
    pub(crate) error_max_um: f64,
    /// Its root mean square \[µm\].
    pub(crate) error_rms_um: f64,
    /// Ripple of the carriage.
    pub(crate) ripple: Ripple,
}
