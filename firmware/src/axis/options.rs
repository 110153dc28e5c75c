//! What an axis can do beyond the law: options, each of which can be off.

use crate::monitor::{EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor};
use crate::position::CounterParameters;

/// Which encoder the position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// The motor's: the paper's axis.
    #[default]
    Motor,
    /// The load's, with the damping from the motor.
    Load(CounterParameters),
}

/// What changes while the axis stands: at rest an integrator behind a
/// quantiser and a gap hunts, and these stop it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rest {
    /// Errors up to this size count as 0 for `Kp` and `Ki` while no motion runs
    /// \[counts\]; the derivative goes on.
    pub dead_band: u32,
    /// Whether the integral keeps its value while no motion runs, whatever the
    /// error: what is left is then left to `Kp`.
    pub hold_integral: bool,
}

impl Rest {
    /// Nothing changes: the default.
    pub const NONE: Self = Self {
        dead_band: 0,
        hold_integral: false,
    };
}

/// Checks that run in every sample; `None` checks nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Monitors {
    /// Distance of the axis from its setpoint.
    pub following_error: Option<FollowingErrorMonitor>,
    /// An encoder that does not count.
    pub encoder_loss: Option<EncoderLossMonitor>,
    /// An output that stays at its limit.
    pub saturation: Option<SaturationMonitor>,
    /// A sample that did not come.
    pub ticks: Option<TickMonitor>,
}

impl Monitors {
    /// Nothing is watched: the default.
    pub const NONE: Self = Self {
        following_error: None,
        encoder_loss: None,
        saturation: None,
        ticks: None,
    };
}
