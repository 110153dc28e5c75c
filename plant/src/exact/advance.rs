//! Solver `exact`: one interval with every change of mode located.
//!
//! Under a held voltage an interval without a change costs one step with the
//! table's kernel and one look at the bound of [`super::levels`]. Everything
//! else is walked through ([`super::crossing`]) from change to change.

use super::crossing::{LinearGuard, Stop};
use super::figures::{CARRIAGE, Piece};
use super::system::{Column, DELTA, HELD, held_state, to_plant_vector};
use super::tables::{HeldTable, Quantity, Table, Tables};
use super::walk::{BOUND_MARGIN, Flow};
use crate::error::PlantError;
use crate::hybrid::guard::speed_noise;
use crate::hybrid::mode::{Direction, Guard, Guards};
use crate::model::axis::Drive;
use crate::model::joint::{Flank, JointMode};
use crate::model::motion::MotionPoint;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA_DOT, BETA_INTEGRAL, EPSILON_DOT, State, Vector};
use crate::observe::extremes::Extremes;
use crate::observe::span::{Interior, Span, Watch};
use crate::plant::{Plant, seconds};
use crate::stepped::adaptive::Interval;

/// Units in the last place of the terms of δ that its rounding may reach.
pub(crate) const NOISE_ULPS: f64 = 4.0 * f64::EPSILON;

/// A smooth piece of the solution under a held voltage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldPiece<'a> {
    pub(crate) table: &'a HeldTable,
    pub(crate) input: Column<HELD>,
    pub(crate) start: Column<HELD>,
    pub(crate) offset_rad: f64,
    /// β̂, which a held voltage does not advance.
    pub(crate) beta_integral_rads: f64,
}

impl HeldPiece<'_> {
    /// Where the whole step ends.
    fn whole_end(&self, voltage_v: f64) -> Vector {
        let end = self.table.kernel.step(&self.start, voltage_v);
        to_plant_vector(&end, self.offset_rad, self.beta_integral_rads)
    }

    pub(crate) fn flow(&self) -> Flow<'_, HELD> {
        Flow {
            table: &self.table.table,
            input: &self.input,
            start: &self.start,
        }
    }
}

impl Plant {
    /// Solver `exact` over `length_ns` from now.
    #[inline(always)]
    pub(crate) fn advance_exactly(
        &mut self,
        tables: &mut Tables,
        drive: &Drive<'_>,
        length_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        if !self.axis.is_affine() {
            return Err(PlantError::NotAffine);
        }
        match drive {
            Drive::Held(voltage_v) => {
                if !self.keeps_mode(tables, drive, *voltage_v, length_ns, watch) {
                    self.advance_held(tables, drive, *voltage_v, length_ns, watch)?;
                }
                Ok(())
            }
            Drive::Feedback(pid) => self.advance_feedback(tables, drive, pid, length_ns, watch),
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
        let place = tables.held(&self.axis, &self.mode, length_ns);
        let table = &tables.held[place];
        let offset_rad = self.axis.offset_rad(&self.mode);
        let start = held_state(&self.y, offset_rad);
        let end = table.kernel.step(&start, voltage_v);
        let strays = || table.kernel.gap_strays(&start, &end);
        let joint_keeps =
            self.joint_keeps(start[DELTA], end[DELTA], strays) && end.iter().all(|x| x.is_finite());
        let slides = |s: f64| {
            let speed = |x: &Column<HELD>| s * (x[BETA_DOT] - x[EPSILON_DOT]);
            let bound = &table.table.quantity(Quantity::ScrewSpeed).bounds.per_change;
            let stray = BOUND_MARGIN * bound.dot(&(end - start).abs());
            speed(&start).min(speed(&end)) > stray
        };
        let guide_keeps = match self.mode.guide {
            GuideMode::AsWritten => true,
            GuideMode::Forward => slides(1.0),
            GuideMode::Backward => slides(-1.0),
            GuideMode::Stuck => false,
        };
        if !(joint_keeps && guide_keeps) {
            return false;
        }
        let y = to_plant_vector(&end, offset_rad, self.y[BETA_INTEGRAL]);
        let piece = self.piece(table, voltage_v);
        watch.span(&Span {
            axis: &self.axis,
            drive,
            modes: (self.mode, self.mode),
            start_s: seconds(self.time_ns),
            length_s: seconds(length_ns),
            y: (&self.y, &y),
            interior: Interior::Held(&piece),
        });
        self.y = y;
        true
    }

    /// Whether the joint keeps its mode over a step from `start` to `end` of δ,
    /// which strays from its chord by at most `strays`.
    #[inline(always)]
    pub(super) fn joint_keeps(&self, start: f64, end: f64, strays: impl FnOnce() -> f64) -> bool {
        let lowest = match self.mode.joint {
            JointMode::Rigid | JointMode::Gapless => return true,
            JointMode::Open => self.axis.backlash_half_rad() - start.abs().max(end.abs()),
            JointMode::Loaded(flank) => (flank.sign() * start).min(flank.sign() * end),
            JointMode::Released(_) => return false,
        };
        lowest > strays()
    }

    /// The solution from here on under a held voltage.
    #[inline(always)]
    fn piece<'t>(&self, table: &'t HeldTable, voltage_v: f64) -> HeldPiece<'t> {
        let offset_rad = self.axis.offset_rad(&self.mode);
        HeldPiece {
            table,
            input: table.system.input(voltage_v),
            start: held_state(&self.y, offset_rad),
            offset_rad,
            beta_integral_rads: self.y[BETA_INTEGRAL],
        }
    }

    /// Searches the step that the bound allows for when the carriage is last
    /// outside the settling band.
    pub(crate) fn look_at_band(
        &self,
        tables: &mut Tables,
        (voltage_v, length_ns): (f64, u64),
        extremes: &mut Extremes,
    ) {
        let band_m = extremes.settling_band_m();
        let place = tables.held(&self.axis, &self.mode, length_ns);
        let solution = self.piece(&tables.held[place], voltage_v);
        let end = solution.whole_end(voltage_v);
        let times_s = (seconds(self.time_ns), seconds(length_ns));
        self.look(&solution, times_s, &end, (0, band_m), extremes);
    }

    /// Searches it for the extremes of [`Extremes::peaks`] whose bits are set.
    pub(crate) fn look_at_step(
        &self,
        tables: &mut Tables,
        (voltage_v, length_ns): (f64, u64),
        which: u8,
        extremes: &mut Extremes,
    ) {
        let place = tables.held(&self.axis, &self.mode, length_ns);
        let solution = self.piece(&tables.held[place], voltage_v);
        let end = solution.whole_end(voltage_v);
        let times_s = (seconds(self.time_ns), seconds(length_ns));
        self.look(&solution, times_s, &end, (which, f64::INFINITY), extremes);
    }

    /// What the joint's damper takes over a piece of the step \[J\].
    pub(crate) fn joint_loss_j(
        &self,
        tables: &mut Tables,
        (voltage_v, length_ns): (f64, u64),
        length_s: f64,
    ) -> f64 {
        let place = tables.held(&self.axis, &self.mode, length_ns);
        self.piece(&tables.held[place], voltage_v)
            .joint_loss_j(length_s)
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
        let place = tables.held(&self.axis, &self.mode, length_ns);
        let solution = self.piece(&tables.held[place], voltage_v);
        self.look(
            &solution,
            times_s,
            &end.to_vector(),
            (which, f64::INFINITY),
            extremes,
        );
    }

    fn look(
        &self,
        solution: &HeldPiece<'_>,
        (start_s, length_s): (f64, f64),
        end: &Vector,
        (which, band_m): (u8, f64),
        extremes: &mut Extremes,
    ) {
        let motion = extremes.motion();
        let mut commands = [MotionPoint::default(); 2];
        if which >> CARRIAGE != 0 {
            commands = [motion.at(start_s), motion.at(start_s + length_s)];
        }
        let (ends, times_s) = ([&self.y, end], (start_s, length_s));
        let piece = Piece::new(&self.axis, &self.mode, ends, (motion, commands), times_s);
        let sights = solution.sights(&self.axis, piece);
        let mut peaks = extremes.peaks();
        for (i, (peak, size)) in peaks.iter_mut().zip(sights.sizes()).enumerate() {
            if which >> i & 1 != 0 {
                *peak = peak.max(size);
            }
        }
        let seen = sights.look(peaks, which, band_m);
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
        let place = tables.held(&self.axis, &self.mode, length_ns);
        self.set_parting_noise(&tables.held[place], voltage_v);
        self.settle(drive, &interval, watch)?;
        loop {
            let (mode, offset_rad) = (self.mode, self.axis.offset_rad(&self.mode));
            let place = tables.held(&self.axis, &mode, length_ns);
            let table = &tables.held[place];
            let piece = self.piece(table, voltage_v);
            let left_s = interval.left_s();
            let guards = self.guards(drive);
            let linear = guards.map(|g| Some(self.linear_guard(g?, &table.table, 0.0)));
            let stop =
                piece
                    .flow()
                    .first_zero(&linear, left_s, 1)
                    .map_err(|_| PlantError::TooStiff {
                        time_s: interval.now_s(),
                    })?;
            let mut end = stop.x;
            if stop.guard.is_none() && interval.done_s() == 0.0 {
                // The very step that the bound would have allowed.
                end = table.kernel.step(&piece.start, voltage_v);
            }
            let y = to_plant_vector(&end, offset_rad, piece.beta_integral_rads);
            let interior = Interior::Held(&piece);
            self.move_over(drive, &interval, &stop, y, interior, watch)?;
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
        interior: Interior<'_>,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let time_s = interval.now_s();
        if !y.iter().all(|v| v.is_finite()) {
            return Err(PlantError::NonFinite { time_s });
        }
        if stop.time_s > 0.0 {
            watch.span(&Span {
                axis: &self.axis,
                drive,
                modes: (self.mode, self.mode),
                start_s: time_s,
                length_s: stop.time_s,
                y: (&self.y, &y),
                interior,
            });
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
        interval.move_by(stop.time_s);
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
        let terms = table.kernel.terms_of_delta(&x, voltage_v);
        let length_s = table.length_s();
        self.axis.set_parting_noise(NOISE_ULPS * terms, length_s);
    }

    /// A guard of the present mode as a linear function of the table's state.
    pub(super) fn linear_guard<'t, const D: usize>(
        &self,
        guard: Guard,
        table: &'t Table<D>,
        limit_v: f64,
    ) -> LinearGuard<'t, D> {
        let joint = self.axis.joint;
        let b = self.axis.backlash_half_rad();
        let release_nm = joint.map_or(0.0, |joint| self.axis.release_noise_nm(joint, &self.y));
        let part_rad = joint.map_or(0.0, |joint| release_nm / joint.stiffness_nm_per_rad);
        let flank = |flank: Flank| flank.sign();
        let way = |direction: Direction| direction.sign();
        let (quantity, sign, offset, noise) = match guard {
            // In the gap δ = ε.
            Guard::Meet(f) => (Quantity::Delta, -flank(f), b, 0.0),
            Guard::Part(f) => (Quantity::Delta, flank(f), 0.0, part_rad),
            Guard::Release(f) => (Quantity::FlankTorque, flank(f), 0.0, release_nm),
            Guard::Reload(f) => (Quantity::FlankTorque, -flank(f), 0.0, 0.0),
            Guard::Stop(d) => (Quantity::ScrewSpeed, way(d), 0.0, speed_noise(&self.y)),
            Guard::Break(d) => (
                Quantity::MovingTorque,
                -way(d),
                self.axis.holding_torque_nm,
                0.0,
            ),
            Guard::Limit(d) => (Quantity::Demand, -way(d), limit_v, 0.0),
            Guard::Unlimit(d) => (Quantity::Demand, way(d), -limit_v, 0.0),
        };
        LinearGuard {
            linear: table.quantity(quantity),
            sign,
            offset,
            noise,
            fresh: self.fresh == Some(guard),
        }
    }
}
