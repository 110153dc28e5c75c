//! A quantity over one solver step as a polynomial of degree four, with its
//! roots and its largest magnitude found for certain.
//!
//! Certainty comes from the Bernstein form: a polynomial on \[0, 1\] lies
//! within the range of its Bernstein coefficients, so coefficients of one
//! sign exclude a root, and halving the interval (de Casteljau) separates
//! whatever is left. A dip below zero and back inside one step is found like
//! any other crossing; comparing the signs at both ends would miss it.

/// Halvings after which an undecided interval is called a touch, not a
/// crossing: 2^-40 of a step is below the clock's resolution.
const MAX_HALVINGS: u32 = 40;

/// Polynomial of degree below `N` on \[0, 1\] in Bernstein form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polynomial<const N: usize> {
    bernstein: [f64; N],
}

/// Values and slopes of a quantity at both ends of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ends {
    pub(crate) start: f64,
    /// Change over the whole step if the slope at its start lasted.
    pub(crate) start_slope: f64,
    pub(crate) end: f64,
    /// As `start_slope`, for the slope at the end.
    pub(crate) end_slope: f64,
}

impl Ends {
    /// Bound of |q| of the cubic through the ends: its Bernstein coefficients.
    pub(crate) fn bound(&self) -> f64 {
        let inner = (self.start + self.start_slope / 3.0)
            .abs()
            .max((self.end - self.end_slope / 3.0).abs());
        self.start.abs().max(self.end.abs()).max(inner)
    }

    /// Monomial coefficients of the quartic through the ends and the value
    /// in the middle.
    fn coefficients(&self, middle: f64) -> [f64; 5] {
        let (a0, a1) = (self.start, self.start_slope);
        let r1 = self.end - a0 - a1;
        let rd = self.end_slope - a1;
        let rm = middle - a0 - 0.5 * a1;
        let a4 = 16.0 * rm - 8.0 * r1 + 2.0 * rd;
        let a3 = rd - 2.0 * r1 - 2.0 * a4;
        let a2 = r1 - a3 - a4;
        [a0, a1, a2, a3, a4]
    }

    /// The quartic `q(θ)`, 0 ≤ θ ≤ 1.
    pub(crate) fn quartic(&self, middle: f64) -> Polynomial<5> {
        Polynomial::from_monomials(self.coefficients(middle))
    }

    /// `(q(θ) − q(0))/θ`: the quartic with the root at its start divided out,
    /// so that rounding cannot find the crossing that began the step again.
    /// Its value at θ = 0 is known to be at least 0, and is held there.
    pub(crate) fn without_root_at_start(&self, middle: f64) -> Polynomial<4> {
        let [_, a1, a2, a3, a4] = self.coefficients(middle);
        Polynomial::from_monomials([a1.max(0.0), a2, a3, a4])
    }
}

impl<const N: usize> Polynomial<N> {
    /// `b_i = Σ_{j≤i} C(i,j)/C(n,j)·a_j` with n = N − 1.
    fn from_monomials(a: [f64; N]) -> Self {
        let mut bernstein = [0.0; N];
        for (i, b) in bernstein.iter_mut().enumerate() {
            let mut weight = 1.0;
            for (j, &coefficient) in a.iter().enumerate().take(i + 1) {
                *b += weight * coefficient;
                // C(i,j+1)/C(n,j+1) from C(i,j)/C(n,j); n − j ≥ 1 while j < i.
                if j < i {
                    weight *= index(i - j) / index(N - 1 - j);
                }
            }
        }
        Self { bernstein }
    }

    /// The polynomial run backwards, `q(1 − θ)`.
    pub(crate) fn reversed(mut self) -> Self {
        self.bernstein.reverse();
        self
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

    /// The first θ in \[0, 1\] at which the polynomial falls below zero.
    pub(crate) fn first_negative(&self) -> Option<f64> {
        self.first_negative_in(0.0, 1.0, MAX_HALVINGS)
    }

    fn first_negative_in(&self, from: f64, to: f64, halvings: u32) -> Option<f64> {
        let b = &self.bernstein;
        if b.iter().all(|&b| b >= 0.0) {
            return None;
        }
        if b[0] < 0.0 {
            return Some(from);
        }
        if halvings == 0 {
            return (b[N - 1] < 0.0).then_some(to);
        }
        let (left, right) = self.halves();
        let middle = 0.5 * (from + to);
        left.first_negative_in(from, middle, halvings - 1)
            .or_else(|| right.first_negative_in(middle, to, halvings - 1))
    }

    /// The larger of `floor` and the supremum of |q| over the step.
    pub(crate) fn peak_above(&self, floor: f64) -> f64 {
        let ends = self.bernstein[0].abs().max(self.bernstein[N - 1].abs());
        self.peak_in(floor.max(ends), MAX_HALVINGS)
    }

    fn peak_in(&self, mut peak: f64, halvings: u32) -> f64 {
        // Rounding of the coefficients themselves is not worth halving for.
        if self.bound() <= peak * (1.0 + 1e-15) || halvings == 0 {
            return peak;
        }
        let (left, right) = self.halves();
        peak = peak.max(right.bernstein[0].abs());
        peak = left.peak_in(peak, halvings - 1);
        right.peak_in(peak, halvings - 1)
    }

    /// De Casteljau at θ = ½.
    fn halves(&self) -> (Self, Self) {
        let mut left = [0.0; N];
        let mut right = self.bernstein;
        for (i, corner) in left.iter_mut().enumerate() {
            *corner = right[0];
            for j in 0..N - 1 - i {
                right[j] = 0.5 * (right[j] + right[j + 1]);
            }
        }
        (Self { bernstein: left }, Self { bernstein: right })
    }
}

/// A small index as a factor.
fn index(i: usize) -> f64 {
    f64::from(u8::try_from(i).unwrap_or(u8::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(q: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> (Ends, f64) {
        let ends = Ends {
            start: q(0.0),
            start_slope: slope(0.0),
            end: q(1.0),
            end_slope: slope(1.0),
        };
        (ends, q(0.5))
    }

    #[test]
    fn reproduces_a_quartic() {
        let (ends, middle) = sampled(
            |t| 3.0 - t + 2.0 * t * t - 5.0 * t.powi(3) + 7.0 * t.powi(4),
            |t| -1.0 + 4.0 * t - 15.0 * t * t + 28.0 * t.powi(3),
        );
        let expected = [3.0, -1.0, 2.0, -5.0, 7.0];
        for (a, b) in ends.coefficients(middle).iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "{a} for {b}");
        }
    }

    #[test]
    fn finds_a_dip_that_the_ends_do_not_show() {
        // (t − 0.4)(t − 0.4001): below zero for a ten-thousandth of the step.
        let (r, s) = (0.4, 0.4001);
        let (ends, middle) = sampled(|t| (t - r) * (t - s), |t| 2.0 * t - r - s);
        let root = ends.quartic(middle).first_negative().unwrap();
        assert!((root - r).abs() < 1e-11, "{root}");
        assert!(ends.start > 0.0 && ends.end > 0.0);
        // The contrast: lifted off zero there is nothing to find.
        let lifted = ends.quartic(middle).affine(1e-8, 1.0);
        assert_eq!(lifted.first_negative(), None);
    }

    #[test]
    fn does_not_find_the_root_at_its_start_again() {
        // θ·(1 − θ)·(θ + 1) shifted by a rounding error below zero.
        let (ends, middle) = sampled(
            |t| t * (1.2 - t) * (t + 1.0) - 1e-17,
            |t| 1.2 + 0.4 * t - 3.0 * t * t,
        );
        assert_eq!(ends.quartic(middle).first_negative(), Some(0.0));
        assert_eq!(ends.without_root_at_start(middle).first_negative(), None);
    }

    #[test]
    fn finds_the_peak_between_the_ends() {
        let (ends, middle) = sampled(|t| t * (1.0 - t), |t| 1.0 - 2.0 * t);
        assert!((ends.quartic(middle).peak_above(0.0) - 0.25).abs() < 1e-15);
        assert_eq!(ends.quartic(middle).peak_above(0.3), 0.3);
        let negative = ends.quartic(middle).affine(0.0, -1.0);
        assert!((negative.peak_above(0.0) - 0.25).abs() < 1e-15);
    }

    #[test]
    fn runs_backwards() {
        let (ends, middle) = sampled(|t| 0.7 - t, |_| -1.0);
        let last = ends.quartic(middle).affine(0.0, -1.0).reversed();
        assert!((last.first_negative().unwrap() - 0.0).abs() < 1e-12 || last.bernstein[0] > 0.0);
        let root = last.affine(0.0, 1.0).first_negative().unwrap();
        assert!((root - 0.3).abs() < 1e-11, "{root}");
    }
}
