//! The tables of `hil-runner budget`.

use hil_core::number;
use hil_runner::chip::budget::goldens::{Difference, Judgement};
use hil_runner::chip::budget::{Amount, Instructions, TargetFigures};
use hil_runner::chip::spec::Target;

use super::terminal::{table, text};

/// Sample time that shares are given of \[ns\]: that of the built-in cases.
const SAMPLE_TIME_NS: f64 = 1e6;

/// Instructions and bytes of a target, with what is made of them.
pub(super) fn tables(measured: &TargetFigures, judgements: &[Judgement]) -> String {
    let name = measured.target.name();
    let clock_mhz = number::table(measured.meter.clock_hz() as f64 / 1e6);
    let mut instructions = table(
        &[
            "instructions of a sample",
            "max",
            "median",
            "first",
            "cycles",
            "µs",
            "% of\n1 ms",
            "golden",
            "off by",
            "",
        ],
        1,
    );
    let mut bytes = table(&["memory", "bytes", "golden", "off by", ""], 1);
    for judgement in judgements {
        let figure = &judgement.figure;
        let measured_amount = measured
            .figures
            .iter()
            .find(|measured| measured.name == *figure)
            .map(|measured| measured.amount);
        let golden = judgement.golden.map(largest);
        let ends = [
            golden.map_or_else(missing, |golden| golden.to_string()),
            judgement.difference.map_or_else(missing, off_by),
            verdict(judgement, measured_amount.is_some()).to_owned(),
        ];
        let row = |cells: Vec<String>| [vec![figure.clone()], cells, ends.to_vec()].concat();
        match (measured_amount, judgement.golden) {
            (Some(Amount::Instructions(count)), _) => {
                instructions.add_row(row(costs(measured, count)));
            }
            (Some(Amount::Bytes(count)), _) => {
                bytes.add_row(row(vec![count.to_string()]));
            }
            (None, Some(Amount::Bytes(_))) => {
                bytes.add_row(row(vec![missing()]));
            }
            (None, _) => {
                instructions.add_row(row(vec![missing(); 6]));
            }
        }
    }
    format!(
        "{name} ({}), times at {clock_mhz} MHz\n{}{}",
        measured.target.triple(),
        text(&instructions),
        text(&bytes)
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
        count.median.to_string(),
        count.first.map_or_else(missing, |first| first.to_string()),
        cycles.to_string(),
        format!("{:.2}", time_ns / 1e3),
        format!("{:.2}", 100.0 * time_ns / SAMPLE_TIME_NS),
    ]
}

/// What has changed since the goldens, a line a figure.
pub(super) fn changes(target: Target, judgements: &[Judgement]) -> String {
    let name = target.name();
    let mut lines = String::new();
    for judgement in judgements {
        let figure = &judgement.figure;
        let line = match (judgement.golden, judgement.difference) {
            (_, Some(difference)) if difference.signed() == 0 => continue,
            (_, Some(difference)) => format!(
                "{} {} → {}",
                difference.part, difference.golden, difference.measured
            ),
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

fn verdict(judgement: &Judgement, measured: bool) -> &'static str {
    match (judgement.pass, judgement.golden, measured) {
        (true, ..) => "pass",
        (_, None, _) => "NEW",
        (_, _, false) => "GONE",
        _ => "FAIL",
    }
}

fn missing() -> String {
    number::MISSING.to_owned()
}
