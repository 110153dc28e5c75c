//! Runs on this machine: over a function call or a pair of channels, with a
//! clock at the controller's step, and many of them on several threads.
//!
//! Controller and plant in two threads, with a channel in each direction, have
//! the shape that real time needs. The bits are those of a function call, since
//! the plant waits for the answer. The clock never touches the run itself: steps
//! are timed in a second pass over the recorded inputs, the first 100,000 of
//! them.

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender};
use hil_core::case::{Case, Law};
use hil_core::controllers::Controller;
use hil_core::error::RunError;
use hil_core::lanes::{Runs, parcels};
use hil_core::message::{Command, Link, LinkError, Measurement};
use hil_core::number::seconds;
use hil_core::quantise::FixedPointGains;
use hil_core::run::{self, CaseRun, HostTiming, Outcome, RowSink, RunOptions};
use hil_core::summary::Summary;

/// Connection of controller and plant on one machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LinkKind {
    /// A function call: the fast path of everything.
    #[default]
    InProcess,
    /// Two threads and a pair of channels.
    Channel,
}

impl LinkKind {
    /// Runs a case over this connection; see [`run::run`].
    ///
    /// # Errors
    /// As [`run::run`].
    pub fn run(
        self,
        case: &Case,
        options: RunOptions,
        sink: &mut RowSink<'_>,
    ) -> Result<Outcome, RunError> {
        if case.controller.law == Law::Continuous {
            return run::run(case, options, sink);
        }
        self.run_with(case, options, run::controller(case, options.io)?, sink)
    }

    /// The same with a controller that is ready for its first sample.
    ///
    /// # Errors
    /// As [`run::run_over`].
    fn run_with(
        self,
        case: &Case,
        options: RunOptions,
        mut controller: Controller,
        sink: &mut RowSink<'_>,
    ) -> Result<Outcome, RunError> {
        if self == Self::InProcess {
            return run::run_over(case, options, &mut controller, sink);
        }
        // One message fits in each direction: there is never more in flight.
        let (measurements, asked) = crossbeam_channel::bounded(1);
        let (answers, commands) = crossbeam_channel::bounded(1);
        let mut plant_end = ChannelLink {
            measurements,
            commands,
            gains: controller.gains(),
        };
        std::thread::scope(|scope| {
            let served = scope.spawn(move || {
                for measurement in &asked {
                    if answers.send(controller.step(measurement)).is_err() {
                        return;
                    }
                }
            });
            let outcome = run::run_over(case, options, &mut plant_end, sink);
            // Hanging up ends the controller's thread.
            drop(plant_end);
            // A controller that ended abnormally has stopped answering, which the
            // plant's end has told.
            drop(served.join());
            outcome
        })
    }
}

/// The plant's end of a pair of channels.
#[derive(Debug)]
struct ChannelLink {
    measurements: Sender<Measurement>,
    commands: Receiver<Command>,
    gains: Option<FixedPointGains>,
}

impl Link for ChannelLink {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        let closed = || LinkError::Closed { tick };
        self.measurements.send(measurement).map_err(|_| closed())?;
        let command = self.commands.recv().map_err(|_| closed())?;
        if command.tick != tick {
            return Err(LinkError::WrongTick {
                asked: tick,
                answered: command.tick,
            });
        }
        Ok(command)
    }

    fn gains(&self) -> Option<FixedPointGains> {
        self.gains.clone()
    }
}

/// Runs a case and, on sampled rungs, times the controller in a second pass
/// over what it was fed.
///
/// # Errors
/// [`RunError`]; the rows up to there have been delivered.
pub fn timed_run(
    case: &Case,
    link: LinkKind,
    mut options: RunOptions,
    sink: &mut RowSink<'_>,
) -> Result<CaseRun, RunError> {
    options.inputs = true;
    let (Law::Sampled | Law::Quantised | Law::Firmware, Some(period_ns)) =
        (case.controller.law, case.controller.sample_time_ns)
    else {
        return CaseRun::new(case, options, sink);
    };
    let controller = run::controller(case, options.io)?;
    let outcome = link.run_with(case, options, controller.clone(), sink)?;
    let timing = measure(controller, &outcome.inputs, 1e6 * seconds(period_ns));
    Ok(CaseRun::of(case, outcome).timed(timing))
}

/// Feeds `inputs` to `controller` once more; `None` without inputs.
fn measure(
    mut controller: Controller,
    inputs: &[Measurement],
    sample_time_us: f64,
) -> Option<HostTiming> {
    let steps = times(inputs, |measurement| {
        black_box(controller.step(black_box(*measurement)));
    });
    let empty = times(inputs, |measurement| {
        black_box(measurement);
    });
    Some(HostTiming {
        steps: steps.len(),
        median_us: percentile_us(&steps, 50)?,
        p99_us: percentile_us(&steps, 99)?,
        max_us: percentile_us(&steps, 100)?,
        clock_us: percentile_us(&empty, 50)?,
        sample_time_us,
    })
}

/// The time of each step over its input, sorted.
fn times(inputs: &[Measurement], mut step: impl FnMut(&Measurement)) -> Vec<Duration> {
    let timed = inputs.iter().map(|measurement| {
        let start = Instant::now();
        step(measurement);
        start.elapsed()
    });
    let mut times: Vec<Duration> = timed.collect();
    times.sort_unstable();
    times
}

/// Nearest-rank percentile of sorted durations \[µs\].
fn percentile_us(sorted: &[Duration], percent: usize) -> Option<f64> {
    let rank = (sorted.len() * percent).div_ceil(100).max(1);
    sorted.get(rank - 1).map(|d| d.as_secs_f64() * 1e6)
}

/// The figures of every case, in their order: bit for bit those of
/// [`hil_core::run::run`] with `run.events = false`, whatever the number of
/// threads.
///
/// ```
/// use std::num::NonZeroUsize;
/// use hil_core::runfile;
/// use hil_runner::host;
///
/// let case = runfile::builtin("paper-2", &["controller.law=quantised".to_owned()])?;
/// let cases: Vec<_> = (1..=5)
///     .map(|gain| {
///         let mut case = case.clone();
///         case.controller.gains.kp = f64::from(gain);
///         case
///     })
///     .collect();
/// let figures = host::figures(&cases, NonZeroUsize::MIN)?;
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
    Ok(Team::new(threads)?.figures(cases))
}

/// Threads that keep their tables from call to call.
#[derive(Debug)]
pub struct Team {
    pool: Option<rayon::ThreadPool>,
    runs: Vec<Mutex<Runs>>,
}

impl Team {
    /// So many threads; a single one is the caller's.
    ///
    /// # Errors
    /// The threads cannot be started.
    pub fn new(threads: NonZeroUsize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = threads.get();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = (threads > 1).then(|| pool.build()).transpose()?;
        let runs = (0..threads).map(|_| Mutex::new(Runs::new())).collect();
        Ok(Self { pool, runs })
    }

    /// As [`figures`].
    pub fn figures(&self, cases: &[Case]) -> Vec<Result<Summary, RunError>> {
        let parcels = parcels(cases, self.runs.len());
        let next = AtomicUsize::new(0);
        let work = |thread: usize| {
            let mut done = Vec::new();
            let Some(runs) = self.runs.get(thread) else {
                return done;
            };
            let mut runs = runs.lock().unwrap_or_else(PoisonError::into_inner);
            while let Some(parcel) = parcels.get(next.fetch_add(1, Ordering::Relaxed)) {
                runs.of_parcel(cases, parcel, |place, figures| done.push((place, figures)));
            }
            done
        };
        let done = match &self.pool {
            None => vec![work(0)],
            Some(pool) => pool.broadcast(|thread| work(thread.index())),
        };
        let mut done: Vec<_> = done.into_iter().flatten().collect();
        done.sort_unstable_by_key(|(place, _)| *place);
        done.into_iter().map(|(_, figures)| figures).collect()
    }
}

#[cfg(test)]
mod tests {
    use hil_core::message::Steps;

    use super::*;

    /// The plant's end, and the controller's.
    const MEASUREMENT: Measurement = Measurement {
        tick: 7,
        position_counts: Steps::Whole(0),
        load_counts: None,
    };

    fn ends() -> (ChannelLink, Receiver<Measurement>, Sender<Command>) {
        let (measurements, asked) = crossbeam_channel::bounded(1);
        let (answers, commands) = crossbeam_channel::bounded(1);
        let gains = None;
        let link = ChannelLink {
            measurements,
            commands,
            gains,
        };
        (link, asked, answers)
    }

    #[test]
    fn a_controller_that_is_gone_is_an_error() {
        let (mut link, asked, answers) = ends();
        drop((asked, answers));
        let closed = LinkError::Closed { tick: 7 };
        assert_eq!(link.exchange(MEASUREMENT), Err(closed));
    }

    #[test]
    fn an_answer_to_another_sample_is_an_error() {
        let (mut link, _asked, answers) = ends();
        let answer = Command::whole(6, 0, 0);
        answers.send(answer).unwrap();
        let wrong = LinkError::WrongTick {
            asked: 7,
            answered: 6,
        };
        assert_eq!(link.exchange(MEASUREMENT), Err(wrong));
    }

    #[test]
    fn takes_the_nearest_rank() {
        let sorted: Vec<Duration> = (1..=200).map(Duration::from_micros).collect();
        let at = |percent| percentile_us(&sorted, percent).unwrap().round();
        assert_eq!((at(50), at(99), at(100)), (100.0, 198.0, 200.0));
        assert_eq!(percentile_us(&[], 50), None);
    }
}
