//! Replays a file of vectors, line by line.

use firmware::{Axis, AxisState};

use super::row::{Wanted, given, wanted};
use super::settings::Settings;

/// Where a file and the axis part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Mismatch {
    /// Number of the line, from 1.
    pub(crate) line: usize,
    pub(crate) what: What,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum What {
    /// The line is neither a setting nor a row.
    Unreadable,
    /// The firmware refuses the settings.
    Settings,
    /// The axis refuses a request of the row.
    Request,
    /// The outputs are others.
    Outputs,
}

/// The number of rows in a file whose every row the axis gives.
pub(crate) fn replay(text: &str) -> Result<usize, Mismatch> {
    let mut settings = Settings::default();
    let mut running: Option<(Axis, AxisState)> = None;
    let mut changed = true;
    let mut rows = 0;
    for (line, content) in (1..).zip(text.lines()) {
        let fail = |what| Mismatch { line, what };
        let content = content.trim();
        if content.is_empty() || content.starts_with('#') {
            continue;
        }
        let Some((inputs, outputs)) = content.split_once('|') else {
            settings.set(content).ok_or(fail(What::Unreadable))?;
            changed = true;
            continue;
        };
        let mut given = given(inputs).ok_or(fail(What::Unreadable))?;
        let wanted = wanted(outputs).ok_or(fail(What::Unreadable))?;
        if changed {
            let axis = settings.axis().ok_or(fail(What::Settings))?;
            running = Some(match running {
                None => (axis, AxisState::start(&axis)),
                Some((_, mut state)) => {
                    state.gains_changed();
                    (axis, state)
                }
            });
            changed = false;
        }
        let (axis, state) = running.as_mut().ok_or(fail(What::Settings))?;
        for event in given.events() {
            axis.request(state, event)
                .map_err(|_| fail(What::Request))?;
        }
        let inputs = given.inputs;
        let output = axis.tick(state, &inputs, &mut given);
        if Wanted::of(output, state) != wanted {
            return Err(fail(What::Outputs));
        }
        rows += 1;
    }
    Ok(rows)
}
