//! Searches along a curve L, a step at a time: where it passes a border, and where it is
//! nearest to −1.

use nalgebra::Complex;

/// Steps of the search for a minimum; two or three are the rule.
const MOST_STEPS: u32 = 12;
/// Steps of the search for a zero; likewise.
const MOST_ROOT_STEPS: u32 = 40;
/// Remainder of |L|² − 1, or of Im L in units of |L|, at a zero.
const ROOT: f64 = 1e-7;

/// A frequency, and L there.
type Point = (f64, Complex<f64>);

/// What L passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Border {
    /// `|L| = 1`.
    UnitGain,
    /// `|L/(1 + L)| = 1/√2`, where `2·|L|² = |1 + L|²`.
    HalfPower,
    /// `Im L = 0`.
    RealAxis,
}

impl Border {
    /// What changes its sign there, `Im L` in units of `size`.
    #[inline(always)]
    fn excess(self, value: Complex<f64>, size: f64) -> f64 {
        match self {
            Self::UnitGain => value.norm_sqr() - 1.0,
            Self::HalfPower => (value - 1.0).norm_sqr() - 2.0,
            Self::RealAxis => value.im / size,
        }
    }
}

/// The search for a passage, by false position (Illinois).
#[derive(Debug, Clone, Copy)]
pub(super) struct Zero {
    pub(super) border: Border,
    /// True if the excess falls below 0 with the frequency.
    pub(super) falls: bool,
    /// The last frequency, and L there.
    pub(super) found: Point,
    pub(super) done: bool,
    /// |L| about here.
    size: f64,
    /// Both ends, and the excess there.
    a: [f64; 2],
    b: [f64; 2],
    steps: u32,
}

impl Zero {
    /// Between two points; none where L stays on one side.
    #[inline(always)]
    pub(super) fn new(border: Border, ends: [Point; 2]) -> Option<Self> {
        let sides = match border {
            Border::RealAxis => ends.map(|(_, value)| value.im),
            _ => ends.map(|(_, value)| border.excess(value, 1.0)),
        };
        if (sides[0] < 0.0) == (sides[1] < 0.0) {
            return None;
        }
        let size = ends[0].1.re.abs().max(ends[1].1.re.abs());
        let [a, b] = ends.map(|(at, value)| [at, border.excess(value, size)]);
        Some(Self {
            border,
            falls: sides[0] >= 0.0,
            found: ends[1],
            done: false,
            size,
            a,
            b,
            steps: 0,
        })
    }

    /// One step.
    #[inline(always)]
    pub(super) fn step(&mut self, l: &impl Fn(f64) -> Complex<f64>) {
        let ([a, fa], [b, fb]) = (self.a, self.b);
        let x = b - fb * (b - a) / (fb - fa);
        let value = l(x);
        let fx = self.border.excess(value, self.size);
        self.found = (x, value);
        self.steps += 1;
        self.done = fx.abs() <= ROOT || (b - a).abs() <= 1e-12 * x || self.steps == MOST_ROOT_STEPS;
        if (fx < 0.0) == (fb < 0.0) {
            self.a[1] = 0.5 * fa;
        } else {
            self.a = self.b;
        }
        self.b = [x, fx];
    }
}

/// The search for a minimum of `|1 + L|`: the parabola through L at three points is put
/// for L, which is smooth where |1 + L| has its kink, and its nearest point is the next of
/// the three.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum {
    pub(super) done: bool,
    /// The nearest first.
    three: [Point; 3],
    /// Lowest and highest frequency.
    within: [f64; 2],
    steps: u32,
}

impl Minimum {
    /// From three points.
    pub(super) fn new(mut three: [Point; 3], within: [f64; 2]) -> Self {
        three.sort_by(|a, b| squared_distance(a.1).total_cmp(&squared_distance(b.1)));
        Self {
            done: false,
            three,
            within,
            steps: 0,
        }
    }

    /// Frequency and squared distance of the nearest point.
    pub(super) fn found(&self) -> (f64, f64) {
        let (frequency, value) = self.three[0];
        (frequency, squared_distance(value))
    }

    /// One step.
    #[inline(always)]
    pub(super) fn step(&mut self, l: &impl Fn(f64) -> Complex<f64>) {
        let three = self.three;
        let [(x1, l1), (x0, l0), (x2, l2)] = three;
        let (slope_0, slope_2) = ((l1 - l0) / (x1 - x0), (l2 - l1) / (x2 - x1));
        let bend = (slope_2 - slope_0) / (x2 - x0);
        let slope = slope_0 + bend * (x1 - x0);
        let step = nearest(l1 + 1.0, slope, bend);
        let mut x = (x1 + step).clamp(self.within[0], self.within[1]);
        if x == x0 || x == x2 {
            // The parabola leads back to a known point: half way.
            x = 0.5 * (x1 + x);
        }
        self.steps += 1;
        self.done = (x - x1).abs() <= 1e-9 * x1 || self.steps == MOST_STEPS;
        if (x - x1).abs() <= 1e-9 * x1 {
            return;
        }
        let here = (x, l(x));
        let (before, after) = (squared_distance(l1), squared_distance(here.1));
        // The farthest of the four goes.
        self.three = if after < before {
            [here, three[0], three[1]]
        } else {
            [three[0], here, three[1]]
        };
        self.done |= (before - after).abs() <= 1e-9 * before;
    }
}

/// `|1 + L|²`.
fn squared_distance(value: Complex<f64>) -> f64 {
    let re = 1.0 + value.re;
    re * re + value.im * value.im
}

/// The h near 0 at which `|e + s·h + c·h²|` is smallest, by Newton on the
/// derivative of its square.
fn nearest(e: Complex<f64>, s: Complex<f64>, c: Complex<f64>) -> f64 {
    let product = |a: Complex<f64>, b: Complex<f64>| a.re * b.re + a.im * b.im;
    let mut h = 0.0;
    for _ in 0..4 {
        let value = e + (s + c * h) * h;
        let slope = s + c * (2.0 * h);
        let first = product(value, slope);
        let steep = slope.norm_sqr();
        let second = steep + 2.0 * product(value, c);
        h -= first / if second > 0.1 * steep { second } else { steep };
    }
    h
}
