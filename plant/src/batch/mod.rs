//! Many runs of one axis side by side: what studies are made of.
//!
//! ```text
//! transition  a step with one change of contact
//! phase       the numbers of one step, those of all lanes and those of each
//! group       the runs of a group, and their steps that have not been looked at
//! peaks       which figures may exceed their peaks between the ends of the steps
//! questions   those of them that wait for an answer
//! answers     the answers
//! step        the step that they take, and which of them leave it
//! contact     lanes that leave the common step, of all groups together
//! ```
//!
//! The lanes share motor, gear, screw, carriage, joint stiffness, drive, load and the
//! lengths of the steps; b, the command, encoder, converter and gains are free.
//! A step computes all lanes at once and looks at each lane's bounds. A lane
//! whose mode may change is taken out of it. A change of contact and nothing
//! else is followed with those of other groups, by the operations of the single
//! run ([`crate::Plant`]) in their order; anything else by the code of that. So
//! every lane ends with the bits of the single run.

mod answers;
mod contact;
mod group;
mod peaks;
mod phase;
mod questions;
mod step;
mod transition;

use self::contact::Contacts;
pub use self::group::LaneSetup;
use self::group::{Group, Shared};
use self::phase::Phase;
pub use self::step::InStep;
use self::step::Leaving;
use crate::exact::{DRIVING, Tables, is_stiff};
use crate::hybrid::PlantError;
use crate::model::axis::{Axis, AxisParameters};
use crate::model::state::State;
use crate::model::surroundings::Surroundings;
use crate::numerics::width::Width;
use crate::observe::extremes::{Extremes, FIGURES};

/// Many runs of one axis, in groups that each have one step for all lanes.
///
/// A lane whose contact changes leaves the common step. Its group is then held
/// up until [`Batch::catch_up`] has followed it, together with those of other
/// groups, which go on meanwhile: one by one they would take longer than all the
/// common steps.
#[derive(Debug, Clone)]
pub struct Batch<W: Width> {
    width: W,
    shared: Shared,
    groups: Vec<Group<W>>,
    running: usize,
    leaving: Vec<Leaving>,
    contacts: Contacts<W>,
}

impl<W: Width> Batch<W> {
    /// Runs with steps of the given lengths \[ns\]: one a sample, or two where a
    /// computation delay divides it, and those after the last sample.
    ///
    /// # Errors
    /// [`PlantError::NotAffine`] with a quadratic resistance; [`PlantError::NotSideBySide`]
    /// within other surroundings than those that [`Surroundings::go_side_by_side`] says;
    /// [`PlantError::TooStiff`] where a time constant is far below a step: what such
    /// runs take is counted, which only a single run can.
    pub fn new(
        width: W,
        parameters: &AxisParameters,
        surroundings: &Surroundings,
        lengths_ns: &[u64],
    ) -> Result<Self, PlantError> {
        if !parameters.is_affine() {
            return Err(PlantError::NotAffine);
        }
        if !surroundings.go_side_by_side() {
            return Err(PlantError::NotSideBySide);
        }
        let axis = Axis::new(parameters, surroundings, 0.0);
        if lengths_ns.iter().any(|&ns| is_stiff(&axis, ns)) {
            return Err(PlantError::TooStiff { time_s: 0.0 });
        }
        Ok(Self {
            width,
            shared: Shared {
                has_stiction: axis.resistance.has_stiction(),
                limits: axis.stage.limits(),
                start: surroundings.start,
                axis,
                tables: Tables::default(),
                phases: lengths_ns.iter().map(|&ns| Phase::new(ns)).collect(),
                most_chords: [[0.0; DRIVING]; FIGURES],
            },
            groups: Vec::new(),
            running: 0,
            leaving: Vec::new(),
            contacts: Contacts::new(lengths_ns.len()),
        })
    }

    /// Puts one run for each setup at rest at zero, [`Width::LANES`] in a group;
    /// lanes that are left over repeat the last one.
    pub fn start(&mut self, setups: &[LaneSetup]) {
        self.leaving.clear();
        self.contacts.start();
        self.running = setups.len().div_ceil(W::LANES);
        let Some(last) = setups.last() else { return };
        while self.groups.len() < self.running {
            let group = Group::new(self.width);
            self.groups.push(group);
        }
        for (group, setups) in self.groups.iter_mut().zip(setups.chunks(W::LANES)) {
            group.start(&mut self.shared, setups, last);
        }
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.running
    }

    /// A group, to be advanced.
    #[inline(always)]
    pub fn group(&mut self, number: usize) -> InStep<'_, W> {
        let (group, leaving) = (&mut self.groups[number], &mut self.leaving);
        InStep::new(&mut self.shared, group, number, leaving)
    }

    /// True if lanes of a group have left the common step and wait to be followed.
    #[inline(always)]
    pub fn is_held_up(&self, group: usize) -> bool {
        self.groups[group].held_up > 0
    }

    /// Follows lanes that have left the common step, as many of one kind at a time as
    /// go side by side; fewer wait for others, unless no group can go on without them.
    pub fn catch_up(&mut self, none_goes_on: bool) {
        let (w, shared) = (self.width, &mut self.shared);
        let (contacts, groups) = (&mut self.contacts, &mut self.groups);
        let leaving = &mut self.leaving;
        w.apart(
            #[inline(always)]
            || contacts.follow(w, shared, groups, (leaving, none_goes_on)),
        );
    }

    /// State of a run.
    pub fn state(&self, run: usize) -> State {
        let (group, lane) = (&self.groups[run / W::LANES], run % W::LANES);
        let mut state = group.state(lane);
        state.beta_rad += group.start_rad.as_ref()[lane];
        state
    }

    /// Looks at what still waits for a look in any run.
    pub fn look_back(&mut self) {
        let (groups, shared) = (&mut self.groups[..self.running], &mut self.shared);
        self.width.apart(
            #[inline(always)]
            || {
                for group in groups {
                    group.look_back(shared);
                }
            },
        );
    }

    /// Extremes of a run so far, or the error that ended it; [`Batch::look_back`] has to
    /// come first.
    ///
    /// # Errors
    /// The [`PlantError`] that stopped the run; it stands where it stopped.
    pub fn extremes_of(&self, run: usize) -> Result<Extremes, PlantError> {
        self.groups[run / W::LANES].extremes_of(run % W::LANES)
    }
}
