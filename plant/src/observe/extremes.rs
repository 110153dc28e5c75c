//! Largest values over the continuous solution, without a trace.
//!
//! Every span of the solution is searched between its ends; the limits on
//! both sides of a contact change are ends of spans. Memory does not grow
//! with the run.

use crate::exact::{Piece, Seen, Sights};
use crate::hybrid::mode::AmplifierMode;
use crate::model::motion::{Motion, MotionPoint};
use crate::numerics::bernstein::Polynomial;
use crate::observe::span::{ContactChange, Interior, Span, Watch};
use crate::stepped::piece::Stepped;

/// What is measured besides the plain peaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtremesSettings {
    /// The commanded motion.
    pub motion: Motion,
    /// Half width of the settling band around the travel \[m\].
    pub settling_band_m: f64,
}

/// Extremes of a run so far. Starts at rest at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    settings: ExtremesSettings,
    breaks_s: [f64; 7],
    command_at_end: Option<(f64, MotionPoint)>,
    /// sup of |ẍ| \[m/s²\], both one-sided limits at events included.
    pub peak_abs_acceleration_mps2: f64,
    /// sup of |x_ref − x| \[m\].
    pub peak_following_error_m: f64,
    /// sup of |x_ref − p·β| \[m\].
    pub peak_motor_following_error_m: f64,
    /// sup of |I| \[A\].
    pub peak_abs_current_a: f64,
    /// sup of |V_m| in force \[V\].
    pub peak_abs_voltage_v: f64,
    /// Time at the amplifier's limit under the continuous law \[s\].
    pub voltage_limited_s: f64,
    /// Last instant at which the carriage was outside the settling band \[s\].
    pub last_outside_band_s: Option<f64>,
    /// Changes of contact.
    pub contact_changes: u64,
    /// Closings of the gap.
    pub impacts: u64,
    /// Largest |ε̇| at which the gap closed \[rad/s\]; 0 if it never did.
    pub hardest_impact_radps: f64,
    /// `∫ c·ε̇² dt` over the time in contact \[J\]: what the joint's damper has
    /// turned into heat.
    pub joint_loss_j: f64,
}

impl Extremes {
    /// Nothing seen yet.
    pub fn new(settings: ExtremesSettings) -> Self {
        Self {
            settings,
            breaks_s: settings.motion.breaks_s(),
            command_at_end: None,
            peak_abs_acceleration_mps2: 0.0,
            peak_following_error_m: 0.0,
            peak_motor_following_error_m: 0.0,
            peak_abs_current_a: 0.0,
            peak_abs_voltage_v: 0.0,
            voltage_limited_s: 0.0,
            last_outside_band_s: None,
            contact_changes: 0,
            impacts: 0,
            hardest_impact_radps: 0.0,
            joint_loss_j: 0.0,
        }
    }

    pub(crate) fn motion(&self) -> &Motion {
        &self.settings.motion
    }

    pub(crate) fn settling_band_m(&self) -> f64 {
        self.settings.settling_band_m
    }

    /// Peaks of ẍ, I and the two following errors.
    pub(crate) fn peaks(&self) -> [f64; 4] {
        [
            self.peak_abs_acceleration_mps2,
            self.peak_abs_current_a,
            self.peak_following_error_m,
            self.peak_motor_following_error_m,
        ]
    }

    /// The same, to be raised.
    pub(crate) fn peaks_mut(&mut self) -> [&mut f64; 4] {
        [
            &mut self.peak_abs_acceleration_mps2,
            &mut self.peak_abs_current_a,
            &mut self.peak_following_error_m,
            &mut self.peak_motor_following_error_m,
        ]
    }

    fn settle(&mut self, stepped: &Stepped<'_>) {
        let band_m = self.settings.settling_band_m;
        let span = stepped.span;
        let distance = stepped.distance_to(self.settings.motion.travel_m());
        if distance.ends.end.abs() > band_m {
            self.last_outside_band_s = Some(span.end_s());
        } else if distance.bound() > band_m
            && let Some(theta) = last_outside(distance.septic(), band_m)
        {
            self.last_outside_band_s = Some(span.start_s() + theta * span.length_s());
        }
    }

    fn follow(&mut self, stepped: &Stepped<'_>) {
        let span = stepped.span;
        let motion = &self.settings.motion;
        let start = self.command_at(span.start_s());
        let end = motion.at(span.end_s());
        let command = (start, end);
        let of_carriage = stepped.following_error(motion, &command, false);
        of_carriage.raise(&mut self.peak_following_error_m);
        let of_motor = stepped.following_error(motion, &command, true);
        of_motor.raise(&mut self.peak_motor_following_error_m);
        self.command_at_end = Some((span.end_s(), end));
    }
}

impl Extremes {
    /// A piece of the exact solution with its ends, and the command at its end.
    fn piece(&self, span: &Span<'_>) -> (Piece<'_>, MotionPoint) {
        let motion = &self.settings.motion;
        let commands = [self.command_at(span.start_s()), motion.at(span.end_s())];
        let times_s = (span.start_s(), span.length_s());
        let ends = [span.y.0, span.y.1];
        let piece = Piece::new(span.axis, &span.modes.0, ends, (motion, commands), times_s);
        (piece, commands[1])
    }

    /// Looks at a piece of the exact solution, its ends included.
    fn look<const D: usize>(&self, sights: &Sights<'_, D>) -> Seen {
        let mut peaks = self.peaks();
        for (peak, ends) in peaks.iter_mut().zip(sights.sizes()) {
            *peak = peak.max(ends);
        }
        sights.look(peaks, u8::MAX, self.settings.settling_band_m)
    }

    /// Takes over what was seen in a piece of the exact solution.
    pub(crate) fn take(&mut self, seen: &Seen) {
        for (peak, seen) in self.peaks_mut().into_iter().zip(seen.peaks) {
            *peak = seen;
        }
        // `None` is less than any time.
        if seen.last_outside_s > self.last_outside_band_s {
            self.last_outside_band_s = seen.last_outside_s;
        }
    }

    /// The command at the start of a span, which is the end of the last.
    fn command_at(&self, start_s: f64) -> MotionPoint {
        match self.command_at_end {
            Some((time_s, command)) if time_s == start_s => command,
            _ => self.settings.motion.at(start_s),
        }
    }

    /// A step of a Runge-Kutta solver.
    fn look_between_ends(&mut self, stepped: &Stepped<'_>) {
        stepped
            .acceleration()
            .raise(&mut self.peak_abs_acceleration_mps2);
        stepped.current().raise(&mut self.peak_abs_current_a);
        stepped.voltage().raise(&mut self.peak_abs_voltage_v);
        let breaks_s = self.breaks_s;
        stepped.split_at(&breaks_s, |part| self.follow(part));
        self.settle(stepped);
    }
}

impl Watch for Extremes {
    fn span(&mut self, span: &Span<'_>) {
        if span.is_voltage_limited() {
            self.voltage_limited_s += span.length_s();
        }
        match span.interior {
            Interior::Held(piece) => {
                let voltage_v = span.voltage_at_v(0.0).abs();
                self.peak_abs_voltage_v = self.peak_abs_voltage_v.max(voltage_v);
                let (ends, command) = self.piece(span);
                let seen = self.look(&piece.sights(span.axis, ends));
                self.take(&seen);
                self.command_at_end = Some((span.end_s(), command));
                self.joint_loss_j += piece.joint_loss_j(span.length_s);
            }
            Interior::Feedback(piece) => {
                let ends_v = (span.voltage_at_v(0.0), span.voltage_at_v(1.0));
                let peak_v = &mut self.peak_abs_voltage_v;
                *peak_v = peak_v.max(ends_v.0.abs()).max(ends_v.1.abs());
                if span.modes.0.amplifier == AmplifierMode::Linear {
                    piece.raise_voltage(span.length_s, ends_v, peak_v);
                }
                let (ends, command) = self.piece(span);
                let seen = self.look(&piece.sights(span.axis, ends));
                self.take(&seen);
                self.command_at_end = Some((span.end_s(), command));
                self.joint_loss_j += piece.joint_loss_j(span.length_s);
            }
            Interior::Stepped(piece) => {
                let stepped = Stepped { span, piece };
                self.look_between_ends(&stepped);
                self.joint_loss_j += stepped.joint_loss_j();
            }
        }
    }

    fn contact_change(&mut self, change: &ContactChange) {
        self.contact_changes += 1;
        self.impacts += u64::from(change.impact);
        if change.impact {
            let closing_radps = change.epsilon_dot_radps.abs();
            self.hardest_impact_radps = self.hardest_impact_radps.max(closing_radps);
        }
    }
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
