//! Solver `dopri5`: adaptive steps, and every mode change located.
//!
//! The steps are those of the Dormand-Prince pair of order 8(5,3)
//! ([`super::dop853`]). Each accepted step is searched for the first guard that
//! falls below zero ([`crate::hybrid::guard`]): where its ends and its bends
//! exclude none ([`Stray`]), the polynomial of its dense output decides
//! ([`Ends::septic`]). A step with such a guard is taken again, shorter, by Newton
//! on its length, so that the event is as accurate as the solution itself.

use super::dop853::{self, Step, Stray};
use super::piece::SteppedPiece;
use crate::hybrid::guard::Guard;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::axis::Drive;
use crate::model::direction::Direction;
use crate::model::pid::Side;
use crate::model::rates::Rates;
use crate::model::state::Vector;
use crate::numerics::bernstein::{Ends, NODES};
use crate::numerics::seconds;
use crate::observe::Watch;

/// Steps that any interval may take, and steps per second of simulated time
/// on top, after which the plant is called too stiff: an average step below
/// 10 ns would keep a user waiting for minutes without a word.
const MAX_STEPS: f64 = 100_000.0;
const MAX_STEPS_PER_S: f64 = 1e8;

impl Automaton {
    /// Solver `dopri5`: piece by piece between the breaks of the command.
    pub(crate) fn advance_smoothly(
        &mut self,
        steps: &mut StepSize,
        drive: &Drive<'_>,
        length_ns: u64,
        tolerance: f64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let (start_s, length_s) = (seconds(self.time_ns), seconds(length_ns));
        let mut interval = Interval::new(start_s, length_s);
        self.take_up(drive);
        let breaks_s = match drive {
            Drive::Held(_) => {
                // The command jumps at every interval's start.
                steps.restart();
                &[]
            }
            Drive::Feedback(pid) => pid.motion().breaks_from(start_s),
        };
        let breaks_s = breaks_s.iter().map(|t| t - start_s);
        for end_s in breaks_s.take_while(|&t| t < length_s).chain([length_s]) {
            if end_s > interval.done_s {
                self.advance_piece(steps, drive, &mut interval, end_s, tolerance, watch)?;
            }
        }
        Ok(())
    }

    /// Advances to `end_s` after the interval's start; the right-hand side is
    /// smooth in time until then.
    fn advance_piece(
        &mut self,
        steps: &mut StepSize,
        drive: &Drive<'_>,
        interval: &mut Interval,
        end_s: f64,
        tolerance: f64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let mut f0 = self.settle(drive, interval, watch)?;
        let axis = self.axis;
        while interval.done_s < end_s {
            let left_s = end_s - interval.done_s;
            let h = even_share(left_s, steps.next_s);
            let last = h == left_s;
            let time_s = interval.now_s();
            let rates = Rates::new(&axis, &self.mode, drive, time_s);
            let step = dop853::step(|t, y| rates.at(t, y), time_s, &self.y, &f0, h);
            let error = error_norm(&step, &rates.noise(&step.y1), tolerance);
            interval.steps += 1.0;
            // Beyond the one that any interval takes.
            interval.count_work(u64::from(interval.steps > 1.0), watch)?;
            if !step.y1.iter().all(|v| v.is_finite()) && h < 1e-12 {
                return Err(PlantError::NonFinite { time_s });
            }
            if h < 1e-15 && !last
                || interval.steps > MAX_STEPS + MAX_STEPS_PER_S * interval.length_s
            {
                return Err(PlantError::TooStiff { time_s });
            }
            if error.is_nan() || error > 1.0 {
                steps.reject(h, error);
                continue;
            }
            let stray = step.stray();
            match self.first_event(drive, &rates, &step, &stray) {
                None => {
                    self.accept(drive, &step, stray, watch);
                    interval.done_s = if last { end_s } else { interval.done_s + h };
                    f0 = step.f1;
                    steps.accept(h, error, last);
                }
                Some((guard, theta)) => {
                    let (shorter, hit) = self.locate(drive, &rates, &step, guard, theta);
                    self.accept(drive, &shorter, stray, watch);
                    interval.done_s += shorter.h;
                    f0 = shorter.f1;
                    if hit {
                        interval.count_event()?;
                        self.switch(guard, drive, interval, watch);
                        f0 = self.settle(drive, interval, watch)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Hands the step to the observer and moves to its end, off the surface it began on.
    fn accept(&mut self, drive: &Drive<'_>, step: &Step, stray: Stray, watch: &mut impl Watch) {
        let piece = SteppedPiece {
            dense: Some((step, 0.0, 1.0)),
            rates: (step.f0(), &step.f1),
            stray,
        };
        self.move_along(drive, (step.start_s, step.h), step.y1, &piece, watch);
        self.fresh = None;
    }

    /// The guard that is first to fall below zero within the step, and where.
    fn first_event(
        &self,
        drive: &Drive<'_>,
        rates: &Rates<'_>,
        step: &Step,
        stray: &Stray,
    ) -> Option<(Guard, f64)> {
        let mut first: Option<(Guard, f64)> = None;
        let mut upper: Option<Ends> = None;
        let (start_s, end_s) = (step.start_s, step.start_s + step.h);
        for guard in self.guards(drive).into_iter().flatten() {
            let look = |now: (f64, Side), here: (&Vector, &Vector)| {
                self.axis.guard(guard, &self.mode, drive, now, here)
            };
            let ends = match (guard, upper, drive) {
                // The two limits are one demand seen from both sides.
                (Guard::Limit(Direction::Negative), Some(upper), Drive::Feedback(pid)) => Ends {
                    values: upper.values.map(|value| 2.0 * pid.limit() - value),
                    slopes: upper.slopes.map(|slope| -slope),
                },
                _ => Ends::new(
                    look((start_s, Side::After), (&step.y0, step.f0())),
                    look((end_s, Side::Before), (&step.y1, &step.f1)),
                    step.h,
                ),
            };
            if guard == Guard::Limit(Direction::Positive) {
                upper = Some(ends);
            }
            let (low, _) = ends.hull(self.axis.guard_reach(guard, drive, stray));
            if low >= 0.0 {
                continue;
            }
            let septic = ends.septic(NODES.map(|theta| {
                let y = step.at(|t, y| rates.at(t, y), theta);
                // The rate is not used; any derivative will do.
                look((start_s + theta * step.h, Side::After), (&y, step.f0())).0
            }));
            let root = if self.fresh == Some(guard) {
                septic.without_root_at_start().first_negative()
            } else {
                septic.first_negative()
            };
            if let Some(theta) = root
                && first.is_none_or(|(_, earliest)| theta < earliest)
            {
                first = Some((guard, theta));
            }
        }
        first
    }

    /// Shortens the step so that it ends where `guard` reaches zero: Newton
    /// on the length of the step itself, so that the root is as good as the
    /// solution and not merely as its dense output. Where the guard turns out
    /// to stay positive (it only grazes zero), the shorter step is still
    /// valid; `false` says that nothing switches.
    fn locate(
        &self,
        drive: &Drive<'_>,
        rates: &Rates<'_>,
        step: &Step,
        guard: Guard,
        theta: f64,
    ) -> (Step, bool) {
        let f = |t: f64, y: &Vector| rates.at(t, y);
        let (time_s, f0) = (step.start_s, step.f0());
        let look = |step: &Step| {
            let now = (time_s + step.h, Side::Before);
            self.axis
                .guard(guard, &self.mode, drive, now, (&step.y1, &step.f1))
        };
        let mut h = theta * step.h;
        let (mut low_s, mut high_s) = (0.0, None);
        let mut trial = dop853::step(f, time_s, &step.y0, f0, h);
        for _ in 0..50 {
            let (value, rate) = look(&trial);
            if value > 0.0 {
                low_s = h;
            } else {
                high_s = Some(h);
            }
            let correction_s = -value / rate;
            // Below the resolution of the clock there is nothing to gain but
            // the bias of the polynomial's root, which a thousand changes add
            // up; the last correction takes it out.
            if value == 0.0 || correction_s.abs() < 1e-16 {
                let last_s = h + correction_s;
                if last_s != h && last_s > 0.0 && last_s <= step.h {
                    trial = dop853::step(f, time_s, &step.y0, f0, last_s);
                }
                return (trial, true);
            }
            if rate >= 0.0 && high_s.is_none() {
                return (trial, false);
            }
            let top_s = high_s.unwrap_or(step.h);
            let mut next_s = h + correction_s;
            if !(next_s > low_s && next_s < top_s) {
                next_s = match high_s {
                    Some(high_s) => 0.5 * (low_s + high_s),
                    None if h < step.h => step.h,
                    None => return (trial, false),
                };
            }
            if next_s == h {
                break;
            }
            h = next_s;
            trial = dop853::step(f, time_s, &step.y0, f0, h);
        }
        (trial, true)
    }
}

/// Error that a step may add to a state, as shares of the tolerance: of 1
/// rad, rad/s or A, and of the state itself. A run of a second takes tens of
/// thousands of steps, and a joint that rattles multiplies the error of each:
/// over 240 random cases against a program in extended precision the largest
/// error of β was 9.5e-8 rad with shares of 1 and 0.01, and 1.2e-8 with these.
const ABSOLUTE_SHARE: f64 = 0.1;
const RELATIVE_SHARE: f64 = 0.001;

/// Share of the step after the last jump of the voltage that is tried after the
/// next one: jumps differ, and a rejected step costs as much as a good one.
const RESTART_SHARE: f64 = 0.8;

/// Weight of the rounding of one stage in the estimates: the root of the sum of
/// the squares of their weights is 2.2, and half a last bit is the most of it.
const NOISE_WEIGHT: f64 = 2.0;

/// Steps that the error control would take next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepSize {
    /// Step to take next \[s\].
    next_s: f64,
    /// After a jump of the voltage, from the last such jump: the transient that
    /// follows needs shorter steps than what it has become by the next one.
    /// Without this memory every sixth step was rejected (W1: 1 ms between
    /// jumps).
    restart_s: f64,
    restarted: bool,
}

impl StepSize {
    /// Before anything is known; the first steps correct it.
    pub(crate) fn new() -> Self {
        Self {
            next_s: 1e-5,
            restart_s: 1e-5,
            restarted: false,
        }
    }

    /// The voltage has jumped.
    fn restart(&mut self) {
        self.next_s = self.next_s.min(RESTART_SHARE * self.restart_s);
        self.restarted = true;
    }

    /// A step of `h` had an error above 1.
    fn reject(&mut self, h: f64, error: f64) {
        self.next_s = h * growth(error).min(0.9);
    }

    /// A step of `h` was good; `last` if the interval's end cut it short, which
    /// says little about the next.
    fn accept(&mut self, h: f64, error: f64, last: bool) {
        let wanted_s = h * growth(error);
        let longer = |known_s: f64| match last {
            true => wanted_s.max(known_s),
            false => wanted_s,
        };
        self.next_s = longer(self.next_s);
        if self.restarted {
            self.restart_s = longer(self.restart_s);
            self.restarted = false;
        }
    }
}

/// Error of the step, 1 being what is allowed: the largest of its components
/// relative to what the tolerance allows them. The estimates of order 5 and 3
/// go with h⁶ and h⁴; `e5²/√(e5² + e3²/100)` goes with h⁸ (Hairer, Nørsett,
/// Wanner, section II.10), here written so that no square overflows first.
///
/// `noise` is the rounding in the derivatives. The estimates weigh it like a
/// part of the solution, and it does not go with any power of h: at a tolerance
/// of 1e-14 a joint of 9e5 N m/rad behind a gap of 0.13 rad shortened the steps
/// to nothing. What it amounts to is allowed.
fn error_norm(step: &Step, noise: &Vector, tolerance: f64) -> f64 {
    let (fifth, third) = step.errors();
    let (mut e5, mut e3, mut sum) = (0.0_f64, 0.0_f64, 0.0);
    let parts = fifth.iter().zip(third.iter()).zip(noise.iter());
    for (((fifth, third), noise), y) in parts.zip(step.y1.iter()) {
        let of_solution = tolerance * (ABSOLUTE_SHARE + RELATIVE_SHARE * y.abs());
        let allowed = of_solution + NOISE_WEIGHT * noise * step.h;
        let per_allowed = 1.0 / allowed;
        let (share5, share3) = (fifth.abs() * per_allowed, third.abs() * per_allowed);
        e5 = e5.max(share5);
        e3 = e3.max(share3);
        sum += share5 + share3;
    }
    // `max` hides a NaN, a sum does not.
    if !sum.is_finite() {
        return f64::NAN;
    }
    if e5 == 0.0 {
        return 0.0;
    }
    let ratio = e3 / e5;
    e5 / (1.0 + 0.01 * ratio * ratio).sqrt()
}

/// Factor for the next step: the error goes with h⁸.
fn growth(error: f64) -> f64 {
    if error.is_nan() {
        return 0.2;
    }
    (0.9 / error.sqrt().sqrt().sqrt()).clamp(0.2, 5.0)
}

/// The step to take of what is left, so that equal steps no longer than
/// `wanted_s` fill it and no short one remains at its end.
fn even_share(left_s: f64, wanted_s: f64) -> f64 {
    // A remainder too short to matter is joined to the others.
    let steps = (left_s / wanted_s - 0.001).ceil();
    if steps > 1.0 { left_s / steps } else { left_s }
}
