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

use fearless_simd::Level;
use nalgebra::Complex;
use plant::{widest, with_four};

use super::search::{Border, Minimum, Response, Zero, search};

/// Points of L.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve<'a> {
    /// Rising, in whatever unit; three points at least.
    pub(crate) frequency: &'a [f64],
    pub(crate) re: &'a [f64],
    pub(crate) im: &'a [f64],
    /// The last point is the middle of a sampled spectrum, where L is
    /// real.
    pub(crate) ends_real: bool,
}

/// What there is to find on the curves of some runs: in room that is kept.
#[derive(Debug)]
pub(crate) struct Finds {
    pub(crate) level: Level,
    runs: Vec<Run>,
    blocks: Vec<Block>,
    zeros: Vec<Zero>,
    minima: Vec<Minimum>,
}

impl Default for Finds {
    fn default() -> Self {
        Self {
            level: widest(),
            runs: Vec::new(),
            blocks: Vec::new(),
            zeros: Vec::new(),
            minima: Vec::new(),
        }
    }
}

/// What is known of a run before anything is searched.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// The point nearest to −1: its frequency and squared distance.
    lowest: (f64, f64),
    stable: bool,
    /// |L| in the middle of the spectrum, where L is negative there.
    real_end: Option<f64>,
    /// Numbers of zeros and minima up to those of this run.
    zeros: usize,
    minima: usize,
}

/// What there is to find in a block of chords.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Some of the marks below.
    marks: u64,
    /// Least squared distance of a point from −1.
    lowest: f64,
}

/// |L| passes 1.
const UNIT_GAIN: u64 = 1;
/// |L/(1 + L)| passes 1/√2.
const HALF_POWER: u64 = 2;
/// L passes the real axis.
const REAL: u64 = 4;
/// A chord is seen from −1 under more than a right angle.
const WIDE: u64 = 8;

/// Chords of a block.
const BLOCK: usize = 8;
/// Chords that are looked into: up to this times the lowest squared distance of
/// a point. A chord is off its curve by a few per cent at most.
const CANDIDATE: f64 = 1.2;
/// Chords whose ends are farther than this times that distance, and seen from −1 under
/// less than a right angle, are none of them: such a chord is at least `1/√2` times as far
/// away as the nearer end.
pub(crate) const NEAR: f64 = 2.0 * CANDIDATE;
/// |L| at which no loop is closed any more: the zero of an undamped joint.
const NOTHING: f64 = 1e-9;

impl Curve<'_> {
    fn point(&self, i: usize) -> Complex<f64> {
        Complex::new(self.re[i], self.im[i])
    }

    /// The point nearest to −1, from its squared distance: its frequency.
    fn lowest(&self, blocks: &[Block], lowest: f64) -> f64 {
        let block = blocks.iter().position(|block| block.lowest == lowest);
        let start = BLOCK * block.unwrap_or(0);
        let mut points = (start..self.re.len()).map(|i| self.point(i) + 1.0);
        let place = points.position(|point| point.norm_sqr() == lowest);
        self.frequency[place.map_or(0, |place| start + place)]
    }

    /// Squared distance of −1 from the chord behind point `i`; infinite where it is no
    /// candidate, and behind the last.
    fn chord(&self, i: usize, lowest: f64) -> f64 {
        if i + 1 >= self.re.len() {
            return f64::INFINITY;
        }
        let (from, to) = (self.point(i) + 1.0, self.point(i + 1) + 1.0);
        if !is_near(from, to, lowest) {
            return f64::INFINITY;
        }
        let along = to - from;
        let length = along.norm_sqr();
        if length == 0.0 {
            return from.norm_sqr();
        }
        let share = (-(from.re * along.re + from.im * along.im) / length).clamp(0.0, 1.0);
        (from + along * share).norm_sqr()
    }

    /// Every local minimum of |1 + L|² that may be the lowest. The chords tell where it
    /// can be, L itself then where it is.
    fn minima(&self, lowest: f64, blocks: &[Block], mut found: impl FnMut(usize)) {
        let bound = CANDIDATE * lowest;
        for (number, block) in blocks.iter().enumerate() {
            if block.lowest > NEAR * lowest && block.marks & WIDE == 0 {
                continue;
            }
            let start = number * BLOCK;
            let mut before = match start {
                0 => f64::INFINITY,
                start => self.chord(start - 1, lowest),
            };
            let mut here = self.chord(start, lowest);
            for i in start..(start + BLOCK).min(self.re.len() - 1) {
                let after = self.chord(i + 1, lowest);
                // Of two chords that meet in the closest point, the first.
                if here < before && here <= after && here <= bound {
                    found(i);
                }
                (before, here) = (here, after);
            }
        }
    }

    /// Every passage that a [`Margin`] needs.
    fn passages(&self, stable: bool, blocks: &[Block], mut found: impl FnMut(Border, usize)) {
        let chords = self.re.len() - 1;
        // The chord to a real end crosses nothing.
        let crossing = if self.ends_real { chords - 1 } else { chords };
        let mut narrows = stable;
        for (number, block) in blocks.iter().enumerate() {
            let start = number * BLOCK;
            let end = (start + BLOCK).min(chords);
            let ends = |i: usize, over: fn(Complex<f64>) -> f64| {
                [i, i + 1].map(|k| over(self.point(k)) < 0.0)
            };
            if block.marks & UNIT_GAIN != 0 {
                for i in start..end {
                    let [from, to] = ends(i, over_unit_gain);
                    if from != to {
                        found(Border::UnitGain, i);
                    }
                }
            }
            if narrows && block.marks & HALF_POWER != 0 {
                let first = (start..end).find(|&i| ends(i, over_half_power) == [false, true]);
                narrows = first.is_none();
                first.into_iter().for_each(|i| found(Border::HalfPower, i));
            }
            if stable && block.marks & REAL != 0 {
                for i in start..end.min(crossing) {
                    let [from, to] = ends(i, |value| value.im);
                    if from != to && (self.re[i] < 0.0 || self.re[i + 1] < 0.0) {
                        found(Border::RealAxis, i);
                    }
                }
            }
        }
    }
}

impl Finds {
    /// Begins with other runs.
    pub(crate) fn clear(&mut self) {
        self.runs.clear();
        self.zeros.clear();
        self.minima.clear();
    }

    /// Looks for a run's distance from −1 alone.
    pub(crate) fn add_modulus(&mut self, curve: &Curve<'_>) {
        let (run, minima) = (self.runs.len(), &mut self.minima);
        let lowest = look_over(curve.re, curve.im, self.level, &mut self.blocks);
        let n = curve.re.len();
        let point = |i: usize| (curve.frequency[i], curve.point(i));
        curve.minima(lowest, &self.blocks, |i| {
            let middle = i.clamp(1, n - 2);
            minima.push(Minimum {
                run,
                three: [point(middle - 1), point(middle), point(middle + 1)],
                within: [i.saturating_sub(1), (i + 2).min(n - 1)].map(|i| curve.frequency[i]),
                found: (curve.frequency[i], f64::INFINITY),
            });
        });
        self.runs.push(Run {
            lowest: (curve.lowest(&self.blocks, lowest), lowest),
            stable: false,
            real_end: None,
            zeros: self.zeros.len(),
            minima: self.minima.len(),
        });
    }

    /// Looks for everything that a [`Margin`] needs.
    pub(crate) fn add(&mut self, curve: &Curve<'_>, stable: bool) {
        self.add_modulus(curve);
        let (run, zeros) = (self.runs.len() - 1, &mut self.zeros);
        let point = |i: usize| (curve.frequency[i], curve.point(i));
        curve.passages(stable, &self.blocks, |border, i| {
            zeros.push(Zero {
                run,
                border,
                ends: [point(i), point(i + 1)],
                found: point(i + 1),
            });
        });
        let end = curve.re[curve.re.len() - 1];
        if let Some(run) = self.runs.last_mut() {
            run.stable = stable;
            run.zeros = zeros.len();
            run.real_end = (curve.ends_real && end < 0.0).then_some(-end);
        }
    }

    /// Searches everything that there is to find.
    pub(crate) fn search(&mut self, response: &impl Response) {
        search(self.level, &mut self.zeros, &mut self.minima, response);
    }

    /// Margins of every run, frequencies in the unit of its curve.
    pub(crate) fn margins(&self) -> Vec<Margin> {
        let (mut zeros, mut minima) = (0, 0);
        let margin = |run: &Run| {
            let of_run = (
                &self.zeros[zeros..run.zeros],
                &self.minima[minima..run.minima],
            );
            (zeros, minima) = (run.zeros, run.minima);
            Margin::of(run, of_run.0, of_run.1)
        };
        self.runs.iter().map(margin).collect()
    }

    /// `min |1 + L|` of every run.
    pub(crate) fn moduli(&self) -> Vec<f64> {
        let mut minima = 0;
        let modulus = |run: &Run| {
            let of_run = &self.minima[minima..run.minima];
            minima = run.minima;
            run.closest(of_run).1.sqrt()
        };
        self.runs.iter().map(modulus).collect()
    }
}

impl Run {
    /// Frequency and value of the lowest of the minima, or of the points.
    fn closest(&self, minima: &[Minimum]) -> (f64, f64) {
        let minima = minima.iter().map(|minimum| minimum.found);
        minima.fold(
            self.lowest,
            |least, here| if here.1 < least.1 { here } else { least },
        )
    }
}

/// `|L|² − 1`.
fn over_unit_gain(value: Complex<f64>) -> f64 {
    value.norm_sqr() - 1.0
}

/// `|L − 1|² − 2`, above 0 where `|L/(1 + L)| > 1/√2`.
fn over_half_power(value: Complex<f64>) -> f64 {
    (value - 1.0).norm_sqr() - 2.0
}

/// True if the chord between two points `1 + L` may be a candidate.
fn is_near(from: Complex<f64>, to: Complex<f64>, lowest: f64) -> bool {
    let bound = NEAR * lowest;
    from.re * to.re + from.im * to.im < 0.0 || from.norm_sqr() <= bound || to.norm_sqr() <= bound
}

/// Looks over a curve, block by block: the least squared distance of a point from −1.
fn look_over(re: &[f64], im: &[f64], level: Level, blocks: &mut Vec<Block>) -> f64 {
    blocks.clear();
    with_four(
        level,
        #[inline(always)]
        || {
            let mut lowest = f64::INFINITY;
            for start in (0..re.len() - 1).step_by(BLOCK) {
                let block = Block::new(&filled(&re[start..]), &filled(&im[start..]));
                lowest = lowest.min(block.lowest);
                blocks.push(block);
            }
            lowest
        },
    )
}

/// The points of a block; behind the end of the curve, its last one.
#[inline(always)]
fn filled(points: &[f64]) -> [f64; BLOCK + 1] {
    match points.first_chunk() {
        Some(all) => *all,
        None => core::array::from_fn(|k| points[k.min(points.len() - 1)]),
    }
}

impl Block {
    /// Looks without a branch.
    #[inline(always)]
    fn new(re: &[f64; BLOCK + 1], im: &[f64; BLOCK + 1]) -> Self {
        let within = |re: f64, im: f64| (re - 1.0) * (re - 1.0) + im * im < 2.0;
        let mark = |holds: bool, mark: u64| if holds { mark } else { 0 };
        let distance = |k: usize| (1.0 + re[k]) * (1.0 + re[k]) + im[k] * im[k];
        let (mut marks, mut lowest) = (0, distance(BLOCK));
        for k in 0..BLOCK {
            let (r0, r1, i0, i1) = (re[k], re[k + 1], im[k], im[k + 1]);
            let passes = (r0 * r0 + i0 * i0 < 1.0) != (r1 * r1 + i1 * i1 < 1.0);
            marks |= mark(passes, UNIT_GAIN);
            marks |= mark(within(r0, i0) != within(r1, i1), HALF_POWER);
            marks |= mark((i0 < 0.0) != (i1 < 0.0), REAL);
            marks |= mark((1.0 + r0) * (1.0 + r1) + i0 * i1 < 0.0, WIDE);
            let here = distance(k);
            lowest = if here < lowest { here } else { lowest };
        }
        Self { marks, lowest }
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

    /// Reads what was found of a run.
    fn of(run: &Run, zeros: &[Zero], minima: &[Minimum]) -> Self {
        let (weakest, distance) = run.closest(minima);
        let (mut crossover, mut phase): (Option<f64>, Option<f64>) = (None, None);
        let mut bandwidth = None;
        // The largest |L| below 1 where L is negative; 0 without any.
        let mut magnitude = 0.0_f64;
        let mut negative = |at: f64| {
            if at < 1.0 {
                magnitude = magnitude.max(at);
            }
        };
        for zero in zeros {
            let (frequency, value) = zero.found;
            match zero.border {
                Border::UnitGain => {
                    let falls = over_unit_gain(zero.ends[0].1) >= 0.0;
                    if falls && crossover.is_none() {
                        crossover = Some(frequency);
                    }
                    // arg(−L): what turns L to −1.
                    let lag = libm::atan2(-value.im, -value.re);
                    if phase.is_none_or(|phase| lag.abs() < phase.abs()) {
                        phase = Some(lag);
                    }
                }
                Border::HalfPower => bandwidth = Some(frequency),
                Border::RealAxis if value.re < -NOTHING => negative(-value.re),
                Border::RealAxis => (),
            }
        }
        run.real_end.into_iter().for_each(negative);
        let stable = run.stable;
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

/// A modulus, below 0 where the loop is unstable.
pub(crate) fn signed(stable: bool, modulus: f64) -> f64 {
    if stable { modulus } else { -modulus }
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
