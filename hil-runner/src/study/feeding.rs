//! What feeds the limit cycles of a block of runs.

use std::borrow::Cow;
use std::num::NonZeroUsize;

use super::cell::Cell;
use crate::case::Case;
use crate::error::RunError;
use crate::lanes;
use crate::rest::feeding::{baseline, counterfactuals, fed_by};
use crate::summary::Summary;

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
    let ripples: Vec<Option<f64>> = lanes::figures(&again, NonZeroUsize::MIN)
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
