//! A table for a held voltage: none of it depends on b, on the voltage or on which flank
//! carries. Two serve an axis, six one with dry friction.

use super::grid::Grid;
use super::levels::{self, Levels};
use super::loss::{DRIVING, Dissipation, PARTS};
use super::system::{AxisSystem, Column, HELD};
use super::table::{Table, held_rows};
use super::whole_step::WholeStep;
use crate::model::axis::{Axis, Mode};
use crate::model::direction::Direction;
use crate::model::joint::JointMode;
use crate::model::resistance::GuideMode;
use crate::model::state::CURRENT;
use crate::numerics::seconds;
use crate::numerics::width::Width;
use crate::observe::extremes::ENERGIES;

/// The axis over one length in one mode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldTable {
    pub(super) length_ns: u64,
    /// Of a joint that carries torque.
    pub(crate) closed: bool,
    pub(crate) guide: GuideMode,
    pub(crate) system: AxisSystem,
    pub(crate) table: Table<HELD>,
    pub(crate) step: WholeStep,
    /// Of a closed joint with damping.
    loss: Option<Dissipation<DRIVING>>,
    armature: Dissipation<PARTS>,
}

/// True if a step over this length is stiff, the joint open or closed.
pub(crate) fn is_stiff(axis: &Axis, length_ns: u64) -> bool {
    let joints: &[JointMode] = match axis.joint {
        Some(_) => &[JointMode::Open, JointMode::Loaded(Direction::Positive)],
        None => &[JointMode::Rigid],
    };
    joints.iter().any(|&joint| {
        let mode = Mode {
            joint,
            guide: GuideMode::AsWritten,
            ..axis.mode_at_rest()
        };
        levels::is_stiff(&axis.system(&mode).a, seconds(length_ns))
    })
}

impl HeldTable {
    /// Length of the step \[s\].
    pub(crate) fn length_s(&self) -> f64 {
        seconds(self.length_ns)
    }

    /// The energies \[J\] of a part of the step from where the current and the rates are these.
    #[inline(always)]
    pub(crate) fn energies_of_part<W: Width>(
        &self,
        w: W,
        (current, rates): (W::Vector, &[W::Vector; DRIVING]),
        voltage_v: W::Vector,
        length_s: W::Vector,
    ) -> [W::Vector; ENERGIES] {
        let mut joint_j = w.splat(0.0);
        if let Some(joint) = &self.loss {
            [joint_j, _] = joint.with_integral(w, *rates, length_s);
        }
        let [a, b, c, d] = *rates;
        let parts = [current, a, b, c, d];
        let [armature_j, charge_as] = self.armature.with_integral(w, parts, length_s);
        [joint_j, armature_j, voltage_v * charge_as]
    }

    pub(super) fn new(axis: &Axis, mode: &Mode, length_ns: u64) -> Self {
        let system = axis.system(mode);
        let rows = held_rows(axis, mode, &system);
        let levels = Levels::new(&system.a, seconds(length_ns));
        let grid = Grid::new(&levels);
        let closed = mode.joint.carries();
        let loss = closed.then(|| Dissipation::held(axis, &levels)).flatten();
        let mut current = Column::<HELD>::zeros();
        current[CURRENT] = 1.0;
        let resistance_ohm = axis.motor.resistance_ohm;
        let armature = Dissipation::of_quantity(resistance_ohm, &levels, &current);
        let table = Table::new(levels, grid, &rows);
        let heat = (loss.as_ref(), &armature);
        Self {
            length_ns,
            closed,
            guide: mode.guide,
            step: WholeStep::new(axis, (&system, &table), mode.guide, heat),
            system,
            table,
            loss,
            armature,
        }
    }
}
