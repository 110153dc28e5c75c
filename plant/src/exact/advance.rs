//! Solver `exact`: one interval with every change of mode located.
//!
//! An interval without a change costs one step with the table's matrices and one
//! look at the bound of [`super::levels`]. Everything else is walked through
//! ([`super::crossing`]) from change to change.

use fearless_simd::Simd;

use super::crossing::{Flow, Stop};
use super::held_table::HeldTable;
use super::levels::NOISE_ULPS;
use super::memory::Tables;
use super::piece::HeldPiece;
use super::system::{Column, DELTA, HELD, held_state};
use super::whole_step::sizes_of;
use crate::hybrid::guard::Guards;
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::amplifier::{Stage, StageMode};
use crate::model::axis::Drive;
use crate::model::joint::JointMode;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON_DOT, State, Vector};
use crate::numerics::seconds;
use crate::numerics::width::{One, Single, Width};
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
        if let Drive::Held(voltage_v) = drive {
            if self.has_voltage_of_command() {
                let w = Single(simd);
                if !self.keeps_mode(w, tables, (drive, *voltage_v), length_ns, watch) {
                    self.advance_held(tables, drive, *voltage_v, length_ns, watch)?;
                }
                return Ok(());
            }
            self.take_up(drive);
        }
        if !self.keeps_all_modes(simd, tables, drive, length_ns, watch) {
            self.advance_commanded(tables, drive, length_ns, watch)?;
        }
        Ok(())
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
        w: impl Width<Vector = f64>,
        tables: &mut Tables,
        (drive, voltage_v): (&Drive<'_>, f64),
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> bool {
        if self.fresh.is_some() || self.axis.releases() || self.mode.guide == GuideMode::Stuck {
            return false;
        }
        let table = tables.held(&self.axis, &self.mode, length_ns);
        let offset_rad = self.axis.offset_rad(&self.mode);
        let start = held_state(&self.y, offset_rad);
        let x = start.into();
        let [states, others] = table.step.sums(w, &x, voltage_v);
        let sizes = sizes_of(w, others, start[EPSILON_DOT]);
        let [beta, beta_dot, delta, epsilon_dot] = w.parts(states);
        let [beta_rate, current, epsilon_rate, current_rate] = w.parts(others);
        let end = Column::<HELD>::new(beta, beta_dot, delta, epsilon_dot, current);
        let deltas = [start[DELTA], delta];
        let speeds = [start[EPSILON_DOT], epsilon_dot];
        let [c, d] = table.step.inner_points(w, deltas, speeds);
        let strays = || table.step.gap_strays(w, sizes);
        let joint_keeps = self.joint_keeps([deltas[0], c, d, deltas[1]], strays)
            && end.iter().all(|x| x.is_finite());
        let guide = self.mode.guide;
        let guide_keeps = guide == GuideMode::AsWritten || {
            let speed = |x: &Column<HELD>| guide.direction() * (x[BETA_DOT] - x[EPSILON_DOT]);
            speed(&start).min(speed(&end)) > table.step.guide_strays(w, sizes)
        };
        let current_keeps = |[_, limit_a]: [f64; 2]| {
            let largest = start[CURRENT].abs().max(end[CURRENT].abs());
            limit_a - largest > table.step.current_strays(w, sizes)
        };
        let stage_keeps = || self.axis.stage.limits().is_none_or(current_keeps);
        if !(joint_keeps && guide_keeps && stage_keeps()) {
            return false;
        }
        let [beta_dot, epsilon_dot] = [start[BETA_DOT], start[EPSILON_DOT]];
        let rate =
            Column::<HELD>::new(beta_dot, beta_rate, epsilon_dot, epsilon_rate, current_rate);
        let piece = self.piece_with(table, voltage_v, [start, rate]);
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
        self.piece_with(table, voltage_v, [start, rate.into()])
    }

    /// The same where the start is known with the rates there.
    #[inline(always)]
    fn piece_with<'t>(
        &self,
        table: &'t HeldTable,
        voltage_v: f64,
        [start, rate]: [Column<HELD>; 2],
    ) -> HeldPiece<'t> {
        let flow = Flow {
            table: &table.table,
            input: table.system.input(voltage_v),
            start,
            rate,
        };
        HeldPiece {
            table,
            flow,
            voltage_v,
            offset_rad: self.axis.offset_rad(&self.mode),
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
        tables.carried = None;
        let mut interval = Interval::new(seconds(self.time_ns), seconds(length_ns));
        let table = tables.held(&self.axis, &self.mode, length_ns);
        // A loaded flank has come away when it has fallen further than the rounding of the terms
        // that make up δ, and of b itself.
        let start = held_state(&self.y, self.axis.offset_rad(&self.mode));
        let terms = table.step.terms_of_delta(One, &start.into(), voltage_v);
        self.axis
            .set_parting_noise(NOISE_ULPS * terms, interval.length_s);
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
            let zero = piece.flow.first_zero(&linear, left_s, 1);
            let time_s = interval.now_s();
            let stop = zero.ok_or(PlantError::TooStiff { time_s })?;
            interval.count_work(stop.work, watch)?;
            let mut end = stop.x;
            if stop.guard.is_none() && interval.done_s == 0.0 {
                // The very step that the bound would have allowed.
                end = piece.whole_end();
            }
            let y = piece.plant_vector(&end);
            if self.move_over(drive, &mut interval, (&stop, &guards), y, &piece, watch)? {
                return Ok(());
            }
        }
    }

    /// Emits the span up to `stop`, moves there and switches at the guard that stopped the
    /// piece; `true` at the end of the interval.
    pub(super) fn move_over<const D: usize>(
        &mut self,
        drive: &Drive<'_>,
        interval: &mut Interval,
        (stop, guards): (&Stop<D>, &Guards),
        y: Vector,
        interior: &dyn Interior,
        watch: &mut impl Watch,
    ) -> Result<bool, PlantError> {
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
        interval.done_s += stop.time_s;
        let Some(guard) = stop.guard.and_then(|place| guards[place]) else {
            return Ok(true);
        };
        interval.count_event()?;
        self.switch(guard, drive, interval, watch);
        self.settle(drive, interval, watch)?;
        Ok(false)
    }
}
