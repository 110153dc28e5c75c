//! An affine system's exact steps over a sample and its halves, quarters, …,
//! each with a proven bound of how far a quantity strays from its chord.
//!
//! From `x` with `v = A·x + u` the exact step over t is
//!
//! ```text
//! x(t) = x + ψ(t)·v,   ψ(t) = ∫₀ᵗ e^{As} ds = Σ_{n≥1} A^(n−1)·tⁿ/n!,   ψ(2t) = (1 + e^{At})·ψ(t)
//! ```
//!
//! # The bound
//!
//! Let `q = f·x` be a quantity and T the length of a step. Its deviation from
//! the chord between the ends is linear in v:
//!
//! ```text
//! q(t) − [q(0) + t/T·(q(T) − q(0))] = g_T(t)·v,   g_T(t) = f·ψ(t) − t/T·f·ψ(T)
//! ```
//!
//! so `|deviation| ≤ Σ_j H_T,j·|v_j|` for every H_T with `H_T,j ≥ sup_t |g_T,j(t)|`.
//! Such an H is found without sampling, from short steps to long ones.
//!
//! *Shortest step h.* g_h is zero at both ends and `g_h'' = f·e^{At}·A`. A
//! function exceeds the larger of its ends by at most `h²/8·sup|g''|`, and
//! entry by entry `|e^{At}| ≤ e^{|A|h}`. Hence `H_h = h²/8·|f|·e^{|A|h}·|A|`.
//!
//! *Twice as long.* With T = 2τ and `d = f·ψ(τ) − ½·f·ψ(2τ)`, the deviation in
//! the middle: on the first half `g_T(t) = g_τ(t) + t/τ·d`; on the second, as
//! `ψ(τ + s) = ψ(τ) + ψ(s)·e^{Aτ}`, `g_T(τ + s) = g_τ(s)·e^{Aτ} + (1 − s/τ)·d`.
//! Hence `H_2τ = max(H_τ, H_τ·|e^{Aτ}|) + |d|`, the maximum entry by entry.
//! For a parabola this is 4/3 of the truth, whatever the number of halvings.
//!
//! *Slopes.* The same for `T·g_T'`, by which the slope of q strays from that of
//! its chord: at the start `E_h = h²/2·|f|·e^{|A|h}·|A|`, and then
//! `E_2τ = 2·max(E_τ, E_τ·|e^{Aτ}|) + 2·|d|`. A quantity that changes by more
//! than `Σ_j E_j·|v_j|` over a step is monotone within it.
//!
//! If both ends of a guard lie further from zero, on the positive side, than
//! `Σ_j H_j·|v_j|`, the guard has no zero in between.
//!
//! # The series
//!
//! The last of the steps is so short that the Taylor series converges at once.
//! With `v = A·x + u` the solution is `x(t) = x(0) + Σ_{n≥1} A^(n−1)·v·tⁿ/n!`.
//! With
//!
//! ```text
//! λ = max_i (|A|·w)_i / w_i     for a positive w
//! ```
//!
//! the norm `|v|_w = max_i |v_i|/w_i` of `A^n·v` is at most `λ^n·|v|_w`, and
//! with `λ·h ≤ 1` what [`TERMS`] terms leave out is at most
//! `h·|v|_w·(λh)^16/17!·(1 + 1/17) < 4e-15·h·|v|_w`: what rounding leaves too.

use std::sync::OnceLock;

use fearless_simd::Simd;

use super::sums::{add_times, times};
use super::system::{Column, Matrix};
use crate::numerics::vectors::{in_fours, widest};

/// Terms after the constant one.
pub(crate) const TERMS: usize = 16;

/// Coefficients of a polynomial in θ = t/h.
pub(crate) type Coefficients = [f64; TERMS + 1];

/// `x(θ·h) = Σ c_n·θⁿ`, 0 ≤ θ ≤ 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Taylor<const D: usize> {
    terms: [Column<D>; TERMS + 1],
}

impl<const D: usize> Taylor<D> {
    /// The series from `x` with `rate = A·x + u`, over `length_s`.
    pub(crate) fn new(a: &Matrix<D>, x: &Column<D>, rate: &Column<D>, length_s: f64) -> Self {
        in_fours!(widest(), simd => Self::with(simd, a, (x, rate), length_s))
    }

    #[inline(always)]
    fn with(
        simd: impl Simd,
        a: &Matrix<D>,
        (x, rate): (&Column<D>, &Column<D>),
        length_s: f64,
    ) -> Self {
        let mut terms = [*x; TERMS + 1];
        let mut term = rate * length_s;
        for (n, slot) in (1_u32..).zip(terms.iter_mut().skip(1)) {
            *slot = term;
            term = times(simd, a, &term) * (length_s / f64::from(n + 1));
        }
        Self { terms }
    }

    /// The state at θ, by Horner's rule.
    pub(crate) fn at(&self, theta: f64) -> Column<D> {
        let mut x = self.terms[TERMS];
        for term in self.terms.iter().rev().skip(1) {
            x = x * theta + term;
        }
        x
    }

    /// `row·x` as a polynomial in θ.
    pub(crate) fn quantity(&self, row: &Column<D>) -> Coefficients {
        let mut coefficients = [0.0; TERMS + 1];
        for (c, term) in coefficients.iter_mut().zip(&self.terms) {
            *c = row.dot(term);
        }
        coefficients
    }
}

/// `ψ(h) = Σ_{n≥1} A^(n−1)·hⁿ/n!` by its series, for a short h.
pub(crate) fn integral<const D: usize>(a: &Matrix<D>, length_s: f64) -> Matrix<D> {
    in_fours!(widest(), simd => integral_with(simd, a, length_s))
}

#[inline(always)]
fn integral_with<const D: usize>(simd: impl Simd, a: &Matrix<D>, length_s: f64) -> Matrix<D> {
    // ψ = h·(1 + Ah/2·(1 + Ah/3·(…))): Horner's rule from the smallest term.
    // Most entries of an axis' A are zero.
    let scaled = a * length_s;
    let entry = |place| (place % D, place / D, scaled[place]);
    let entries: Vec<_> = (0..D * D).map(entry).filter(|e| e.2 != 0.0).collect();
    let mut sum: [[f64; D]; D] = Matrix::<D>::identity().into();
    for n in (2..=20_u32).rev() {
        let mut product = [[0.0; D]; D];
        for &(i, k, value) in &entries {
            add_times(simd, &mut product[i], &sum[k], value);
        }
        for (i, (row, product)) in sum.iter_mut().zip(&product).enumerate() {
            for (j, (sum, product)) in row.iter_mut().zip(product).enumerate() {
                *sum = if i == j { 1.0 } else { 0.0 } + product / f64::from(n);
            }
        }
    }
    Matrix::from_fn(|i, j| sum[i][j]) * length_s
}

/// `λ` of the bound above: an upper bound of the spectral radius of |A| that
/// no scaling of the states can spoil; no lower than where it is known to be at most
/// `enough`. The weights come from iterating `w ← |A|·w + small`, which turns w towards
/// the Perron vector of |A|; any positive w gives a bound.
pub(super) fn growth_down_to<const D: usize>(a: &Matrix<D>, enough: f64) -> f64 {
    in_fours!(widest(), simd => growth_with(simd, a, enough))
}

#[inline(always)]
fn growth_with<const D: usize>(simd: impl Simd, a: &Matrix<D>, enough: f64) -> f64 {
    let magnitude = a.abs();
    let mut w = Column::<D>::repeat(1.0);
    let mut bound = f64::INFINITY;
    for _ in 0..64 {
        let next = times(simd, &magnitude, &w);
        let mut lambda = 0.0_f64;
        for (grown, weight) in next.iter().zip(w.iter()) {
            lambda = lambda.max(grown / weight);
        }
        bound = bound.min(lambda);
        if bound <= enough {
            break;
        }
        // Half of the old keeps cyclic matrices from swinging to and fro and
        // every weight above zero.
        let scale = lambda.max(f64::MIN_POSITIVE);
        w = next / scale + w * 0.5;
        w /= w.max();
        w.apply(|weight| *weight = weight.max(1e-250));
    }
    bound
}

/// Factor that the bounds are raised by, so that their own rounding cannot make them
/// too small.
pub(crate) const BOUND_MARGIN: f64 = 1.0 + 1e-9;

/// Units in the last place of the terms of δ that its rounding may reach.
pub(crate) const NOISE_ULPS: f64 = 4.0 * f64::EPSILON;

/// Halvings of a sample after which the system is called too stiff. 2^40 of
/// them would take hours; the walk's own limit is reached long before.
const MOST_HALVINGS: usize = 40;

/// One exact step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExactStep<const D: usize> {
    pub(crate) length_s: f64,
    /// `ψ(T)`.
    pub(crate) integral: Matrix<D>,
    /// `e^{AT}`.
    pub(crate) transition: Matrix<D>,
}

/// Exact steps of length T, T/2, … T/2^L, the last so short that the Taylor
/// series of [`super::levels`] holds over it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Levels<const D: usize> {
    pub(crate) a: Matrix<D>,
    /// The longest first.
    pub(crate) steps: Vec<ExactStep<D>>,
    /// Transposes of |A| and `e^{|A|h}` with the length h of the shortest.
    magnitude: Matrix<D>,
    grown: Matrix<D>,
    /// Transposes of `ψ(τ) − ½·ψ(2τ)` and of `|e^{Aτ}|`, τ half of each step but the shortest.
    halves: Vec<[Matrix<D>; 2]>,
    /// Transposes of `e^{AT/2}` and `A·T/2` of the longest, made when first asked for.
    middle: OnceLock<[Matrix<D>; 2]>,
}

/// Bounds of a quantity's deviation from its chord: `|v|` is multiplied with this and summed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChordBounds<const D: usize> {
    /// `H` of every level.
    pub(crate) per_rate: Vec<Column<D>>,
    /// `E` of every level.
    pub(crate) slope_per_rate: Vec<Column<D>>,
}

/// Halvings of the longest step from which on a table is stiff: a walk over one of
/// fewer takes some thousand steps at most.
const STIFF: usize = 12;

/// The part of a step that the Taylor series holds over \[s\], λ being the growth, and
/// how often the step is halved down to it.
fn leaf(growth_per_s: f64, mut length_s: f64) -> (f64, usize) {
    let mut halvings = 0;
    while growth_per_s * length_s > 1.0 && halvings < MOST_HALVINGS {
        length_s *= 0.5;
        halvings += 1;
    }
    (length_s, halvings)
}

/// True if a time constant is shorter than a 2,048th of a step, as far as λ tells.
pub(crate) fn is_stiff<const D: usize>(a: &Matrix<D>, length_s: f64) -> bool {
    let most = f64::from(1_u32 << (STIFF - 1)) / length_s;
    leaf(growth_down_to(a, most), length_s).1 >= STIFF
}

impl<const D: usize> Levels<D> {
    /// True if a time constant is shorter than a 2,048th of the longest step, likewise.
    pub(crate) fn is_stiff(&self) -> bool {
        self.steps.len() > STIFF
    }

    /// The steps of a system over `length_s` and its binary fractions.
    pub(crate) fn new(a: &Matrix<D>, length_s: f64) -> Self {
        // Of less growth than one over the step nothing is halved.
        let growth_per_s = growth_down_to(a, 1.0 / length_s);
        let (leaf_s, halvings) = leaf(growth_per_s, length_s);
        let shortest = integral(a, leaf_s);
        let mut step = ExactStep {
            length_s: leaf_s,
            integral: shortest,
            transition: Matrix::identity() + a * shortest,
        };
        let mut steps = vec![step];
        for _ in 0..halvings {
            step = ExactStep {
                length_s: 2.0 * step.length_s,
                integral: step.integral + step.transition * step.integral,
                transition: step.transition * step.transition,
            };
            steps.push(step);
        }
        steps.reverse();
        let magnitude = a.abs();
        let halves = steps.windows(2).map(|pair| {
            let middle = pair[1].integral - pair[0].integral * 0.5;
            [middle.transpose(), pair[1].transition.abs().transpose()]
        });
        Self {
            a: *a,
            halves: halves.collect(),
            middle: OnceLock::new(),
            steps,
            // e^{|A|h} = 1 + |A|·ψ_|A|(h)
            grown: (Matrix::identity() + magnitude * integral(&magnitude, leaf_s)).transpose(),
            magnitude: magnitude.transpose(),
        }
    }

    /// The shortest of the steps that is no shorter than a piece, and how often its bound of a
    /// chord must be taken for the piece: twice where that is shorter, as its chord lies up to
    /// once the deviation from the longer one's.
    pub(super) fn over(&self, length_s: f64) -> (usize, f64) {
        if length_s == self.steps[0].length_s {
            return (0, 1.0);
        }
        let longer = self.steps.iter().take_while(|s| s.length_s >= length_s);
        let level = longer.count().saturating_sub(1);
        let whole = self.steps[level].length_s == length_s;
        (level, if whole { 1.0 } else { 2.0 })
    }

    /// Transposes of `e^{AT/2}` and `A·T/2` of the longest step.
    pub(super) fn middle(&self) -> &[Matrix<D>; 2] {
        self.middle.get_or_init(|| {
            let (a, half_s) = (&self.a, 0.5 * self.steps[0].length_s);
            let half = match self.steps.get(1) {
                Some(step) => step.transition,
                None => Matrix::identity() + a * integral(a, half_s),
            };
            [half.transpose(), (a * half_s).transpose()]
        })
    }

    /// The bounds for a quantity with coefficients `row`.
    pub(crate) fn bounds(&self, row: &Column<D>) -> ChordBounds<D> {
        in_fours!(widest(), simd => self.bounds_with(simd, row))
    }

    #[inline(always)]
    fn bounds_with(&self, simd: impl Simd, row: &Column<D>) -> ChordBounds<D> {
        let h = self.steps[self.steps.len() - 1].length_s;
        let grown = times(simd, &self.grown, &row.abs());
        let curvature = times(simd, &self.magnitude, &grown) * (h * h);
        let (mut chord, mut slope) = (curvature / 8.0, curvature / 2.0);
        let (mut per_rate, mut slope_per_rate) = (vec![chord], vec![slope]);
        for [middle, carry] in self.halves.iter().rev() {
            // d = f·ψ(τ) − ½·f·ψ(2τ)
            let d = times(simd, middle, row).abs();
            chord = chord.sup(&times(simd, carry, &chord)) + d;
            slope = (slope.sup(&times(simd, carry, &slope)) + d) * 2.0;
            per_rate.push(chord);
            slope_per_rate.push(slope);
        }
        per_rate.reverse();
        slope_per_rate.reverse();
        ChordBounds {
            per_rate,
            slope_per_rate,
        }
    }
}

impl<const D: usize> ChordBounds<D> {
    /// Bound of the deviation over a step of level `level` that begins with
    /// `rate`.
    pub(crate) fn over(&self, level: usize, rate: &Column<D>) -> f64 {
        self.per_rate[level].dot(&rate.abs())
    }

    /// Change over a step of level `level` above which a quantity is monotone.
    pub(crate) fn slope_over(&self, level: usize, rate: &Column<D>) -> f64 {
        self.slope_per_rate[level].dot(&rate.abs())
    }
}
