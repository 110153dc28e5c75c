//! Figures of many runs on several threads, each with lanes of its own.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

use hil_core::case::Case;
use hil_core::error::RunError;
use hil_core::lanes::{Runs, parcels};
use hil_core::summary::Summary;

/// The figures of every case, in their order: bit for bit those of
/// [`hil_core::run::run`] with `run.events = false`, whatever the number of
/// threads.
///
/// ```
/// use std::num::NonZeroUsize;
/// use hil_core::runfile;
/// use hil_runner::lanes;
///
/// let case = runfile::builtin("paper-2", &["controller.law=quantised".to_owned()])?;
/// let cases: Vec<_> = (1..=5)
///     .map(|gain| {
///         let mut case = case.clone();
///         case.controller.gains.kp = f64::from(gain);
///         case
///     })
///     .collect();
/// let figures = lanes::figures(&cases, NonZeroUsize::MIN)?;
/// let errors: Vec<_> = figures.iter().flatten().map(|f| f.peak_following_error_mm).collect();
/// assert!(errors.is_sorted_by(|a, b| a > b));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The threads cannot be started.
pub fn figures(
    cases: &[Case],
    threads: NonZeroUsize,
) -> Result<Vec<Result<Summary, RunError>>, rayon::ThreadPoolBuildError> {
    let threads = threads.get();
    if threads == 1 {
        let mut results = Vec::with_capacity(cases.len());
        Runs::new().figures(cases, &mut results);
        return Ok(results);
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    let parcels = parcels(cases, threads);
    let next = AtomicUsize::new(0);
    let done = pool.broadcast(|_| {
        let mut runs = Runs::new();
        let mut done = Vec::new();
        while let Some(parcel) = parcels.get(next.fetch_add(1, Ordering::Relaxed)) {
            runs.of_parcel(cases, parcel, |place, figures| done.push((place, figures)));
        }
        done
    });
    let mut done: Vec<_> = done.into_iter().flatten().collect();
    done.sort_unstable_by_key(|(place, _)| *place);
    Ok(done.into_iter().map(|(_, figures)| figures).collect())
}
