//! Predictions that stand beside the figures of a run, each in columns of its
//! own: what [`crate::theory`] says about the run's loop.

use serde::Deserialize;

use super::cell::Cell;
use crate::case::Case;
use crate::theory;

/// A prediction (`theory`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Theory {
    /// The margin of the continuous loop with half a sample and the delay as
    /// dead time: what hold and delay cost, to first order.
    HoldAndDelay,
}

impl Theory {
    /// Names of its columns.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::HoldAndDelay => &["theory_margin_closed"],
        }
    }

    /// The values of its columns for a run; empty where the theory has nothing
    /// to say.
    pub(super) fn cells(self, case: &Case) -> Vec<Cell> {
        match self {
            Self::HoldAndDelay => {
                let margin = theory::margin_by_delay(case);
                vec![Cell::number(margin.map(|margin| margin.signed()))]
            }
        }
    }
}
