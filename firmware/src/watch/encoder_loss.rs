//! Encoder loss: the axis is driven and no count comes.

use super::{WatchError, lengthened};
use crate::faults::{FaultCause, Trip};

/// Watches for an encoder that does not count although the axis is driven:
/// the loop is open then, and the law would drive ever harder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderLossWatch {
    code_threshold: u32,
    ticks: u32,
}

impl EncoderLossWatch {
    /// The largest code of the widest converter, 2^23 − 1.
    pub const MAX_CODE_THRESHOLD: u32 = 0x7F_FFFF;

    /// Codes from `code_threshold` on, either sign, move a healthy axis within
    /// `ticks` samples.
    ///
    /// # Errors
    /// [`WatchError::CodeThreshold`] unless the threshold is 1 to 2^23 − 1,
    /// [`WatchError::LossTicks`] for 0 samples: the one at rest would do.
    ///
    /// ```
    /// use firmware::watch::{EncoderLossState, EncoderLossWatch};
    ///
    /// let watch = EncoderLossWatch::accept(300, 2)?;
    /// let mut state = EncoderLossState::default();
    /// assert_eq!(watch.check(&mut state, -300, 0), None);
    /// assert!(watch.check(&mut state, -300, 0).is_some());
    /// assert_eq!(watch.check(&mut state, -300, 1), None);
    /// # Ok::<(), firmware::WatchError>(())
    /// ```
    pub const fn accept(code_threshold: u32, ticks: u32) -> Result<Self, WatchError> {
        if code_threshold == 0 || code_threshold > Self::MAX_CODE_THRESHOLD {
            return Err(WatchError::CodeThreshold { code_threshold });
        }
        if ticks == 0 {
            return Err(WatchError::LossTicks);
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

/// Memory of an [`EncoderLossWatch`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EncoderLossState {
    samples: u32,
}
