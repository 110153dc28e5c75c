//! Motion command with seven intervals (paper, Fig. 6), generated sample by
//! sample in integers.

mod error;
mod generator;
mod piece;
mod plan;
mod real;

pub use self::error::MotionError;
pub use self::generator::{MotionGenerator, MotionState};
pub use self::plan::MotionPlan;
