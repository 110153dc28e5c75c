//! The first mode change within a step of solver `dopri5`: whether there is
//! one, and where.

use crate::hybrid::guard::Instant;
use crate::hybrid::mode::{Direction, Guard};
use crate::model::axis::Drive;
use crate::model::pid::Side;
use crate::model::rates::Rates;
use crate::model::state::Vector;
use crate::numerics::septic::Ends;
use crate::plant::Plant;
use crate::stepped::dop853::{self, NODES, Step};
use crate::stepped::reach::Reach;

impl Plant {
    /// The guard that is first to fall below zero within the step, and where.
    pub(crate) fn first_event(
        &self,
        drive: &Drive<'_>,
        rates: &Rates<'_>,
        step: &Step,
        reach: &Reach,
    ) -> Option<(Guard, f64)> {
        let mut first: Option<(Guard, f64)> = None;
        let mut upper = None;
        for guard in self.guards(drive).into_iter().flatten() {
            let look = |instant: Instant<'_>| self.axis.guard(guard, &self.mode, drive, instant);
            let (start_s, end_s) = (step.start_s, step.start_s + step.h);
            let ends = match (guard, upper, drive) {
                // The two limits are one demand seen from both sides.
                (Guard::Limit(Direction::Negative), Some(ends), Drive::Feedback(pid)) => {
                    mirrored(&ends, 2.0 * pid.voltage_limit_v())
                }
                _ => {
                    let (start, start_rate) = look(Instant {
                        time_s: start_s,
                        side: Side::After,
                        y: &step.y0,
                        dy: step.f0(),
                    });
                    let (end, end_rate) = look(Instant {
                        time_s: end_s,
                        side: Side::Before,
                        y: &step.y1,
                        dy: &step.f1,
                    });
                    Ends {
                        start,
                        start_slope: start_rate * step.h,
                        end,
                        end_slope: end_rate * step.h,
                    }
                }
            };
            if guard == Guard::Limit(Direction::Positive) {
                upper = Some(ends);
            }
            let (low, _) = ends.hull(self.axis.guard_reach(guard, drive, reach));
            if low >= 0.0 {
                continue;
            }
            let septic = ends.septic(NODES.map(|theta| {
                let y = step.at(|t, y| rates.at(t, y), theta);
                look(Instant {
                    time_s: start_s + theta * step.h,
                    side: Side::After,
                    y: &y,
                    // The rate is not used; any derivative will do.
                    dy: step.f0(),
                })
                .0
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
    pub(crate) fn locate(
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
            let instant = Instant {
                time_s: time_s + step.h,
                side: Side::Before,
                y: &step.y1,
                dy: &step.f1,
            };
            self.axis.guard(guard, &self.mode, drive, instant)
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

/// `sum − q`.
fn mirrored(q: &Ends, sum: f64) -> Ends {
    Ends {
        start: sum - q.start,
        start_slope: -q.start_slope,
        end: sum - q.end,
        end_slope: -q.end_slope,
    }
}
