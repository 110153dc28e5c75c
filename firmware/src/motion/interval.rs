//! The seven intervals of the command, in counts and samples.

use heapless::Vec;

use super::real::Real;
use crate::refusal::{Refusal, What};

/// Course of the acceleration within an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    Rise,
    Constant,
    Fall,
}

/// One interval in counts and samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interval {
    /// 1 to 7.
    pub(super) number: u8,
    pub(super) course: Course,
    pub(super) duration: Real,
    /// Position and velocity at its start.
    pub(super) position: Real,
    pub(super) velocity: Real,
    /// The acceleration's amplitude, with its sign.
    pub(super) amplitude: Real,
    /// Its samples, and when the first of them is after its start.
    pub(super) samples: u64,
    pub(super) first: Real,
}

impl Interval {
    /// `ω`, and `ω·τ` at the first sample.
    pub(super) fn first_angle(&self) -> (Real, Real) {
        let omega = Real::HALF_PI.over(self.duration);
        (omega, omega.times(self.first))
    }

    /// The largest acceleration that a sample of the interval may have: an
    /// interval with one sample may be so short that its peak is never seen.
    pub(super) fn largest_acceleration(&self) -> Real {
        let (_, theta) = self.first_angle();
        match (self.samples, self.course) {
            (1, Course::Rise) => self.amplitude.times(theta.sine_cosine().0),
            (1, Course::Fall) => self.amplitude.times(theta.sine_cosine().1),
            _ => self.amplitude,
        }
    }
}

/// The peak speed and the seven intervals, with the amplitudes that lead over
/// the travel to rest.
pub(super) fn chain(
    travel: u64,
    intervals_ps: [u64; 7],
    period_ps: u64,
) -> Result<(Real, Vec<Interval, 7>), Refusal> {
    let period = Real::from_integer(period_ps);
    let [t1, t2, t3, t4, t5, t6, t7] = intervals_ps.map(|t| Real::from_integer(t).over(period));
    let c = Real::TWO_OVER_PI;
    // Speed gained per unit of amplitude: ∫ of a quarter sine is (2/π)·T.
    let gain = t2.plus(c.times(t1.plus(t3)));
    let loss = t6.plus(c.times(t5.plus(t7)));
    for (what, speed) in [(What::Rise, gain), (What::Fall, loss)] {
        if speed.is_zero() {
            return Err(Refusal::new(what, 0, [1, i64::MAX]));
        }
    }
    // Speeds at the joints as parts of the peak speed.
    let v1 = c.times(t1).over(gain);
    let v2 = t2.plus(c.times(t1)).over(gain);
    let v6 = c.times(t7).over(loss);
    let v5 = t6.plus(c.times(t7)).over(loss);
    // Displacements at a peak speed of 1, the last three seen from the end.
    let rest = Real::ONE.minus(c);
    let sine = |t: Real, v: Real| t.times(v).times(rest);
    let ramp = |t: Real, u: Real, v: Real| t.times(u.plus(v)).scaled(-1);
    let cosine = |t: Real, v: Real| t.times(v.plus(c.times(Real::ONE.minus(v))));
    let (zero, one) = (Real::ZERO, Real::ONE);
    let (rise, constant, fall) = (Course::Rise, Course::Constant, Course::Fall);
    // Length, displacement and speed at the start.
    let parts = [
        (rise, t1, sine(t1, v1), zero),
        (constant, t2, ramp(t2, v1, v2), v1),
        (fall, t3, cosine(t3, v2), v2),
        (constant, t4, t4, one),
        (rise, t5, cosine(t5, v5), one),
        (constant, t6, ramp(t6, v5, v6), v5),
        (fall, t7, sine(t7, v6), v6),
    ];
    let unit = parts.iter().fold(zero, |sum, part| sum.plus(part.2));
    let peak = Real::from_integer(travel).scaled(-32).over(unit);

    let (up, down) = (peak.over(gain), peak.over(loss).negated());
    let amplitudes = [up, up, up, zero, down, down, down];
    let rows = intervals_ps.into_iter().zip(parts).zip(amplitudes).zip(1..);

    let mut intervals = Vec::new();
    let (mut start_ps, mut position) = (0_u64, Real::ZERO);
    for (((t_ps, (course, duration, displacement, speed)), amplitude), number) in rows {
        // Sample k lies in the interval if start ≤ k·Δt < end.
        let end_ps = start_ps.saturating_add(t_ps);
        let first_sample = sample_from(start_ps, period_ps);
        // Below 2^42: no time is rounded.
        let first_ps = first_sample
            .saturating_mul(period_ps)
            .saturating_sub(start_ps);
        // There is room for all seven.
        let _ = intervals.push(Interval {
            number,
            course,
            duration,
            position: position.times(peak),
            velocity: speed.times(peak),
            amplitude,
            samples: sample_from(end_ps, period_ps).saturating_sub(first_sample),
            first: Real::from_integer(first_ps).over(period),
        });
        start_ps = end_ps;
        position = position.plus(displacement);
    }
    Ok((peak, intervals))
}

/// The first sample at or after `time_ps`.
pub(super) fn sample_from(time_ps: u64, period_ps: u64) -> u64 {
    let before = period_ps.saturating_sub(1);
    time_ps
        .saturating_add(before)
        .checked_div(period_ps)
        .unwrap_or(0)
}
