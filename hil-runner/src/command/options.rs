//! Options that several verbs have: cases with their overrides, and the link of
//! controller and plant; remarks, and errors in the words of the run file.

use std::collections::HashSet;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, bail};
use clap::Args;
use hil_core::case::{Case, Law};
use hil_core::error::RunError;
use hil_core::run::{CaseRun, RowSink, RunOptions, run_over};
use hil_core::runfile::{self, RunFile};
use hil_runner::chip::client::Client;
use hil_runner::chip::spec::ChipLink;
use hil_runner::chip::{self, ChipLaw, name_of};
use hil_runner::files::{self, same_file};
use hil_runner::host::LinkKind;
use hil_runner::live::{Images, Live, LiveCase};
use serde::Serialize;
use serde_json::Value;

use super::terminal::{self, tell, tell_line};

// A documented structure would put its words into the help of every verb.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Sets {
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub(super) sets: Vec<String>,
}

// As above.
#[derive(Debug, Default, Args)]
pub(super) struct Cases {
    /// Run files, built-in cases (paper-1 … paper-4, paper-2-12bit) or `-`, a run file from
    /// standard input
    #[arg(required = true)]
    pub(super) cases: Vec<String>,
}

impl Sets {
    /// Reads the run files; all that is wrong with any of them in one message.
    pub(super) fn load(&self, cases: &[String]) -> anyhow::Result<Vec<RunFile>> {
        if cases.iter().filter(|case| *case == "-").count() > 1 {
            bail!("- is given for two cases; standard input has one run file");
        }
        let mut found = Vec::with_capacity(cases.len());
        let mut mistakes = Vec::new();
        let mut told = HashSet::new();
        for case in cases {
            match files::run_file(case, &self.sets) {
                Ok(file) => found.push(file),
                // The same wrong --set is wrong for every case; once is enough.
                Err(errors) => {
                    let each = errors.entries().iter().map(ToString::to_string);
                    mistakes.extend(each.filter(|mistake| told.insert(mistake.clone())));
                }
            }
        }
        if !mistakes.is_empty() {
            let mut message = String::new();
            runfile::list_mistakes(&mut message, &mistakes)?;
            bail!(message);
        }
        Ok(found)
    }

    /// Reads one run file.
    pub(super) fn load_one(&self, case: &str) -> anyhow::Result<RunFile> {
        let files = self.load(&[case.to_owned()])?;
        files.into_iter().next().context("a case has a file")
    }

    /// The same with one override more, which comes last.
    pub(super) fn and(&self, set: String) -> Self {
        let mut all = self.clone();
        all.sets.push(set);
        all
    }
}

/// Refuses every law but the firmware's.
pub(super) fn refuse_other_laws(files: &[RunFile], because: &str) -> anyhow::Result<()> {
    let other = |file: &&RunFile| file.case.controller.law != Law::Firmware;
    if let Some(file) = files.iter().find(other) {
        let because = format!("{because}; the law must be \"firmware\"");
        bail!("{}", file.refuse("controller.law", &because));
    }
    Ok(())
}

/// An output must not replace a file that is read, nor another output.
pub(super) fn refuse_replaced(
    outputs: &[&Path],
    cases: &[String],
    files: &[RunFile],
    log: Option<&Path>,
) -> anyhow::Result<()> {
    for (i, output) in outputs.iter().enumerate() {
        let path = output.display();
        let same = |other: &&Path| same_file(output, other);
        if outputs[i + 1..].iter().any(same) {
            bail!("{path} is given for two outputs; each needs its own");
        }
        let is_read = |case: &String| {
            // What is read from standard input is not what is written to standard output.
            case != "-"
                && runfile::builtin_text(case).is_none()
                && same_file(Path::new(case), output)
        };
        if cases.iter().any(is_read) {
            bail!("{path} is a run file of this command; an output would replace it");
        }
    }
    let profiles = files.iter().filter_map(|file| file.profile.as_deref());
    let profiles = profiles.map(|path| (path, "a profile"));
    let log = log.map(|path| (path, "the log"));
    for (path, what) in log.into_iter().chain(profiles) {
        if outputs.iter().any(|output| same_file(output, path)) {
            let path = path.display();
            bail!("{path} is {what} of this command; an output would replace it");
        }
    }
    Ok(())
}

/// The folder of the outputs that nobody has given a path for.
pub(super) fn make_out_folder() -> anyhow::Result<()> {
    std::fs::create_dir_all("out").context("the folder out cannot be made")
}

/// The case of a run file with overrides, as its page carries it.
pub(super) fn live_case(name_or_path: &str, sets: &Sets) -> anyhow::Result<LiveCase> {
    let (file, text) = files::named_text(name_or_path)?;
    Ok(LiveCase::new(file, &text, &sets.sets)?)
}

/// A case with its simulator, which is built where there is none; that is said on stderr.
pub(super) fn live(case: LiveCase) -> anyhow::Result<Live> {
    Ok(Live::new(case, &Images::find(&mut tell_line)?)?)
}

/// The same where it is asked for.
pub(super) fn live_if(
    is_asked: bool,
    case: impl FnOnce() -> anyhow::Result<LiveCase>,
) -> anyhow::Result<Option<Live>> {
    is_asked.then(|| live(case()?)).transpose()
}

/// The error of a run of this file as the user should read it.
pub(super) fn explain(file: &RunFile, error: RunError) -> anyhow::Error {
    anyhow::Error::msg(hil_core::error::explain(file, &error))
}

/// Tells on stderr what the user should know besides the figures.
pub(super) fn warn(name: &str, warnings: impl IntoIterator<Item = impl std::fmt::Display>) {
    for warning in warnings {
        tell!("{name}: warning: {warning}\n");
    }
}

/// The texts of cases, once each, behind the names of all that have it.
pub(super) fn once_each(
    texts: impl IntoIterator<Item = (String, String)>,
) -> Vec<(String, String)> {
    let mut shown: Vec<(String, String)> = Vec::new();
    for (name, text) in texts {
        match shown.iter_mut().find(|(_, known)| *known == text) {
            Some((names, _)) => *names += &format!(", {name}"),
            None => shown.push((name, text)),
        }
    }
    shown
}

/// What cases have in JSON: that of one case as it is, that of several as a list in
/// their order.
pub(super) fn of_cases(
    values: impl IntoIterator<Item = impl Serialize>,
) -> serde_json::Result<Value> {
    let values = values.into_iter().map(serde_json::to_value);
    let mut values = values.collect::<Result<Vec<_>, _>>()?;
    Ok(match values.len() {
        1 => values.remove(0),
        _ => values.into(),
    })
}

/// A link by its name on the command line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) enum LinkName {
    /// Controller and plant in this process, in one thread.
    #[default]
    InProcess,
    /// The same in two threads.
    Channel,
    /// A controller on a chip.
    Chip(ChipLink),
}

/// The help of `--link`.
pub(super) const LINK_HELP: &str = "How controller and plant are connected: in-process, channel, \
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
                .map_err(|unknown| format!("{unknown}, in-process or channel")),
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

/// A chip that has answered.
#[derive(Debug)]
pub(super) struct OpenChip {
    link: ChipLink,
    pub(super) client: Client,
}

impl LinkName {
    /// Opens the link to a chip, where it is one. In QEMU an image is built where there
    /// is none, which is said on stderr.
    pub(super) fn open(&self) -> anyhow::Result<(LinkKind, Option<OpenChip>)> {
        Ok(match self {
            Self::InProcess => (LinkKind::InProcess, None),
            Self::Channel => (LinkKind::Channel, None),
            Self::Chip(link) => (LinkKind::default(), Some(OpenChip::open(link)?)),
        })
    }
}

impl OpenChip {
    /// Opens the line and greets the chip.
    pub(super) fn open(link: &ChipLink) -> anyhow::Result<Self> {
        terminal::watch_signals("");
        let opened = chip::open(link, &mut tell_line).with_context(|| format!("--link {link}"))?;
        let client = Client::greet(opened.line).with_context(|| format!("--link {link}"))?;
        let on_chip = client.identity().image_crc;
        if let Some(in_file) = opened.image_crc.filter(|in_file| *in_file != on_chip) {
            bail!(
                "--link {link}: the chip runs another image than the one that was loaded: its \
                 CRC-32 is {on_chip:08x}, that of the file {in_file:08x}"
            );
        }
        let name = name_of(client.identity());
        if let ChipLink::Qemu { target, .. } = link
            && name != target.name()
        {
            let target = target.name();
            bail!("--link {link}: the image is one for {name}, not for {target}");
        }
        terminal::check_signals()?;
        Ok(Self {
            link: link.clone(),
            client,
        })
    }

    /// The chip with the controller of a case.
    pub(super) fn law(&mut self, case: &Case) -> Result<ChipLaw<'_>, RunError> {
        let in_qemu = matches!(self.link, ChipLink::Qemu { .. });
        ChipLaw::new(&mut self.client, case, in_qemu)
    }

    /// Tells the notes on the line so far, a matter of the moment, if requests were
    /// asked again.
    pub(super) fn tell(&self) {
        let noticed = self.client.noticed();
        if noticed.repeated > 0 {
            tell!(
                "{}: {} requests answered, {} of them asked again; {} damaged frames, {} stray\n",
                self.link,
                noticed.answered,
                noticed.repeated,
                noticed.damaged,
                noticed.stray
            );
        }
    }

    /// Runs a case. The time of a step on this host means nothing then and is not
    /// taken.
    pub(super) fn run(
        &mut self,
        case: &Case,
        options: RunOptions,
        sink: &mut RowSink<'_>,
    ) -> Result<CaseRun, RunError> {
        let outcome = run_over(case, options, &mut self.law(case)?, sink)?;
        Ok(CaseRun::of(case, outcome))
    }
}
