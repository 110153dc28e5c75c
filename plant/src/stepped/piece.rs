//! A piece of a Runge-Kutta solution: the quantities over it that guards and
//! figures look at, and how far these may be from the cubic through their ends.
//!
//! The quantities are sums of states, and so are their distances from the cubic, their
//! reach, from those of the states ([`Stray`]). They decide whether a step
//! need be looked into at all ([`Ends::hull`]), which costs more than its ends.

use super::dop853::{Step, Stray};
use crate::hybrid::guard::Guard;
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::joint::{ElasticJoint, JointMode};
use crate::model::motion::MotionPoint;
use crate::model::pid::{PidGains, Side};
use crate::model::rates::Rates;
use crate::model::resistance::GuideMode;
use crate::model::state::{
    BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, CURRENT_INTEGRAL, EPSILON, EPSILON_DOT, Vector, gamma,
    gamma_dot,
};
use crate::numerics::GAUSS_4;
use crate::numerics::bernstein::{Ends, NODES, Polynomial};
use crate::observe::extremes::{Energies, Extremes};
use crate::observe::{Interior, Span};

impl Stray {
    /// Of a command whose fourth derivative is at most this: the error of the
    /// cubic through two values and slopes is `|q⁗|·h⁴/384`.
    fn command(&self, fourth_derivative: f64) -> f64 {
        let square = self.length_s * self.length_s;
        fourth_derivative * square * square / 384.0
    }

    /// Of the continuous law's demand, eq. 27-28.
    fn demand(&self, drive: &Drive<'_>) -> f64 {
        let Drive::Feedback(pid) = drive else {
            return 0.0;
        };
        let (s, z) = (pid.radians_per_m.abs(), pid.gear_ratio.abs());
        let error = |fourth_derivative: f64, state: usize| {
            self.command(fourth_derivative) * s + self.states[state] / z
        };
        let command = pid.motion().fourth_derivatives;
        let PidGains { kp, ki_per_s, kd_s } = pid.gains;
        let sum = kp * error(command.displacement_m, BETA)
            + ki_per_s * error(command.displacement_integral_ms, BETA_INTEGRAL)
            + kd_s * error(command.velocity_mps, BETA_DOT);
        pid.loop_gain.abs() * sum
    }

    /// `k·ε + c·ε̇` of a flank \[N m\].
    fn flank_torque(&self, joint: &ElasticJoint) -> f64 {
        joint.stiffness_nm_per_rad * self.states[EPSILON]
            + joint.damping_nms_per_rad * self.states[EPSILON_DOT]
    }
}

impl Axis {
    /// Of the value of a guard.
    pub(crate) fn guard_reach(&self, guard: Guard, drive: &Drive<'_>, stray: &Stray) -> f64 {
        match guard {
            Guard::Meet(_) | Guard::Part(_) => stray.states[EPSILON],
            Guard::Release(_) | Guard::Reload(_) => {
                self.joint.map_or(0.0, |joint| stray.flank_torque(&joint))
            }
            // The margin of this guard is rounding, and so is how far it strays.
            Guard::Stop(_) => stray.gamma_dot,
            Guard::Break(_) => self.torque_reach(stray, true),
            Guard::Limit(_) | Guard::Unlimit(_) => stray.demand(drive),
            Guard::Saturate(_) | Guard::Desaturate(_) => self.loop_reach(drive, stray),
            Guard::Hold(_) | Guard::Return(_) => stray.states[CURRENT],
            Guard::LetGo(_) => stray.demand(drive) + self.holding_reach(stray),
            Guard::Overrun(_) => self.holding_reach(stray),
        }
    }

    /// Of `ẍ = p·γ̈` \[m/s²\]. With `γ̇ = γ̇0 + w` the square γ̇² differs from the
    /// cubic through its ends by what 2·γ̇0·w does, and by w² and its own cubic:
    /// at most `max w² + w1² + 8/27·|w1·ẇ1·h|`, which 8 excursions² of γ̇ exceed; `speed` is
    /// the largest |γ̇|.
    fn acceleration_reach(&self, mode: &Mode, stray: &Stray, speed: f64, excursion: f64) -> f64 {
        if mode.guide == GuideMode::Stuck {
            return 0.0;
        }
        let loaded = !matches!(mode.joint, JointMode::Open | JointMode::Released(_));
        let [_, a1, a2] = self.resistance.polynomial(mode.guide);
        let square = 2.0 * speed * stray.gamma_dot + 8.0 * excursion * excursion;
        let p = self.pitch_m_per_rad;
        let force = a1.abs() * stray.gamma_dot + a2.abs() * square;
        p * (self.torque_reach(stray, loaded) + p * force) / self.moved_inertia()
    }

    /// Of what turns the screw, Ψ or `k_m·I/z` \[N m\].
    fn torque_reach(&self, stray: &Stray, loaded: bool) -> f64 {
        match self.joint {
            Some(joint) if loaded => stray.flank_torque(&joint),
            Some(_) => 0.0,
            None => (self.motor.torque_nm(stray.states[CURRENT]) / self.gear_ratio).abs(),
        }
    }

    /// Of `R·I + k_m·β̇/z` \[V\].
    fn holding_reach(&self, stray: &Stray) -> f64 {
        let (states, motor) = (&stray.states, &self.motor);
        let km = motor.torque_constant_nm_per_a / self.gear_ratio;
        motor.resistance_ohm * states[CURRENT] + km * states[BETA_DOT]
    }

    /// Of the voltage that a current loop asks for \[V\].
    fn loop_reach(&self, drive: &Drive<'_>, stray: &Stray) -> f64 {
        let (states, motor) = (&stray.states, &self.motor);
        let (.., omega_radps) = self.stage.numbers();
        let error_a = stray.demand(drive) + states[CURRENT];
        let integral = motor.resistance_ohm * states[CURRENT_INTEGRAL];
        omega_radps * (motor.inductance_h * error_a + integral)
    }

    /// Of the voltage at the motor \[V\].
    fn voltage_reach(&self, mode: &Mode, drive: &Drive<'_>, stray: &Stray) -> f64 {
        match (self.stage, mode.stage) {
            (_, StageMode::Saturated(_) | StageMode::Overrun(_)) => 0.0,
            (Stage::IdealCurrent, _) | (_, StageMode::Holding(_)) => self.holding_reach(stray),
            (Stage::CurrentLoop { .. }, _) => self.loop_reach(drive, stray),
            _ if mode.amplifier != AmplifierMode::Linear => 0.0,
            _ => stray.demand(drive),
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
    pub(crate) stray: Stray,
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
        let (current, voltage) = (stepped.current(), stepped.voltage());
        let peak_mps2 = &mut extremes.peak_abs_acceleration_mps2;
        stepped.acceleration().raise(peak_mps2);
        current.raise(&mut extremes.peak_abs_current_a);
        voltage.raise(&mut extremes.peak_abs_voltage_v);
        voltage
            .times(&current)
            .raise(&mut extremes.peak_abs_power_w);
        let motion = &extremes.settings.motion;
        if motion.breaks_between(span.start_s, span.end_s()).is_empty() {
            stepped.follow(extremes);
        } else {
            stepped.follow_in_parts(extremes);
        }
        stepped.settle(extremes);
        extremes.add(stepped.energies());
    }
}

/// A quantity over a span.
#[derive(Debug)]
struct Quantity<'a, V> {
    span: &'a Span<'a>,
    ends: Ends,
    /// Largest distance from the cubic through its ends.
    reach: f64,
    /// Of time, state and mode within the span.
    value: V,
}

impl<'a, V: Fn(f64, &Vector, &Mode) -> f64> Quantity<'a, V> {
    /// The polynomial through the ends and the nodes between them.
    fn septic(&self) -> Polynomial<8> {
        let span = self.span;
        self.ends.septic(NODES.map(|theta| {
            let time_s = span.start_s + theta * span.length_s;
            (self.value)(time_s, &span.vector_at(theta), &span.modes.0)
        }))
    }

    /// How far it may be from its start.
    fn excursion(&self) -> f64 {
        let ([start, end], slopes) = (self.ends.values, self.ends.slopes);
        let chord = end - start;
        let [start_bend, end_bend] = slopes.map(|slope| (slope - chord).abs());
        chord.abs() + 0.25 * (start_bend + end_bend) + self.reach
    }

    /// Raises `peak` to the supremum of |q| over the span.
    fn raise(&self, peak: &mut f64) {
        let bound = self.ends.bound(self.reach);
        if bound > *peak {
            let [start, end] = self.ends.values;
            *peak = peak.max(start.abs()).max(end.abs());
            // Where the quantity grows throughout, the end is the largest.
            if bound > *peak {
                *peak = self.septic().peak_above(*peak);
            }
        }
    }

    /// The product with another quantity. With `V = V0 + v` and `I = I0 + i` it strays from
    /// the cubic through its ends as V0·i and I0·v do, and by v·i and the cubic of that: less
    /// than 8 products of their excursions (see [`Axis::acceleration_reach`]).
    fn times<'b, W: Fn(f64, &Vector, &Mode) -> f64>(
        &'b self,
        other: &'b Quantity<'a, W>,
    ) -> Quantity<'b, impl Fn(f64, &Vector, &Mode) -> f64> {
        let (v, i) = (&self.ends, &other.ends);
        Quantity {
            span: self.span,
            ends: Ends {
                values: [0, 1].map(|end| v.values[end] * i.values[end]),
                slopes: [0, 1]
                    .map(|end| v.slopes[end] * i.values[end] + v.values[end] * i.slopes[end]),
            },
            reach: v.values[0].abs() * other.reach
                + i.values[0].abs() * self.reach
                + 8.0 * self.excursion() * other.excursion(),
            value: |t: f64, y: &Vector, mode: &Mode| {
                (self.value)(t, y, mode) * (other.value)(t, y, mode)
            },
        }
    }
}

/// A span of a Runge-Kutta solver with its piece.
#[derive(Debug, Clone, Copy)]
struct Stepped<'a> {
    span: &'a Span<'a>,
    piece: &'a SteppedPiece<'a>,
}

impl<'a> Stepped<'a> {
    /// A quantity over the span, from its value, its rate at the ends and how far it may be
    /// from the cubic through these.
    fn quantity<V: Fn(f64, &Vector, &Mode) -> f64>(
        &self,
        value: V,
        rate: impl Fn((f64, Side), &Vector, &Vector, &Mode) -> f64,
        reach: f64,
    ) -> Quantity<'a, V> {
        let (span, (f0, f1)) = (self.span, self.piece.rates);
        let end = |now: (f64, Side), y: &Vector, dy: &Vector, mode: &Mode| {
            (value(now.0, y, mode), rate(now, y, dy, mode))
        };
        let start = end((span.start_s, Side::After), span.y.0, f0, &span.modes.0);
        let end = end((span.end_s(), Side::Before), span.y.1, f1, &span.modes.1);
        Quantity {
            span,
            ends: Ends::new(start, end, span.length_s),
            reach,
            value,
        }
    }

    /// Carriage acceleration `p·γ̈` over the span \[m/s²\].
    fn acceleration(&self) -> Quantity<'a, impl Fn(f64, &Vector, &Mode) -> f64> {
        let (axis, mode, stray) = (self.span.axis, &self.span.modes.0, &self.piece.stray);
        let speed = self.quantity(
            |_, y, _| gamma_dot(y),
            |_, _, dy, _| gamma_dot(dy),
            stray.gamma_dot,
        );
        let excursion = speed.excursion();
        let largest = speed.ends.values[0].abs() + excursion;
        self.quantity(
            |_, y, mode| axis.carriage_acceleration_mps2(mode, y),
            |_, y, dy, mode| axis.pitch_m_per_rad * axis.screw_jerk(mode, y, dy),
            axis.acceleration_reach(mode, stray, largest, excursion),
        )
    }

    /// Armature current over the span \[A\].
    fn current(&self) -> Quantity<'a, impl Fn(f64, &Vector, &Mode) -> f64> {
        self.quantity(
            |_, y, _| y[CURRENT],
            |_, _, dy, _| dy[CURRENT],
            self.piece.stray.states[CURRENT],
        )
    }

    /// Motor voltage over the span \[V\].
    fn voltage(&self) -> Quantity<'a, impl Fn(f64, &Vector, &Mode) -> f64> {
        let (axis, drive) = (self.span.axis, self.span.drive);
        self.quantity(
            |t, y, mode| axis.voltage_v(mode, drive, t, y),
            |now, y, dy, mode| {
                let rates = [dy[BETA], dy[BETA_DOT]];
                let command_rate = axis.command_rate(mode, drive, now, y[BETA], rates);
                match mode.stage {
                    StageMode::Saturated(_) | StageMode::Overrun(_) => 0.0,
                    stage => axis.stage_voltage_v(stage, command_rate, dy),
                }
            },
            axis.voltage_reach(&self.span.modes.0, drive, &self.piece.stray),
        )
    }

    /// Notes when the carriage was last outside the settling band.
    fn settle(&self, extremes: &mut Extremes) {
        let (span, axis) = (self.span, self.span.axis);
        let (band_m, p) = (extremes.settings.settling_band_m, axis.pitch_m_per_rad);
        let target_m = extremes.settings.motion.travel_m();
        let distance = self.quantity(
            |_, y, _| target_m - p * axis.screw_angle_rad(y),
            |_, _, dy, _| -p * gamma(dy),
            p.abs() * self.piece.stray.gamma,
        );
        if distance.ends.values[1].abs() > band_m {
            extremes.last_outside_band_s = Some(span.end_s());
        } else if distance.ends.bound(distance.reach) > band_m
            && let Some(theta) = distance.septic().last_outside(band_m)
        {
            extremes.last_outside_band_s = Some(span.start_s + theta * span.length_s);
        }
    }

    /// Raises the following errors, where the command is smooth.
    fn follow(&self, extremes: &mut Extremes) {
        let (span, stray) = (self.span, &self.piece.stray);
        let ((y0, y1), (f0, f1)) = (span.y, self.piece.rates);
        let start = extremes.command_at(span.start_s);
        let motion = &extremes.settings.motion;
        let end = motion.at(span.end_s());
        let p = span.axis.pitch_m_per_rad;
        let command_reach = stray.command(motion.fourth_derivatives.displacement_m);
        // `x_ref − p·angle` with the angle of the carriage, γ, or of the motor, β.
        let error = |angle: fn(&Vector) -> f64, start_rad: f64, stray_rad: f64| {
            let value = move |x_m: f64, y: &Vector| x_m - p * (angle(y) + start_rad);
            let at = |command: MotionPoint, y: &Vector, dy: &Vector| {
                let rate = command.velocity_mps - p * angle(dy);
                (value(command.displacement_m, y), rate)
            };
            Quantity {
                span,
                ends: Ends::new(at(start, y0, f0), at(end, y1, f1), span.length_s),
                reach: command_reach + p.abs() * stray_rad,
                value: move |t: f64, y: &Vector, _: &Mode| value(motion.at(t).displacement_m, y),
            }
        };
        let of_carriage = error(gamma, span.axis.start_rad, stray.gamma);
        of_carriage.raise(&mut extremes.peak_following_error_m);
        let of_motor = error(|y| y[BETA], 0.0, stray.states[BETA]);
        of_motor.raise(&mut extremes.peak_motor_following_error_m);
        extremes.command_at_end = Some((span.end_s(), end));
    }

    /// The same where it has breaks: between each two of them.
    fn follow_in_parts(&self, extremes: &mut Extremes) {
        let (span, start_s, length_s) = (self.span, self.span.start_s, self.span.length_s);
        let motion = extremes.settings.motion.clone();
        let breaks_s = motion.breaks_between(start_s, span.end_s()).iter();
        let thetas = breaks_s.map(|t| (t - start_s) / length_s).chain([1.0]);
        let mut from = 0.0;
        for to in thetas {
            if to <= from {
                continue;
            }
            let (start_s, length_s) = (start_s + from * length_s, (to - from) * length_s);
            let (y0, y1) = (span.vector_at(from), span.vector_at(to));
            let rate = |now, y: &Vector| span.axis.derivative(&span.modes.0, span.drive, now, y);
            let f0 = rate((start_s, Side::After), &y0);
            let f1 = rate((start_s + length_s, Side::Before), &y1);
            let piece = SteppedPiece {
                dense: self.piece.dense.map(|(step, first, last)| {
                    let theta = |share: f64| first + share * (last - first);
                    (step, theta(from), theta(to))
                }),
                rates: (&f0, &f1),
                stray: self.piece.stray,
            };
            let part = Span {
                start_s,
                length_s,
                y: (&y0, &y1),
                interior: &piece,
                ..*span
            };
            let (span, piece) = (&part, &piece);
            Stepped { span, piece }.follow(extremes);
            from = to;
        }
    }

    /// Energies over the span \[J\]: that which the joint's damper takes, `∫ R·I² dt` and
    /// `∫ V·I dt`, by the method's own sum where there is one, so to the order of the
    /// solution; by Gauss's rule on the cubic of solver `rk4`, whose step may be in contact
    /// in a part only.
    fn energies(&self) -> Energies {
        let span = self.span;
        let (axis, (start, end)) = (span.axis, (span.modes.0.joint, span.modes.1.joint));
        let joint = axis.joint.unwrap_or_default();
        let carries = |y: &Vector| match start == end {
            true => start.carries(),
            false => {
                (start.carries() || end.carries())
                    && joint.mode_of_state(y[EPSILON], y[EPSILON_DOT]).carries()
            }
        };
        let mut sums = [0.0; 3];
        let mut add = |theta: f64, weight: f64, y: &Vector| {
            let time_s = span.start_s + theta * span.length_s;
            let voltage_v = axis.voltage_v(span.mode_at(theta), span.drive, time_s, y);
            let (epsilon_dot, current_a) = (y[EPSILON_DOT], y[CURRENT]);
            let powers = [
                if carries(y) {
                    epsilon_dot * epsilon_dot
                } else {
                    0.0
                },
                axis.motor.resistance_ohm * (current_a * current_a),
                voltage_v * current_a,
            ];
            for (sum, power) in sums.iter_mut().zip(powers) {
                *sum += weight * power;
            }
        };
        let (c, h) = (joint.damping_nms_per_rad, span.length_s);
        if let Some((step, ..)) = self.piece.dense {
            for (theta, weight, y) in step.stages() {
                add(theta, weight, &y);
            }
            let [joint, armature, electrical] = sums;
            [c * (joint * h), armature * h, electrical * h]
        } else {
            for (theta, weight) in GAUSS_4 {
                add(theta, weight, &span.vector_at(theta));
            }
            let [joint, armature, electrical] = sums;
            [c * joint * h, armature * h, electrical * h]
        }
    }
}
