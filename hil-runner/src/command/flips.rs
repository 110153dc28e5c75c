//! `hil-runner certify --flips`: bits of an image inverted one at a time, and how
//! each of them is found.

use std::collections::BTreeMap;

use anyhow::{Context, bail};
use hil_core::runfile::RunFile;
use hil_runner::chip::certify::flips::{Campaign, Flip, Kind, Outcome, Place};
use hil_runner::chip::certify::{HostTrace, stored};
use hil_runner::chip::image::Finder;
use hil_runner::chip::spec::{ChipLink, Transport};
use rayon::prelude::*;

use super::options::explain;
use super::terminal::{self, Progress, check_signals, tell_line};

/// Flips so many instructions at the end of every link; true if all are found.
pub(super) fn execute(
    files: &[RunFile],
    links: &[ChipLink],
    count: usize,
    seed: u64,
) -> anyhow::Result<bool> {
    const TRANSPORT: Transport = Transport::Fifo;
    let target = |link: &ChipLink| match link {
        ChipLink::Qemu { target, transport } if *transport == TRANSPORT => Ok(*target),
        other => bail!("--flips needs an image in QEMU, --link qemu[:m4|m0|m3|rv32], not {other}"),
    };
    let targets = links.iter().map(target).collect::<Result<Vec<_>, _>>()?;
    let vectors = stored();
    let mut hosts = Vec::with_capacity(files.len());
    for file in files {
        let mut progress = Progress::of(&file.case);
        let host = HostTrace::record(&file.case, &mut |row| progress.row(row));
        hosts.push(host.map_err(|error| explain(file, error))?);
    }
    let mut pass = true;
    for target in targets {
        let name = target.name();
        let finder = Finder::from_environment();
        let image = finder.image(target, TRANSPORT.image(), &mut tell_line)?;
        let campaign = Campaign::new(target, &image, &vectors, &hosts).context(name)?;
        let flips = campaign.draw(count, seed).context("--flips")?;
        let template = "{prefix}: {bar:30} {pos} flips, {eta} left";
        let bar = terminal::bar(name, flips.len() as u64, template);
        let run = |flip: &Flip| -> anyhow::Result<_> {
            check_signals()?;
            let outcome = campaign.run(*flip)?;
            bar.inc(1);
            Ok((*flip, outcome))
        };
        // One by one: a chip that is silent takes ten times as long.
        let ends: anyhow::Result<Vec<_>> = flips.par_iter().with_max_len(1).map(run).collect();
        bar.finish_and_clear();
        let ends = ends?;
        let executed = campaign.executed().len();
        let title = format!("{name}: {count} of {executed} executed instructions, seed {seed}\n");
        let (survivors, survived) = survivors(&campaign, &ends);
        terminal::print(&(title + &table(&ends, survived) + &survivors))?;
        pass &= survived == 0;
    }
    Ok(pass)
}

/// Flips that are found, by kind and place.
fn table(ends: &[(Flip, Outcome)], survived: usize) -> String {
    const KINDS: [(Kind, &str); 4] = [
        (Kind::Number, "another number"),
        (Kind::Refusal, "another answer"),
        (Kind::Silence, "no answer"),
        (Kind::End, "end of QEMU"),
    ];
    let row = |name: &str, wanted: &dyn Fn(Kind) -> bool| {
        let at = |place| {
            let is = |end: &Outcome| matches!(end, Outcome::Found { place: p, kind, .. } if *p == place && wanted(*kind));
            ends.iter().filter(|(_, end)| is(end)).count()
        };
        let found = [Place::Start, Place::Vectors, Place::Cases].map(at);
        let [start, vectors, cases] = found.map(|number| number.to_string());
        let all = found.iter().sum::<usize>().to_string();
        [name.to_owned(), start, vectors, cases, all]
    };
    let kinds = KINDS.map(|(kind, name)| row(name, &|other| other == kind));
    let survived = ["survived", "", "", "", &survived.to_string()].map(str::to_owned);
    let rows = kinds.into_iter().chain([row("found", &|_| true), survived]);
    terminal::table(["", "start", "vectors", "cases", "flips"], 1, rows)
}

/// Survivors by function, and their number.
fn survivors(campaign: &Campaign<'_>, ends: &[(Flip, Outcome)]) -> (String, usize) {
    let mut functions: BTreeMap<&str, (usize, BTreeMap<u32, String>)> = BTreeMap::new();
    for (Flip { address, .. }, end) in ends {
        let Some(before) = campaign.executed().get(address) else {
            continue;
        };
        let (flips, survivors) = functions.entry(&before.symbol).or_default();
        *flips += 1;
        if let Outcome::Survived { text, remarks } = end {
            let line = format!("  {address:#010x}: {} → {text}", before.text);
            let remark = |remark: &String| format!("\n              {remark}");
            let remarks: String = remarks.iter().map(remark).collect();
            survivors.insert(*address, line + &remarks + "\n");
        }
    }
    let counts = functions.values().map(|(_, survivors)| survivors.len());
    let survived = counts.sum();
    functions.retain(|_, (_, survivors)| !survivors.is_empty());
    let text = functions.iter().map(|(function, (flips, survivors))| {
        let lines: String = survivors.values().map(String::as_str).collect();
        let count = survivors.len();
        format!("{function}: {count} of {flips} survive\n{lines}")
    });
    (text.collect(), survived)
}
