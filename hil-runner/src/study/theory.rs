//! Predictions that stand beside the figures of a run, each in columns of its
//! own: what [`hil_core::theory`] says about the run's loop.

use serde::Deserialize;

use super::cell::Cell;
use hil_core::case::Case;
use hil_core::theory;

/// A prediction (`theory`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Theory {
    /// The margin of the continuous loop with half a sample and the delay as
    /// dead time: what hold and delay cost, to first order.
    HoldAndDelay,
    /// Limit cycles by describing functions of gap, encoder and converter.
    DescribingFunction,
    /// What white quantisation noise makes of position, acceleration and voltage.
    QuantisationNoise,
}

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
        match self {
            Self::HoldAndDelay => {
                let margin = theory::margin_by_delay(case);
                vec![Cell::number(margin.map(|margin| margin.signed()))]
            }
            Self::DescribingFunction => {
                let gap = theory::gap_cycle(case);
                let amplitude = |cycle: Option<theory::Cycle>| {
                    Cell::number(cycle.map(|cycle| cycle.amplitude_um))
                };
                vec![
                    amplitude(gap),
                    Cell::number(gap.map(|cycle| cycle.period_s)),
                    amplitude(theory::encoder_cycle(case)),
                    amplitude(theory::dac_cycle(case)),
                ]
            }
            Self::QuantisationNoise => {
                let noise = theory::quantisation_noise(case).map(|noise| noise.together);
                vec![
                    Cell::number(noise.map(|noise| noise.position_um)),
                    Cell::number(noise.map(|noise| noise.acceleration_mps2)),
                    Cell::number(noise.map(|noise| noise.voltage_v)),
                ]
            }
        }
    }
}
