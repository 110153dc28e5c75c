//! Solver `exact`: one interval with every change of mode located.
//!
//! An interval without a change costs one step with the table's matrices and one
//! look at the bound of [`super::levels`]. Everything else is walked through
//! ([`super::crossing`]) from change to change.

use super::crossing::{Flow, Stop};
use super::held_table::HeldTable;
use super::levels::NOISE_ULPS;
use super::loss::DRIVING;
use super::memory::{Carried, Tables};
use super::piece::{FeedbackPiece, HeldPiece, Piece};
use super::system::{
    Column, DELTA, HELD, feedback_state, held_state, plant_vector, to_plant_vector, with_command,
};
use crate::hybrid::guard::Guards;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::Drive;
use crate::model::joint::JointMode;
use crate::model::motion::{MotionPoint, OscillatorStep};
use crate::model::pid::ContinuousPid;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON_DOT, State, Vector};
use crate::numerics::seconds;
use crate::numerics::width::{One, Width};
use crate::observe::extremes::{CARRIAGE, Extremes};
use crate::observe::{Interior, Watch};

impl Automaton {
    /// Solver `exact` over `length_ns` from now.
    #[inline(always)]
    pub(crate) fn advance_exactly(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        if self.axis.resistance.quadratic_ns2_per_rad2 != 0.0 {
            return Err(PlantError::NotAffine);
        }
        match drive {
            _ if !self.has_voltage_of(drive) => {
                self.advance_staged(tables, drive, length_ns, watch)
            }
            Drive::Held(voltage_v) => {
                if !self.keeps_mode(tables, drive, *voltage_v, length_ns, watch) {
                    self.advance_held(tables, drive, *voltage_v, length_ns, watch)?;
                }
                Ok(())
            }
            Drive::Feedback(pid) => self.advance_feedback(tables, drive, pid, length_ns, watch),
        }
    }

    /// True if the motor has the voltage of the command, so that the tables of the paper's
    /// drive serve.
    #[inline(always)]
    fn has_voltage_of(&self, drive: &Drive<'_>) -> bool {
        match self.axis.stage {
            Stage::Voltage => true,
            Stage::LimitedVoltage { .. } => {
                self.mode.stage == StageMode::Follows && matches!(drive, Drive::Held(_))
            }
            Stage::IdealCurrent | Stage::CurrentLoop { .. } => false,
        }
    }

    /// Takes the whole interval in one step if the bound excludes a change.
    #[inline(always)]
    fn keeps_mode(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        voltage_v: f64,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> bool {
        if self.fresh.is_some() || self.axis.releases() || self.mode.guide == GuideMode::Stuck {
            return false;
        }
        let table = tables.held(&self.axis, &self.mode, length_ns);
        let offset_rad = self.axis.offset_rad(&self.mode);
        let start = held_state(&self.y, offset_rad);
        let sums = table.step.take(One, &start.into(), voltage_v);
        let (end, rates) = (Column::from(sums.end()), sums.rates(start[EPSILON_DOT]));
        let sizes = rates.map(f64::abs);
        let deltas = [start[DELTA], end[DELTA]];
        let speeds = [start[EPSILON_DOT], end[EPSILON_DOT]];
        let [c, d] = table.step.inner_points(One, deltas, speeds);
        let strays = || table.step.gap_strays(One, &sizes);
        let joint_keeps = self.joint_keeps([deltas[0], c, d, deltas[1]], strays)
            && end.iter().all(|x| x.is_finite());
        let slides = |s: f64| {
            let speed = |x: &Column<HELD>| s * (x[BETA_DOT] - x[EPSILON_DOT]);
            speed(&start).min(speed(&end)) > table.step.guide_strays(One, &sizes)
        };
        let guide_keeps = match self.mode.guide {
            GuideMode::AsWritten => true,
            GuideMode::Forward => slides(1.0),
            GuideMode::Backward => slides(-1.0),
            GuideMode::Stuck => false,
        };
        let current_keeps = || match self.axis.stage.limits() {
            Some([_, limit_a]) => {
                let largest = start[CURRENT].abs().max(end[CURRENT].abs());
                limit_a - largest > table.step.current_strays(One, &sizes)
            }
            None => true,
        };
        if !(joint_keeps && guide_keeps && current_keeps()) {
            return false;
        }
        let y = to_plant_vector(&end, offset_rad, self.y[BETA_INTEGRAL]);
        let piece = self.piece_with(table, voltage_v, &rates);
        let times_s = (seconds(self.time_ns), seconds(length_ns));
        self.move_along(drive, times_s, y, &piece, watch);
        true
    }

    /// True if the joint keeps its mode over a step over which δ strays from the range of
    /// these points by at most `strays`.
    #[inline(always)]
    fn joint_keeps<const N: usize>(&self, points: [f64; N], strays: impl FnOnce() -> f64) -> bool {
        let lowest = match self.mode.joint {
            JointMode::Rigid | JointMode::Gapless => return true,
            JointMode::Open => {
                let sizes = points.map(f64::abs);
                let largest = sizes.into_iter().fold(0.0, |m, size| One.max(size, m));
                self.axis.backlash_half_rad() - largest
            }
            JointMode::Loaded(flank) => {
                let values = points.map(|point| flank.sign() * point);
                (values.into_iter()).fold(f64::INFINITY, |m, value| One.min(value, m))
            }
            JointMode::Released(_) => return false,
        };
        lowest > strays()
    }

    /// The solution from here on under a held voltage.
    #[inline(always)]
    fn piece<'t>(&self, table: &'t HeldTable, voltage_v: f64) -> HeldPiece<'t> {
        let start = held_state(&self.y, self.axis.offset_rad(&self.mode));
        let [_, rates @ ..] = table.step.rates(One, &start.into(), voltage_v);
        self.piece_with(table, voltage_v, &rates)
    }

    /// The same where the rates of β̇, δ, ε̇ and I are known.
    #[inline(always)]
    fn piece_with<'t>(
        &self,
        table: &'t HeldTable,
        voltage_v: f64,
        [a, b, c, d]: &[f64; DRIVING],
    ) -> HeldPiece<'t> {
        let offset_rad = self.axis.offset_rad(&self.mode);
        let start = held_state(&self.y, offset_rad);
        HeldPiece {
            table,
            input: table.system.input(voltage_v),
            rate: Column::<HELD>::new(start[BETA_DOT], *a, *b, *c, *d),
            start,
            offset_rad,
            beta_integral_rads: self.y[BETA_INTEGRAL],
        }
    }

    /// Searches the step that the bound allows for the extremes of
    /// [`Extremes::peaks`] whose bits are set in `which`, and for when the
    /// carriage is last further than `band_m` from the travel.
    pub(crate) fn look_at_step(
        &self,
        tables: &mut Tables,
        (voltage_v, length_ns): (f64, u64),
        sought: (u8, f64),
        extremes: &mut Extremes,
    ) {
        let table = tables.held(&self.axis, &self.mode, length_ns);
        let solution = self.piece(table, voltage_v);
        let end = solution.whole_end(voltage_v);
        let times_s = (seconds(self.time_ns), seconds(length_ns));
        self.look((&solution, voltage_v), times_s, &end, sought, extremes);
    }

    /// The same for a piece of the step, which ends in `end`.
    pub(crate) fn look_at_piece(
        &self,
        tables: &mut Tables,
        (voltage_v, length_ns): (f64, u64),
        times_s: (f64, f64),
        (end, which): (&State, u8),
        extremes: &mut Extremes,
    ) {
        let table = tables.held(&self.axis, &self.mode, length_ns);
        let solution = self.piece(table, voltage_v);
        let sought = (which, f64::INFINITY);
        let end = end.to_vector();
        self.look((&solution, voltage_v), times_s, &end, sought, extremes);
    }

    fn look(
        &self,
        (solution, voltage_v): (&HeldPiece<'_>, f64),
        (start_s, length_s): (f64, f64),
        end: &Vector,
        (which, band_m): (u8, f64),
        extremes: &mut Extremes,
    ) {
        let motion = &extremes.settings.motion;
        let mut commands = [MotionPoint::default(); 2];
        if which >> CARRIAGE & 0b11 != 0 {
            commands = [motion.at(start_s), motion.at(start_s + length_s)];
        }
        let (ends, times_s) = ([&self.y, end], (start_s, length_s));
        let command = (motion, commands);
        let piece = Piece::new(&self.axis, &self.mode, ends, command, times_s, voltage_v);
        let sights = solution.sights(&self.axis, piece);
        let seen = sights.look_at(which, band_m, extremes);
        extremes.take(&seen);
    }

    /// The interval under a held voltage from change to change.
    #[cold]
    #[inline(never)]
    fn advance_held(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        voltage_v: f64,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let mut interval = Interval::new(seconds(self.time_ns), seconds(length_ns));
        let table = tables.held(&self.axis, &self.mode, length_ns);
        self.set_parting_noise(table, voltage_v);
        self.settle(drive, &interval, watch)?;
        loop {
            if !self.has_voltage_of(drive) {
                let ends = (length_ns, interval.length_s);
                return self.advance_staged_to(tables, drive, ends, &mut interval, watch);
            }
            let (mode, offset_rad) = (self.mode, self.axis.offset_rad(&self.mode));
            let table = tables.held(&self.axis, &mode, length_ns);
            let piece = self.piece(table, voltage_v);
            let left_s = interval.length_s - interval.done_s;
            let guards = self.guards(drive);
            let linear = guards.map(|g| Some(self.linear_guard(g?, &table.table, 0.0)));
            let zero = piece.flow().first_zero(&linear, left_s, 1);
            let time_s = interval.now_s();
            let stop = zero.map_err(|_| PlantError::TooStiff { time_s })?;
            interval.count_work(stop.work, watch)?;
            let mut end = stop.x;
            if stop.guard.is_none() && interval.done_s == 0.0 {
                // The very step that the bound would have allowed.
                end = table
                    .step
                    .take(One, &piece.start.into(), voltage_v)
                    .end()
                    .into();
            }
            let y = to_plant_vector(&end, offset_rad, piece.beta_integral_rads);
            self.move_over(drive, &interval, &stop, y, &piece, watch)?;
            if self.end_of_piece(&mut interval, &stop, &guards, drive, watch)? {
                return Ok(());
            }
        }
    }

    /// Emits the span up to `stop` and moves there.
    pub(super) fn move_over<const D: usize>(
        &mut self,
        drive: &Drive<'_>,
        interval: &Interval,
        stop: &Stop<D>,
        y: Vector,
        interior: &dyn Interior,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let time_s = interval.now_s();
        if !y.iter().all(|v| v.is_finite()) {
            return Err(PlantError::NonFinite { time_s });
        }
        if stop.time_s > 0.0 {
            self.move_along(drive, (time_s, stop.time_s), y, interior, watch);
            self.fresh = None;
        }
        self.y = y;
        if self.mode.guide == GuideMode::Stuck {
            // γ̇ = 0 to the last bit.
            match self.axis.joint {
                Some(_) => self.y[EPSILON_DOT] = self.y[BETA_DOT],
                None => self.y[BETA_DOT] = 0.0,
            }
        }
        Ok(())
    }

    /// Switches at the guard that stopped the piece; `true` at the end of the
    /// interval.
    pub(super) fn end_of_piece<const D: usize>(
        &mut self,
        interval: &mut Interval,
        stop: &Stop<D>,
        guards: &Guards,
        drive: &Drive<'_>,
        watch: &mut impl Watch,
    ) -> Result<bool, PlantError> {
        interval.done_s += stop.time_s;
        match stop.guard.and_then(|place| guards[place]) {
            None => Ok(true),
            Some(guard) => {
                interval.count_event()?;
                self.switch(guard, drive, interval, watch);
                self.settle(drive, interval, watch)?;
                Ok(false)
            }
        }
    }

    /// Sets how far a loaded flank must fall to have come away: above the
    /// rounding of the terms that make up δ, and of b itself.
    fn set_parting_noise(&mut self, table: &HeldTable, voltage_v: f64) {
        let x = held_state(&self.y, self.axis.offset_rad(&self.mode));
        let terms = table.step.terms_of_delta(One, &x.into(), voltage_v);
        let length_s = table.length_s();
        self.axis.set_parting_noise(NOISE_ULPS * terms, length_s);
    }
}

/// The continuous law (eq. 27-37): the command is part of the state, so that an
/// interval without a change is one product with a matrix.
impl Automaton {
    /// One interval under the continuous law.
    fn advance_feedback(
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
        let breaks_s = pid.motion().breaks_from(start_s).iter();
        let inside_s = breaks_s.map(|t| t - start_s).take_while(|&t| t < length_s);
        let mut last = None;
        for end_s in inside_s.chain([length_s]) {
            if end_s > interval.done_s || end_s == length_s {
                last = self.advance_to(
                    tables,
                    (drive, pid),
                    (length_ns, end_s),
                    &mut interval,
                    watch,
                )?;
            }
        }
        if let Some(carried) = last {
            tables.carried = Some(Box::new(carried));
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
        let same = carried.length_ns == length_ns && start_s + length_s <= carried.until_s;
        let Some(table) = feedback.get(carried.place) else {
            return false;
        };
        if !simple || !same || !carried.is_at(self, pid) {
            return false;
        }
        let start = carried.x;
        let command = carried.command.after(&table.command);
        let end = with_command(&table.step(&start), &command);
        // What is not finite strays for ever, or to what is not a number.
        let [strays_rad, strays_v] = table.guards.times(&(end - start).abs());
        let joint_keeps = self.joint_keeps([start[DELTA], end[DELTA]], || strays_rad);
        let demands_v = [carried.demand_v, table.demand_v(&end)];
        let [v0, v1] = demands_v;
        let limit_v = pid.limit();
        let inside_v = match self.mode.amplifier {
            AmplifierMode::Linear => limit_v - v0.abs().max(v1.abs()),
            AmplifierMode::AtUpper => v0.min(v1) - limit_v,
            AmplifierMode::AtLower => (-v0).min(-v1) - limit_v,
        };
        if !(joint_keeps && inside_v > strays_v) {
            return false;
        }
        let offset_rad = self.axis.offset_rad(&self.mode);
        let y = plant_vector(&end, (offset_rad, table.rad_per_m), &command.point);
        let piece = FeedbackPiece {
            table,
            motion: pid.motion(),
            x: [start, end],
            demands_v,
            offset_rad,
        };
        self.move_along(drive, (start_s, length_s), y, &piece, watch);
        carried.time_ns += length_ns;
        (carried.x, carried.y, carried.command, carried.demand_v) = (end, y, command, v1);
        true
    }

    /// From change to change up to `end_s` after the interval's start, within
    /// one interval of the command. Returns where to go on from.
    fn advance_to(
        &mut self,
        tables: &mut Tables,
        (drive, pid): (&Drive<'_>, &ContinuousPid),
        (length_ns, end_s): (u64, f64),
        interval: &mut Interval,
        watch: &mut impl Watch,
    ) -> Result<Option<Carried>, PlantError> {
        self.settle(drive, interval, watch)?;
        loop {
            let (mode, offset_rad) = (self.mode, self.axis.offset_rad(&self.mode));
            let motion = pid.motion();
            let command = motion.oscillator(interval.now_s());
            let coupling = command.coupling;
            let place = tables.feedback(&self.axis, &mode, pid, coupling, length_ns);
            let table = &tables.feedback[place];
            let counted = (offset_rad, table.rad_per_m);
            let start = feedback_state(&self.y, counted, &command);
            let noise_rad = table.rounding_of_delta(&start);
            self.axis.set_parting_noise(noise_rad, seconds(length_ns));
            let (guards, limit_v) = (self.guards(drive), pid.limit());
            let linear = guards.map(|guard| Some(self.linear_guard(guard?, &table.table, limit_v)));
            let left_s = end_s - interval.done_s;
            let zero = Flow::feedback(table, &start).first_zero(&linear, left_s, 0);
            let time_s = interval.now_s();
            let stop = zero.map_err(|_| PlantError::TooStiff { time_s })?;
            interval.count_work(stop.work, watch)?;
            let command = command.after(&OscillatorStep::new(coupling, stop.time_s));
            let piece = FeedbackPiece {
                table,
                motion,
                x: [start, stop.x],
                demands_v: [table.demand_v(&start), table.demand_v(&stop.x)],
                offset_rad,
            };
            let y = plant_vector(&stop.x, counted, &command.point);
            self.move_over(drive, interval, &stop, y, &piece, watch)?;
            let demand_v = piece.demands_v[1];
            if self.end_of_piece(interval, &stop, &guards, drive, watch)? {
                let time_ns = self.time_ns + length_ns;
                let end_s = seconds(time_ns);
                let later = motion.breaks_from(end_s).first();
                let carried = Carried {
                    pid: pid.clone(),
                    mode,
                    time_ns,
                    length_ns,
                    y,
                    x: stop.x,
                    command,
                    demand_v,
                    place,
                    until_s: later.copied().unwrap_or(f64::INFINITY),
                };
                let untouched = self.y == y && self.mode == mode;
                return Ok(untouched.then_some(carried));
            }
        }
    }
}
