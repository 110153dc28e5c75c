//! Polynomials and quadrature.

pub(crate) mod bernstein;
pub(crate) mod quadrature;
pub(crate) mod septic;
