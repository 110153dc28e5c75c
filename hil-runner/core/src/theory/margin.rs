//! Distance of a loop from instability, read from its response `L(jω)`.
//!
//! The modulus margin `min |1 + L|` is the distance of the Nyquist curve from
//! −1, the reciprocal of the sensitivity's peak M_s (Åström and Wittenmark,
//! "Computer-Controlled Systems", 3.4 and 5.5). 0.5 and more is a sound loop. One
//! number covers gain and phase at once: a loop with modulus m endures any gain
//! from 1/(1+m) to 1/(1−m) and a lag of 2·asin(m/2).

use nalgebra::Complex;

use super::curve::Curve;

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
}

impl Margin {
    /// The modulus margin, negative for an unstable loop: 0 is the border.
    pub fn signed(&self) -> f64 {
        if self.stable {
            self.modulus
        } else {
            -self.modulus
        }
    }

    /// Reads a curve, frequencies in its unit.
    pub(crate) fn of<F: Fn(f64) -> Complex<f64>>(curve: &Curve<'_, F>, stable: bool) -> Self {
        let lowest = curve.lowest();
        let (weakest, distance) = nearest(curve, lowest);
        let (mut crossover, mut phase): (Option<f64>, Option<f64>) = (None, None);
        let mut magnitude: Option<f64> = None;
        for (start, marks) in curve.marked(lowest.1) {
            if marks.unit_gain {
                curve.each_unit_gain(start, |frequency, falls, value| {
                    if falls && crossover.is_none() {
                        crossover = Some(frequency);
                    }
                    // arg(−L): what turns L to −1.
                    let lag = libm::atan2(-value.im, -value.re);
                    if phase.is_none_or(|phase| lag.abs() < phase.abs()) {
                        phase = Some(lag);
                    }
                });
            }
            if marks.real && stable {
                curve.each_phase_crossing(start, |_, at| {
                    if at < 1.0 && magnitude.is_none_or(|most| at > most) {
                        magnitude = Some(at);
                    }
                });
            }
        }
        if let Some(at) = curve.real_end()
            && at < 1.0
            && magnitude.is_none_or(|most| at > most)
        {
            magnitude = Some(at);
        }
        Self {
            stable,
            modulus: distance.sqrt(),
            weakest_radps: weakest,
            phase_rad: phase.filter(|_| stable),
            gain: magnitude.filter(|_| stable).map(|at| 1.0 / at),
            crossover_radps: crossover,
        }
    }
}

/// `min |1 + L|`, without what else a [`Margin`] tells.
pub(crate) fn modulus<F: Fn(f64) -> Complex<f64>>(curve: &Curve<'_, F>) -> f64 {
    nearest(curve, curve.lowest()).1.sqrt()
}

/// Frequency at which −1 is nearest, and its squared distance, from the point nearest to it.
fn nearest<F: Fn(f64) -> Complex<f64>>(curve: &Curve<'_, F>, lowest: (usize, f64)) -> (f64, f64) {
    let (mut weakest, mut distance) = (curve.frequency[lowest.0], lowest.1);
    for (start, marks) in curve.marked(lowest.1) {
        if marks.near {
            curve.each_minimum(start, lowest.1, |frequency, value| {
                if value < distance {
                    (weakest, distance) = (frequency, value);
                }
            });
        }
    }
    (weakest, distance)
}
