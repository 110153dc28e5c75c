//! Polynomials on \[0, 1\] with their roots and largest magnitudes found for
//! certain, and a quantity over a step as one of degree seven.
//!
//! Certainty comes from the Bernstein form: a polynomial on \[0, 1\] lies
//! within the range of its Bernstein coefficients, and has at most as many roots
//! as they change sign (Descartes' rule; G. Farin, "Curves and Surfaces for
//! CAGD", section 6). No change of sign excludes a root, one proves that there
//! is exactly one; anything else is halved (de Casteljau). A dip below zero and
//! back inside one step is found like any other crossing; comparing the signs at
//! both ends would miss it.
//!
//! The quantity is known by values and slopes at its ends ([`Ends`]). How far it
//! can be from them often says enough; else four nodes between them make the
//! polynomial.

use super::width::{One, Width};

/// Halvings after which an undecided interval is called a touch, not a
/// crossing: 2^-40 of a step is below the clock's resolution.
const MAX_HALVINGS: u32 = 40;

/// Rounding of the coefficients, of the largest of them.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Polynomial of degree below `N` on \[0, 1\] in Bernstein form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polynomial<const N: usize> {
    pub(crate) bernstein: [f64; N],
}

impl Polynomial<8> {
    /// `(q(θ) − q(0))/θ`: the polynomial with the root at its start divided
    /// out, so that rounding cannot find the crossing that began the step
    /// again. Its value at θ = 0 is known to be at least 0, and is held there.
    ///
    /// `B_{j,7}/θ = C(7,j)/C(6,j−1)·B_{j−1,6} = 7/j·B_{j−1,6}`.
    pub(crate) fn without_root_at_start(&self) -> Polynomial<7> {
        let [start, others @ ..] = self.bernstein;
        let mut bernstein = others;
        for (j, b) in (1_u8..).zip(&mut bernstein) {
            *b = (*b - start) * 7.0 / f64::from(j);
        }
        bernstein[0] = bernstein[0].max(0.0);
        Polynomial { bernstein }
    }
}

impl<const N: usize> Polynomial<N> {
    /// `Σ a_n·θⁿ` over \[0, `end`\], stretched to \[0, 1\]: `b_i = Σ_{j≤i} C(i,j)/C(N−1,j)·a_j`.
    pub(crate) fn of_powers(a: &[f64; N], end: f64) -> Self {
        let weights = const { weights::<N>() };
        let (mut bernstein, mut power) = ([0.0; N], 1.0);
        for (a, weights) in a.iter().zip(&weights) {
            for (b, weight) in bernstein.iter_mut().zip(weights) {
                *b += weight * (a * power);
            }
            power *= end;
        }
        Self { bernstein }
    }

    /// `offset + factor·q`.
    pub(crate) fn affine(mut self, offset: f64, factor: f64) -> Self {
        for b in &mut self.bernstein {
            *b = offset + factor * *b;
        }
        self
    }

    /// Upper bound of |q| over the step.
    fn bound(&self) -> f64 {
        self.bernstein.iter().fold(0.0, |m: f64, b| m.max(b.abs()))
    }

    /// The first θ in \[0, 1\] at which the polynomial falls below zero. A zero at 0 is not
    /// such a θ by itself: what follows decides.
    pub(crate) fn first_negative(&self) -> Option<f64> {
        self.first_negative_in([0.0, 1.0], ROUNDING * self.bound(), MAX_HALVINGS)
    }

    /// The same within a stretch, whose coefficients these are; where they are no larger than
    /// `rounding`, their signs say nothing.
    fn first_negative_in(&self, [from, to]: [f64; 2], rounding: f64, halvings: u32) -> Option<f64> {
        let b = &self.bernstein;
        if *b.iter().find(|b| **b != 0.0)? < 0.0 {
            return Some(from);
        }
        match self.sign_changes() {
            0 => return None,
            1 => return Some(from + (to - from) * self.root_before(1.0, b[N - 1])),
            _ if halvings == 0 || self.bound() <= rounding => {
                return (b[N - 1] < 0.0).then_some(to);
            }
            _ => {}
        }
        let (left, right) = self.halves();
        let middle = 0.5 * (from + to);
        left.first_negative_in([from, middle], rounding, halvings - 1)
            .or_else(|| right.first_negative_in([middle, to], rounding, halvings - 1))
    }

    /// Changes of sign along the coefficients, zeros left out.
    fn sign_changes(&self) -> usize {
        let signs = self.bernstein.iter().filter(|b| **b != 0.0);
        let mut below = signs.map(|b| *b < 0.0);
        let Some(mut before) = below.next() else {
            return 0;
        };
        below
            .filter(|now| core::mem::replace(&mut before, *now) != *now)
            .count()
    }

    /// A zero in (0, θ), if the polynomial is positive at 0 and negative at θ.
    pub(crate) fn zero_before(&self, theta: f64) -> Option<f64> {
        let (value, _) = self.value_and_slope(theta);
        let falls = self.bernstein[0] > 0.0 && value < 0.0;
        falls.then(|| self.root_before(theta, value))
    }

    /// The root between 0, where the polynomial is not negative, and θ, where it has this
    /// negative value: Newton, held within the bracket. A zero at the start is not it.
    fn root_before(&self, mut high: f64, value: f64) -> f64 {
        let (start, mut low) = (self.bernstein[0], 0.0);
        let share = match start > 0.0 {
            true => start / (start - value),
            false => 0.5,
        };
        let mut theta = share * high;
        for _ in 0..100 {
            let (value, slope) = self.value_and_slope(theta);
            if value == 0.0 {
                return theta;
            }
            match value > 0.0 {
                true => low = theta,
                false => high = theta,
            }
            let newton = theta - value / slope;
            let next = match newton > low && newton < high {
                true => newton,
                false => 0.5 * (low + high),
            };
            // The last bits of θ are decided by the rounding of the value.
            if (next - theta).abs() <= ROUNDING * next || next <= low || next >= high {
                return next;
            }
            theta = next;
        }
        theta
    }

    fn value_and_slope(&self, theta: f64) -> (f64, f64) {
        value_and_slope(One, &self.bernstein, theta)
    }

    /// The last θ in \[0, 1\] at which |q| exceeds `band`, if any.
    pub(crate) fn last_outside(mut self, band: f64) -> Option<f64> {
        // Backwards, and negative where ±q exceeds the band.
        self.bernstein.reverse();
        let beyond = [-1.0, 1.0].map(|sign| self.affine(band, sign).first_negative());
        let first = beyond.into_iter().flatten().reduce(f64::min);
        first.map(|theta| 1.0 - theta)
    }

    /// The larger of `floor` and the supremum of |q| over the step.
    pub(crate) fn peak_above(&self, floor: f64) -> f64 {
        let ends = self.bernstein[0].abs().max(self.bernstein[N - 1].abs());
        self.peak_in(floor.max(ends), MAX_HALVINGS)
    }

    fn peak_in(&self, mut peak: f64, halvings: u32) -> f64 {
        let bound = self.bound();
        // Rounding of the coefficients themselves is not worth halving for. What is not a number
        // exceeds nothing.
        let exceeds = bound > peak * (1.0 + 1e-15) && bound.is_finite();
        if !exceeds || halvings == 0 {
            return peak;
        }
        let (left, right) = self.halves();
        peak = peak.max(right.bernstein[0].abs());
        peak = left.peak_in(peak, halvings - 1);
        right.peak_in(peak, halvings - 1)
    }

    fn halves(&self) -> (Self, Self) {
        let (left, right) = halves(One, &self.bernstein);
        (Self { bernstein: left }, Self { bernstein: right })
    }
}

/// `C(i,j)/C(N−1,j)` by j and i.
const fn weights<const N: usize>() -> [[f64; N]; N] {
    let mut weights = [[0.0; N]; N];
    let mut i = 0;
    while i < N {
        let mut weight = 1.0;
        let mut j = 0;
        while j <= i {
            weights[j][i] = weight;
            if j < i {
                weight *= (i - j) as f64 / (N - 1 - j) as f64;
            }
            j += 1;
        }
        i += 1;
    }
    weights
}

/// `C(degree, i)`.
pub(crate) const fn binomials<const N: usize>(degree: usize) -> [f64; N] {
    let mut row = [0.0; N];
    row[0] = 1.0;
    let mut i = 1;
    while i <= degree {
        row[i] = row[i - 1] * (degree - i + 1) as f64 / i as f64;
        i += 1;
    }
    row
}

/// Value and slope at θ: Horner's rule in `1 − θ`, with the powers of θ.
#[inline(always)]
pub(crate) fn value_and_slope<W: Width, const N: usize>(
    w: W,
    b: &[W::Vector; N],
    theta: W::Vector,
) -> (W::Vector, W::Vector) {
    let of_value = const { binomials::<N>(N - 1) };
    let of_slope = const { binomials::<N>(N - 2) };
    let rest = w.splat(1.0) - theta;
    let (mut value, mut slope, mut power) = (b[0], w.splat(0.0), w.splat(1.0));
    for i in 1..N {
        slope = slope * rest + w.splat(of_slope[i - 1]) * power * (b[i] - b[i - 1]);
        power = power * theta;
        value = value * rest + w.splat(of_value[i]) * power * b[i];
    }
    (value, w.splat(const { (N - 1) as f64 }) * slope)
}

/// Bernstein coefficients of both halves: de Casteljau at θ = ½.
#[inline(always)]
pub(crate) fn halves<W: Width, const N: usize>(
    w: W,
    b: &[W::Vector; N],
) -> ([W::Vector; N], [W::Vector; N]) {
    let (mut left, mut right) = (*b, *b);
    for (i, corner) in left.iter_mut().enumerate() {
        *corner = right[0];
        for j in 0..N - 1 - i {
            right[j] = w.splat(0.5) * (right[j] + right[j + 1]);
        }
    }
    (left, right)
}

/// The instants within a step at which a quantity is looked at.
pub(crate) const NODES: [f64; 4] = [0.2, 0.4, 0.6, 0.8];

/// Values and slopes of a quantity at both ends of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ends {
    pub(crate) values: [f64; 2],
    /// Change over the whole step if the slope at that end lasted.
    pub(crate) slopes: [f64; 2],
}

/// Share of `reach` in the middle coefficient of [`Ends::hull`], see there.
const HULL_PER_REACH: f64 = 12.0;

impl Ends {
    /// From the value and its rate at both ends.
    pub(crate) fn new(start: (f64, f64), end: (f64, f64), length: f64) -> Self {
        Self {
            values: [start.0, end.0],
            slopes: [start.1 * length, end.1 * length],
        }
    }

    /// Bernstein coefficients of the cubic through the ends.
    fn cubic(&self) -> [f64; 4] {
        let ([start, end], [start_slope, end_slope]) = (self.values, self.slopes);
        [start, start + start_slope / 3.0, end - end_slope / 3.0, end]
    }

    /// Range of the quantity over the step, from its ends alone: at least as
    /// wide as the quantity, if it strays from the cubic through the ends by
    /// less than `reach`.
    ///
    /// The distance from the cubic has double roots at both ends, `r =
    /// S·θ²·(1 − θ)²`. With |S| ≤ 6·m the quantity lies between quartics whose
    /// Bernstein coefficients are those of the cubic, the middle one moved by
    /// ±m. A constant S makes the largest |r| S/16, so that m = 16/6 of the
    /// reach would do; 12 leaves S room to vary by 4.5 times over the step.
    pub(crate) fn hull(&self, reach: f64) -> (f64, f64) {
        let [b0, b1, b2, b3] = self.cubic();
        // One degree up.
        let (c1, c3) = (0.25 * (b0 + 3.0 * b1), 0.25 * (3.0 * b2 + b3));
        let c2 = 0.5 * (b1 + b2);
        let m = HULL_PER_REACH * reach;
        let low = b0.min(b3).min(c1.min(c3)).min(c2 - m);
        let high = b0.max(b3).max(c1.max(c3)).max(c2 + m);
        (low, high)
    }

    /// Upper bound of |q| over the step, as [`Ends::hull`].
    pub(crate) fn bound(&self, reach: f64) -> f64 {
        let (low, high) = self.hull(reach);
        high.max(-low)
    }

    /// The polynomial `q(θ)`, 0 ≤ θ ≤ 1, through the ends and the values at
    /// θ = 1/5, 2/5, 3/5 and 4/5.
    ///
    /// `q = H + θ²·(1 − θ)²·S` with the cubic H through the ends and another
    /// cubic S through what is left at the four nodes; both in Bernstein form,
    /// where a product and a higher degree are weighted sums of coefficients:
    /// `B_{i,3}·θ²·(1 − θ)² = C(3,i)/C(7,i+2)·B_{i+2,7}`.
    pub(crate) fn septic(&self, nodes: [f64; 4]) -> Polynomial<8> {
        let [h0, h1, h2, h3] = self.cubic();
        let mut left = [0.0; 4];
        for ((left, theta), value) in left.iter_mut().zip(NODES).zip(nodes) {
            let rest = 1.0 - theta;
            let (outer, inner) = (theta * theta, rest * rest);
            let cubic =
                (h0 * rest + 3.0 * h1 * theta) * inner + (3.0 * h2 * rest + h3 * theta) * outer;
            *left = (value - cubic) / (outer * inner);
        }
        let [l1, l2, l3, l4] = left;
        // Bernstein coefficients of the cubic through four values at NODES.
        let s0 = 4.0 * l1 - 6.0 * l2 + 4.0 * l3 - l4;
        let s1 = (-58.0 * l1 + 177.0 * l2 - 138.0 * l3 + 37.0 * l4) / 18.0;
        let s2 = (37.0 * l1 - 138.0 * l2 + 177.0 * l3 - 58.0 * l4) / 18.0;
        let s3 = -l1 + 4.0 * l2 - 6.0 * l3 + 4.0 * l4;
        Polynomial {
            bernstein: [
                h0,
                (4.0 * h0 + 3.0 * h1) / 7.0,
                (6.0 * h0 + 12.0 * h1 + 3.0 * h2 + s0) / 21.0,
                (4.0 * h0 + 18.0 * h1 + 12.0 * h2 + h3 + 3.0 * s1) / 35.0,
                (h0 + 12.0 * h1 + 18.0 * h2 + 4.0 * h3 + 3.0 * s2) / 35.0,
                (3.0 * h1 + 12.0 * h2 + 6.0 * h3 + s3) / 21.0,
                (3.0 * h2 + 4.0 * h3) / 7.0,
                h3,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_peak_between_the_ends() {
        // θ·(1 − θ)
        let bernstein = [0.0, 0.5, 0.0];
        let q = Polynomial { bernstein };
        assert_eq!(q.peak_above(0.3), 0.3);
        for q in [q, q.affine(0.0, -1.0)] {
            assert!((q.peak_above(0.0) - 0.25).abs() < 1e-15);
        }
    }

    #[test]
    fn runs_backwards() {
        // 0.7 − θ
        let bernstein = [0.7, 0.2, -0.3];
        let q = Polynomial { bernstein };
        let last = q.last_outside(0.4).unwrap();
        assert!((last - 0.3).abs() < 1e-15, "{last}");
    }

    fn sampled(q: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> (Ends, Polynomial<8>) {
        let ends = Ends::new((q(0.0), slope(0.0)), (q(1.0), slope(1.0)), 1.0);
        (ends, ends.septic(NODES.map(q)))
    }

    /// De Casteljau at any θ.
    fn value(q: &Polynomial<8>, theta: f64) -> f64 {
        let mut b = q.bernstein;
        for n in (1..8).rev() {
            for j in 0..n {
                b[j] += (b[j + 1] - b[j]) * theta;
            }
        }
        b[0]
    }

    #[test]
    fn reproduces_degree_seven_and_not_eight() {
        let of = |degree: i32| {
            let q = move |t: f64| 3.0 - t + 2.0 * t * t - 5.0 * t.powi(4) + 7.0 * t.powi(degree);
            let slope = move |t: f64| {
                -1.0 + 4.0 * t - 20.0 * t.powi(3) + 7.0 * f64::from(degree) * t.powi(degree - 1)
            };
            let (_, septic) = sampled(q, slope);
            let off = |i: u8| {
                let t = f64::from(i) / 97.0;
                (value(&septic, t) - q(t)).abs()
            };
            (0..=97).map(off).fold(0.0, f64::max)
        };
        assert!(of(7) < 1e-14, "{}", of(7));
        assert!(of(8) > 1e-5, "{}", of(8));
    }

    #[test]
    fn finds_a_dip_that_the_ends_do_not_show() {
        // (t − 0.4)(t − 0.4001): below zero for a ten-thousandth of the step.
        let (r, s) = (0.4, 0.4001);
        let (ends, q) = sampled(|t| (t - r) * (t - s), |t| 2.0 * t - r - s);
        let root = q.first_negative().unwrap();
        assert!((root - r).abs() < 1e-12, "{root}");
        assert!(ends.values.iter().all(|&end| end > 0.0));
        assert!(ends.hull(0.0).0 < 0.0);
        // The contrast: lifted off zero there is nothing to find.
        assert_eq!(q.affine(1e-8, 1.0).first_negative(), None);
    }

    /// A quantity of degree seven that strays far from the cubic through its
    /// ends stays within the hull; without its reach it would not.
    #[test]
    fn hull_holds_what_the_ends_do_not_show() {
        // 0.01 − a·θ²(1 − θ)²·(1 + θ): dips below zero in the middle.
        let bump = |t: f64| t * t * (1.0 - t) * (1.0 - t) * (1.0 + t);
        let (ends, q) = sampled(|t| 0.01 - 0.2 * bump(t), |_| 0.0);
        assert!(q.first_negative().is_some());
        assert_eq!(ends.hull(0.0), (0.01, 0.01));
        let reach = 0.2 * bump(0.53);
        let (low, high) = ends.hull(reach);
        assert!(low <= 0.01 - reach && high >= 0.01);
        assert_eq!(ends.bound(reach), high.max(-low));
    }

    #[test]
    fn does_not_find_the_root_at_its_start_again() {
        // θ·(1.2 − θ)·(θ + 1) shifted by a rounding error below zero.
        let (_, q) = sampled(
            |t| t * (1.2 - t) * (t + 1.0) - 1e-17,
            |t| 1.2 + 0.4 * t - 3.0 * t * t,
        );
        assert_eq!(q.first_negative(), Some(0.0));
        assert_eq!(q.without_root_at_start().first_negative(), None);
        // The contrast: the return through zero is found.
        let (_, q) = sampled(|t| t * (0.7 - t), |t| 0.7 - 2.0 * t);
        let root = q.without_root_at_start().first_negative().unwrap();
        assert!((root - 0.7).abs() < 1e-14, "{root}");
    }
}
