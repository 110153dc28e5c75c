//! Solver `exact` where more than a held voltage drives the motor: the continuous law
//! (eq. 27-37), and the amplifiers beyond the paper's behind that or behind a held command.
//!
//! In each mode all of it is affine ([`super::commanded_table`]): under the continuous law the
//! command is part of the state, so that an interval without a change is one product with a
//! matrix; behind a held command nothing is counted from a motion, and the command enters as
//! an input.

use core::array;

use fearless_simd::Simd;

use super::commanded_table::CommandedTable;
use super::crossing::{Flow, Sought};
use super::grid::product;
use super::levels::BOUND_MARGIN;
use super::memory::{Carried, Tables};
use super::piece::{Sights, distances_m};
use super::power::{about_chord, is_monotone, raise_product};
use super::system::{COMMANDED, Column, DELTA, commanded_state, plant_vector};
use super::table::Quantity;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::Drive;
use crate::model::motion::{Motion, MotionPoint, Oscillator, OscillatorStep};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, CURRENT, Vector};
use crate::numerics::seconds;
use crate::numerics::vectors::{in_fours, widest};
use crate::numerics::width::{One, Width};
use crate::observe::extremes::{CARRIAGE, Extremes, FIGURES, POWER, Seen};
use crate::observe::{Interior, Span, Watch};

/// Place of the voltage among what a piece looks at: that of the power, of which all is known
/// first.
const VOLTAGE: usize = POWER;

/// A smooth piece of the solution.
#[derive(Debug, Clone, Copy)]
struct CommandedPiece<'a> {
    table: &'a CommandedTable,
    flow: Flow<'a, COMMANDED>,
    end: &'a Column<COMMANDED>,
    /// The motion that the state is counted from; none behind a held command.
    motion: Option<&'a Motion>,
    held: f64,
    offset_rad: f64,
}

impl CommandedPiece<'_> {
    /// ẍ, I, how far carriage and motor are behind the command, and the voltage at both ends;
    /// and the commands there that the state is not counted from.
    #[inline(always)]
    fn ends(
        &self,
        span: &Span<'_>,
        extremes: &Extremes,
    ) -> ([[f64; FIGURES]; 2], [MotionPoint; 2]) {
        let (table, p) = (self.table, span.axis.pitch_m_per_rad);
        let mut commands = [MotionPoint::default(); 2];
        if self.motion.is_none() {
            let end = extremes.settings.motion.at(span.end_s());
            commands = [extremes.command_at(span.start_s()), end];
        }
        let voltage = table.table.row(Quantity::Voltage);
        let [offset_v, _] = table.offsets(self.held);
        let mut figures = [[0.0; FIGURES]; 2];
        for (i, x) in [&self.flow.start, self.end].into_iter().enumerate() {
            let carriage_rad = x[BETA] - x[DELTA] - self.offset_rad + span.axis.start_rad;
            let command_m = commands[i].displacement_m;
            figures[i] = [
                p * (table.screw_acceleration(x) + table.screw_load),
                x[CURRENT],
                command_m - p * carriage_rad,
                command_m - p * x[BETA],
                product(One, voltage, &(*x).into()) + offset_v,
            ];
        }
        (figures, commands)
    }

    /// Ranges of the figures' slopes, times the step: they stray up to `slack` times as far from
    /// their chords as they may over the whole step.
    #[inline(always)]
    fn slopes(
        &self,
        simd: impl Simd,
        span: &Span<'_>,
        (motion, commands): (&Motion, [MotionPoint; 2]),
        slack: f64,
    ) -> [[f64; 2]; FIGURES] {
        let (table, input) = (self.table, &self.flow.input);
        let rates = [self.flow.rate, table.rates(simd, self.end, input)];
        let [mut from, mut to, strays] = table.slopes(simd, rates.each_ref());
        let mut strays = strays.map(|stray| slack * stray);
        if self.motion.is_none() {
            let step_s = table.length_s();
            // T·ẋ_ref strays from its chord by T²/2·sup|a_ref|, between two breaks by
            // T³/8·sup|jerk| too.
            let mut bend_m = motion.peak_acceleration_mps2 * step_s * step_s / 2.0;
            if motion.breaks_between(span.start_s, span.end_s()).is_empty() {
                let jerk_mps3 = motion.fourth_derivatives.displacement_integral_ms;
                bend_m = bend_m.min(jerk_mps3 * step_s * step_s * step_s / 8.0);
            }
            for i in CARRIAGE..POWER {
                from[i] += commands[0].velocity_mps * step_s;
                to[i] += commands[1].velocity_mps * step_s;
                strays[i] += bend_m * BOUND_MARGIN;
            }
        }
        array::from_fn(|i| about_chord([from[i], to[i]], strays[i]))
    }

    /// A first test by the rates settles nearly every figure of nearly every whole step.
    #[inline(always)]
    fn raise_by_rates(&self, simd: impl Simd, span: &Span<'_>, extremes: &mut Extremes) {
        let (table, length_s) = (self.table, span.length_s);
        let (start, rates) = (&self.flow.start, &self.flow.rate);
        let ([from, to], commands) = self.ends(span, extremes);
        let motion = &extremes.settings.motion;
        let step_s = table.length_s();
        let bend_m = motion.peak_acceleration_mps2 * step_s * step_s;
        // The chord of a part of the step lies up to once the deviation from the step's.
        let slack = if length_s == step_s { 1.0 } else { 2.0 };
        let mut strays = table.strays(simd, rates);
        for stray in &mut strays {
            *stray *= slack;
        }
        if self.motion.is_none() {
            // The command bends too, where the state is not counted from it.
            for stray in &mut strays[CARRIAGE..POWER] {
                *stray += bend_m / 8.0;
            }
        }
        let [a, b, c, d, mut power_w] = extremes.peaks();
        let mut peaks = [a, b, c, d, extremes.peak_abs_voltage_v];
        let (mut open, mut uppers) = (0, strays);
        for i in 0..FIGURES {
            let size = One.max(from[i].abs(), to[i].abs());
            peaks[i] = One.max(peaks[i], size);
            uppers[i] += size;
            let outdone = uppers[i] <= peaks[i];
            open |= u8::from(!outdone) << i;
        }
        let powers = [from, to].map(|ends| (ends[VOLTAGE] * ends[1]).abs());
        power_w = One.max(power_w, One.max(powers[0], powers[1]));
        let power_is_outdone = uppers[VOLTAGE] * uppers[1] <= power_w;
        let mut power_open = !power_is_outdone;
        if open != 0 || power_open {
            let factors = [VOLTAGE, 1].map(|i| about_chord([from[i], to[i]], strays[i]));
            let slopes = self.slopes(simd, span, (motion, commands), slack);
            for (i, [low, high]) in slopes.iter().enumerate() {
                if *low >= 0.0 || *high <= 0.0 {
                    open &= !(1 << i);
                }
            }
            power_open &= !is_monotone(factors, [VOLTAGE, 1].map(|i| slopes[i]));
        }
        let (flow, work) = (&self.flow, &mut extremes.work);
        let [offset_v, _] = table.offsets(self.held);
        let sought = |of, offset| Sought::plain(table.table.quantity(of), offset);
        let voltage = || sought(Quantity::Voltage, offset_v);
        if open >> VOLTAGE != 0 {
            let (ends_v, peak_v) = ([from[VOLTAGE], to[VOLTAGE]], &mut peaks[VOLTAGE]);
            let over = table.table.levels.over(length_s);
            flow.raise(&voltage(), length_s, over, ends_v, peak_v, work);
        }
        if power_open {
            let factors = [voltage(), sought(Quantity::Current, 0.0)];
            raise_product(flow, &factors, length_s, &mut power_w, work);
        }
        let band_m = extremes.settings.settling_band_m;
        let [from_m, to_m] = distances_m(span, motion);
        let inside = One.max(from_m, to_m) + strays[CARRIAGE] + bend_m / 8.0 <= band_m;
        let [a, b, c, d, peak_v] = peaks;
        let mut seen = Seen {
            peaks: [a, b, c, d, power_w],
            last_outside_s: (to_m > band_m).then(|| span.end_s()),
            work: 0,
        };
        let which = open & 0xf;
        if which != 0 || !inside && seen.last_outside_s.is_none() {
            let sights = Sights {
                flow: self.flow,
                span,
                motion,
                ends: [from, to],
                constants: (self.offset_rad, table.screw_load),
                ahead: self.motion.is_some(),
            };
            seen = sights.look(seen.peaks, which, band_m);
        }
        extremes.take(&seen);
        extremes.peak_abs_voltage_v = peak_v;
        if self.motion.is_none() {
            extremes.command_at_end = Some((span.end_s(), commands[1]));
        }
        let [joint_j, armature_j, guide_j] =
            table.heat_j(simd, span.axis, (start, rates), length_s);
        extremes.add(span.balanced_energies(joint_j, armature_j, guide_j));
    }
}

impl Interior for CommandedPiece<'_> {
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector {
        let time_s = theta * span.length_s;
        let now_s = span.start_s + time_s;
        let point = self.motion.map_or(MotionPoint::default(), |m| m.at(now_s));
        let counted = (self.offset_rad, self.table.rad_per_m);
        plant_vector(&self.flow.at(time_s), counted, &point)
    }

    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes) {
        in_fours!(widest(), simd => self.raise_by_rates(simd, span, extremes));
    }
}

/// A held command, 0 under the continuous law, and that law.
fn parts<'a>(drive: &Drive<'a>) -> (f64, Option<&'a ContinuousPid>) {
    match drive {
        Drive::Held(held) => (*held, None),
        Drive::Feedback(pid) => (0.0, Some(*pid)),
    }
}

impl Automaton {
    /// One interval in which a mode may change, or the continuous law begins.
    #[inline(never)]
    pub(super) fn advance_commanded(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let (_, pid) = parts(drive);
        self.take_up(drive);
        tables.carried = None;
        let (start_s, length_s) = (seconds(self.time_ns), seconds(length_ns));
        let mut interval = Interval::new(start_s, length_s);
        let breaks_s = pid.map_or(&[][..], |pid| pid.motion().breaks_from(start_s));
        let inside_s = breaks_s.iter().map(|t| t - start_s);
        let inside_s = inside_s.take_while(|&t| t < length_s);
        let mut last = None;
        for end_s in inside_s.chain([length_s]) {
            if end_s > interval.done_s || end_s == length_s {
                let ends = (length_ns, end_s);
                last = self.advance_commanded_to(tables, drive, ends, &mut interval, watch)?;
            }
        }
        tables.carried = last.map(Box::new);
        Ok(())
    }

    /// Takes the whole interval in one step if the bounds exclude a change; under the
    /// continuous law from where the last one ended.
    #[inline(always)]
    pub(super) fn keeps_all_modes(
        &mut self,
        simd: impl Simd,
        tables: &mut Tables,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> bool {
        let mode = self.mode;
        let simple = self.fresh.is_none()
            && !self.axis.releases()
            && (mode.guide, mode.stage) == (GuideMode::AsWritten, StageMode::Follows);
        if !simple {
            return false;
        }
        let (start_s, length_s) = (seconds(self.time_ns), seconds(length_ns));
        let (held, pid) = parts(drive);
        let offset_rad = self.axis.offset_rad(&mode);
        let (place, start, command, before) = match pid {
            None => {
                let command = Oscillator::default();
                let counted = (offset_rad, 1.0 / self.axis.pitch_m_per_rad);
                let start = commanded_state(&self.y, counted, &command);
                let place = tables.commanded(&self.axis, &mode, None, (None, length_ns));
                (place, start, command, None)
            }
            Some(pid) => match tables.carried_at(self.time_ns, pid) {
                Some(from) if from.length_ns == length_ns && start_s + length_s <= from.until_s => {
                    (from.place, from.x, from.command, Some(from.demand))
                }
                _ => return false,
            },
        };
        let table = &tables.commanded[place];
        let input = match pid {
            Some(_) => table.input[0],
            None => table.input(held),
        };
        let command = command.after(&table.command);
        let [end, rates] = table.step(simd, &start, (held, &input), &command);
        // What is not finite strays for ever, or to what is not a number.
        let [delta_rad, of_demand, of_beyond, of_current] = table.strays_of_guards(simd, &rates);
        let joint_keeps =
            self.joint_keeps([start[DELTA], end[DELTA]], || delta_rad) && end.sum().is_finite();
        let mut demand = 0.0;
        let command_keeps = match (pid, before) {
            (Some(pid), Some(a)) => {
                demand = table.demand(&end);
                let (b, limit) = (demand, pid.limit());
                let inside = match mode.amplifier {
                    AmplifierMode::Linear => limit - a.abs().max(b.abs()),
                    AmplifierMode::AtLimit(d) => (d.sign() * a).min(d.sign() * b) - limit,
                };
                inside > of_demand
            }
            _ => true,
        };
        let stage_keeps = match self.axis.stage {
            Stage::Voltage | Stage::IdealCurrent => true,
            Stage::LimitedVoltage { limit_a, .. } => {
                let largest = start[CURRENT].abs().max(end[CURRENT].abs());
                limit_a - largest > of_current
            }
            Stage::CurrentLoop { limit_v, .. } => {
                let beyond = table.table.quantity(Quantity::Beyond);
                let [_, offset] = table.offsets(held);
                let ends = [&start, &end].map(|x| (beyond.value(x) + offset).abs());
                limit_v - ends[0].max(ends[1]) > of_beyond
            }
        };
        if !(joint_keeps && command_keeps && stage_keeps) {
            return false;
        }
        let y = plant_vector(&end, (offset_rad, table.rad_per_m), &command.point);
        let piece = CommandedPiece {
            table,
            flow: Flow {
                table: &table.table,
                input,
                start,
                rate: rates,
            },
            end: &end,
            motion: pid.map(ContinuousPid::motion),
            held,
            offset_rad,
        };
        self.move_along(drive, (start_s, length_s), y, &piece, watch);
        if let (Some(_), Some(carried)) = (pid, &mut tables.carried) {
            carried.time_ns += length_ns;
            (carried.x, carried.command, carried.demand) = (end, command, demand);
        }
        true
    }

    /// From change to change up to `end_s` after the interval's start, within one interval
    /// of the command. Returns where to go on from under the continuous law.
    #[inline(never)]
    pub(super) fn advance_commanded_to(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        (length_ns, end_s): (u64, f64),
        interval: &mut Interval,
        watch: &mut impl Watch,
    ) -> Result<Option<Carried>, PlantError> {
        self.settle(drive, interval, watch)?;
        let (held, pid) = parts(drive);
        let motion = pid.map(ContinuousPid::motion);
        loop {
            let mode = self.mode;
            let command = motion.map(|motion| motion.oscillator(interval.now_s()));
            let coupling = command.map(|command| command.coupling);
            let command = command.unwrap_or_default();
            let place = tables.commanded(&self.axis, &mode, pid, (coupling, length_ns));
            let table = &tables.commanded[place];
            let offset_rad = self.axis.offset_rad(&mode);
            let counted = (offset_rad, table.rad_per_m);
            let start = commanded_state(&self.y, counted, &command);
            let input = table.input(held);
            let noise_rad = table.rounding_of_delta(&start);
            self.axis.set_parting_noise(noise_rad, seconds(length_ns));
            let guards = self.guards(drive);
            let (limit, offsets) = (pid.map_or(0.0, ContinuousPid::limit), table.offsets(held));
            let linear = guards.map(|g| Some(self.linear_guard(g?, &table.table, limit, offsets)));
            let flow = Flow::new(&table.table, input, start);
            let zero = flow.first_zero(&linear, end_s - interval.done_s, 0);
            let time_s = interval.now_s();
            let stop = zero.ok_or(PlantError::TooStiff { time_s })?;
            interval.count_work(stop.work, watch)?;
            let command = match pid {
                None => command,
                Some(_) => command.after(&OscillatorStep::new(command.coupling, stop.time_s)),
            };
            let piece = CommandedPiece {
                table,
                flow,
                end: &stop.x,
                motion,
                held,
                offset_rad,
            };
            let demand = table.demand(&stop.x);
            let y = plant_vector(&stop.x, counted, &command.point);
            if self.move_over(drive, interval, (&stop, &guards), y, &piece, watch)? {
                let Some(pid) = pid else { return Ok(None) };
                let time_ns = self.time_ns + length_ns;
                let later = pid.motion().breaks_from(seconds(time_ns)).first();
                let carried = Carried {
                    time_ns,
                    length_ns,
                    x: stop.x,
                    command,
                    demand,
                    place,
                    until_s: later.copied().unwrap_or(f64::INFINITY),
                };
                let untouched = self.y == y && self.mode == mode;
                return Ok(untouched.then_some(carried));
            }
        }
    }
}
