//! Comparison of a chip with the host, bit for bit: every number of every step of a
//! case in closed loop, and every row of the golden vectors.
//!
//! ```text
//!  case ─┬─► host's controller ─┬─ plant          HostTrace: every step
//!        │                      └──────────────────────┐
//!        └─► chip's controller ─┬─ plant               ▼
//!                               └─► every step ──► compared, the first
//!                                                  difference ends the run
//! ```
//!
//! Either side has a plant of its own. As long as the codes are the same the
//! plants are, and a code that differs is found in its own step.
//!
//! A [`Step`] is compared; the same numbers go into the [`TraceHash`] of
//! either side. The time of a step is no part of it.

#[cfg(unix)]
pub mod flips;
mod vectors;
mod whole_runs;

use core::fmt;
use std::slice::Iter;

use crc::{CRC_64_XZ, Crc};
use firmware::Fault;

use super::chip_law::refuse_other_laws;
use hil_core::case::Case;
use hil_core::controllers::{Controller, IoKind};
use hil_core::error::RunError;
use hil_core::message::{AxisStatus, Command, Link, LinkError, Measurement, Steps};
use hil_core::number::seconds;
use hil_core::quantise::QuantiseError;
use hil_core::run::{RowSink, RunOptions, run_over};

pub use vectors::{VectorFile, replay, stored};
pub use whole_runs::compare_run;

/// A run of a case with the host's controller, step by step; about 400 bytes
/// each.
#[derive(Debug, Clone)]
pub struct HostTrace<'c> {
    case: &'c Case,
    steps: Vec<Step>,
}

/// Result of a chip against the host in one case, or against a file of vectors.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Comparison {
    /// Steps, or rows, that were compared.
    pub compared: u64,
    /// The first difference; nothing was compared behind it.
    pub difference: Option<Difference>,
}

impl<'c> HostTrace<'c> {
    /// Runs a case of rung `firmware` on the host; its rows go to `sink`.
    ///
    /// # Errors
    /// As [`hil_core::run::run()`], and for any other rung.
    pub fn record(case: &'c Case, sink: &mut RowSink<'_>) -> Result<Self, RunError> {
        refuse_other_laws(case)?;
        let controller = Controller::new(case, IoKind::Direct).map_err(RunError::Quantise)?;
        let mut recording = Recording {
            controller: controller.ok_or(RunError::Quantise(QuantiseError::NoSampleTime))?,
            steps: Vec::new(),
        };
        run_over(case, RunOptions::default(), &mut recording, sink)?;
        let steps = recording.steps;
        Ok(Self { case, steps })
    }

    /// Every step of the run.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Runs the case with the controller at the end of `link` and compares. Each
    /// step goes into `hash`, the last one too.
    ///
    /// # Errors
    /// As [`run_over`].
    pub fn compare(
        &self,
        link: &mut impl Link,
        hash: &mut TraceHash,
        sink: &mut RowSink<'_>,
    ) -> Result<Comparison, RunError> {
        let mut compared = Compared {
            link,
            case: self.case,
            host: self.steps.iter(),
            hash,
            comparison: Comparison::default(),
        };
        let run = run_over(self.case, RunOptions::default(), &mut compared, sink);
        let comparison = compared.comparison;
        if comparison.difference.is_none() {
            run?;
        }
        Ok(comparison)
    }
}

/// A controller whose every step is kept.
struct Recording {
    controller: Controller,
    steps: Vec<Step>,
}

impl Link for Recording {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let command = self.controller.exchange(measurement)?;
        self.steps.push(Step::new(measurement, command));
        Ok(command)
    }
}

/// A controller whose every step is held against the host's.
struct Compared<'a, L> {
    link: &'a mut L,
    case: &'a Case,
    host: Iter<'a, Step>,
    hash: &'a mut TraceHash,
    comparison: Comparison,
}

impl<L: Link> Link for Compared<'_, L> {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        let command = self.link.exchange(measurement)?;
        let step = Step::new(measurement, command);
        self.hash.add(&step);
        self.comparison.compared += 1;
        // Both runs have the steps of the one case.
        let host = self.host.next().ok_or(LinkError::Closed { tick })?;
        let numbers = NumberPair::differing(step.numbers(), host.numbers());
        if numbers.is_empty() {
            return Ok(command);
        }
        let period_ns = self.case.controller.sample_time_ns.unwrap_or(0);
        let time_s = seconds(tick.saturating_mul(period_ns));
        self.comparison.difference = Some(Difference {
            at: tick,
            place: format!("step {tick} ({time_s} s) of {}", self.case.name),
            numbers,
            other: "here",
        });
        // Ends the run.
        Err(LinkError::Closed { tick })
    }
}

/// Input and output of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    measurement: Measurement,
    command: Command,
}

/// A number that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// There is none.
    None,
    /// A number.
    Whole(i64),
    /// A thing with a name: a state, the cause of a fault.
    Name(&'static str),
}

/// A number with its name.
pub type Named = (&'static str, Number);

impl Step {
    /// A step of the firmware, whose counts and codes are whole numbers; how
    /// long it took is left out.
    pub fn new(measurement: Measurement, mut command: Command) -> Self {
        command.execution = None;
        Self {
            measurement,
            command,
        }
    }

    /// Everything that is compared: the sample, what the encoders show, what
    /// the controller answers, what the axis reports, and the fault that is
    /// latched and the first of the run, 8 numbers each.
    pub fn numbers(&self) -> Vec<Named> {
        let (measurement, command) = (&self.measurement, &self.command);
        let axis = command.axis.as_ref();
        let steps = |steps: Steps| Number::Whole(steps.whole());
        let state = axis.map_or(Number::None, |axis| Number::Name(axis.state.name()));
        let of_axis = |number: fn(&AxisStatus) -> u32| Number::of(axis.map(number).map(i64::from));
        let mut numbers = vec![
            ("sample", Number::Whole(command.tick.cast_signed())),
            ("count", steps(measurement.position_counts)),
            ("count of the load", Number::of(measurement.load_counts)),
            ("code", steps(command.dac_code)),
            ("error", steps(command.error_counts)),
            ("out of range", Number::flag(command.out_of_range)),
            ("state", state),
            ("faults", of_axis(|axis| axis.faults)),
            ("refused requests", of_axis(|axis| axis.refused_requests)),
            ("peak error", of_axis(|axis| axis.peak_error_counts)),
        ];
        numbers.extend(fault_numbers(axis.and_then(|axis| axis.fault), LATCHED));
        numbers.extend(fault_numbers(axis.and_then(|axis| axis.first_fault), FIRST));
        numbers
    }
}

/// Names of the numbers of the fault that is latched, and of the first of the run.
const FAULT: [[&str; 2]; 8] = [
    ["fault", "first fault"],
    ["sample of the fault", "sample of the first fault"],
    ["setpoint at the fault", "setpoint at the first fault"],
    ["position at the fault", "position at the first fault"],
    ["error at the fault", "error at the first fault"],
    ["code at the fault", "code at the first fault"],
    ["measured at the fault", "measured at the first fault"],
    ["limit of the fault", "limit of the first fault"],
];
const LATCHED: usize = 0;
const FIRST: usize = 1;

/// The numbers of a fault, by the names of that column.
fn fault_numbers(fault: Option<Fault>, column: usize) -> impl Iterator<Item = Named> {
    let numbers = fault.map_or([Number::None; 8], |fault| {
        let values = fault.values;
        [
            Number::Name(fault.cause.name()),
            Number::Whole(fault.tick.cast_signed()),
            Number::Whole(values.setpoint.into()),
            Number::Whole(values.position.into()),
            Number::Whole(values.error.into()),
            Number::Whole(values.code.into()),
            Number::Whole(values.measured),
            Number::Whole(values.limit),
        ]
    });
    FAULT.map(|names| names[column]).into_iter().zip(numbers)
}

impl Number {
    fn of(value: Option<i64>) -> Self {
        value.map_or(Self::None, Self::Whole)
    }

    fn flag(value: bool) -> Self {
        Self::Whole(i64::from(value))
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Whole(value) if *value < 0 => write!(f, "−{}", value.unsigned_abs()),
            Self::Whole(value) => write!(f, "{value}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

static CRC: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// CRC-64/XZ over the numbers of every step, in the order of
/// [`Step::numbers`]. A number is a byte 1 and its 8 bytes, lowest first, in
/// two's complement; a name a byte 2, its letters, and a byte 0; none a byte
/// 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TraceHash(u64);

impl TraceHash {
    /// Takes in a step.
    pub fn add(&mut self, step: &Step) {
        let mut bytes = Vec::new();
        for (_, number) in step.numbers() {
            match number {
                Number::None => bytes.push(0),
                Number::Whole(value) => {
                    bytes.push(1);
                    bytes.extend(value.to_le_bytes());
                }
                Number::Name(name) => {
                    bytes.push(2);
                    bytes.extend(name.bytes());
                    bytes.push(0);
                }
            }
        }
        // The algorithm reflects the bits, and inverts at its start and end.
        let mut digest = CRC.digest_with_initial((!self.0).reverse_bits());
        digest.update(&bytes);
        self.0 = digest.finalize();
    }

    /// Takes in some steps.
    pub fn extend(&mut self, steps: &[Step]) {
        for step in steps {
            self.add(step);
        }
    }
}

impl fmt::Display for TraceHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// A number that is another on the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberPair {
    /// Its name.
    pub name: &'static str,
    /// On the chip.
    pub chip: Number,
    /// On the host, or in the file.
    pub wanted: Number,
}

impl NumberPair {
    /// Those that differ.
    fn differing(chip: Vec<Named>, wanted: Vec<Named>) -> Vec<Self> {
        chip.into_iter()
            .zip(wanted)
            .filter(|(chip, wanted)| chip != wanted)
            .map(|((name, chip), (_, wanted))| Self { name, chip, wanted })
            .collect()
    }
}

/// The first step of a case, or row of a file of vectors, at which a chip differs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Number of the step, k, or of the line, from 1; 0 of a whole run.
    pub at: u64,
    /// The place in words: "step 512 (0.512 s) of paper-2".
    pub place: String,
    /// The numbers that differ; none of a whole run, whose place has them.
    pub numbers: Vec<NumberPair>,
    /// The origin of the numbers that the chip's are held against: "here".
    pub other: &'static str,
}

/// "differs at step 3 (0.003 s) of paper-1: code −17 on the chip, −16 here; state
/// fault on the chip, moving here".
impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.numbers.is_empty() {
            return write!(f, "differs in {}", self.place);
        }
        write!(f, "differs at {}: ", self.place)?;
        for (place, NumberPair { name, chip, wanted }) in self.numbers.iter().enumerate() {
            let separator = if place == 0 { "" } else { "; " };
            write!(
                f,
                "{separator}{name} {chip} on the chip, {wanted} {}",
                self.other
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(tick: u64, dac_code: i32) -> Step {
        let measurement = Measurement {
            tick,
            position_counts: Steps::Whole(7),
            load_counts: None,
        };
        Step::new(measurement, Command::whole(tick, -1, dac_code))
    }

    /// The bytes as the documentation has them, through the library's own
    /// whole checksum.
    #[test]
    fn the_hash_is_that_of_the_documented_bytes() {
        let number = |value: i64| {
            let mut bytes = vec![1];
            bytes.extend(value.to_le_bytes());
            bytes
        };
        let mut bytes = Vec::new();
        for (tick, code) in [(0, 3), (1, -4)] {
            bytes.extend([number(tick), number(7)].concat());
            bytes.push(0);
            bytes.extend([number(code), number(-1), number(0)].concat());
            // No state, 3 numbers of the axis, 2 faults.
            bytes.extend([0; 1 + 3 + 16]);
        }
        let of = |steps: &[Step]| {
            let mut hash = TraceHash::default();
            hash.extend(steps);
            hash
        };
        let hash = of(&[step(0, 3), step(1, -4)]);
        assert_eq!(hash.to_string(), format!("{:016x}", CRC.checksum(&bytes)));
        // The contrast: any other code, or another order.
        assert_ne!(hash, of(&[step(0, 3), step(1, -5)]));
        assert_ne!(hash, of(&[step(1, -4), step(0, 3)]));
        // Check value of CRC-64/XZ in the catalogue.
        assert_eq!(CRC.checksum(b"123456789"), 0x995d_c9bb_df19_39fa);
    }
}
