//! Solver `exact`: the plant between two updates of the voltage, without a
//! discretisation error, and every change of mode found.
//!
//! ```text
//! system      A and u of the axis in one mode
//! sums        weighted sums of columns
//! levels      exact steps over a sample and its halves, the shortest a power series; the chord
//!             bound, with its proof
//! grid        exact states anywhere within a step
//! sketch      a quantity over a step as one polynomial, with a proven remainder
//! curve       that polynomial for one run or many side by side; its first zero
//! loss        what damper, armature and guide turn into heat, as a sum of squares
//! table       a system's quantities with their bounds, made once
//! whole_step  a whole sample under a held voltage: states, rates, bounds and heat
//! held_table  all that the state does not change under a held voltage
//! commanded_table  the same under the continuous law and behind other amplifiers
//! memory      the tables made so far
//! crossing    along the solution in the longest steps that will do; the first zero of a guard
//! peak        extremes between the samples, also of what is behind the command
//! power       largest magnitude of a product of two quantities
//! piece       a piece of the solution, and what a run's figures look at on it
//! advance     one sample under a held voltage: step, look, switch
//! commanded   the same under the continuous law and behind other amplifiers
//! ```

mod advance;
mod commanded;
mod commanded_table;
mod crossing;
mod curve;
mod grid;
mod held_table;
mod levels;
mod loss;
mod memory;
mod peak;
mod piece;
mod power;
mod sketch;
mod sums;
mod system;
mod table;
#[cfg(test)]
pub(crate) mod tests;
mod whole_step;

pub(crate) use curve::{Curve, ELEVENTH, SLOPES};
pub(crate) use grid::{Grid, Window, scaled, zero_near};
pub(crate) use held_table::{HeldTable, is_stiff};
pub(crate) use levels::{BOUND_MARGIN, NOISE_ULPS};
pub(crate) use loss::DRIVING;
pub(crate) use memory::Tables;
pub(crate) use peak::{command_slopes, magnitude_at_turn, magnitude_behind};
pub(crate) use piece::behind_figure;
pub(crate) use sketch::Sketch;
pub(crate) use system::{DELTA, HELD, held_state};
pub(crate) use table::Quantity;
pub(crate) use whole_step::{WholeStep, sizes_of, times_sizes};
