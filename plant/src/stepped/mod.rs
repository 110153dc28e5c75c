//! Solvers `dopri5` and `rk4`.

pub(crate) mod adaptive;
pub(crate) mod dop853;
pub(crate) mod event_search;
pub(crate) mod joint_loss;
pub(crate) mod piece;
pub(crate) mod quantity;
pub(crate) mod reach;
pub(crate) mod rk4;
pub(crate) mod step_size;
pub(crate) mod table;
