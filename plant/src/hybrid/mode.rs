//! Modes of the axis and what ends them.
//!
//! Within one mode the equations are smooth. Each mode has a few guards:
//! functions that are positive inside the mode; the first to reach zero ends
//! it. The modes and their guards:
//!
//! ```text
//! joint      Open ──ε = ±b──► Loaded ──|ε| = b──► Open
//!                             Loaded ──Ψ = 0 (no_pull)──► Released ──|ε| = b──► Open
//!                             Released ──Ψ > 0──► Loaded
//! guide      Forward, Backward ──γ̇ = 0──► Stuck or the other direction
//!            Stuck ──|τ| = p·a0──► Forward, Backward
//! amplifier  Linear ◄──|V| = V_max──► AtLimit            (continuous law only)
//! ```

use crate::model::joint::{Flank, JointMode};
use crate::model::resistance::GuideMode;

/// What the amplifier does under the continuous law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AmplifierMode {
    /// The output follows the demand, or a held voltage.
    Linear,
    /// The output stands at `+V_max`.
    AtUpper,
    /// The output stands at `−V_max`.
    AtLower,
}

/// Everything that selects the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Mode {
    pub(crate) joint: JointMode,
    pub(crate) guide: GuideMode,
    pub(crate) amplifier: AmplifierMode,
}

/// Direction of motion, torque or voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Positive,
    Negative,
}

impl Direction {
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}

/// What can end a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guard {
    /// `b − s·ε`: the gap closes on a flank.
    Meet(Flank),
    /// `s·ε − b`: the flank comes away.
    Part(Flank),
    /// `s·Ψ`: the flank would have to pull.
    Release(Flank),
    /// `−s·Ψ` of the released flank: it would push again.
    Reload(Flank),
    /// `s·γ̇`: sliding comes to rest.
    Stop(Direction),
    /// `p·a0 − s·τ`: dry friction gives way.
    Break(Direction),
    /// `V_max − s·V`: the demand reaches the limit.
    Limit(Direction),
    /// `s·V − V_max`: the demand comes back from the limit.
    Unlimit(Direction),
}

/// The guards of a mode: at most two each for joint, guide and amplifier.
pub(crate) type Guards = [Option<Guard>; 6];

impl Mode {
    /// The guards of this mode. `releases` says whether a loaded flank lets
    /// go where it would pull, `feedback` whether the voltage follows the
    /// continuous law.
    pub(crate) fn guards(&self, releases: bool, feedback: bool) -> Guards {
        let joint = match self.joint {
            JointMode::Rigid | JointMode::Gapless => [None, None],
            JointMode::Open => [
                Some(Guard::Meet(Flank::Drive)),
                Some(Guard::Meet(Flank::Coast)),
            ],
            JointMode::Loaded(flank) if releases => [Some(Guard::Release(flank)), None],
            JointMode::Loaded(flank) => [Some(Guard::Part(flank)), None],
            JointMode::Released(flank) => [Some(Guard::Part(flank)), Some(Guard::Reload(flank))],
        };
        let guide = match self.guide {
            GuideMode::AsWritten => [None, None],
            GuideMode::Forward => [Some(Guard::Stop(Direction::Positive)), None],
            GuideMode::Backward => [Some(Guard::Stop(Direction::Negative)), None],
            GuideMode::Stuck => [
                Some(Guard::Break(Direction::Positive)),
                Some(Guard::Break(Direction::Negative)),
            ],
        };
        let amplifier = match self.amplifier {
            _ if !feedback => [None, None],
            AmplifierMode::Linear => [
                Some(Guard::Limit(Direction::Positive)),
                Some(Guard::Limit(Direction::Negative)),
            ],
            AmplifierMode::AtUpper => [Some(Guard::Unlimit(Direction::Positive)), None],
            AmplifierMode::AtLower => [Some(Guard::Unlimit(Direction::Negative)), None],
        };
        [
            joint[0],
            joint[1],
            guide[0],
            guide[1],
            amplifier[0],
            amplifier[1],
        ]
    }
}

impl Guard {
    /// The guard on the same surface in the mode that this one leads to; its
    /// value there is zero at first and must not be found again.
    pub(crate) fn opposite(self, next: &Mode) -> Self {
        let turned = |d: Direction| match d {
            Direction::Positive => Direction::Negative,
            Direction::Negative => Direction::Positive,
        };
        match self {
            Self::Meet(flank) => Self::Part(flank),
            Self::Part(flank) => Self::Meet(flank),
            Self::Release(flank) => Self::Reload(flank),
            Self::Reload(flank) => Self::Release(flank),
            Self::Break(direction) => Self::Stop(direction),
            // From sliding straight into the other direction, or on.
            Self::Stop(direction) => match (next.guide, direction) {
                (GuideMode::Backward, Direction::Positive)
                | (GuideMode::Forward, Direction::Negative) => Self::Stop(turned(direction)),
                _ => self,
            },
            Self::Limit(direction) => Self::Unlimit(direction),
            Self::Unlimit(direction) => Self::Limit(direction),
        }
    }
}
