//! A walk along the exact solution from one state, for as long as a mode lasts,
//! and the first zero of the mode's guards along it.
//!
//! The walk takes the longest steps that will do: one that the chord bound of
//! [`super::levels`] settles costs two products with a small matrix; one that it
//! does not settle is halved; the shortest is handed over as a Taylor series,
//! whose polynomials decide.
//!
//! No zero is missed. The sketch over the whole stretch is believed where its
//! remainder leaves no question ([`super::sketch`]). Else the stretch is walked
//! along: a leg is passed over only if the chord bound excludes a zero, and on
//! the shortest legs Descartes' rule isolates every root of the
//! guard's polynomial, so that a crossing and its return inside one sample are
//! two roots like any others. What remains is rounding: a dip shallower than
//! that of the polynomial's coefficients (relative 1e-15 of its terms) cannot
//! be told from a touch.

use super::curve::{Found, first_zero as first_zero_of, without_start};
use super::grid::{Local, scaled, zero_near};
use super::levels::{BOUND_MARGIN, Coefficients, TERMS, Taylor};
use super::system::Column;
use super::table::{Linear, Quantity, Table};
use crate::hybrid::Automaton;
use crate::hybrid::guard::{Guard, speed_noise};
use crate::model::motion::Motion;
use crate::numerics::bernstein::Polynomial;
use crate::numerics::width::One;

/// Steps of one walk after which the plant is called too stiff: a sample of
/// the stiffest axis that was tried takes some thousands.
const MOST_STEPS: u32 = 4_000_000;

/// The solution of `dx/dt = A·x + u` from `start`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flow<'a, const D: usize> {
    pub(super) table: &'a Table<D>,
    pub(super) input: Column<D>,
    pub(super) start: Column<D>,
    /// dx/dt at the start.
    pub(super) rate: Column<D>,
}

/// One step along the solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg<const D: usize> {
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    pub(crate) from: Column<D>,
    /// dx/dt at the start.
    pub(crate) rate: Column<D>,
    pub(crate) to: Column<D>,
    /// Number of the table's step that this is.
    pub(crate) level: usize,
}

/// A leg that the bound has settled, or one of the shortest with its series.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Stretch<const D: usize> {
    Settled(Leg<D>),
    /// `end` is the θ of the series at which the leg ends.
    Leaf {
        leg: Leg<D>,
        series: Taylor<D>,
        end: f64,
    },
}

/// A walk of a given length, and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Walk<'a, const D: usize> {
    flow: &'a Flow<'a, D>,
    length_s: f64,
    time_s: f64,
    level: usize,
    steps: u32,
    x: Column<D>,
    /// dx/dt there, once it is known.
    rate: Option<Column<D>>,
}

impl<'a, const D: usize> Flow<'a, D> {
    pub(super) fn new(table: &'a Table<D>, input: Column<D>, start: Column<D>) -> Self {
        Self {
            table,
            input,
            start,
            rate: table.levels.a * start + input,
        }
    }

    /// A walk that tries steps from `first_level` on.
    pub(super) fn walk(&self, length_s: f64, first_level: usize) -> Walk<'_, D> {
        Walk {
            flow: self,
            length_s,
            time_s: 0.0,
            level: first_level.min(self.table.levels.steps.len() - 1),
            steps: 0,
            x: self.start,
            rate: Some(self.rate),
        }
    }

    /// The solution around `time_s`, where the table has a grid.
    pub(crate) fn near(&self, time_s: f64) -> Option<Local<One, D>> {
        let grid = self.table.grid.as_ref()?;
        let from = (&self.start.into(), &self.rate.into());
        Some(grid.near(One, &self.table.levels.a, from, time_s))
    }

    /// The state after `time_s`. Every leg is settled, so that the number of
    /// steps is at most that of the halvings.
    pub(crate) fn at(&self, time_s: f64) -> Column<D> {
        if let Some(local) = self.near(time_s) {
            return local.at(local.window.sigma(time_s)).into();
        }
        let mut walk = self.walk(time_s, 0);
        while walk.next(|_| true).is_some() {}
        walk.x
    }
}

/// Ends are compared with this much of the length to spare: binary fractions
/// of it are exact, but what is left of an interval after an event is not.
const SPARE: f64 = 4.0 * f64::EPSILON;

impl<const D: usize> Walk<'_, D> {
    /// Work of the walk so far. A walk on any but a stiff table is so short that it
    /// counts as none: runs side by side spare other ones than a single run.
    pub(super) fn work(&self) -> u64 {
        match self.flow.table.levels.is_stiff() {
            true => u64::from(self.steps),
            false => 0,
        }
    }

    /// The next stretch; `None` at the end of the walk, and where it takes too many steps.
    pub(super) fn next(&mut self, settled: impl Fn(&Leg<D>) -> bool) -> Option<Stretch<D>> {
        let levels = &self.flow.table.levels;
        let steps = &levels.steps;
        let last = steps.len() - 1;
        let left_s = self.length_s - self.time_s;
        let spare_s = SPARE * self.length_s;
        if left_s <= spare_s {
            return None;
        }
        let rate = self.rate.take();
        let rate = rate.unwrap_or_else(|| levels.a * self.x + self.flow.input);
        loop {
            self.steps += 1;
            if self.steps > MOST_STEPS {
                return None;
            }
            let step = &steps[self.level];
            let whole = step.length_s <= left_s + spare_s;
            if !whole && self.level < last {
                self.level += 1;
                continue;
            }
            let mut leg = Leg {
                start_s: self.time_s,
                length_s: step.length_s,
                from: self.x,
                rate,
                to: self.x + step.integral * rate,
                level: self.level,
            };
            if whole && settled(&leg) {
                self.move_to(&leg);
                self.level = self.level.saturating_sub(1);
                return Some(Stretch::Settled(leg));
            }
            if self.level < last {
                self.level += 1;
                continue;
            }
            let series = Taylor::new(&levels.a, &leg.from, &rate, step.length_s);
            let mut end = 1.0;
            if !whole {
                leg.length_s = left_s;
                end = left_s / step.length_s;
                leg.to = series.at(end);
            }
            self.move_to(&leg);
            return Some(Stretch::Leaf { leg, series, end });
        }
    }

    fn move_to(&mut self, leg: &Leg<D>) {
        self.time_s = leg.start_s + leg.length_s;
        self.x = leg.to;
    }
}

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

impl<'a, const D: usize> Sought<'a, D> {
    /// The quantity itself, with its constant part.
    pub(super) fn plain(linear: &'a Linear<D>, offset: f64) -> Self {
        Self {
            linear,
            scale: 1.0,
            offset,
            command: None,
        }
    }

    pub(crate) fn value(&self, x: &Column<D>, time_s: f64) -> f64 {
        let q = self.scale * self.linear.value(x) + self.offset;
        match self.command {
            None => q,
            Some((motion, start_s)) => motion.at(start_s + time_s).displacement_m - q,
        }
    }

    /// Bound of how far the quantity strays from its chord over `length_s`, a step of
    /// level `level` or shorter: by what the plant's part may, and `T²/8` times
    /// sup|a_ref| for the command.
    pub(crate) fn chord_bound(&self, level: usize, rate: &Column<D>, length_s: f64) -> f64 {
        let own = self.scale.abs() * self.linear.bounds.over(level, rate);
        (own + self.bend(length_s) / 8.0) * BOUND_MARGIN
    }

    /// The change above which the quantity is monotone over a step of level
    /// `level`; `T²/2` times sup|a_ref| for the command.
    pub(crate) fn slope_bound(&self, level: usize, rate: &Column<D>, length_s: f64) -> f64 {
        let own = self.scale.abs() * self.linear.bounds.slope_over(level, rate);
        (own + self.bend(length_s) / 2.0) * BOUND_MARGIN
    }

    fn bend(&self, length_s: f64) -> f64 {
        self.command.map_or(0.0, |(motion, _)| {
            motion.peak_acceleration_mps2 * length_s * length_s
        })
    }

    /// True if the quantity's magnitude stays below `floor` within a leg, but
    /// for its ends.
    pub(super) fn stays_below(&self, leg: &Leg<D>, floor: f64) -> bool {
        let end_s = leg.start_s + leg.length_s;
        let (from, to) = (
            self.value(&leg.from, leg.start_s),
            self.value(&leg.to, end_s),
        );
        let (level, rate, length_s) = (leg.level, &leg.rate, leg.length_s);
        (to - from).abs() >= self.slope_bound(level, rate, length_s)
            || from.abs().max(to.abs()) + self.chord_bound(level, rate, length_s) <= floor
    }

    /// Coefficients in powers of the θ of a leg's series.
    fn powers(&self, leg: &Leg<D>, series: &Taylor<D>, end: f64) -> Coefficients {
        let mut q = series.quantity(&self.linear.row);
        for c in &mut q {
            *c *= self.scale;
        }
        q[0] += self.offset;
        if let Some((motion, start_s)) = self.command {
            let mut command: Coefficients = [0.0; TERMS + 1];
            let now = motion.oscillator(start_s + leg.start_s);
            now.series(leg.length_s / end, &mut command);
            for (q, command) in q.iter_mut().zip(command) {
                *q = command - *q;
            }
        }
        q
    }

    /// The quantity over a leg, from its start to its end.
    pub(super) fn polynomial(
        &self,
        leg: &Leg<D>,
        series: &Taylor<D>,
        end: f64,
    ) -> Polynomial<{ TERMS + 1 }> {
        Polynomial::of_powers(&self.powers(leg, series, end), end)
    }
}

/// A guard, positive within the mode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinearGuard<'a, const D: usize> {
    /// It has the guard's sign as its scale, and no command.
    pub(crate) quantity: Sought<'a, D>,
    /// Depth below zero to which the guard must fall to count. The crossing is then
    /// its zero all the same: every separation of a joint that rattles would
    /// else come late, by the same sign, and the next impacts multiply that.
    pub(crate) noise: f64,
    /// The solution starts on the guard's surface and leaves it.
    pub(crate) fresh: bool,
}

/// Stop of the solution: at the first zero of a guard, or at the end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stop<const D: usize> {
    pub(crate) time_s: f64,
    pub(crate) x: Column<D>,
    /// Place of the guard among those given.
    pub(crate) guard: Option<usize>,
    /// Work of finding it.
    pub(crate) work: u64,
}

impl Automaton {
    /// A guard of the present mode as a linear function of the table's state. `limit` is that
    /// of the law's demand, and behind the command voltage and [`Quantity::Beyond`] have these
    /// constant parts.
    pub(crate) fn linear_guard<'t, const D: usize>(
        &self,
        guard: Guard,
        table: &'t Table<D>,
        limit: f64,
        [voltage_v, beyond]: [f64; 2],
    ) -> LinearGuard<'t, D> {
        let joint = self.axis.joint;
        let b = self.axis.backlash_half_rad();
        let release_nm = joint.map_or(0.0, |joint| self.axis.release_noise_nm(joint, &self.y));
        let part_rad = joint.map_or(0.0, |joint| release_nm / joint.stiffness_nm_per_rad);
        let holding_nm = self.axis.holding_torque_nm;
        let (limit_v, limit_a, _) = self.axis.stage.numbers();
        let (quantity, sign, offset) = match guard {
            // In the gap δ = ε.
            Guard::Meet(f) => (Quantity::Delta, -f.sign(), b),
            Guard::Part(f) => (Quantity::Delta, f.sign(), 0.0),
            Guard::Release(f) => (Quantity::FlankTorque, f.sign(), 0.0),
            Guard::Reload(f) => (Quantity::FlankTorque, -f.sign(), 0.0),
            Guard::Stop(d) => (Quantity::ScrewSpeed, d.sign(), 0.0),
            Guard::Break(d) => {
                let holds_nm = holding_nm + d.sign() * self.axis.load_torque_nm();
                (Quantity::MovingTorque, -d.sign(), holds_nm)
            }
            Guard::Limit(d) => (Quantity::Demand, -d.sign(), limit),
            Guard::Unlimit(d) => (Quantity::Demand, d.sign(), -limit),
            Guard::Saturate(d) => (Quantity::Beyond, -d.sign(), limit_v - d.sign() * beyond),
            Guard::Desaturate(d) => (Quantity::Beyond, d.sign(), d.sign() * beyond - limit_v),
            Guard::Hold(d) => (Quantity::Current, -d.sign(), limit_a),
            Guard::LetGo(d) => (Quantity::Beyond, d.sign(), d.sign() * beyond),
            Guard::Overrun(d) => (Quantity::Voltage, d.sign(), limit_v + d.sign() * voltage_v),
            Guard::Return(d) => (Quantity::Current, d.sign(), -limit_a),
        };
        let noise = match guard {
            Guard::Part(_) => part_rad,
            Guard::Release(_) => release_nm,
            Guard::Stop(_) => speed_noise(&self.y),
            _ => 0.0,
        };
        LinearGuard {
            quantity: Sought {
                linear: table.quantity(quantity),
                scale: sign,
                offset,
                command: None,
            },
            noise,
            fresh: self.fresh == Some(guard),
        }
    }
}

impl<const D: usize> LinearGuard<'_, D> {
    fn value(&self, x: &Column<D>) -> f64 {
        let of = &self.quantity;
        (of.offset + self.noise) + of.scale * of.linear.row.dot(x)
    }

    /// True if the guard stays positive over a leg.
    fn holds_over(&self, leg: &Leg<D>) -> bool {
        let lower = self.value(&leg.from).min(self.value(&leg.to));
        lower > BOUND_MARGIN * self.quantity.linear.bounds.over(leg.level, &leg.rate)
    }

    /// True if the solution leaves the guard's surface with this leg.
    fn starts_with(&self, leg: &Leg<D>) -> bool {
        self.fresh && leg.start_s == 0.0
    }

    /// First zero of the guard over a step, as far as its sketch tells.
    fn sketched_zero(&self, flow: &Flow<'_, D>, theta: f64) -> Option<Found> {
        let curve = flow.whole_curve(&self.quantity)?;
        let holds = match self.fresh {
            true => curve.holds_after_start(One, theta),
            false => curve.holds_until(One, theta),
        };
        if holds != 0 {
            return Some(Found::None);
        }
        let (values, stray) = (curve.values_until(One, theta), curve.stray);
        let found = match self.fresh {
            true => first_zero_of(&without_start(One, &values), stray, 0.0, HALVINGS),
            false => first_zero_of(&values, stray, self.noise, HALVINGS),
        };
        match found {
            // One zero only.
            Found::At([_, from, to])
                if from > 0.0 && curve.falls_within(One, theta * from, theta * to) =>
            {
                Some(found)
            }
            Found::None => Some(found),
            _ => None,
        }
    }

    /// First zero of the guard over a leg, as a share of it.
    fn first_zero(&self, leg: &Leg<D>, series: &Taylor<D>, end: f64) -> Option<f64> {
        if self.starts_with(leg) {
            // `(q(θ) − q(0))/θ`: the root at the start divided out, so that rounding cannot find
            // the crossing that began the leg again. Its value at 0, the slope, is known to be
            // at least 0 and is held there.
            let mut rest = self.quantity.powers(leg, series, end);
            rest.rotate_left(1);
            (rest[0], rest[TERMS]) = (rest[0].max(0.0), 0.0);
            return Polynomial::of_powers(&rest, end).first_negative();
        }
        let powers = self.quantity.powers(leg, series, end);
        // The cheapest bound of all: |q(θ) − q(0)| ≤ Σ|a_n|.
        let reach: f64 = powers[1..].iter().map(|a| a.abs()).sum();
        if powers[0] > reach {
            return None;
        }
        let q = Polynomial::of_powers(&powers, end);
        let theta = q.affine(self.noise, 1.0).first_negative()?;
        let zero = (self.noise != 0.0).then(|| q.zero_before(theta));
        Some(zero.flatten().unwrap_or(theta))
    }
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
        let theta = length_s / self.table.levels.steps[0].length_s;
        let mut first: Option<(usize, &Sought<'_, D>, [f64; 3])> = None;
        for (place, guard) in guards.iter().enumerate() {
            let Some(guard) = guard else { continue };
            let Found::At(zero) = guard.sketched_zero(self, theta)? else {
                continue;
            };
            let [theta, from, to] = zero;
            match first {
                Some((.., [_, low, high])) if from <= high && low <= to => return None,
                Some((.., [earliest, ..])) if earliest < theta => {}
                _ => first = Some((place, &guard.quantity, zero)),
            }
        }
        let Some((place, of, [zero, from, to])) = first else {
            return Some(self.end(length_s));
        };
        let local = self.near(zero * length_s);
        let (window, coefficients) = match &local {
            Some(local) => (local.window, local.quantity(One, &of.linear.row)),
            None => self.around(of.linear, zero * length_s)?,
        };
        let coefficients = scaled::<One>(coefficients, (of.scale, of.offset));
        let (sigma, found) = zero_near(One, &coefficients, window.sigma(zero * length_s), 1);
        let time_s = window.time_s(sigma);
        let within = (from * length_s..=to * length_s).contains(&time_s);
        (found != 0 && within && time_s > 0.0 && time_s <= length_s).then(|| Stop {
            time_s,
            x: local.map_or_else(|| self.at(time_s), |local| local.at(sigma).into()),
            guard: Some(place),
            work: 0,
        })
    }

    /// The end, no guard having a zero before it.
    fn end(&self, length_s: f64) -> Stop<D> {
        Stop {
            time_s: length_s,
            x: self.at(length_s),
            guard: None,
            work: 0,
        }
    }

    /// True if the chord bound excludes a zero of every guard over the whole of the table's
    /// step.
    pub(super) fn all_hold(&self, guards: &[Option<LinearGuard<'_, D>>], length_s: f64) -> bool {
        let step = &self.table.levels.steps[0];
        let leg = Leg {
            start_s: 0.0,
            length_s,
            from: self.start,
            rate: self.rate,
            to: self.start + step.integral * self.rate,
            level: 0,
        };
        step.length_s == length_s
            && !self.table.levels.is_stiff()
            && (guards.iter().flatten()).all(|guard| !guard.fresh && guard.holds_over(&leg))
    }

    /// The first zero of a guard within `length_s`, or the end; `None` if the walk there takes
    /// too many steps.
    pub(super) fn first_zero(
        &self,
        guards: &[Option<LinearGuard<'_, D>>],
        length_s: f64,
        first_level: usize,
    ) -> Option<Stop<D>> {
        if first_level == 0 && self.all_hold(guards, length_s) {
            return Some(self.end(length_s));
        }
        if let Some(stop) = self.sketched_zero(guards, length_s) {
            return Some(stop);
        }
        let mut walk = self.walk(length_s, first_level);
        let settled = |leg: &Leg<D>| {
            let passes =
                |guard: &LinearGuard<'_, D>| !guard.starts_with(leg) && guard.holds_over(leg);
            guards.iter().flatten().all(passes)
        };
        while let Some(stretch) = walk.next(settled) {
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
                return Some(Stop {
                    time_s: leg.start_s + theta * leg.length_s,
                    x: series.at(theta * end),
                    guard: Some(place),
                    work: walk.work(),
                });
            }
        }
        (walk.steps <= MOST_STEPS).then(|| Stop {
            time_s: length_s,
            x: walk.x,
            guard: None,
            work: walk.work(),
        })
    }
}
