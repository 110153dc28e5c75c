//! `hil-runner home`: measure the gap of a case's joint with the firmware's
//! own routine.

use clap::Args;
use hil_core::controllers::measure_gap;
use hil_core::error::RunError;

use super::explain;
use super::run::load;
use super::terminal;

/// Measure the joint's gap as the firmware does: creep until the load follows
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  hil-runner home paper-2 --set load_encoder.counts_per_mm=1000 \\\n    \
                  --set carriage.resistance_constant_n=250 --set carriage.resistance_opposes_motion=true\n  \
                  hil-runner home axis.toml --set backlash.backlash_measurement_detection=effort")]
pub(crate) struct Home {
    /// Run file or built-in case
    case: String,
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
}

impl Home {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        for file in &load(std::slice::from_ref(&self.case), &self.sets)? {
            let gap = measure_gap(&file.case)
                .map_err(|error| explain(file, RunError::Quantise(error)))?;
            let [first, second, third] = gap.full_counts;
            terminal::print(&format!(
                "{}: half gap {} motor counts; the joint's own is {:.2}\n\
                 whole gap at three crossings: {first}, {second}, {third} motor counts; \
                 {:.2} s of simulated time\n",
                file.case.name, gap.half_counts, gap.true_half_counts, gap.duration_s,
            ))?;
        }
        Ok(true)
    }
}
