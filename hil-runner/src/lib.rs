//! The bench around [`hil_core`]: chips, studies on disk, reports as files, the
//! command line.
//!
//! ```text
//! command line ──► study, chip, report ──► hil_core ──► firmware, plant
//! ```

pub mod chip;
pub mod files;
pub mod host;
pub mod image;
pub mod live;
mod page;
pub mod report;
pub mod study;
