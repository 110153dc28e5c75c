//! Polynomials that are known for certain, quadrature, vectors, and time as a number.

pub(crate) mod bernstein;
pub(crate) mod vectors;
pub(crate) mod width;

/// Nanoseconds as seconds, correctly rounded.
pub(crate) fn seconds(ns: u64) -> f64 {
    count(ns) / 1e9
}

/// A count as a float; exact below 2^53, which is 104 days in nanoseconds.
pub(crate) fn count(n: u64) -> f64 {
    n as f64
}

/// Nodes and their weights in one of Gauss's rules on \[0, 1\], exact for polynomials of a
/// degree below twice the number of nodes. Four nodes: the square of a cubic.
pub(crate) const GAUSS_4: [(f64, f64); 4] = [
    (0.06943184420297371, 0.17392742256872692),
    (0.33000947820757187, 0.32607257743127305),
    (0.6699905217924281, 0.32607257743127305),
    (0.9305681557970263, 0.17392742256872692),
];

/// Eight nodes: `e^{2x}` to the last bit.
pub(crate) const GAUSS_8: [(f64, f64); 8] = [
    (0.019855071751231884, 0.05061426814518813),
    (0.10166676129318664, 0.11119051722668724),
    (0.2372337950418355, 0.15685332293894363),
    (0.4082826787521751, 0.181341891689181),
    (0.591717321247825, 0.181341891689181),
    (0.7627662049581645, 0.15685332293894363),
    (0.8983332387068134, 0.11119051722668724),
    (0.9801449282487681, 0.05061426814518813),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// `∫₀¹ xⁿ dx` by a rule, less the truth.
    fn error(rule: &[(f64, f64)], n: u32) -> f64 {
        let power = |x: f64| (0..n).fold(1.0, |power, _| power * x);
        let sum: f64 = rule.iter().map(|(x, weight)| weight * power(*x)).sum();
        (sum - 1.0 / f64::from(n + 1)).abs()
    }

    /// Exact up to degree 2n − 1; the contrast is the next one.
    #[test]
    fn rules_are_exact_up_to_their_degree() {
        for (rule, degree, contrast) in [(&GAUSS_4[..], 8, 1e-6), (&GAUSS_8[..], 16, 1e-11)] {
            assert!((0..degree).all(|n| error(rule, n) < 1e-15));
            assert!(error(rule, degree) > contrast);
        }
    }

    #[test]
    fn eight_nodes_do_for_an_exponential() {
        let sum: f64 = GAUSS_8.iter().map(|(x, w)| w * libm::exp(2.0 * x)).sum();
        let truth = (libm::exp(2.0) - 1.0) / 2.0;
        assert!((sum / truth - 1.0).abs() < 1e-15, "{sum} {truth}");
    }
}
