//! Heat of the joint's damper, `∫ c·ε̇² dt`, along the exact
//! solution and without a discretisation error; likewise that of the armature,
//! `∫ R·I² dt`, and of a linear resistance, `∫ p·a1·γ̇² dt`.
//!
//! Within a mode the input u is constant, so that the rates `v = ẋ = A·x + u`
//! obey `v̇ = A·v`, and ε̇ is one of them, that of δ. Over a stretch of length T
//! that begins with the rates v
//!
//! ```text
//! ∫₀ᵀ ε̇² dt = vᵀ·W(T)·v,   W(T) = ∫₀ᵀ e^{Aᵀt}·f·fᵀ·e^{At} dt,   f the unit vector of δ
//! ```
//!
//! W is kept as an upper triangle R with `W = RᵀR`, which makes the integral the
//! sum of squares `|R·v|²`: nothing cancels, and it is never negative.
//!
//! *Why not at the ends alone.* With `AᵀP + PA = −f·fᵀ` the same integral is
//! `v(0)ᵀ·P·v(0) − v(T)ᵀ·P·v(T)`, and the sum over a closed joint telescopes. But
//! there is no P where two eigenvalues of A add up to zero (a stuck screw, a
//! resistance that drives the carriage), and with a weak motor or a small c the
//! two terms are nearly equal and large. R(T) exists for every A.
//!
//! *How R is made.* Over the shortest step h of [`super::levels`] by Gauss's rule:
//! each row of R(h) before it is made triangular is `√w_i·f·e^{A·θ_i·h}`, and eight
//! nodes do as `λ·h ≤ 1`. Over twice the length, as `W(2τ) = W(τ) +
//! e^{Aᵀτ}·W(τ)·e^{Aτ}`, R(2τ) is the triangle of R(τ) above `R(τ)·e^{Aτ}`. Rows
//! are taken in by Givens rotations, which do not square what is small.
//!
//! *A quantity that is no rate.* I and γ̇ are sums `q = f·x` of the states. With q itself
//! ahead of the rates, `z = (q, v)` obeys `q̇ = f·v`, `v̇ = A·v`: the same with f the unit
//! vector of q. The first row of `RᵀR·z` is then `∫ q dt`, as the first column of
//! e^{At} is a 1 above zeros: `R₀₀·(R·z)₀`. For I that is the charge, and times a held
//! voltage the electrical energy.

use super::levels::{ExactStep, Levels, TERMS};
use super::system::{Column, DELTA, HELD, Matrix};
use crate::model::axis::Axis;
use crate::model::state::BETA_DOT;
use crate::numerics::GAUSS_8;
use crate::numerics::width::{One, Width};

/// The states under a held voltage that drive something: β̇, δ, ε̇ and I.
pub(crate) const DRIVING: usize = 4;

/// I and the rates of these: what makes the heat of the armature.
pub(crate) const PARTS: usize = DRIVING + 1;

/// Place of δ among them.
const DRIVING_DELTA: usize = DELTA - BETA_DOT;

/// One of the exact steps, for the rates.
#[derive(Debug, Clone, PartialEq)]
struct Leg<const N: usize> {
    length_s: f64,
    transition: Matrix<N>,
    /// R of this length, upper triangular.
    factor: Matrix<N>,
}

/// Matrices that make the loss of a stretch from the rates at its start.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dissipation<const N: usize> {
    /// What the square is multiplied with: c \[N m s/rad\], R \[Ω\], p·a1.
    pub(crate) coefficient: f64,
    /// Exact steps, the longest first.
    legs: Vec<Leg<N>>,
    /// `f·Aⁿ·hⁿ/n!` with the length h of the shortest.
    series: [Column<N>; TERMS + 1],
}

impl Dissipation<DRIVING> {
    /// That of a joint in contact under a held voltage, whose β drives nothing;
    /// `None` without damping.
    pub(super) fn held(axis: &Axis, levels: &Levels<HELD>) -> Option<Self> {
        let driving = |m: &Matrix<HELD>| m.fixed_view::<4, 4>(BETA_DOT, BETA_DOT).into_owned();
        let c = axis.joint?.damping_nms_per_rad;
        let transition = |step: &ExactStep<HELD>| driving(&step.transition);
        let rates = driving(&levels.a);
        (c != 0.0).then(|| Self::new(c, levels, &rates, transition, DRIVING_DELTA))
    }
}

impl<const N: usize> Dissipation<N> {
    /// The same where all states drive.
    pub(super) fn of_all(axis: &Axis, levels: &Levels<N>) -> Option<Self> {
        let c = axis.joint?.damping_nms_per_rad;
        (c != 0.0).then(|| Self::new(c, levels, &levels.a, |step| step.transition, DELTA))
    }

    /// That of `f·x`, which stands ahead of the rates of the last N − 1 states; the
    /// others drive nothing.
    pub(super) fn of_quantity<const D: usize>(
        coefficient: f64,
        levels: &Levels<D>,
        f: &Column<D>,
    ) -> Self {
        let rates = behind(0.0, f, &levels.a);
        let transition = |step: &ExactStep<D>| {
            let growth = step.integral.transpose() * f;
            behind(1.0, &growth, &step.transition)
        };
        Self::new(coefficient, levels, &rates, transition, 0)
    }

    /// Of the states that count, `rates` is A and `transition` makes e^{At}; the quantity
    /// is the rate of number `place` of them.
    fn new<const D: usize>(
        coefficient: f64,
        levels: &Levels<D>,
        rates: &Matrix<N>,
        transition: impl Fn(&ExactStep<D>) -> Matrix<N>,
        place: usize,
    ) -> Self {
        let shortest_s = levels.steps[levels.steps.len() - 1].length_s;
        let series = series(rates, place, shortest_s);
        let mut factor = shortest_factor(&series, shortest_s);
        let mut legs: Vec<Leg<N>> = Vec::new();
        for step in levels.steps.iter().rev() {
            if let Some(half) = legs.last() {
                factor = doubled(&half.factor, &half.transition);
            }
            legs.push(Leg {
                length_s: step.length_s,
                transition: transition(step),
                factor,
            });
        }
        legs.reverse();
        Self {
            coefficient,
            legs,
            series,
        }
    }

    /// The coefficient and R of the longest step.
    pub(crate) fn whole(&self) -> (f64, Matrix<N>) {
        let factor = self.legs.first().map_or(Matrix::zeros(), |leg| leg.factor);
        (self.coefficient, factor)
    }

    /// The heat \[J\] over `length_s`, at most that of the longest step,
    /// from where the rates are `rate`.
    pub(crate) fn over(&self, rate: Column<N>, length_s: f64) -> f64 {
        self.with_integral(One, rate.into(), length_s)[0]
    }

    /// The same in every lane, and `∫ q dt` where q stands ahead of the rates.
    #[inline(always)]
    pub(crate) fn with_integral<W: Width>(
        &self,
        w: W,
        mut rate: [W::Vector; N],
        length_s: W::Vector,
    ) -> [W::Vector; 2] {
        let (zero, coefficient) = (w.splat(0.0), w.splat(self.coefficient));
        let (mut sum, mut integral, mut left_s) = (zero, zero, length_s);
        for leg in &self.legs {
            let leg_s = w.splat(leg.length_s);
            let takes = w.at_most(leg_s, left_s);
            if w.bits(takes) == 0 {
                continue;
            }
            let (squared, first) = squared(w, &leg.factor, &rate);
            let more = w.splat(leg.factor[(0, 0)]) * first;
            sum = w.select(takes, sum + squared, sum);
            integral = w.select(takes, integral + more, integral);
            left_s = w.select(takes, left_s - leg_s, left_s);
            if w.bits(w.greater(left_s, zero)) == 0 {
                return [coefficient * sum, integral];
            }
            let end = times(w, &leg.transition, &rate);
            for (rate, end) in rate.iter_mut().zip(end) {
                *rate = w.select(takes, end, *rate);
            }
        }
        let [squared, rest] = self.over_rest(w, &rate, left_s);
        let goes_on = w.greater(left_s, zero);
        sum = w.select(goes_on, sum + squared, sum);
        integral = w.select(goes_on, integral + rest, integral);
        [coefficient * sum, integral]
    }

    /// `∫ q² dt` and `∫ q dt` over less than the shortest step.
    #[inline(always)]
    fn over_rest<W: Width>(
        &self,
        w: W,
        rate: &[W::Vector; N],
        length_s: W::Vector,
    ) -> [W::Vector; 2] {
        let zero = w.splat(0.0);
        let Some(shortest) = self.legs.last() else {
            return [zero; 2];
        };
        // q(θ·h) = Σ (f·Aⁿ·hⁿ/n!·v)·θⁿ
        let end = length_s / w.splat(shortest.length_s);
        // Node beside node, as none waits for the other.
        let mut thetas = [end; GAUSS_8.len()];
        for (at, (theta, _)) in thetas.iter_mut().zip(GAUSS_8) {
            *at = w.splat(theta) * end;
        }
        let mut values = [zero; GAUSS_8.len()];
        for row in self.series.iter().rev() {
            let mut c = w.splat(row[0]) * rate[0];
            for j in 1..N {
                c = c + w.splat(row[j]) * rate[j];
            }
            for (q, theta) in values.iter_mut().zip(thetas) {
                *q = *q * theta + c;
            }
        }
        let (mut sum, mut integral) = (zero, zero);
        for (q, (_, weight)) in values.into_iter().zip(GAUSS_8) {
            sum = sum + w.splat(weight) * (q * q);
            integral = integral + w.splat(weight) * q;
        }
        [sum * length_s, integral * length_s]
    }
}

/// What f and the states' matrix are with q ahead of the rates of the last states: q
/// itself is `own` times as large.
fn behind<const D: usize, const N: usize>(own: f64, f: &Column<D>, m: &Matrix<D>) -> Matrix<N> {
    let first = D + 1 - N;
    let mut all = Matrix::<N>::zeros();
    all[(0, 0)] = own;
    for j in 1..N {
        all[(0, j)] = f[first + j - 1];
        for i in 1..N {
            all[(i, j)] = m[(first + i - 1, first + j - 1)];
        }
    }
    all
}

/// `|R·v|²`, in this order, and the first of `R·v`.
#[inline(always)]
fn squared<W: Width, const N: usize>(
    w: W,
    factor: &Matrix<N>,
    rate: &[W::Vector; N],
) -> (W::Vector, W::Vector) {
    let zero = w.splat(0.0);
    let (mut sum, mut first) = (zero, zero);
    for i in 0..N {
        let mut part = w.splat(factor[(i, i)]) * rate[i];
        for j in i + 1..N {
            part = part + w.splat(factor[(i, j)]) * rate[j];
        }
        if i == 0 {
            first = part;
        }
        sum = sum + part * part;
    }
    (sum, first)
}

/// `M·v`.
#[inline(always)]
fn times<W: Width, const N: usize>(w: W, matrix: &Matrix<N>, v: &[W::Vector; N]) -> [W::Vector; N] {
    let mut product = *v;
    for (i, sum) in product.iter_mut().enumerate() {
        *sum = w.splat(matrix[(i, 0)]) * v[0];
        for j in 1..N {
            *sum = *sum + w.splat(matrix[(i, j)]) * v[j];
        }
    }
    product
}

/// `f·Aⁿ·hⁿ/n!`.
fn series<const N: usize>(a: &Matrix<N>, delta: usize, length_s: f64) -> [Column<N>; TERMS + 1] {
    let mut row = Column::<N>::zeros();
    row[delta] = 1.0;
    let mut rows = [row; TERMS + 1];
    for (n, slot) in (1_u32..).zip(rows.iter_mut().skip(1)) {
        row = (a.transpose() * row) * (length_s / f64::from(n));
        *slot = row;
    }
    rows
}

/// R over the shortest step, from the series of `f·e^{At}`.
fn shortest_factor<const N: usize>(series: &[Column<N>; TERMS + 1], length_s: f64) -> Matrix<N> {
    let mut factor = Matrix::zeros();
    for (theta, weight) in GAUSS_8 {
        let mut row = Column::<N>::zeros();
        for term in series.iter().rev() {
            row = row * theta + term;
        }
        take_in(&mut factor, row * (weight * length_s).sqrt());
    }
    factor
}

/// R over twice the length.
fn doubled<const N: usize>(factor: &Matrix<N>, transition: &Matrix<N>) -> Matrix<N> {
    let (mut both, second) = (*factor, factor * transition);
    for i in 0..N {
        take_in(&mut both, second.row(i).transpose());
    }
    both
}

/// The triangle of `factor` above `row`: one Givens rotation a column.
fn take_in<const N: usize>(factor: &mut Matrix<N>, mut row: Column<N>) {
    for i in 0..N {
        let (top, below) = (factor[(i, i)], row[i]);
        if below == 0.0 {
            continue;
        }
        let size = length(top, below);
        let (cosine, sine) = (top / size, below / size);
        for j in i..N {
            let (upper, lower) = (factor[(i, j)], row[j]);
            factor[(i, j)] = cosine * upper + sine * lower;
            row[j] = cosine * lower - sine * upper;
        }
    }
}

/// `√(a² + b²)`, also where the squares leave the numbers.
fn length(a: f64, b: f64) -> f64 {
    let size = a.abs().max(b.abs());
    let (a, b) = (a / size, b / size);
    size * (a * a + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::levels::{Taylor, growth_down_to};
    use super::*;

    /// A joint that swings at `w` with damping ratio `zeta`, driven by a state
    /// that decays with `r` or grows.
    fn system(w: f64, zeta: f64, r: f64) -> Matrix<3> {
        Matrix::<3>::new(0.0, 1.0, 0.0, -w * w, -2.0 * zeta * w, 30.0, 0.1, -1.0, -r)
    }

    /// `∫ v_0² dt` by Gauss's rule on pieces of the power series, each so short
    /// that it converges; none of the tables is used.
    fn quadrature(a: &Matrix<3>, rate: &Column<3>, length_s: f64) -> f64 {
        let pieces = (growth_down_to(a, 0.0) * length_s).ceil().max(1.0);
        let (mut v, mut sum, mut done) = (*rate, 0.0, 0.0);
        while done < pieces {
            let series = Taylor::new(a, &v, &(a * v), length_s / pieces);
            for (theta, weight) in GAUSS_8 {
                let speed = series.at(theta)[0];
                sum += weight * speed * speed * (length_s / pieces);
            }
            v = series.at(1.0);
            done += 1.0;
        }
        sum
    }

    fn loss(a: &Matrix<3>, length_s: f64) -> Dissipation<3> {
        let levels = Levels::new(a, length_s);
        Dissipation::new(2.0, &levels, a, |step| step.transition, 0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Whatever the system: damped or not, slow or fast against the step,
        /// unstable too; over the whole step and a part of it.
        #[test]
        fn is_the_integral(
            w in 1.0..3e4_f64,
            zeta in prop_oneof![Just(0.0), 0.0..2.0_f64],
            r in -50.0..1e3_f64,
            rate in [-1.0..1.0_f64, -100.0..100.0_f64, -10.0..10.0_f64],
            length_s in 1e-6..0.01_f64,
            part in prop_oneof![Just(1.0), Just(0.5), 1e-6..1.0_f64],
        ) {
            let (a, rate) = (system(w, zeta, r), Column::from(rate));
            let found = loss(&a, length_s).over(rate, part * length_s);
            let expected = 2.0 * quadrature(&a, &rate, part * length_s);
            prop_assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
        }
    }

    /// Loss of a damped joint until it stands still, by hand: it swings
    /// freely, and its energy is all that there is to lose.
    #[test]
    fn a_swing_that_dies_away_loses_its_energy() {
        let (w, zeta) = (1e3, 0.05);
        let mut a = Matrix::<3>::zeros();
        (a[(0, 1)], a[(1, 0)], a[(1, 1)]) = (1.0, -w * w, -2.0 * zeta * w);
        // At δ = 0 with ε̇ = 3: ½·J·ε̇² with c = 2·ζ·w·J.
        let (c, speed): (f64, f64) = (2.0, 3.0);
        let inertia = c / (2.0 * zeta * w);
        let rate = Column::<3>::new(speed, a[(1, 1)] * speed, 0.0);
        let lost = loss(&a, 1.0).over(rate, 1.0);
        let energy = 0.5 * inertia * speed * speed;
        assert!((lost / energy - 1.0).abs() < 1e-12, "{lost} {energy}");
        // The contrast: after a tenth of a second something is left.
        let early = loss(&a, 1.0).over(rate, 0.1);
        assert!((early / energy - 1.0).abs() > 1e-5, "{early} {energy}");
    }

    /// With an eigenvalue 0 there is no solution of Lyapunov's equation, here
    /// as with a stuck screw; and where nothing moves nothing is lost.
    #[test]
    fn a_singular_system_has_a_loss() {
        let mut a = Matrix::<3>::zeros();
        (a[(1, 1)], a[(0, 1)]) = (-100.0, 1.0);
        // ε̇(t) = 1 + (1 − e^{−100t})·0.05
        let found = loss(&a, 0.01).over(Column::<3>::new(1.0, 5.0, 0.0), 0.01);
        let decayed = 1.0 - libm::exp(-1.0);
        let twice = 1.0 - libm::exp(-2.0);
        let (linear, square) = (
            0.01 - decayed / 100.0,
            0.01 - decayed / 50.0 + twice / 200.0,
        );
        let expected = 2.0 * (0.01 + 0.1 * linear + 0.0025 * square);
        assert!((found / expected - 1.0).abs() < 1e-14, "{found} {expected}");
        assert_eq!(loss(&a, 0.01).over(Column::zeros(), 0.01), 0.0);
    }
}
