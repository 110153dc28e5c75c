//! Time of one controller step on the host, measured in a second pass over
//! the recorded inputs (the first 100,000 of them) so that the clock never
//! touches the run itself.

use std::hint::black_box;
use std::time::{Duration, Instant};

use hil_core::case::{Case, Law};
use hil_core::case_run::{CaseRun, HostTiming};
use hil_core::controllers::Controller;
use hil_core::error::RunError;
use hil_core::message::Measurement;
use hil_core::run::{self, RowSink, RunOptions};

use crate::channel::LinkKind;

/// Runs a case and, on sampled rungs, times the controller in a second pass
/// over the measurements that it got.
///
/// # Errors
/// [`RunError`]; the rows up to there have been delivered.
pub fn timed_run(
    case: &Case,
    link: LinkKind,
    options: RunOptions,
    sink: &mut RowSink<'_>,
) -> Result<CaseRun, RunError> {
    let options = RunOptions {
        inputs: true,
        ..options
    };
    if case.controller.law == Law::Continuous {
        return CaseRun::new(case, options, sink);
    }
    let controller = run::controller(case, options.io)?;
    let outcome = link.run_with(case, options, controller.clone(), sink)?;
    let timing = measure(controller, &outcome.inputs);
    Ok(CaseRun::of(case, outcome).timed(timing))
}

/// Feeds `inputs` to `controller` once more; `None` without inputs.
pub fn measure(mut controller: Controller, inputs: &[Measurement]) -> Option<HostTiming> {
    let mut steps: Vec<Duration> = Vec::with_capacity(inputs.len());
    for &measurement in inputs {
        let start = Instant::now();
        black_box(controller.step(black_box(measurement)));
        steps.push(start.elapsed());
    }
    let mut empty: Vec<Duration> = inputs
        .iter()
        .map(|measurement| {
            let start = Instant::now();
            black_box(measurement);
            start.elapsed()
        })
        .collect();
    steps.sort_unstable();
    empty.sort_unstable();
    Some(HostTiming {
        steps: steps.len(),
        median_us: percentile_us(&steps, 50)?,
        p99_us: percentile_us(&steps, 99)?,
        max_us: percentile_us(&steps, 100)?,
        clock_us: percentile_us(&empty, 50)?,
    })
}
/// Nearest-rank percentile of sorted durations \[µs\].
fn percentile_us(sorted: &[Duration], percent: usize) -> Option<f64> {
    let rank = (sorted.len() * percent).div_ceil(100).max(1);
    sorted.get(rank - 1).map(|d| d.as_secs_f64() * 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_nearest_rank() {
        let sorted: Vec<Duration> = (1..=200).map(Duration::from_micros).collect();
        let at = |percent| percentile_us(&sorted, percent).unwrap().round();
        assert_eq!((at(50), at(99), at(100)), (100.0, 198.0, 200.0));
        assert_eq!(percentile_us(&[], 50), None);
    }
}
