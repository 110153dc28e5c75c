//! Tables for the terminal, at most 100 columns wide.

use std::io::Write;

use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use hil_core::case_run::CaseRun;
use hil_core::ladder::Rung;
use hil_core::number;
use hil_core::reservation::kept_but;
use hil_core::scaling::{ScaledLaw, ScalingRequest};
use hil_core::{figures, time};

use super::certify::Certificate;

const WIDTH: u16 = 100;

/// Lines around the table and under its header only.
const STYLE: TableStyle = {
    let line = LineStyle::none().fill('─').junction('─');
    TableStyle::new()
        .top_border(line)
        .header_separator(line)
        .bottom_border(line)
};

/// Writes to standard output; a reader that hangs up is no error.
pub(crate) fn print(text: &str) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Writes a message to standard error; nobody there to read it is no error.
pub(crate) fn tell(text: &str) {
    let mut stderr = std::io::stderr().lock();
    // There is nowhere left to complain.
    let _ = stderr.write_all(text.as_bytes());
}

/// A name that leaves room for the other columns.
fn short(name: &str) -> String {
    const LONGEST: usize = 20;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST - 1).chain(['…']).collect()
}

/// The first `names` columns left, the others right.
pub(super) fn table(header: &[&str], names: usize) -> Table {
    let mut table = Table::new();
    table
        .load_style(STYLE)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH)
        .set_header(header);
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 1));
        if i >= names {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// The table without the padding at the ends of its lines.
pub(super) fn text(table: &Table) -> String {
    table.trim_fmt() + "\n"
}

fn shown(value: Option<f64>) -> String {
    held(value, None)
}

/// A value with the digits that hold; `None` stands for all.
fn held(value: Option<f64>, digits: Option<usize>) -> String {
    value.map_or_else(
        || number::MISSING.to_owned(),
        |value| number::held(value, digits),
    )
}

/// Every verdict of every run.
pub(crate) fn verdict_table(runs: &[CaseRun]) -> String {
    if runs.iter().all(|run| run.verdicts().next().is_none()) {
        return "no limits in the budget, no verdicts\n".to_owned();
    }
    let header = [
        "case", "figure", "value", "limit", "margin", "unit", "verdict",
    ];
    let mut table = table(&header, 2);
    for run in runs {
        for verdict in run.verdicts() {
            let limit = number::table(verdict.limit);
            let digits = run.outcome.summary.digits(&verdict.figure);
            table.add_row([
                short(&run.outcome.summary.name),
                verdict.figure.clone(),
                held(verdict.value, digits),
                if verdict.default {
                    format!("{limit} (default)")
                } else {
                    limit
                },
                held(verdict.margin, verdict.margin_digits(digits)),
                figures::unit(&verdict.figure).to_owned(),
                if verdict.pass { "pass" } else { "FAIL" }.to_owned(),
            ]);
        }
    }
    text(&table) + &standing(runs)
}

/// What the verdicts come to, in a line.
fn standing(runs: &[CaseRun]) -> String {
    let of = |pass: bool| {
        let verdicts = runs.iter().flat_map(CaseRun::verdicts);
        verdicts.filter(|verdict| verdict.pass == pass).count()
    };
    let (kept, broken) = (of(true), of(false));
    if broken > 0 {
        return format!("FAIL: {broken} of {} limits broken\n", kept + broken);
    }
    let reservations: Vec<_> = runs.iter().map(CaseRun::named_reservations).collect();
    let words = kept_but(&reservations).unwrap_or_else(|| "PASS: all limits kept".to_owned());
    format!("{words}\n")
}

/// The figures that a reader looks for first, a line a run.
pub(crate) fn figure_table(runs: &[CaseRun]) -> String {
    let header = [
        "case",
        "law",
        "solver",
        "peak acc\nm/s²",
        "following\nerror mm",
        "final\nerror µm",
        "settled\nafter s",
        "contact\nchanges",
        "peak\nvolts",
        "peak\ncode",
    ];
    let mut table = table(&header, 3);
    for run in runs {
        let summary = &run.outcome.summary;
        let figure = |key: &str| summary.shown(key);
        table.add_row([
            short(&summary.name),
            summary.law.to_owned(),
            summary.solver.to_owned(),
            figure("peak_abs_acc_mps2"),
            figure("peak_following_error_mm"),
            figure("final_error_um"),
            figure("settling_time_s"),
            figure("contact_changes"),
            figure("peak_abs_voltage_v"),
            figure("max_abs_dac_code"),
        ]);
    }
    text(&table)
}

/// What the firmware's words make of the gains, once for cases that agree.
pub(crate) fn word_tables(runs: &[CaseRun]) -> String {
    let mut tables: Vec<(String, String)> = Vec::new();
    for run in runs {
        let Some(gains) = &run.outcome.gains else {
            continue;
        };
        let header = [
            "gain per sample",
            "codes/count",
            "firmware word",
            "rounding",
        ];
        let mut table = table(&header, 1);
        for gain in &gains.rows {
            table.add_row([
                gain.name().to_owned(),
                number::table(gain.wanted),
                gain.word.to_string(),
                format!("{:+.1e}", gain.relative_error()),
            ]);
        }
        let table = text(&table);
        let name = &run.outcome.summary.name;
        match tables.iter_mut().find(|(_, known)| *known == table) {
            Some((names, _)) => *names += &format!(", {name}"),
            None => tables.push((format!("words of {name}"), table)),
        }
    }
    let titled = tables
        .iter()
        .map(|(names, table)| format!("{names}\n{table}"));
    titled.collect()
}

/// The words of a law with their lengths, and the largest gains that fit.
/// Feed-forward is left out where it is off.
pub(crate) fn word_length_table(request: &ScalingRequest, words: &ScaledLaw) -> String {
    let header = [
        "key",
        "per sample",
        "word",
        "bits",
        "rounding",
        "term up to\ncodes",
        "headroom\nbits",
        "largest\nthat fits",
    ];
    let mut table = table(&header, 1);
    let f = f64::from(words.law.words().sum_fraction_bits);
    for (index, row) in words.rows.iter().enumerate() {
        if row.value == 0.0 && !row.is_of_the_paper() {
            continue;
        }
        let largest = words.law.largest_term(row.part);
        table.add_row([
            row.key().trim_start_matches("controller.").to_owned(),
            number::table(row.wanted),
            row.word.to_string(),
            (u32::BITS - row.word.mantissa.leading_zeros()).to_string(),
            format!("{:+.1e}", row.relative_error()),
            number::table(largest as f64 * (-f).exp2()),
            // Of the 62 bits that a sum may take.
            largest.leading_zeros().saturating_sub(2).to_string(),
            number::table(request.largest_gain(index)),
        ]);
    }
    text(&table)
}

/// What the host and every chip have computed, a line each.
pub(super) fn certificate_table(certificates: &[Certificate]) -> String {
    let header = [
        "target",
        "image",
        "trace hash",
        "cases",
        "steps",
        "",
        "vector\nfiles",
        "rows",
        "",
    ];
    let mut table = table(&header, 3);
    for certificate in certificates {
        let Certificate { link, image, .. } = certificate;
        let verdict = |differs: bool| match (link, differs) {
            (None, _) => "",
            (Some(_), false) => "same",
            (Some(_), true) => "differs",
        };
        let missing = || number::MISSING.to_owned();
        table.add_row([
            link.as_ref()
                .map_or_else(|| "host".to_owned(), ToString::to_string),
            image.map_or_else(missing, |crc| format!("{crc:08x}")),
            certificate.hash.to_string(),
            certificate.cases.to_string(),
            certificate.steps.to_string(),
            verdict(certificate.difference.is_some()).to_owned(),
            certificate.files.to_string(),
            certificate.rows.to_string(),
            verdict(certificate.row_difference.is_some()).to_owned(),
        ]);
    }
    text(&table)
}

/// Host step times, apart from everything that is reproducible.
pub(crate) fn timing_lines(runs: &[CaseRun]) -> String {
    let mut lines = String::new();
    for run in runs {
        let (Some(timing), Some(period_ns)) = (run.timing, run.case.controller.sample_time_ns)
        else {
            continue;
        };
        lines += &format!(
            "{}: host step {:.3} µs median, {:.3} p99, {:.3} max of {} µs (clock alone {:.3})\n",
            run.outcome.summary.name,
            timing.median_us,
            timing.p99_us,
            timing.max_us,
            number::table(1e6 * time::seconds(period_ns)),
            timing.clock_us,
        );
    }
    lines
}

/// What the controller's part of each run cost its chip.
pub(crate) fn chip_lines(runs: &[CaseRun]) -> String {
    let mut lines = String::new();
    for run in runs {
        let summary = &run.outcome.summary;
        let Some(chip) = &summary.chip else { continue };
        let step = match (chip.instructions_per_step_max, chip.cycles_per_step_max) {
            (Some(instructions), Some(cycles)) => {
                format!("a step {instructions} instructions at most, {cycles} cycles allowed")
            }
            (None, Some(cycles)) => format!("a step {cycles} cycles at most"),
            (_, None) => "no time of its steps".to_owned(),
        };
        lines += &format!(
            "{} on {}, image {}: {step}, {} % of Δt at {} MHz; {} bytes of flash, {} of RAM, {} of stack\n",
            summary.name,
            chip.target,
            chip.image_hash,
            shown(chip.utilisation_max_percent),
            number::table(chip.clock_hz as f64 / 1e6),
            chip.flash_bytes,
            chip.ram_bytes,
            shown(chip.stack_bytes.map(f64::from)),
        );
    }
    lines
}

/// The rungs of a ladder.
pub(crate) fn ladder_table(rungs: &[Rung]) -> String {
    let header = [
        "rung",
        "adds",
        "peak acc\nm/s²",
        "following\nerror mm",
        "final\nerror µm",
        "contact\nchanges",
        "rms Δacc\nm/s²",
        "rms Δx\nµm",
    ];
    let mut table = table(&header, 2);
    for rung in rungs {
        let figure = |key: &str| rung.outcome.summary.shown(key);
        let difference =
            |value: Option<f64>, place: usize| held(value, rung.difference_digits[place]);
        table.add_row([
            rung.name(),
            rung.adds().to_owned(),
            figure("peak_abs_acc_mps2"),
            figure("peak_following_error_mm"),
            figure("final_error_um"),
            figure("contact_changes"),
            difference(rung.difference.map(|d| d.rms_acc_mps2), 0),
            difference(rung.difference.map(|d| d.rms_position_um), 1),
        ]);
    }
    text(&table)
}
