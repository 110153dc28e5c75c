//! Extremes of a quantity along the exact solution, between the samples.

use super::roots::Polynomial;
use super::tables::Linear;
use super::taylor::{Coefficients, TERMS, Taylor};
use super::walk::{Flow, Leg, Stretch};
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
    fn value(&self, x: &super::system::Column<D>, time_s: f64) -> f64 {
        let q = self.scale * self.linear.row.dot(x) + self.offset;
        match self.command {
            None => q,
            Some((motion, start_s)) => motion.at(start_s + time_s).displacement_m - q,
        }
    }

    /// Bound of the deviation from the chord over a leg: that of the plant's
    /// part, and `T²/8·sup|a_ref|` for the command.
    fn deviation(&self, leg: &Leg<D>) -> f64 {
        let own = self.scale.abs() * self.linear.bounds.over(leg.level, &leg.rate);
        let command = self.command.map_or(0.0, |(motion, _)| {
            motion.peak_acceleration_mps2() * leg.length_s * leg.length_s / 8.0
        });
        (own + command) * (1.0 + 1e-9)
    }

    /// Upper bound of the magnitude over a leg.
    pub(crate) fn upper_bound(&self, leg: &Leg<D>) -> f64 {
        let end_s = leg.start_s + leg.length_s;
        let ends = self.value(&leg.from, leg.start_s).abs();
        ends.max(self.value(&leg.to, end_s).abs()) + self.deviation(leg)
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

impl<const D: usize> Flow<'_, D> {
    /// The supremum of the quantity's magnitude over `length_s`. It depends on
    /// nothing but the solution: the largest of several is the same whichever
    /// of them a bound has spared.
    pub(crate) fn peak(&self, sought: &Sought<'_, D>, length_s: f64) -> f64 {
        let mut peak = sought.value(self.start, 0.0).abs();
        let mut walk = self.walk(length_s, 0);
        loop {
            match walk.next(|leg| sought.upper_bound(leg) <= peak) {
                Ok(Some(Stretch::Leaf { leg, series, end })) => {
                    peak = peak.max(sought.polynomial(&leg, &series, end).peak(end));
                }
                Ok(Some(Stretch::Settled(_))) => {}
                // A walk as long as this one has been taken before.
                Ok(None) | Err(_) => return peak,
            }
        }
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
        while let Ok(Some(stretch)) = walk.next(|leg| sought.upper_bound(leg) <= band) {
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
