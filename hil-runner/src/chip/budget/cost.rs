//! What the image `cost` says: identity, then name and times of each feature,
//! then its stack. `images/src/bin/cost/main.rs` has the bodies.

use std::time::{Duration, Instant};

use firmware_link::frame::{Received, Receiver};
use firmware_link::{Identity, Reply, Status};

use super::{Amount, BudgetError, Figure, Instructions, Memory, median};
use crate::chip::Meter;
use crate::chip::line::Line;
use crate::chip::open_cost;
use crate::chip::spec::Target;
use hil_core::case::TargetSettings;

/// First byte of a body with a feature's name.
const NAME: u8 = 0x41;

/// First byte of a body with times.
const TIMES: u8 = 0x42;

/// Silence after which nothing more is awaited. All of it takes 0.3 s on an
/// idle machine, 2026-11.
const SILENCE: Duration = Duration::from_secs(10);

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// How the chip's times are read.
    pub meter: Meter,
    /// The features in the order of the image.
    pub features: Vec<Figure>,
    /// Memory of the image itself.
    pub memory: Memory,
}

/// Starts the image of a target and listens to its end.
///
/// # Errors
/// [`BudgetError`] if it cannot be started, or says something else.
pub fn measure(
    target: Target,
    settings: TargetSettings,
    tell: &mut dyn FnMut(&str),
) -> Result<Measured, BudgetError> {
    let mut opened = open_cost(target, tell)?;
    tell(&format!("{}: samples of constant axes", target.name()));
    listen(&mut *opened.line, settings)
}

/// Listens to the image `cost` at the other end of `line`.
///
/// # Errors
/// [`BudgetError`] if it says something else, or not all.
pub fn listen(line: &mut dyn Line, settings: TargetSettings) -> Result<Measured, BudgetError> {
    let mut receiver = Receiver::new();
    let mut said = Said::default();
    let mut buffer = [0; 4096];
    let mut heard = Instant::now();
    loop {
        let count = line.receive(&mut buffer, SILENCE)?;
        if count == 0 {
            if heard.elapsed() >= SILENCE {
                return Err(BudgetError::Silent);
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
                return Err(BudgetError::Unexpected);
            };
            if let Some(status) = said.take(body)? {
                return said.measured(status, settings);
            }
        }
    }
}

/// What was said so far.
#[derive(Debug, Default)]
struct Said {
    identity: Option<Identity>,
    /// Name and times \[ticks\].
    features: Vec<(String, Vec<u32>)>,
}

impl Said {
    /// A body; the status ends it.
    fn take(&mut self, body: &[u8]) -> Result<Option<Status>, BudgetError> {
        match body.split_first() {
            Some((&NAME, name)) => {
                let name = str::from_utf8(name).map_err(|_| BudgetError::Unexpected)?;
                self.features.push((name.to_owned(), Vec::new()));
            }
            Some((&TIMES, times)) => {
                let (times, []) = times.as_chunks::<4>() else {
                    return Err(BudgetError::Unexpected);
                };
                let (_, known) = self.features.last_mut().ok_or(BudgetError::Unexpected)?;
                known.extend(times.iter().map(|time| u32::from_le_bytes(*time)));
            }
            _ => match Reply::read(body) {
                Some((_, Reply::Hello(identity))) => self.identity = Some(identity),
                Some((_, Reply::Status(status))) => return Ok(Some(status)),
                _ => return Err(BudgetError::Unexpected),
            },
        }
        Ok(None)
    }

    fn measured(self, status: Status, settings: TargetSettings) -> Result<Measured, BudgetError> {
        let identity = self.identity.ok_or(BudgetError::Unexpected)?;
        let samples: usize = self.features.iter().map(|(_, times)| times.len()).sum();
        if u32::try_from(samples) != Ok(status.steps) {
            return Err(BudgetError::Unexpected);
        }
        let meter = Meter::new(&identity, true, settings);
        let features = self.features.into_iter().map(|(name, times)| {
            let counts = times.iter().filter_map(|t| meter.time(*t).instructions);
            let counts: Vec<u32> = counts.collect();
            // A feature has more samples than one.
            let (first, others) = counts.split_first().ok_or(BudgetError::NoSteps)?;
            Ok(Figure {
                name,
                amount: Amount::Instructions(Instructions {
                    max: others.iter().copied().max().ok_or(BudgetError::NoSteps)?,
                    median: median(others).ok_or(BudgetError::NoSteps)?,
                    first: Some(*first),
                }),
            })
        });
        Ok(Measured {
            features: features.collect::<Result<_, BudgetError>>()?,
            meter,
            memory: Memory {
                flash: identity.flash_bytes,
                ram: identity.ram_bytes,
                stack: status.stack_bytes,
            },
        })
    }
}
