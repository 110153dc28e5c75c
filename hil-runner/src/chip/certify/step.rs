//! A step as the numbers that are compared, their hash, and the words for where
//! chip and host part.

use core::fmt;

use crc::{CRC_64_XZ, Crc};
use firmware::Fault;

use hil_core::case::Case;
use hil_core::message::{Command, Measurement, Steps};
use hil_core::time::seconds;

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
    pub fn new(measurement: Measurement, command: Command) -> Self {
        let command = Command {
            execution: None,
            ..command
        };
        Self {
            measurement,
            command,
        }
    }

    /// Number of the sample, k.
    pub fn tick(&self) -> u64 {
        self.measurement.tick
    }

    /// Everything that is compared: the sample, what the encoders show, what
    /// the controller answers, what the axis reports, and the fault that is
    /// latched and the first of the run, 8 numbers each.
    pub fn numbers(&self) -> Vec<Named> {
        let Self {
            measurement,
            command,
        } = self;
        let axis = command.axis.as_ref();
        let steps = |steps: Steps| Number::Whole(steps.whole());
        let of_axis = |value: Option<u32>| Number::of(value.map(i64::from));
        let mut numbers = vec![
            ("sample", Number::Whole(command.tick.cast_signed())),
            ("count", steps(measurement.position_counts)),
            ("count of the load", Number::of(measurement.load_counts)),
            ("code", steps(command.dac_code)),
            ("error", steps(command.error_counts)),
            ("out of range", Number::flag(command.out_of_range)),
            ("state", Number::name(axis.map(|axis| axis.state.name()))),
            ("faults", of_axis(axis.map(|axis| axis.faults))),
            (
                "refused requests",
                of_axis(axis.map(|axis| axis.refused_requests)),
            ),
            (
                "peak error",
                of_axis(axis.map(|axis| axis.peak_error_counts)),
            ),
        ];
        let latched = fault_numbers(axis.and_then(|axis| axis.fault));
        let first = fault_numbers(axis.and_then(|axis| axis.first_fault));
        numbers.extend(FAULT.into_iter().zip(latched));
        numbers.extend(FIRST_FAULT.into_iter().zip(first));
        numbers
    }
}

/// Names of the numbers of a fault.
pub(super) const FAULT: [&str; 8] = [
    "fault",
    "sample of the fault",
    "setpoint at the fault",
    "position at the fault",
    "error at the fault",
    "code at the fault",
    "measured at the fault",
    "limit of the fault",
];

const FIRST_FAULT: [&str; 8] = [
    "first fault",
    "sample of the first fault",
    "setpoint at the first fault",
    "position at the first fault",
    "error at the first fault",
    "code at the first fault",
    "measured at the first fault",
    "limit of the first fault",
];

/// The numbers of a fault.
pub(super) fn fault_numbers(fault: Option<Fault>) -> [Number; 8] {
    let Some(Fault {
        cause,
        tick,
        values,
    }) = fault
    else {
        return [Number::None; 8];
    };
    [
        Number::Name(cause.name()),
        Number::Whole(tick.cast_signed()),
        Number::Whole(values.setpoint.into()),
        Number::Whole(values.position.into()),
        Number::Whole(values.error.into()),
        Number::Whole(values.code.into()),
        Number::Whole(values.measured),
        Number::Whole(values.limit),
    ]
}

impl Number {
    pub(super) fn of(value: Option<i64>) -> Self {
        value.map_or(Self::None, Self::Whole)
    }

    pub(super) fn flag(value: bool) -> Self {
        Self::Whole(i64::from(value))
    }

    fn name(name: Option<&'static str>) -> Self {
        name.map_or(Self::None, Self::Name)
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

    /// The hash of some steps.
    pub fn of(steps: &[Step]) -> Self {
        let mut hash = Self::default();
        hash.extend(steps);
        hash
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
    pub(super) fn differing(chip: Vec<Named>, wanted: Vec<Named>) -> Vec<Self> {
        chip.into_iter()
            .zip(wanted)
            .filter(|(chip, wanted)| chip != wanted)
            .map(|((name, chip), (_, wanted))| Self { name, chip, wanted })
            .collect()
    }
}

/// The first step of a case at which a chip differs from the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Name of the case.
    pub case: String,
    /// Number of the step, k.
    pub tick: u64,
    /// Its time \[s\].
    pub time_s: f64,
    /// The numbers that differ, at least one.
    pub numbers: Vec<NumberPair>,
}

impl Difference {
    /// Between the same step of host and chip; `None` if there is none.
    pub(super) fn between(case: &Case, host: &Step, chip: &Step) -> Option<Self> {
        let numbers = NumberPair::differing(chip.numbers(), host.numbers());
        let period_ns = case.controller.sample_time_ns.unwrap_or(0);
        (!numbers.is_empty()).then(|| Self {
            case: case.name.clone(),
            tick: host.tick(),
            time_s: seconds(host.tick().saturating_mul(period_ns)),
            numbers,
        })
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            case, tick, time_s, ..
        } = self;
        write!(f, "differs at step {tick} ({time_s} s) of {case}: ")?;
        write_pairs(f, &self.numbers, "here")
    }
}

/// The first row of a file of vectors that a chip answers otherwise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowDifference {
    /// Name of the file.
    pub file: String,
    /// Number of the line, from 1.
    pub line: usize,
    /// The numbers that differ, at least one.
    pub numbers: Vec<NumberPair>,
}

impl fmt::Display for RowDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "differs at line {} of {}: ", self.line, self.file)?;
        write_pairs(f, &self.numbers, "in the file")
    }
}

/// "code −17 on the chip, −16 here; state fault on the chip, moving here".
fn write_pairs(f: &mut fmt::Formatter<'_>, pairs: &[NumberPair], there: &str) -> fmt::Result {
    for (place, NumberPair { name, chip, wanted }) in pairs.iter().enumerate() {
        let separator = if place == 0 { "" } else { "; " };
        write!(f, "{separator}{name} {chip} on the chip, {wanted} {there}")?;
    }
    Ok(())
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
        let hash = TraceHash::of(&[step(0, 3), step(1, -4)]);
        assert_eq!(hash.to_string(), format!("{:016x}", CRC.checksum(&bytes)));
        // The contrast: any other code, or another order.
        assert_ne!(hash, TraceHash::of(&[step(0, 3), step(1, -5)]));
        assert_ne!(hash, TraceHash::of(&[step(1, -4), step(0, 3)]));
        // Check value of CRC-64/XZ in the catalogue.
        assert_eq!(CRC.checksum(b"123456789"), 0x995d_c9bb_df19_39fa);
    }
}
