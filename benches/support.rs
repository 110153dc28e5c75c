//! Shared set-up of the benchmarks: the workloads W1-W5, the lockstep that
//! every program is driven by, the fixed-step Runge-Kutta of the paper, the
//! reference loop that they are compared with, and the project's own solvers.
//!
//! Comparators with heavy dependencies are a workspace of their own,
//! `benches/yardsticks`, which adds their figures to the same groups.

#![forbid(unsafe_code)]

pub mod elastic_axis;
pub mod groups;
pub mod lockstep;
pub mod many;
pub mod reference_loop;
pub mod rk4_axis;
pub mod workload;
