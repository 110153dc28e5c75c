//! A piece of the exact solution, and what the figures of a run look at on it.

use super::crossing::Flow;
use super::feedback_table::FeedbackTable;
use super::held_table::HeldTable;
use super::loss::heat_of_part;
use super::peak::{SketchedPeak, Sought};
use super::power::{Factor, raise_product, stays_below};
use super::system::{Column, DELTA, FEEDBACK, HELD, plant_vector, to_plant_vector};
use super::table::{Linear, Quantity};
use crate::model::amplifier::AmplifierMode;
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::motion::{Motion, MotionPoint};
use crate::model::state::{BETA, CURRENT, Vector};
use crate::numerics::width::{One, Width};
use crate::observe::extremes::{CARRIAGE, Energies, Extremes, FIGURES, POWER, Seen, figures_at};
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
        let behind = |of, offset: f64| match self.ahead {
            true => self.sought(of, -p, offset, false),
            false => self.sought(of, p, -offset, true),
        };
        match figure {
            0 => self.sought(Quantity::ScrewAcceleration, p, p * screw_load, false),
            1 => self.sought(Quantity::Current, 1.0, 0.0, false),
            CARRIAGE => behind(Quantity::ScrewAngle, p * offset_rad),
            POWER => self.sought(Quantity::Current, self.piece.voltage_v, 0.0, false),
            _ => behind(Quantity::GearAngle, 0.0),
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
        let end = self
            .table
            .step
            .take(One, &self.start.into(), voltage_v)
            .end();
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
        let [joint_loss_j, armature_loss_j, charge_as] = match length_s == table.length_s() {
            true => table.step.heat(One, current, &rates),
            false => heat_of_part(
                One,
                (table.loss.as_ref(), &table.armature),
                (current, &rates),
                length_s,
            ),
        };
        [joint_loss_j, armature_loss_j, voltage_v * charge_as]
    }
}

/// Place of the voltage among what a piece under the continuous law looks at first.
const VOLTAGE: usize = 4;

/// A smooth piece of the solution under the continuous law.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FeedbackPiece<'a> {
    pub(crate) table: &'a FeedbackTable,
    pub(crate) motion: &'a Motion,
    /// The states at both ends, and the law's demand there \[V\].
    pub(crate) x: [Column<FEEDBACK>; 2],
    pub(crate) demands_v: [f64; 2],
    pub(crate) offset_rad: f64,
}

impl FeedbackPiece<'_> {
    /// Raises `peak_v` to the supremum of the demand's magnitude within the
    /// piece, which at the ends is known.
    fn raise_voltage(&self, length_s: f64, peak_v: &mut f64, work: &mut u64) {
        let flow = Flow::feedback(self.table, &self.x[0]);
        let demand = self.table.table.quantity(Quantity::Demand);
        raise_quantity(&flow, (demand, 0.0), self.demands_v, length_s, peak_v, work);
    }

    /// Raises `peak_w` to the supremum of the power's magnitude, which at the ends is
    /// known; the voltage is the demand or constant.
    fn raise_power(
        &self,
        (linear, constant_v): (bool, f64),
        length_s: f64,
        peak_w: &mut f64,
        work: &mut u64,
    ) {
        let flow = Flow::feedback(self.table, &self.x[0]);
        let voltage = Sought {
            linear: self.table.table.quantity(Quantity::Demand),
            scale: f64::from(u8::from(linear)),
            offset: constant_v,
            command: None,
        };
        let current = self.table.table.quantity(Quantity::Current);
        raise_product(
            &flow,
            &[voltage, Sought::plain(current)],
            length_s,
            peak_w,
            work,
        );
    }

    /// Energy that the joint's damper takes over `length_s` of the piece \[J\].
    fn joint_loss_j(&self, length_s: f64) -> f64 {
        let (table, start) = (self.table, &self.x[0]);
        let Some(loss) = &table.loss else {
            return 0.0;
        };
        if length_s == table.length_s() {
            return loss.over_whole(start);
        }
        let rates = table.table.levels.a * start + table.input;
        loss.of.over(rates, length_s)
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

impl Interior for FeedbackPiece<'_> {
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector {
        let time_s = theta * span.length_s;
        let command = self.motion.at(span.start_s + time_s);
        let x = Flow::feedback(self.table, &self.x[0]).at(time_s);
        plant_vector(&x, (self.offset_rad, self.table.rad_per_m), &command)
    }

    /// A first test by the change of the state settles nearly every figure of
    /// nearly every whole step.
    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes) {
        let (table, length_s, offset_rad) = (self.table, span.length_s, self.offset_rad);
        let p = span.axis.pitch_m_per_rad;
        let linear = span.modes.0.amplifier == AmplifierMode::Linear;
        let [from, to] = core::array::from_fn(|end| {
            let x = &self.x[end];
            let acceleration_mps2 = p * (table.screw_acceleration(x) + table.screw_load);
            let carriage_rad = x[BETA] - x[DELTA] - offset_rad + span.axis.start_rad;
            let voltage_v = if linear {
                self.demands_v[end]
            } else {
                span.voltage_at_v(0.0)
            };
            let errors_m = [-p * carriage_rad, -p * x[BETA]];
            [
                acceleration_mps2,
                x[CURRENT],
                errors_m[0],
                errors_m[1],
                voltage_v,
            ]
        });
        let change = (self.x[1] - self.x[0]).abs();
        let mut strays = table.figures.times(&change);
        // At the limit the voltage is constant.
        if !linear {
            strays[VOLTAGE] = 0.0;
        }
        let slope = |i: usize| match i {
            VOLTAGE if !linear => 0.0,
            _ => table.slopes[i].dot(&change),
        };
        let whole = length_s == table.length_s();
        let [a, b, c, d, mut power_w] = extremes.peaks();
        let mut peaks = [a, b, c, d, extremes.peak_abs_voltage_v];
        let mut open = 0;
        for i in 0..peaks.len() {
            let size = One.max(from[i].abs(), to[i].abs());
            peaks[i] = One.max(peaks[i], size);
            open |= u8::from(!(whole && size + strays[i] <= peaks[i])) << i;
        }
        for i in 0..peaks.len() {
            let monotone = || (to[i] - from[i]).abs() >= slope(i);
            if open >> i & 1 != 0 && whole && monotone() {
                open &= !(1 << i);
            }
        }
        if linear && open >> VOLTAGE != 0 {
            self.raise_voltage(length_s, &mut peaks[VOLTAGE], &mut extremes.work);
        }
        let factors = [VOLTAGE, 1].map(|i| Factor {
            ends: [from[i], to[i]],
            chord: strays[i],
        });
        let slopes = || [VOLTAGE, 1].map(slope);
        let powers = [from, to].map(|ends| (ends[VOLTAGE] * ends[1]).abs());
        power_w = One.max(power_w, One.max(powers[0], powers[1]));
        if !(whole && stays_below(&factors, slopes, power_w)) {
            let constant = if linear { 0.0 } else { from[VOLTAGE] };
            self.raise_power(
                (linear, constant),
                length_s,
                &mut power_w,
                &mut extremes.work,
            );
        }
        let motion = &extremes.settings.motion;
        let band_m = extremes.settings.settling_band_m;
        let distances_m =
            [span.y.0, span.y.1].map(|y| motion.travel_m() - p * span.axis.screw_angle_rad(y));
        let [from_m, to_m] = distances_m.map(f64::abs);
        let bend_m = motion.peak_acceleration_mps2 * length_s * length_s / 8.0;
        let inside = whole && One.max(from_m, to_m) + strays[CARRIAGE] + bend_m <= band_m;
        let [a, b, c, d, peak_v] = peaks;
        let mut seen = Seen {
            peaks: [a, b, c, d, power_w],
            last_outside_s: (to_m > band_m).then(|| span.end_s()),
            work: 0,
        };
        let which = open & 0xf;
        if which != 0 || !inside && seen.last_outside_s.is_none() {
            let piece = Piece {
                motion,
                start_s: span.start_s,
                length_s,
                // What is known of the power is all.
                voltage_v: 0.0,
                ends: [from, to].map(|[a, b, c, d, _]| [a, b, c, d, 0.0]),
                distances_m,
            };
            let flow = Flow::feedback(table, &self.x[0]);
            let constants = (offset_rad, table.screw_load);
            let sights = Sights::new(span.axis, flow, constants, piece, true);
            seen = sights.look(seen.peaks, which, band_m);
        }
        extremes.take(&seen);
        extremes.peak_abs_voltage_v = peak_v;
        let joint_j = self.joint_loss_j(length_s);
        let [armature_j, guide_j] = table.heat_j(span.axis, &self.x[0], length_s);
        extremes.add(span.balanced_energies(joint_j, armature_j, guide_j));
    }
}
