//! Solver `exact`: the plant between two updates of the voltage, without a
//! discretisation error, and every change of mode found.
//!
//! ```text
//! system      A and u of the axis in one mode
//! taylor      the solution over a short stretch as a power series
//! levels      exact steps over a sample and its halves; the chord bound, with its proof
//! tables      all that the state does not change, made once
//! walk        along the solution in the longest steps that will do
//! roots       zeros and extremes of polynomials, found for certain
//! crossing    the first zero of a guard
//! peak        extremes between the samples
//! figures     what a run's figures look at
//! advance     one sample: step, look, switch
//! feedback    the same under the continuous law
//! ```

mod advance;
mod crossing;
mod feedback;
mod figures;
mod levels;
mod peak;
mod roots;
mod system;
mod tables;
mod taylor;
#[cfg(test)]
mod tests;
mod walk;

pub(crate) use advance::HeldPiece;
pub(crate) use feedback::FeedbackPiece;
pub(crate) use figures::Sights;
pub(crate) use system::{Column, HELD, to_plant_vector};
pub(crate) use tables::{HeldTable, Quantity, Tables};
pub(crate) use walk::BOUND_MARGIN;
