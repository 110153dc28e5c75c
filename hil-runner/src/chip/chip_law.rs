//! Rung `firmware` on a chip: the same parameters, the same registers and the
//! same requests as on the host, over a line; the codes come back.

use firmware::axis::Inputs;
use firmware::law::Law as AxisLaw;
use firmware::output::{Output, Quantiser};
use firmware::{Axis, Dac, Next, Observed, SetpointSource, Settings, State, counts};
use firmware_link::request::MOST_WORDS;
use firmware_link::{Events, Identity, Request, SourceKind, Step, plan, settings as wire};
use hil_core::case::{Case, Law};
use hil_core::chip_cost::{ChipReport, ExecutionFigures};
use hil_core::controllers::{Arrivals, FROM_REST, Reported, Setup, Source, World, compensated};
use hil_core::error::RunError;
use hil_core::message::{Command, Link, LinkError, Measurement};
use hil_core::quantise::{FixedPointGains, QuantiseError};

use super::client::{Client, too_long};
use super::line::ChipError;
use super::meter::Meter;

/// A configured chip, sample by sample.
#[derive(Debug)]
pub struct ChipLaw<'c> {
    client: &'c mut Client,
    /// The host's part of an axis; none where the chip has the paper's law alone.
    axis: Option<Box<RemoteAxis>>,
    /// The source, where the setpoints come with the samples.
    source: Option<Source>,
    gains: FixedPointGains,
    /// The converter that the codes are for.
    dac: Dac,
    meter: Meter,
}

/// The host's part of an axis on a chip.
#[derive(Debug)]
struct RemoteAxis {
    world: World,
    reported: Reported,
    /// The axis that the chip has, and its law from the gain change on.
    axis: Axis,
    next_law: Option<AxisLaw>,
}

impl RemoteAxis {
    /// Everything that comes before the sample, and the sample itself.
    fn prepare(
        &mut self,
        client: &mut Client,
        source: Option<&mut Source>,
        tick: u64,
        arrivals: Arrivals,
    ) -> Result<Step, ChipError> {
        let mut events = Events::default();
        for event in arrivals.events.into_iter().flatten() {
            self.reported.asked(event);
            events.insert(event);
        }
        if arrivals.gains_change
            && let Some(law) = self.next_law
            && law != *self.axis.law()
        {
            self.axis.set_law(law);
            give_settings(client, &self.axis)?;
        }
        let shown = arrivals.shown;
        let inputs = Inputs {
            tick,
            motor_register: match shown.bus_fails {
                true => 0,
                false => shown.motor_register,
            },
            load_register: shown.load_register,
            emergency_stop: shown.emergency_stop,
            failed_transfers: u32::from(shown.bus_fails),
        };
        let mut next = Next::Underrun;
        if let Some(source) = source {
            if let Source::Queue(queue) = source {
                queue.fill(arrivals.queue_is_dry);
            }
            // Only an axis that moves takes from it.
            if self.reported.status.state == State::Moving {
                next = source.next(&Observed::default());
            }
        }
        Ok(Step {
            events,
            inputs,
            motor_unread: shown.bus_fails,
            next,
        })
    }
}

impl ChipLaw<'_> {
    fn sample(&mut self, measurement: Measurement) -> Result<Command, ChipError> {
        let tick = measurement.tick;
        let step = match &mut self.axis {
            // The paper's law: a register in, a code out.
            None => Step {
                events: Events::default(),
                inputs: Inputs {
                    tick,
                    motor_register: counts::wrap(measurement.position_counts.whole())
                        .cast_unsigned(),
                    ..Inputs::default()
                },
                motor_unread: false,
                next: (self.source.as_mut())
                    .map_or(Next::Underrun, |source| source.next(&Observed::default())),
            },
            Some(axis) => match axis.world.at(measurement) {
                Some(arrivals) => {
                    axis.prepare(self.client, self.source.as_mut(), tick, arrivals)?
                }
                None => return Ok(axis.reported.command(tick, false)),
            },
        };
        let stepped = self.client.step(step)?;
        // A frame that is whole may still come from a controller that is not.
        let (code, largest) = (stepped.code, self.dac.max_code());
        if code < self.dac.min_code() || code > largest {
            return Err(ChipError(format!(
                "the controller answers code {code}; the converter has {} to {largest}",
                -largest - 1
            )));
        }
        let command = match &mut self.axis {
            None => Command {
                out_of_range: stepped.out_of_range,
                ..Command::whole(tick, stepped.error_counts, code)
            },
            Some(axis) => {
                // Without power the amplifier gets 0 V, whatever the code.
                let code = if stepped.power { code } else { 0 };
                axis.reported
                    .sampled(stepped.state, stepped.error_counts, code, stepped.fault);
                axis.reported.command(tick, stepped.out_of_range)
            }
        };
        Ok(Command {
            execution: Some(self.meter.time(stepped.ticks)),
            ..command
        })
    }
}

impl Link for ChipLaw<'_> {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        self.sample(measurement)
            .map_err(|ChipError(because)| LinkError::Chip { tick, because })
    }

    fn gains(&self) -> Option<FixedPointGains> {
        Some(self.gains.clone())
    }

    fn cost(
        &mut self,
        execution: ExecutionFigures,
        period_ns: u64,
    ) -> Result<Option<ChipReport>, LinkError> {
        let refused = |ChipError(sentence)| LinkError::Refused(sentence);
        let status = self.client.status().map_err(refused)?;
        let identity = self.client.identity();
        let own = ChipReport {
            target: name_of(identity),
            image_hash: format!("{:08x}", identity.image_crc),
            flash_bytes: identity.flash_bytes,
            ram_bytes: identity.ram_bytes,
            stack_bytes: Some(status.stack_bytes).filter(|bytes| *bytes > 0),
            clock_hz: self.meter.clock_hz(),
            streamed_words: match &self.source {
                Some(Source::Table(table)) => Some([table.words.len(), room(identity)]),
                _ => None,
            },
            ..ChipReport::default()
        };
        Ok(Some(execution.report(own, period_ns)))
    }
}

impl<'c> ChipLaw<'c> {
    /// Begins a session on the chip and gives it the controller of `case`.
    /// `in_qemu`: its timer counts instructions.
    ///
    /// # Errors
    /// [`RunError`] if the case has no such controller, or the chip does not take
    /// it.
    pub fn new(client: &'c mut Client, case: &Case, in_qemu: bool) -> Result<Self, RunError> {
        let period_ns = case.controller.sample_time_ns;
        let period_ns = period_ns.ok_or(QuantiseError::NoSampleTime)?;
        refuse_other_laws(case)?;
        let dac = Dac::with_bits(case.dac.bits).map_err(QuantiseError::Refused)?;
        client.begin_session()?;
        let setup = Setup::of(case, period_ns)?;
        let scaled = setup.law()?;
        // The paper's law is an axis with everything off.
        let is_paper = case.options.is_off();
        let axis = match is_paper {
            true => {
                let output = Output::unlimited(scaled.law.dac(), Quantiser::Nearest);
                Axis::new(scaled.law, output)
            }
            false => compensated(&setup, scaled.law)?,
        };
        give_settings(client, &axis)?;
        let (kind, source) = give_source(client, setup.source(&scaled.law))?;
        let mut events = Events::default();
        let mut reported = Reported::new(State::Disabled);
        for event in FROM_REST {
            reported.asked(event);
            events.insert(event);
        }
        client.begin(kind, events)?;
        let axis = match is_paper {
            true => None,
            false => Some(Box::new(RemoteAxis {
                world: World::new(&case.options, period_ns),
                reported,
                axis,
                next_law: setup.next_law()?,
            })),
        };
        let meter = Meter::new(client.identity(), in_qemu, case.target);
        Ok(Self {
            client,
            axis,
            source,
            gains: scaled.fixed_point(),
            dac,
            meter,
        })
    }
}

/// Gives the chip the settings of an axis.
pub(super) fn give_settings(client: &mut Client, axis: &Axis) -> Result<(), ChipError> {
    let payload = wire::write(&Settings::of(axis)).ok_or_else(too_long)?;
    client.take(&Request::Settings(&payload))
}

/// Puts the setpoints into the chip's memory, and what comes with the samples back: a queue,
/// and a table that the memory has no room for.
fn give_source(
    client: &mut Client,
    source: Source,
) -> Result<(SourceKind, Option<Source>), ChipError> {
    let room = room(client.identity());
    let kind = match &source {
        Source::Table(table) if table.words.len() <= room => {
            send_memory(client, &table.words)?;
            match table.has_rates {
                true => SourceKind::Rates,
                false => SourceKind::Table,
            }
        }
        Source::Generator(generator) => {
            let words: Vec<i32> = plan::words(&generator.stretches, generator.end).collect();
            let needed = words.len();
            if needed > room {
                return Err(ChipError(format!(
                    "the motion needs {needed} words for its plan but the chip's table holds {room}; \
                     a longer sample time or controller.setpoints = \"queue\" needs fewer"
                )));
            }
            send_memory(client, &words)?;
            SourceKind::Plan
        }
        Source::Table(_) | Source::Queue(_) => return Ok((SourceKind::Step, Some(source))),
    };
    Ok((kind, None))
}

/// Words of the chip's memory.
fn room(identity: &Identity) -> usize {
    usize::try_from(identity.table_capacity).unwrap_or(usize::MAX)
}

/// Fills the chip's memory.
fn send_memory(client: &mut Client, words: &[i32]) -> Result<(), ChipError> {
    for some in words.chunks(MOST_WORDS) {
        let bytes: Vec<u8> = some.iter().flat_map(|word| word.to_le_bytes()).collect();
        client.take(&Request::Memory(&bytes))?;
    }
    Ok(())
}

/// Refuses a case of any rung but `firmware`.
///
/// # Errors
/// A sentence with the law of the case.
pub(super) fn refuse_other_laws(case: &Case) -> Result<(), ChipError> {
    match case.controller.law {
        Law::Firmware => Ok(()),
        other => Err(ChipError(format!(
            "a chip runs the firmware; the law must be \"firmware\", not \"{}\"",
            other.name()
        ))),
    }
}

/// The name that a chip gives itself; what is no letter, number or sign is a question
/// mark.
pub fn name_of(identity: &Identity) -> String {
    let name = identity.target.iter().take_while(|byte| **byte != 0);
    name.map(|byte| match char::from(*byte) {
        sign if sign.is_ascii_graphic() => sign,
        _ => '?',
    })
    .collect()
}
