//! The firmware's golden vectors, replayed at the end of a line.

use std::io;

use firmware::Axis;
use firmware_link::vectors::{ALL, File, Mismatch, Row, What, rows};
use firmware_link::{Events, SourceKind, Step, Stepped};

use super::{Comparison, Difference, LATCHED, Named, Number, NumberPair, fault_numbers};
use crate::chip::chip_law::give_settings;
use crate::chip::client::Client;
use crate::chip::line::ChipError;

/// A file of vectors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VectorFile {
    /// Its name.
    pub name: String,
    /// Its contents.
    pub text: String,
}

/// The files of the source tree that this program was built from, by name.
pub fn stored() -> Vec<VectorFile> {
    let file = |(name, text): File| VectorFile {
        name: name.into(),
        text: text.into(),
    };
    ALL.map(file).into()
}

/// Gives the chip the axis of a file and its rows, one after another, until it
/// answers one otherwise. `on_row` is called before each.
///
/// # Errors
/// [`ChipError`] if the file cannot be read, the chip does not answer, or `on_row`
/// ends it.
pub fn replay(
    client: &mut Client,
    file: &VectorFile,
    on_row: &mut dyn FnMut() -> io::Result<()>,
) -> Result<Comparison, ChipError> {
    let name = &file.name;
    let unreadable = |mismatch: Mismatch| ChipError(format!("{name}, {mismatch}"));
    let mut axis = None;
    let mut replayed = Comparison::default();
    for row in rows(&file.text) {
        let row = row.map_err(unreadable)?;
        let line = row.line;
        on_row().map_err(|error| ChipError(error.to_string()))?;
        let what = What::Unreadable;
        let events = events(&row).ok_or_else(|| unreadable(Mismatch { line, what }))?;
        let stepped = step(client, &mut axis, &row, events)
            .map_err(|error| ChipError(format!("at line {line} of {name}: {error}")))?;
        replayed.compared += 1;
        let numbers = NumberPair::differing(numbers(&stepped), numbers(&wanted(&row)));
        if !numbers.is_empty() {
            replayed.difference = Some(Difference {
                at: line as u64,
                place: format!("line {line} of {name}"),
                numbers,
                other: "in the file",
            });
            break;
        }
    }
    Ok(replayed)
}

/// The requests of a row as the set that goes over the line; `None` if they
/// stand in another order there.
fn events(row: &Row<'_>) -> Option<Events> {
    let mut events = Events::default();
    for event in row.given.events() {
        events.insert(event);
    }
    events.iter().eq(row.given.events()).then_some(events)
}

/// One row: first the axis, where it is another.
fn step(
    client: &mut Client,
    axis: &mut Option<Axis>,
    row: &Row<'_>,
    events: Events,
) -> Result<Stepped, ChipError> {
    if let Some(other) = row.axis {
        if axis.is_none() {
            client.begin_session()?;
        }
        give_settings(client, &other)?;
        if axis.is_none() {
            client.begin(SourceKind::Step, Events::default())?;
        }
        *axis = Some(other);
    }
    client.step(Step {
        events,
        inputs: row.given.inputs,
        motor_unread: false,
        next: row.given.next,
    })
}

/// The answer that a row asks for: its file has every request as one that the state
/// allows.
fn wanted(row: &Row<'_>) -> Stepped {
    let output = row.wanted.output;
    Stepped {
        code: output.code,
        error_counts: output.error_counts,
        state: output.state,
        power: output.power,
        out_of_range: output.out_of_range,
        fault: row.wanted.fault,
        ..Stepped::default()
    }
}

/// All numbers of an answer that are compared.
fn numbers(stepped: &Stepped) -> Vec<Named> {
    let refused = stepped.refused.iter().count();
    let mut numbers = vec![
        ("code", Number::Whole(stepped.code.into())),
        ("error", Number::Whole(stepped.error_counts.into())),
        ("out of range", Number::flag(stepped.out_of_range)),
        ("state", Number::Name(stepped.state.name())),
        ("power", Number::flag(stepped.power)),
        ("refused requests", Number::of(i64::try_from(refused).ok())),
    ];
    numbers.extend(fault_numbers(stepped.fault, LATCHED));
    numbers
}
