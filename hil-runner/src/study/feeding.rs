//! What feeds the limit cycles of a block of runs.

use std::borrow::Cow;

use super::cell::Cell;
use hil_core::case::Case;
use hil_core::error::RunError;
use hil_core::lanes::Runs;
use hil_core::rest::feeding::{baseline, counterfactuals, fed_by};
use hil_core::summary::Summary;

/// Finds it for every run that has a limit cycle: the run again on rung
/// `quantised`, as it is and without one nonlinearity each, all of them side by
/// side. `each` gets places and cells.
pub(super) fn find(
    cases: &[Case],
    summaries: &[Result<Summary, RunError>],
    mut each: impl FnMut(usize, Cell),
) {
    let mut again: Vec<Case> = Vec::new();
    let mut asked = Vec::new();
    for (place, (case, summary)) in cases.iter().zip(summaries).enumerate() {
        let cycles = |summary: &Summary| summary.limit_cycle_period_s.is_some();
        if summary.as_ref().is_ok_and(cycles) {
            let others = counterfactuals(case);
            let first = again.len();
            again.push(baseline(case));
            again.extend(others.iter().map(|other| other.case.clone()));
            asked.push((place, first, others));
        }
    }
    let mut figures = Vec::with_capacity(again.len());
    Runs::new().figures(&again, &mut figures);
    let ripples: Vec<Option<f64>> = figures
        .into_iter()
        .map(|summary| summary.ok()?.rest_ripple_um)
        .collect();
    for (place, first, others) in asked {
        let Some(Some(amplitude_um)) = ripples.get(first) else {
            continue;
        };
        let without: Vec<_> = others
            .iter()
            .zip(ripples.iter().skip(first + 1))
            .map(|(other, ripple)| (other.without, *ripple))
            .collect();
        let words = fed_by(*amplitude_um, &without).to_string();
        each(place, Cell::Text(Cow::Owned(words)));
    }
}
