//! One row: what goes into a sample, and what must come out of it.

use core::fmt;
use core::str::{FromStr, SplitWhitespace};

use firmware::Codes;
use firmware::axis::{AxisOutput, Inputs};
use firmware::faults::{Fault, FaultCause, FaultValues};
use firmware::reference::{Next, Observed, Setpoint, SetpointSource, Stretch};
use firmware::states::{Event, State};

/// Inputs of a sample. It is the source of setpoints of that sample too.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a> {
    /// A letter for each request before the sample, `-` for none.
    pub requests: &'a str,
    /// Readings of the hardware.
    pub inputs: Inputs,
    /// Answer of the source if it is asked.
    pub next: Next,
}

/// The letters of the requests.
const LETTERS: [(char, Event); 4] = [
    ('E', Event::Enable),
    ('S', Event::Start),
    ('D', Event::Disable),
    ('R', Event::Reset),
];

impl<'a> Given<'a> {
    /// The inputs of a row: all before the bar; `None` if that is anything else.
    pub fn read(text: &'a str) -> Option<Self> {
        let mut columns = Columns::of(text);
        let given = Self {
            requests: columns.requests()?,
            inputs: Inputs {
                tick: columns.number()?,
                motor_register: columns.number()?,
                load_register: columns.optional()?,
                emergency_stop: columns.flag()?,
                failed_transfers: columns.number()?,
            },
            next: columns.next()?,
        };
        columns.end()?;
        Some(given)
    }

    /// The requests, in their order.
    pub fn events(&self) -> impl Iterator<Item = Event> {
        let letters = self.requests.chars().filter(|letter| *letter != '-');
        letters.filter_map(|letter| {
            let known = LETTERS.iter().find(|(known, _)| *known == letter);
            known.map(|(_, event)| *event)
        })
    }
}

impl SetpointSource for Given<'_> {
    fn next(&mut self, _: &Observed) -> Next {
        self.next
    }
}

/// Outputs that it must give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// Of the sample.
    pub output: AxisOutput,
    /// The fault that is latched after it.
    pub fault: Option<Fault>,
}

impl Wanted {
    /// The outputs of a row: all behind the bar; `None` if that is anything
    /// else.
    pub fn read(text: &str) -> Option<Self> {
        let mut columns = Columns::of(text);
        let wanted = Self {
            output: AxisOutput {
                code: columns.number()?,
                error_counts: columns.number()?,
                state: {
                    let name = columns.name()?;
                    State::ALL.into_iter().find(|state| state.name() == name)?
                },
                power: columns.flag()?,
                out_of_range: columns.flag()?,
            },
            fault: columns.fault()?,
        };
        columns.end()?;
        Some(wanted)
    }
}

/// The columns of a row, or the values of a setting, from left to right.
pub(super) struct Columns<'a>(SplitWhitespace<'a>);

impl<'a> Columns<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        Self(text.split_whitespace())
    }

    pub(super) fn name(&mut self) -> Option<&'a str> {
        self.0.next()
    }

    pub(super) fn number<T: FromStr>(&mut self) -> Option<T> {
        self.name()?.parse().ok()
    }

    /// A number, or `-` for none.
    pub(super) fn optional<T: FromStr>(&mut self) -> Option<Option<T>> {
        match self.name()? {
            "-" => Some(None),
            number => number.parse().ok().map(Some),
        }
    }

    fn flag(&mut self) -> Option<bool> {
        match self.name()? {
            "0" => Some(false),
            "1" => Some(true),
            _ => None,
        }
    }

    /// Letters that are known, or `-`.
    fn requests(&mut self) -> Option<&'a str> {
        let known = |letter| LETTERS.iter().any(|(known, _)| *known == letter);
        let requests = self.name()?;
        (requests == "-" || requests.chars().all(known)).then_some(requests)
    }

    fn next(&mut self) -> Option<Next> {
        let kind = self.name()?;
        if kind == "none" {
            return Some(Next::Underrun);
        }
        if kind == "stretch" {
            let mut words = [0; Stretch::WORDS];
            for word in &mut words {
                *word = self.number()?;
            }
            return Some(Next::Stretch(Stretch::from_words(&words)));
        }
        let mut setpoint = Setpoint {
            position: self.number()?,
            velocity: self.number()?,
            acceleration: self.number()?,
            ahead: None,
        };
        match kind {
            "next" => Some(Next::Setpoint(setpoint)),
            "last" => Some(Next::Last(setpoint)),
            "ahead" => {
                setpoint.ahead = Some(Codes::from_bits(self.number()?));
                Some(Next::Setpoint(setpoint))
            }
            _ => None,
        }
    }

    /// The fault that is latched, or none.
    fn fault(&mut self) -> Option<Option<Fault>> {
        let name = self.name()?;
        if name == "-" {
            return Some(None);
        }
        let mut causes = FaultCause::ALL.into_iter();
        Some(Some(Fault {
            cause: causes.find(|cause| cause.name() == name)?,
            tick: self.number()?,
            values: FaultValues {
                setpoint: self.number()?,
                position: self.number()?,
                error: self.number()?,
                code: self.number()?,
                measured: self.number()?,
                limit: self.number()?,
            },
        }))
    }

    /// `Some` if nothing is left.
    pub(super) fn end(mut self) -> Option<()> {
        self.0.next().is_none().then_some(())
    }
}

impl fmt::Display for Given<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inputs = &self.inputs;
        let (tick, motor_register) = (inputs.tick, inputs.motor_register);
        write!(f, "{} {tick} {motor_register} ", self.requests)?;
        match inputs.load_register {
            Some(register) => write!(f, "{register}")?,
            None => f.write_str("-")?,
        }
        let (stop, failed_transfers) = (u8::from(inputs.emergency_stop), inputs.failed_transfers);
        write!(f, " {stop} {failed_transfers} ")?;
        let (kind, setpoint) = match self.next {
            Next::Setpoint(setpoint) => ("next", setpoint),
            Next::Last(setpoint) => ("last", setpoint),
            Next::Underrun => return f.write_str("none"),
            Next::Stretch(stretch) => {
                f.write_str("stretch")?;
                return numbers(f, &stretch.to_words());
            }
        };
        // The end of a motion has none.
        let ahead = setpoint.ahead.filter(|_| kind == "next");
        f.write_str(if ahead.is_some() { "ahead" } else { kind })?;
        let rated = [setpoint.position, setpoint.velocity, setpoint.acceleration];
        numbers(f, &rated)?;
        ahead.map_or(Ok(()), |ahead| numbers(f, &[ahead.to_bits()]))
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let output = &self.output;
        let (code, error, state) = (output.code, output.error_counts, output.state.name());
        let [power, range] = [output.power, output.out_of_range].map(u8::from);
        write!(f, "{code} {error} {state} {power} {range} ")?;
        let Some(Fault {
            cause,
            tick,
            values,
        }) = &self.fault
        else {
            return f.write_str("-");
        };
        write!(f, "{} {tick}", cause.name())?;
        let of_sample = [values.setpoint, values.position, values.error, values.code];
        numbers(f, &of_sample)?;
        numbers(f, &[values.measured, values.limit])
    }
}

/// Writes columns of numbers, each behind a space.
fn numbers(f: &mut fmt::Formatter<'_>, numbers: &[impl fmt::Display]) -> fmt::Result {
    numbers.iter().try_for_each(|number| write!(f, " {number}"))
}
