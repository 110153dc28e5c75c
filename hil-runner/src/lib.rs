//! Runs the controller and the plant in lockstep and reports what came out.

pub mod case;
