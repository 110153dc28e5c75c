//! Solver `exact` under the continuous law (paper, eq. 27-37): the command is
//! part of the state, so that an interval without a change is one product with
//! a matrix.

use super::advance::NOISE_ULPS;
use super::system::{Column, DELTA, FEEDBACK, feedback_state, plant_vector};
use super::tables::{FeedbackTable, Quantity, Tables};
use super::walk::{BOUND_MARGIN, Flow};
use crate::error::PlantError;
use crate::hybrid::mode::AmplifierMode;
use crate::model::axis::Drive;
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::Vector;
use crate::observe::span::{Interior, Span, Watch};
use crate::plant::{Plant, seconds};
use crate::stepped::adaptive::Interval;

/// A smooth piece of the solution under the continuous law.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FeedbackPiece<'a> {
    pub(crate) table: &'a FeedbackTable,
    pub(crate) start: Column<FEEDBACK>,
    pub(crate) end: Column<FEEDBACK>,
    pub(crate) offset_rad: f64,
    pub(crate) pitch_m_per_rad: f64,
}

impl FeedbackPiece<'_> {
    /// The plant's own vector.
    pub(crate) fn plant_vector(&self, x: &Column<FEEDBACK>) -> Vector {
        plant_vector(x, (self.offset_rad, self.pitch_m_per_rad))
    }

    pub(crate) fn flow(&self) -> Flow<'_, FEEDBACK> {
        Flow {
            table: &self.table.table,
            input: &self.table.input,
            start: &self.start,
        }
    }
}

/// The whole state at the end of the last interval, to go on from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Carried {
    pid: ContinuousPid,
    time_ns: u64,
    length_ns: u64,
    /// The plant's own vector, which must not have been touched.
    y: Vector,
    x: Column<FEEDBACK>,
    /// Place of the table.
    place: usize,
    /// Until when the command keeps to its interval \[s\].
    until_s: f64,
}

impl Plant {
    /// One interval under the continuous law.
    pub(super) fn advance_feedback(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        pid: &ContinuousPid,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        if self.carries_on(tables, drive, pid, length_ns, watch) {
            return Ok(());
        }
        tables.carried = None;
        let (start_s, length_s) = (seconds(self.time_ns), seconds(length_ns));
        let mut interval = Interval::new(start_s, length_s);
        let breaks_s = pid.motion().breaks_s();
        let mut last = None;
        for end_s in breaks_s.map(|t| t - start_s).into_iter().chain([length_s]) {
            let inside = end_s > interval.done_s() && end_s < length_s;
            if inside || end_s == length_s {
                last = self.advance_to(
                    tables,
                    (drive, pid),
                    (length_ns, end_s),
                    &mut interval,
                    watch,
                )?;
            }
        }
        if let Some((x, place)) = last {
            let end_s = seconds(self.time_ns + length_ns);
            let later = breaks_s.into_iter().filter(|&t| t >= end_s);
            tables.carried = Some(Box::new(Carried {
                pid: *pid,
                time_ns: self.time_ns + length_ns,
                length_ns,
                y: self.y,
                x,
                place,
                until_s: later.fold(f64::INFINITY, f64::min),
            }));
        }
        Ok(())
    }

    /// Takes the whole interval in one step from where the last one ended, if
    /// the bounds exclude a change.
    fn carries_on(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        pid: &ContinuousPid,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> bool {
        let Tables {
            carried, feedback, ..
        } = tables;
        let Some(carried) = carried else { return false };
        let simple = self.fresh.is_none()
            && !self.axis.releases()
            && self.mode.guide == GuideMode::AsWritten;
        let (start_s, length_s) = (seconds(self.time_ns), seconds(length_ns));
        let same = carried.time_ns == self.time_ns
            && carried.length_ns == length_ns
            && carried.y == self.y
            && start_s + length_s <= carried.until_s
            && carried.pid.is_same_law(pid);
        let Some(table) = feedback.get(carried.place) else {
            return false;
        };
        if !simple || !same || !table.is_of(&self.mode) {
            return false;
        }
        let start = carried.x;
        let end = start + (table.growth * start + table.drift);
        let change = (end - start).abs();
        let stray = |quantity: Quantity| {
            let bound = &table.table.quantity(quantity).bounds.per_change;
            BOUND_MARGIN * bound.dot(&change)
        };
        let strays = || stray(Quantity::Delta);
        let joint_keeps =
            self.joint_keeps(start[DELTA], end[DELTA], strays) && end.iter().all(|x| x.is_finite());
        let demand = &table.table.quantity(Quantity::Demand);
        let (v0, v1) = (demand.value(&start), demand.value(&end));
        let limit_v = pid.voltage_limit_v();
        let inside_v = match self.mode.amplifier {
            AmplifierMode::Linear => limit_v - v0.abs().max(v1.abs()),
            AmplifierMode::AtUpper => v0.min(v1) - limit_v,
            AmplifierMode::AtLower => (-v0).min(-v1) - limit_v,
        };
        if !(joint_keeps && inside_v > stray(Quantity::Demand)) {
            return false;
        }
        let piece = FeedbackPiece {
            table,
            start,
            end,
            offset_rad: self.axis.offset_rad(&self.mode),
            pitch_m_per_rad: self.axis.pitch_m_per_rad(),
        };
        let y = piece.plant_vector(&end);
        watch.span(&Span {
            axis: &self.axis,
            drive,
            modes: (self.mode, self.mode),
            start_s,
            length_s,
            y: (&self.y, &y),
            interior: Interior::Feedback(&piece),
        });
        self.y = y;
        carried.time_ns += length_ns;
        carried.x = end;
        carried.y = y;
        true
    }

    /// From change to change up to `end_s` after the interval's start, within
    /// one interval of the command. Returns the whole state at the end with the
    /// place of its table.
    fn advance_to(
        &mut self,
        tables: &mut Tables,
        (drive, pid): (&Drive<'_>, &ContinuousPid),
        (length_ns, end_s): (u64, f64),
        interval: &mut Interval,
        watch: &mut impl Watch,
    ) -> Result<Option<(Column<FEEDBACK>, usize)>, PlantError> {
        self.settle(drive, interval, watch)?;
        loop {
            let (mode, offset_rad) = (self.mode, self.axis.offset_rad(&self.mode));
            let command = pid.motion().oscillator(interval.now_s());
            let place = tables.feedback(&self.axis, &mode, pid, command.omega_radps, length_ns);
            let table = &tables.feedback[place];
            let pitch_m_per_rad = self.axis.pitch_m_per_rad();
            let start = feedback_state(&self.y, (offset_rad, pitch_m_per_rad), &command);
            let terms = table.growth.row(DELTA).transpose().component_mul(&start);
            let noise_rad = NOISE_ULPS * (start[DELTA].abs() + terms.abs().sum());
            self.axis.set_parting_noise(noise_rad, seconds(length_ns));
            let mut piece = FeedbackPiece {
                table,
                start,
                end: start,
                offset_rad,
                pitch_m_per_rad,
            };
            let (guards, limit_v) = (self.guards(drive), pid.voltage_limit_v());
            let linear = guards.map(|guard| Some(self.linear_guard(guard?, &table.table, limit_v)));
            let left_s = end_s - interval.done_s();
            let too_stiff = PlantError::TooStiff {
                time_s: interval.now_s(),
            };
            let zero = piece.flow().first_zero(&linear, left_s, 0);
            let stop = zero.map_err(|_| too_stiff)?;
            piece.end = stop.x;
            let y = piece.plant_vector(&stop.x);
            self.move_over(drive, interval, &stop, y, Interior::Feedback(&piece), watch)?;
            if self.end_of_piece(interval, &stop, &guards, drive, watch)? {
                let untouched = self.y == y && self.mode == mode;
                return Ok(untouched.then_some((stop.x, place)));
            }
        }
    }
}
