//! A piece of a Runge-Kutta solution: what its solver knows of it besides the
//! ends, and the figures' quantities over it.

use crate::hybrid::mode::Mode;
use crate::model::axis::{Axis, Drive};
use crate::model::motion::{Motion, MotionPoint};
use crate::model::pid::Side;
use crate::model::rates::Rates;
use crate::model::state::{BETA, BETA_DOT, CURRENT, Vector, gamma};
use crate::numerics::septic::Ends;
use crate::observe::span::{Interior, Span};
use crate::stepped::dop853::Step;
use crate::stepped::quantity::Quantity;
use crate::stepped::reach::Reach;

/// What a Runge-Kutta solver knows of a span besides its ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SteppedPiece<'a> {
    /// The step with its dense output, and the θ on it of the span's ends.
    /// Solver `rk4` has none: its solution is the cubic through the ends.
    pub(crate) dense: Option<(&'a Step, f64, f64)>,
    /// dy/dt at both ends.
    pub(crate) rates: (&'a Vector, &'a Vector),
    pub(crate) reach: Reach,
}

impl SteppedPiece<'_> {
    /// State at `start + θ·length` of the span that this is the piece of.
    pub(crate) fn at(&self, span: &Span<'_>, theta: f64) -> Vector {
        match self.dense {
            Some((step, from, to)) => {
                let rates = Rates::new(span.axis, &span.modes.0, span.drive);
                step.at(|t, y| rates.at(t, y), from + theta * (to - from))
            }
            None => {
                // Cubic Hermite through both ends.
                let ((y0, y1), (f0, f1)) = (span.y, self.rates);
                let (h, rest) = (span.length_s, 1.0 - theta);
                let chord = y1 - y0;
                let (u, v) = (f0 * h - chord, f1 * h - chord);
                y0 + chord * theta + (u * rest - v * theta) * (theta * rest)
            }
        }
    }
}

/// A span of a Runge-Kutta solver with its piece.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stepped<'a> {
    pub(crate) span: &'a Span<'a>,
    pub(crate) piece: &'a SteppedPiece<'a>,
}

/// A quantity with its rate at one end of a span.
type Probe = (f64, f64);

impl Stepped<'_> {
    /// A quantity over the span, from its value and rate at both ends (given
    /// side, time, state, derivative, mode), its value between them and how
    /// far it may be from the cubic through its ends.
    fn quantity<V: Fn(f64, &Vector) -> f64>(
        &self,
        probe: impl Fn(Side, f64, &Vector, &Vector, &Mode) -> Probe,
        value: V,
        reach: f64,
    ) -> Quantity<'_, V> {
        let (start_s, h) = (self.span.start_s, self.span.length_s);
        let ((m0, m1), (y0, y1)) = (&self.span.modes, self.span.y);
        let (f0, f1) = self.piece.rates;
        let (start, start_rate) = probe(Side::After, start_s, y0, f0, m0);
        let (end, end_rate) = probe(Side::Before, start_s + h, y1, f1, m1);
        Quantity {
            span: self.span,
            ends: Ends {
                start,
                start_slope: start_rate * h,
                end,
                end_slope: end_rate * h,
            },
            reach,
            value,
        }
    }

    /// Carriage acceleration `p·γ̈` over the span \[m/s²\].
    pub(crate) fn acceleration(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let (axis, mode) = (self.span.axis, &self.span.modes.0);
        let p = axis.pitch_m_per_rad();
        self.quantity(
            move |_, _, y, dy, mode| {
                (
                    axis.carriage_acceleration_mps2(mode, y),
                    p * axis.screw_jerk(mode, y, dy),
                )
            },
            move |_, y| axis.carriage_acceleration_mps2(mode, y),
            axis.acceleration_reach(mode, &self.piece.reach),
        )
    }

    /// Armature current over the span \[A\].
    pub(crate) fn current(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        self.quantity(
            |_, _, y, dy, _| (y[CURRENT], dy[CURRENT]),
            |_, y| y[CURRENT],
            self.piece.reach.current(),
        )
    }

    /// Motor voltage over the span \[V\].
    pub(crate) fn voltage(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let (axis, drive, mode) = (self.span.axis, self.span.drive, &self.span.modes.0);
        let limited = self.span.is_voltage_limited();
        let rate = |time_s: f64, side: Side, y: &Vector, dy: &Vector| match drive {
            Drive::Feedback(pid) if !limited => {
                pid.demand_rate(time_s, side, y[BETA], dy[BETA], dy[BETA_DOT])
            }
            _ => 0.0,
        };
        let reach = if limited {
            0.0
        } else {
            Axis::demand_reach(drive, &self.piece.reach)
        };
        self.quantity(
            |side, t, y, dy, mode| (axis.voltage_v(mode, drive, t, y), rate(t, side, y, dy)),
            move |t, y| axis.voltage_v(mode, drive, t, y),
            reach,
        )
    }

    /// `x_ref − p·angle` over the span \[m\], the angle being γ for the
    /// carriage or β for the motor; `command` holds x_ref and v_ref at both
    /// ends. The command must be smooth within the span.
    pub(crate) fn following_error<'s>(
        &'s self,
        motion: &'s Motion,
        command: &'s (MotionPoint, MotionPoint),
        of_motor: bool,
    ) -> Quantity<'s, impl Fn(f64, &Vector) -> f64> {
        let (p, reach) = (self.span.axis.pitch_m_per_rad(), &self.piece.reach);
        let angle = move |v: &Vector| if of_motor { v[BETA] } else { gamma(v) };
        self.quantity(
            move |side, _, y, dy, _| {
                let r = match side {
                    Side::After => &command.0,
                    Side::Before => &command.1,
                };
                (
                    r.displacement_m - p * angle(y),
                    r.velocity_mps - p * angle(dy),
                )
            },
            move |t, y| motion.at(t).displacement_m - p * angle(y),
            reach.displacement(motion) + p.abs() * reach.angle(of_motor),
        )
    }

    /// Distance of the carriage from `target_m` over the span \[m\].
    pub(crate) fn distance_to(&self, target_m: f64) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let p = self.span.axis.pitch_m_per_rad();
        self.quantity(
            move |_, _, y, dy, _| (target_m - p * gamma(y), -p * gamma(dy)),
            move |_, y| target_m - p * gamma(y),
            p.abs() * self.piece.reach.angle(false),
        )
    }

    /// Calls `look` with the parts of this span between the given instants.
    pub(crate) fn split_at(&self, breaks_s: &[f64], mut look: impl FnMut(&Stepped<'_>)) {
        let (start_s, end_s) = (self.span.start_s, self.span.end_s());
        let inside = |t: f64| t > start_s && t < end_s;
        if !breaks_s.iter().any(|&t| inside(t)) {
            look(self);
            return;
        }
        let mut from = 0.0;
        let ends = breaks_s.iter().filter(|&&t| inside(t));
        let thetas = ends.map(|t| (t - start_s) / self.span.length_s);
        for to in thetas.chain([1.0]) {
            if to > from {
                self.part(from, to, &mut look);
                from = to;
            }
        }
    }

    fn part(&self, from: f64, to: f64, look: &mut impl FnMut(&Stepped<'_>)) {
        let span = self.span;
        let start_s = span.start_s + from * span.length_s;
        let length_s = (to - from) * span.length_s;
        let (y0, y1) = (span.vector_at(from), span.vector_at(to));
        let rate = |t: f64, y: &Vector| span.axis.derivative(&span.modes.0, span.drive, t, y);
        let (f0, f1) = (rate(start_s, &y0), rate(start_s + length_s, &y1));
        let piece = SteppedPiece {
            dense: self.piece.dense.map(|(step, first, last)| {
                let theta = |share: f64| first + share * (last - first);
                (step, theta(from), theta(to))
            }),
            rates: (&f0, &f1),
            reach: self.piece.reach,
        };
        let part = Span {
            start_s,
            length_s,
            y: (&y0, &y1),
            interior: Interior::Stepped(&piece),
            ..*span
        };
        look(&Stepped {
            span: &part,
            piece: &piece,
        });
    }
}
