//! What the rows of all lanes leave behind, as [`crate::rest::Seen`] does for a
//! single run.

use plant::Width;

use crate::case::Case;
use crate::rest::{Range, Seen, Window};

/// Codes and counts so far, and the carriages in the window of rest. A lane
/// without a run sees something too; nobody asks it.
#[derive(Debug, Clone)]
pub(crate) struct LaneSeen<W: Width> {
    window: Option<Window>,
    /// Lowest and highest codes and counts before the window, and in it.
    before: [W::Array; 4],
    now: [W::Array; 4],
    positions_m: Vec<W::Array>,
}

/// The first row that is in no window.
const NEVER: u64 = u64::MAX;

impl<W: Width> LaneSeen<W> {
    pub(crate) fn new() -> Self {
        Self {
            window: None,
            before: Self::nothing(),
            now: Self::nothing(),
            positions_m: Vec::new(),
        }
    }

    fn nothing() -> [W::Array; 4] {
        let Range { lowest, highest } = Range::EMPTY;
        [lowest, highest, lowest, highest].map(W::array)
    }

    /// Forgets everything; the window is that of a case of the lanes.
    pub(crate) fn start(&mut self, case: Option<&Case>) {
        self.window = case.and_then(Window::of);
        self.before = Self::nothing();
        self.now = Self::nothing();
        self.positions_m.clear();
    }

    /// Takes in row number `row`: code, count and carriage \[m\].
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

    /// What a lane has seen.
    pub(crate) fn of(&self, lane: usize) -> Seen {
        let range = |arrays: &[W::Array; 4], place: usize| Range {
            lowest: arrays[place].as_ref()[lane],
            highest: arrays[place + 1].as_ref()[lane],
        };
        let both = |place: usize| match self.window {
            Some(_) => [range(&self.before, place), range(&self.now, place)],
            None => [range(&self.now, place), Range::EMPTY],
        };
        let positions_m = self.positions_m.iter().map(|array| array.as_ref()[lane]);
        Seen::from_parts(self.window, both(0), both(2), positions_m.collect())
    }
}
