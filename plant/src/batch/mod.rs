//! Many runs of one axis side by side: what studies are made of.
//!
//! ```text
//! width     how many lanes, and with which instructions
//! phase     the numbers of one step, lane by lane
//! modes     what a lane's mode makes of the equations
//! lanes     the states of all lanes, one step at a time
//! loss      what the dampers of the joints take in a step
//! figures   what is measured at the ends of a step, and whether to look between
//! closer    lanes that leave the common step
//! pending   steps that are looked at for extremes later
//! ```
//!
//! The lanes share motor, gear, screw, carriage, joint stiffness and the
//! lengths of the steps; b, the command, encoder, converter and gains are free.
//! A step computes all lanes at once and looks at each lane's bounds. A lane
//! whose mode may change, or whose figures may grow between the samples, is
//! taken out and advanced by the code of the single run ([`crate::Plant`]), so
//! that every lane ends with the bits of that.

mod closer;
mod figures;
mod lanes;
mod loss;
mod modes;
mod pending;
mod phase;
mod width;

pub use lanes::{Batch, LaneSetup};
pub use width::{Eight, One, Width};
