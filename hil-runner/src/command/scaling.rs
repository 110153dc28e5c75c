//! `hil-runner scaling`: the fixed-point gains of a case with their lengths,
//! headroom and rounding, and what would fit.

use anyhow::anyhow;
use clap::Args;
use firmware::Axis;
use hil_core::controllers::{
    Setup, accepted, compensated, scaling_request, smallest_sample_time_ns,
};
use hil_core::error::RunError;
use hil_core::number;
use hil_core::quantise::QuantiseError;
use hil_core::runfile::RunFile;
use hil_core::scaling::{ScaledLaw, ScalingRequest};

use super::options::{Cases, Sets, explain, once_each};
use super::terminal::{self, say};
use super::{c_axis, rust_axis};

/// Show a case's fixed-point gains: lengths, headroom, rounding, and what fits
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/scaling.txt").trim_ascii_end())]
pub(crate) struct Scaling {
    #[command(flatten)]
    cases: Cases,
    #[command(flatten)]
    sets: Sets,
    /// Print the axis of one case as a Rust constant for an image of one's own
    #[arg(long)]
    rust: bool,
    /// Print the same as an initialiser of `servo_settings`, for firmware in C
    #[arg(long)]
    c: bool,
}

/// Source of an axis, by the case's name, the request and the axis.
type Source = fn(&str, &ScalingRequest, &Axis) -> String;

impl Scaling {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let files = self.sets.load(&self.cases.cases)?;
        let source: Option<(_, Source)> = match (self.rust, self.c) {
            (false, false) => None,
            (true, false) => Some(("--rust", rust_axis::source)),
            (false, true) => Some(("--c", c_axis::source)),
            (true, true) => {
                anyhow::bail!("--rust and --c each print an axis of their own: give one of them")
            }
        };
        if let Some((option, source)) = source {
            let [file] = files.as_slice() else {
                let cases = files.len();
                anyhow::bail!("{option} prints the axis of one case, not of {cases}");
            };
            terminal::print(&constant(file, source)?)?;
            return Ok(true);
        }
        let described = |file: &RunFile| Ok((file.case.name.clone(), describe(file)?));
        let texts: anyhow::Result<Vec<_>> = files.iter().map(described).collect();
        for (names, text) in once_each(texts?) {
            say!("{names}\n{text}")?;
        }
        Ok(true)
    }
}

/// The axis of a case as source.
fn constant(file: &RunFile, source: Source) -> anyhow::Result<String> {
    let refused = |error| explain(file, RunError::Quantise(error));
    let case = &file.case;
    let period_ns = case.controller.sample_time_ns;
    let period_ns = period_ns.ok_or_else(|| refused(QuantiseError::NoSampleTime))?;
    let setup = Setup::of(case, period_ns).map_err(refused)?;
    let law = setup.law().map_err(refused)?.law;
    let axis = compensated(&setup, law).map_err(refused)?;
    // A run asks for more than its axis, and stops without it.
    accepted(case, period_ns).map_err(refused)?;
    let request = scaling_request(case).map_err(refused)?;
    Ok(source(&case.name, &request, &axis))
}

fn describe(file: &RunFile) -> anyhow::Result<String> {
    let refused = |error| explain(file, RunError::Quantise(error));
    let request = scaling_request(&file.case).map_err(refused)?;
    let scaled = request.scaled_law().map_err(refused)?;
    // A run asks for more than its gains, and stops without it.
    accepted(&file.case, request.sample_time_ns).map_err(refused)?;
    let table = gain_table(&request, &scaled);
    let ranges = ranges(file, &request, &scaled)?;
    Ok(format!("{table}{ranges}"))
}

fn ranges(file: &RunFile, request: &ScalingRequest, scaled: &ScaledLaw) -> anyhow::Result<String> {
    let law = &scaled.law;
    let accepted = law.words();
    let smallest_ns = smallest_sample_time_ns(&file.case)
        .ok_or_else(|| anyhow!("the gains that were accepted are accepted no more"))?;
    Ok(format!(
        "sum: 64 bits, 32 of them fraction, {} bits of headroom above the largest sum\n\
         error |e| ≤ 2^{} = {} counts; {}integral ≤ 2^{} codes\n\
         difference |Δe| ≤ {} counts{}\n\
         sample time: {} µs; the smallest that fits: {} µs\n",
        law.headroom_bits(),
        accepted.error_bits,
        law.error_limit(),
        match law.error_sum_limit() {
            u64::MAX => String::new(),
            limit => format!("sum of errors |Σe| ≤ {limit} counts; "),
        },
        accepted.integral_bits,
        law.difference_limit(),
        if law.difference_outweighs() {
            "; beyond it the converter is at its end whatever the rest is"
        } else {
            ""
        },
        number::table(request.sample_time_ns as f64 / 1e3),
        number::table(smallest_ns as f64 / 1e3),
    ))
}

/// The gains of a law in fixed point with their lengths, and the largest that fit.
/// Feed-forward is left out where it is off.
fn gain_table(request: &ScalingRequest, scaled: &ScaledLaw) -> String {
    let header = "key|per sample\ncodes/count|fixed point|bits|rounding|term up to\ncodes\
    |headroom\nbits|largest\nthat fits";
    let rows = scaled.rows.iter().enumerate();
    let rows = rows.filter(|(_, row)| row.value != 0.0 || row.is_of_the_paper());
    let rows = rows.map(|(index, row)| {
        let largest = scaled.law.largest_term(row.part);
        [
            row.key().trim_start_matches("controller.").to_owned(),
            match row.unit() {
                "codes/count" => number::table(row.wanted),
                unit => format!("{} {unit}", number::table(row.wanted)),
            },
            row.word.to_string(),
            (u32::BITS - row.word.mantissa.leading_zeros()).to_string(),
            number::relative_error(row.relative_error()),
            number::table(largest as f64 / 4_294_967_296.0),
            // Of the 62 bits that the terms may take.
            largest.leading_zeros().saturating_sub(2).to_string(),
            number::table(request.largest_gain(index)),
        ]
    });
    terminal::table(header.split('|'), 1, rows)
}
