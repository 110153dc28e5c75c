//! Cost of the controller on a chip, held against what it has cost before.
//!
//! ```text
//!  image cost ──► every feature of a constant axis ───────┐
//!  image fifo ──► runs: an axis over the line, by state ──┼─► figures ──► goldens
//!  images fifo, uart, cost: flash, RAM, deepest stack ────┘
//! ```
//!
//! The image `cost` says its identity, then name and times of each feature, then
//! its stack; `images/src/bin/cost/main.rs` has the bodies.

pub mod goldens;

use std::time::{Duration, Instant};

use firmware_link::frame::{Received, Receiver};
use firmware_link::{Identity, Reply, Status};
use hil_core::case::TargetSettings;
use hil_core::chip_cost::ChipReport;
use hil_core::error::RunError;
use hil_core::run::{RunOptions, run_over};

use super::chip_law::ChipLaw;
use super::client::Client;
use super::line::ChipError;
use super::meter::Meter;
use super::spec::{COST_IMAGE, ChipLink, Target, Transport};
use super::{open, open_cost};
use crate::files;
use goldens::{Amount, Figure, Instructions};

/// All figures of a target.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetFigures {
    /// The target.
    pub target: Target,
    /// Meter of instructions, cycles and time.
    pub meter: Meter,
    /// The figures, in the order in which they are shown.
    pub figures: Vec<Figure>,
}

/// Measures a target in QEMU; `tell` gets a line before a part that takes a
/// while.
///
/// # Errors
/// [`ChipError`] if an image cannot be had, or does not do its work.
pub fn measure(target: Target, tell: &mut dyn FnMut(&str)) -> Result<TargetFigures, ChipError> {
    let (meter, mut figures, cost_memory) = cost(target, tell)?;
    let mut memory = Vec::new();
    for transport in [Transport::Fifo, Transport::Uart] {
        let (name, image) = (target.name(), transport.image());
        tell(&format!(
            "{name}: samples of an axis of words, image {image}"
        ));
        let (states, bytes) = runs(target, transport, tell)?;
        // Over either transport the same instructions.
        if transport == Transport::Fifo {
            figures.extend(states);
        }
        memory.extend(memory_figures(image, bytes));
    }
    // It has no table to be taken off its statics.
    let [flash, _, stack] = memory_figures(COST_IMAGE, cost_memory);
    memory.extend([flash, stack]);
    figures.append(&mut memory);
    Ok(TargetFigures {
        target,
        meter,
        figures,
    })
}

/// Memory that an image takes: flash, statics less the table of setpoints,
/// deepest stack \[bytes\].
type Memory = [u32; 3];

fn memory_figures(image: &str, [flash, ram, stack]: Memory) -> [Figure; 3] {
    [("flash", flash), ("RAM", ram), ("deepest stack", stack)].map(|(kind, bytes)| Figure {
        name: format!("image {image}, {kind}"),
        amount: Amount::Bytes(bytes),
    })
}

/// First byte of a body with a feature's name.
const NAME: u8 = 0x41;

/// First byte of a body with times.
const TIMES: u8 = 0x42;

/// Silence after which nothing more is awaited. All of it takes 0.3 s on an
/// idle machine, 2026-11.
const SILENCE: Duration = Duration::from_secs(10);

/// The chip said what the image for costs does not say.
const UNEXPECTED: &str =
    "the chip tells something else than what its samples cost; its image is of another version";

/// The chip has told of no sample.
const NO_STEPS: &str = "the chip has computed no sample";

/// Meter of the chip's times, features in the order of the image, and its memory.
type Measured = (Meter, Vec<Figure>, Memory);

/// Starts the image of a target and listens to its end.
///
/// # Errors
/// [`ChipError`] if it cannot be started, or says something else, or not all.
fn cost(target: Target, tell: &mut dyn FnMut(&str)) -> Result<Measured, ChipError> {
    let mut line = open_cost(target, tell)?.line;
    tell(&format!("{}: samples of constant axes", target.name()));
    let mut receiver = Receiver::new();
    let mut said = Said::default();
    let mut buffer = [0; 4096];
    let mut heard = Instant::now();
    loop {
        let count = line.receive(&mut buffer, SILENCE)?;
        if count == 0 {
            if heard.elapsed() >= SILENCE {
                return Err("the chip has stopped telling what its samples cost".into());
            }
            continue;
        }
        heard = Instant::now();
        for byte in buffer.get(..count).unwrap_or_default() {
            let Some(received) = receiver.take(*byte) else {
                continue;
            };
            // A FIFO damages nothing.
            let Received::Body(body) = received else {
                return Err(UNEXPECTED.into());
            };
            if let Some(status) = said.take(body)? {
                return said.measured(status);
            }
        }
    }
}

/// The figures that were told so far.
#[derive(Debug, Default)]
struct Said {
    identity: Option<Identity>,
    /// Name and times \[ticks\].
    features: Vec<(String, Vec<u32>)>,
}

impl Said {
    /// A body; the status ends it.
    fn take(&mut self, body: &[u8]) -> Result<Option<Status>, ChipError> {
        match body.split_first() {
            Some((&NAME, name)) => {
                let name = str::from_utf8(name).map_err(|_| UNEXPECTED)?;
                self.features.push((name.to_owned(), Vec::new()));
            }
            Some((&TIMES, times)) => {
                let (times, []) = times.as_chunks::<4>() else {
                    return Err(UNEXPECTED.into());
                };
                let (_, known) = self.features.last_mut().ok_or(UNEXPECTED)?;
                known.extend(times.iter().map(|time| u32::from_le_bytes(*time)));
            }
            _ => match Reply::read(body) {
                Some((_, Reply::Hello(identity))) => self.identity = Some(identity),
                Some((_, Reply::Status(status))) => return Ok(Some(status)),
                _ => return Err(UNEXPECTED.into()),
            },
        }
        Ok(None)
    }

    fn measured(self, status: Status) -> Result<Measured, ChipError> {
        let identity = self.identity.ok_or(UNEXPECTED)?;
        let samples: usize = self.features.iter().map(|(_, times)| times.len()).sum();
        if u32::try_from(samples) != Ok(status.steps) {
            return Err(UNEXPECTED.into());
        }
        let meter = Meter::new(&identity, true, TargetSettings::default());
        let features = self.features.into_iter().map(|(name, times)| {
            let counts = times.iter().filter_map(|t| meter.time(*t).instructions);
            let counts: Vec<u32> = counts.collect();
            // A feature has more samples than one.
            let (first, others) = counts.split_first().ok_or(NO_STEPS)?;
            Ok(Figure {
                name,
                amount: Amount::Instructions(Instructions {
                    max: others.iter().copied().max().ok_or(NO_STEPS)?,
                    p99: percentile(others, 99),
                    median: percentile(others, 50).ok_or(NO_STEPS)?,
                    first: Some(*first),
                }),
            })
        });
        let features = features.collect::<Result<_, ChipError>>()?;
        let memory = [identity.flash_bytes, identity.ram_bytes, status.stack_bytes];
        Ok((meter, features, memory))
    }
}

/// The case of the runs.
const CASE: &str = "paper-2";

/// Every feature that goes with every other one, and requests that lead
/// through all states: off, on again, and a stop.
const EVERYTHING: &str = include_str!("everything.txt");

/// Runs the paper's controller and then an axis with everything on, whose
/// options are looked at in every sample. Instructions by the state after the
/// sample, and memory of the image.
///
/// # Errors
/// [`ChipError`] if there is no chip, or a run ends early.
fn runs(
    target: Target,
    transport: Transport,
    tell: &mut dyn FnMut(&str),
) -> Result<(Vec<Figure>, Memory), ChipError> {
    let link = ChipLink::Qemu { target, transport };
    let mut client = Client::greet(open(&link, tell)?.line)?;
    let paper = report(&mut client, "")?;
    let everything = report(&mut client, EVERYTHING)?;
    let mut states = figures("run", &paper);
    states.extend(figures("run, everything", &everything));
    let memory = [
        everything.flash_bytes,
        everything.ram_bytes,
        // Painted once, so that it is that of both.
        everything.stack_bytes.unwrap_or(0),
    ];
    Ok((states, memory))
}

/// The report of a run with these sets, one a line.
fn report(client: &mut Client, sets: &str) -> Result<ChipReport, ChipError> {
    let sets: Vec<String> = sets.lines().map(str::to_owned).collect();
    let case = files::case(CASE, &sets).map_err(|errors| ChipError(errors.to_string()))?;
    let failed = |error: RunError| ChipError(error.to_string());
    let mut law = ChipLaw::new(client, &case, true).map_err(failed)?;
    let outcome = run_over(&case, RunOptions::default(), &mut law, &mut |_| Ok(()));
    let report = outcome.map_err(failed)?.summary.chip;
    Ok(report.ok_or(NO_STEPS)?)
}

/// A figure a state.
fn figures(name: &str, report: &ChipReport) -> Vec<Figure> {
    let whole = |count: u64| u32::try_from(count).unwrap_or(u32::MAX);
    let of_states = report.states.iter().map(|cost| Figure {
        name: format!("{name}, {}", cost.state),
        amount: Amount::Instructions(Instructions {
            max: whole(cost.max),
            p99: None,
            median: whole(cost.median),
            first: None,
        }),
    });
    of_states.collect()
}

/// The smallest of the counts that `percent` of them do not exceed.
fn percentile(counts: &[u32], percent: usize) -> Option<u32> {
    let mut sorted = counts.to_vec();
    sorted.sort_unstable();
    let place = (sorted.len() * percent).div_ceil(100).saturating_sub(1);
    sorted.get(place).copied()
}
