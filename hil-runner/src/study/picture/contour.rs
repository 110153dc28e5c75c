//! Contour lines by marching squares (Lorensen and Cline 1987, in two
//! dimensions), on the centres of the cells.

use std::collections::BTreeMap;

/// A point on the plane.
pub(super) type Point = (f64, f64);

/// Values on a grid of points, row by row.
pub(in crate::study) struct Field<'a> {
    /// Places along x, one per column of the grid.
    pub(in crate::study) x: &'a [f64],
    /// Places along y, one per row of the grid.
    pub(in crate::study) y: &'a [f64],
    /// Values; squares with one missing have no line.
    pub(in crate::study) values: &'a [Option<f64>],
}

/// An edge of the grid, by its first point: along x or along y from there.
type Edge = (usize, usize, bool);

impl Field<'_> {
    fn value(&self, i: usize, j: usize) -> Option<f64> {
        self.values.get(j * self.x.len() + i).copied().flatten()
    }

    /// The lines on which the field has that level.
    pub(in crate::study) fn lines(&self, level: f64) -> Vec<Vec<Point>> {
        let mut joints: BTreeMap<Edge, Vec<Edge>> = BTreeMap::new();
        for j in 1..self.y.len() {
            for i in 1..self.x.len() {
                for [a, b] in self.square(i - 1, j - 1, level) {
                    joints.entry(a).or_default().push(b);
                    joints.entry(b).or_default().push(a);
                }
            }
        }
        let point = |edge: &Edge| self.crossing(*edge, level);
        let line = |chain: &Vec<Edge>| chain.iter().filter_map(point).collect();
        chains(joints).iter().map(line).collect()
    }

    /// The pieces of a line in the square whose corner is (i, j): pairs of
    /// edges of the square.
    fn square(&self, i: usize, j: usize, level: f64) -> Vec<[Edge; 2]> {
        let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|(i, j)| self.value(i, j)) else {
            return Vec::new();
        };
        let (below, right) = ((i, j, true), (i + 1, j, false));
        let (above, left) = ((i, j + 1, true), (i, j, false));
        let edges = [below, right, above, left];
        let inside = [a, b, c, d].map(|corner| corner >= level);
        // An edge is crossed where its ends lie on either side.
        let crossed = (0..4).filter(|&at| inside[at] != inside[(at + 1) % 4]);
        let crossed: Vec<Edge> = crossed.map(|at| edges[at]).collect();
        match crossed[..] {
            [one, other] => vec![[one, other]],
            [] => Vec::new(),
            // A saddle joins the corners that its middle is with.
            _ if inside[0] == (0.25 * (a + b + c + d) >= level) => {
                vec![[left, above], [below, right]]
            }
            _ => vec![[left, below], [above, right]],
        }
    }

    /// The point of an edge at the level, by the straight line between its ends.
    fn crossing(&self, (i, j, along_x): Edge, level: f64) -> Option<Point> {
        let (p, q) = if along_x { (i + 1, j) } else { (i, j + 1) };
        let (from, to) = (self.value(i, j)?, self.value(p, q)?);
        let share = (level - from) / (to - from);
        let between = |a: f64, b: f64| a + share * (b - a);
        Some((between(self.x[i], self.x[p]), between(self.y[j], self.y[q])))
    }
}

/// Follows the joints from edge to edge: open lines from their ends, then
/// closed ones.
fn chains(mut joints: BTreeMap<Edge, Vec<Edge>>) -> Vec<Vec<Edge>> {
    let mut found = Vec::new();
    let ends = |joints: &BTreeMap<Edge, Vec<Edge>>| {
        let single = joints.iter().find(|(_, others)| others.len() == 1);
        single.or(joints.iter().next()).map(|(edge, _)| *edge)
    };
    while let Some(start) = ends(&joints) {
        let mut chain = vec![start];
        let mut at = start;
        while let Some(next) = joints.get_mut(&at).and_then(Vec::pop) {
            if let Some(back) = joints.get_mut(&next)
                && let Some(here) = back.iter().position(|edge| *edge == at)
            {
                back.remove(here);
            }
            if joints.get(&at).is_some_and(Vec::is_empty) {
                joints.remove(&at);
            }
            chain.push(next);
            at = next;
        }
        joints.remove(&at);
        if chain.len() > 1 {
            found.push(chain);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(count: u32) -> Vec<f64> {
        (0..count).map(f64::from).collect()
    }

    fn field<'a>(x: &'a [f64], y: &'a [f64], values: &'a [Option<f64>]) -> Field<'a> {
        Field { x, y, values }
    }

    /// A cone: its contour is a circle, closed, of the right radius.
    #[test]
    fn a_cone_has_circles() {
        let at = places(41);
        let radius = |x: f64, y: f64| ((x - 20.0).powi(2) + (y - 20.0).powi(2)).sqrt();
        let values: Vec<Option<f64>> = at
            .iter()
            .flat_map(|&y| at.iter().map(move |&x| Some(radius(x, y))))
            .collect();
        let field = field(&at, &at, &values);
        let lines = field.lines(12.3);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        // A chord of a square of side 1 is off by no more than 1/(8·r).
        let bound = 1.0 / (8.0 * 12.3) + 1e-9;
        for &(x, y) in &lines[0] {
            assert!((radius(x, y) - 12.3).abs() < bound);
        }
        // The contrast: another level is outside that bound.
        assert!(
            field.lines(13.0)[0]
                .iter()
                .all(|&(x, y)| (radius(x, y) - 12.3).abs() > bound)
        );
        assert!(field.lines(100.0).is_empty());
    }

    #[test]
    fn a_slope_has_one_open_line_per_level() {
        let (x, y) = (places(5), places(3));
        let values: Vec<Option<f64>> = (0..15).map(|at| Some(f64::from(at % 5))).collect();
        let field = field(&x, &y, &values);
        assert_eq!(field.lines(2.5), [vec![(2.5, 0.0), (2.5, 1.0), (2.5, 2.0)]]);
    }

    #[test]
    fn a_missing_value_parts_the_line() {
        let (x, y) = (places(2), places(5));
        let mut values: Vec<Option<f64>> = (0..10).map(|at| Some(f64::from(at % 2))).collect();
        values[4] = None;
        let field = field(&x, &y, &values);
        let lines = field.lines(0.5);
        assert_eq!(
            lines,
            [vec![(0.5, 0.0), (0.5, 1.0)], vec![(0.5, 3.0), (0.5, 4.0)]]
        );
    }

    #[test]
    fn a_saddle_has_two_lines_that_do_not_cross() {
        let at = places(2);
        let values = [1.0, 0.0, 0.0, 1.0].map(Some);
        let field = field(&at, &at, &values);
        assert_eq!(field.lines(0.4).len(), 2);
        assert_eq!(field.lines(0.6).len(), 2);
        assert_ne!(field.lines(0.4), field.lines(0.6));
    }
}
