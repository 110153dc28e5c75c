//! Replays a file of vectors on the axis of this very program.

use super::row::Wanted;
use super::rows::{Mismatch, Row, What, rows};
use firmware::axis::{Axis, AxisState};

/// The number of rows in a file whose every row the axis gives.
///
/// # Errors
/// [`Mismatch`] with the first line where file and axis part.
pub fn replay(text: &str) -> Result<usize, Mismatch> {
    let mut running: Option<(Axis, AxisState)> = None;
    let mut count: usize = 0;
    for row in rows(text) {
        let row = row?;
        if let Some(axis) = row.axis {
            running = Some(match running {
                None => (axis, AxisState::start(&axis)),
                Some((_, mut state)) => {
                    state.gains_changed();
                    (axis, state)
                }
            });
        }
        let line = row.line;
        let fail = |what| Mismatch { line, what };
        let (axis, state) = running.as_mut().ok_or(fail(What::Settings))?;
        sample(axis, state, &row).map_err(fail)?;
        count = count.saturating_add(1);
    }
    Ok(count)
}

fn sample(axis: &Axis, state: &mut AxisState, row: &Row<'_>) -> Result<(), What> {
    let mut given = row.given;
    for event in given.events() {
        axis.request(state, event).map_err(|_| What::Request)?;
    }
    let output = axis.tick(state, &row.given.inputs, &mut given);
    let gave = Wanted {
        output,
        fault: state.fault().copied(),
    };
    if gave == row.wanted {
        Ok(())
    } else {
        Err(What::Outputs)
    }
}
