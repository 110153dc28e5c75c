//! The stability margin of every run's linearised loop, with the joint closed
//! and open. What does not depend on gains and steps is kept from run to run.

use super::cell::Cell;
use hil_core::case::{Case, Law};
use hil_core::theory::{FamilyKey, JointState, LoopFamily, LoopGains, is_papers_loop};

/// Families that are kept: those of neighbouring points of a grid.
const KEPT: usize = 8;

/// Names of the columns.
pub(super) const COLUMNS: [&str; 2] = ["modulus_margin_contact", "modulus_margin_gap"];

/// Loops of the last families.
#[derive(Debug, Default)]
pub(super) struct Margins {
    known: Vec<(FamilyKey, Option<LoopFamily>)>,
    /// Place that is given up next.
    oldest: usize,
}

impl Margins {
    /// The signed modulus margins of a run; empty where it has none: on rung
    /// `continuous`, with a law that is not the paper's, with a delay that is
    /// measured, and of a joint without a gap the open one.
    pub(super) fn cells(&mut self, case: &Case) -> [Cell; 2] {
        if case.controller.law == Law::Continuous || !is_papers_loop(case) {
            return [Cell::Empty, Cell::Empty];
        }
        let gains = LoopGains::of(case);
        [JointState::Closed, JointState::Open].map(|joint| {
            if joint == JointState::Open && !case.has_gap() {
                return Cell::Empty;
            }
            let family = self.family(case, joint);
            Cell::number(family.map(|family| family.signed_modulus(&gains)))
        })
    }

    fn family(&mut self, case: &Case, joint: JointState) -> Option<&LoopFamily> {
        let period_ns = case.controller.sample_time_ns?;
        let delay_ns = case.controller.computation_delay.fixed_ns()?;
        let key = LoopFamily::key(&case.axis, period_ns, delay_ns, joint);
        let place = self.known.iter().position(|(known, _)| *known == key);
        let place = match place {
            Some(place) => place,
            None => {
                let made = (key, LoopFamily::of(case, joint));
                if self.known.len() < KEPT {
                    self.known.push(made);
                    self.known.len() - 1
                } else {
                    let place = self.oldest;
                    self.oldest = (place + 1) % KEPT;
                    self.known[place] = made;
                    place
                }
            }
        };
        self.known[place].1.as_ref()
    }
}
