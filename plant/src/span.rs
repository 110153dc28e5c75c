//! What an observer of the plant sees: one smooth piece of the solution at a
//! time, and the contact changes between them.

use crate::axis::{Axis, Drive};
use crate::exact::{FeedbackPiece, HeldPiece, to_plant_vector};
use crate::joint::Contact;
use crate::mode::Mode;
use crate::motion::{Motion, MotionPoint};
use crate::pid::Side;
use crate::quartic::{Ends, Polynomial};
use crate::state::{BETA, BETA_DOT, CURRENT, EPSILON, State, Vector, gamma};

/// Follows the plant as it is advanced.
pub trait Watch {
    /// A smooth piece of the solution, in order and without holes.
    fn span(&mut self, span: &Span<'_>);
    /// The joint took load or let go, between two spans.
    fn contact_change(&mut self, change: &ContactChange);
}

/// Watches nothing.
impl Watch for () {
    fn span(&mut self, _: &Span<'_>) {}
    fn contact_change(&mut self, _: &ContactChange) {}
}

/// One change of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactChange {
    /// When \[s\].
    pub time_s: f64,
    /// Contact before.
    pub from: Contact,
    /// Contact after.
    pub to: Contact,
    /// Whether the gap closed: taking load again after `no_pull` let go is a
    /// change, but no impact.
    pub impact: bool,
    /// Carriage acceleration just before \[m/s²\].
    pub acceleration_before_mps2: f64,
    /// Carriage acceleration just after \[m/s²\].
    pub acceleration_after_mps2: f64,
}

/// How the solution runs between the ends of a span.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Interior<'a> {
    /// A dense output of the solver.
    Dense(&'a crate::dopri5::Step),
    /// Nothing but the ends with their rates (solver `rk4`).
    Unknown(&'a Vector, &'a Vector),
    /// The solution itself, under a held voltage.
    Held(&'a HeldPiece<'a>),
    /// The solution itself, under the continuous law.
    Feedback(&'a FeedbackPiece<'a>),
}

/// A smooth piece of the solution.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    pub(crate) axis: &'a Axis,
    pub(crate) drive: &'a Drive<'a>,
    /// Mode at the start and, where it differs (solver `rk4`), at the end.
    pub(crate) modes: (Mode, Mode),
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    pub(crate) y: (&'a Vector, &'a Vector),
    pub(crate) interior: Interior<'a>,
}

/// A quantity with its rate at one end of a span.
type Probe = (f64, f64);

/// A quantity over a span. Its value in the middle costs more than the ends,
/// which most questions can do without.
#[derive(Debug)]
pub(crate) struct Quantity<'a, V> {
    span: &'a Span<'a>,
    pub(crate) ends: Ends,
    value: V,
}

impl<V: Fn(f64, &Vector) -> f64> Quantity<'_, V> {
    /// The quartic through the ends and the middle.
    pub(crate) fn quartic(&self) -> Polynomial<5> {
        let middle_s = self.span.start_s + 0.5 * self.span.length_s;
        self.ends
            .quartic((self.value)(middle_s, &self.span.vector_at(0.5)))
    }

    /// Raises `peak` to the supremum of |q| over the span.
    pub(crate) fn raise(&self, peak: &mut f64) {
        // Cubic and quartic differ far less than this margin.
        if self.ends.bound() > *peak * (1.0 - 1e-6) {
            *peak = self.quartic().peak_above(*peak);
        }
    }
}

impl Span<'_> {
    /// Start of the span \[s\].
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// End of the span \[s\].
    pub fn end_s(&self) -> f64 {
        self.start_s + self.length_s
    }

    /// Length of the span \[s\].
    pub fn length_s(&self) -> f64 {
        self.length_s
    }

    /// State at `start + θ·length`, 0 ≤ θ ≤ 1. Solver `rk4` has only the ends
    /// and a cubic between them.
    pub fn state_at(&self, theta: f64) -> State {
        State::from_vector(&self.vector_at(theta))
    }

    /// Carriage acceleration at `start + θ·length` \[m/s²\].
    pub fn acceleration_at_mps2(&self, theta: f64) -> f64 {
        let mode = if theta < 1.0 {
            &self.modes.0
        } else {
            &self.modes.1
        };
        self.axis
            .carriage_acceleration_mps2(mode, &self.vector_at(theta))
    }

    /// Contact within the span.
    pub fn contact(&self) -> Contact {
        self.modes.0.joint.contact()
    }

    /// Motor voltage at `start + θ·length` \[V\].
    pub fn voltage_at_v(&self, theta: f64) -> f64 {
        let mode = if theta < 1.0 {
            &self.modes.0
        } else {
            &self.modes.1
        };
        let time_s = self.start_s + theta * self.length_s;
        self.axis
            .voltage_v(mode, self.drive, time_s, &self.vector_at(theta))
    }

    /// Whether the amplifier stands at its limit under the continuous law.
    pub fn is_voltage_limited(&self) -> bool {
        self.modes.0.amplifier != crate::mode::AmplifierMode::Linear
    }

    fn vector_at(&self, theta: f64) -> Vector {
        let (y0, y1) = self.y;
        match self.interior {
            _ if theta <= 0.0 => *y0,
            _ if theta >= 1.0 => *y1,
            Interior::Dense(step) if theta == 0.5 => step.middle,
            Interior::Dense(step) => step.at(theta),
            Interior::Held(piece) => {
                let x = piece.flow().at(theta * self.length_s);
                to_plant_vector(&x, piece.offset_rad, piece.beta_integral_rads)
            }
            Interior::Feedback(piece) => {
                let x = piece.flow().at(theta * self.length_s);
                let mut y = x.fixed_rows::<6>(0).into_owned();
                y[EPSILON] += piece.offset_rad;
                y
            }
            Interior::Unknown(f0, f1) => {
                // Cubic Hermite through both ends.
                let (h, rest) = (self.length_s, 1.0 - theta);
                let chord = y1 - y0;
                let (u, v) = (f0 * h - chord, f1 * h - chord);
                y0 + chord * theta + (u * rest - v * theta) * (theta * rest)
            }
        }
    }

    /// A quantity over the span, from its value and rate at both ends (given
    /// side, time, state, derivative, mode) and its value in the middle.
    fn quantity<V: Fn(f64, &Vector) -> f64>(
        &self,
        probe: impl Fn(Side, f64, &Vector, &Vector, &Mode) -> Probe,
        value: V,
    ) -> Quantity<'_, V> {
        let (start_s, h) = (self.start_s, self.length_s);
        let ((m0, m1), (y0, y1)) = (&self.modes, self.y);
        let (f0, f1) = &match self.interior {
            Interior::Dense(step) => (step.f0, step.f1),
            Interior::Unknown(f0, f1) => (*f0, *f1),
            // Not needed: figures look at the solution itself.
            Interior::Held(_) | Interior::Feedback(_) => {
                let rate = |t: f64, y: &Vector| self.axis.derivative(m0, self.drive, t, y);
                (rate(start_s, y0), rate(start_s + h, y1))
            }
        };
        let (start, start_rate) = probe(Side::After, start_s, y0, f0, m0);
        let (end, end_rate) = probe(Side::Before, start_s + h, y1, f1, m1);
        Quantity {
            span: self,
            ends: Ends {
                start,
                start_slope: start_rate * h,
                end,
                end_slope: end_rate * h,
            },
            value,
        }
    }

    /// Carriage acceleration `p·γ̈` over the span \[m/s²\].
    pub(crate) fn acceleration(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let (axis, p) = (self.axis, self.axis.pitch_m_per_rad());
        self.quantity(
            move |_, _, y, dy, mode| {
                (
                    axis.carriage_acceleration_mps2(mode, y),
                    p * axis.screw_jerk(mode, y, dy),
                )
            },
            move |_, y| axis.carriage_acceleration_mps2(&self.modes.0, y),
        )
    }

    /// Armature current over the span \[A\].
    pub(crate) fn current(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        self.quantity(
            |_, _, y, dy, _| (y[CURRENT], dy[CURRENT]),
            |_, y| y[CURRENT],
        )
    }

    /// Motor voltage over the span \[V\].
    pub(crate) fn voltage(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let axis = self.axis;
        let rate = |time_s: f64, side: Side, y: &Vector, dy: &Vector| match self.drive {
            Drive::Feedback(pid) if !self.is_voltage_limited() => {
                pid.demand_rate(time_s, side, y[BETA], dy[BETA], dy[BETA_DOT])
            }
            _ => 0.0,
        };
        self.quantity(
            |side, t, y, dy, mode| (axis.voltage_v(mode, self.drive, t, y), rate(t, side, y, dy)),
            move |t, y| axis.voltage_v(&self.modes.0, self.drive, t, y),
        )
    }

    /// `x_ref − p·angle` over the span \[m\], the angle being γ for the
    /// carriage or β = γ + ε for the motor; `command` holds x_ref and v_ref at
    /// both ends. The command must be smooth within the span.
    pub(crate) fn following_error<'s>(
        &'s self,
        motion: &'s Motion,
        command: &'s (MotionPoint, MotionPoint),
        of_motor: bool,
    ) -> Quantity<'s, impl Fn(f64, &Vector) -> f64> {
        let p = self.axis.pitch_m_per_rad();
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
        )
    }

    /// Distance of the carriage from `target_m` over the span \[m\].
    pub(crate) fn distance_to(&self, target_m: f64) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let p = self.axis.pitch_m_per_rad();
        self.quantity(
            move |_, _, y, dy, _| (target_m - p * gamma(y), -p * gamma(dy)),
            move |_, y| target_m - p * gamma(y),
        )
    }

    /// Calls `piece` with the parts of this span between the given instants.
    pub(crate) fn split_at(&self, breaks_s: &[f64], mut piece: impl FnMut(&Span<'_>)) {
        let inside = |t: f64| t > self.start_s && t < self.end_s();
        if !breaks_s.iter().any(|&t| inside(t)) {
            piece(self);
            return;
        }
        let mut from = 0.0;
        let ends = breaks_s.iter().filter(|&&t| inside(t));
        let thetas = ends.map(|t| (t - self.start_s) / self.length_s);
        for to in thetas.chain([1.0]) {
            if to > from {
                self.part(from, to, &mut piece);
                from = to;
            }
        }
    }

    fn part(&self, from: f64, to: f64, piece: &mut impl FnMut(&Span<'_>)) {
        let start_s = self.start_s + from * self.length_s;
        let length_s = (to - from) * self.length_s;
        let (y0, y1) = (self.vector_at(from), self.vector_at(to));
        let rate = |t: f64, y: &Vector| self.axis.derivative(&self.modes.0, self.drive, t, y);
        let (f0, f1) = (rate(start_s, &y0), rate(start_s + length_s, &y1));
        piece(&Span {
            start_s,
            length_s,
            y: (&y0, &y1),
            interior: Interior::Unknown(&f0, &f1),
            ..*self
        });
    }
}
