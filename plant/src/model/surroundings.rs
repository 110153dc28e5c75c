//! What surrounds the axis: the amplifier that drives it, forces on its carriage, and
//! where it starts.

use std::collections::BTreeSet;

use super::amplifier::Amplifier;
use super::direction::Direction;
use super::joint::Transmission;

/// A force on the carriage for a time, positive against positive x.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// First instant \[ns\].
    pub from_ns: u64,
    /// The instant from which on it acts no more \[ns\]; `None` for ever.
    pub to_ns: Option<u64>,
    /// The force \[N\].
    pub force_n: f64,
}

/// Where the joint stands at the start, the carriage at zero and all at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Start {
    /// In the middle of its gap.
    #[default]
    Centred,
    /// On the drive flank, ε = b.
    PositiveFlank,
    /// On the coast flank, ε = −b.
    NegativeFlank,
}

impl Start {
    /// The flank in contact, if the joint has a gap: twice b \[rad\].
    pub(crate) fn flank(self, backlash_half_rad: f64) -> Option<Direction> {
        let has_gap = backlash_half_rad > 0.0;
        match self {
            Self::PositiveFlank if has_gap => Some(Direction::Positive),
            Self::NegativeFlank if has_gap => Some(Direction::Negative),
            _ => None,
        }
    }

    /// `β(0)`, where the encoder's zero is \[rad\].
    pub fn beta_rad(self, transmission: &Transmission) -> f64 {
        let b = transmission.joint.backlash_half_rad();
        self.flank(b).map_or(0.0, |flank| flank.sign() * b)
    }
}

/// Amplifier, loads and start of an axis; the default is the paper's: a voltage drive,
/// no load, the joint centred.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// The amplifier; of a voltage drive without a current limit nothing is used.
    pub amplifier: Amplifier,
    /// Force on the carriage at all times, positive against positive x \[N\].
    pub load_force_n: f64,
    /// Forces that act for a time, on top.
    pub loads: Vec<Load>,
    /// Where the joint stands at the start.
    pub start: Start,
}

impl Surroundings {
    /// True if they are the paper's.
    pub fn is_papers(&self) -> bool {
        self.amplifier.current_limit_a().is_none()
            && self.load_force_n == 0.0
            && self.loads.is_empty()
            && self.start == Start::Centred
    }

    /// True if runs within them go side by side ([`crate::Batch`]): the amplifier is a
    /// voltage drive, and the load acts at all times.
    pub fn go_side_by_side(&self) -> bool {
        !self.amplifier.is_current_drive() && self.loads.is_empty()
    }

    /// The force on the carriage at an instant \[ns\], in newtons.
    pub fn force_at_n(&self, now_ns: u64) -> f64 {
        let acting = self
            .loads
            .iter()
            .filter(|load| load.from_ns <= now_ns && load.to_ns.is_none_or(|to_ns| now_ns < to_ns));
        acting.fold(self.load_force_n, |sum, load| sum + load.force_n)
    }

    /// The force from each instant on at which it changes \[ns, N\], the first at 0.
    pub(crate) fn forces(&self) -> Vec<(u64, f64)> {
        let edges = self
            .loads
            .iter()
            .flat_map(|load| [Some(load.from_ns), load.to_ns]);
        let instants: BTreeSet<u64> = edges.flatten().chain([0]).collect();
        let at = |now_ns| (now_ns, self.force_at_n(now_ns));
        instants.into_iter().map(at).collect()
    }
}
