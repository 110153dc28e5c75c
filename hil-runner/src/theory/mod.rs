//! Linear theory of the sampled loop, and what it predicts.
//!
//! Pure functions on a case's parameters, to stand beside what the simulation
//! finds. Sources and measured agreement: `docs/THEORY.md`.

mod characteristic;
#[cfg(test)]
mod closed_loop;
mod curve;
mod delay;
mod family;
mod field;
mod gains;
mod grid;
mod held;
mod linear_axis;
mod margin;
mod polynomial;
mod refine;
#[cfg(test)]
mod tests;

pub use delay::margin_by_delay;
pub use family::{FamilyKey, LoopError, LoopFamily};
pub use field::{MarginField, margin};
pub use gains::{LoopGains, is_papers_loop, loop_gain};
pub use linear_axis::JointState;
pub use margin::{Crossing, Margin};
