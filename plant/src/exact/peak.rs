//! Extremes of a quantity along the exact solution, between the samples.

use super::roots::Polynomial;
use super::tables::Linear;
use super::taylor::{Coefficients, TERMS, Taylor};
use super::walk::{BOUND_MARGIN, Flow, Leg, Stretch};
use crate::motion::Motion;

/// A quantity `scale·row·x + offset`, or the command less that.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sought<'a, const D: usize> {
    pub(crate) linear: &'a Linear<D>,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// The command with the time at which the solution starts \[s\]; it must
    /// be smooth over the stretch.
    pub(crate) command: Option<(&'a Motion, f64)>,
}

impl<const D: usize> Sought<'_, D> {
    pub(crate) fn value(&self, x: &super::system::Column<D>, time_s: f64) -> f64 {
        let q = self.scale * self.linear.value(x) + self.offset;
        match self.command {
            None => q,
            Some((motion, start_s)) => motion.at(start_s + time_s).displacement_m - q,
        }
    }

    /// How far the quantity may stray from its chord over a leg, and the change
    /// above which it is monotone: those of the plant's part, and `T²/8` and
    /// `T²/2` times sup|a_ref| for the command.
    pub(crate) fn strays(&self, leg: &Leg<D>) -> (f64, f64) {
        let (bounds, scale) = (&self.linear.bounds, self.scale.abs());
        let bend = self.command.map_or(0.0, |(motion, _)| {
            motion.peak_acceleration_mps2() * leg.length_s * leg.length_s
        });
        let chord = scale * bounds.over(leg.level, &leg.rate) + bend / 8.0;
        let slope = scale * bounds.slope_over(leg.level, &leg.rate) + bend / 2.0;
        (chord * BOUND_MARGIN, slope * BOUND_MARGIN)
    }

    /// Whether the quantity's magnitude stays below `floor` within a leg, but
    /// for its ends; `slack` is how many times its bound the chord may be off.
    pub(crate) fn stays_below(&self, leg: &Leg<D>, slack: f64, floor: f64) -> bool {
        let end_s = leg.start_s + leg.length_s;
        let (from, to) = (
            self.value(&leg.from, leg.start_s),
            self.value(&leg.to, end_s),
        );
        let (chord, slope) = self.strays(leg);
        let monotone = slack == 1.0 && (to - from).abs() >= slope;
        monotone || from.abs().max(to.abs()) + slack * chord <= floor
    }

    fn polynomial(&self, leg: &Leg<D>, series: &Taylor<D>, end: f64) -> Polynomial {
        let mut q = series.quantity(&self.linear.row);
        for c in &mut q {
            *c *= self.scale;
        }
        q[0] += self.offset;
        if let Some((motion, start_s)) = self.command {
            let mut command: Coefficients = [0.0; TERMS + 1];
            motion.series(start_s + leg.start_s, leg.length_s / end, &mut command);
            for (q, command) in q.iter_mut().zip(command) {
                *q = command - *q;
            }
        }
        Polynomial::new(q)
    }
}

/// An extreme counts if it exceeds the ends by more than their rounding.
const ABOVE_THE_ENDS: f64 = 1.0 + 1e-14;

/// What two searches may differ by, as a share: another floor leads through
/// other steps.
const BELOW_THE_FLOOR: f64 = 1.0 - 1e-12;

impl<const D: usize> Flow<'_, D> {
    /// The supremum of the quantity's magnitude within `length_s`, if it is
    /// larger than at both ends and than `floor`. Where there is one, it depends
    /// on nothing but the solution: the largest of several is the same whichever
    /// of them a bound has spared.
    pub(crate) fn peak_within(
        &self,
        sought: &Sought<'_, D>,
        length_s: f64,
        floor: f64,
    ) -> Option<f64> {
        let ends = sought.value(self.start, 0.0).abs();
        let ends = ends.max(sought.value(&self.at(length_s), length_s).abs()) * ABOVE_THE_ENDS;
        let low = floor * BELOW_THE_FLOOR;
        if low > ends && self.peak_above(sought, length_s, low) <= low {
            return None;
        }
        let peak = self.peak_above(sought, length_s, ends);
        (peak > ends.max(floor)).then_some(peak)
    }

    /// The supremum between the ends, or `floor` if that is larger.
    fn peak_above(&self, sought: &Sought<'_, D>, length_s: f64, floor: f64) -> f64 {
        let mut peak = floor;
        let mut walk = self.walk(length_s, 0);
        // A walk as long as this one has been taken before, so it ends.
        while let Ok(Some(stretch)) = walk.next(|leg| sought.stays_below(leg, 1.0, peak)) {
            match stretch {
                Stretch::Settled(leg) => {
                    let end_s = leg.start_s + leg.length_s;
                    if end_s < length_s {
                        peak = peak.max(sought.value(&leg.to, end_s).abs());
                    }
                }
                Stretch::Leaf { leg, series, end } => {
                    peak = peak.max(sought.polynomial(&leg, &series, end).peak(end));
                }
            }
        }
        peak
    }

    /// When within `length_s` the quantity's magnitude is last above `band`.
    pub(crate) fn last_outside(
        &self,
        sought: &Sought<'_, D>,
        band: f64,
        length_s: f64,
    ) -> Option<f64> {
        let mut last = None;
        let mut walk = self.walk(length_s, 0);
        let inside = |leg: &Leg<D>| {
            let end_s = leg.start_s + leg.length_s;
            let ends = sought.value(&leg.from, leg.start_s).abs();
            let ends = ends.max(sought.value(&leg.to, end_s).abs());
            ends + sought.strays(leg).0 <= band
        };
        while let Ok(Some(stretch)) = walk.next(inside) {
            if let Stretch::Leaf { leg, series, end } = stretch
                && let Some(theta) = sought
                    .polynomial(&leg, &series, end)
                    .last_outside(band, end)
            {
                last = Some(leg.start_s + theta / end * leg.length_s);
            }
        }
        last
    }
}
