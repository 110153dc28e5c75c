//! Solvers that step: `dopri5`, adaptive with every event located, and `rk4`, the
//! paper's own way.

pub(crate) mod adaptive;
mod dop853;
mod piece;
pub(crate) mod rk4;
