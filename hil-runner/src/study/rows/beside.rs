//! Columns beside the summary of a run: predictions of theory, feeding of its limit
//! cycle, distance from the rung before it.

use super::cell::Cell;
use crate::study::plan::Theory;
use hil_core::case::Case;
use hil_core::error::RunError;
use hil_core::ladder;
use hil_core::lanes::Runs;
use hil_core::record::GridPoint;
use hil_core::rest::feeding::{baseline, counterfactuals, fed_by};
use hil_core::summary::Summary;
use hil_core::theory;

impl Theory {
    /// Names of its columns.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::HoldAndDelay => &["theory_modulus_margin_contact"],
            Self::DescribingFunction => &[
                "theory_gap_cycle_um",
                "theory_gap_cycle_period_s",
                "theory_encoder_cycle_um",
                "theory_dac_cycle_um",
            ],
            Self::QuantisationNoise => &[
                "theory_noise_position_um",
                "theory_noise_acc_mps2",
                "theory_noise_voltage_v",
            ],
        }
    }

    /// The values of its columns for a run; empty where the theory has nothing
    /// to say.
    pub(super) fn cells(self, case: &Case) -> Vec<Cell> {
        let numbers = match self {
            Self::HoldAndDelay => {
                vec![theory::margin_by_delay(case).map(|margin| margin.signed())]
            }
            Self::DescribingFunction => {
                let gap = theory::gap_cycle(case);
                let amplitude = |cycle: Option<theory::Cycle>| Some(cycle?.amplitude_um);
                vec![
                    amplitude(gap),
                    gap.map(|cycle| cycle.period_s),
                    amplitude(theory::encoder_cycle(case)),
                    amplitude(theory::dac_cycle(case)),
                ]
            }
            Self::QuantisationNoise => {
                let noise = theory::quantisation_noise(case).map(|noise| noise.together);
                let is_current = case.amplifier.is_current_drive();
                vec![
                    noise.map(|noise| noise.position_um),
                    noise.map(|noise| noise.acceleration_mps2),
                    noise.filter(|_| !is_current).map(|noise| noise.command),
                ]
            }
        };
        numbers.into_iter().map(Cell::number).collect()
    }
}

/// Nonlinearities that feed the limit cycle of each run; empty without one. The
/// runs that have one are made again on rung `quantised`, as they are and without
/// one nonlinearity each, all of them side by side.
pub(super) fn feeding(cases: &[Case], summaries: &[Result<Summary, RunError>]) -> Vec<Cell> {
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
    let ripple = |summary: &Result<Summary, RunError>| summary.as_ref().ok()?.rest_ripple_um;
    let ripples: Vec<Option<f64>> = figures.iter().map(ripple).collect();
    let mut cells = vec![Cell::Empty; cases.len()];
    for (place, first, others) in asked {
        let Some(Some(amplitude_um)) = ripples.get(first) else {
            continue;
        };
        let without = others.iter().zip(ripples.iter().skip(first + 1));
        let without: Vec<_> = without
            .map(|(other, ripple)| (other.without, *ripple))
            .collect();
        cells[place] = Cell::text(fed_by(*amplitude_um, &without));
    }
    cells
}

/// Names of the columns of [`differences`].
pub(super) const DIFFERENCES: [&str; 2] = ["rms_acc_change_mps2", "rms_position_change_um"];

/// Distance of every run from that of the rung before it at the same point, as
/// `hil-runner ladder` has it. `places` has, for each row in order, the number of
/// its rung and the place of its case.
pub(super) fn differences<'a>(
    cases: &[Case],
    places: impl Iterator<Item = (usize, Option<&'a usize>)>,
) -> Vec<[Cell; 2]> {
    let mut cells = vec![[Cell::Empty, Cell::Empty]; cases.len()];
    let mut below: Option<Vec<GridPoint>> = None;
    for (rung, place) in places {
        // A run that fails says so in its own row.
        let here = place.and_then(|place| ladder::grid(&cases[*place]).ok());
        if let (Some(place), Some(here), Some(below), 1..) = (place, &here, &below, rung) {
            let difference = ladder::difference(here, below);
            cells[*place] = [difference.rms_acc_mps2, difference.rms_position_um].map(Cell::number);
        }
        below = here;
    }
    cells
}
