//! Linear theory of the sampled loop, and what it predicts.
//!
//! Pure functions on a case's parameters, to stand beside what the simulation
//! finds. Sources and measured agreement: `docs/THEORY.md`.

mod characteristic;
mod closed_loop;
mod curve;
mod cycles;
mod delay;
mod describing;
mod family;
mod field;
mod gains;
mod gap_cycles;
mod grid;
mod held;
mod linear_axis;
mod margin;
mod noise;
mod polynomial;
mod refine;
mod step_cycles;
#[cfg(test)]
mod tests;

pub use cycles::{Cycle, CycleStability, FEWEST_SAMPLES, MOST_DISTORTION};
pub use delay::margin_by_delay;
pub use describing::{joint_share, quantiser, quantiser_bias};
pub use family::{FamilyKey, LoopError, LoopFamily};
pub use field::{MarginField, margin};
pub use gains::{LoopGains, is_papers_loop, loop_gain};
pub use gap_cycles::{gap_cycle, gap_cycles};
pub use linear_axis::JointState;
pub use margin::{Crossing, Margin};
pub use noise::{Noise, NoiseFigures, quantisation_noise};
pub use step_cycles::{dac_cycle, dac_cycles, encoder_cycle, encoder_cycles};
