//! The states of an axis and what takes it from one to another.
//!
//! ```text
//!             Enable            Start             MotionEnded
//!  Disabled ─────────► Enabled ───────► Moving ───────────────► Holding
//!     ▲ ▲                 │              │ ▲                      │ │
//!     │ └──── Disable ────┴──────────────┴─│──────────────────────┘ │
//!     │                                    └──────── Start ─────────┘
//!     └─── Reset ─── Fault ◄─── Fail ─── every state
//! ```
//!
//! [`State::after`] answers every pair of state and event. A request that does
//! not fit is [`Refused`]: nothing changes, and who asked is told so. The whole
//! table, and what the output does in each state, is in `docs/STATES.md`.

use thiserror::Error;

use crate::named::named;

named! {
    /// States of an axis.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub enum State {
        /// Without power; the position is followed all the same.
        #[default]
        Disabled = "disabled",
        /// Powered, held at the position where it was enabled.
        Enabled = "enabled",
        /// Follows a source of setpoints.
        Moving = "moving",
        /// Powered, held at the last setpoint of a motion.
        Holding = "holding",
        /// Without power, until it is reset.
        Fault = "fault",
    }
}

impl State {
    /// The state that `event` leads to from this one.
    ///
    /// # Errors
    /// [`Refused`] where the event is none that this state can follow; the
    /// state stays what it is.
    ///
    /// ```
    /// use firmware::{Event, Refused, State};
    ///
    /// let enabled = State::Disabled.after(Event::Enable)?;
    /// assert_eq!(enabled.after(Event::Start)?, State::Moving);
    /// // Whatever happens, a fault waits for its reset.
    /// let refused = State::Fault.after(Event::Enable);
    /// assert_eq!(refused, Err(Refused { state: State::Fault, event: Event::Enable }));
    /// # Ok::<(), Refused>(())
    /// ```
    pub const fn after(self, event: Event) -> Result<Self, Refused> {
        match (self, event) {
            // Also from Disabled: what trips there must not be overlooked by
            // the next Enable.
            (_, Event::Fail) => Ok(Self::Fault),
            (Self::Disabled, Event::Enable) => Ok(Self::Enabled),
            (Self::Enabled | Self::Holding, Event::Start) => Ok(Self::Moving),
            (Self::Moving, Event::MotionEnded) => Ok(Self::Holding),
            // Switching off what is off is no mistake.
            (Self::Disabled | Self::Enabled | Self::Moving | Self::Holding, Event::Disable)
            | (Self::Fault, Event::Reset) => Ok(Self::Disabled),
            (state, event) => Err(Refused { state, event }),
        }
    }

    /// Tells whether the amplifier is enabled and the law's code goes out. Where it
    /// is not, the output is code 0 with the amplifier off.
    pub const fn is_powered(self) -> bool {
        match self {
            Self::Enabled | Self::Moving | Self::Holding => true,
            Self::Disabled | Self::Fault => false,
        }
    }
}

named! {
    /// Events of an axis: requests from outside, and what it finds out
    /// itself.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub enum Event {
        /// Request: power on and hold the position where the axis stands.
        Enable = "enable",
        /// Request: power off.
        Disable = "disable",
        /// Request: follow the source of setpoints.
        Start = "start",
        /// The source has given its last setpoint.
        MotionEnded = "motion-ended",
        /// A check has failed ([`crate::faults`]).
        Fail = "fail",
        /// Request: leave the fault, with the power still off.
        Reset = "reset",
    }
}

impl Event {
    /// The demand that a state fails which refuses it.
    const fn demand(self) -> &'static str {
        match self {
            Self::Enable => "the axis must be disabled",
            Self::Disable => "a fault has to be reset",
            Self::Start => "the axis must be enabled or holding",
            Self::MotionEnded => "the source of setpoints ends a motion while the axis is moving",
            Self::Fail => "a check must have tripped",
            Self::Reset => "there must be a fault",
        }
    }
}

/// A request that the state does not follow. The axis goes on as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error(
    "the event {} is refused in the state {}; {}",
    .event.name(), .state.name(), .event.demand()
)]
pub struct Refused {
    /// The state, before and after.
    pub state: State,
    /// The refused event.
    pub event: Event,
}
