//! `hil-runner measure-backlash`: the gap of a case's joint, measured with the
//! firmware's own routine.

use clap::Args;
use hil_core::controllers::measure_gap;
use hil_core::error::RunError;
use hil_core::number;

use super::cases::{Sets, explain};
use super::terminal;

/// Measure the joint's gap as the firmware does: creep until the load follows
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  hil-runner measure-backlash paper-2 --set load_encoder.counts_per_mm=1000 \\\n    \
                  --set carriage.resistance_constant_n=250 --set carriage.resistance_opposes_motion=true\n  \
                  hil-runner measure-backlash axis.toml --set backlash.backlash_measurement_detection=effort")]
pub(crate) struct MeasureBacklash {
    /// Run file or built-in case
    case: String,
    #[command(flatten)]
    sets: Sets,
}

impl MeasureBacklash {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let file = self.sets.load_one(&self.case)?;
        let gap =
            measure_gap(&file.case).map_err(|error| explain(&file, RunError::Quantise(error)))?;
        let [first, second, third] = gap.full_counts;
        terminal::print(&format!(
            "{}: half gap {} motor counts; the joint's own is {}\n\
             whole gap at three crossings: {first}, {second}, {third} motor counts; \
             {} s of simulated time\n",
            file.case.name,
            gap.half_counts,
            number::table(gap.true_half_counts),
            number::table(gap.duration_s),
        ))?;
        Ok(true)
    }
}
