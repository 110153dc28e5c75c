//! Linear theory of the sampled loop and what it predicts, to stand beside what
//! the simulation finds.
//!
//! ```text
//!  Case ──► LinearAxis ──► HeldStep ──► PulseResponse ──► Characteristic ──► stable?
//!           in contact     Φ, Γ0, Γ1    β/V in w = z − 1   L(e^{jωΔt})        Routh
//!           or in the gap                                       │
//!                    LoopFamily = Characteristic + Grid ────────┴──► Margin
//!                                            Loops, LoopCurves ──► LoopFigures, plots
//! ```
//!
//! | question | function |
//! | --- | --- |
//! | how far from instability, how fast, how stiff? | [`Loops::figures`], [`margin`] |
//! | what do hold and delay cost, to first order? | [`margin_by_delay`] |
//! | does the axis cycle in its gap? | [`gap_cycle`] |
//! | does it cycle by steps of encoder or converter? | [`encoder_cycle`], [`dac_cycle`] |
//! | how much do the steps shake it in motion? | [`quantisation_noise`] |
//!
//! All are pure functions of a case's parameters and `None` where they do not
//! apply. Sources, conditions and how well they agree with the simulation stand
//! in `docs/THEORY.md`.

mod characteristic;
mod curve;
mod curves;
mod cycles;
mod delay;
mod family;
mod held;
mod linear_axis;
mod loops;
mod noise;
mod search;
mod stiffness;
#[cfg(test)]
mod tests;

pub use characteristic::{LoopGains, is_papers_loop};
pub use curve::Margin;
pub use curves::{LoopCurve, LoopCurves};
pub use cycles::{
    Cycle, CycleStability, FEWEST_SAMPLES, MOST_DISTORTION, dac_cycle, dac_cycles, encoder_cycle,
    encoder_cycles, gap_cycle, gap_cycles, joint_share, quantiser, quantiser_bias,
};
pub use delay::margin_by_delay;
pub use family::{FamilyKey, LoopFamily};
pub use linear_axis::JointState;
pub use loops::{JOINT_STATES, LoopFigures, Loops, left_out, margin, no_figure, no_loop};
pub use noise::{Noise, NoiseFigures, quantisation_noise};
