//! One row: what goes into a sample, and what must come out of it.

use core::fmt;
use core::str::{FromStr, SplitWhitespace};

use firmware::{
    AxisOutput, AxisState, Event, Fault, FaultCause, FaultValues, Inputs, Next, Observed, Setpoint,
    SetpointSource, State,
};

/// What goes into a sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Given<'a> {
    /// A letter for each request before the sample, `-` for none.
    pub(crate) requests: &'a str,
    pub(crate) inputs: Inputs,
    /// What the source has if it is asked.
    pub(crate) next: Next,
}

/// The letters of the requests.
const LETTERS: [(char, Event); 4] = [
    ('E', Event::Enable),
    ('S', Event::Start),
    ('D', Event::Disable),
    ('R', Event::Reset),
];

impl Given<'_> {
    /// The requests, in their order.
    pub(crate) fn events(&self) -> impl Iterator<Item = Event> {
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

/// What comes out of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wanted {
    output: AxisOutput,
    fault: Option<Fault>,
}

impl Wanted {
    pub(crate) fn of(output: AxisOutput, state: &AxisState) -> Self {
        Self {
            output,
            fault: state.fault().copied(),
        }
    }
}

/// The columns of a row from left to right.
struct Columns<'a>(SplitWhitespace<'a>);

impl<'a> Columns<'a> {
    fn name(&mut self) -> Option<&'a str> {
        self.0.next()
    }

    fn number<T: FromStr>(&mut self) -> Option<T> {
        self.name()?.parse().ok()
    }

    fn flag(&mut self) -> Option<bool> {
        Some(self.number::<u8>()? == 1)
    }

    fn next(&mut self) -> Option<Next> {
        let kind = self.name()?;
        if kind == "none" {
            return Some(Next::Underrun);
        }
        let setpoint = Setpoint {
            position: self.number()?,
            velocity: self.number()?,
            acceleration: self.number()?,
        };
        match kind {
            "next" => Some(Next::Setpoint(setpoint)),
            "last" => Some(Next::Last(setpoint)),
            _ => None,
        }
    }
}

/// The inputs of a row: all before the bar.
pub(crate) fn given(text: &str) -> Option<Given<'_>> {
    let mut columns = Columns(text.split_whitespace());
    let requests = columns.name()?;
    let inputs = Inputs {
        tick: columns.number()?,
        motor_register: columns.number()?,
        load_register: match columns.name()? {
            "-" => None,
            register => Some(register.parse().ok()?),
        },
        emergency_stop: columns.flag()?,
        failed_transfers: columns.number()?,
    };
    let next = columns.next()?;
    let given = Given {
        requests,
        inputs,
        next,
    };
    columns.0.next().is_none().then_some(given)
}

/// The outputs of a row: all behind the bar.
pub(crate) fn wanted(text: &str) -> Option<Wanted> {
    let mut columns = Columns(text.split_whitespace());
    let output = AxisOutput {
        code: columns.number()?,
        error_counts: columns.number()?,
        state: {
            let name = columns.name()?;
            State::ALL.into_iter().find(|state| state.name() == name)?
        },
        power: columns.flag()?,
        out_of_range: columns.flag()?,
    };
    let fault = match columns.name()? {
        "-" => None,
        name => Some(Fault {
            cause: FaultCause::ALL
                .into_iter()
                .find(|cause| cause.name() == name)?,
            tick: columns.number()?,
            values: FaultValues {
                setpoint: columns.number()?,
                position: columns.number()?,
                error: columns.number()?,
                code: columns.number()?,
                measured: columns.number()?,
                limit: columns.number()?,
            },
        }),
    };
    let wanted = Wanted { output, fault };
    columns.0.next().is_none().then_some(wanted)
}

impl fmt::Display for Given<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inputs {
            tick,
            motor_register,
            load_register,
            emergency_stop,
            failed_transfers,
        } = self.inputs;
        write!(f, "{} {tick} {motor_register} ", self.requests)?;
        match load_register {
            Some(register) => write!(f, "{register}")?,
            None => f.write_str("-")?,
        }
        write!(f, " {} {failed_transfers} ", u8::from(emergency_stop))?;
        let (kind, setpoint) = match self.next {
            Next::Setpoint(setpoint) => ("next", setpoint),
            Next::Last(setpoint) => ("last", setpoint),
            Next::Underrun => return f.write_str("none"),
        };
        let Setpoint {
            position,
            velocity,
            acceleration,
        } = setpoint;
        write!(f, "{kind} {position} {velocity} {acceleration}")
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let AxisOutput {
            code,
            error_counts,
            state,
            power,
            out_of_range,
        } = self.output;
        let (power, range) = (u8::from(power), u8::from(out_of_range));
        write!(f, "{code} {error_counts} {} {power} {range} ", state.name())?;
        let Some(Fault {
            cause,
            tick,
            values,
        }) = self.fault
        else {
            return f.write_str("-");
        };
        let FaultValues {
            setpoint,
            position,
            error,
            code,
            measured,
            limit,
        } = values;
        write!(
            f,
            "{} {tick} {setpoint} {position} {error} {code} {measured} {limit}",
            cause.name()
        )
    }
}
