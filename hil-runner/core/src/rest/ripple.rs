//! How far the carriage strays from a straight line: what is left when a creep
//! at constant speed is taken out.
//!
//! The line is that of least squares with the weights `(1 − u²)²`, u going from −1
//! to 1 over the window. A cycle that stands in the window a few times tilts it: a
//! sine of amplitude 1 and n whole periods moves its two ends by up to
//! `105/(πn)³·|1 − 15/(πn)²|`, one down and one up, without weights by `3/(πn)`.
//!
//! ```text
//!                     ends of the line        half swing too large by
//! n             weights        without        weights         without
//! 3              0.1042         0.3183         0.087            0.160
//! 8              0.0065         0.1194         0.006            0.097
//! ```

/// Positions less a straight line; where the line lies does not matter, only how
/// steep it is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Residual {
    /// \[m\], in order.
    pub(super) values_m: Vec<f64>,
    lowest_m: f64,
    highest_m: f64,
}

impl Residual {
    /// Of positions at equal distances.
    pub(super) fn of(positions_m: &[f64]) -> Self {
        // From the first on: what they share would cost the small ones digits.
        let first_m = positions_m.first().copied().unwrap_or(0.0);
        let n = count(positions_m.len());
        // u of one position after the other, from whole numbers.
        let places = || {
            let mut next = -1.0 - n;
            core::iter::repeat_with(move || {
                next += 2.0;
                next / n
            })
        };
        let (mut moment, mut inertia) = (0.0, 0.0);
        for (position_m, u) in positions_m.iter().zip(places()) {
            let root = 1.0 - u * u;
            let arm = root * root * u;
            moment += arm * (position_m - first_m);
            inertia += arm * u;
        }
        let slope_m = if inertia > 0.0 { moment / inertia } else { 0.0 };
        let (mut lowest_m, mut highest_m) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut values_m = Vec::with_capacity(positions_m.len());
        for (position_m, u) in positions_m.iter().zip(places()) {
            let value = (position_m - first_m) - slope_m * u;
            lowest_m = lowest_m.min(value);
            highest_m = highest_m.max(value);
            values_m.push(value);
        }
        Self {
            values_m,
            lowest_m,
            highest_m,
        }
    }

    /// Half of the swing from the lowest to the highest \[m\].
    pub(super) fn amplitude_m(&self) -> f64 {
        0.5 * (self.highest_m - self.lowest_m)
    }
}

/// A number of samples; far below 2^53.
#[expect(clippy::cast_precision_loss, reason = "a few thousand at most")]
pub(super) fn count(n: usize) -> f64 {
    n as f64
}
