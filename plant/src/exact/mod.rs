//! Solver `exact`: the plant between two updates of the voltage, without a
//! discretisation error, and every change of mode found.
//!
//! ```text
//! system      A and u of the axis in one mode
//! taylor      the solution over a short stretch as a power series
//! levels      exact steps over a sample and its halves; the chord bound, with its proof
//! loss        what the joint's damper takes, as a sum of squares
//! tables      all that the state does not change, made once
//! zeros       the first zero of a polynomial with a remainder
//! kernel      the step over a whole sample under a held voltage
//! behind      how far a quantity is behind the command
//! grid        exact states anywhere within a step
//! sketch      a quantity over a step as one polynomial, with a proven remainder
//! walk        along the solution in the longest steps that will do
//! roots       zeros and extremes of polynomials, found for certain
//! crossing    the first zero of a guard
//! peak        extremes between the samples
//! figures     what a run's figures look at
//! advance     one sample: step, look, switch
//! feedback    the same under the continuous law
//! ```

mod advance;
mod behind;
mod crossing;
mod feedback;
mod figures;
mod grid;
mod kernel;
mod levels;
mod loss;
mod peak;
mod roots;
mod sketch;
mod system;
mod tables;
mod taylor;
#[cfg(test)]
mod tests;
mod walk;
mod zeros;

pub(crate) use advance::{HeldPiece, NOISE_ULPS};
pub(crate) use behind::command_slopes;
pub(crate) use feedback::FeedbackPiece;
pub(crate) use figures::{CARRIAGE, FIGURES, Piece, Seen, Sights, figures_at};
pub(crate) use grid::{CELLS, MOST_NEWTON as MOST_POLISHING, TERMS};
pub(crate) use loss::DRIVING;
pub(crate) use sketch::{EVALUATION, SLOPES, Sketch, VALUES};
pub(crate) use system::{AxisSystem, Column, HELD, Matrix, to_plant_vector};
pub(crate) use tables::{HeldTable, Quantity, Tables};
pub(crate) use walk::BOUND_MARGIN;
pub(crate) use zeros::{CLOSE, MOST_NEWTON, binomials};
