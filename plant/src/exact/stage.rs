//! Drives beyond the paper's: a current drive, and a limit of the current.
//!
//! In each mode of the amplifier the armature is affine too ([`super::stage_table`]), so that
//! all of [`super`] serves it. The state is that under the continuous law with the current
//! loop's memory q behind it; under a held command nothing is counted from a motion, and
//! the command enters as an input.

use super::crossing::{Flow, LinearGuard};
use super::memory::Tables;
use super::peak::Sought;
use super::piece::{Piece, Sights, raise_quantity};
use super::power::{raise_product, stays_below_over_step};
use super::stage_table::{LOOP, STAGE, StageTable, wide};
use super::system::{Column, FEEDBACK, feedback_state, plant_vector};
use super::table::Quantity;
use crate::hybrid::guard::Guard;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::axis::Drive;
use crate::model::motion::{Motion, MotionPoint, Oscillator, OscillatorStep};
use crate::model::pid::ContinuousPid;
use crate::model::state::{CURRENT, CURRENT_INTEGRAL, Vector};
use crate::numerics::seconds;
use crate::observe::extremes::{Extremes, POWER};
use crate::observe::{Interior, Span, Watch};

/// A smooth piece of the solution.
#[derive(Debug, Clone, Copy)]
struct StagePiece<'a> {
    table: &'a StageTable,
    flow: Flow<'a, STAGE>,
    end: &'a Column<STAGE>,
    /// The motion that the state is counted from.
    motion: Option<&'a Motion>,
    held: f64,
    counted: (f64, f64),
}

impl StagePiece<'_> {
    /// Raises the peaks of voltage and power to the suprema of their magnitudes.
    fn raise_voltage_and_power(
        &self,
        length_s: f64,
        (peak_v, peak_w): (&mut f64, &mut f64),
        work: &mut u64,
    ) {
        let voltage = self.table.table.quantity(Quantity::Voltage);
        let offset_v = self.table.voltage.offset(self.held);
        let ends = [self.flow.start, self.end];
        let ends_v = ends.map(|x| voltage.value(x) + offset_v);
        *peak_v = peak_v.max(ends_v[0].abs()).max(ends_v[1].abs());
        raise_quantity(
            &self.flow,
            (voltage, offset_v),
            ends_v,
            length_s,
            peak_v,
            work,
        );
        let voltage = Sought {
            offset: offset_v,
            ..Sought::plain(voltage)
        };
        let currents_a = ends.map(|x| x[CURRENT]);
        for (voltage_v, current_a) in ends_v.into_iter().zip(currents_a) {
            *peak_w = peak_w.max((voltage_v * current_a).abs());
        }
        let current = Sought::plain(self.table.table.quantity(Quantity::Current));
        let quantities = [voltage, current];
        let known = [ends_v, currents_a];
        if !stays_below_over_step(&self.flow, (&quantities, known), length_s, *peak_w) {
            raise_product(&self.flow, &quantities, length_s, peak_w, work);
        }
    }
}

impl Interior for StagePiece<'_> {
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector {
        let time_s = theta * span.length_s;
        let now_s = span.start_s + time_s;
        let point = self.motion.map_or(MotionPoint::default(), |m| m.at(now_s));
        to_plant(&self.flow.at(time_s), self.counted, &point)
    }

    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes) {
        let mut work = 0;
        let peaks = (
            &mut extremes.peak_abs_voltage_v,
            &mut extremes.peak_abs_power_w,
        );
        self.raise_voltage_and_power(span.length_s, peaks, &mut work);
        extremes.work += work;
        // What is known of the power is all.
        let (piece, command) = Piece::over(span, 0.0, extremes);
        let constants = (self.counted.0, self.table.screw_load);
        let counted = self.motion.is_some();
        let sights = Sights::new(span.axis, self.flow, constants, piece, counted);
        let band_m = extremes.settings.settling_band_m;
        let seen = sights.look_at(!(1 << POWER), band_m, extremes);
        extremes.take(&seen);
        extremes.command_at_end = Some((span.end_s(), command));
        let rates = self.flow.rate;
        let joint_j = match &self.table.loss {
            Some(loss) => loss.over(rates, span.length_s),
            None => 0.0,
        };
        let at_start = (self.flow.start, &rates);
        let [armature_j, guide_j] = self.table.heat_j(span.axis, at_start, span.length_s);
        extremes.add(span.balanced_energies(joint_j, armature_j, guide_j));
    }
}

/// The state from the plant's vector.
fn to_stage(y: &Vector, counted: (f64, f64), command: &Oscillator) -> Column<STAGE> {
    let mut x = wide(&feedback_state(y, counted, command));
    x[LOOP] = y[CURRENT_INTEGRAL];
    x
}

/// The plant's vector from that.
fn to_plant(x: &Column<STAGE>, counted: (f64, f64), point: &MotionPoint) -> Vector {
    let own = x.fixed_rows::<FEEDBACK>(0).into_owned();
    let mut y = plant_vector(&own, counted, point);
    y[CURRENT_INTEGRAL] = x[LOOP];
    y
}

impl Automaton {
    /// One interval with a drive beyond the paper's.
    #[cold]
    #[inline(never)]
    pub(super) fn advance_staged(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        self.take_up(drive);
        let length_s = seconds(length_ns);
        let mut interval = Interval::new(seconds(self.time_ns), length_s);
        if let Drive::Feedback(pid) = drive {
            let breaks_s = pid.motion().breaks_from(interval.start_s).iter();
            let start_s = interval.start_s;
            for end_s in breaks_s.map(|t| t - start_s).take_while(|&t| t < length_s) {
                if end_s > interval.done_s {
                    let ends = (length_ns, end_s);
                    self.advance_staged_to(tables, drive, ends, &mut interval, watch)?;
                }
            }
        }
        self.advance_staged_to(tables, drive, (length_ns, length_s), &mut interval, watch)
    }

    /// From change to change up to `end_s` after the interval's start, within one interval
    /// of the command.
    #[inline(never)]
    pub(super) fn advance_staged_to(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        (length_ns, end_s): (u64, f64),
        interval: &mut Interval,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        self.settle(drive, interval, watch)?;
        loop {
            let mode = self.mode;
            let counted = (self.axis.offset_rad(&mode), 1.0 / self.axis.pitch_m_per_rad);
            let (pid, held, command) = match drive {
                Drive::Held(held) => (None, *held, Oscillator::default()),
                Drive::Feedback(pid) => {
                    let command = pid.motion().oscillator(interval.now_s());
                    (Some(*pid), 0.0, command)
                }
            };
            let coupling = pid.map(|_| command.coupling);
            let place = tables.stage(&self.axis, &mode, (pid, coupling), length_ns);
            let table = &tables.stages[place];
            let start = to_stage(&self.y, counted, &command);
            let input = table.input + table.input_per_command * held;
            let noise_rad = table.rounding_of_delta(&start);
            self.axis.set_parting_noise(noise_rad, seconds(length_ns));
            let guards = self.guards(drive);
            let limit = pid.map_or(0.0, ContinuousPid::limit);
            let linear = guards.map(|guard| Some(self.staged_guard(guard?, table, held, limit)));
            let flow = Flow::new(&table.table, &input, &start);
            let zero = flow.first_zero(&linear, end_s - interval.done_s, 0);
            let time_s = interval.now_s();
            let stop = zero.map_err(|_| PlantError::TooStiff { time_s })?;
            interval.count_work(stop.work, watch)?;
            let point = match pid {
                None => MotionPoint::default(),
                Some(_) => {
                    let step = OscillatorStep::new(command.coupling, stop.time_s);
                    command.after(&step).point
                }
            };
            let piece = StagePiece {
                table,
                flow,
                end: &stop.x,
                motion: pid.map(ContinuousPid::motion),
                held,
                counted,
            };
            let y = to_plant(&stop.x, counted, &point);
            self.move_over(drive, interval, &stop, y, &piece, watch)?;
            if self.end_of_piece(interval, &stop, &guards, drive, watch)? {
                return Ok(());
            }
        }
    }

    /// A guard as a linear function of the table's state.
    fn staged_guard<'t>(
        &self,
        guard: Guard,
        table: &'t StageTable,
        held: f64,
        limit: f64,
    ) -> LinearGuard<'t, STAGE> {
        let (limit_v, limit_a, _) = self.axis.stage.numbers();
        let beyond = table.beyond.offset(held);
        let (quantity, sign, offset) = match guard {
            Guard::Saturate(d) => (Quantity::Beyond, -d.sign(), limit_v - d.sign() * beyond),
            Guard::Desaturate(d) => (Quantity::Beyond, d.sign(), d.sign() * beyond - limit_v),
            Guard::LetGo(d) => (Quantity::Beyond, d.sign(), d.sign() * beyond),
            Guard::Return(d) => (Quantity::Current, d.sign(), -limit_a),
            Guard::Overrun(d) => {
                let holding_v = d.sign() * table.voltage.offset(held);
                (Quantity::Voltage, d.sign(), limit_v + holding_v)
            }
            _ => return self.linear_guard(guard, &table.table, limit),
        };
        LinearGuard {
            linear: table.table.quantity(quantity),
            sign,
            offset,
            noise: 0.0,
            fresh: self.fresh == Some(guard),
        }
    }
}
