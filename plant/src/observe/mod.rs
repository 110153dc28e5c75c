//! What watches a solution.

pub(crate) mod extremes;
pub(crate) mod span;
