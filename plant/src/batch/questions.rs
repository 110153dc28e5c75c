//! Figures that may exceed their peaks between the ends of a step, or of a piece of one between
//! changes of contact. Most are outdone by what comes later, so they wait.

use super::phase::{KINDS, Kind};
use crate::model::axis::Mode;
use crate::model::state::State;
use crate::numerics::seconds;
use crate::observe::extremes::FIGURES;

/// A step of one run, to be looked at again.
#[derive(Debug, Clone, Copy)]
pub(super) struct PastStep {
    /// Where it begins, or the piece of it.
    pub(super) state: State,
    pub(super) mode: Mode,
    pub(super) voltage_v: f64,
    pub(super) phase: usize,
    pub(super) time_ns: u64,
}

/// A figure over a step of one run, or over a piece of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    /// Upper bound of its magnitude.
    pub(super) upper: f64,
    pub(super) lane: usize,
    pub(super) step: PastStep,
    /// The piece, where it is one.
    pub(super) piece: Option<Piece>,
}

/// A piece of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) start_s: f64,
    pub(super) length_s: f64,
    pub(super) end: State,
}

impl Question {
    /// Start and length of the step or piece \[s\].
    pub(super) fn times_s(&self, step_s: f64) -> (f64, f64) {
        match &self.piece {
            None => (seconds(self.step.time_ns), step_s),
            Some(piece) => (piece.start_s, piece.length_s),
        }
    }
}

/// What questions that go side by side have in common: the length of the step, the kind of
/// mode, and the figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Topic {
    pub(super) phase: usize,
    pub(super) kind: Kind,
    pub(super) figure: usize,
}

impl Topic {
    pub(super) fn place(self) -> usize {
        (self.phase * KINDS + self.kind.place()) * FIGURES + self.figure
    }

    pub(super) fn all(phases: usize) -> impl Iterator<Item = Self> {
        (0..phases).flat_map(|phase| {
            Kind::all().flat_map(move |kind| {
                (0..FIGURES).map(move |figure| Self {
                    phase,
                    kind,
                    figure,
                })
            })
        })
    }
}

/// Questions of one topic that wait at most, and how many may go on waiting when those that
/// are outdone have been dropped.
pub(super) const MOST: usize = 64;
pub(super) const KEPT: usize = 48;

/// The questions of a group that wait, by topic.
#[derive(Debug, Clone, Default)]
pub(super) struct Questions {
    pub(super) lists: Vec<Vec<Question>>,
    /// Room for those that are answered now.
    pub(super) chunk: Vec<Question>,
}

impl Questions {
    /// None, with room for those of so many lengths of a step.
    pub(super) fn clear(&mut self, phases: usize) {
        self.lists.resize_with(phases * KINDS * FIGURES, Vec::new);
        self.lists.iter_mut().for_each(Vec::clear);
    }
}
