//! Solver `exact`: one interval with every change of mode located.
//!
//! An interval without a change costs one step with the table's matrices and one
//! look at the bound of [`super::levels`]. Everything else is walked through
//! ([`super::crossing`]) from change to change.

use fearless_simd::Simd;

use super::crossing::Stop;
use super::held_table::HeldTable;
use super::levels::NOISE_ULPS;
use super::memory::Tables;
use super::piece::HeldPiece;
use super::system::{Column, DELTA, HELD, held_state};
use crate::hybrid::guard::Guards;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::amplifier::{Stage, StageMode};
use crate::model::axis::Drive;
use crate::model::joint::JointMode;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON_DOT, State, Vector};
use crate::numerics::seconds;
use crate::numerics::width::{One, Width};
use crate::observe::extremes::Extremes;
use crate::observe::{Interior, Span, Watch};

impl Automaton {
    /// Solver `exact` over `length_ns` from now.
    #[inline(always)]
    pub(crate) fn advance_exactly(
        &mut self,
        simd: impl Simd,
        tables: &mut Tables,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        if self.axis.resistance.quadratic_ns2_per_rad2 != 0.0 {
            return Err(PlantError::NotAffine);
        }
        match drive {
            Drive::Held(voltage_v) if self.has_voltage_of_command() => {
                if !self.keeps_mode(tables, drive, *voltage_v, length_ns, watch) {
                    self.advance_held(tables, drive, *voltage_v, length_ns, watch)?;
                }
                Ok(())
            }
            _ => self.advance_commanded(simd, tables, drive, length_ns, watch),
        }
    }

    /// True if the motor has the voltage of the command.
    #[inline(always)]
    fn has_voltage_of_command(&self) -> bool {
        match self.axis.stage {
            Stage::Voltage => true,
            Stage::LimitedVoltage { .. } => self.mode.stage == StageMode::Follows,
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
        let [a, b, c, d] = rates;
        let rate = Column::<HELD>::new(start[BETA_DOT], a, b, c, d);
        let piece = self.piece_with(table, voltage_v, rate);
        let y = piece.plant_vector(&end);
        let times_s = (seconds(self.time_ns), seconds(length_ns));
        self.move_along(drive, times_s, y, &piece, watch);
        true
    }

    /// True if the joint keeps its mode over a step over which δ strays from the range of
    /// these points by at most `strays`.
    #[inline(always)]
    pub(super) fn joint_keeps<const N: usize>(
        &self,
        points: [f64; N],
        strays: impl FnOnce() -> f64,
    ) -> bool {
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
        let rate = table.step.rates(One, &start.into(), voltage_v);
        self.piece_with(table, voltage_v, rate.into())
    }

    /// The same where the rates are known.
    #[inline(always)]
    fn piece_with<'t>(
        &self,
        table: &'t HeldTable,
        voltage_v: f64,
        rate: Column<HELD>,
    ) -> HeldPiece<'t> {
        let offset_rad = self.axis.offset_rad(&self.mode);
        HeldPiece {
            table,
            voltage_v,
            input: table.system.input(voltage_v),
            start: held_state(&self.y, offset_rad),
            rate,
            offset_rad,
            beta_integral_rads: self.y[BETA_INTEGRAL],
        }
    }

    /// Searches the step that the bound allows, or a piece of it with its times and its end,
    /// for the extremes of [`Extremes::peaks`] whose bits are set in `which`, and for when the
    /// carriage is last further than `band_m` from the travel.
    pub(crate) fn look_at(
        &self,
        tables: &mut Tables,
        (voltage_v, length_ns): (f64, u64),
        piece: Option<((f64, f64), &State)>,
        (which, band_m): (u8, f64),
        extremes: &mut Extremes,
    ) {
        let table = tables.held(&self.axis, &self.mode, length_ns);
        let solution = self.piece(table, voltage_v);
        let ((start_s, length_s), end) = match piece {
            Some((times_s, end)) => (times_s, end.to_vector()),
            None => (
                (seconds(self.time_ns), seconds(length_ns)),
                solution.plant_vector(&solution.whole_end()),
            ),
        };
        let span = Span {
            axis: &self.axis,
            drive: &Drive::Held(voltage_v),
            modes: (self.mode, self.mode),
            start_s,
            length_s,
            y: (&self.y, &end),
            interior: &solution,
        };
        solution.look(&span, (which, band_m), extremes);
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
            if !self.has_voltage_of_command() {
                let ends = (length_ns, interval.length_s);
                self.advance_commanded_to(tables, drive, ends, &mut interval, watch)?;
                return Ok(());
            }
            let table = tables.held(&self.axis, &self.mode, length_ns);
            let piece = self.piece(table, voltage_v);
            let left_s = interval.length_s - interval.done_s;
            let guards = self.guards(drive);
            let linear = guards.map(|g| Some(self.linear_guard(g?, &table.table, 0.0, [0.0; 2])));
            let zero = piece.flow().first_zero(&linear, left_s, 1);
            let time_s = interval.now_s();
            let stop = zero.map_err(|_| PlantError::TooStiff { time_s })?;
            interval.count_work(stop.work, watch)?;
            let mut end = stop.x;
            if stop.guard.is_none() && interval.done_s == 0.0 {
                // The very step that the bound would have allowed.
                end = piece.whole_end();
            }
            let y = piece.plant_vector(&end);
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
