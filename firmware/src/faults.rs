//! Reasons for which an axis stops, and what one needs to see of it afterwards.
//!
//! Of the checks that trip in one tick the axis keeps the most urgent, by the order
//! of [`FaultCause`], adds the tick and what it knows of the sample, and latches
//! this first [`Fault`] until it is reset.
//!
//! # Order
//!
//! Within a tick the cause is named that explains the others: a stopped
//! machine explains everything; a dead bus explains ticks that come late and
//! registers that make no sense; a missed tick explains a count that jumps and
//! a queue that is not where it should be; a wrong count explains an error
//! that is too large, and that one explains a code at its limit.
//!
//! # Values
//!
//! Measured value and limit have a meaning for each cause:
//!
//! | cause | `measured` | `limit` |
//! | --- | --- | --- |
//! | emergency stop | 0 | 0 |
//! | hardware bus | transfers that failed in this sample, answers that were not believed among them | 0 |
//! | missed tick | ticks missed; below 0: by how many it came again | 0 |
//! | encoder glitch | difference of the counter, signed \[counts\] | largest magnitude \[counts\] |
//! | encoder loss | samples without a count under a driving code | samples that are a loss |
//! | setpoint underrun | setpoints that there were: 0 | setpoints needed: 1 |
//! | following error | `\|e\|` \[counts\] | largest magnitude at this speed \[counts\] |
//! | saturation too long | samples at a limit of the output | those that are allowed |

use core::fmt;

use crate::named::named;

named! {
    /// Causes that stop the axis, the most urgent first: the order of the variants is
    /// the priority where several appear in one tick.
    ///
    /// ```
    /// use firmware::FaultCause;
    ///
    /// assert_eq!(FaultCause::FollowingError.name(), "following-error");
    /// assert_eq!(FaultCause::ALL[6], FaultCause::FollowingError);
    /// ```
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[non_exhaustive]
    pub enum FaultCause {
        /// The emergency stop is pressed. Release it, then reset.
        EmergencyStop = "emergency-stop",
        /// Encoder or converter could not be reached, or says itself that it is not to
        /// be trusted: it has lost its supply, met a short circuit or a brown-out.
        HardwareBus = "hardware-bus",
        /// The control loop did not run at a tick, or ran twice.
        MissedTick = "missed-tick",
        /// The encoder count changed by more than any motion of the axis can; the
        /// position may be wrong from here on.
        EncoderGlitch = "encoder-glitch",
        /// The axis is driven but its encoder does not move.
        EncoderLoss = "encoder-loss",
        /// The motion has not ended but there was no setpoint.
        SetpointUnderrun = "setpoint-underrun",
        /// The axis is too far from its setpoint.
        FollowingError = "following-error",
        /// The output has stood at a limit for too long.
        SaturationTooLong = "saturation-too-long",
    }
}

/// Values at the sample of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultValues {
    /// Setpoint, in counts of the encoder that the position comes from
    /// \[counts, modulo 2^32\].
    pub setpoint: i32,
    /// Position, in the same counts \[counts, modulo 2^32\].
    pub position: i32,
    /// `e = r − c` \[counts\].
    pub error: i32,
    /// The code in force when the fault was found: the last one before the
    /// safe output.
    pub code: i32,
    /// Measured value; the unit is that of the cause.
    pub measured: i64,
    /// The limit that it passed, in the same unit.
    pub limit: i64,
}

/// A fault as it is kept for whoever has to understand it.
///
/// ```
/// use firmware::{Fault, FaultCause, FaultValues};
///
/// let values = FaultValues {
///     setpoint: 1_000,
///     position: 799,
///     error: 201,
///     code: 2_047,
///     measured: 201,
///     limit: 200,
/// };
/// let fault = Fault { cause: FaultCause::FollowingError, tick: 17, values };
/// assert_eq!(
///     fault.to_string(),
///     "the axis is 201 counts from its setpoint, more than the 200 that are allowed at \
///      this speed (tick 17: setpoint 1000, position 799, error 201 counts, code 2047)"
/// );
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fault {
    /// The cause.
    pub cause: FaultCause,
    /// Number of the tick at which it was found.
    pub tick: u64,
    /// Values at that sample.
    pub values: FaultValues,
}

impl Fault {
    /// All zeros, where none is latched.
    pub(crate) const ZERO: Self = Self {
        cause: FaultCause::EmergencyStop,
        tick: 0,
        values: FaultValues {
            setpoint: 0,
            position: 0,
            error: 0,
            code: 0,
            measured: 0,
            limit: 0,
        },
    };
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FaultValues {
            setpoint,
            position,
            error,
            code,
            measured,
            limit,
        } = self.values;
        match self.cause {
            FaultCause::EmergencyStop => f.write_str("the emergency stop is pressed"),
            FaultCause::HardwareBus => write!(
                f,
                "encoder or converter could not be reached or trusted: \
                 transfers that failed {measured}, \
                 allowed {limit}"
            ),
            FaultCause::MissedTick if measured < limit => write!(
                f,
                "the tick came again, {} too early",
                measured.unsigned_abs()
            ),
            FaultCause::MissedTick => write!(f, "ticks that were missed: {measured}"),
            FaultCause::EncoderGlitch => write!(
                f,
                "the encoder count changed by {measured} counts, \
                 more than the {limit} that any motion allows"
            ),
            FaultCause::EncoderLoss => write!(
                f,
                "the encoder has not moved for {measured} samples under a driving code \
                 and counts as lost after {limit}"
            ),
            FaultCause::SetpointUnderrun => write!(
                f,
                "the motion has not ended but its next setpoint has not come: \
                 {measured} where {limit} was needed"
            ),
            FaultCause::FollowingError => write!(
                f,
                "the axis is {measured} counts from its setpoint, \
                 more than the {limit} that are allowed at this speed"
            ),
            FaultCause::SaturationTooLong => write!(
                f,
                "the output has stood at a limit for {measured} samples, \
                 more than the {limit} that are allowed"
            ),
        }?;
        write!(
            f,
            " (tick {}: setpoint {setpoint}, position {position}, \
             error {error} counts, code {code})",
            self.tick
        )
    }
}
