//! A case that has to be run by itself.

use crate::case::Case;
use crate::error::RunError;
use crate::run::{RunOptions, run_among};
use crate::summary::Summary;
use crate::theory::Loops;

/// The figures of a single run, whatever the case is.
pub(super) fn alone(case: &Case, loops: &mut Loops) -> Result<Summary, RunError> {
    let mut case = case.clone();
    case.run.events = false;
    let outcome = run_among(&case, RunOptions::default(), loops, &mut |_| Ok(()));
    outcome.map(|outcome| outcome.summary)
}
