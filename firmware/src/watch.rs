//! Four watches over an axis: each looks at one sample and gives a [`Trip`]
//! when its limit is passed.
//!
//! | watch | trips when |
//! | --- | --- |
//! | [`FollowingErrorWatch`] | `\|e\| > a + s·\|v_ref\|` |
//! | [`EncoderLossWatch`] | `\|code\|` ≥ threshold and no count for `ticks` samples in a row |
//! | [`SaturationWatch`] | output at a limit for more than `ticks` samples in a row |
//! | [`TickWatch`] | a tick is not the successor of the last one |
//!
//! A watch goes on tripping while its condition lasts; which fault was the
//! first is for [`crate::FaultLatch`] to remember.
//!
//! # Following error
//!
//! Without feed-forward an axis follows at a distance that grows with its
//! speed, `v` over the velocity gain, so a fixed limit would have to allow at
//! rest what is only normal at full speed. `s` is that lag \[samples\], a word
//! `w·2^−f`, and `v_ref = v·2^−q` \[counts/sample\] with the fraction bits `q`
//! of the source of setpoints. With `F = f + q` the demand is
//!
//! ```text
//! |e|·2^F > a·2^F + w·|v|
//! ```
//!
//! `|e|` and `a` are whole, so `|e| − a > w·|v|·2^−F` holds exactly when
//! `|e| − a > floor(w·|v|·2^−F)`: one product and one shift decide without
//! any error, and `a + floor(w·|v|·2^−F)` is the largest `|e|` that is
//! allowed, which is what a fault has to report. Rounding `v` to whole counts
//! per sample or the product to the nearest count would decide wrongly.
//!
//! | value | magnitude | of |
//! | --- | --- | --- |
//! | `\|e\|` | ≤ 2^31 | 2^32 |
//! | `a` | < 2^31 | 2^32 |
//! | `w·\|v\|` | < 2^31·2^31 = 2^62 | 2^64 |
//! | `F` | ≤ 62; beyond, the second part would always be 0 | 64 |
//! | `a + floor(w·\|v\|·2^−F)` | < 2^31 + 2^62 < 2^63 | 2^63 |

use core::fmt;

use crate::faults::{FaultCause, Trip};
use crate::word::GainWord;

/// Watches the distance of the axis from its setpoint.
///
/// ```
/// use firmware::watch::{FollowingErrorState, FollowingErrorWatch};
/// use firmware::GainWord;
///
/// // 200 counts at rest and 2.5 samples of lag; velocities in 2^-16 counts/sample.
/// let watch = FollowingErrorWatch::accept(200, GainWord::new(5, 1), 16)?;
/// let mut state = FollowingErrorState::default();
/// // At 10.2 counts per sample 225.5 are allowed.
/// let velocity = 668_467;
/// assert_eq!(watch.check(&mut state, -225, velocity), None);
/// let trip = watch.check(&mut state, -226, velocity).expect("one count more");
/// assert_eq!((trip.measured, trip.limit), (226, 225));
/// assert_eq!(state.peak(), 226);
/// # Ok::<(), firmware::WatchError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FollowingErrorWatch {
    /// `a` \[counts\].
    limit_counts: u32,
    /// `w`.
    mantissa: u32,
    /// `F`.
    fraction_bits: u8,
}

impl FollowingErrorWatch {
    /// Largest limit at rest \[counts\]: `|e|` can only just pass it.
    pub const MAX_LIMIT_COUNTS: u32 = i32::MAX.cast_unsigned();
    /// Largest sum of the fraction bits of lag and velocity.
    pub const MAX_FRACTION_BITS: u8 = 62;

    /// A limit of `limit_counts` at rest, and of `per_speed` more for each
    /// count per sample of the setpoint, that is a lag \[samples\]; the
    /// setpoint's velocity has `velocity_fraction_bits` fraction bits.
    ///
    /// # Errors
    /// [`WatchError::LimitCounts`] unless the limit is 1 to 2^31 − 1,
    /// [`WatchError::Negative`] for a lag below 0, [`WatchError::FractionBits`]
    /// where lag and velocity have more than 62 fraction bits together.
    pub fn accept(
        limit_counts: u32,
        per_speed: GainWord,
        velocity_fraction_bits: u8,
    ) -> Result<Self, WatchError> {
        if limit_counts == 0 || limit_counts > Self::MAX_LIMIT_COUNTS {
            return Err(WatchError::LimitCounts { limit_counts });
        }
        let mantissa =
            u32::try_from(per_speed.mantissa).map_err(|_| WatchError::Negative { per_speed })?;
        let fraction_bits = per_speed
            .fraction_bits
            .saturating_add(velocity_fraction_bits);
        if fraction_bits > Self::MAX_FRACTION_BITS {
            return Err(WatchError::FractionBits {
                per_speed,
                velocity_fraction_bits,
            });
        }
        Ok(Self {
            limit_counts,
            mantissa,
            fraction_bits,
        })
    }

    /// One sample: takes `e` \[counts\] and the velocity of the setpoint.
    pub fn check(
        &self,
        state: &mut FollowingErrorState,
        error: i32,
        velocity: i32,
    ) -> Option<Trip> {
        let size = error.unsigned_abs();
        state.peak = state.peak.max(size);

        // a + floor(w·|v|·2^−F) [counts]; nothing wraps (page of this file)
        let (a, w) = (u64::from(self.limit_counts), u64::from(self.mantissa));
        let v = u64::from(velocity.unsigned_abs());
        let lag = w
            .wrapping_mul(v)
            .wrapping_shr(u32::from(self.fraction_bits));
        let limit = a.wrapping_add(lag).cast_signed();

        let measured = i64::from(size);
        (measured > limit).then_some(Trip {
            cause: FaultCause::FollowingError,
            measured,
            limit,
        })
    }
}

/// Memory of a [`FollowingErrorWatch`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FollowingErrorState {
    peak: u32,
}

impl FollowingErrorState {
    /// Largest `|e|` since the start or the last reset \[counts\].
    pub const fn peak(&self) -> u32 {
        self.peak
    }

    /// Starts the peak anew.
    pub const fn reset_peak(&mut self) {
        self.peak = 0;
    }
}

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

    /// One sample: takes the code that was in force up to it and the change of
    /// the count \[counts\].
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

/// Watches for an output that stands at a limit: an axis that cannot do what
/// it is asked to, because it is blocked or the motion asks too much.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SaturationWatch {
    ticks: u32,
}

impl SaturationWatch {
    /// Allows `ticks` samples in a row.
    ///
    /// # Errors
    /// [`WatchError::SaturationTicks`] for 2^32 − 1, which the counter never
    /// passes.
    ///
    /// ```
    /// use firmware::watch::{SaturationState, SaturationWatch};
    ///
    /// let watch = SaturationWatch::accept(1)?;
    /// let mut state = SaturationState::default();
    /// assert_eq!(watch.check(&mut state, true), None);
    /// assert!(watch.check(&mut state, true).is_some());
    /// # Ok::<(), firmware::WatchError>(())
    /// ```
    pub const fn accept(ticks: u32) -> Result<Self, WatchError> {
        if ticks == u32::MAX {
            return Err(WatchError::SaturationTicks { ticks });
        }
        Ok(Self { ticks })
    }

    /// One sample: takes whether the output stands at a limit.
    pub fn check(&self, state: &mut SaturationState, at_limit: bool) -> Option<Trip> {
        state.samples = lengthened(state.samples, at_limit);
        (state.samples > self.ticks).then_some(Trip {
            cause: FaultCause::SaturationTooLong,
            measured: i64::from(state.samples),
            limit: i64::from(self.ticks),
        })
    }
}

/// Memory of a [`SaturationWatch`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SaturationState {
    samples: u32,
}

/// The length of a run of samples after one more; it ends where the condition
/// does, and stays at its largest value.
const fn lengthened(samples: u32, goes_on: bool) -> u32 {
    if goes_on {
        samples.saturating_add(1)
    } else {
        0
    }
}

/// Watches that the control loop runs at every tick, once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickWatch;

impl TickWatch {
    /// One sample: takes the number of its tick, counted by the hardware timer
    /// and not by the loop. The first one may be any; after a trip the next one
    /// is compared with the number that came.
    ///
    /// ```
    /// use firmware::watch::{TickState, TickWatch};
    ///
    /// let mut state = TickState::default();
    /// assert_eq!(TickWatch.check(&mut state, 41), None);
    /// assert_eq!(TickWatch.check(&mut state, 42), None);
    /// let trip = TickWatch.check(&mut state, 45).expect("43 and 44 are missing");
    /// assert_eq!(trip.measured, 2);
    /// ```
    pub fn check(&self, state: &mut TickState, tick: u64) -> Option<Trip> {
        // Counted modulo 2^64, so that no end has to be looked at.
        let expected = state.expected.replace(tick.wrapping_add(1))?;
        let missed = tick.wrapping_sub(expected).cast_signed();
        (missed != 0).then_some(Trip {
            cause: FaultCause::MissedTick,
            measured: missed,
            limit: 0,
        })
    }
}

/// Memory of a [`TickWatch`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickState {
    /// The number that comes next; none before the first tick.
    expected: Option<u64>,
}

/// Why a watch is not accepted. Nothing was built; the axis cannot start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum WatchError {
    /// The limit of the following error would trip at the first count, or
    /// never.
    LimitCounts {
        /// The limit given \[counts\].
        limit_counts: u32,
    },
    /// The lag is negative.
    Negative {
        /// Its word.
        per_speed: GainWord,
    },
    /// Lag and velocity have too many fraction bits together.
    FractionBits {
        /// The word of the lag.
        per_speed: GainWord,
        /// Fraction bits of the velocity.
        velocity_fraction_bits: u8,
    },
    /// The code that must move the axis is 0, or none that a converter has.
    CodeThreshold {
        /// The threshold given \[codes\].
        code_threshold: u32,
    },
    /// A loss of the encoder after 0 samples.
    LossTicks,
    /// A time at the limit that is never passed.
    SaturationTicks {
        /// The number of samples given.
        ticks: u32,
    },
}

impl fmt::Display for WatchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LimitCounts { limit_counts } => write!(
                f,
                "a following error limit of {limit_counts} counts is of no use; \
                 it must lie between 1 and {}",
                FollowingErrorWatch::MAX_LIMIT_COUNTS
            ),
            Self::Negative { per_speed } => write!(
                f,
                "the following error's share per speed {per_speed} is negative; \
                 it must be at least 0"
            ),
            Self::FractionBits {
                per_speed,
                velocity_fraction_bits,
            } => write!(
                f,
                "the following error's share per speed {per_speed} and a velocity with \
                 {velocity_fraction_bits} fraction bits have more than {} of them together",
                FollowingErrorWatch::MAX_FRACTION_BITS
            ),
            Self::CodeThreshold { code_threshold } => write!(
                f,
                "a code threshold of {code_threshold} cannot tell a lost encoder; \
                 it must lie between 1 and {}",
                EncoderLossWatch::MAX_CODE_THRESHOLD
            ),
            Self::LossTicks => f.write_str(
                "an encoder cannot be lost after 0 samples; it must be at least 1 sample",
            ),
            Self::SaturationTicks { ticks } => write!(
                f,
                "{ticks} samples at a limit are never passed; \
                 the number must be below {ticks}"
            ),
        }
    }
}

impl core::error::Error for WatchError {}
