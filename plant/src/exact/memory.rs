//! What solver `exact` has computed about an axis, to be used again.

use std::sync::Arc;

use super::commanded_table::{CommandedTable, Key};
use super::held_table::HeldTable;
use super::system::{COMMANDED, Column};
use crate::model::axis::{Axis, Mode};
use crate::model::motion::{Coupling, Oscillator};
use crate::model::pid::ContinuousPid;

/// The whole state at the end of the last interval under the continuous law, to go on from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Carried {
    pub(super) time_ns: u64,
    pub(super) length_ns: u64,
    pub(super) x: Column<COMMANDED>,
    pub(super) command: Oscillator,
    pub(crate) demand: f64,
    /// Place of the table.
    pub(super) place: usize,
    /// Until when the command keeps to its interval \[s\].
    pub(super) until_s: f64,
}

/// The tables made so far. They are made when first needed; a sampled run
/// needs two, one for each state of the joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tables {
    held: Vec<Arc<HeldTable>>,
    pub(super) commanded: Vec<Box<CommandedTable>>,
    pid: Option<Box<ContinuousPid>>,
    /// Under that law. Whatever moves the axis otherwise takes time, or takes this away.
    pub(crate) carried: Option<Box<Carried>>,
}

/// Tables kept at most of each kind; a run with a delay uses twice three, a
/// continuous one with all modes and segments about twenty.
const MOST_TABLES: usize = 64;

/// The place of a table among those of its kind; it is made if need be.
#[inline]
fn place_of<T>(tables: &mut Vec<T>, is: impl Fn(&T) -> bool, make: impl FnOnce() -> T) -> usize {
    let found = tables.iter().position(is);
    found.unwrap_or_else(|| add(tables, make))
}

#[cold]
fn add<T>(tables: &mut Vec<T>, make: impl FnOnce() -> T) -> usize {
    if tables.len() >= MOST_TABLES {
        tables.clear();
    }
    tables.push(make());
    tables.len() - 1
}

impl Tables {
    /// Where to go on from at that time under this law.
    #[inline(always)]
    pub(crate) fn carried_at(&self, time_ns: u64, pid: &ContinuousPid) -> Option<&Carried> {
        let (carried, law) = (self.carried.as_deref()?, self.pid.as_deref()?);
        (carried.time_ns == time_ns && law.is_same_law(pid)).then_some(carried)
    }

    /// The table for `mode` and `length_ns`, made if need be.
    #[inline]
    pub(crate) fn held(&mut self, axis: &Axis, mode: &Mode, length_ns: u64) -> &Arc<HeldTable> {
        let key = (mode.joint.carries(), mode.guide, length_ns);
        let place = place_of(
            &mut self.held,
            |t| (t.closed, t.guide, t.length_ns) == key,
            || Arc::new(HeldTable::new(axis, mode, length_ns)),
        );
        &self.held[place]
    }

    /// The place of the table for a mode of whatever else gives the voltage.
    pub(super) fn commanded(
        &mut self,
        axis: &Axis,
        mode: &Mode,
        pid: Option<&ContinuousPid>,
        (coupling, length_ns): (Option<Coupling>, u64),
    ) -> usize {
        let key = Key {
            carries: mode.joint.carries(),
            guide: mode.guide,
            amplifier: mode.amplifier,
            stage: mode.stage,
            coupling,
            length_ns,
        };
        if pid.is_some() && self.pid.as_deref() != pid {
            // All of them are of another law.
            self.commanded.clear();
            self.pid = pid.cloned().map(Box::new);
        }
        place_of(
            &mut self.commanded,
            |t| t.key == key,
            || Box::new(CommandedTable::new(axis, mode, pid, key)),
        )
    }
}
