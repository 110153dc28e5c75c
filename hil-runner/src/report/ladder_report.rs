//! The ladder: the rungs of one case and what each adds to the one below.

use serde::Serialize;

use super::number::{rounded, rounded_option};

/// All rungs of one case on common rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderReport {
    /// Name of the case.
    pub case: String,
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
    pub peak_abs_acc_mps2: Option<f64>,
    /// sup of |x_ref − x| \[mm\].
    pub peak_following_error_mm: Option<f64>,
    /// x_ref − x at the end \[µm\], signed.
    pub final_error_um: Option<f64>,
    /// Changes of `contact`.
    pub contact_changes: Option<u64>,
    /// Root mean square of the difference of ẍ over the rows \[m/s²\].
    pub rms_acc_diff_mps2: Option<f64>,
    /// Root mean square of the difference of x over the rows \[µm\].
    pub rms_pos_diff_um: Option<f64>,
    /// Carriage acceleration ẍ on the rows \[m/s²\].
    #[serde(serialize_with = "rounded")]
    pub acc_mps2: Vec<f64>,
    /// Difference of ẍ to the rung below on the rows \[m/s²\].
    #[serde(serialize_with = "rounded_option")]
    pub acc_diff_mps2: Option<Vec<f64>>,
    /// Difference of x to the rung below on the rows \[µm\].
    #[serde(serialize_with = "rounded_option")]
    pub pos_diff_um: Option<Vec<f64>>,
}
