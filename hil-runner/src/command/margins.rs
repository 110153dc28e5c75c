//! `hil-runner margins`: how far a case's loop is from instability, without a run.

use clap::Args;
use hil_core::case::Case;
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::number;
use hil_core::theory::{LoopFigures, LoopGains, Loops, left_out, no_figure};
use serde_json::{Value, json};

use super::options::{Cases, Sets, warn};
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

impl Margins {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let files = self.sets.load(&self.cases.cases)?;
        let mut loops = Loops::default();
        let each: Vec<(String, &Case, LoopFigures)> = files
            .iter()
            .flat_map(|file| gains_of(&file.case))
            .map(|(name, case, gains)| (name, case, loops.figures_of(case, &[gains])))
            .collect();
        if self.json {
            let of = |(name, _, figures): &(String, &Case, LoopFigures)| {
                let mut value = json!({ "name": name });
                if let (Value::Object(all), Ok(Value::Object(own))) =
                    (&mut value, serde_json::to_value(figures))
                {
                    all.extend(own);
                }
                value
            };
            let all: Vec<Value> = each.iter().map(of).collect();
            match all.as_slice() {
                [one] => terminal::print_json(one)?,
                all => terminal::print_json(&all)?,
            }
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
fn table(each: &[(String, &Case, LoopFigures)]) -> String {
    let names = each.iter().map(|(name, ..)| terminal::short(name));
    let header: Vec<String> = ["figure".to_owned()]
        .into_iter()
        .chain(names)
        .chain(["unit".to_owned()])
        .collect();
    let of_loop = SUMMARY_FIGURES.iter().filter(|figure| figure.at_least);
    let rows = of_loop.clone().map(|figure| {
        let values = each
            .iter()
            .map(|(.., of)| number::shown(of.figure(figure.key), None));
        let row = core::iter::once(figure.label.to_owned()).chain(values);
        row.chain([figure.unit.to_owned()]).collect::<Vec<String>>()
    });
    let mut text = terminal::table(header, 1, rows);
    for (name, case, of) in each {
        for (margin, joint) in [
            (of.modulus_margin_contact, "in contact"),
            (of.modulus_margin_gap, "in the gap"),
        ] {
            if margin.is_some_and(|margin| margin < 0.0) {
                text += &format!("{name}: the loop is UNSTABLE {joint}\n");
            }
        }
        let reasons = of_loop
            .clone()
            .filter_map(|figure| no_figure(case, figure.key));
        let mut reasons: Vec<&str> = reasons.collect();
        reasons.dedup();
        for reason in reasons {
            text += &format!("{name}: {reason}\n");
        }
    }
    text
}
