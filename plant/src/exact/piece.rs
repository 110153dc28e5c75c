//! A piece of the exact solution, and what the figures of a run look at on it.

use super::crossing::Flow;
use super::held_table::HeldTable;
use super::peak::{SketchedPeak, Sought};
use super::system::{Column, HELD, to_plant_vector};
use super::table::{Linear, Quantity};
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::motion::{Motion, MotionPoint};
use crate::model::state::{CURRENT, Vector};
use crate::numerics::width::{One, Width};
use crate::observe::extremes::{
    CARRIAGE, Energies, Extremes, FIGURES, POWER, Seen, figures_at, is_following_error,
};
use crate::observe::{Interior, Span};

/// Ends and command of one piece of the solution, for the figures of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece<'a> {
    pub(crate) motion: &'a Motion,
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    /// Voltage over the piece, where it is held.
    pub(crate) voltage_v: f64,
    /// The figures at both ends.
    pub(crate) ends: [[f64; FIGURES]; 2],
    /// Distances of the carriage from the travel at both ends \[m\].
    pub(crate) distances_m: [f64; 2],
}

impl<'a> Piece<'a> {
    /// The piece within one mode between the states `ends`, where the command
    /// is `commands`.
    #[inline(always)]
    pub(crate) fn new(
        axis: &Axis,
        mode: &Mode,
        ends: [&Vector; 2],
        (motion, commands): (&'a Motion, [MotionPoint; 2]),
        (start_s, length_s): (f64, f64),
        voltage_v: f64,
    ) -> Self {
        let p = axis.pitch_m_per_rad;
        let figures = |place: usize| {
            let given = (commands[place].displacement_m, voltage_v);
            figures_at(axis, mode, ends[place], given)
        };
        Self {
            motion,
            start_s,
            length_s,
            voltage_v,
            ends: [figures(0), figures(1)],
            distances_m: ends.map(|y| motion.travel_m() - p * axis.screw_angle_rad(y)),
        }
    }

    /// The piece over `span` as `extremes` measures it, under a held voltage, and the
    /// command at its end.
    #[inline(always)]
    pub(super) fn over(
        span: &Span<'_>,
        voltage_v: f64,
        extremes: &'a Extremes,
    ) -> (Self, MotionPoint) {
        let motion = &extremes.settings.motion;
        let start = extremes.command_at(span.start_s());
        let commands = [start, motion.at(span.end_s())];
        let times_s = (span.start_s(), span.length_s());
        let ends = [span.y.0, span.y.1];
        let command = (motion, commands);
        let piece = Self::new(span.axis, &span.modes.0, ends, command, times_s, voltage_v);
        (piece, commands[1])
    }
}

/// A stretch of the solution that a quantity is looked at on.
#[derive(Debug, Clone, Copy)]
struct Reach<'a, const D: usize> {
    flow: Flow<'a, D>,
    length_s: f64,
    /// The shortest of the table's steps that is no shorter than the piece.
    level: usize,
    /// 1 where the piece is as long as that step. The chord of a shorter one
    /// lies up to once the deviation from the longer one's, which makes 2.
    slack: f64,
}

impl<'a, const D: usize> Reach<'a, D> {
    fn new(flow: &Flow<'a, D>, length_s: f64) -> Self {
        let levels = &flow.table.levels;
        let level = levels
            .steps
            .iter()
            .rposition(|step| step.length_s >= length_s)
            .unwrap_or(0);
        let whole = levels.steps[level].length_s == length_s;
        Self {
            flow: *flow,
            length_s,
            level,
            slack: if whole { 1.0 } else { 2.0 },
        }
    }

    /// Raises `peak` to the supremum of the quantity's magnitude, which at the
    /// ends is known.
    fn raise(
        &self,
        sought: &Sought<'a, D>,
        (from, to): (f64, f64),
        peak: &mut f64,
        work: &mut u64,
    ) {
        let length_s = self.length_s;
        let chord = sought.chord_bound(self.level, &self.flow.rate, length_s);
        if from.abs().max(to.abs()) + self.slack * chord <= *peak {
            return;
        }
        if self.slack == 1.0
            && (to - from).abs() >= sought.slope_bound(self.level, &self.flow.rate, length_s)
        {
            return;
        }
        match self.flow.sketched_peak(sought, length_s, *peak) {
            SketchedPeak::None => {}
            SketchedPeak::At(within) => *peak = peak.max(within),
            SketchedPeak::Unclear => self.search(sought, peak, work),
        }
    }

    /// Raises `peak` by searching the piece; where the command is not smooth,
    /// its parts.
    fn search(&self, sought: &Sought<'a, D>, peak: &mut f64, work: &mut u64) {
        let Some((motion, start_s)) = sought.command else {
            let within = self.flow.peak_within(sought, self.length_s, *peak, work);
            *peak = within.map_or(*peak, |within| peak.max(within));
            return;
        };
        let length_s = self.length_s;
        let mut from_s = 0.0;
        let inner = motion.breaks_from(start_s).iter().map(|t| t - start_s);
        for to_s in inner.take_while(|&t| t <= length_s).chain([length_s]) {
            if to_s <= from_s {
                continue;
            }
            let start: Column<D> = self.flow.at(from_s);
            let flow = self.flow.from(&start);
            let part = Sought {
                command: Some((motion, start_s + from_s)),
                ..*sought
            };
            if to_s < length_s {
                *peak = peak.max(part.value(&self.flow.at(to_s), to_s - from_s).abs());
            }
            if let Some(within) = flow.peak_within(&part, to_s - from_s, *peak, work) {
                *peak = peak.max(within);
            }
            from_s = to_s;
        }
    }
}

/// One piece of the solution with the quantities that figures are made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sights<'a, const D: usize> {
    reach: Reach<'a, D>,
    piece: Piece<'a>,
    pitch_m_per_rad: f64,
    /// `m·b` of δ less β(0), and the constant part of γ̈.
    constants: (f64, f64),
    /// The state is counted from the command.
    ahead: bool,
}

impl<'a, const D: usize> Sights<'a, D> {
    pub(super) fn new(
        axis: &Axis,
        flow: Flow<'a, D>,
        (offset_rad, screw_load): (f64, f64),
        piece: Piece<'a>,
        ahead: bool,
    ) -> Self {
        Self {
            reach: Reach::new(&flow, piece.length_s),
            piece,
            pitch_m_per_rad: axis.pitch_m_per_rad,
            constants: (offset_rad - axis.start_rad, screw_load),
            ahead,
        }
    }

    fn sought(&self, of: Quantity, scale: f64, offset: f64, commanded: bool) -> Sought<'a, D> {
        let piece = &self.piece;
        Sought {
            linear: self.reach.flow.table.quantity(of),
            scale,
            offset,
            command: commanded.then_some((piece.motion, piece.start_s)),
        }
    }

    /// ẍ, I, the command less p·γ or p·β, or the power.
    fn figure(&self, figure: usize) -> Sought<'a, D> {
        let (p, (offset_rad, screw_load)) = (self.pitch_m_per_rad, self.constants);
        let lanes = [offset_rad, self.piece.voltage_v];
        let (of, (scale, offset)) = behind_figure(One, figure, [p, screw_load], lanes);
        match is_following_error(figure) && self.ahead {
            true => self.sought(of, -scale, -offset, false),
            false => self.sought(of, scale, offset, is_following_error(figure)),
        }
    }

    /// The larger magnitudes of the figures at the ends.
    pub(crate) fn sizes(&self) -> [f64; FIGURES] {
        let [from, to] = &self.piece.ends;
        core::array::from_fn(|i| from[i].abs().max(to[i].abs()))
    }

    /// Raises the peaks whose bits are set in `which` to the suprema within the
    /// piece, those at its ends being known, and looks at the settling band.
    pub(crate) fn look(&self, mut peaks: [f64; FIGURES], which: u8, band_m: f64) -> Seen {
        let mut work = 0;
        for (figure, peak) in peaks.iter_mut().enumerate() {
            if which >> figure & 1 != 0 {
                let [from, to] = &self.piece.ends;
                let ends = (from[figure], to[figure]);
                self.reach
                    .raise(&self.figure(figure), ends, peak, &mut work);
            }
        }
        let after_s = self.last_outside(band_m, &mut work);
        Seen {
            peaks,
            last_outside_s: after_s.map(|t| self.piece.start_s + t),
            work,
        }
    }

    /// The figures whose bits are set in `which` and the settling band, the ends of the
    /// piece included.
    pub(super) fn look_at(&self, which: u8, band_m: f64, extremes: &Extremes) -> Seen {
        let mut peaks = extremes.peaks();
        for (i, (peak, ends)) in peaks.iter_mut().zip(self.sizes()).enumerate() {
            if which >> i & 1 != 0 {
                *peak = peak.max(ends);
            }
        }
        self.look(peaks, which, band_m)
    }

    /// Last time at which the carriage is further than `band_m` from the travel, counted
    /// from the start of the piece \[s\].
    fn last_outside(&self, band_m: f64, work: &mut u64) -> Option<f64> {
        let length_s = self.piece.length_s;
        let [from_m, to_m] = self.piece.distances_m.map(f64::abs);
        if to_m > band_m {
            return Some(length_s);
        }
        // The distance from the travel, or the command's from where it would be none.
        let p = self.pitch_m_per_rad;
        let offset_m = self.piece.motion.travel_m() + p * self.constants.0;
        let distance = self.sought(Quantity::ScrewAngle, -p, offset_m, self.ahead);
        let chord = distance.chord_bound(self.reach.level, &self.reach.flow.rate, length_s);
        if from_m.max(to_m) + self.reach.slack * chord <= band_m {
            return None;
        }
        self.reach
            .flow
            .last_outside(&distance, band_m, length_s, work)
    }
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

/// Raises `peak` to the supremum of a quantity's magnitude, which at the ends is known.
pub(super) fn raise_quantity<const D: usize>(
    flow: &Flow<'_, D>,
    (linear, offset): (&Linear<D>, f64),
    [from, to]: [f64; 2],
    length_s: f64,
    peak: &mut f64,
    work: &mut u64,
) {
    let sought = Sought {
        offset,
        ..Sought::plain(linear)
    };
    Reach::new(flow, length_s).raise(&sought, (from, to), peak, work);
}

/// A smooth piece of the solution under a held voltage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldPiece<'a> {
    pub(crate) table: &'a HeldTable,
    pub(crate) input: Column<HELD>,
    pub(crate) start: Column<HELD>,
    /// dx/dt at the start.
    pub(crate) rate: Column<HELD>,
    pub(crate) offset_rad: f64,
    /// β̂, which a held voltage does not advance.
    pub(crate) beta_integral_rads: f64,
}

impl HeldPiece<'_> {
    /// End of the whole step.
    pub(super) fn whole_end(&self, voltage_v: f64) -> Vector {
        let end = self.table.step.end(One, &self.start.into(), voltage_v);
        to_plant_vector(&end.into(), self.offset_rad, self.beta_integral_rads)
    }

    pub(crate) fn flow(&self) -> Flow<'_, HELD> {
        Flow::with_rate(&self.table.table, &self.input, &self.start, self.rate)
    }

    pub(super) fn sights<'a>(&'a self, axis: &Axis, piece: Piece<'a>) -> Sights<'a, HELD> {
        let constants = (self.offset_rad, self.table.system.screw_load);
        Sights::new(axis, self.flow(), constants, piece, false)
    }

    /// The energies of `length_s` of the piece.
    #[inline(always)]
    pub(crate) fn energies(&self, voltage_v: f64, length_s: f64) -> Energies {
        let (table, current) = (self.table, self.start[CURRENT]);
        let [_, rates @ ..]: [f64; HELD] = self.rate.into();
        match length_s == table.length_s() {
            true => table.step.energies(One, (current, &rates), voltage_v),
            false => table.energies_of_part(One, (current, &rates), voltage_v, length_s),
        }
    }
}

impl Interior for HeldPiece<'_> {
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector {
        let x = self.flow().at(theta * span.length_s);
        to_plant_vector(&x, self.offset_rad, self.beta_integral_rads)
    }

    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes) {
        let voltage_v = match span.drive {
            Drive::Held(voltage_v) => *voltage_v,
            Drive::Feedback(_) => span.voltage_at_v(0.0),
        };
        extremes.peak_abs_voltage_v = extremes.peak_abs_voltage_v.max(voltage_v.abs());
        let (piece, command) = Piece::over(span, voltage_v, extremes);
        let band_m = extremes.settings.settling_band_m;
        let seen = self
            .sights(span.axis, piece)
            .look_at(u8::MAX, band_m, extremes);
        extremes.take(&seen);
        extremes.command_at_end = Some((span.end_s(), command));
        extremes.add(self.energies(voltage_v, span.length_s));
    }
}
