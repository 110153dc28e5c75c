//! `hil-runner scaling`: the fixed-point gains of a case with their lengths,
//! headroom and rounding, and what would fit.

use std::collections::BTreeMap;

use anyhow::anyhow;
use clap::Args;
use firmware::Axis;
use hil_core::case::Case;
use hil_core::controllers::{
    Setup, accepted, compensated, scaling_request, smallest_sample_time_ns,
};
use hil_core::error::RunError;
use hil_core::number;
use hil_core::quantise::{FixedPointGain, QuantiseError, from_plant};
use hil_core::runfile::{RunFile, SECTIONS, Way};
use hil_core::scaling::{ScaledLaw, ScalingRequest};
use serde_json::{Value, json};

use super::options::{Cases, Sets, explain, of_cases, once_each};
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
    /// Print JSON in place of the tables, of several cases a list
    #[arg(long, conflicts_with_all = ["rust", "c"])]
    json: bool,
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
        let scaled = files.iter().map(Scaled::of);
        let scaled = scaled.collect::<anyhow::Result<Vec<_>>>()?;
        if self.json {
            terminal::print_json(&of_cases(scaled.iter().map(Scaled::json))?)?;
            return Ok(true);
        }
        let text = |scaled: &Scaled| (scaled.case.name.clone(), scaled.text());
        for (names, text) in once_each(scaled.iter().map(text)) {
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

/// The keys of one way with their numbers.
type InOneWay = Vec<(&'static str, f64)>;

/// What a run file can give in several ways, in each that the case has: section, and the
/// keys of each way with their numbers.
fn in_all_ways(case: &Case) -> Vec<(&'static str, Vec<InOneWay>)> {
    let mut all = Vec::new();
    for section in SECTIONS {
        for ways in section.ways {
            let value = |name: &&'static str| {
                let number = section.key(name)?.get(case)?.number()?;
                Some((*name, number))
            };
            let is_required =
                |name: &str| section.key(name).is_some_and(|key| key.need.is_required());
            // What a way lacks, another kind of drive has, or it is no number.
            let lacks = |name: &&'static str| is_required(name) && value(name).is_none();
            let is_whole = |way: &&Way| !way.iter().any(lacks);
            let of_way = |way: &Way| way.iter().filter_map(value).collect::<Vec<_>>();
            let mut given: Vec<InOneWay> = ways.iter().filter(is_whole).map(of_way).collect();
            given.retain(|way| !way.is_empty());
            if given.len() > 1 {
                all.push((section.name, given));
            }
        }
    }
    all
}

/// The fixed-point gains of a case, all accepted.
struct Scaled {
    case: Case,
    request: ScalingRequest,
    scaled: ScaledLaw,
    /// Smallest sample time that the gains fit \[ns\].
    smallest_ns: u64,
}

impl Scaled {
    fn of(file: &RunFile) -> anyhow::Result<Self> {
        let refused = |error| explain(file, RunError::Quantise(error));
        let request = scaling_request(&file.case).map_err(refused)?;
        let scaled = request.scaled_law().map_err(refused)?;
        // A run asks for more than its gains, and stops without it.
        accepted(&file.case, request.sample_time_ns).map_err(refused)?;
        let smallest_ns = smallest_sample_time_ns(&file.case)
            .ok_or_else(|| anyhow!("the gains that were accepted are accepted no more"))?;
        Ok(Self {
            case: file.case.clone(),
            request,
            scaled,
            smallest_ns,
        })
    }

    fn text(&self) -> String {
        let law = &self.scaled.law;
        let accepted = law.words();
        let ranges = format!(
            "sum: 64 bits, 32 of them fraction, {} bits of headroom above the largest sum\n\
             error |e| ≤ 2^{} = {} counts; {}integral ≤ 2^{} codes\n\
             difference |Δe| ≤ {} counts{}\n\
             sample time: {} µs; the smallest that fits: {} µs\n",
            law.headroom_bits(),
            accepted.error_bits,
            law.error_limit(),
            match self.error_sum_limit() {
                None => String::new(),
                Some(limit) => format!("sum of errors |Σe| ≤ {limit} counts; "),
            },
            accepted.integral_bits,
            law.difference_limit(),
            if law.difference_outweighs() {
                "; beyond it the converter is at its end whatever the rest is"
            } else {
                ""
            },
            number::table(self.request.sample_time_ns as f64 / 1e3),
            number::table(self.smallest_ns as f64 / 1e3),
        );
        let from_plant = from_plant(&self.scaled.rows);
        let mut text =
            self.gain_table() + &from_plant + &ranges + "the same as a run file can give it:\n";
        for (section, ways) in in_all_ways(&self.case) {
            let one = |(name, value): &(&str, f64)| format!("{name} = {}", number::table(*value));
            let way = |way: &InOneWay| way.iter().map(one).collect::<Vec<_>>().join(", ");
            let ways: Vec<String> = ways.iter().map(way).collect();
            text += &format!("  [{section}] {}\n", ways.join("\n    or "));
        }
        text
    }

    /// The largest |Σe| \[counts\]; `None` where the sum has no limit.
    fn error_sum_limit(&self) -> Option<u64> {
        let limit = self.scaled.law.error_sum_limit();
        (limit != u64::MAX).then_some(limit)
    }

    fn json(&self) -> Value {
        let law = &self.scaled.law;
        let gain = |gain: &Gain<'_>| {
            json!({
                "key": gain.row.key(),
                "value": gain.row.value,
                "from_plant": gain.row.from_plant,
                "per_sample": gain.row.wanted,
                "unit": gain.row.unit(),
                "mantissa": gain.row.word.mantissa,
                "fraction_bits": gain.row.word.fraction_bits,
                "relative_error": gain.row.relative_error(),
                "largest_term_codes": gain.largest_term_codes(),
                "headroom_bits": gain.headroom_bits(),
                "largest_that_fits": gain.largest_that_fits,
            })
        };
        json!({
            "name": self.case.name,
            "sample_time_ns": self.request.sample_time_ns,
            "smallest_sample_time_ns": self.smallest_ns,
            "sum_headroom_bits": law.headroom_bits(),
            "error_limit_counts": law.error_limit(),
            "error_sum_limit_counts": self.error_sum_limit(),
            "integral_bits": law.words().integral_bits,
            "difference_limit_counts": law.difference_limit(),
            "gains": self.gains().map(|own| gain(&own)).collect::<Vec<_>>(),
            "in_all_ways": in_all_ways(&self.case)
                .into_iter()
                .map(|(section, ways)| json!({"section": section, "ways": ways.into_iter()
                    .map(|way| way.into_iter().collect::<BTreeMap<_, _>>())
                    .collect::<Vec<_>>()}))
                .collect::<Vec<_>>(),
        })
    }

    /// The gains; feed-forward is left out where it is off.
    fn gains(&self) -> impl Iterator<Item = Gain<'_>> {
        let rows = self.scaled.rows.iter().enumerate();
        let rows = rows.filter(|(_, row)| row.value != 0.0 || row.is_of_the_paper());
        rows.map(|(index, row)| Gain {
            row,
            largest_term: self.scaled.law.largest_term(row.part),
            largest_that_fits: self.request.largest_gain(index),
        })
    }

    /// The gains in fixed point with their lengths, and the largest that fit.
    fn gain_table(&self) -> String {
        let header = "key|per sample\ncodes/count|fixed point|bits|rounding|term up to\ncodes\
        |headroom\nbits|largest\nthat fits";
        let rows = self.gains().map(|gain| {
            let row = gain.row;
            [
                row.key().trim_start_matches("controller.").to_owned(),
                match row.unit() {
                    "codes/count" => number::table(row.wanted),
                    unit => format!("{} {unit}", number::table(row.wanted)),
                },
                row.word.to_string(),
                (u32::BITS - row.word.mantissa.leading_zeros()).to_string(),
                number::relative_error(row.relative_error()),
                number::table(gain.largest_term_codes()),
                gain.headroom_bits().to_string(),
                number::table(gain.largest_that_fits),
            ]
        });
        terminal::table(header.split('|'), 1, rows)
    }
}

/// A gain in fixed point, and what its term takes of the sum.
struct Gain<'r> {
    row: &'r FixedPointGain,
    /// Largest magnitude of its term \[2^−32 codes\].
    largest_term: u64,
    /// Largest value of its key that fits.
    largest_that_fits: f64,
}

impl Gain<'_> {
    fn largest_term_codes(&self) -> f64 {
        self.largest_term as f64 / 4_294_967_296.0
    }

    /// Of the 62 bits that the terms may take.
    fn headroom_bits(&self) -> u32 {
        self.largest_term.leading_zeros().saturating_sub(2)
    }
}
