//! Encoder loss: the axis is driven and no count comes.

use super::{MonitorError, lengthened};
use crate::faults::{FaultCause, Trip};

/// Guards against an encoder that does not count although the axis is driven:
/// the loop is open then, and the law would drive ever harder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderLossMonitor {
    code_threshold: u32,
    ticks: u32,
}

impl EncoderLossMonitor {
    /// The largest code of the widest converter, 2^23 − 1.
    pub const MAX_CODE_THRESHOLD: u32 = 0x7F_FFFF;

    /// Codes from `code_threshold` on, either sign, move a healthy axis within
    /// `ticks` samples.
    ///
    /// # Errors
    /// [`MonitorError::CodeThreshold`] unless the threshold is 1 to 2^23 − 1,
    /// [`MonitorError::LossTicks`] for 0 samples: the one at rest would do.
    ///
    /// ```
    /// use firmware::monitor::{EncoderLossState, EncoderLossMonitor};
    ///
    /// let monitor = EncoderLossMonitor::accept(300, 2)?;
    /// let mut state = EncoderLossState::default();
    /// assert_eq!(monitor.check(&mut state, -300, 0), None);
    /// assert!(monitor.check(&mut state, -300, 0).is_some());
    /// assert_eq!(monitor.check(&mut state, -300, 1), None);
    /// # Ok::<(), firmware::MonitorError>(())
    /// ```
    pub const fn accept(code_threshold: u32, ticks: u32) -> Result<Self, MonitorError> {
        if code_threshold == 0 || code_threshold > Self::MAX_CODE_THRESHOLD {
            return Err(MonitorError::CodeThreshold { code_threshold });
        }
        if ticks == 0 {
            return Err(MonitorError::LossTicks);
        }
        Ok(Self {
            code_threshold,
            ticks,
        })
    }

    /// Code and samples from which on it is a loss.
    pub const fn limits(&self) -> (u32, u32) {
        (self.code_threshold, self.ticks)
    }

    /// One sample: takes the code that was in force up to it and the change of
    /// the count \[counts\].
    #[inline]
    pub fn check(&self, state: &mut EncoderLossState, code: i32, difference: i32) -> Option<Trip> {
        let still = (code.unsigned_abs() >= self.code_threshold) & (difference == 0);
        state.samples = lengthened(state.samples, still);
        (state.samples >= self.ticks).then_some(Trip {
            cause: FaultCause::EncoderLoss,
            measured: i64::from(state.samples),
            limit: i64::from(self.ticks),
        })
    }
}

/// Memory of an [`EncoderLossMonitor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EncoderLossState {
    samples: u32,
}
