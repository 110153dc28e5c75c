//! The first zero of a mode's guards along the exact solution.
//!
//! None is missed. The sketch over the whole stretch is believed where its
//! remainder leaves no question ([`super::sketch`]). Else the stretch is walked
//! along: a leg is passed over only if the chord bound excludes a zero, and on
//! the shortest legs Descartes' rule isolates every root of the
//! guard's polynomial, so that a crossing and its return inside one sample are
//! two roots like any others. What remains is rounding: a dip shallower than
//! that of the polynomial's coefficients (relative 1e-15 of its terms) cannot
//! be told from a touch.

use super::grid::zero_near;
use super::levels::BOUND_MARGIN;
use super::roots::Polynomial;
use super::sketch::{Found, VALUES, first_zero as first_zero_of};
use super::system::Column;
use super::tables::{Linear, Quantity, Table};
use super::taylor::Taylor;
use super::walk::{Flow, Leg, Stretch, TooManySteps};

use crate::hybrid::Automaton;
use crate::hybrid::guard::{Direction, Guard, speed_noise};
use crate::model::joint::Flank;

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

impl Automaton {
    /// A guard of the present mode as a linear function of the table's state.
    pub(crate) fn linear_guard<'t, const D: usize>(
        &self,
        guard: Guard,
        table: &'t Table<D>,
        limit_v: f64,
    ) -> LinearGuard<'t, D> {
        let joint = self.axis.joint;
        let b = self.axis.backlash_half_rad();
        let release_nm = joint.map_or(0.0, |joint| self.axis.release_noise_nm(joint, &self.y));
        let part_rad = joint.map_or(0.0, |joint| release_nm / joint.stiffness_nm_per_rad);
        let flank = |flank: Flank| flank.sign();
        let way = |direction: Direction| direction.sign();
        let (quantity, sign, offset, noise) = match guard {
            // In the gap δ = ε.
            Guard::Meet(f) => (Quantity::Delta, -flank(f), b, 0.0),
            Guard::Part(f) => (Quantity::Delta, flank(f), 0.0, part_rad),
            Guard::Release(f) => (Quantity::FlankTorque, flank(f), 0.0, release_nm),
            Guard::Reload(f) => (Quantity::FlankTorque, -flank(f), 0.0, 0.0),
            Guard::Stop(d) => (Quantity::ScrewSpeed, way(d), 0.0, speed_noise(&self.y)),
            Guard::Break(d) => (
                Quantity::MovingTorque,
                -way(d),
                self.axis.holding_torque_nm,
                0.0,
            ),
            Guard::Limit(d) => (Quantity::Demand, -way(d), limit_v, 0.0),
            Guard::Unlimit(d) => (Quantity::Demand, way(d), -limit_v, 0.0),
        };
        LinearGuard {
            linear: table.quantity(quantity),
            sign,
            offset,
            noise,
            fresh: self.fresh == Some(guard),
        }
    }
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

    /// What the sketch of the guard over a step tells about its first zero.
    fn sketched_zero(&self, flow: &Flow<'_, D>, rate: &Column<D>, theta: f64) -> Option<Found> {
        let start = self.offset + self.sign * self.linear.row.dot(flow.start);
        let sketch = self.linear.sketch.as_ref()?;
        let curve = sketch.curve(rate, self.sign, start);
        let found = if self.fresh {
            let rest = without_start(&curve.values);
            if rest.iter().all(|&b| b > curve.stray) {
                return Some(Found::None);
            }
            let rest = without_start(&curve.values_until(theta));
            first_zero_of(&rest, curve.stray, 0.0, HALVINGS)
        } else if curve.values.iter().all(|&b| b > curve.stray) {
            Found::None
        } else {
            let values = curve.values_until(theta);
            first_zero_of(&values, curve.stray, self.noise, HALVINGS)
        };
        match found {
            // One zero only.
            Found::At { from, to, .. }
                if from > 0.0 && curve.falls_within(theta * from, theta * to) =>
            {
                Some(found)
            }
            Found::None => Some(found),
            _ => None,
        }
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

/// `(q(θ) − q(0))/θ`, whose remainder is that of the slope: the zero at the
/// start divided out. It begins with the slope, known not to fall.
fn without_start(values: &[f64; VALUES]) -> [f64; VALUES - 1] {
    let start = values[0];
    let mut b = [0.0; VALUES - 1];
    let mut count = 1.0;
    for (b, value) in b.iter_mut().zip(&values[1..]) {
        *b = (value - start) * (11.0 / count);
        count += 1.0;
    }
    b
}

/// Halvings of a sketch before it is called unclear.
const HALVINGS: u32 = 3;

impl<const D: usize> Flow<'_, D> {
    /// The first zero, or the end, from the sketches of the guards; `None` where
    /// one of them is not clear.
    fn sketched_zero(
        &self,
        guards: &[Option<LinearGuard<'_, D>>],
        length_s: f64,
    ) -> Option<Stop<D>> {
        let grid = self.table.grid.as_ref()?;
        let rate = self.table.levels.a * self.start + self.input;
        let theta = length_s / grid.length_s();
        let mut first: Option<(usize, &LinearGuard<'_, D>, [f64; 3])> = None;
        for (place, guard) in guards.iter().enumerate() {
            let Some(guard) = guard else { continue };
            let Found::At { theta, from, to } = guard.sketched_zero(self, &rate, theta)? else {
                continue;
            };
            match first {
                Some((.., [_, low, high])) if from <= high && low <= to => return None,
                Some((.., [earliest, ..])) if earliest < theta => {}
                _ => first = Some((place, guard, [theta, from, to])),
            }
        }
        let Some((place, guard, [zero, from, to])) = first else {
            let local = grid.near(&self.table.levels.a, self.start, &rate, length_s);
            return Some(Stop {
                time_s: length_s,
                x: local.at(local.sigma(length_s)),
                guard: None,
            });
        };
        let local = grid.near(&self.table.levels.a, self.start, &rate, zero * length_s);
        let mut coefficients = local.quantity(&guard.linear.row).map(|c| guard.sign * c);
        coefficients[0] += guard.offset;
        let sigma = zero_near(&coefficients, local.sigma(zero * length_s))?;
        let time_s = local.time_s(sigma);
        let within = (from * length_s..=to * length_s).contains(&time_s);
        (within && time_s > 0.0 && time_s <= length_s).then(|| Stop {
            time_s,
            x: local.at(sigma),
            guard: Some(place),
        })
    }

    /// The first zero of a guard within `length_s`, or the end.
    pub(crate) fn first_zero(
        &self,
        guards: &[Option<LinearGuard<'_, D>>],
        length_s: f64,
        first_level: usize,
    ) -> Result<Stop<D>, TooManySteps> {
        if let Some(stop) = self.sketched_zero(guards, length_s) {
            return Ok(stop);
        }
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
