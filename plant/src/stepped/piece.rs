//! A piece of a Runge-Kutta solution: the quantities over it that guards and
//! figures look at, and how far these may be from the cubic through their ends.
//!
//! The quantities are sums of states, and so are their distances from the cubic
//! ([`Reach`], from [`super::dop853::Step::stray`]). They decide whether a step
//! need be looked into at all ([`Ends::hull`]); its values between the ends cost
//! more than those at the ends.

use super::dop853::{Step, Stray};
use crate::hybrid::guard::Guard;
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::joint::{ElasticJoint, JointMode};
use crate::model::motion::{Motion, MotionPoint};
use crate::model::pid::Side;
use crate::model::rates::Rates;
use crate::model::resistance::GuideMode;
use crate::model::state::{
    BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, CURRENT_INTEGRAL, EPSILON, EPSILON_DOT, Vector, gamma,
    gamma_dot,
};
use crate::numerics::GAUSS_4;
use crate::numerics::bernstein::{Ends, NODES, Polynomial};
use crate::observe::extremes::Extremes;
use crate::observe::{Interior, Span};

/// A step: its length, how far its states may be from the cubics through their
/// ends, and γ̇ as the one state that enters the equations squared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    length_s: f64,
    stray: Stray,
    /// Largest |γ̇|, and how much γ̇ moves \[rad/s\].
    speed: f64,
    excursion: f64,
}

impl Reach {
    /// From the states and their derivatives at both ends.
    ///
    /// The cubic `y0 + Δ·θ + (u·(1 − θ) − v·θ)·θ·(1 − θ)` with `u = h·f0 − Δ`
    /// and `v = h·f1 − Δ` moves by at most |Δ| + (|u| + |v|)/4.
    pub(crate) fn new(
        stray: Stray,
        length_s: f64,
        (y0, y1): (&Vector, &Vector),
        (f0, f1): (&Vector, &Vector),
    ) -> Self {
        let start = gamma_dot(y0);
        let chord = gamma_dot(y1) - start;
        let bend = (gamma_dot(f0) * length_s - chord).abs();
        let twist = (gamma_dot(f1) * length_s - chord).abs();
        let excursion = chord.abs() + 0.25 * (bend + twist) + stray.gamma_dot;
        Self {
            length_s,
            stray,
            speed: start.abs() + excursion,
            excursion,
        }
    }

    /// Of β for the motor, or of γ \[rad\].
    pub(crate) fn angle(&self, of_motor: bool) -> f64 {
        if of_motor {
            self.stray.states[BETA]
        } else {
            self.stray.gamma
        }
    }

    /// Of a command whose fourth derivative is at most this: the error of the
    /// cubic through two values and slopes is `|q⁗|·h⁴/384`.
    fn command(&self, fourth_derivative: f64) -> f64 {
        let square = self.length_s * self.length_s;
        fourth_derivative * square * square / 384.0
    }

    /// `k·ε + c·ε̇` of a flank \[N m\].
    fn flank_torque(&self, joint: &ElasticJoint) -> f64 {
        joint.stiffness_nm_per_rad * self.stray.states[EPSILON]
            + joint.damping_nms_per_rad * self.stray.states[EPSILON_DOT]
    }
}

impl Axis {
    /// Of the value of a guard.
    pub(crate) fn guard_reach(&self, guard: Guard, drive: &Drive<'_>, reach: &Reach) -> f64 {
        match guard {
            Guard::Meet(_) | Guard::Part(_) => reach.stray.states[EPSILON],
            Guard::Release(_) | Guard::Reload(_) => {
                self.joint.map_or(0.0, |joint| reach.flank_torque(&joint))
            }
            // The margin of this guard is rounding, and so is how far it strays.
            Guard::Stop(_) => reach.stray.gamma_dot,
            Guard::Break(_) => self.torque_reach(reach, true),
            Guard::Limit(_) | Guard::Unlimit(_) => Self::demand_reach(drive, reach),
            Guard::Saturate(_) | Guard::Desaturate(_) => self.loop_reach(drive, reach),
            Guard::Hold(_) | Guard::Return(_) => reach.stray.states[CURRENT],
            Guard::LetGo(_) => Self::demand_reach(drive, reach) + self.holding_reach(reach),
            Guard::Overrun(_) => self.holding_reach(reach),
        }
    }

    /// Of `ẍ = p·γ̈` \[m/s²\]. With `γ̇ = γ̇0 + w` the square γ̇² differs from the
    /// cubic through its ends by what 2·γ̇0·w does, and by w² and its own cubic:
    /// at most `max w² + w1² + 8/27·|w1·ẇ1·h|`, which 8 excursions² exceed.
    pub(crate) fn acceleration_reach(&self, mode: &Mode, reach: &Reach) -> f64 {
        if mode.guide == GuideMode::Stuck {
            return 0.0;
        }
        let loaded = !matches!(mode.joint, JointMode::Open | JointMode::Released(_));
        let [_, a1, a2] = self.resistance.polynomial(mode.guide);
        let speed = reach.stray.gamma_dot;
        let square = 2.0 * reach.speed * speed + 8.0 * reach.excursion * reach.excursion;
        let p = self.pitch_m_per_rad;
        let force = a1.abs() * speed + a2.abs() * square;
        p * (self.torque_reach(reach, loaded) + p * force) / self.moved_inertia()
    }

    /// Of what turns the screw, Ψ or `k_m·I/z` \[N m\].
    fn torque_reach(&self, reach: &Reach, loaded: bool) -> f64 {
        match self.joint {
            Some(joint) if loaded => reach.flank_torque(&joint),
            Some(_) => 0.0,
            None => (self.motor.torque_nm(reach.stray.states[CURRENT]) / self.gear_ratio).abs(),
        }
    }

    /// Of `R·I + k_m·β̇/z` \[V\].
    fn holding_reach(&self, reach: &Reach) -> f64 {
        let (states, motor) = (&reach.stray.states, &self.motor);
        let km = motor.torque_constant_nm_per_a / self.gear_ratio;
        motor.resistance_ohm * states[CURRENT] + km * states[BETA_DOT]
    }

    /// Of the voltage that a current loop asks for \[V\].
    fn loop_reach(&self, drive: &Drive<'_>, reach: &Reach) -> f64 {
        let (states, motor) = (&reach.stray.states, &self.motor);
        let (.., omega_radps) = self.stage.numbers();
        let error_a = Self::demand_reach(drive, reach) + states[CURRENT];
        let integral = motor.resistance_ohm * states[CURRENT_INTEGRAL];
        omega_radps * (motor.inductance_h * error_a + integral)
    }

    /// Of the voltage at the motor \[V\].
    fn voltage_reach(&self, mode: &Mode, drive: &Drive<'_>, reach: &Reach) -> f64 {
        match (self.stage, mode.stage) {
            (_, StageMode::Saturated(_) | StageMode::Overrun(_)) => 0.0,
            (Stage::IdealCurrent, _) | (_, StageMode::Holding(_)) => self.holding_reach(reach),
            (Stage::CurrentLoop { .. }, _) => self.loop_reach(drive, reach),
            _ if mode.amplifier != AmplifierMode::Linear => 0.0,
            _ => Self::demand_reach(drive, reach),
        }
    }

    /// Of the continuous law's demand, eq. 27-28.
    pub(crate) fn demand_reach(drive: &Drive<'_>, reach: &Reach) -> f64 {
        match drive {
            Drive::Held(_) => 0.0,
            Drive::Feedback(pid) => {
                let command = pid.motion().fourth_derivatives;
                pid.demand_reach(
                    reach.stray.states[BETA_INTEGRAL],
                    reach.stray.states[BETA],
                    reach.stray.states[BETA_DOT],
                    [
                        reach.command(command.displacement_integral_ms),
                        reach.command(command.displacement_m),
                        reach.command(command.velocity_mps),
                    ],
                )
            }
        }
    }
}

/// Knowledge of a Runge-Kutta solver about a span besides its ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SteppedPiece<'a> {
    /// The step with its dense output, and the θ on it of the span's ends.
    /// Solver `rk4` has none: its solution is the cubic through the ends.
    pub(crate) dense: Option<(&'a Step, f64, f64)>,
    /// dy/dt at both ends.
    pub(crate) rates: (&'a Vector, &'a Vector),
    pub(crate) reach: Reach,
}

impl Interior for SteppedPiece<'_> {
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector {
        match self.dense {
            Some((step, from, to)) => {
                let rates = Rates::new(span.axis, &span.modes.0, span.drive, step.start_s);
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

    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes) {
        let stepped = Stepped { span, piece: self };
        stepped
            .acceleration()
            .raise(&mut extremes.peak_abs_acceleration_mps2);
        stepped.current().raise(&mut extremes.peak_abs_current_a);
        stepped.voltage().raise(&mut extremes.peak_abs_voltage_v);
        stepped.power().raise(&mut extremes.peak_abs_power_w);
        let motion = &extremes.settings.motion;
        if motion.breaks_between(span.start_s, span.end_s()).is_empty() {
            follow(extremes, &stepped);
        } else {
            stepped.split_at_breaks(&motion.clone(), |part| follow(extremes, part));
        }
        settle(extremes, &stepped);
        let [armature_j, electrical_j] = stepped.electrical_energies();
        extremes.add([stepped.joint_loss_j(), armature_j, electrical_j]);
    }
}

/// A quantity over a span. Its values between the ends cost more than those at
/// the ends, and most looks can do without.
#[derive(Debug)]
struct Quantity<'a, V> {
    span: &'a Span<'a>,
    ends: Ends,
    /// Largest distance from the cubic through its ends.
    reach: f64,
    /// Of time and state within the span.
    value: V,
}

impl<V: Fn(f64, &Vector) -> f64> Quantity<'_, V> {
    /// The polynomial through the ends and the nodes between them.
    fn septic(&self) -> Polynomial<8> {
        let span = self.span;
        self.ends.septic(NODES.map(|theta| {
            let time_s = span.start_s + theta * span.length_s;
            (self.value)(time_s, &span.vector_at(theta))
        }))
    }

    /// How far it may be from its start.
    fn excursion(&self) -> f64 {
        let ends = &self.ends;
        let chord = ends.end - ends.start;
        let bends = (ends.start_slope - chord).abs() + (ends.end_slope - chord).abs();
        chord.abs() + 0.25 * bends + self.reach
    }

    /// Upper bound of |q| over the span, without looking into it.
    fn bound(&self) -> f64 {
        self.ends.bound(self.reach)
    }

    /// Raises `peak` to the supremum of |q| over the span.
    fn raise(&self, peak: &mut f64) {
        let bound = self.bound();
        if bound > *peak {
            *peak = peak.max(self.ends.start.abs()).max(self.ends.end.abs());
            // Where the quantity grows throughout, the end is the largest.
            if bound > *peak {
                *peak = self.septic().peak_above(*peak);
            }
        }
    }
}

/// A span of a Runge-Kutta solver with its piece.
#[derive(Debug, Clone, Copy)]
struct Stepped<'a> {
    span: &'a Span<'a>,
    piece: &'a SteppedPiece<'a>,
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
    fn acceleration(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let (axis, mode) = (self.span.axis, &self.span.modes.0);
        let p = axis.pitch_m_per_rad;
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
    fn current(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        self.quantity(
            |_, _, y, dy, _| (y[CURRENT], dy[CURRENT]),
            |_, y| y[CURRENT],
            self.piece.reach.stray.states[CURRENT],
        )
    }

    /// Motor voltage over the span \[V\].
    fn voltage(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let (axis, drive, mode) = (self.span.axis, self.span.drive, &self.span.modes.0);
        let rate = |now: (f64, Side), y: &Vector, dy: &Vector, mode: &Mode| {
            let rates = [dy[BETA], dy[BETA_DOT]];
            let command_rate = axis.command_rate(mode, drive, now, y[BETA], rates);
            axis.stage_voltage_rate(mode.stage, command_rate, dy)
        };
        self.quantity(
            |side, t, y, dy, mode| {
                let voltage_v = axis.voltage_v(mode, drive, t, y);
                (voltage_v, rate((t, side), y, dy, mode))
            },
            move |t, y| axis.voltage_v(mode, drive, t, y),
            axis.voltage_reach(mode, drive, &self.piece.reach),
        )
    }

    /// Electrical power over the span \[W\]. With `V = V0 + v` and `I = I0 + i` it strays from
    /// the cubic through its ends as V0·i and I0·v do, and by v·i and the cubic of that: less
    /// than 8 products of their excursions (see [`Axis::acceleration_reach`]).
    fn power(&self) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let (v, i) = (self.voltage(), self.current());
        let reach = v.ends.start.abs() * i.reach
            + i.ends.start.abs() * v.reach
            + 8.0 * v.excursion() * i.excursion();
        let slope = |v: [f64; 2], i: [f64; 2]| v[1] * i[0] + v[0] * i[1];
        Quantity {
            span: self.span,
            ends: Ends {
                start: v.ends.start * i.ends.start,
                start_slope: slope(
                    [v.ends.start, v.ends.start_slope],
                    [i.ends.start, i.ends.start_slope],
                ),
                end: v.ends.end * i.ends.end,
                end_slope: slope(
                    [v.ends.end, v.ends.end_slope],
                    [i.ends.end, i.ends.end_slope],
                ),
            },
            reach,
            value: move |t: f64, y: &Vector| (v.value)(t, y) * (i.value)(t, y),
        }
    }

    /// `x_ref − p·angle` over the span \[m\], the angle being γ for the
    /// carriage or β for the motor; `command` holds x_ref and v_ref at both
    /// ends. The command must be smooth within the span.
    fn following_error<'s>(
        &'s self,
        motion: &'s Motion,
        command: &'s (MotionPoint, MotionPoint),
        of_motor: bool,
    ) -> Quantity<'s, impl Fn(f64, &Vector) -> f64> {
        let (p, reach) = (self.span.axis.pitch_m_per_rad, &self.piece.reach);
        let start_rad = if of_motor {
            0.0
        } else {
            self.span.axis.start_rad
        };
        let angle = move |v: &Vector| if of_motor { v[BETA] } else { gamma(v) };
        self.quantity(
            move |side, _, y, dy, _| {
                let r = match side {
                    Side::After => &command.0,
                    Side::Before => &command.1,
                };
                (
                    r.displacement_m - p * (angle(y) + start_rad),
                    r.velocity_mps - p * angle(dy),
                )
            },
            move |t, y| motion.at(t).displacement_m - p * (angle(y) + start_rad),
            reach.command(motion.fourth_derivatives.displacement_m)
                + p.abs() * reach.angle(of_motor),
        )
    }

    /// Distance of the carriage from `target_m` over the span \[m\].
    fn distance_to(&self, target_m: f64) -> Quantity<'_, impl Fn(f64, &Vector) -> f64> {
        let axis = self.span.axis;
        let p = axis.pitch_m_per_rad;
        self.quantity(
            move |_, _, y, dy, _| (target_m - p * axis.screw_angle_rad(y), -p * gamma(dy)),
            move |_, y| target_m - p * axis.screw_angle_rad(y),
            p.abs() * self.piece.reach.angle(false),
        )
    }

    /// Energy that the joint's damper takes over the span \[J\]: by the method's own sum
    /// where there is one, so to the order of the solution; by Gauss's rule on
    /// the cubic of solver `rk4`, whose step may be in contact in a part only.
    fn joint_loss_j(&self) -> f64 {
        let Some(joint) = self.span.axis.joint else {
            return 0.0;
        };
        let (start, end) = (self.span.modes.0.joint, self.span.modes.1.joint);
        let c = joint.damping_nms_per_rad;
        match self.piece.dense {
            _ if c == 0.0 || !(start.carries() || end.carries()) => 0.0,
            // The rate of ε is ε̇.
            Some((step, 0.0, 1.0)) => c * step.squared_rate(EPSILON),
            _ => {
                let mut sum = 0.0;
                for (theta, weight) in GAUSS_4 {
                    let y = self.span.vector_at(theta);
                    let (epsilon, epsilon_dot) = (y[EPSILON], y[EPSILON_DOT]);
                    let closed =
                        start == end || joint.mode_of_state(epsilon, epsilon_dot).carries();
                    if closed {
                        sum += weight * (epsilon_dot * epsilon_dot);
                    }
                }
                c * sum * self.span.length_s
            }
        }
    }

    /// `∫ R·I² dt` and `∫ V·I dt` over the span \[J\], by the same sums.
    fn electrical_energies(&self) -> [f64; 2] {
        let span = self.span;
        let (axis, drive) = (span.axis, span.drive);
        let powers = |theta: f64, y: &Vector| {
            let time_s = span.start_s + theta * span.length_s;
            let voltage_v = axis.voltage_v(span.mode_at(theta), drive, time_s, y);
            let current_a = y[CURRENT];
            [
                axis.motor.resistance_ohm * (current_a * current_a),
                voltage_v * current_a,
            ]
        };
        let mut sums = [0.0; 2];
        let mut add = |weight: f64, powers: [f64; 2]| {
            for (sum, power) in sums.iter_mut().zip(powers) {
                *sum += weight * power;
            }
        };
        match self.piece.dense {
            Some((step, 0.0, 1.0)) => {
                for (theta, weight, y) in step.stages() {
                    add(weight, powers(theta, &y));
                }
            }
            _ => {
                for (theta, weight) in GAUSS_4 {
                    add(weight, powers(theta, &span.vector_at(theta)));
                }
            }
        }
        sums.map(|sum| sum * span.length_s)
    }

    /// Calls `look` with the parts of this span between the breaks of the command.
    fn split_at_breaks(&self, motion: &Motion, mut look: impl FnMut(&Stepped<'_>)) {
        let start_s = self.span.start_s;
        let mut from = 0.0;
        let ends = motion.breaks_between(start_s, self.span.end_s()).iter();
        let thetas = ends.map(|t| (t - start_s) / self.span.length_s);
        for to in thetas.chain([1.0]) {
            if to > from {
                self.part(from, to, &mut look);
                from = to;
            }
        }
    }

    /// Calls `look` with the part between two θ.
    fn part(&self, from: f64, to: f64, look: &mut impl FnMut(&Stepped<'_>)) {
        let span = self.span;
        let start_s = span.start_s + from * span.length_s;
        let length_s = (to - from) * span.length_s;
        let (y0, y1) = (span.vector_at(from), span.vector_at(to));
        let rate =
            |now: (f64, Side), y: &Vector| span.axis.derivative(&span.modes.0, span.drive, now, y);
        let f0 = rate((start_s, Side::After), &y0);
        let f1 = rate((start_s + length_s, Side::Before), &y1);
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
            interior: &piece,
            ..*span
        };
        look(&Stepped {
            span: &part,
            piece: &piece,
        });
    }
}

/// Notes when the carriage was last outside the settling band.
fn settle(extremes: &mut Extremes, stepped: &Stepped<'_>) {
    let band_m = extremes.settings.settling_band_m;
    let span = stepped.span;
    let distance = stepped.distance_to(extremes.settings.motion.travel_m());
    if distance.ends.end.abs() > band_m {
        extremes.last_outside_band_s = Some(span.end_s());
    } else if distance.bound() > band_m
        && let Some(theta) = last_outside(distance.septic(), band_m)
    {
        extremes.last_outside_band_s = Some(span.start_s() + theta * span.length_s());
    }
}

/// Raises the following errors, where the command is smooth.
fn follow(extremes: &mut Extremes, stepped: &Stepped<'_>) {
    let span = stepped.span;
    let motion = &extremes.settings.motion;
    let start = extremes.command_at(span.start_s());
    let end = motion.at(span.end_s());
    let command = (start, end);
    let of_carriage = stepped.following_error(motion, &command, false);
    of_carriage.raise(&mut extremes.peak_following_error_m);
    let of_motor = stepped.following_error(motion, &command, true);
    of_motor.raise(&mut extremes.peak_motor_following_error_m);
    extremes.command_at_end = Some((span.end_s(), end));
}

/// The last θ in \[0, 1\] at which |distance| exceeds the band.
fn last_outside(distance: Polynomial<8>, band_m: f64) -> Option<f64> {
    let backwards = distance.reversed();
    let above = backwards.affine(band_m, -1.0).first_negative();
    let below = backwards.affine(band_m, 1.0).first_negative();
    match (above, below) {
        (Some(a), Some(b)) => Some(1.0 - a.min(b)),
        (one, other) => one.or(other).map(|theta| 1.0 - theta),
    }
}
