//! How far the rungs of a point are from one another: what each of them costs.

use super::cell::Cell;
use hil_core::case::Case;
use hil_core::ladder;
use hil_core::record::GridPoint;

/// Names of the columns.
pub(super) const COLUMNS: [&str; 2] = ["rms_acc_change_mps2", "rms_position_change_um"];

/// Compares every run with that of the rung before it at the same point, as
/// `hil-runner ladder` does. `places` has, for each row in order, the number of
/// its rung and the place of its case; `each` gets places and cells.
pub(super) fn find<'a>(
    cases: &[Case],
    places: impl Iterator<Item = (usize, Option<&'a usize>)>,
    mut each: impl FnMut(usize, [Cell; 2]),
) {
    let mut below: Option<Vec<GridPoint>> = None;
    for (rung, place) in places {
        // A run that fails says so in its own row.
        let here = place.and_then(|place| ladder::grid(&cases[*place]).ok());
        if let (Some(place), Some(here), Some(below), 1..) = (place, &here, &below, rung) {
            let difference = ladder::difference(here, below);
            each(
                *place,
                [difference.rms_acc_mps2, difference.rms_position_um].map(Cell::number),
            );
        }
        below = here;
    }
}
