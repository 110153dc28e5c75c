//! `hil-runner budget`: what the controller costs on each target, held against
//! what it has cost before.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use hil_core::number;
use hil_runner::chip::budget::goldens::{
    self, Amount, Difference, Goldens, Instructions, Judgement,
};
use hil_runner::chip::budget::{TargetFigures, measure};
use hil_runner::chip::image::Finder;
use hil_runner::chip::installed;
use hil_runner::chip::spec::{Target, Transport};
use hil_runner::files::OutputFile;
use serde_json::{Value, json};

use super::terminal::{self, table, tell, tell_line};

/// Measure what the controller costs on chips, and hold it against the goldens
///
/// Counts the instructions of every sample in QEMU: of axes that are constants
/// of an image, feature by feature, and of an axis that comes in words, state by
/// state; asks the images for their flash, RAM and deepest stack. Figures beyond
/// the tolerance of firmware/cortex-m/goldens/<TARGET>.toml fail, better ones too.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/budget.txt").trim_ascii_end())]
pub(crate) struct Budget {
    /// Targets: m4, m0, m3, rv32; without any, all that can be run in QEMU here
    #[arg(value_name = "TARGET", value_parser = target)]
    targets: Vec<Target>,
    /// Write the figures down as the new goldens, and say what has changed
    #[arg(long)]
    bless: bool,
    /// The folder of the goldens, in place of the project's
    #[arg(long, value_name = "FOLDER")]
    goldens: Option<PathBuf>,
    /// Print a list of the targets as JSON in place of the tables
    #[arg(long, conflicts_with = "bless")]
    json: bool,
}

/// The project's folder of goldens.
const GOLDENS: &str = "firmware/cortex-m/goldens";

fn target(name: &str) -> Result<Target, String> {
    Target::find(name).ok_or_else(|| format!("{name} is no target; it must be m4, m0, m3 or rv32"))
}

impl Budget {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let own = || Finder::from_environment().builder.project.join(GOLDENS);
        let folder = self.goldens.clone().unwrap_or_else(own);
        if !folder.is_dir() {
            let place = folder.display();
            bail!("{place} is no folder; --goldens takes the folder of the goldens");
        }
        let (here, mut pass) = (self.here()?, true);
        let goldens_of = |target: Target| folder.join(format!("{}.toml", target.name()));
        let mut paths = here.iter().map(|target| goldens_of(*target));
        if let Some(path) = paths.find(|path| !self.bless && !path.is_file()) {
            bail!("{} is not there; --bless writes it", path.display());
        }
        let mut values = Vec::new();
        for target in here {
            let path = goldens_of(target);
            let measured = measure(target, &mut tell_line).with_context(|| target.name())?;
            let known = Goldens::read(&path)?;
            if self.bless {
                bless(&measured, &known, &path)?;
                continue;
            }
            let judgements = known.judge(&measured.figures);
            if self.json {
                values.push(json_of(&measured, &judgements));
            } else {
                terminal::print(&tables(&measured, &judgements))?;
            }
            if !judgements.iter().all(Judgement::pass) {
                pass = false;
                let goldens = self.goldens.as_ref();
                let goldens = goldens.map(|folder| format!(" --goldens {}", folder.display()));
                let (goldens, name) = (goldens.unwrap_or_default(), target.name());
                tell!(
                    "{name}: not as in {}; `hil-runner budget {name}{goldens} --bless` writes down what is meant \
                to stay\n",
                    path.display(),
                );
            }
        }
        if self.json {
            terminal::print_json(&values)?;
        }
        Ok(pass)
    }

    /// The targets to measure. One that was named must be there; of the others
    /// it is told what they lack.
    fn here(&self) -> anyhow::Result<Vec<Target>> {
        let mut here = Vec::new();
        for (target, there) in installed(Transport::Fifo) {
            let named = self.targets.contains(&target);
            match there {
                _ if !named && !self.targets.is_empty() => {}
                Ok(()) => here.push(target),
                Err(error) if named => bail!("{}: {error}", target.name()),
                Err(error) => tell!("{} is left out: {error}\n", target.name()),
            }
        }
        if here.is_empty() {
            bail!("no target can be run here");
        }
        Ok(here)
    }
}

/// Writes the goldens, and what is no longer as it was.
fn bless(measured: &TargetFigures, known: &Goldens, path: &Path) -> anyhow::Result<()> {
    let name = measured.target.name();
    let text = goldens::text(measured.target, &measured.figures);
    OutputFile::create(path)?.write_whole(&text)?;
    let judgements = known.judge(&measured.figures);
    let mut changes = changes(name, &judgements);
    if changes.is_empty() {
        changes = format!("{name}: nothing has changed\n");
    }
    Ok(terminal::print(&changes)?)
}

/// A target with its figures as JSON.
fn json_of(measured: &TargetFigures, judgements: &[Judgement]) -> Value {
    json!({
        "target": measured.target.name(),
        "triple": measured.target.triple(),
        "clock_hz": measured.meter.clock_hz(),
        "figures": judgements.iter().map(figure_of).collect::<Vec<_>>(),
    })
}

fn figure_of(judgement: &Judgement) -> Value {
    json!({
        "figure": judgement.figure,
        "measured": judgement.measured,
        "golden": judgement.golden,
        "pass": judgement.pass(),
    })
}

/// Sample time that shares are given of \[ns\]: that of the built-in cases.
const SAMPLE_TIME_NS: f64 = 1e6;

/// Instructions and bytes of a target, with what is made of them.
fn tables(measured: &TargetFigures, judgements: &[Judgement]) -> String {
    let name = measured.target.name();
    let clock_mhz = number::table(measured.meter.clock_hz() as f64 / 1e6);
    let (mut instructions, mut bytes) = (Vec::new(), Vec::new());
    for judgement in judgements {
        let golden = judgement.golden.map(largest);
        let ends = [
            golden.map_or_else(missing, |golden| golden.to_string()),
            judgement.difference().map_or_else(missing, off_by),
            verdict(judgement).to_owned(),
        ];
        let (table, cells) = match (judgement.measured, judgement.golden) {
            (Some(Amount::Instructions(count)), _) => (&mut instructions, costs(measured, count)),
            (Some(Amount::Bytes(count)), _) => (&mut bytes, vec![count.to_string()]),
            (None, Some(Amount::Bytes(_))) => (&mut bytes, vec![missing()]),
            (None, _) => (&mut instructions, vec![missing(); 7]),
        };
        table.push([vec![judgement.figure.clone()], cells, ends.to_vec()].concat());
    }
    let header =
        "instructions of a sample|max|99 %|median|first|cycles|µs|% of\n1 ms|golden|off by|";
    format!(
        "{name} ({}), times at {clock_mhz} MHz\n{}{}",
        measured.target.triple(),
        table(header.split('|'), 1, instructions),
        table(["memory", "bytes", "golden", "off by", ""], 1, bytes)
    )
}

/// Instructions, and cycles, time and share of the longest sample.
fn costs(measured: &TargetFigures, count: Instructions) -> Vec<String> {
    // The first sample has the same time as any other.
    let most = count.first.unwrap_or(0).max(count.max);
    let (cycles, time_ns) = measured.meter.of_instructions(most);
    let time_ns = time_ns as f64;
    vec![
        count.max.to_string(),
        count.p99.map_or_else(missing, |p99| p99.to_string()),
        count.median.to_string(),
        count.first.map_or_else(missing, |first| first.to_string()),
        cycles.to_string(),
        number::rounded(time_ns / 1e3, 3),
        number::rounded(100.0 * time_ns / SAMPLE_TIME_NS, 3),
    ]
}

/// The changes since the goldens, a line a figure.
fn changes(name: &str, judgements: &[Judgement]) -> String {
    let mut lines = String::new();
    for judgement in judgements {
        let figure = &judgement.figure;
        let line = match (judgement.golden, judgement.difference()) {
            (_, Some(difference)) if difference.signed() == 0 => continue,
            (_, Some(of)) => format!("{} {} → {}", of.part, of.golden, of.measured),
            (None, None) => "new".to_owned(),
            (Some(_), None) => "gone, or another kind of figure".to_owned(),
        };
        lines += &format!("{name}: {figure}: {line}\n");
    }
    lines
}

/// The golden that stands in the table: of instructions the most.
fn largest(golden: Amount) -> u32 {
    match golden {
        Amount::Instructions(golden) => golden.max,
        Amount::Bytes(golden) => golden,
    }
}

/// The difference of the part that is farthest off, which is named unless it is
/// the one in the table.
fn off_by(difference: Difference) -> String {
    let signed = difference.signed();
    let part = match difference.part {
        "max" | "bytes" => "",
        part => part,
    };
    if signed == 0 {
        return "0".to_owned();
    }
    format!("{signed:+} {part}").trim_end().to_owned()
}

fn verdict(judgement: &Judgement) -> &'static str {
    match (judgement.golden, judgement.measured) {
        _ if judgement.pass() => "pass",
        (None, _) => "NEW",
        (_, None) => "GONE",
        _ => "FAIL",
    }
}

fn missing() -> String {
    number::MISSING.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes are a number, instructions have their parts; what is new has no golden and
    /// does not pass.
    #[test]
    fn figures_are_numbers_and_parts() {
        let bytes = Amount::Bytes(512);
        let instructions = Amount::Instructions(Instructions {
            max: 60,
            p99: None,
            median: 45,
            first: Some(70),
        });
        let judged = |measured, golden| {
            figure_of(&Judgement {
                figure: "tick".to_owned(),
                measured,
                golden,
            })
        };
        let expected = json!({"figure": "tick", "measured": 512, "golden": 512, "pass": true});
        assert_eq!(judged(Some(bytes), Some(bytes)), expected);
        let new = judged(Some(instructions), None);
        let parts = json!({"max": 60, "p99": null, "median": 45, "first": 70});
        assert_eq!((&new["measured"], &new["golden"]), (&parts, &Value::Null));
        assert_eq!(new["pass"], false);
    }
}
