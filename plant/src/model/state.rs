//! State of the axis.
//!
//! The relative rotation ε = β − γ is a state of its own and γ follows from
//! it: near a contact change β − γ would lose the digits that decide it (β
//! reaches hundreds of radians, the gap can be 1e-15 rad). β is kept and not
//! γ because the encoder sees β: a motor at rest stands at exactly 0 counts
//! whatever the carriage does. The paper's vector (eq. 33) is `u0 = β̂, u1 = β,
//! u2 = β̇, u3 = γ, u4 = γ̇, u5 = I`. A current drive's loop has a memory besides.

use nalgebra::SVector;

/// Components of the vector that the solvers advance.
pub(crate) type Vector = SVector<f64, 7>;

pub(crate) const BETA: usize = 0;
pub(crate) const BETA_DOT: usize = 1;
pub(crate) const EPSILON: usize = 2;
pub(crate) const EPSILON_DOT: usize = 3;
pub(crate) const CURRENT: usize = 4;
pub(crate) const BETA_INTEGRAL: usize = 5;
/// The last one, so that it enters no sum of the others.
pub(crate) const CURRENT_INTEGRAL: usize = 6;

/// `γ = β − ε` of a vector of the plant.
pub(crate) fn gamma(y: &Vector) -> f64 {
    y[BETA] - y[EPSILON]
}

/// `γ̇ = β̇ − ε̇` of a vector of the plant, γ̈ of its derivative.
pub(crate) fn gamma_dot(y: &Vector) -> f64 {
    y[BETA_DOT] - y[EPSILON_DOT]
}

/// State of the axis at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// `β`, angle of the gear output \[rad\].
    pub beta_rad: f64,
    /// `β̇`, speed of the gear output \[rad/s\].
    pub beta_dot_radps: f64,
    /// `ε = β − γ`, relative rotation of the joint (eq. 8) \[rad\].
    pub epsilon_rad: f64,
    /// `ε̇` \[rad/s\].
    pub epsilon_dot_radps: f64,
    /// `I`, armature current \[A\].
    pub current_a: f64,
    /// `β̂ = ∫β dt` \[rad s\] (eq. 29), the memory of the continuous law: a held
    /// voltage leaves it as it is.
    pub beta_integral_rads: f64,
    /// `q`, the integral part of a current drive's loop \[A s\]; 0 without one.
    pub current_integral_as: f64,
}

impl State {
    /// `γ = β − ε`, screw angle \[rad\].
    pub fn gamma_rad(&self) -> f64 {
        self.beta_rad - self.epsilon_rad
    }

    /// `γ̇`, screw speed \[rad/s\].
    pub fn gamma_dot_radps(&self) -> f64 {
        self.beta_dot_radps - self.epsilon_dot_radps
    }

    pub(crate) fn to_vector(self) -> Vector {
        Vector::from([
            self.beta_rad,
            self.beta_dot_radps,
            self.epsilon_rad,
            self.epsilon_dot_radps,
            self.current_a,
            self.beta_integral_rads,
            self.current_integral_as,
        ])
    }

    pub(crate) fn from_vector(y: &Vector) -> Self {
        Self {
            beta_rad: y[BETA],
            beta_dot_radps: y[BETA_DOT],
            epsilon_rad: y[EPSILON],
            epsilon_dot_radps: y[EPSILON_DOT],
            current_a: y[CURRENT],
            beta_integral_rads: y[BETA_INTEGRAL],
            current_integral_as: y[CURRENT_INTEGRAL],
        }
    }
}
