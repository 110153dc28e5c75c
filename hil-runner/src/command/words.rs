//! `hil-runner words`: word lengths, headroom and rounding of a case's law,
//! and what would fit.

use anyhow::anyhow;
use clap::Args;
use hil_core::controllers::{accepted, scaling_request, smallest_sample_time_ns};
use hil_core::error::RunError;
use hil_core::number;
use hil_core::runfile::RunFile;
use hil_core::scaling::{ScaledLaw, ScalingRequest};

use super::explain;
use super::run::load;
use super::terminal;

/// Show the words of a case's law: lengths, headroom, rounding, and what fits
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  hil-runner words paper-1 paper-2 paper-3 paper-4\n  \
                  hil-runner words axis.toml --set controller.word_bits=24\n  \
                  hil-runner words paper-2 --set controller.sample_time_s=0.0001")]
pub(crate) struct Words {
    /// Run files or built-in cases (paper-1 … paper-4, paper-2-12bit)
    #[arg(required = true)]
    cases: Vec<String>,
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
}

impl Words {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let mut shown: Vec<(Vec<String>, String)> = Vec::new();
        for file in &load(&self.cases, &self.sets)? {
            let text = describe(file)?;
            let name = file.case.name.clone();
            match shown.iter_mut().find(|(_, known)| *known == text) {
                Some((names, _)) => names.push(name),
                None => shown.push((vec![name], text)),
            }
        }
        for (names, text) in shown {
            terminal::print(&format!("{}\n{text}", names.join(", ")))?;
        }
        Ok(true)
    }
}

fn describe(file: &RunFile) -> anyhow::Result<String> {
    let refused = |error| explain(file, RunError::Quantise(error));
    let request = scaling_request(&file.case).map_err(refused)?;
    let words = request.scaled_law().map_err(refused)?;
    // What the words alone do not show stops a run all the same.
    accepted(&file.case, request.sample_time_ns).map_err(refused)?;
    let table = terminal::word_length_table(&request, &words);
    let ranges = ranges(file, &request, &words)?;
    Ok(format!("{table}{ranges}"))
}

fn ranges(file: &RunFile, request: &ScalingRequest, words: &ScaledLaw) -> anyhow::Result<String> {
    let law = &words.law;
    let accepted = law.words();
    let f = accepted.sum_fraction_bits;
    let smallest_ns = smallest_sample_time_ns(&file.case)
        .ok_or_else(|| anyhow!("the words that were accepted are accepted no more"))?;
    let alone = if file.case.options.is_off() {
        "nothing is asked beyond the paper's law: a run takes that one, with an integral of 128 bits,\n\
         for which these words fit too, and somewhat larger gains\n"
    } else {
        ""
    };
    Ok(format!(
        "sum: 64 bits, {f} of them fraction, {} bits of headroom above the largest sum\n\
         error |e| ≤ 2^{} = {} counts; sum of errors |Σe| ≤ {} counts; integral ≤ 2^{} codes\n\
         difference |Δe| ≤ {} counts; beyond it the converter is at its end whatever the rest is\n\
         sample time: {} µs; the smallest that fits: {} µs\n{alone}",
        law.headroom_bits(),
        accepted.error_bits,
        law.error_limit(),
        law.error_sum_limit(),
        accepted.integral_bits,
        law.slope_limit(),
        number::table(request.sample_time_ns as f64 / 1e3),
        number::table(smallest_ns as f64 / 1e3),
    ))
}
