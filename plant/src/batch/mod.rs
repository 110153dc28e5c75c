//! Many runs of one axis side by side: what studies are made of.
//!
//! ```text
//! width       how many lanes, and with which instructions
//! grid        the solution around a change of contact
//! curve       a guard over a step, and where it is zero
//! transition  a step with one change of contact
//! phase       the numbers of one step, those of all lanes and those of each
//! group       the runs of a group, and their steps that have not been looked at
//! peaks       extremes between the ends of the steps
//! step        the step that they take, and which of them leave it
//! contact     lanes that leave the common step, of all groups together
//! ```
//!
//! The lanes share motor, gear, screw, carriage, joint stiffness and the
//! lengths of the steps; b, the command, encoder, converter and gains are free.
//! A step computes all lanes at once and looks at each lane's bounds. A lane
//! whose mode may change is taken out of it. A change of contact and nothing
//! else is followed with those of other groups, by the operations of the single
//! run ([`crate::Plant`]) in their order; anything else by the code of that. So
//! every lane ends with the bits of the single run.

mod contact;
mod curve;
mod grid;
mod group;
mod peaks;
mod phase;
mod step;
mod transition;
mod width;

use self::contact::Contacts;
pub use self::group::LaneSetup;
use self::group::{Group, Shared};
use self::phase::Phase;
use self::step::Leaving;
pub use self::width::{Eight, Four, One, Width};
use crate::exact::{DRIVING, Tables};
use crate::hybrid::PlantError;
use crate::model::axis::{Axis, AxisParameters};
use crate::model::state::State;
use crate::observe::extremes::{Extremes, FIGURES};

/// Many runs of one axis, in groups that each have one step for all lanes.
///
/// A lane whose contact changes leaves the common step. Its group is then held
/// up until [`Batch::catch_up`] has followed it, together with those of other
/// groups: one by one they would take longer than all the common steps.
#[derive(Debug, Clone)]
pub struct Batch<W: Width> {
    width: W,
    shared: Shared,
    groups: Vec<Group<W>>,
    running: usize,
    leaving: Vec<Leaving>,
    contacts: Contacts<W>,
}

/// The lanes of a group, which have their steps in common.
#[derive(Debug)]
pub struct InStep<'a, W: Width> {
    width: W,
    shared: &'a mut Shared,
    group: &'a mut Group<W>,
    number: usize,
    leaving: &'a mut Vec<Leaving>,
}

impl<W: Width> InStep<'_, W> {
    /// β of every lane \[rad\].
    #[inline(always)]
    pub fn beta_rad(&self) -> W::Vector {
        self.width.load(&self.group.track.now().state[0])
    }

    /// ε of every lane \[rad\].
    #[inline(always)]
    pub fn epsilon_rad(&self) -> W::Vector {
        self.width.load(&self.group.track.now().state[2])
    }

    /// ẍ of every lane \[m/s²\].
    #[inline(always)]
    pub fn acceleration_mps2(&self) -> W::Vector {
        self.width.load(&self.group.acceleration_mps2)
    }

    /// Advances every lane by a step of length number `phase`, under a voltage
    /// \[V\] of its own; `command_m` is x_ref at the end of the step \[m\]. Returns
    /// whether the group is now held up: [`Batch::catch_up`] then has to come
    /// first, before it is asked for anything.
    #[inline(always)]
    pub fn advance(&mut self, phase: usize, voltage_v: W::Vector, command_m: W::Vector) -> bool {
        let numbers = (self.number, phase);
        self.group
            .advance(self.shared, numbers, voltage_v, command_m, self.leaving)
    }
}

impl<W: Width> Batch<W> {
    /// Runs with steps of the given lengths \[ns\]: one a sample, or two where a
    /// computation delay divides it.
    ///
    /// # Errors
    /// [`PlantError::NotAffine`] with a quadratic resistance.
    pub fn new(
        width: W,
        parameters: &AxisParameters,
        lengths_ns: &[u64],
    ) -> Result<Self, PlantError> {
        if !parameters.is_affine() {
            return Err(PlantError::NotAffine);
        }
        Ok(Self {
            width,
            shared: Shared {
                axis: Axis::new(parameters, 0.0),
                tables: Tables::default(),
                phases: lengths_ns.iter().map(|&ns| Phase::new(ns)).collect(),
                lengths_ns: lengths_ns.to_vec(),
                most_chords: [[0.0; DRIVING]; FIGURES],
            },
            groups: Vec::new(),
            running: 0,
            leaving: Vec::new(),
            contacts: Contacts::new(),
        })
    }

    /// Puts one run for each setup at rest at zero, [`Width::LANES`] in a group;
    /// lanes that are left over repeat the last one.
    pub fn start(&mut self, setups: &[LaneSetup]) {
        self.leaving.clear();
        self.running = setups.len().div_ceil(W::LANES);
        let Some(last) = setups.last() else { return };
        while self.groups.len() < self.running {
            let group = Group::new(self.width, self.shared.phases.len());
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
        InStep {
            width: self.width,
            shared: &mut self.shared,
            group: &mut self.groups[number],
            number,
            leaving: &mut self.leaving,
        }
    }

    /// Follows the lanes that have left the common step.
    #[inline(always)]
    pub fn catch_up(&mut self) {
        let groups = &mut self.groups;
        self.contacts
            .follow(self.width, &mut self.shared, groups, &mut self.leaving);
    }

    /// State of a run.
    pub fn state(&self, run: usize) -> State {
        self.groups[run / W::LANES].state(run % W::LANES)
    }

    /// Looks at what still waits for a look in any run.
    #[inline(always)]
    pub fn look_back(&mut self) {
        for group in &mut self.groups[..self.running] {
            group.look_back(&mut self.shared);
        }
    }

    /// Extremes of a run so far, or the error that ended it; [`Batch::look_back`]
    /// has to come first: it wants a caller whose code has the instructions of the
    /// width, and this does not.
    ///
    /// # Errors
    /// The [`PlantError`] that stopped the run; it stands where it stopped.
    pub fn extremes_of(&self, run: usize) -> Result<Extremes, PlantError> {
        self.groups[run / W::LANES].extremes_of(&self.shared.lengths_ns, run % W::LANES)
    }
}
