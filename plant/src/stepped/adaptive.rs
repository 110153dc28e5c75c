//! Solver `dopri5`: adaptive steps, and every mode change located.
//!
//! The steps are those of the Dormand-Prince pair of order 8(5,3)
//! ([`crate::stepped::dop853`]). Each accepted step is searched for the first guard that
//! falls below zero ([`crate::hybrid::mode`]). Where the step's ends and its bends
//! exclude that ([`crate::stepped::reach`]), it is not looked into; otherwise the
//! polynomial of its dense output decides ([`crate::numerics::septic`]). A step with such
//! a guard is taken again, shorter, by Newton on its length, so that the event
//! is as accurate as the solution itself.

use crate::error::PlantError;
use crate::model::axis::Drive;
use crate::model::rates::Rates;
use crate::observe::span::{Interior, Span, Watch};
use crate::plant::Plant;
use crate::stepped::dop853::{self, Step};
use crate::stepped::piece::SteppedPiece;
use crate::stepped::reach::Reach;
use crate::stepped::step_size::{self, even_share};

/// Mode changes within one interval after which the plant gives up: ten
/// thousand in a sample or a row are no rattle that anyone could use.
const MAX_EVENTS: u32 = 10_000;

/// Steps that any interval may take, and steps per second of simulated time
/// on top, after which the plant is called too stiff: an average step below
/// 10 ns would keep a user waiting for minutes without a word.
const MAX_STEPS: f64 = 100_000.0;
const MAX_STEPS_PER_S: f64 = 1e8;

impl Plant {
    /// Solver `dopri5`: piece by piece between the breaks of the command.
    pub(crate) fn advance_smoothly(
        &mut self,
        drive: &Drive<'_>,
        interval: &mut Interval,
        tolerance: f64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        if let Drive::Held(_) = drive {
            // The voltage jumps at every interval's start.
            self.steps.restart();
        }
        if let Drive::Feedback(pid) = drive {
            for break_s in pid.motion().breaks_s() {
                let offset_s = break_s - interval.start_s;
                if offset_s > interval.done_s && offset_s < interval.length_s {
                    self.advance_piece(drive, interval, offset_s, tolerance, watch)?;
                }
            }
        }
        self.advance_piece(drive, interval, interval.length_s, tolerance, watch)
    }

    /// Advances to `end_s` after the interval's start; the right-hand side is
    /// smooth in time until then.
    fn advance_piece(
        &mut self,
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
            let h = even_share(left_s, self.steps.next_s());
            let last = h == left_s;
            let time_s = interval.now_s();
            let rates = Rates::new(&axis, &self.mode, drive);
            let step = dop853::step(|t, y| rates.at(t, y), time_s, &self.y, &f0, h);
            let error = step_size::error_norm(&step, &rates.noise(&step.y1), tolerance);
            interval.steps += 1.0;
            if !step.y1.iter().all(|v| v.is_finite()) && h < 1e-12 {
                return Err(PlantError::NonFinite { time_s });
            }
            if h < 1e-15 && !last
                || interval.steps > MAX_STEPS + MAX_STEPS_PER_S * interval.length_s
            {
                return Err(PlantError::TooStiff { time_s });
            }
            if error.is_nan() || error > 1.0 {
                self.steps.reject(h, error);
                continue;
            }
            let reach = Reach::new(step.stray(), h, (&step.y0, &step.y1), (step.f0(), &step.f1));
            match self.first_event(drive, &rates, &step, &reach) {
                None => {
                    self.accept(drive, &step, reach, watch);
                    interval.done_s = if last { end_s } else { interval.done_s + h };
                    self.fresh = None;
                    f0 = step.f1;
                    self.steps.accept(h, error, last);
                }
                Some((guard, theta)) => {
                    let (shorter, hit) = self.locate(drive, &rates, &step, guard, theta);
                    self.accept(drive, &shorter, reach, watch);
                    interval.done_s += shorter.h;
                    self.fresh = None;
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

    /// Hands the step to the observer and moves to its end.
    fn accept(&mut self, drive: &Drive<'_>, step: &Step, reach: Reach, watch: &mut impl Watch) {
        let piece = SteppedPiece {
            dense: Some((step, 0.0, 1.0)),
            rates: (step.f0(), &step.f1),
            reach,
        };
        watch.span(&Span {
            axis: &self.axis,
            drive,
            modes: (self.mode, self.mode),
            start_s: step.start_s,
            length_s: step.h,
            y: (&step.y0, &step.y1),
            interior: Interior::Stepped(&piece),
        });
        self.y = step.y1;
    }
}

/// Where an advance stands.
#[derive(Debug)]
pub(crate) struct Interval {
    start_s: f64,
    length_s: f64,
    done_s: f64,
    events: u32,
    steps: f64,
}

impl Interval {
    pub(crate) fn new(start_s: f64, length_s: f64) -> Self {
        Self {
            start_s,
            length_s,
            done_s: 0.0,
            events: 0,
            steps: 0.0,
        }
    }

    pub(crate) fn now_s(&self) -> f64 {
        self.start_s + self.done_s
    }

    /// Time gone since the interval's start \[s\].
    pub(crate) fn done_s(&self) -> f64 {
        self.done_s
    }

    /// Time left to the interval's end \[s\].
    pub(crate) fn left_s(&self) -> f64 {
        self.length_s - self.done_s
    }

    pub(crate) fn move_by(&mut self, time_s: f64) {
        self.done_s += time_s;
    }

    pub(crate) fn count_event(&mut self) -> Result<(), PlantError> {
        self.events += 1;
        if self.events > MAX_EVENTS {
            return Err(PlantError::TooManyEvents {
                time_s: self.now_s(),
            });
        }
        Ok(())
    }
}
