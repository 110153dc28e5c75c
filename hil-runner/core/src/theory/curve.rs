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
use fearless_simd::{Simd, f64x8};
use nalgebra::Complex;
use plant::widest;

use super::search::{Border, Minimum, Response, Zero, search};

/// Points of L.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve<'a> {
    /// Rising, in whatever unit; three points at least.
    pub(crate) frequency: &'a [f64],
    pub(crate) l: &'a Parts,
    /// The last point is the middle of a sampled spectrum, where L is
    /// real.
    pub(crate) ends_real: bool,
}

/// Real and imaginary parts, point by point.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Parts {
    pub(crate) re: Vec<f64>,
    pub(crate) im: Vec<f64>,
}

impl Parts {
    pub(crate) fn push(&mut self, value: Complex<f64>) {
        self.re.push(value.re);
        self.im.push(value.im);
    }

    pub(crate) fn clear(&mut self) {
        self.re.clear();
        self.im.clear();
    }

    pub(crate) fn point(&self, i: usize) -> Complex<f64> {
        Complex::new(self.re[i], self.im[i])
    }
}

/// What there is to find on the curves of some runs: in room that is kept.
#[derive(Debug, Default)]
pub(crate) struct Finds {
    runs: Vec<Run>,
    blocks: Vec<Block>,
    zeros: Vec<Zero>,
    minima: Vec<Minimum>,
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
    /// The frequency and L of a point.
    fn point(&self, i: usize) -> (f64, Complex<f64>) {
        (self.frequency[i], self.l.point(i))
    }

    /// Frequency of the point nearest to −1, from its squared distance.
    fn lowest(&self, blocks: &[Block], lowest: f64) -> f64 {
        let mut ends = each_bit(blocks, |block| block.near).flat_map(|i| [i, i + 1]);
        let place = ends.find(|&i| (self.l.point(i) + 1.0).norm_sqr() == lowest);
        self.frequency[place.unwrap_or(0)]
    }

    /// Squared distance of −1 from the chord behind point `i`.
    fn chord(&self, i: usize) -> f64 {
        let (from, to) = (self.l.point(i) + 1.0, self.l.point(i + 1) + 1.0);
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
        let distance = |i: usize| match blocks.get(i / BLOCK) {
            Some(block) if block.near >> (i % BLOCK) & 1 == 1 => self.chord(i),
            _ => f64::INFINITY,
        };
        for i in each_bit(blocks, |block| block.near) {
            let (before, here) = (
                i.checked_sub(1).map_or(f64::INFINITY, distance),
                self.chord(i),
            );
            // Of two chords that meet in the closest point, the first.
            if here <= bound && here < before && here <= distance(i + 1) {
                found(i);
            }
        }
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
        let re = &self.l.re;
        let crossing = re.len() - if self.ends_real { 2 } else { 1 };
        for i in each_bit(blocks, |block| block.real) {
            if i < crossing && (re[i] < 0.0 || re[i + 1] < 0.0) {
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
        let blocks = &mut self.blocks;
        let lowest = fearless_simd::dispatch!(widest(), simd => look_over(simd, curve.l, blocks));
        let n = curve.frequency.len();
        curve.minima(lowest, blocks, |i| {
            let middle = i.clamp(1, n - 2);
            minima.push(Minimum {
                run,
                three: [middle - 1, middle, middle + 1].map(|i| curve.point(i)),
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
        curve.passages(stable, &self.blocks, |border, i| {
            zeros.push(Zero {
                run,
                border,
                ends: [i, i + 1].map(|i| curve.point(i)),
                found: curve.point(i + 1),
            });
        });
        let end = curve.l.re[curve.l.re.len() - 1];
        if let Some(run) = self.runs.last_mut() {
            run.stable = stable;
            run.zeros.end = zeros.len();
            run.real_end = (curve.ends_real && end < 0.0).then_some(-end);
        }
    }

    /// Searches everything that there is to find.
    pub(crate) fn search(&mut self, response: &impl Response) {
        search(&mut self.zeros, &mut self.minima, response);
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
        let zeros = self.zeros[run.zeros.clone()].iter();
        let passing = |border| zeros.clone().filter(move |zero| zero.border == border);
        let falls = |zero: &&Zero| zero.ends[0].1.norm_sqr() >= 1.0;
        // arg(−L): what turns L to −1.
        let lag = |zero: &Zero| libm::atan2(-zero.found.1.im, -zero.found.1.re);
        let nearer = |lag: f64, other: f64| if other.abs() < lag.abs() { other } else { lag };
        let phase = passing(Border::UnitGain).map(lag).reduce(nearer);
        // The largest |L| below 1 where L is negative; 0 without any.
        let negative = passing(Border::RealAxis).map(|zero| -zero.found.1.re);
        let negative = negative.filter(|at| *at > NOTHING).chain(run.real_end);
        let magnitude = negative.filter(|at| *at < 1.0).fold(0.0, f64::max);
        let stable = run.stable;
        Margin {
            stable,
            modulus: distance.sqrt(),
            weakest_radps: weakest,
            phase_rad: phase.filter(|_| stable),
            gain: (stable && magnitude > 0.0).then(|| 1.0 / magnitude),
            crossover_radps: passing(Border::UnitGain)
                .find(falls)
                .map(|zero| zero.found.0),
            bandwidth_radps: passing(Border::HalfPower).next().map(|zero| zero.found.0),
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
fn look_over<S: Simd>(simd: S, l: &Parts, blocks: &mut Vec<Block>) -> f64 {
    let [zero, one, two] = [0.0, 1.0, 2.0].map(|number| f64x8::splat(simd, number));
    let ends = |start| {
        [start, start + 1].map(|at| (from_place(simd, &l.re, at), from_place(simd, &l.im, at)))
    };
    blocks.clear();
    let mut least = f64x8::splat(simd, f64::INFINITY);
    for start in (0..l.re.len() - 1).step_by(BLOCK) {
        let [from, to] = ends(start).map(|(re, im)| {
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
        let [(re_0, im_0), (re_1, im_1)] = ends(start).map(|(re, im)| (one + re, im));
        let near = [
            (re_0 * re_1 + im_0 * im_1).simd_lt(zero),
            (re_0 * re_0 + im_0 * im_0).simd_le(bound),
            (re_1 * re_1 + im_1 * im_1).simd_le(bound),
        ];
        let [wide, from, to] = near.map(|near| near.to_bitmask());
        // Behind the end there is none.
        let chords = BLOCK.min(l.re.len() - 1 - start);
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

/// Ratio of neighbouring frequencies before anything is refined.
pub(crate) const RATIO: f64 = 1.2;

/// Frequencies from the first on, each [`RATIO`] times the one before or as much as `most`
/// above it.
pub(crate) fn rising(first: f64, most: f64) -> impl Iterator<Item = f64> {
    core::iter::successors(Some(first), move |at| Some((at * RATIO).min(at + most)))
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
