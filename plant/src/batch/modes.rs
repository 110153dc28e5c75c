//! What the lanes' modes make of the equations.

use super::width::Width;
use crate::hybrid::Automaton;
use crate::model::joint::JointMode;
use crate::model::resistance::GuideMode;

/// The numbers of every lane's mode.
#[derive(Debug, Clone)]
pub(crate) struct ModeNumbers<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    pub(crate) offset_rad: W::Array,
    /// The guard `base + side·δ − open·|δ|`, positive within the mode.
    pub(crate) base: W::Array,
    side: W::Array,
    open: W::Array,
    /// `k` and `c` while a flank carries, else 0.
    pub(crate) stiffness: W::Array,
    pub(crate) damping: W::Array,
    /// a0 against the motion.
    pub(crate) resistance_n: W::Array,
    /// The flank in contact: −1, 0 or 1.
    pub(crate) joint: W::Array,
}

impl<W: Width> ModeNumbers<W> {
    pub(crate) fn new() -> Self {
        let zero = W::array(0.0);
        Self {
            offset_rad: zero,
            base: zero,
            side: zero,
            open: zero,
            stiffness: zero,
            damping: zero,
            resistance_n: zero,
            joint: zero,
        }
    }

    /// The guard of the joint; where δ is not a number, neither is this.
    #[inline(always)]
    pub(crate) fn guard(&self, w: W, delta: W::Vector) -> W::Vector {
        (w.load(&self.base) + w.load(&self.side) * delta) - w.load(&self.open) * w.abs(delta)
    }

    /// The guard of one lane.
    pub(crate) fn guard_of(&self, lane: usize, delta: f64) -> f64 {
        let of = |array: &W::Array| array.as_ref()[lane];
        (of(&self.base) + of(&self.side) * delta) - of(&self.open) * delta.abs()
    }

    /// Whether no bound can tell that the lane keeps its mode.
    pub(crate) fn is_unsure(&self, lane: usize) -> bool {
        self.base.as_ref()[lane] == f64::NEG_INFINITY
    }

    /// Sets a lane's numbers to those of its mode.
    pub(crate) fn set(&mut self, lane: usize, plant: &Automaton) {
        let (mode, axis) = (&plant.mode, &plant.axis);
        let never = f64::NEG_INFINITY;
        let simple =
            !axis.releases() && mode.guide == GuideMode::AsWritten && plant.fresh.is_none();
        let (base, side, open) = match mode.joint {
            _ if !simple => (never, 0.0, 0.0),
            JointMode::Rigid | JointMode::Gapless => (f64::INFINITY, 0.0, 0.0),
            JointMode::Open => (axis.backlash_half_rad(), 0.0, 1.0),
            JointMode::Loaded(flank) => (0.0, flank.sign(), 0.0),
            JointMode::Released(_) => (never, 0.0, 0.0),
        };
        let (stiffness, damping) = match (mode.joint, axis.joint) {
            (JointMode::Gapless | JointMode::Loaded(_), Some(joint)) => {
                (joint.stiffness_nm_per_rad, joint.damping_nms_per_rad)
            }
            _ => (0.0, 0.0),
        };
        let resistance_n = mode.guide.direction() * axis.resistance().constant_n;
        for (array, value) in [
            (&mut self.offset_rad, axis.offset_rad(mode)),
            (&mut self.base, base),
            (&mut self.side, side),
            (&mut self.open, open),
            (&mut self.stiffness, stiffness),
            (&mut self.damping, damping),
            (&mut self.resistance_n, resistance_n),
            (&mut self.joint, f64::from(mode.joint.contact().sign())),
        ] {
            array.as_mut()[lane] = value;
        }
    }
}
