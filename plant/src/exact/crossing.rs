//! The first zero of a mode's guards along the exact solution.
//!
//! None is missed: a leg is passed over only if the chord bound excludes a
//! zero, and on the shortest legs Descartes' rule isolates every root of the
//! guard's polynomial, so that a crossing and its return inside one sample are
//! two roots like any others. What remains is rounding: a dip shallower than
//! that of the polynomial's coefficients (relative 1e-15 of its terms) cannot
//! be told from a touch.

use super::roots::Polynomial;
use super::system::Column;
use super::tables::Linear;
use super::taylor::Taylor;
use super::walk::{BOUND_MARGIN, Flow, Leg, Stretch, TooManySteps};

/// A guard `offset + sign·row·x`, positive within the mode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinearGuard<'a, const D: usize> {
    pub(crate) linear: &'a Linear<D>,
    pub(crate) sign: f64,
    pub(crate) offset: f64,
    /// How far below zero the guard must fall to count. The crossing is then
    /// its zero all the same: every separation of a joint that rattles would
    /// else come late, by the same sign, and the next impacts multiply that.
    pub(crate) noise: f64,
    /// The solution starts on the guard's surface and leaves it.
    pub(crate) fresh: bool,
}

/// Where the solution stops: at the first zero of a guard, or at the end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stop<const D: usize> {
    pub(crate) time_s: f64,
    pub(crate) x: Column<D>,
    /// Place of the guard among those given.
    pub(crate) guard: Option<usize>,
}

impl<const D: usize> LinearGuard<'_, D> {
    fn value(&self, x: &Column<D>) -> f64 {
        (self.offset + self.noise) + self.sign * self.linear.row.dot(x)
    }

    /// Whether the guard stays positive over a leg.
    fn holds_over(&self, leg: &Leg<D>) -> bool {
        let lower = self.value(&leg.from).min(self.value(&leg.to));
        lower > BOUND_MARGIN * self.linear.bounds.over(leg.level, &leg.rate)
    }

    /// Whether the solution leaves the guard's surface with this leg.
    fn starts_with(&self, leg: &Leg<D>) -> bool {
        self.fresh && leg.start_s == 0.0
    }

    fn first_zero(&self, leg: &Leg<D>, series: &Taylor<D>, end: f64) -> Option<f64> {
        let mut coefficients = series.quantity(&self.linear.row);
        for c in &mut coefficients {
            *c *= self.sign;
        }
        coefficients[0] += self.offset;
        let q = Polynomial::new(coefficients);
        if self.starts_with(leg) {
            return q.without_root_at_start().first_negative(end);
        }
        let theta = q.raised(self.noise).first_negative(end)?;
        Some(q.zero_before(theta).unwrap_or(theta))
    }
}

impl<const D: usize> Flow<'_, D> {
    /// The first zero of a guard within `length_s`, or the end.
    pub(crate) fn first_zero(
        &self,
        guards: &[Option<LinearGuard<'_, D>>],
        length_s: f64,
        first_level: usize,
    ) -> Result<Stop<D>, TooManySteps> {
        let mut walk = self.walk(length_s, first_level);
        let settled = |leg: &Leg<D>| {
            let passes =
                |guard: &LinearGuard<'_, D>| !guard.starts_with(leg) && guard.holds_over(leg);
            guards.iter().flatten().all(passes)
        };
        while let Some(stretch) = walk.next(settled)? {
            let Stretch::Leaf { leg, series, end } = stretch else {
                continue;
            };
            let mut first: Option<(f64, usize)> = None;
            for (place, guard) in guards.iter().enumerate() {
                let Some(guard) = guard else { continue };
                if !guard.starts_with(&leg) && guard.holds_over(&leg) && end == 1.0 {
                    continue;
                }
                if let Some(theta) = guard.first_zero(&leg, &series, end)
                    && first.is_none_or(|(earliest, _)| theta < earliest)
                {
                    first = Some((theta, place));
                }
            }
            if let Some((theta, place)) = first {
                return Ok(Stop {
                    time_s: leg.start_s + theta / end * leg.length_s,
                    x: series.at(theta),
                    guard: Some(place),
                });
            }
        }
        Ok(Stop {
            time_s: length_s,
            x: walk.x,
            guard: None,
        })
    }
}
