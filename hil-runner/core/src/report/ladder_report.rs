//! The ladder: the rungs of one case and what each adds to the one below.

use serde::Serialize;

use crate::number::{rounded, rounded_option};

/// A figure, and how many digits of it hold; `None` for all that tables show.
pub type Held = (Option<f64>, Option<usize>);

/// All rungs of one case, their differences on common rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderReport {
    /// Name of the case.
    pub case: String,
    /// What holds for several rungs, one sentence each.
    pub warnings: Vec<String>,
    /// Times of the common rows \[s\], ascending.
    #[serde(serialize_with = "rounded")]
    pub t_s: Vec<f64>,
    /// The rungs from the bottom up.
    pub rungs: Vec<LadderRung>,
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
    #[serde(serialize_with = "rounded")]
    pub t_s: Vec<f64>,
    /// Carriage acceleration ẍ at these times \[m/s²\].
    #[serde(serialize_with = "rounded")]
    pub acc_mps2: Vec<f64>,
    /// Difference of ẍ to the rung below on the rows \[m/s²\].
    #[serde(serialize_with = "rounded_option")]
    pub acc_diff_mps2: Option<Vec<f64>>,
    /// Difference of x to the rung below on the rows \[µm\].
    #[serde(serialize_with = "rounded_option")]
    pub pos_diff_um: Option<Vec<f64>>,
}
