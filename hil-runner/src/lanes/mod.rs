//! The figures of many runs, without rows: what studies are made of.
//!
//! Runs that share axis (but for b), command, timing and law are computed side
//! by side in the lanes of the widest vector instructions, on as many threads
//! as are wanted; every other case by itself. Neither changes a bit of a
//! figure: each lane sees the operations of the single run in their order, and
//! nothing is added across lanes.
//!
//! ```text
//! family     which runs can go side by side
//! commands   the motion at the samples, computed once for all of them
//! settings   gains, encoder, converter and amplifier, lane by lane
//! laws       the sampled laws on all lanes
//! seen       what the rows leave behind, lane by lane
//! lockstep   laws and axes from sample to sample
//! worker     what one thread keeps from run to run
//! ```

mod commands;
mod family;
mod laws;
mod lockstep;
mod seen;
mod settings;
mod worker;

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::Level;

use crate::case::Case;
use crate::error::RunError;
use crate::summary::Summary;
use family::Family;

pub use worker::{Runs, SingleRuns};

/// Cases of a stream that are held in memory at a time.
const STREAM_CHUNK: usize = 4_096;

/// Cases side by side at most.
const LANES: usize = 8;

/// The figures of every case, in their order: bit for bit those of
/// [`crate::run::run`] with `run.events = false`, whatever the number of
/// threads.
///
/// ```
/// use std::num::NonZeroUsize;
/// use hil_runner::{lanes, runfile};
///
/// let case = runfile::load("paper-2", &["controller.law=quantised".to_owned()])?;
/// let cases: Vec<_> = (1..=5)
///     .map(|gain| {
///         let mut case = case.clone();
///         case.controller.gains.kp = f64::from(gain);
///         case
///     })
///     .collect();
/// let figures = lanes::figures(&cases, NonZeroUsize::MIN);
/// let errors: Vec<_> = figures.iter().flatten().map(|f| f.peak_following_error_mm).collect();
/// assert!(errors.is_sorted_by(|a, b| a > b));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn figures(cases: &[Case], threads: NonZeroUsize) -> Vec<Result<Summary, RunError>> {
    figures_on(&mut workers(Level::new(), threads), cases)
}

/// As [`figures`] for as many cases as there may be: a few thousand of them are
/// in memory at a time. `each` gets every case with its figures, in order, and
/// may end the stream, with a value that is returned.
pub fn stream<B>(
    cases: impl IntoIterator<Item = Case>,
    threads: NonZeroUsize,
    mut each: impl FnMut(Case, Result<Summary, RunError>) -> ControlFlow<B>,
) -> ControlFlow<B> {
    let mut cases = cases.into_iter();
    let mut workers = workers(Level::new(), threads);
    loop {
        let chunk: Vec<Case> = cases.by_ref().take(STREAM_CHUNK).collect();
        if chunk.is_empty() {
            return ControlFlow::Continue(());
        }
        let results = figures_on(&mut workers, &chunk);
        for (case, result) in chunk.into_iter().zip(results) {
            each(case, result)?;
        }
    }
}

/// What every thread keeps, with given instructions.
fn workers(level: Level, threads: NonZeroUsize) -> Vec<Runs> {
    (0..threads.get()).map(|_| Runs::with(level)).collect()
}

/// The figures, on one thread for each of the workers.
fn figures_on(workers: &mut [Runs], cases: &[Case]) -> Vec<Result<Summary, RunError>> {
    let groups = groups(cases);
    let parcels = parcels(&groups, workers.len());
    let next = AtomicUsize::new(0);
    let work = |runs: &mut Runs| {
        let mut done = Vec::new();
        while let Some(parcel) = parcels.get(next.fetch_add(1, Ordering::Relaxed)) {
            runs.of_places(parcel.family, cases, parcel.places, |place, figures| {
                done.push((place, figures));
            });
        }
        done
    };
    let needed = workers.len().min(parcels.len());
    let done: Vec<Done> = std::thread::scope(|scope| {
        let work = &work;
        let (own, others) = match workers[..needed].split_first_mut() {
            Some(split) => split,
            None => return Vec::new(),
        };
        let others: Vec<_> = others
            .iter_mut()
            .map(|runs| scope.spawn(move || work(runs)))
            .collect();
        let own = work(own);
        // A thread that ended abnormally leaves its cases without figures.
        let others = others.into_iter().filter_map(|thread| thread.join().ok());
        std::iter::once(own).chain(others).collect()
    });
    let mut results: Vec<_> = cases.iter().map(|_| Err(RunError::Thread)).collect();
    for (place, result) in done.into_iter().flatten() {
        results[place] = result;
    }
    results
}

/// Places and figures.
type Done = Vec<(usize, Result<Summary, RunError>)>;

/// Cases of one family, or cases without one: a piece of work for one thread.
struct Parcel<'a> {
    family: Option<Family>,
    places: &'a [usize],
}

/// Places of the cases of one family, in order.
struct Group {
    family: Option<Family>,
    places: Vec<usize>,
}

/// The families in the order in which they appear.
fn groups(cases: &[Case]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known = HashMap::new();
    for (place, case) in cases.iter().enumerate() {
        let family = Family::of(case);
        let key = family.as_ref().map(Family::key);
        let number = *known.entry(key).or_insert(groups.len());
        match groups.get_mut(number) {
            Some(group) => group.places.push(place),
            None => groups.push(Group {
                family,
                places: vec![place],
            }),
        }
    }
    groups
}

/// The groups cut into work for the threads: as much as is computed at a time,
/// unless that left a thread without any.
fn parcels(groups: &[Group], threads: usize) -> Vec<Parcel<'_>> {
    let cut = |group: &Group| match group.family {
        None => 1,
        Some(_) => {
            let share = group.places.len().div_ceil(threads);
            share.next_multiple_of(LANES).min(Runs::AT_A_TIME)
        }
    };
    let parcel = |family| move |places| Parcel { family, places };
    groups
        .iter()
        .flat_map(|group| group.places.chunks(cut(group)).map(parcel(group.family)))
        .collect()
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::runfile;

    /// The same bits with every kind of instructions that this machine has.
    #[test]
    fn instructions_change_no_bit() {
        let case = runfile::load("paper-2", &["controller.law=quantised".into()]).unwrap();
        let cases: Vec<Case> = (1..=8)
            .map(|n| {
                let mut case = case.clone();
                case.controller.gains.kp = 0.7 * f64::from(n);
                case
            })
            .collect();
        let widest = Level::new();
        let levels = [
            widest.as_sse2().map(Level::Sse2),
            widest.as_sse4_2().map(Level::Sse4_2),
            widest.as_avx2().map(Level::Avx2),
        ];
        let figures = |level| -> Vec<Summary> {
            let results = figures_on(&mut workers(level, NonZeroUsize::MIN), &cases);
            results.into_iter().map(Result::unwrap).collect()
        };
        for level in levels.into_iter().flatten() {
            assert_eq!(figures(level), figures(widest), "{level:?}");
        }
    }
}
