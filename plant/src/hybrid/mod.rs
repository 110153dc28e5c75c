//! The axis as a hybrid automaton.

pub(crate) mod automaton;
pub(crate) mod guard;
pub(crate) mod mode;
