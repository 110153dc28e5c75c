//! `hil-runner margins`: how far a case's loop is from instability, without a run.

use clap::Args;
use hil_core::case::Case;
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::number;
use hil_core::theory::{LoopFigures, LoopGains, Loops, left_out, no_figure};
use serde::Serialize;

use super::options::{Cases, Sets, of_cases, warn};
use super::terminal;

/// Show the margins of a case's linear loop, without a run
///
/// The loop is the exact sampled one: hold, delay, filter, encoders and kind of drive as they
/// are, once with the joint in contact and once in its gap. Where gains change during the
/// run, before and after.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  hil-runner margins paper-2
  hil-runner margins axis.toml --set controller.derivative_filter_s=0.002
  hil-runner margins paper-1 paper-2 --json")]
pub(crate) struct Margins {
    #[command(flatten)]
    cases: Cases,
    /// Print every figure as JSON, of several cases a list
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    sets: Sets,
}

/// A loop of a case with its figures.
#[derive(Serialize)]
struct OfLoop<'c> {
    name: String,
    #[serde(skip)]
    case: &'c Case,
    #[serde(flatten)]
    figures: LoopFigures,
}

impl Margins {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let files = self.sets.load(&self.cases.cases)?;
        let mut loops = Loops::default();
        let of = |(name, case, gains)| OfLoop {
            name,
            case,
            figures: loops.figures_of(case, &[gains]),
        };
        let each = files.iter().flat_map(|file| gains_of(&file.case));
        let each: Vec<OfLoop> = each.map(of).collect();
        if self.json {
            terminal::print_json(&of_cases(&each)?)?;
        } else {
            terminal::print(&table(&each))?;
        }
        for file in &files {
            warn(&file.case.name, left_out(&file.case));
        }
        Ok(true)
    }
}

/// The case by its name, with its gains; where they change, with those before and after.
fn gains_of(case: &Case) -> Vec<(String, &Case, LoopGains)> {
    let (name, start) = (&case.name, LoopGains::of(case));
    match LoopGains::after_change(case) {
        None => vec![(name.clone(), case, start)],
        Some(after) => vec![
            (format!("{name}, before"), case, start),
            (format!("{name}, after the change"), case, after),
        ],
    }
}

/// A line a figure, a column a loop; the reasons for what is missing below.
fn table(each: &[OfLoop<'_>]) -> String {
    let names = each.iter().map(|of| terminal::short(&of.name));
    let header = core::iter::once("figure".to_owned()).chain(names);
    let header = header.chain(["unit".to_owned()]);
    let of_loop = SUMMARY_FIGURES.iter().filter(|figure| figure.at_least);
    let rows = of_loop.clone().map(|figure| {
        let value = |of: &OfLoop| number::shown(of.figures.figure(figure.key), None);
        let values = each.iter().map(value);
        let row = core::iter::once(figure.label.to_owned()).chain(values);
        row.chain([figure.unit.to_owned()]).collect::<Vec<String>>()
    });
    let mut text = terminal::table(header, 1, rows);
    for of in each {
        let (name, figures) = (&of.name, &of.figures);
        for (margin, joint) in [
            (figures.modulus_margin_contact, "in contact"),
            (figures.modulus_margin_gap, "in the gap"),
        ] {
            if margin.is_some_and(|margin| margin < 0.0) {
                text += &format!("{name}: the loop is UNSTABLE {joint}\n");
            }
        }
        let reasons = of_loop
            .clone()
            .filter_map(|figure| no_figure(of.case, figure.key));
        let mut reasons: Vec<&str> = reasons.collect();
        reasons.dedup();
        for reason in reasons {
            text += &format!("{name}: {reason}\n");
        }
    }
    text
}
