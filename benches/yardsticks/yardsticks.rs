//! Other people's solvers on the project's workloads, as fast as they go:
//! a yardstick that is slow through clumsy use would measure nothing.

#![forbid(unsafe_code)]

pub mod contact;
pub mod diffsol_axis;
pub mod diffsol_continuous;
pub mod odeint;
pub mod programs;
