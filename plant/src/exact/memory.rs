//! What solver `exact` has computed about an axis, to be used again.

use super::feedback_table::FeedbackTable;
use super::held_table::HeldTable;
use super::stage_table::StageTable;
use super::system::{Column, FEEDBACK};
use crate::hybrid::Automaton;
use crate::model::axis::{Axis, Mode};
use crate::model::motion::{Coupling, Oscillator};
use crate::model::pid::ContinuousPid;
use crate::model::state::Vector;

/// The whole state at the end of the last interval, to go on from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Carried {
    pub(super) pid: ContinuousPid,
    pub(super) mode: Mode,
    pub(super) time_ns: u64,
    pub(super) length_ns: u64,
    /// The plant's own vector, which must not have been touched.
    pub(super) y: Vector,
    pub(super) x: Column<FEEDBACK>,
    pub(super) command: Oscillator,
    pub(crate) demand_v: f64,
    /// Place of the table.
    pub(super) place: usize,
    /// Until when the command keeps to its interval \[s\].
    pub(super) until_s: f64,
}

impl Carried {
    /// True if the axis still stands there, under the same law.
    pub(crate) fn is_at(&self, now: &Automaton, pid: &ContinuousPid) -> bool {
        self.time_ns == now.time_ns
            && self.mode == now.mode
            && self.y == now.y
            && self.pid.is_same_law(pid)
    }
}

/// The tables made so far. They are made when first needed; a sampled run
/// needs two, one for each state of the joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tables {
    held: Vec<HeldTable>,
    pub(crate) feedback: Vec<FeedbackTable>,
    pub(super) stages: Vec<StageTable>,
    pid: Option<Box<ContinuousPid>>,
    pub(crate) carried: Option<Box<Carried>>,
}

/// Tables kept at most of each kind; a run with a delay uses twice three, a
/// continuous one with all modes and segments about twenty.
const MOST_TABLES: usize = 64;

impl Tables {
    /// The table for `mode` and `length_ns`, made if need be.
    #[inline]
    pub(crate) fn held(&mut self, axis: &Axis, mode: &Mode, length_ns: u64) -> &HeldTable {
        let key = (mode.joint.carries(), mode.guide, length_ns);
        let mut tables = self.held.iter();
        let found = tables.position(|t| (t.closed, t.guide, t.length_ns) == key);
        let place = found.unwrap_or_else(|| self.make_held(axis, mode, length_ns));
        &self.held[place]
    }

    #[cold]
    fn make_held(&mut self, axis: &Axis, mode: &Mode, length_ns: u64) -> usize {
        if self.held.len() >= MOST_TABLES {
            self.held.clear();
        }
        self.held.push(HeldTable::new(axis, mode, length_ns));
        self.held.len() - 1
    }

    /// The place of that for the continuous law; `coupling` is that of the command's
    /// interval.
    pub(crate) fn feedback(
        &mut self,
        axis: &Axis,
        mode: &Mode,
        pid: &ContinuousPid,
        coupling: Coupling,
        length_ns: u64,
    ) -> usize {
        self.of_law(Some(pid));
        let carries = mode.joint.carries();
        let key = (carries, mode.guide, mode.amplifier, coupling, length_ns);
        let mut tables = self.feedback.iter();
        if let Some(place) = tables.position(|t| t.key == key) {
            return place;
        }
        if self.feedback.len() >= MOST_TABLES {
            self.feedback.clear();
        }
        self.feedback.push(FeedbackTable::new(axis, mode, pid, key));
        self.feedback.len() - 1
    }

    /// Forgets what is of another law.
    fn of_law(&mut self, pid: Option<&ContinuousPid>) {
        if let Some(pid) = pid
            && self.pid.as_deref() != Some(pid)
        {
            self.feedback.clear();
            self.stages.clear();
            self.pid = Some(Box::new(pid.clone()));
        }
    }

    /// The place of the table for this mode; `coupling` is that of the command's interval.
    pub(super) fn stage(
        &mut self,
        axis: &Axis,
        mode: &Mode,
        (pid, coupling): (Option<&ContinuousPid>, Option<Coupling>),
        length_ns: u64,
    ) -> usize {
        self.of_law(pid);
        let carries = mode.joint.carries();
        let key = (
            carries,
            mode.guide,
            mode.amplifier,
            mode.stage,
            coupling,
            length_ns,
        );
        let mut tables = self.stages.iter();
        if let Some(place) = tables.position(|t| t.key == key) {
            return place;
        }
        if self.stages.len() >= MOST_TABLES {
            self.stages.clear();
        }
        self.stages.push(StageTable::new(axis, mode, pid, key));
        self.stages.len() - 1
    }
}
