//! Largest values over the continuous solution, without a trace.
//!
//! Every span of the solution is searched between its ends; the limits on
//! both sides of a contact change are ends of spans. Memory does not grow
//! with the run.

use crate::bernstein::Polynomial;
use crate::exact::Sights;
use crate::motion::{Motion, MotionPoint};
use crate::span::{ContactChange, Interior, Span, Watch};
use crate::state::{BETA, CURRENT, Vector, gamma};
use crate::stepped::Stepped;

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
        }
    }

    pub(crate) fn motion(&self) -> &Motion {
        &self.settings.motion
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
    /// A piece of the exact solution.
    fn look<const D: usize>(&mut self, span: &Span<'_>, sights: &Sights<'_, D>) {
        let ends = (
            self.command_at(span.start_s()),
            self.settings.motion.at(span.end_s()),
        );
        for (y, command) in [(span.y.0, ends.0), (span.y.1, ends.1)] {
            self.look_at(span, y, &command);
        }
        self.command_at_end = Some((span.end_s(), ends.1));
        self.look_within(span.start_s(), sights);
    }

    /// Between the ends of a piece of the exact solution.
    pub(crate) fn look_within<const D: usize>(&mut self, start_s: f64, sights: &Sights<'_, D>) {
        self.raise_peaks(start_s, sights, u8::MAX);
        if let Some(voltage) = &sights.voltage {
            sights.raise(voltage, &mut self.peak_abs_voltage_v);
        }
        let (travel_m, band_m) = (
            self.settings.motion.travel_m(),
            self.settings.settling_band_m,
        );
        if let Some(after_s) = sights.last_outside(travel_m, band_m) {
            self.last_outside_band_s = Some(start_s + after_s);
        }
    }

    /// The peaks of [`Extremes::peaks`] whose bits are set in `which`.
    pub(crate) fn raise_peaks<const D: usize>(
        &mut self,
        start_s: f64,
        sights: &Sights<'_, D>,
        which: u8,
    ) {
        let motion = &self.settings.motion;
        if which & 1 != 0 {
            sights.raise(&sights.acceleration, &mut self.peak_abs_acceleration_mps2);
        }
        if which & 2 != 0 {
            sights.raise(&sights.current, &mut self.peak_abs_current_a);
        }
        if which & 4 != 0 {
            let peak = &mut self.peak_following_error_m;
            sights.raise_behind(&sights.carriage, motion, start_s, peak);
        }
        if which & 8 != 0 {
            let peak = &mut self.peak_motor_following_error_m;
            sights.raise_behind(&sights.motor, motion, start_s, peak);
        }
    }

    /// One end of a piece of the exact solution.
    fn look_at(&mut self, span: &Span<'_>, y: &Vector, command: &MotionPoint) {
        let (axis, p) = (span.axis, span.axis.pitch_m_per_rad());
        let raise = |peak: &mut f64, value: f64| *peak = peak.max(value.abs());
        let acceleration_mps2 = axis.carriage_acceleration_mps2(&span.modes.0, y);
        raise(&mut self.peak_abs_acceleration_mps2, acceleration_mps2);
        raise(&mut self.peak_abs_current_a, y[CURRENT]);
        let x_ref_m = command.displacement_m;
        raise(&mut self.peak_following_error_m, x_ref_m - p * gamma(y));
        raise(
            &mut self.peak_motor_following_error_m,
            x_ref_m - p * y[BETA],
        );
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
                self.look(span, &piece.sights(span.axis, span.y.1, span.length_s));
            }
            Interior::Feedback(piece) => {
                for theta in [0.0, 1.0] {
                    let voltage_v = span.voltage_at_v(theta).abs();
                    self.peak_abs_voltage_v = self.peak_abs_voltage_v.max(voltage_v);
                }
                let amplifier = span.modes.0.amplifier;
                self.look(span, &piece.sights(span.axis, amplifier, span.length_s));
            }
            Interior::Stepped(piece) => self.look_between_ends(&Stepped { span, piece }),
        }
    }

    fn contact_change(&mut self, change: &ContactChange) {
        self.contact_changes += 1;
        self.impacts += u64::from(change.impact);
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
