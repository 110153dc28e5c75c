//! `hil-runner certify`: the controller on chips held against the one that was
//! simulated.

use std::str::FromStr;

use anyhow::{anyhow, bail};
use clap::Args;
use hil_core::case::{ComputationDelay, Law};
use hil_core::number;
use hil_core::runfile::RunFile;
use hil_runner::chip::certify::{
    Comparison, HostTrace, TraceHash, VectorFile, compare_run, replay, stored,
};
use hil_runner::chip::client::Client;
use hil_runner::chip::spec::{ChipLink, Transport};
use hil_runner::chip::wasm::{Page, PageLine};
use hil_runner::chip::{ChipLaw, installed};
use hil_runner::live::{Images, LiveCase};
use serde_json::{Value, json};

#[cfg(unix)]
use super::flips;
use super::options::{Cases, OpenChip, Sets, explain, live_case, refuse_other_laws};
use super::terminal::{self, Progress, check_signals, tell, tell_line};

/// Hold the controller on chips against the host's, bit for bit
///
/// Runs each case on the host and, in a closed loop of its own, on each chip, and
/// compares every count, code, error, state and fault of every step; then
/// replays the firmware's golden vectors on the chip. The trace hash is over all
/// steps of all cases.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/certify.txt").trim_ascii_end())]
pub(crate) struct Certify {
    #[command(flatten)]
    cases: Cases,
    /// Chip: qemu[:m4|m0|m3|rv32], qemu-uart[:m4|m0|m3|rv32] or serial:PORT[@BAUD]; or wasm, the
    /// simulator of web pages, of which all rungs are held; may be given several times. Without
    /// it, every target that can be run in QEMU here
    #[arg(long = "link", value_name = "LINK")]
    links: Vec<Held>,
    /// Print host and chips as a list in JSON in place of the table
    #[arg(long)]
    json: bool,
    /// Measure the comparison itself: invert a bit of so many executed instructions of
    /// the image in QEMU, one at a time, and tell which flips the vectors and then the
    /// cases find; one that survives is exit status 1
    #[cfg(unix)]
    #[arg(long, value_name = "N", conflicts_with = "json")]
    flips: Option<core::num::NonZeroUsize>,
    /// The draw of the flips
    #[cfg(unix)]
    #[arg(long, value_name = "SEED", default_value_t = 1, requires = "flips")]
    seed: u64,
    #[command(flatten)]
    sets: Sets,
}

/// What is held against the host.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Held {
    /// A controller on a chip.
    Chip(ChipLink),
    /// The simulator of web pages.
    Page,
}

const PAGE: &str = "wasm";

impl FromStr for Held {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            PAGE => Ok(Self::Page),
            text => text
                .parse()
                .map(Self::Chip)
                .map_err(|unknown| format!("{unknown}, or {PAGE} for the simulator of web pages")),
        }
    }
}

/// A computation, and its place.
#[derive(Debug, Default)]
struct Certificate {
    /// What is held, by its name, or the host itself.
    target: String,
    /// CRC-32 of the chip's image; the host has none.
    image: Option<u32>,
    /// Over the steps of the cases.
    hash: TraceHash,
    /// Cases and their steps.
    cases: Compared,
    /// Files of vectors and their rows.
    vectors: Compared,
    /// Whole runs of a page's simulator, and their numbers.
    runs: Compared,
}

/// Cases or files that were begun, and what they have up to the first difference.
#[derive(Debug, Default)]
struct Compared {
    begun: usize,
    all: Comparison,
}

impl Compared {
    /// Takes in one more; true if it differs, and is the last.
    fn add(&mut self, one: Comparison) -> bool {
        self.begun += 1;
        self.all.compared += one.compared;
        self.all.difference = one.difference;
        self.all.difference.is_some()
    }
}

impl Certificate {
    /// The first differences, a line each.
    fn differences(&self) -> String {
        let target = &self.target;
        let parts = [&self.cases, &self.vectors, &self.runs].into_iter();
        let found = parts.filter_map(|part| part.all.difference.as_ref());
        found.map(|found| format!("{target}: {found}\n")).collect()
    }

    /// CRC-32 of the image in hexadecimal digits.
    fn image(&self) -> Option<String> {
        self.image.map(|crc| format!("{crc:08x}"))
    }

    fn json(&self) -> Value {
        let part = |Compared { begun, all }: &Compared, begun_key: &str, compared_key: &str| {
            json!({
                begun_key: begun,
                compared_key: all.compared,
                "difference": all.difference.as_ref().map(ToString::to_string),
            })
        };
        let mut json = json!({
            "target": self.target,
            "image": self.image(),
            "trace_hash": self.hash.to_string(),
            "cases": part(&self.cases, "cases", "steps"),
            "vectors": part(&self.vectors, "files", "rows"),
        });
        if self.runs.begun > 0 {
            json["runs"] = part(&self.runs, "runs", "numbers");
        }
        json
    }
}

impl Certify {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let files = self.sets.load(&self.cases.cases)?;
        refuse_other_laws(&files, "a chip runs the firmware")?;
        let measured =
            |file: &&RunFile| file.case.controller.computation_delay == ComputationDelay::Measured;
        if let Some(file) = files.iter().find(measured) {
            let because = "host and chip run in loops of their own, which need one delay: a time";
            bail!("{}", file.refuse("controller.computation_delay_s", because));
        }
        let links = match self.links.is_empty() {
            true => installed_links()?,
            false => self.links.clone(),
        };
        #[cfg(unix)]
        if let Some(count) = self.flips {
            let chip = |held: &Held| match held {
                Held::Chip(link) => Ok(link.clone()),
                Held::Page => bail!("--flips needs an image in QEMU, not {PAGE}"),
            };
            let links: Vec<ChipLink> = links.iter().map(chip).collect::<Result<_, _>>()?;
            return flips::execute(&files, &links, count.get(), self.seed);
        }
        let (bench, host) = Bench::on_host(&files)?;
        let rows = host.vectors.all.compared;
        let mut certificates = vec![host];
        let mut errors = Vec::new();
        for link in links {
            let made = match &link {
                Held::Chip(link) => bench.of_chip(link, rows),
                Held::Page => {
                    let cases = self.cases.cases.iter();
                    let cases = cases.map(|case| live_case(case, &self.sets));
                    bench.of_page(&cases.collect::<Result<Vec<_>, _>>()?, rows)
                }
            };
            match made {
                Ok(certificate) => certificates.push(certificate),
                Err(error) => errors.push(format!("{error:#}")),
            }
            check_signals()?;
        }
        let differences = certificates.iter().map(Certificate::differences);
        let differences: String = differences.collect();
        if self.json {
            let values = certificates.iter().map(Certificate::json);
            terminal::print_json(&values.collect::<Vec<_>>())?;
        } else {
            terminal::print(&(table(&certificates) + &differences))?;
        }
        if !errors.is_empty() {
            bail!("{}", errors.join("\n"));
        }
        Ok(differences.is_empty())
    }
}

/// Every target that runs in QEMU here, over its FIFOs; the others are named.
fn installed_links() -> anyhow::Result<Vec<Held>> {
    let transport = Transport::Fifo;
    let mut links = Vec::new();
    for (target, missing) in installed(transport) {
        match missing {
            Ok(()) => links.push(Held::Chip(ChipLink::Qemu { target, transport })),
            Err(error) => tell!("left out: {}: {error}\n", target.name()),
        }
    }
    if links.is_empty() {
        bail!("no target can be run here; --link serial:PORT[@BAUD] takes a board");
    }
    Ok(links)
}

/// The host's side of every comparison.
struct Bench<'f> {
    files: &'f [RunFile],
    hosts: Vec<HostTrace<'f>>,
    vectors: Vec<VectorFile>,
}

impl<'f> Bench<'f> {
    fn on_host(files: &'f [RunFile]) -> anyhow::Result<(Self, Certificate)> {
        let vectors = stored();
        let mut hosts = Vec::with_capacity(files.len());
        let mut certificate = Certificate {
            target: "host".to_owned(),
            ..Certificate::default()
        };
        for file in files {
            let mut progress = Progress::of(&file.case);
            let host = HostTrace::record(&file.case, &mut |row| progress.row(row));
            let host = host.map_err(|error| explain(file, error))?;
            certificate.cases.begun += 1;
            certificate.cases.all.compared += host.steps().len() as u64;
            certificate.hash.extend(host.steps());
            hosts.push(host);
        }
        for file in &vectors {
            let rows = firmware_link::vectors::replay(&file.text)
                .map_err(|mismatch| anyhow!("on the host: {}, {mismatch}", file.name))?;
            certificate.vectors.begun += 1;
            certificate.vectors.all.compared += rows as u64;
        }
        let bench = Self {
            files,
            hosts,
            vectors,
        };
        Ok((bench, certificate))
    }

    fn of_chip(&self, link: &ChipLink, rows: u64) -> anyhow::Result<Certificate> {
        let mut chip = OpenChip::open(link)?;
        let certificate = self.over(link.to_string(), &mut chip.client, rows)?;
        chip.tell();
        Ok(certificate)
    }

    /// The cases step by step and the vectors with the firmware in a page's simulator, and the
    /// cases as whole runs on every rung.
    fn of_page(&self, cases: &[LiveCase], rows: u64) -> anyhow::Result<Certificate> {
        let image = Images::find(&mut tell_line)?.simulator;
        let mut client = Client::greet(Box::new(PageLine::new(Page::start(&image)?)))?;
        let mut certificate = self.over(PAGE.to_owned(), &mut client, rows)?;
        let mut page = Page::start(&image)?;
        certificate.image = Some(page.crc());
        let runs = cases.len() * Law::ALL.len();
        let mut progress = Progress::of_rows(&format!("{PAGE}, whole runs"), runs as u64);
        for case in cases {
            for law in Law::ALL {
                progress.one()?;
                if certificate.runs.add(compare_run(case, &mut page, law)?) {
                    return Ok(certificate);
                }
            }
        }
        Ok(certificate)
    }

    /// The cases step by step, then the vectors.
    fn over(&self, target: String, client: &mut Client, rows: u64) -> anyhow::Result<Certificate> {
        let mut certificate = Certificate {
            image: Some(client.identity().image_crc),
            ..Certificate::default()
        };
        for (file, host) in self.files.iter().zip(&self.hosts) {
            let label = format!("{target}, {}", file.case.name);
            let mut progress = Progress::labelled(&file.case, &label);
            let mut sink = |row: &_| progress.row(row);
            // Times are no part of what is compared.
            let law = ChipLaw::new(client, &file.case, true);
            let compared =
                law.and_then(|mut law| host.compare(&mut law, &mut certificate.hash, &mut sink));
            let compared =
                compared.map_err(|error| explain(file, error).context(target.clone()))?;
            if certificate.cases.add(compared) {
                break;
            }
        }
        let mut progress = Progress::of_rows(&format!("{target}, vectors"), rows);
        let mut on_row = || progress.one();
        for file in &self.vectors {
            let replayed =
                replay(client, file, &mut on_row).map_err(|error| anyhow!("{target}: {error}"))?;
            if certificate.vectors.add(replayed) {
                break;
            }
        }
        certificate.target = target;
        Ok(certificate)
    }
}

/// The computations of the host and of every chip, a line each.
fn table(certificates: &[Certificate]) -> String {
    let mut header = "target|image|trace hash|cases|steps||vector\nfiles|rows|".to_owned();
    let has_runs = certificates.iter().any(|of| of.runs.begun > 0);
    if has_runs {
        header += "|whole\nruns|numbers|";
    }
    let rows = certificates.iter().map(|certificate| {
        let part = |Compared { begun, all }: &Compared| {
            let verdict = match (certificate.image, &all.difference) {
                (None, _) => "",
                (Some(_), None) => "same",
                (Some(_), Some(_)) => "differs",
            };
            let compared = all.compared.to_string();
            [begun.to_string(), compared, verdict.to_owned()]
        };
        let image = certificate.image();
        let image = image.unwrap_or_else(|| number::MISSING.to_owned());
        let hash = certificate.hash.to_string();
        let own = [certificate.target.clone(), image, hash];
        let mut row = [own, part(&certificate.cases), part(&certificate.vectors)].concat();
        match certificate.runs.begun {
            0 if has_runs => row.extend([number::MISSING, number::MISSING, ""].map(str::to_owned)),
            0 => {}
            _ => row.extend(part(&certificate.runs)),
        }
        row
    });
    terminal::table(header.split('|'), 3, rows)
}
