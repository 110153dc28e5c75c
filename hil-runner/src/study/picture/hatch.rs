//! Fields without a value: grey, and hatched by what happened there.

use super::canvas::{Area, Canvas, Stroke};
use super::clip::clipped;
use super::colour::{MUTED, NO_VALUE};

/// Lines over a grey field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hatch {
    /// None.
    Plain,
    /// Rising to the right.
    Rising,
    /// Falling to the right.
    Falling,
    /// Both.
    Crossed,
}

/// Distance of two lines along x \[px\].
const PITCH: f64 = 7.0;

impl Hatch {
    /// The hatch of the n-th state, so that no two of the first four are alike.
    pub(super) fn of(index: usize) -> Self {
        const HATCHES: [Hatch; 4] = [Hatch::Rising, Hatch::Falling, Hatch::Crossed, Hatch::Plain];
        HATCHES[index % HATCHES.len()]
    }

    /// Fills an area; lines of neighbours meet.
    pub(super) fn draw(self, canvas: &mut Canvas, area: &Area) {
        canvas.fill(area, NO_VALUE);
        let slopes: &[f64] = match self {
            Self::Plain => &[],
            Self::Rising => &[-1.0],
            Self::Falling => &[1.0],
            Self::Crossed => &[-1.0, 1.0],
        };
        let stroke = Stroke::solid(MUTED, 0.9);
        for slope in slopes {
            // Lines x − slope·y = k·pitch, k whole: the same for every area.
            let ends = [area.top, area.bottom].map(|y| -slope * y);
            let low = area.left + ends[0].min(ends[1]);
            let high = area.right + ends[0].max(ends[1]);
            let mut k = (low / PITCH).ceil();
            while k * PITCH <= high {
                let at = |y: f64| (k * PITCH + slope * y, y);
                for part in clipped(&[at(area.top), at(area.bottom)], area) {
                    canvas.path(&part, &stroke);
                }
                k += 1.0;
            }
        }
    }
}
