//! Lines cut at the edge of a plot, and into dashes.

use super::canvas::{Area, Point};

/// Lines of fewer points stay as they are.
const MANY: usize = 2_000;
/// Width of a column in which points cannot be told apart \[px\].
const COLUMN: f64 = 0.5;

/// The parts of a line that lie in an area (Liang and Barsky, piece by piece).
pub(super) fn clipped(points: &[Point], area: &Area) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut part: Vec<Point> = Vec::new();
    for pair in points.windows(2) {
        let &[from, to] = pair else { continue };
        match inside(from, to, area) {
            Some((start, end)) => {
                if part.last() != Some(&start) {
                    parts.push(std::mem::take(&mut part));
                    part.push(start);
                }
                part.push(end);
            }
            None => parts.push(std::mem::take(&mut part)),
        }
    }
    parts.push(part);
    parts.retain(|part| part.len() > 1);
    parts
}

/// The piece of a straight line in an area.
fn inside(from: Point, to: Point, area: &Area) -> Option<(Point, Point)> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    if !(dx.is_finite() && dy.is_finite()) {
        return None;
    }
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (step, room) in [
        (-dx, from.0 - area.left),
        (dx, area.right - from.0),
        (-dy, from.1 - area.top),
        (dy, area.bottom - from.1),
    ] {
        if step == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if step < 0.0 {
            enter = enter.max(room / step);
        } else {
            leave = leave.min(room / step);
        }
    }
    if enter > leave {
        return None;
    }
    // The ends themselves stay as they are, so that pieces join.
    let at = |share: f64| match share {
        0.0 => from,
        1.0 => to,
        _ => (from.0 + share * dx, from.1 + share * dy),
    };
    Some((at(enter), at(leave)))
}

/// A line without the points that nobody can see: of those in one column of
/// the sheet the first, the lowest, the highest and the last stay.
pub(super) fn thinned(points: Vec<Point>) -> Vec<Point> {
    if points.len() < MANY {
        return points;
    }
    let column = |point: &Point| (point.0 / COLUMN).floor();
    let columns = points.chunk_by(|a, b| column(a) == column(b));
    let mut kept: Vec<Point> = Vec::new();
    for part in columns {
        let mut ends = [0, part.len() - 1, 0, 0];
        for (at, point) in part.iter().enumerate() {
            if point.1 < part[ends[2]].1 {
                ends[2] = at;
            }
            if point.1 > part[ends[3]].1 {
                ends[3] = at;
            }
        }
        ends.sort_unstable();
        let mut last = None;
        for at in ends {
            if last != Some(at) {
                kept.push(part[at]);
            }
            last = Some(at);
        }
    }
    kept
}

/// A line cut into dashes: `pattern` is drawn and left out by turns \[px\].
pub(super) fn dashes(points: &[Point], pattern: &[f64]) -> Vec<Vec<Point>> {
    let mut found: Vec<Vec<Point>> = Vec::new();
    let mut turns = pattern.iter().copied().cycle();
    let (mut drawn, mut left) = (true, turns.next().unwrap_or(f64::INFINITY));
    let mut dash: Vec<Point> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let &[from, to] = pair else { continue };
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = (dx * dx + dy * dy).sqrt();
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (from.0 + dx * done / length, from.1 + dy * done / length);
            if drawn {
                dash.push(at);
                found.push(std::mem::take(&mut dash));
            } else {
                dash = vec![at];
            }
            drawn = !drawn;
            left = turns.next().unwrap_or(f64::INFINITY);
        }
        left -= length - done;
        if drawn {
            dash.push(to);
        }
    }
    if drawn {
        found.push(dash);
    }
    found.retain(|dash| dash.len() > 1);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area {
        left: 0.0,
        top: 0.0,
        right: 10.0,
        bottom: 10.0,
    };

    #[test]
    fn lines_end_at_the_edge() {
        let through = [(-5.0, 5.0), (15.0, 5.0)];
        assert_eq!(clipped(&through, &AREA), [[(0.0, 5.0), (10.0, 5.0)]]);
        let past = [(-5.0, 12.0), (15.0, 12.0)];
        assert!(clipped(&past, &AREA).is_empty());
        let out_and_in = [(5.0, 5.0), (5.0, 15.0), (8.0, 15.0), (8.0, 5.0)];
        let found = clipped(&out_and_in, &AREA);
        assert_eq!(
            found,
            [[(5.0, 5.0), (5.0, 10.0)], [(8.0, 10.0), (8.0, 5.0)]]
        );
    }

    #[test]
    fn lines_inside_stay_whole() {
        let inside = [(1.0, 1.0), (2.0, 5.0), (9.0, 3.0)];
        assert_eq!(clipped(&inside, &AREA), [inside.to_vec()]);
        assert!(clipped(&[(1.0, f64::NAN), (2.0, 3.0)], &AREA).is_empty());
        assert!(clipped(&[], &AREA).is_empty());
    }

    /// A noisy line of 10⁵ points keeps its outline in every column.
    #[test]
    fn lines_of_many_points_keep_their_outline() {
        let noise = |i: u32| (f64::from(i) * 0.618_034).fract();
        let line = |count: u32| -> Vec<Point> {
            let place = |i: u32| 500.0 * f64::from(i) / f64::from(count);
            (0..count).map(|i| (place(i), noise(i))).collect()
        };
        let whole = line(100_000);
        let thin = thinned(whole.clone());
        assert!(thin.len() <= 4_000, "{}", thin.len());
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0));
        for column in 0..1000 {
            let inside = |point: &&Point| (point.0 / COLUMN).floor() == f64::from(column);
            let extent = |points: &[Point]| {
                let heights = points.iter().filter(inside).map(|point| point.1);
                heights.fold((f64::MAX, f64::MIN), |(low, high), y| {
                    (low.min(y), high.max(y))
                })
            };
            assert_eq!(extent(&thin), extent(&whole), "{column}");
        }
        assert_eq!(thinned(line(1_000)), line(1_000));
    }

    #[test]
    fn dashes_go_round_corners() {
        let corner = [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0)];
        assert_eq!(
            dashes(&corner, &[4.0, 1.0]),
            [
                vec![(0.0, 0.0), (4.0, 0.0)],
                vec![(5.0, 0.0), (6.0, 0.0), (6.0, 3.0)],
                vec![(6.0, 4.0), (6.0, 6.0)],
            ]
        );
    }
}
