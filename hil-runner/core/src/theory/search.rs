//! Searches along curves L, side by side: where one passes a border, and where it is
//! nearest to −1.
//!
//! A search is a chain of steps that wait for one another; those of other borders, and of
//! other loops, wait for none of it. Each lane has one, with the operations of a search by
//! itself in their order.

use nalgebra::Complex;
use plant::{Four, Width, widest};

/// Steps of the search for a minimum; two or three are the rule.
const MOST_STEPS: u32 = 12;
/// Steps of the search for a zero; likewise.
const MOST_ROOT_STEPS: u32 = 40;
/// Remainder of |L|² − 1, or of Im L in units of |L|, at a zero.
const ROOT: f64 = 1e-7;
/// Lanes at most.
const MOST_LANES: usize = 8;

/// A frequency, and L there.
type Point = (f64, Complex<f64>);
/// One a lane.
type Points<W> = (<W as Width>::Vector, Complex<<W as Width>::Vector>);

/// L of several runs.
pub(super) trait Response {
    /// L of the run of each lane, at a frequency of its own; what a lane without a run has
    /// is not read.
    fn at<W: Width>(&self, w: W, runs: &[usize], frequency: W::Vector) -> Complex<W::Vector>;
}

/// L lane by lane, from run and frequency.
pub(super) struct LaneByLane<F>(pub(super) F);

impl<F: Fn(usize, f64) -> Complex<f64>> Response for LaneByLane<F> {
    #[inline(always)]
    fn at<W: Width>(&self, w: W, runs: &[usize], frequency: W::Vector) -> Complex<W::Vector> {
        by_lane(w, runs.len(), frequency, |lane, frequency| {
            (self.0)(runs[lane], frequency)
        })
    }
}

/// In the first lanes, what a function of the lane's number makes of each.
#[inline(always)]
pub(super) fn by_lane<W: Width>(
    w: W,
    lanes: usize,
    numbers: W::Vector,
    f: impl Fn(usize, f64) -> Complex<f64>,
) -> Complex<W::Vector> {
    let numbers = w.stored(numbers);
    let (mut re, mut im) = (W::array(0.0), W::array(0.0));
    for (lane, number) in numbers.as_ref().iter().enumerate().take(lanes) {
        let value = f(lane, *number);
        re.as_mut()[lane] = value.re;
        im.as_mut()[lane] = value.im;
    }
    Complex::new(w.load(&re), w.load(&im))
}

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

/// A passage between two points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Zero {
    pub(super) run: usize,
    pub(super) border: Border,
    pub(super) ends: [Point; 2],
    /// Where it was found.
    pub(super) found: Point,
}

impl Zero {
    /// The centre of the border's circle, its squared radius, and the unit of Im L, 0 of a
    /// circle.
    fn border(&self) -> [f64; 3] {
        match self.border {
            Border::UnitGain => [0.0, 1.0, 0.0],
            Border::HalfPower => [1.0, 2.0, 0.0],
            Border::RealAxis => {
                let [from, to] = self.ends.map(|(_, value)| value.re.abs());
                [0.0, 0.0, from.max(to)]
            }
        }
    }
}

/// A minimum of |1 + L| near three points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum {
    pub(super) run: usize,
    pub(super) three: [Point; 3],
    /// Lowest and highest frequency.
    pub(super) within: [f64; 2],
    /// Frequency and squared distance.
    pub(super) found: (f64, f64),
}

/// Finds all of them.
pub(super) fn search(zeros: &mut [Zero], minima: &mut [Minimum], response: &impl Response) {
    let level = widest();
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = level.as_avx512() {
        use fearless_simd::Simd;
        return simd.vectorize(
            #[inline(always)]
            || side_by_side(plant::Eight(simd), zeros, minima, response),
        );
    }
    fearless_simd::dispatch!(level, simd => side_by_side(Four(simd), zeros, minima, response));
}

#[inline(always)]
fn side_by_side<W: Width>(
    w: W,
    zeros: &mut [Zero],
    minima: &mut [Minimum],
    response: &impl Response,
) {
    for zeros in zeros.chunks_mut(W::LANES) {
        find_zeros(w, zeros, response);
    }
    for minima in minima.chunks_mut(W::LANES) {
        find_minima(w, minima, response);
    }
}

/// One number of each lane's search; lanes without one repeat the last.
#[inline(always)]
pub(super) fn gathered<W: Width, T>(w: W, searches: &[T], of: impl Fn(&T) -> f64) -> W::Vector {
    let mut numbers = W::array(0.0);
    for (lane, number) in numbers.as_mut().iter_mut().enumerate() {
        *number = of(&searches[lane.min(searches.len() - 1)]);
    }
    w.load(&numbers)
}

/// The same of a point.
#[inline(always)]
fn points<W: Width, T>(w: W, searches: &[T], of: impl Fn(&T) -> Point) -> Points<W> {
    let re = gathered(w, searches, |search| of(search).1.re);
    let im = gathered(w, searches, |search| of(search).1.im);
    (
        gathered(w, searches, |search| of(search).0),
        Complex::new(re, im),
    )
}

/// Finds zeros by false position (Illinois), one a lane.
#[inline(always)]
fn find_zeros<W: Width>(w: W, zeros: &mut [Zero], response: &impl Response) {
    let lanes = zeros.len();
    let runs: [usize; MOST_LANES] = core::array::from_fn(|lane| zeros[lane.min(lanes - 1)].run);
    let border = [0, 1, 2].map(|k| gathered(w, zeros, |zero| zero.border()[k]));
    let [centre, squared, size] = border;
    let (zero, half) = (w.splat(0.0), w.splat(0.5));
    let is_line = w.greater(size, zero);
    let excess = |value: Complex<W::Vector>| {
        let re = value.re - centre;
        let circle = re * re + value.im * value.im - squared;
        w.select(is_line, value.im / size, circle)
    };
    let (mut a, from) = points(w, zeros, |zero| zero.ends[0]);
    let (mut b, to) = points(w, zeros, |zero| zero.ends[1]);
    let (mut fa, mut fb) = (excess(from), excess(to));
    let mut found = [b, to.re, to.im];
    let mut open = u64::MAX >> (u64::BITS as usize - lanes);
    for _ in 0..MOST_ROOT_STEPS {
        let x = b - fb * (b - a) / (fb - fa);
        let value = response.at(w, &runs[..lanes], x);
        let fx = excess(value);
        let is_open = w.lanes(open);
        for (found, here) in found.iter_mut().zip([x, value.re, value.im]) {
            *found = w.select(is_open, here, *found);
        }
        let is_root = w.at_most(w.abs(fx), w.splat(ROOT));
        let is_short = w.at_most(w.abs(b - a), w.splat(1e-12) * x);
        open &= !w.bits(w.either(is_root, is_short));
        if open == 0 {
            break;
        }
        let sides = w.bits(w.greater(zero, fx)) ^ w.bits(w.greater(zero, fb));
        let passed = w.lanes(sides);
        a = w.select(passed, b, a);
        fa = w.select(passed, fb, half * fa);
        (b, fb) = (x, fx);
    }
    let [at, re, im] = found.map(|found| w.stored(found));
    for (lane, zero) in zeros.iter_mut().enumerate() {
        let value = Complex::new(re.as_ref()[lane], im.as_ref()[lane]);
        zero.found = (at.as_ref()[lane], value);
    }
}

/// Finds minima, one a lane: the parabola through L at three points is put for L, which is
/// smooth where |1 + L| has its kink, and its nearest point is the next of the three.
#[inline(always)]
fn find_minima<W: Width>(w: W, minima: &mut [Minimum], response: &impl Response) {
    for minimum in &mut *minima {
        // The nearest first.
        let distance = |point: &Point| (point.1 + 1.0).norm_sqr();
        let three = &mut minimum.three;
        three.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    }
    let lanes = minima.len();
    let runs: [usize; MOST_LANES] = core::array::from_fn(|lane| minima[lane.min(lanes - 1)].run);
    let [lowest, highest] = [0, 1].map(|k| gathered(w, minima, |minimum| minimum.within[k]));
    let mut three = [0, 1, 2].map(|k| points(w, minima, |minimum| minimum.three[k]));
    let squared = |value: Complex<W::Vector>| {
        let re = w.splat(1.0) + value.re;
        re * re + value.im * value.im
    };
    let select = |mask, (x, l): Points<W>, (other_x, other_l): Points<W>| {
        let (re, im) = (
            w.select(mask, l.re, other_l.re),
            w.select(mask, l.im, other_l.im),
        );
        (w.select(mask, x, other_x), Complex::new(re, im))
    };
    let slope = |(x1, l1): Points<W>, (x0, l0): Points<W>| {
        let along = x1 - x0;
        Complex::new((l1.re - l0.re) / along, (l1.im - l0.im) / along)
    };
    let mut open = u64::MAX >> (u64::BITS as usize - lanes);
    for _ in 0..MOST_STEPS {
        let [(x1, l1), (x0, _), (x2, _)] = three;
        let (slope_0, slope_2) = (slope(three[0], three[1]), slope(three[2], three[0]));
        let bend = slope((x2, slope_2), (x0, slope_0));
        let along = x1 - x0;
        let here = Complex::new(slope_0.re + bend.re * along, slope_0.im + bend.im * along);
        let from = Complex::new(l1.re + w.splat(1.0), l1.im);
        let x = x1 + nearest(w, from, here, bend);
        let x = w.select(w.greater(lowest, x), lowest, x);
        let x = w.select(w.greater(x, highest), highest, x);
        // The parabola leads back to a known point: half way.
        let is_known = |known| w.both(w.at_most(x, known), w.at_most(known, x));
        let halved = w.splat(0.5) * (x1 + x);
        let x = w.select(w.either(is_known(x0), is_known(x2)), halved, x);
        open &= !w.bits(w.at_most(w.abs(x - x1), w.splat(1e-9) * x1));
        if open == 0 {
            break;
        }
        let here = (x, response.at(w, &runs[..lanes], x));
        let (before, after) = (squared(l1), squared(here.1));
        // The farthest of the four goes.
        let (is_open, is_nearer) = (w.lanes(open), w.greater(before, after));
        let next = [
            select(is_nearer, here, three[0]),
            select(is_nearer, three[0], here),
            three[1],
        ];
        three = [0, 1, 2].map(|k| select(is_open, next[k], three[k]));
        open &= !w.bits(w.at_most(w.abs(before - after), w.splat(1e-9) * before));
        if open == 0 {
            break;
        }
    }
    let [at, value] = [three[0].0, squared(three[0].1)].map(|found| w.stored(found));
    for (lane, minimum) in minima.iter_mut().enumerate() {
        minimum.found = (at.as_ref()[lane], value.as_ref()[lane]);
    }
}

/// The h near 0 at which `|e + s·h + c·h²|` is smallest, by Newton on the
/// derivative of its square.
#[inline(always)]
fn nearest<W: Width>(
    w: W,
    e: Complex<W::Vector>,
    s: Complex<W::Vector>,
    c: Complex<W::Vector>,
) -> W::Vector {
    let product = |a: Complex<W::Vector>, b: Complex<W::Vector>| a.re * b.re + a.im * b.im;
    let (two, tenth) = (w.splat(2.0), w.splat(0.1));
    let mut h = w.splat(0.0);
    for _ in 0..4 {
        let value = Complex::new(e.re + (s.re + c.re * h) * h, e.im + (s.im + c.im * h) * h);
        let slope = Complex::new(s.re + c.re * (two * h), s.im + c.im * (two * h));
        let first = product(value, slope);
        let steep = product(slope, slope);
        let second = steep + two * product(value, c);
        h = h - first / w.select(w.greater(second, tenth * steep), second, steep);
    }
    h
}
