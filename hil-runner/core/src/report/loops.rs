//! The linear loop of one run, as Bode, Nyquist and Nichols plots show it.

use serde::Serialize;

use crate::case::Case;
use crate::number::{self, seconds};
use crate::theory::{JointState, LoopCurves, LoopGains, left_out, no_loop};

/// The loop of a run in contact and in the gap, with each set of its gains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoopReport {
    /// One, or with a gain change two, in the order of time.
    pub loops: Vec<NamedLoop>,
    /// Remarks on what the loop is without, one sentence each.
    pub notes: Vec<String>,
}

/// The loop with one set of gains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedLoop {
    /// The time of these gains, such as `from 0.3 s`; empty for the whole run.
    pub name: String,
    /// Its curves.
    pub curves: LoopCurves,
}

impl LoopReport {
    /// The loop of a case; none where it has no sampled one in contact.
    pub fn of(case: &Case) -> Option<Self> {
        if no_loop(case, JointState::Contact).is_some() {
            return None;
        }
        let named = |name: String, gains: &LoopGains| NamedLoop {
            name,
            curves: LoopCurves::of(case, gains),
        };
        let start = LoopGains::of(case);
        let change = LoopGains::after_change(case).zip(case.options.gain_change);
        let loops = match change {
            None => vec![named(String::new(), &start)],
            Some((after, change)) => {
                let at_s = number::table(seconds(change.at_ns));
                vec![
                    named(format!("until {at_s} s"), &start),
                    named(format!("from {at_s} s"), &after),
                ]
            }
        };
        let gap = no_loop(case, JointState::Gap);
        let gap = gap.map(|reason| format!("No loop in the gap: {reason}."));
        let without = left_out(case).map(|note| format!("Besides, {note}."));
        Some(Self {
            loops,
            notes: gap.into_iter().chain(without).collect(),
        })
    }
}
