//! The option `--link`: the connection of controller and plant.

use std::str::FromStr;

use anyhow::{Context, bail};
use hil_core::case::Case;
use hil_core::case_run::CaseRun;
use hil_core::error::RunError;
use hil_core::run::{RowSink, RunOptions};
use hil_core::runfile::RunFile;

use hil_runner::chip::client::Client;
use hil_runner::chip::spec::{ChipLink, UnknownLink};
use hil_runner::chip::{self, ChipLaw, ChipUnderTest, name_of, run_on_chip};
use hil_runner::host::{LinkKind, timed_run};

use super::cases::refuse_other_laws;
use super::terminal;

/// A link by its name on the command line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) enum LinkName {
    /// A function call.
    #[default]
    InProcess,
    /// Two threads and a pair of channels.
    Channel,
    /// A controller on a chip.
    Chip(ChipLink),
}

/// The help of `--link`.
pub(super) const HELP: &str = "How controller and plant are connected: in-process, channel, \
     qemu[:m4|m0|m3|rv32], qemu-uart[:m4|m0|m3|rv32] or serial:PORT[@BAUD]; the results are the same";

impl FromStr for LinkName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "in-process" => Ok(Self::InProcess),
            "channel" => Ok(Self::Channel),
            text => text
                .parse()
                .map(Self::Chip)
                .map_err(|unknown: UnknownLink| format!("{unknown}, in-process or channel")),
        }
    }
}

impl std::fmt::Display for LinkName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InProcess => f.write_str("in-process"),
            Self::Channel => f.write_str("channel"),
            Self::Chip(link) => link.fmt(f),
        }
    }
}

/// A link that is open.
#[derive(Debug)]
pub(super) enum OpenLink {
    /// Controller and plant in this process.
    Host(LinkKind),
    /// The controller on a chip.
    Chip(Box<OpenChip>),
}

/// A chip that has answered.
#[derive(Debug)]
pub(super) struct OpenChip {
    link: ChipLink,
    client: Client,
}

impl LinkName {
    /// Opens the link. For a chip in QEMU an image is built where there is none,
    /// which is said on stderr.
    pub(super) fn open(&self) -> anyhow::Result<OpenLink> {
        Ok(match self {
            Self::InProcess => OpenLink::Host(LinkKind::InProcess),
            Self::Channel => OpenLink::Host(LinkKind::Channel),
            Self::Chip(link) => OpenLink::Chip(Box::new(OpenChip::open(link)?)),
        })
    }

    /// A chip runs the firmware alone.
    pub(super) fn refuse_other_laws(&self, files: &[RunFile]) -> anyhow::Result<()> {
        match self {
            Self::Chip(link) => {
                refuse_other_laws(files, &format!("--link {link} runs the firmware"))
            }
            _ => Ok(()),
        }
    }
}

impl OpenChip {
    /// Opens the line and greets the chip.
    pub(super) fn open(link: &ChipLink) -> anyhow::Result<Self> {
        terminal::watch_signals();
        let mut tell = |text: &str| terminal::tell(&format!("{text}\n"));
        let opened = chip::open(link, &mut tell).with_context(|| format!("--link {link}"))?;
        let client = Client::greet(opened.line).with_context(|| format!("--link {link}"))?;
        let on_chip = client.identity().image_crc;
        if let Some(in_file) = opened.image.as_ref().map(|image| image.crc32)
            && in_file != on_chip
        {
            bail!(
                "--link {link}: the chip runs another image than the one that was loaded: its \
                 CRC-32 is {on_chip:08x}, that of the file {in_file:08x}"
            );
        }
        let name = name_of(client.identity());
        if let ChipLink::Qemu { target, .. } = link
            && name != target.name()
        {
            bail!(
                "--link {link}: the image is one for {name}, not for {}",
                target.name()
            );
        }
        terminal::check_signals()?;
        Ok(Self {
            link: link.clone(),
            client,
        })
    }

    /// The chip for a run.
    pub(super) fn under_test(&mut self) -> ChipUnderTest<'_> {
        ChipUnderTest {
            client: &mut self.client,
            in_qemu: matches!(self.link, ChipLink::Qemu { .. }),
        }
    }

    /// The chip with the controller of a case.
    pub(super) fn law(&mut self, case: &Case) -> Result<ChipLaw<'_>, RunError> {
        let chip = self.under_test();
        Ok(ChipLaw::new(chip.client, case, chip.in_qemu)?)
    }

    /// The notes on the line so far: a matter of the moment.
    pub(super) fn noticed(&self) -> String {
        let noticed = self.client.noticed();
        format!(
            "{}: {} requests answered, {} of them asked again; {} damaged frames, {} stray\n",
            self.link, noticed.answered, noticed.repeated, noticed.damaged, noticed.stray
        )
    }
}

impl OpenLink {
    /// Runs a case over the link.
    pub(super) fn run(
        &mut self,
        case: &Case,
        options: RunOptions,
        sink: &mut RowSink<'_>,
    ) -> Result<CaseRun, RunError> {
        match self {
            Self::Host(link) => timed_run(case, *link, options, sink),
            // The time of a step on this host means nothing then and is not taken.
            Self::Chip(chip) => Ok(CaseRun::of(
                case,
                run_on_chip(case, options, &mut chip.under_test(), sink)?,
            )),
        }
    }

    /// Tells the notes on a line to a chip, if requests were asked again.
    pub(super) fn tell(&self) {
        if let Self::Chip(chip) = self
            && chip.client.noticed().repeated > 0
        {
            terminal::tell(&chip.noticed());
        }
    }
}
