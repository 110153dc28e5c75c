//! Which points of the axes' space a study visits. Every plan gives point `i`
//! by itself, without those before it: that is what resuming and shards need.

use core::fmt;

use serde::Deserialize;
use sobol::Sobol;
use sobol::params::JoeKuoD6;

use super::draw;

/// Axes that a Sobol plan can have: dimensions of the table of Joe and Kuo
/// that is kept.
pub const MOST_SOBOL_AXES: usize = 100;

/// Most points of a Sobol plan: bits of its direction numbers.
const SOBOL_BITS: usize = 40;

/// Kind of plan (`plan`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlanKind {
    /// Every value of every axis with every value of the others, the last axis
    /// fastest.
    #[default]
    Grid,
    /// `runs` points, each axis cut into as many equal parts, one point in each
    /// (McKay, Beckman, Conover 1979).
    LatinHypercube,
    /// The first `runs` points of the Sobol sequence with the direction numbers
    /// of Joe and Kuo, shifted at random (digital shift).
    Sobol,
    /// `runs` independent points.
    Random,
}

impl PlanKind {
    /// The name in a study file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::LatinHypercube => "latin-hypercube",
            Self::Sobol => "sobol",
            Self::Random => "random",
        }
    }
}

/// Where a point lies on one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// At one of the axis' values, by its number.
    Index(u64),
    /// At this part of the axis, from 0 to below 1.
    Part(f64),
}

/// A plan over a number of axes.
#[derive(Debug, Clone)]
pub enum Plan {
    /// See [`PlanKind::Grid`].
    Grid {
        /// Values of each axis.
        counts: Vec<u64>,
        /// Product of all of them.
        points: u64,
    },
    /// See [`PlanKind::LatinHypercube`].
    LatinHypercube {
        /// Number of points.
        points: u64,
        /// Seed.
        seed: u64,
    },
    /// See [`PlanKind::Sobol`].
    Sobol {
        /// Number of points.
        points: u64,
        /// Seed.
        seed: u64,
        /// Direction numbers of each axis.
        directions: Vec<Vec<u64>>,
    },
    /// See [`PlanKind::Random`].
    Random {
        /// Number of points.
        points: u64,
        /// Seed.
        seed: u64,
    },
}

/// Why there is no such plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlanError {
    /// More rows than results can number.
    TooMany,
    /// More axes than the Sobol sequence has dimensions here.
    TooManyAxes(usize),
    /// More points than the Sobol sequence has here.
    TooLong(u64),
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooMany => f.write_str(
                "more rows than 2^53, which is as far as results can number them; make the plan smaller",
            ),
            Self::TooManyAxes(axes) => write!(
                f,
                "a Sobol plan has at most {MOST_SOBOL_AXES} axes, not {axes}; \"latin-hypercube\" takes any number"
            ),
            Self::TooLong(runs) => write!(
                f,
                "a Sobol plan has at most {} points, not {runs}; \"random\" takes any number",
                1_u64 << SOBOL_BITS
            ),
        }
    }
}

impl std::error::Error for PlanError {}

impl Plan {
    /// A plan of `runs` points (of the grid: all) over axes with so many values
    /// each.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn new(kind: PlanKind, counts: &[u64], runs: u64, seed: u64) -> Result<Self, PlanError> {
        Ok(match kind {
            PlanKind::Grid => Self::Grid {
                counts: counts.to_owned(),
                points: counts
                    .iter()
                    .try_fold(1_u64, |product, &count| product.checked_mul(count))
                    .ok_or(PlanError::TooMany)?,
            },
            PlanKind::LatinHypercube => Self::LatinHypercube { points: runs, seed },
            PlanKind::Random => Self::Random { points: runs, seed },
            PlanKind::Sobol => {
                if counts.len() > MOST_SOBOL_AXES {
                    return Err(PlanError::TooManyAxes(counts.len()));
                }
                if runs > 1 << SOBOL_BITS {
                    return Err(PlanError::TooLong(runs));
                }
                let table = JoeKuoD6::minimal();
                Self::Sobol {
                    points: runs,
                    seed,
                    directions: Sobol::<f64>::init_direction_vals(counts.len(), SOBOL_BITS, &table),
                }
            }
        })
    }

    /// Number of points.
    pub fn points(&self) -> u64 {
        match self {
            Self::Grid { points, .. }
            | Self::LatinHypercube { points, .. }
            | Self::Sobol { points, .. }
            | Self::Random { points, .. } => *points,
        }
    }

    /// Where point `point` lies on axis `axis`.
    pub fn position(&self, point: u64, axis: usize) -> Position {
        let number = axis as u64;
        match self {
            Self::Grid { counts, .. } => {
                let faster = counts.iter().skip(axis + 1).product::<u64>().max(1);
                let count = counts.get(axis).copied().unwrap_or(1).max(1);
                Position::Index(point / faster % count)
            }
            Self::LatinHypercube { points, seed } => {
                let stratum = draw::shuffled(*seed, number, point, *points);
                let within = draw::unit(*seed, number, point);
                Position::Part(below_one((whole(stratum) + within) / whole(*points)))
            }
            Self::Sobol {
                seed, directions, ..
            } => {
                // Points in the order of the Gray code of their number.
                let gray = point ^ (point >> 1);
                let bits = directions.get(axis).map_or(0, |directions| {
                    let chosen = directions.iter().enumerate();
                    chosen
                        .filter(|(bit, _)| gray >> bit & 1 == 1)
                        .fold(0, |bits, (_, direction)| bits ^ direction)
                });
                Position::Part(draw::from_bits(
                    bits ^ draw::mix(*seed, draw::mix(number, 4)),
                ))
            }
            Self::Random { seed, .. } => Position::Part(draw::unit(*seed, number, point)),
        }
    }
}

/// Keeps a rounded part below 1.
fn below_one(part: f64) -> f64 {
    part.min(1.0 - f64::EPSILON)
}

/// A count as a number; exact below 2^53.
#[expect(
    clippy::cast_precision_loss,
    reason = "counts of points stay below 2^53"
)]
fn whole(n: u64) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(plan: &Plan, axis: usize) -> Vec<f64> {
        (0..plan.points())
            .map(|point| match plan.position(point, axis) {
                Position::Part(part) => part,
                Position::Index(_) => panic!("no part"),
            })
            .collect()
    }

    #[test]
    fn the_grid_visits_every_point_once_the_last_axis_fastest() {
        let plan = Plan::new(PlanKind::Grid, &[2, 3, 4], 0, 0).unwrap();
        let points: Vec<[Position; 3]> = (0..plan.points())
            .map(|point| [0, 1, 2].map(|axis| plan.position(point, axis)))
            .collect();
        let mut expected = Vec::new();
        for a in 0..2 {
            for b in 0..3 {
                for c in 0..4 {
                    expected.push([a, b, c].map(Position::Index));
                }
            }
        }
        assert_eq!(points, expected);
    }

    /// One point in every stratum of every axis; a random plan leaves about
    /// 1/e of them empty.
    #[test]
    fn a_latin_hypercube_fills_every_stratum() {
        let strata = |kind, axis| {
            let plan = Plan::new(kind, &[1, 1], 1000, 5).unwrap();
            let mut seen = vec![false; 1000];
            for part in parts(&plan, axis) {
                seen[(part * 1000.0) as usize] = true;
            }
            seen.iter().filter(|seen| **seen).count()
        };
        for axis in [0, 1] {
            assert_eq!(strata(PlanKind::LatinHypercube, axis), 1000);
            assert!(strata(PlanKind::Random, axis) < 700);
        }
    }

    /// The first 2^m points have one in each of the 2^m boxes of any shape in
    /// two dimensions (a (0, m, 2)-net), whatever the shift; a random plan has not.
    #[test]
    fn sobol_points_are_a_net() {
        let boxes = |kind, columns: u64, rows: u64| {
            let plan = Plan::new(kind, &[1, 1], columns * rows, 9).unwrap();
            let (x, y) = (parts(&plan, 0), parts(&plan, 1));
            let mut seen = vec![false; (columns * rows) as usize];
            for (x, y) in x.into_iter().zip(y) {
                let column = (x * columns as f64) as u64;
                seen[(column * rows + (y * rows as f64) as u64) as usize] = true;
            }
            seen.iter().all(|seen| *seen)
        };
        for (columns, rows) in [(256, 1), (64, 4), (16, 16), (4, 64), (1, 256)] {
            assert!(boxes(PlanKind::Sobol, columns, rows), "{columns} × {rows}");
            assert!(!boxes(PlanKind::Random, columns, rows));
        }
    }

    /// Point after point as the library's own generator has them.
    #[test]
    fn sobol_points_are_those_of_the_sequence() {
        let directions = Sobol::<f64>::init_direction_vals(7, SOBOL_BITS, &JoeKuoD6::minimal());
        let shift = |axis: u64| draw::mix(3, draw::mix(axis, 4));
        let plan = Plan::Sobol {
            points: 500,
            seed: 3,
            directions,
        };
        for (number, point) in Sobol::<f64>::new(7, &JoeKuoD6::minimal())
            .take(500)
            .enumerate()
        {
            for (axis, part) in point.into_iter().enumerate() {
                let Position::Part(found) = plan.position(number as u64, axis) else {
                    panic!()
                };
                // The shift undone, to the 40 bits that are kept.
                let bits = (found * 2f64.powi(53)) as u64 ^ (shift(axis as u64) >> 11);
                assert!(
                    (bits as f64 / 2f64.powi(53) - part).abs() < 1e-12,
                    "{number} {axis}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        let plan =
            |kind, counts: &[u64], runs| Plan::new(kind, counts, runs, 0).map(|plan| plan.points());
        assert_eq!(
            plan(PlanKind::Grid, &[1 << 40, 1 << 40], 0),
            Err(PlanError::TooMany)
        );
        assert_eq!(
            plan(PlanKind::Sobol, &[1; 101], 5),
            Err(PlanError::TooManyAxes(101))
        );
        assert_eq!(
            plan(PlanKind::Sobol, &[1], 1 << 41),
            Err(PlanError::TooLong(1 << 41))
        );
        assert_eq!(plan(PlanKind::Grid, &[], 0), Ok(1));
    }
}
