//! A response `L(jω)` at rising frequencies, and its distance from instability.
//!
//! The modulus margin `min |1 + L|` is the distance of the Nyquist curve from
//! −1, the reciprocal of the sensitivity's peak M_s (Åström and Wittenmark,
//! "Computer-Controlled Systems", 3.4 and 5.5). 0.5 and more is a sound loop. One
//! number covers gain and phase at once: a loop with modulus m endures any gain
//! from 1/(1+m) to 1/(1−m) and a lag of 2·asin(m/2).
//!
//! Nothing happens on most of a curve: it is first looked over without a branch, and
//! only chords with a mark are searched, those of several curves side by side. [`refined`]
//! chooses the frequencies: closer where the response bends.

use core::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f64x8};
use nalgebra::Complex;
use plant::widest;

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
#[derive(Debug, Clone)]
struct Run {
    /// The point nearest to −1: its frequency and squared distance.
    lowest: (f64, f64),
    stable: bool,
    /// |L| in the middle of the spectrum, where L is negative there.
    real_end: Option<f64>,
    /// Places of its zeros and its minima among all.
    zeros: Range<usize>,
    minima: Range<usize>,
}

/// What there is to find in a block of chords: bit i for the one behind its point i.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// |L| passes 1.
    unit_gain: u64,
    /// |L/(1 + L)| falls below 1/√2.
    half_power: u64,
    /// L passes the real axis.
    real: u64,
    /// The chord may come nearest to −1.
    near: u64,
}

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

    /// Frequency of the point nearest to −1, from its squared distance.
    fn lowest(&self, blocks: &[Block], lowest: f64) -> f64 {
        let mut ends = each_bit(blocks, |block| block.near).flat_map(|i| [i, i + 1]);
        let place = ends.find(|&i| (self.point(i) + 1.0).norm_sqr() == lowest);
        self.frequency[place.unwrap_or(0)]
    }

    /// Squared distance of −1 from the chord behind point `i`.
    fn chord(&self, i: usize) -> f64 {
        let (from, to) = (self.point(i) + 1.0, self.point(i + 1) + 1.0);
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
        // Chords that are not near are farther than all that are looked for.
        let far = f64::INFINITY;
        let (mut place, mut before, mut here) = (self.re.len(), far, far);
        let mut look = |i: usize, before: f64, here: f64, after: f64| {
            // Of two chords that meet in the closest point, the first.
            if here < before && here <= after && here <= bound {
                found(i);
            }
        };
        for i in each_bit(blocks, |block| block.near) {
            let next = self.chord(i);
            if i == place + 1 {
                look(place, before, here, next);
                before = here;
            } else {
                look(place, before, here, far);
                before = far;
            }
            (place, here) = (i, next);
        }
        look(place, before, here, far);
    }

    /// Every passage that a [`Margin`] needs.
    fn passages(&self, stable: bool, blocks: &[Block], mut found: impl FnMut(Border, usize)) {
        each_bit(blocks, |block| block.unit_gain).for_each(|i| found(Border::UnitGain, i));
        if !stable {
            return;
        }
        if let Some(i) = each_bit(blocks, |block| block.half_power).next() {
            found(Border::HalfPower, i);
        }
        // The chord to a real end crosses nothing.
        let crossing = self.re.len() - if self.ends_real { 2 } else { 1 };
        for i in each_bit(blocks, |block| block.real) {
            if i < crossing && (self.re[i] < 0.0 || self.re[i + 1] < 0.0) {
                found(Border::RealAxis, i);
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
        let (first, zeros) = (minima.len(), self.zeros.len());
        let (level, blocks) = (self.level, &mut self.blocks);
        let lowest = fearless_simd::dispatch!(level, simd => look_over(simd, curve, blocks));
        let n = curve.re.len();
        let point = |i: usize| (curve.frequency[i], curve.point(i));
        curve.minima(lowest, blocks, |i| {
            let middle = i.clamp(1, n - 2);
            minima.push(Minimum {
                run,
                three: [point(middle - 1), point(middle), point(middle + 1)],
                within: [i.saturating_sub(1), (i + 2).min(n - 1)].map(|i| curve.frequency[i]),
                found: (curve.frequency[i], f64::INFINITY),
            });
        });
        self.runs.push(Run {
            lowest: (curve.lowest(blocks, lowest), lowest),
            stable: false,
            real_end: None,
            zeros: zeros..zeros,
            minima: first..minima.len(),
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
            run.zeros.end = zeros.len();
            run.real_end = (curve.ends_real && end < 0.0).then_some(-end);
        }
    }

    /// Searches everything that there is to find.
    pub(crate) fn search(&mut self, response: &impl Response) {
        search(self.level, &mut self.zeros, &mut self.minima, response);
    }

    /// Margins of every run, frequencies in the unit of its curve.
    pub(crate) fn margins(&self) -> Vec<Margin> {
        self.runs.iter().map(|run| self.margin(run)).collect()
    }

    /// `min |1 + L|` of every run.
    pub(crate) fn moduli(&self) -> Vec<f64> {
        let runs = self.runs.iter();
        runs.map(|run| self.closest(run).1.sqrt()).collect()
    }

    /// Reads what was found of a run.
    fn margin(&self, run: &Run) -> Margin {
        let (weakest, distance) = self.closest(run);
        let (mut crossover, mut phase): (Option<f64>, Option<f64>) = (None, None);
        let mut bandwidth = None;
        // The largest |L| below 1 where L is negative; 0 without any.
        let mut magnitude = 0.0_f64;
        let mut negative = |at: f64| {
            if at < 1.0 {
                magnitude = magnitude.max(at);
            }
        };
        for zero in &self.zeros[run.zeros.clone()] {
            let (frequency, value) = zero.found;
            match zero.border {
                Border::UnitGain => {
                    let falls = zero.ends[0].1.norm_sqr() >= 1.0;
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
        Margin {
            stable,
            modulus: distance.sqrt(),
            weakest_radps: weakest,
            phase_rad: phase.filter(|_| stable),
            gain: (stable && magnitude > 0.0).then(|| 1.0 / magnitude),
            crossover_radps: crossover,
            bandwidth_radps: bandwidth,
        }
    }

    /// Frequency and value of the lowest of a run's minima, or of its points.
    fn closest(&self, run: &Run) -> (f64, f64) {
        let minima = self.minima[run.minima.clone()].iter();
        let found = minima.map(|minimum| minimum.found);
        found.fold(run.lowest, |a, b| if b.1 < a.1 { b } else { a })
    }
}

/// The chords of a curve with a bit set, by their first point.
fn each_bit(blocks: &[Block], of: impl Fn(&Block) -> u64) -> impl Iterator<Item = usize> {
    blocks.iter().enumerate().flat_map(move |(number, block)| {
        let bits =
            core::iter::successors(Some(of(block)), |bits| Some(bits & bits.wrapping_sub(1)));
        let bits = bits.take_while(|bits| *bits != 0);
        bits.map(move |bits| number * BLOCK + bits.trailing_zeros() as usize)
    })
}

/// Looks over a curve without a branch: the least squared distance of a point from −1.
#[inline(always)]
fn look_over<S: Simd>(simd: S, curve: &Curve<'_>, blocks: &mut Vec<Block>) -> f64 {
    let [zero, one, two] = [0.0, 1.0, 2.0].map(|number| f64x8::splat(simd, number));
    blocks.clear();
    let mut least = f64x8::splat(simd, f64::INFINITY);
    for start in (0..curve.re.len() - 1).step_by(BLOCK) {
        let sides = [start, start + 1].map(|place| {
            let re = from_place(simd, curve.re, place);
            let im = from_place(simd, curve.im, place);
            let (before, behind) = (re - one, one + re);
            let distance = behind * behind + im * im;
            least = distance.simd_lt(least).select(distance, least);
            [
                (re * re + im * im).simd_lt(one),
                (before * before + im * im).simd_lt(two),
                im.simd_lt(zero),
            ]
            .map(|side| side.to_bitmask())
        });
        let [from, to] = sides;
        blocks.push(Block {
            unit_gain: from[0] ^ to[0],
            half_power: !from[1] & to[1],
            real: from[2] ^ to[2],
            near: 0,
        });
    }
    let least: [f64; BLOCK] = least.into();
    let lowest = least.into_iter().fold(f64::INFINITY, f64::min);
    let bound = f64x8::splat(simd, NEAR * lowest);
    for (number, block) in blocks.iter_mut().enumerate() {
        let start = number * BLOCK;
        let [(re_0, im_0), (re_1, im_1)] = [start, start + 1].map(|place| {
            let re = from_place(simd, curve.re, place);
            let im = from_place(simd, curve.im, place);
            (one + re, im)
        });
        let near = [
            (re_0 * re_1 + im_0 * im_1).simd_lt(zero),
            (re_0 * re_0 + im_0 * im_0).simd_le(bound),
            (re_1 * re_1 + im_1 * im_1).simd_le(bound),
        ];
        let [wide, from, to] = near.map(|near| near.to_bitmask());
        // Behind the end there is none.
        let chords = BLOCK.min(curve.re.len() - 1 - start);
        block.near = (wide | from | to) & u64::MAX >> (u64::BITS as usize - chords);
    }
    lowest
}

/// As many points as a block has, from a place on; behind the end of the curve, its last one.
#[inline(always)]
fn from_place<S: Simd>(simd: S, points: &[f64], place: usize) -> f64x8<S> {
    let last = points.len() - 1;
    match points[place..].first_chunk::<BLOCK>() {
        Some(all) => f64x8::from_slice(simd, all),
        None => {
            let rest: [f64; BLOCK] = core::array::from_fn(|k| points[(place + k).min(last)]);
            f64x8::from_slice(simd, &rest)
        }
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
