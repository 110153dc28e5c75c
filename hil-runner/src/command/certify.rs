//! `hil-runner certify`: the controller on chips held against the one that was
//! simulated.

use anyhow::{anyhow, bail};
use clap::Args;
use hil_core::case::ComputationDelay;
use hil_core::number;
use hil_core::runfile::RunFile;
use hil_runner::chip::certify::{
    Difference, HostTrace, RowDifference, TraceHash, VectorFile, replay, stored,
};
use hil_runner::chip::installed;
use hil_runner::chip::spec::{ChipLink, Transport};

use super::cases::{Cases, Sets, explain, refuse_other_laws};
use super::link_option::OpenChip;
use super::terminal::{self, Progress, check_signals};

/// Hold the controller on chips against the host's, bit for bit
///
/// Runs each case on the host and, in a closed loop of its own, on each chip, and
/// compares every count, code, error, state and fault of every step; then
/// replays the firmware's golden vectors on the chip. The trace hash is over all
/// steps of all cases.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit status: 0 all bits are the same, 1 a chip differs, 2 a chip could not be run.\n\n\
                  Examples:\n  \
                  hil-runner certify paper-1 paper-2 paper-3 paper-4\n  \
                  hil-runner certify axis.toml --link qemu:m0 --link qemu-uart:m0\n  \
                  hil-runner certify paper-2 --link serial:/dev/ttyACM0@921600\n  \
                  hil-runner certify paper-2 --set controller.anti_windup=clamp"
)]
pub(crate) struct Certify {
    #[command(flatten)]
    cases: Cases,
    /// Chip: qemu[:m4|m0|m3|rv32], qemu-uart[:m4|m0|m3|rv32] or serial:PORT[@BAUD]; may be
    /// given several times. Without it, every target that can be run in QEMU here
    #[arg(long = "link", value_name = "LINK")]
    links: Vec<ChipLink>,
    #[command(flatten)]
    sets: Sets,
}

/// A computation, and its place.
#[derive(Debug, Default)]
struct Certificate {
    /// The link to the chip; none is the host.
    link: Option<ChipLink>,
    /// CRC-32 of the chip's image.
    image: Option<u32>,
    /// Cases that were begun.
    cases: usize,
    /// Steps up to the first difference.
    steps: u64,
    /// Over these steps.
    hash: TraceHash,
    /// The first one.
    difference: Option<Difference>,
    /// Files of vectors that were begun.
    files: usize,
    /// Rows up to the first difference.
    rows: u64,
    /// The first one.
    row_difference: Option<RowDifference>,
}

impl Certificate {
    /// The first differences, a line each.
    fn differences(&self) -> String {
        let Some(link) = &self.link else {
            return String::new();
        };
        let of_step = self.difference.iter().map(ToString::to_string);
        let of_row = self.row_difference.iter().map(ToString::to_string);
        let lines = of_step.chain(of_row);
        lines.map(|line| format!("{link}: {line}\n")).collect()
    }

    fn is_same(&self) -> bool {
        self.difference.is_none() && self.row_difference.is_none()
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
            bail!(
                "{}",
                file.refuse("controller", "computation_delay_s", because)
            );
        }
        let links = if self.links.is_empty() {
            installed_links()?
        } else {
            self.links.clone()
        };
        // A program without its sources has none; the cases can be compared.
        let vectors = stored().unwrap_or_else(|error| {
            terminal::tell(&format!("left out: {error}\n"));
            Vec::new()
        });
        let bench = Bench::on_host(&files, vectors)?;
        let mut certificates = vec![bench.of_host()];
        let mut errors = Vec::new();
        for link in links {
            match bench.of_chip(&link) {
                Ok(certificate) => certificates.push(certificate),
                Err(error) => errors.push(format!("{error:#}")),
            }
            check_signals()?;
        }
        let differences = certificates.iter().map(Certificate::differences);
        terminal::print(&(table(&certificates) + &differences.collect::<String>()))?;
        if !errors.is_empty() {
            bail!("{}", errors.join("\n"));
        }
        Ok(certificates.iter().all(Certificate::is_same))
    }
}

/// Every target that runs in QEMU here, over its FIFOs; the others are named.
fn installed_links() -> anyhow::Result<Vec<ChipLink>> {
    let transport = Transport::Fifo;
    let mut links = Vec::new();
    for (target, missing) in installed(transport) {
        match missing {
            Ok(()) => links.push(ChipLink::Qemu { target, transport }),
            Err(error) => terminal::tell(&format!("left out: {}: {error}\n", target.name())),
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
    rows: u64,
}

impl<'f> Bench<'f> {
    fn on_host(files: &'f [RunFile], vectors: Vec<VectorFile>) -> anyhow::Result<Self> {
        let mut hosts = Vec::with_capacity(files.len());
        for file in files {
            let mut progress = Progress::of(&file.case);
            let host = HostTrace::record(&file.case, &mut |row| progress.row(row));
            hosts.push(host.map_err(|error| explain(file, error))?);
        }
        let mut counted = 0;
        for file in &vectors {
            let rows = firmware_link::vectors::replay(&file.text)
                .map_err(|mismatch| anyhow!("on the host: {}, {mismatch}", file.name))?;
            counted += rows as u64;
        }
        Ok(Self {
            files,
            hosts,
            vectors,
            rows: counted,
        })
    }

    fn of_host(&self) -> Certificate {
        let mut certificate = Certificate::default();
        for host in &self.hosts {
            certificate.cases += 1;
            certificate.steps += host.steps().len() as u64;
            certificate.hash.extend(host.steps());
        }
        certificate.files = self.vectors.len();
        certificate.rows = self.rows;
        certificate
    }

    fn of_chip(&self, link: &ChipLink) -> anyhow::Result<Certificate> {
        let mut chip = OpenChip::open(link)?;
        let client = chip.under_test().client;
        let image = client.identity().image_crc;
        let mut certificate = Certificate {
            link: Some(link.clone()),
            image: Some(image),
            ..Certificate::default()
        };
        for (file, host) in self.files.iter().zip(&self.hosts) {
            let mut progress =
                Progress::labelled(&file.case, &format!("{link}, {}", file.case.name));
            let mut sink = |row: &_| progress.row(row);
            let compared = host.compare_chip(client, &mut certificate.hash, &mut sink);
            let compared =
                compared.map_err(|error| explain(file, error).context(link.to_string()))?;
            certificate.cases += 1;
            certificate.steps += compared.steps;
            certificate.difference = compared.difference;
            if certificate.difference.is_some() {
                break;
            }
        }
        let mut progress = Progress::of_rows(&format!("{link}, vectors"), self.rows);
        let mut on_row = || progress.one();
        for file in &self.vectors {
            let replayed =
                replay(client, file, &mut on_row).map_err(|error| anyhow!("{link}: {error}"))?;
            certificate.files += 1;
            certificate.rows += replayed.rows;
            certificate.row_difference = replayed.difference;
            if certificate.row_difference.is_some() {
                break;
            }
        }
        drop(progress);
        if client.noticed().repeated > 0 {
            terminal::tell(&chip.noticed());
        }
        Ok(certificate)
    }
}

/// The computations of the host and of every chip, a line each.
fn table(certificates: &[Certificate]) -> String {
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
    let mut table = terminal::table(&header, 3);
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
    terminal::text(&table)
}
