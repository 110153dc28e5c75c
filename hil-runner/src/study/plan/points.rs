//! Points of the axes' space that a study visits, and those that a constraint
//! leaves out. Every plan gives point `i`
//! by itself, without those before it: that is what resuming and shards need.

use core::fmt;

use hil_core::number::of_bits;
use hil_core::runfile::KeyPath;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;
use schemars::JsonSchema;
use serde::Deserialize;
use sobol::Sobol;
use sobol::params::JoeKuoD6;

/// Axes that a Sobol plan can have: dimensions of the table of Joe and Kuo
/// that is kept.
pub const MOST_SOBOL_AXES: usize = 100;

/// Most points of a Sobol plan: bits of its direction numbers.
const SOBOL_BITS: usize = 40;

/// Kind of plan (`plan`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
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

/// Place of a point on one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// At one of the axis' values, by its number.
    Index(u64),
    /// At this part of the axis, from 0 to below 1.
    Part(f64),
}

/// A plan over a number of axes.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Its kind.
    pub kind: PlanKind,
    points: u64,
    /// Seed of plans that draw.
    pub seed: u64,
    /// Of a grid, the values of each axis.
    counts: Vec<u64>,
    /// Of a Sobol plan, the direction numbers of each axis.
    directions: Vec<Vec<u64>>,
}

/// More rows than results can number.
pub(in crate::study) const TOO_MANY: &str =
    "more rows than 2^53, which is as far as results can number them; make the plan smaller";

impl Plan {
    /// A plan of `runs` points (of the grid: all) over axes with so many values
    /// each.
    ///
    /// # Errors
    /// The sentence that says what there is at most.
    pub fn new(kind: PlanKind, counts: &[u64], runs: u64, seed: u64) -> Result<Self, String> {
        let axes = counts.len();
        let product = |product: u64, &count| product.checked_mul(count);
        let (mut points, mut directions) = (runs, Vec::new());
        match kind {
            PlanKind::Grid => points = counts.iter().try_fold(1, product).ok_or(TOO_MANY)?,
            PlanKind::LatinHypercube | PlanKind::Random => {}
            PlanKind::Sobol if axes > MOST_SOBOL_AXES => {
                return Err(format!(
                    "a Sobol plan has at most {MOST_SOBOL_AXES} axes, not {axes}; \"latin-hypercube\" takes any number"
                ));
            }
            PlanKind::Sobol if runs > 1 << SOBOL_BITS => {
                let most = 1_u64 << SOBOL_BITS;
                return Err(format!(
                    "a Sobol plan has at most {most} points, not {runs}; \"random\" takes any number"
                ));
            }
            PlanKind::Sobol => {
                let table = JoeKuoD6::minimal();
                directions = Sobol::<f64>::init_direction_vals(axes, SOBOL_BITS, &table);
            }
        }
        Ok(Self {
            kind,
            points,
            seed,
            counts: counts.to_owned(),
            directions,
        })
    }

    /// Number of points.
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Place of point `point` on axis `axis`.
    pub fn position(&self, point: u64, axis: usize) -> Position {
        let (number, seed) = (axis as u64, self.seed);
        match self.kind {
            PlanKind::Grid => {
                let faster = self.counts.iter().skip(axis + 1).product::<u64>().max(1);
                let count = self.counts.get(axis).copied().unwrap_or(1).max(1);
                Position::Index(point / faster % count)
            }
            PlanKind::LatinHypercube => {
                let stratum = shuffled(seed, number, point, self.points);
                let part = (whole(stratum) + unit(seed, number, point)) / whole(self.points);
                // Rounded, it stays below 1.
                Position::Part(part.min(1.0 - f64::EPSILON))
            }
            PlanKind::Sobol => {
                // Points in the order of the Gray code of their number.
                let gray = point ^ (point >> 1);
                let directions = self.directions.get(axis).into_iter().flatten().enumerate();
                let chosen = directions.filter(|(bit, _)| gray >> bit & 1 == 1);
                let bits = chosen.fold(0, |bits, (_, direction)| bits ^ direction);
                Position::Part(of_bits(bits ^ mix(seed, mix(number, 4))))
            }
            PlanKind::Random => Position::Part(unit(seed, number, point)),
        }
    }
}

/// A count as a number; exact below 2^53.
fn whole(n: u64) -> f64 {
    n as f64
}

// Random numbers by place: draw `i` of axis `j` is the same whoever asks for
// it, in whatever order.

/// A number in \[0, 1), 53 bits of it: draw `index` of axis `axis` under `seed`.
fn unit(seed: u64, axis: u64, index: u64) -> f64 {
    let [high, low, stream] = [0, 1, 2].map(|part| mix(mix(seed, axis), part));
    let state = (u128::from(high) << 64) | u128::from(low);
    let mut generator = Pcg64::new(state, stream.into());
    generator.advance(index.into());
    of_bits(generator.next_u64())
}

/// Two numbers into one without a pattern: the finaliser of `SplitMix64`
/// (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
fn mix(a: u64, b: u64) -> u64 {
    let mut z = a
        .wrapping_add(b.wrapping_mul(0xd1b5_4a32_d192_ed03))
        .wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Place of `index` in a shuffled row of `count`, `index` < `count`: a Feistel
/// network over the next power of four, walked until it falls inside (Black,
/// Rogaway, "Ciphers with arbitrary finite domains", 2002). Needs no memory.
fn shuffled(seed: u64, axis: u64, index: u64, count: u64) -> u64 {
    const ROUNDS: u64 = 6;
    let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mask = (1_u64 << half) - 1;
    let key = mix(seed, mix(axis, 3));
    let mut place = index;
    loop {
        let (mut left, mut right) = (place >> half, place & mask);
        for round in 0..ROUNDS {
            (left, right) = (right, left ^ (mix(key ^ round, right) & mask));
        }
        place = (left << half) | right;
        if place < count {
            return place;
        }
    }
}

/// A relation of two terms that must hold for a point to be run.
#[derive(Debug, Clone)]
pub struct Constraint {
    left: Term,
    holds: Relation,
    right: Term,
    text: String,
}

/// Holds of the values of two terms.
type Relation = fn(&f64, &f64) -> bool;

/// A number, a key, or a number times a key.
#[derive(Debug, Clone)]
struct Term {
    factor: f64,
    key: Option<KeyPath>,
}

impl fmt::Display for Constraint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Constraint {
    /// Reads `TERM < TERM`, with `<`, `<=`, `>` or `>=`; a term is a number, a
    /// key, or `NUMBER * KEY`.
    ///
    /// # Errors
    /// The sentence that says what is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let relations: [(&str, Relation); 4] = [
            ("<=", f64::le),
            (">=", f64::ge),
            ("<", f64::lt),
            (">", f64::gt),
        ];
        let mut split = relations.into_iter().filter_map(|(sign, holds)| {
            let (left, right) = text.split_once(sign)?;
            Some((left, holds, right))
        });
        let Some((left, holds, right)) = split.next() else {
            return Err("there is no <, <=, > or >= between two terms".to_owned());
        };
        Ok(Self {
            left: Term::parse(left)?,
            holds,
            right: Term::parse(right)?,
            text: text.split_whitespace().collect::<Vec<_>>().join(" "),
        })
    }

    /// True if it holds where `number` gives the values of keys; a key without
    /// a number fails.
    pub fn holds(&self, number: impl Fn(&KeyPath) -> Option<f64>) -> bool {
        let [left, right] = [&self.left, &self.right].map(|term| term.value(&number));
        matches!((left, right), (Some(left), Some(right)) if (self.holds)(&left, &right))
    }

    /// The keys that it names.
    pub fn keys(&self) -> impl Iterator<Item = &KeyPath> {
        [&self.left, &self.right]
            .into_iter()
            .filter_map(|term| term.key.as_ref())
    }
}

impl Term {
    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if text.is_empty() || text.ends_with('*') {
            return Err("a term is missing; it is a number, a key, or NUMBER * KEY".to_owned());
        }
        let (factor, rest) = match text.split_once('*') {
            Some((factor, key)) => (factor.trim(), Some(key.trim())),
            None if text.parse::<f64>().is_ok() => (text, None),
            None => ("1", Some(text)),
        };
        let number = factor.parse().ok().filter(|n: &f64| n.is_finite());
        let wrong = || format!("{factor:?} is no number; write NUMBER * KEY");
        let factor = number.ok_or_else(wrong)?;
        let key = rest.map(KeyPath::find).transpose()?;
        Ok(Self { factor, key })
    }

    fn value(&self, number: impl Fn(&KeyPath) -> Option<f64>) -> Option<f64> {
        match &self.key {
            None => Some(self.factor),
            Some(key) => Some(self.factor * number(key)?),
        }
    }
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
        let shift = |axis: u64| mix(3, mix(axis, 4));
        let plan = Plan {
            kind: PlanKind::Sobol,
            points: 500,
            seed: 3,
            counts: Vec::new(),
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
                let off = (bits as f64 / 2f64.powi(53) - part).abs();
                assert!(off < 1e-12, "{number} {axis}");
            }
        }
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        let plan =
            |kind, counts: &[u64], runs| Plan::new(kind, counts, runs, 0).map(|plan| plan.points());
        let refused = |kind, counts: &[u64], runs| plan(kind, counts, runs).unwrap_err();
        assert_eq!(refused(PlanKind::Grid, &[1 << 40, 1 << 40], 0), TOO_MANY);
        assert_eq!(
            refused(PlanKind::Sobol, &[1; 101], 5),
            "a Sobol plan has at most 100 axes, not 101; \"latin-hypercube\" takes any number"
        );
        assert_eq!(
            refused(PlanKind::Sobol, &[1], 1 << 41),
            "a Sobol plan has at most 1099511627776 points, not 2199023255552; \
             \"random\" takes any number"
        );
        assert_eq!(plan(PlanKind::Grid, &[], 0), Ok(1));
    }

    #[test]
    fn every_place_is_taken_once() {
        for count in [1, 2, 3, 5, 64, 100, 1000, 4097] {
            let mut places: Vec<u64> = (0..count).map(|i| shuffled(7, 0, i, count)).collect();
            let in_order = places.is_sorted();
            places.sort_unstable();
            assert_eq!(places, (0..count).collect::<Vec<_>>());
            assert!(count < 5 || !in_order, "{count} places are not shuffled");
        }
    }

    /// Mean and variance of a uniform number, and no correlation of axes or of
    /// neighbours: each within five standard deviations of 20,000 draws.
    #[test]
    fn draws_are_uniform_and_independent() {
        let n = 20_000;
        let draws = |axis| (0..n).map(move |i| unit(1, axis, i) - 0.5);
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / n as f64;
        let tolerance = 5.0 / (n as f64).sqrt();
        assert!(mean(&mut draws(0)).abs() < tolerance * (1.0_f64 / 12.0).sqrt());
        let variance = mean(&mut draws(0).map(|u| u * u));
        assert!((variance - 1.0 / 12.0).abs() < tolerance / 180.0_f64.sqrt());
        for other in [1, 2] {
            let across = mean(&mut draws(0).zip(draws(other)).map(|(u, v)| u * v));
            assert!(across.abs() < tolerance / 12.0, "axis {other}: {across}");
        }
        let neighbours = mean(&mut draws(0).zip(draws(0).skip(1)).map(|(u, v)| u * v));
        assert!(neighbours.abs() < tolerance / 12.0);
        // The measure finds what is not independent.
        assert!(mean(&mut draws(0).zip(draws(0)).map(|(u, v)| u * v)) > tolerance / 12.0);
    }

    #[test]
    fn relations_hold_as_they_read() {
        let holds = |text: &str| {
            let constraint = Constraint::parse(text).unwrap();
            constraint.holds(|key| match key.path().as_str() {
                "controller.kp" => Some(2.0),
                "controller.sample_time_s" => Some(1e-3),
                _ => None,
            })
        };
        assert!(holds("controller.kp <= 2"));
        assert!(!holds("controller.kp < 2"));
        assert!(holds("controller.kp>=2e3*controller.sample_time_s"));
        assert!(!holds("0.001 > controller.sample_time_s"));
        assert!(!holds("controller.kd_s > 0"), "what is not known fails");
    }

    #[test]
    fn nonsense_is_refused_with_a_sentence() {
        for (text, words) in [
            ("controller.kp", "there is no <"),
            ("controller.kpp < 3", "unknown key controller.kpp"),
            ("x * controller.kp < 3", "\"x\" is no number"),
            ("inf < controller.kp", "\"inf\" is no number"),
        ] {
            let error = Constraint::parse(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
