//! A case that has to be run by itself.

use crate::case::Case;
use crate::error::RunError;
use crate::run::{RunOptions, run};
use crate::summary::Summary;

/// The figures of a single run, whatever the case is.
pub(super) fn alone(case: &Case) -> Result<Summary, RunError> {
    let mut case = case.clone();
    case.run.events = false;
    run(&case, RunOptions::default(), &mut |_| Ok(())).map(|outcome| outcome.summary)
}
