//! Comparison of a chip with the host, bit for bit: every number of every step of a
//! case in closed loop, and every row of the golden vectors.
//!
//! ```text
//!  case ─┬─► host's controller ─┬─ plant          HostTrace: every step
//!        │                      └──────────────────────┐
//!        └─► chip's controller ─┬─ plant               ▼
//!                               └─► every step ──► compared, the first
//!                                                  difference ends the run
//! ```
//!
//! Either side has a plant of its own. As long as the codes are the same the
//! plants are, and a code that differs is found in its own step.
//!
//! A [`Step`] is compared; the same numbers go into the [`TraceHash`] of
//! either side. The time of a step is no part of it.

mod step;
mod vectors;

use std::slice::Iter;

use super::chip_law::{ChipLaw, ChipLawError};
use super::client::Client;
use hil_core::case::{Case, Law};
use hil_core::controllers::{Controller, IoKind};
use hil_core::error::RunError;
use hil_core::message::{Command, Link, LinkError, Measurement};
use hil_core::run::{RowSink, RunOptions, run_over};

pub use step::{Difference, Named, Number, NumberPair, RowDifference, Step, TraceHash};
pub use vectors::{ReplayError, Replayed, VectorFile, replay, stored};

/// A run of a case with the host's controller, step by step; about 400 bytes
/// each.
#[derive(Debug, Clone)]
pub struct HostTrace<'c> {
    case: &'c Case,
    steps: Vec<Step>,
}

/// Result of a chip against the host in one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Steps that were compared.
    pub steps: u64,
    /// The first difference; nothing was compared behind it.
    pub difference: Option<Difference>,
}

impl<'c> HostTrace<'c> {
    /// Runs a case of rung `firmware` on the host; its rows go to `sink`.
    ///
    /// # Errors
    /// As [`hil_core::run::run()`], and for any other rung.
    pub fn record(case: &'c Case, sink: &mut RowSink<'_>) -> Result<Self, RunError> {
        if case.controller.law != Law::Firmware {
            return Err(ChipLawError::Law(case.controller.law).into());
        }
        let controller = Controller::new(case, IoKind::Direct).map_err(RunError::Quantise)?;
        let mut recording = Recording {
            controller: controller.ok_or(RunError::NoSampleTime)?,
            steps: Vec::new(),
        };
        run_over(case, RunOptions::default(), &mut recording, sink)?;
        let steps = recording.steps;
        Ok(Self { case, steps })
    }

    /// Every step of the run.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Runs the case with the controller at the end of `link` and compares. Each
    /// step goes into `hash`, the last one too.
    ///
    /// # Errors
    /// As [`run_over`].
    pub fn compare(
        &self,
        link: &mut impl Link,
        hash: &mut TraceHash,
        sink: &mut RowSink<'_>,
    ) -> Result<Comparison, RunError> {
        let mut compared = Compared {
            link,
            case: self.case,
            host: self.steps.iter(),
            hash,
            steps: 0,
            difference: None,
        };
        let run = run_over(self.case, RunOptions::default(), &mut compared, sink);
        let (steps, difference) = (compared.steps, compared.difference);
        if difference.is_none() {
            run?;
        }
        Ok(Comparison { steps, difference })
    }

    /// Gives the chip the controller of the case and compares.
    ///
    /// # Errors
    /// As [`super::run_on_chip`].
    pub fn compare_chip(
        &self,
        client: &mut Client,
        hash: &mut TraceHash,
        sink: &mut RowSink<'_>,
    ) -> Result<Comparison, RunError> {
        // Nobody looks at the times.
        let in_qemu = false;
        let mut law = ChipLaw::new(client, self.case, in_qemu)?;
        self.compare(&mut law, hash, sink)
    }
}

/// A controller whose every step is kept.
struct Recording {
    controller: Controller,
    steps: Vec<Step>,
}

impl Link for Recording {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let command = self.controller.exchange(measurement)?;
        self.steps.push(Step::new(measurement, command));
        Ok(command)
    }
}

/// A controller whose every step is held against the host's.
struct Compared<'a, L> {
    link: &'a mut L,
    case: &'a Case,
    host: Iter<'a, Step>,
    hash: &'a mut TraceHash,
    steps: u64,
    difference: Option<Difference>,
}

impl<L: Link> Link for Compared<'_, L> {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        let command = self.link.exchange(measurement)?;
        let step = Step::new(measurement, command);
        self.hash.add(&step);
        self.steps += 1;
        // Both runs have the steps of the one case.
        let host = self.host.next().ok_or(LinkError::Closed { tick })?;
        self.difference = Difference::between(self.case, host, &step);
        if self.difference.is_some() {
            // Ends the run.
            return Err(LinkError::Closed { tick });
        }
        Ok(command)
    }
}
