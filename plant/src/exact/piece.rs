//! A piece of the exact solution, and what the figures of a run look at on it.

use super::crossing::{Flow, Sought};
use super::held_table::HeldTable;
use super::system::{Column, DELTA, HELD};
use super::table::Quantity;
use crate::model::axis::Drive;
use crate::model::motion::{Motion, MotionPoint};
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON_DOT, Vector};
use crate::numerics::width::{One, Width};
use crate::observe::extremes::{
    CARRIAGE, Extremes, FIGURES, POWER, Seen, figures_at, is_following_error,
};
use crate::observe::{Interior, Span};

/// One piece of the solution with the quantities that figures are made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sights<'a, const D: usize> {
    pub(super) flow: Flow<'a, D>,
    pub(super) span: &'a Span<'a>,
    pub(super) motion: &'a Motion,
    /// The figures at both ends.
    pub(super) ends: [[f64; FIGURES]; 2],
    /// `m·b` of δ, and the constant part of γ̈.
    pub(super) constants: (f64, f64),
    /// The state is counted from the command.
    pub(super) ahead: bool,
}

impl<'a, const D: usize> Sights<'a, D> {
    fn sought(&self, of: Quantity, scale: f64, offset: f64, commanded: bool) -> Sought<'a, D> {
        Sought {
            linear: self.flow.table.quantity(of),
            scale,
            offset,
            command: commanded.then_some((self.motion, self.span.start_s)),
        }
    }

    /// `m·b` of δ less β(0).
    fn offset_rad(&self) -> f64 {
        self.constants.0 - self.span.axis.start_rad
    }

    /// ẍ, I, the command less p·γ or p·β, or the power under a held voltage.
    fn figure(&self, figure: usize) -> Sought<'a, D> {
        let voltage_v = match self.span.drive {
            Drive::Held(voltage_v) => *voltage_v,
            Drive::Feedback(_) => 0.0,
        };
        let of_axis = [self.span.axis.pitch_m_per_rad, self.constants.1];
        let lanes = [self.offset_rad(), voltage_v];
        let (of, (scale, offset)) = behind_figure(One, figure, of_axis, lanes);
        match is_following_error(figure) && self.ahead {
            true => self.sought(of, -scale, -offset, false),
            false => self.sought(of, scale, offset, is_following_error(figure)),
        }
    }

    /// Raises the peaks whose bits are set in `which` to the suprema within the
    /// piece, those at its ends being known, and looks at the settling band.
    pub(super) fn look(&self, mut peaks: [f64; FIGURES], which: u8, band_m: f64) -> Seen {
        let (mut work, length_s) = (0, self.span.length_s);
        let over = self.flow.table.levels.over(length_s);
        for (figure, peak) in peaks.iter_mut().enumerate() {
            if which >> figure & 1 != 0 {
                let [from, to] = &self.ends;
                let (sought, ends) = (self.figure(figure), [from[figure], to[figure]]);
                self.flow
                    .raise(&sought, length_s, over, ends, peak, &mut work);
            }
        }
        let after_s = self.last_outside(band_m, over, &mut work);
        Seen {
            peaks,
            last_outside_s: after_s.map(|t| self.span.start_s + t),
            work,
        }
    }

    /// Last time at which the carriage is further than `band_m` from the travel, counted
    /// from the start of the piece \[s\].
    fn last_outside(
        &self,
        band_m: f64,
        (level, slack): (usize, f64),
        work: &mut u64,
    ) -> Option<f64> {
        let length_s = self.span.length_s;
        let [from_m, to_m] = distances_m(self.span, self.motion);
        if to_m > band_m {
            return Some(length_s);
        }
        // The distance from the travel, or the command's from where it would be none.
        let p = self.span.axis.pitch_m_per_rad;
        let offset_m = self.motion.travel_m() + p * self.offset_rad();
        let distance = self.sought(Quantity::ScrewAngle, -p, offset_m, self.ahead);
        let chord = distance.chord_bound(level, &self.flow.rate, length_s);
        if from_m.max(to_m) + slack * chord <= band_m {
            return None;
        }
        self.flow.last_outside(&distance, band_m, length_s, work)
    }
}

/// Distances of the carriage from the travel at both ends \[m\].
pub(super) fn distances_m(span: &Span<'_>, motion: &Motion) -> [f64; 2] {
    let p = span.axis.pitch_m_per_rad;
    [span.y.0, span.y.1].map(|y| (motion.travel_m() - p * span.axis.screw_angle_rad(y)).abs())
}

/// The quantity behind a figure, or that the command exceeds by it, and its scale and offset:
/// from p and the constant part of γ̈, and of every lane `m·b` of δ less β(0), and the voltage.
#[inline(always)]
pub(crate) fn behind_figure<W: Width>(
    w: W,
    figure: usize,
    [pitch_m_per_rad, screw_load]: [f64; 2],
    [offset_rad, voltage_v]: [W::Vector; 2],
) -> (Quantity, (W::Vector, W::Vector)) {
    let (zero, p) = (w.splat(0.0), w.splat(pitch_m_per_rad));
    match figure {
        0 => {
            let offset = w.splat(pitch_m_per_rad * screw_load);
            (Quantity::ScrewAcceleration, (p, offset))
        }
        1 => (Quantity::Current, (w.splat(1.0), zero)),
        CARRIAGE => (Quantity::ScrewAngle, (p, zero - p * offset_rad)),
        POWER => (Quantity::Current, (voltage_v, zero)),
        _ => (Quantity::GearAngle, (p, zero)),
    }
}

/// A smooth piece of the solution under a held voltage.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeldPiece<'a> {
    pub(super) table: &'a HeldTable,
    pub(super) flow: Flow<'a, HELD>,
    pub(super) voltage_v: f64,
    pub(super) offset_rad: f64,
    /// β̂, which a held voltage does not advance.
    pub(super) beta_integral_rads: f64,
}

impl HeldPiece<'_> {
    /// End of the whole step.
    pub(super) fn whole_end(&self) -> Column<HELD> {
        let (step, start) = (&self.table.step, self.flow.start.into());
        step.end(One, &start, self.voltage_v).into()
    }

    pub(super) fn plant_vector(&self, x: &Column<HELD>) -> Vector {
        Vector::from([
            x[BETA],
            x[BETA_DOT],
            x[DELTA] + self.offset_rad,
            x[EPSILON_DOT],
            x[CURRENT],
            self.beta_integral_rads,
            0.0,
        ])
    }

    /// Raises the peaks whose bits are set in `which` to those over the piece, its ends
    /// included, and looks at the settling band. Returns the command at the end, where a
    /// following error is among them.
    #[inline(always)]
    pub(super) fn look(
        &self,
        span: &Span<'_>,
        (which, band_m): (u8, f64),
        extremes: &mut Extremes,
    ) -> MotionPoint {
        let motion = &extremes.settings.motion;
        let mut commands = [MotionPoint::default(); 2];
        if which >> CARRIAGE & 0b11 != 0 {
            commands = [extremes.command_at(span.start_s), motion.at(span.end_s())];
        }
        let figures = |y: &Vector, command: &MotionPoint| {
            let given = (command.displacement_m, self.voltage_v);
            figures_at(span.axis, &span.modes.0, y, given)
        };
        let sights = Sights {
            flow: self.flow,
            span,
            motion,
            ends: [
                figures(span.y.0, &commands[0]),
                figures(span.y.1, &commands[1]),
            ],
            constants: (self.offset_rad, self.table.system.screw_load),
            ahead: false,
        };
        let mut peaks = extremes.peaks();
        let [from, to] = &sights.ends;
        for (i, peak) in peaks.iter_mut().enumerate() {
            if which >> i & 1 != 0 {
                *peak = peak.max(from[i].abs().max(to[i].abs()));
            }
        }
        let seen = sights.look(peaks, which, band_m);
        extremes.take(&seen);
        commands[1]
    }
}

impl Interior for HeldPiece<'_> {
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector {
        self.plant_vector(&self.flow.at(theta * span.length_s))
    }

    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes) {
        let (table, voltage_v, length_s) = (self.table, self.voltage_v, span.length_s);
        extremes.peak_abs_voltage_v = extremes.peak_abs_voltage_v.max(voltage_v.abs());
        let band_m = extremes.settings.settling_band_m;
        let command = self.look(span, (u8::MAX, band_m), extremes);
        extremes.command_at_end = Some((span.end_s(), command));
        let (current, rates) = (self.flow.start[CURRENT], self.flow.rate);
        let [_, rates @ ..]: [f64; HELD] = rates.into();
        let start = (current, &rates);
        extremes.add(match length_s == table.length_s() {
            true => table.step.energies(One, start, voltage_v),
            false => table.energies_of_part(One, start, voltage_v, length_s),
        });
    }
}
