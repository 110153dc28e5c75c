//! Golden vectors of the axis: `firmware/vectors/*.txt`, read, replayed, and
//! recorded. The format is in `firmware/vectors/README.md`.
//!
//! `settings.rs`, `row.rs` and `replay.rs` use `core` and `firmware` only, so
//! that a test on a chip can compile the same files.

pub(crate) mod faults;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod row;
pub(crate) mod scenarios;
pub(crate) mod settings;
