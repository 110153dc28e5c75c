//! Polynomials on \[0, 1\] with their roots and largest magnitudes found for
//! certain.
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
    pub(crate) bernstein: [f64; N],
}

impl Polynomial<8> {
    /// `(q(θ) − q(0))/θ`: the polynomial with the root at its start divided
    /// out, so that rounding cannot find the crossing that began the step
    /// again. Its value at θ = 0 is known to be at least 0, and is held there.
    ///
    /// `B_{j+1,7}/θ = C(7,j+1)/C(6,j)·B_{j,6} = 7/(j + 1)·B_{j,6}`.
    pub(crate) fn without_root_at_start(&self) -> Polynomial<7> {
        let [start, others @ ..] = self.bernstein;
        let mut bernstein = others;
        for (j, b) in bernstein.iter_mut().enumerate() {
            *b = (*b - start) * 7.0 / index(j + 1);
        }
        bernstein[0] = bernstein[0].max(0.0);
        Polynomial { bernstein }
    }
}

impl<const N: usize> Polynomial<N> {
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

    fn halves(&self) -> (Self, Self) {
        let (left, right) = halves(&self.bernstein);
        (Self { bernstein: left }, Self { bernstein: right })
    }
}

/// Bernstein coefficients of both halves: de Casteljau at θ = ½.
pub(crate) fn halves<const N: usize>(b: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut left, mut right) = ([0.0; N], *b);
    for (i, corner) in left.iter_mut().enumerate() {
        *corner = right[0];
        for j in 0..N - 1 - i {
            right[j] = 0.5 * (right[j] + right[j + 1]);
        }
    }
    (left, right)
}

/// A small index as a factor.
fn index(i: usize) -> f64 {
    f64::from(u8::try_from(i).unwrap_or(u8::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_peak_between_the_ends() {
        // θ·(1 − θ)
        let q = Polynomial {
            bernstein: [0.0, 0.5, 0.0],
        };
        assert!((q.peak_above(0.0) - 0.25).abs() < 1e-15);
        assert_eq!(q.peak_above(0.3), 0.3);
        let negative = q.affine(0.0, -1.0);
        assert!((negative.peak_above(0.0) - 0.25).abs() < 1e-15);
    }

    #[test]
    fn runs_backwards() {
        // 0.7 − θ
        let q = Polynomial {
            bernstein: [0.7, 0.2, -0.3],
        };
        let last = q.reversed();
        assert_eq!(last.first_negative(), Some(0.0));
        let root = last.affine(0.0, -1.0).first_negative().unwrap();
        assert!((root - 0.3).abs() < 1e-11, "{root}");
    }
}
