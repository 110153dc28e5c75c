//! The ladder: the rungs of one case and what each adds to the one below.

use serde::Serialize;

use crate::case_run::keys_without_effect;
use crate::ladder::{GRID_NS, Rung};
use crate::number::{column, column_option};
use crate::record::GridPoint;
use crate::time::seconds;

/// A figure, and the number of its digits that hold; `None` for all that tables
/// show.
pub type Held = (Option<f64>, Option<usize>);

/// All rungs of one case, their differences on common rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderReport {
    /// Name of the case.
    pub case: String,
    /// Remarks that hold for several rungs, one sentence each.
    pub warnings: Vec<String>,
    /// Times of the common rows \[s\], ascending.
    #[serde(serialize_with = "column")]
    pub t_s: Vec<f64>,
    /// The rungs from the bottom up.
    pub rungs: Vec<LadderRung>,
}

impl LadderReport {
    pub(super) fn of(case: &str, rungs: &[Rung]) -> Self {
        let rows = rungs.first().map_or(0, |rung| rung.outcome.grid.len());
        let ticks = 0..u64::try_from(rows).unwrap_or(0);
        let below = std::iter::once(None).chain(rungs.iter().map(Some));
        Self {
            case: case.to_owned(),
            warnings: Vec::from_iter(keys_without_effect(rungs.iter().map(|rung| &rung.case))),
            t_s: ticks.map(|tick| seconds(tick * GRID_NS)).collect(),
            rungs: rungs
                .iter()
                .zip(below)
                .map(|(rung, below)| LadderRung::of(rung, below))
                .collect(),
        }
    }
}

/// One rung. "Below" is the rung before it in [`LadderReport::rungs`];
/// differences are this rung less the one below and `None` on the lowest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderRung {
    /// Name of the rung.
    pub name: String,
    /// The effect it adds, such as `sampling, computation delay`.
    pub adds: String,
    /// sup of |ẍ| \[m/s²\].
    pub peak_abs_acc_mps2: Held,
    /// sup of |x_ref − x| \[mm\].
    pub peak_following_error_mm: Held,
    /// x_ref − x at the end \[µm\], signed.
    pub final_error_um: Held,
    /// Changes of `contact`.
    pub contact_changes: Held,
    /// Root mean square of the difference of ẍ over the rows \[m/s²\].
    pub rms_acc_diff_mps2: Held,
    /// Root mean square of the difference of x over the rows \[µm\].
    pub rms_pos_diff_um: Held,
    /// Remarks that the reader must see, one sentence each.
    pub warnings: Vec<String>,
    /// Times of its own acceleration \[s\], never descending: the same time
    /// stands twice where it jumps, so that needles have their full height.
    #[serde(serialize_with = "column")]
    pub t_s: Vec<f64>,
    /// Carriage acceleration ẍ at these times \[m/s²\].
    #[serde(serialize_with = "column")]
    pub acc_mps2: Vec<f64>,
    /// Difference of ẍ to the rung below on the rows \[m/s²\].
    #[serde(serialize_with = "column_option")]
    pub acc_diff_mps2: Option<Vec<f64>>,
    /// Difference of x to the rung below on the rows \[µm\].
    #[serde(serialize_with = "column_option")]
    pub pos_diff_um: Option<Vec<f64>>,
}

impl LadderRung {
    fn of(rung: &Rung, below: Option<&Rung>) -> Self {
        let (summary, plot) = (&rung.outcome.summary, &rung.outcome.plot);
        let held = |key: &str| (summary.figure(key), summary.digits(key));
        let [acc_digits, position_digits] = rung.difference_digits;
        let difference = |of: fn(&GridPoint, &GridPoint) -> f64| {
            let lower = &below?.outcome.grid;
            let rows = rung.outcome.grid.iter().zip(lower);
            Some(rows.map(|(u, l)| of(u, l)).collect())
        };
        Self {
            name: rung.name(),
            adds: rung.adds().to_owned(),
            peak_abs_acc_mps2: held("peak_abs_acc_mps2"),
            peak_following_error_mm: held("peak_following_error_mm"),
            final_error_um: held("final_error_um"),
            contact_changes: held("contact_changes"),
            rms_acc_diff_mps2: (rung.difference.map(|d| d.rms_acc_mps2), acc_digits),
            rms_pos_diff_um: (rung.difference.map(|d| d.rms_position_um), position_digits),
            warnings: rung.warnings(),
            t_s: plot.iter().map(|point| point.t_s).collect(),
            acc_mps2: plot.iter().map(|point| point.acc_mps2).collect(),
            acc_diff_mps2: difference(|u, l| u.acc_mps2 - l.acc_mps2),
            pos_diff_um: difference(|u, l| 1e6 * (u.x_m - l.x_m)),
        }
    }
}
