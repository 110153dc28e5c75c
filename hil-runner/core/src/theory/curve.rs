//! A response `L(jω)` at rising frequencies, and its distance from instability.
//!
//! The modulus margin `min |1 + L|` is the distance of the Nyquist curve from
//! −1, the reciprocal of the sensitivity's peak M_s (Åström and Wittenmark,
//! "Computer-Controlled Systems", 3.4 and 5.5). 0.5 and more is a sound loop. One
//! number covers gain and phase at once: a loop with modulus m endures any gain
//! from 1/(1+m) to 1/(1−m) and a lag of 2·asin(m/2).
//!
//! Nothing happens on most of a curve: blocks of it are first looked over
//! without a branch, and only those with a mark are searched. [`refined`] chooses
//! the frequencies: closer where the response bends.

use nalgebra::Complex;

/// Points of L, and L between them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve<'a, F> {
    /// Rising, in whatever unit `at` takes them; three points at least.
    pub(crate) frequency: &'a [f64],
    pub(crate) re: &'a [f64],
    pub(crate) im: &'a [f64],
    /// `L` between the points.
    pub(crate) at: &'a F,
    /// The last point is the middle of a sampled spectrum, where L is
    /// real.
    pub(crate) ends_real: bool,
}

/// Marks of what there is to find in a block of chords.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Marks {
    /// |L| passes 1.
    unit_gain: bool,
    /// |L/(1 + L)| passes 1/√2.
    half_power: bool,
    /// L passes the real axis.
    real: bool,
    /// A chord may come nearer to −1 than the points.
    near: bool,
}

/// Chords of a block.
const BLOCK: usize = 8;
/// Chords that are looked into: up to this times the lowest squared distance of
/// a point. A chord is off its curve by a few per cent at most.
const CANDIDATE: f64 = 1.2;
/// Steps of the search for a minimum; two or three are the rule.
const MOST_STEPS: usize = 12;
/// Steps of the search for a zero; likewise.
const MOST_ROOT_STEPS: usize = 40;
/// |L| at which no loop is closed any more: the zero of an undamped joint.
const NOTHING: f64 = 1e-9;
/// Remainder of |L|² − 1, or of Im L in units of |L|, at a zero.
const ROOT: f64 = 1e-7;

impl<F: Fn(f64) -> Complex<f64>> Curve<'_, F> {
    fn point(&self, i: usize) -> Complex<f64> {
        Complex::new(self.re[i], self.im[i])
    }

    /// The point nearest to −1 and its squared distance.
    fn lowest(&self) -> (usize, f64) {
        const LANES: usize = 4;
        let squared = |re: f64, im: f64| (1.0 + re) * (1.0 + re) + im * im;
        let mut lanes = [f64::INFINITY; LANES];
        let (re, im) = (self.re.chunks_exact(LANES), self.im.chunks_exact(LANES));
        let rest = re.remainder().iter().zip(im.remainder());
        let mut lowest = rest.fold(f64::INFINITY, |low, (re, im)| low.min(squared(*re, *im)));
        for (re, im) in re.zip(im) {
            for lane in 0..LANES {
                let d = squared(re[lane], im[lane]);
                lanes[lane] = if d < lanes[lane] { d } else { lanes[lane] };
            }
        }
        lowest = lanes.iter().fold(lowest, |low, lane| low.min(*lane));
        let mut points = self.re.iter().zip(self.im);
        let at = points.position(|(re, im)| squared(*re, *im) == lowest);
        (at.unwrap_or(0), lowest)
    }

    /// `min |1 + L|`, without what else a [`Margin`] tells.
    pub(crate) fn modulus(&self) -> f64 {
        self.closest(self.lowest()).1.sqrt()
    }

    /// Frequency at which −1 is nearest, and its squared distance, from the point
    /// nearest to it.
    fn closest(&self, lowest: (usize, f64)) -> (f64, f64) {
        let (mut weakest, mut distance) = (self.frequency[lowest.0], lowest.1);
        for (start, marks) in self.marked(lowest.1) {
            if marks.near {
                self.each_minimum(start, lowest.1, |frequency, value| {
                    if value < distance {
                        (weakest, distance) = (frequency, value);
                    }
                });
            }
        }
        (weakest, distance)
    }

    /// The blocks with something to find, by their first chord.
    fn marked(&self, lowest: f64) -> impl Iterator<Item = (usize, Marks)> {
        let bound = 2.0 * CANDIDATE * lowest;
        let chords = self.re.len() - 1;
        (0..chords).step_by(BLOCK).filter_map(move |start| {
            let end = (start + BLOCK).min(chords);
            let marks = marks(&self.re[start..=end], &self.im[start..=end], bound);
            (marks != Marks::default()).then_some((start, marks))
        })
    }

    /// Squared distance of −1 from the chord behind point `i`; infinite behind
    /// the last.
    fn chord(&self, i: usize) -> f64 {
        if i + 1 >= self.re.len() {
            return f64::INFINITY;
        }
        let (from, to) = (self.point(i) + 1.0, self.point(i + 1) + 1.0);
        let along = to - from;
        let length = along.norm_sqr();
        if length == 0.0 {
            return from.norm_sqr();
        }
        let share = (-(from.re * along.re + from.im * along.im) / length).clamp(0.0, 1.0);
        (from + along * share).norm_sqr()
    }

    /// Every local minimum of |1 + L|² in the block from `start` that may be
    /// the lowest: frequency and value. The chords tell where it can be, L
    /// itself then where it is.
    fn each_minimum(&self, start: usize, lowest: f64, mut found: impl FnMut(f64, f64)) {
        let bound = CANDIDATE * lowest;
        let mut before = match start {
            0 => f64::INFINITY,
            start => self.chord(start - 1),
        };
        let mut here = self.chord(start);
        for i in start..(start + BLOCK).min(self.re.len() - 1) {
            let after = self.chord(i + 1);
            // Of two chords that meet in the closest point, the first.
            if here < before && here <= after && here <= bound {
                let (frequency, value) = self.minimum(i);
                found(frequency, value);
            }
            (before, here) = (here, after);
        }
    }

    /// The minimum of the squared distance near the chord behind point `i`: the
    /// parabola through L at three points is put for L, which is smooth where
    /// |1 + L| has its kink, and its nearest point is the next of the three.
    fn minimum(&self, i: usize) -> (f64, f64) {
        let n = self.re.len();
        let middle = i.clamp(1, n - 2);
        let lowest = self.frequency[i.saturating_sub(1)];
        let highest = self.frequency[(i + 2).min(n - 1)];
        let point = |k: usize| (self.frequency[k], self.point(k));
        let mut three = [point(middle - 1), point(middle), point(middle + 1)];
        three.sort_by(|a, b| squared_distance(a.1).total_cmp(&squared_distance(b.1)));
        for _ in 0..MOST_STEPS {
            let [(x1, l1), (x0, l0), (x2, l2)] = three;
            let (slope_0, slope_2) = ((l1 - l0) / (x1 - x0), (l2 - l1) / (x2 - x1));
            let bend = (slope_2 - slope_0) / (x2 - x0);
            let slope = slope_0 + bend * (x1 - x0);
            let step = nearest(l1 + 1.0, slope, bend);
            let mut x = (x1 + step).clamp(lowest, highest);
            if x == x0 || x == x2 {
                // The parabola leads back to a known point: half way.
                x = 0.5 * (x1 + x);
            }
            if (x - x1).abs() <= 1e-9 * x1 {
                break;
            }
            let here = (x, (self.at)(x));
            let (before, after) = (squared_distance(l1), squared_distance(here.1));
            // The farthest of the four goes.
            three = if after < before {
                [here, three[0], three[1]]
            } else {
                [three[0], here, three[1]]
            };
            if (before - after).abs() <= 1e-9 * before {
                break;
            }
        }
        (three[0].0, squared_distance(three[0].1))
    }

    /// Every zero of `excess(L)` in the block from `start`: its frequency, whether it
    /// falls there, and L.
    fn each_passage(
        &self,
        start: usize,
        excess: fn(Complex<f64>) -> f64,
        mut found: impl FnMut(f64, bool, Complex<f64>),
    ) {
        for i in start..(start + BLOCK).min(self.re.len() - 1) {
            let ends = [i, i + 1].map(|k| excess(self.point(k)));
            if (ends[0] < 0.0) != (ends[1] < 0.0) {
                let (frequency, value) = self.zero(i, ends, excess);
                found(frequency, ends[0] >= 0.0, value);
            }
        }
    }

    /// |L| at every point of the block from `start` on the negative real axis.
    fn each_phase_crossing(&self, start: usize, mut found: impl FnMut(f64)) {
        let last = self.re.len() - 1;
        // The chord to a real end crosses nothing.
        let chords = if self.ends_real { last - 1 } else { last };
        for i in start..(start + BLOCK).min(chords) {
            let ends = [self.im[i], self.im[i + 1]];
            if (ends[0] < 0.0) == (ends[1] < 0.0) || self.re[i] >= 0.0 && self.re[i + 1] >= 0.0 {
                continue;
            }
            let size = self.re[i].abs().max(self.re[i + 1].abs());
            let (_, value) = self.zero(i, ends.map(|im| im / size), |value| value.im / size);
            if value.re < -NOTHING {
                found(-value.re);
            }
        }
    }

    /// |L| in the middle of a sampled spectrum, where L is negative there.
    fn real_end(&self) -> Option<f64> {
        let last = self.re[self.re.len() - 1];
        (self.ends_real && last < 0.0).then_some(-last)
    }

    /// The zero of `f(L)` behind point `i`, by false position (Illinois), and L
    /// there.
    fn zero(
        &self,
        i: usize,
        ends: [f64; 2],
        f: impl Fn(Complex<f64>) -> f64,
    ) -> (f64, Complex<f64>) {
        let (mut a, mut b) = (self.frequency[i], self.frequency[i + 1]);
        let [mut fa, mut fb] = ends;
        let mut best = (b, self.point(i + 1));
        for _ in 0..MOST_ROOT_STEPS {
            let x = b - fb * (b - a) / (fb - fa);
            let value = (self.at)(x);
            let fx = f(value);
            best = (x, value);
            if fx.abs() <= ROOT || (b - a).abs() <= 1e-12 * x {
                break;
            }
            if (fx < 0.0) == (fb < 0.0) {
                fa *= 0.5;
            } else {
                (a, fa) = (b, fb);
            }
            (b, fb) = (x, fx);
        }
        best
    }
}

/// Margins of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The closed loop comes to rest by itself.
    pub stable: bool,
    /// `min |1 + L|` over all frequencies, `1/M_s`, at least 0.
    pub modulus: f64,
    /// Frequency of that minimum \[rad/s\].
    pub weakest_radps: f64,
    /// Smallest turn that brings the loop to instability \[rad\], a lag if
    /// above 0: that of `−L` where `|L| = 1`. `None` for an unstable loop, or
    /// where |L| is never 1.
    pub phase_rad: Option<f64>,
    /// Smallest factor above 1 that brings the loop to instability; `None` for
    /// an unstable loop, or where no gain does.
    pub gain: Option<f64>,
    /// Lowest frequency at which |L| falls to 1 \[rad/s\]: up to there the loop
    /// follows. `None` where it never does.
    pub crossover_radps: Option<f64>,
    /// Bandwidth: lowest frequency at which |T| of `T = L/(1 + L)` falls below 1/√2
    /// \[rad/s\]. `None` for an unstable loop, or where it never does.
    pub bandwidth_radps: Option<f64>,
}

impl Margin {
    /// The modulus margin, negative for an unstable loop: 0 is the border.
    pub fn signed(&self) -> f64 {
        signed(self.stable, self.modulus)
    }

    /// Reads a curve, frequencies in its unit.
    pub(crate) fn of<F: Fn(f64) -> Complex<f64>>(curve: &Curve<'_, F>, stable: bool) -> Self {
        let lowest = curve.lowest();
        let (weakest, distance) = curve.closest(lowest);
        let (mut crossover, mut phase): (Option<f64>, Option<f64>) = (None, None);
        let mut bandwidth: Option<f64> = None;
        // The largest |L| below 1 where L is negative; 0 without any.
        let mut magnitude = 0.0_f64;
        let mut negative = |at: f64| {
            if at < 1.0 {
                magnitude = magnitude.max(at);
            }
        };
        for (start, marks) in curve.marked(lowest.1) {
            if marks.unit_gain {
                curve.each_passage(start, over_unit_gain, |frequency, falls, value| {
                    if falls && crossover.is_none() {
                        crossover = Some(frequency);
                    }
                    // arg(−L): what turns L to −1.
                    let lag = libm::atan2(-value.im, -value.re);
                    if phase.is_none_or(|phase| lag.abs() < phase.abs()) {
                        phase = Some(lag);
                    }
                });
            }
            if marks.half_power && stable && bandwidth.is_none() {
                curve.each_passage(start, over_half_power, |frequency, falls, _| {
                    if falls && bandwidth.is_none() {
                        bandwidth = Some(frequency);
                    }
                });
            }
            if marks.real && stable {
                curve.each_phase_crossing(start, &mut negative);
            }
        }
        curve.real_end().into_iter().for_each(negative);
        Self {
            stable,
            modulus: distance.sqrt(),
            weakest_radps: weakest,
            phase_rad: phase.filter(|_| stable),
            gain: (stable && magnitude > 0.0).then(|| 1.0 / magnitude),
            crossover_radps: crossover,
            bandwidth_radps: bandwidth,
        }
    }
}

/// Looks over a block of chords without a branch.
///
/// A chord whose ends are seen from −1 under less than a right angle is at
/// least `1/√2` times as far away as the nearer end.
fn marks(re: &[f64], im: &[f64], bound: f64) -> Marks {
    let n = re.len() - 1;
    let (re0, re1, im0, im1) = (&re[..n], &re[1..=n], &im[..n], &im[1..=n]);
    let (mut unit_gain, mut half_power, mut real, mut near) = (false, false, false, false);
    let within = |re: f64, im: f64| (re - 1.0) * (re - 1.0) + im * im < 2.0;
    for k in 0..n {
        let (r0, r1, i0, i1) = (re0[k], re1[k], im0[k], im1[k]);
        unit_gain |= (r0 * r0 + i0 * i0 < 1.0) != (r1 * r1 + i1 * i1 < 1.0);
        half_power |= within(r0, i0) != within(r1, i1);
        real |= (i0 < 0.0) != (i1 < 0.0);
        let (x0, x1) = (1.0 + r0, 1.0 + r1);
        near |=
            (x0 * x1 + i0 * i1 < 0.0) | (x0 * x0 + i0 * i0 <= bound) | (x1 * x1 + i1 * i1 <= bound);
    }
    Marks {
        unit_gain,
        half_power,
        real,
        near,
    }
}

/// A modulus, below 0 where the loop is unstable.
pub(crate) fn signed(stable: bool, modulus: f64) -> f64 {
    if stable { modulus } else { -modulus }
}

/// `|L|² − 1`.
fn over_unit_gain(value: Complex<f64>) -> f64 {
    value.norm_sqr() - 1.0
}

/// `|L − 1|² − 2`, above 0 where `|L/(1 + L)| > 1/√2`: `2·|L|² > |1 + L|²`.
fn over_half_power(value: Complex<f64>) -> f64 {
    (value - 1.0).norm_sqr() - 2.0
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

/// Distance that the response half way may have from what its neighbours suggest,
/// relative to them.
const BEND: f64 = 0.02;

/// True if the response between two neighbours bends, seen from the middle: it
/// is neither a power of the frequency nor a straight line. At a resonance it is
/// neither, around a zero the latter.
pub(crate) fn bends(from: Complex<f64>, middle: Complex<f64>, to: Complex<f64>) -> bool {
    let product = from * to;
    let off_power = (middle * middle - product).norm_sqr();
    if off_power <= 4.0 * BEND * BEND * product.norm_sqr() {
        return false;
    }
    let off_line = (middle - (from + to) * 0.5).norm_sqr();
    off_line > BEND * BEND * from.norm_sqr().max(to.norm_sqr())
}

/// Limits of [`refined`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// Points at most.
    pub(crate) most: usize,
    /// Neighbours closer than this, relative, are not divided.
    pub(crate) closest: f64,
}

/// `base` and `seeds` in order, and between them as many frequencies as it takes
/// until no two neighbours are `rough`, or the limits are reached; with the
/// response at each. Seeds are where a needle may hide between two points of the base.
pub(crate) fn refined(
    mut base: Vec<f64>,
    seeds: &[f64],
    limits: Limits,
    response: impl Fn(f64) -> Complex<f64>,
    rough: impl Fn(Complex<f64>, Complex<f64>, Complex<f64>) -> bool,
) -> Vec<(f64, Complex<f64>)> {
    let (lowest, highest) = (base[0], base[base.len() - 1]);
    let within = |at: &&f64| **at > lowest && **at < highest;
    base.extend(seeds.iter().filter(within));
    base.sort_by(f64::total_cmp);
    base.dedup_by(|b, a| *b - *a <= 1e-12 * *a && *b < highest);
    let mut points: Vec<(f64, Complex<f64>)> =
        base.into_iter().map(|at| (at, response(at))).collect();
    // Every gap once a round, so that a full grid is full everywhere.
    loop {
        let mut room = limits.most.saturating_sub(points.len());
        let mut divided = Vec::with_capacity(2 * points.len());
        for pair in points.windows(2) {
            let ((a, at_a), (b, at_b)) = (pair[0], pair[1]);
            divided.push(pair[0]);
            if room == 0 || b - a <= limits.closest * a {
                continue;
            }
            let middle = (a * b).sqrt();
            let at_middle = response(middle);
            if rough(at_a, at_middle, at_b) {
                divided.push((middle, at_middle));
                room -= 1;
            }
        }
        divided.extend(points.last());
        let done = divided.len() == points.len();
        points = divided;
        if done {
            return points;
        }
    }
}
