//! Many runs of one axis side by side: what studies are made of.
//!
//! ```text
//! width     how many lanes, and with which instructions
//! phase     the numbers of one step, those of all lanes and those of each
//! modes     what a lane's mode makes of the equations
//! lanes     all runs of an axis, in groups
//! group     the runs of a group
//! step      the step that they take, and which of them leave it
//! loss      what the dampers of the joints take in a step
//! track     its last steps, and whether to look between their ends
//! question  steps and pieces of steps that are looked at for extremes later
//! contact   lanes that leave the common step, of all groups together
//! swing     a step with one change of contact
//! course    the solution around it
//! curve     where it is
//! closer    lanes that are single runs for a step
//! ```
//!
//! The lanes share motor, gear, screw, carriage, joint stiffness and the
//! lengths of the steps; b, the command, encoder, converter and gains are free.
//! A step computes all lanes at once and looks at each lane's bounds. A lane
//! whose mode may change is taken out of it. A change of contact and nothing
//! else is followed with those of other groups, by the operations of the single
//! run ([`crate::Plant`]) in their order; anything else by the code of that. So
//! every lane ends with the bits of the single run.

mod closer;
mod contact;
mod course;
mod curve;
mod group;
mod lanes;
mod loss;
mod modes;
mod phase;
mod question;
mod step;
mod swing;
mod track;
mod width;

pub use lanes::{Batch, InStep, LaneSetup};
pub use width::{Eight, Four, One, Width};
