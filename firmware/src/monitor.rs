//! Four monitors over an axis: each looks at one sample and gives a [`crate::Trip`]
//! when its limit is passed.
//!
//! | monitor | trips when |
//! | --- | --- |
//! | [`FollowingErrorMonitor`] | `\|e\| > a + s·\|v_ref\|` |
//! | [`EncoderLossMonitor`] | `\|code\|` ≥ threshold and no count for `ticks` samples in a row |
//! | [`SaturationMonitor`] | output at a limit for more than `ticks` samples in a row |
//! | [`TickMonitor`] | a tick is not the successor of the last one |
//!
//! A monitor goes on tripping while its condition lasts; which fault was the
//! first is for [`crate::FaultLatch`] to remember.

use crate::faults::{FaultCause, Trip};
use crate::refusal::{Refusal, What, accepted};
use crate::wide;
use crate::word::GainWord;

/// Monitors the distance of the axis from its setpoint.
///
/// Without feed-forward an axis follows at a distance that grows with its
/// speed, `v` over the velocity gain, so a fixed limit would have to allow at
/// rest what is only normal at full speed. `s` is that lag \[samples\], a word
/// `w·2^−f`, and `v_ref = v·2^−q` \[counts/sample\] with the fraction bits `q`
/// of the source of setpoints. With `F = f + q` the demand is
///
/// ```text
/// |e|·2^F > a·2^F + w·|v|
/// ```
///
/// `|e|` and `a` are whole, so `|e| − a > w·|v|·2^−F` holds exactly when
/// `|e| − a > floor(w·|v|·2^−F)`: one product and one shift decide without
/// any error, and `a + floor(w·|v|·2^−F)` is the largest `|e|` that is
/// allowed, which is what a fault has to report. Rounding `v` to whole counts
/// per sample or the product to the nearest count would decide wrongly.
///
/// | value | magnitude | of |
/// | --- | --- | --- |
/// | `\|e\|` | ≤ 2^31 | 2^32 |
/// | `a` | < 2^31 | 2^32 |
/// | `w·\|v\|` | < 2^31·2^31 = 2^62 | 2^64 |
/// | `F` | ≤ 62; beyond, the second part would always be 0 | 64 |
/// | `a + floor(w·\|v\|·2^−F)` | < 2^31 + 2^62 < 2^63 | 2^63 |
///
/// ```
/// use firmware::monitor::{FollowingErrorState, FollowingErrorMonitor};
/// use firmware::GainWord;
///
/// // 200 counts at rest and 2.5 samples of lag; velocities in 2^-16 counts/sample.
/// let monitor = FollowingErrorMonitor::accept(200, GainWord::new(5, 1), 16)?;
/// let mut state = FollowingErrorState::default();
/// // At 10.2 counts per sample 225.5 are allowed.
/// let velocity = 668_467;
/// assert_eq!(monitor.check(&mut state, -225, velocity), None);
/// let trip = monitor.check(&mut state, -226, velocity).expect("one count more");
/// assert_eq!((trip.measured, trip.limit), (226, 225));
/// assert_eq!(state.peak(), 226);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FollowingErrorMonitor {
    /// `a` \[counts\].
    limit_counts: u32,
    /// `w`.
    mantissa: u32,
    /// `F`.
    fraction_bits: u8,
}

impl FollowingErrorMonitor {
    /// Largest limit at rest \[counts\]: `|e|` can only just pass it.
    pub const MAX_LIMIT_COUNTS: u32 = i32::MAX.cast_unsigned();
    /// Largest sum of the fraction bits of lag and velocity.
    pub const MAX_FRACTION_BITS: u8 = 62;

    /// A limit of `limit_counts` at rest, and of `per_speed` more for each
    /// count per sample of the setpoint, that is a lag \[samples\]; the
    /// setpoint's velocity has `velocity_fraction_bits` fraction bits.
    ///
    /// # Errors
    /// A [`Refusal`] unless the limit is 1 to 2^31 − 1, of a lag below 0, and
    /// where lag and velocity have more than 62 fraction bits together.
    pub const fn accept(
        limit_counts: u32,
        per_speed: GainWord,
        velocity_fraction_bits: u8,
    ) -> Result<Self, Refusal> {
        accepted!(What::FollowingError.word_within(limit_counts, [1, Self::MAX_LIMIT_COUNTS]));
        accepted!(What::Lag(per_speed).not_negative(per_speed.mantissa));
        let own = per_speed.fraction_bits;
        let fraction_bits = own.saturating_add(velocity_fraction_bits);
        if fraction_bits > Self::MAX_FRACTION_BITS {
            let left = Self::MAX_FRACTION_BITS.saturating_sub(own);
            let what = What::LagFractionBits(per_speed);
            let value = wide::bits(velocity_fraction_bits);
            return Err(Refusal::new(what, value, [0, wide::bits(left)]));
        }
        Ok(Self {
            limit_counts,
            mantissa: per_speed.mantissa.unsigned_abs(),
            fraction_bits,
        })
    }

    /// The limit at rest \[counts\], and what it grows by per unit of the
    /// setpoint's velocity.
    pub const fn limits(&self) -> (u32, GainWord) {
        let word = GainWord::new(self.mantissa.cast_signed(), self.fraction_bits);
        (self.limit_counts, word)
    }

    /// One sample: takes `e` \[counts\] and the velocity of the setpoint.
    #[inline]
    pub fn check(
        &self,
        state: &mut FollowingErrorState,
        error: i32,
        velocity: i32,
    ) -> Option<Trip> {
        let size = error.unsigned_abs();
        state.peak = state.peak.max(size);

        // a + floor(w·|v|·2^−F) [counts]; nothing wraps (see the type)
        let lag = wide::product(self.mantissa, velocity.unsigned_abs())
            .wrapping_shr(u32::from(self.fraction_bits));
        let limit = u64::from(self.limit_counts).wrapping_add(lag).cast_signed();

        let measured = i64::from(size);
        (measured > limit).then_some(Trip::new(FaultCause::FollowingError, measured, limit))
    }
}

/// Memory of a [`FollowingErrorMonitor`].
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
    /// A [`Refusal`] unless the threshold is 1 to 2^23 − 1, and of 0 samples:
    /// the one at rest would do.
    ///
    /// ```
    /// use firmware::monitor::{EncoderLossState, EncoderLossMonitor};
    ///
    /// let monitor = EncoderLossMonitor::accept(300, 2)?;
    /// let mut state = EncoderLossState::default();
    /// assert_eq!(monitor.check(&mut state, -300, 0), None);
    /// assert!(monitor.check(&mut state, -300, 0).is_some());
    /// assert_eq!(monitor.check(&mut state, -300, 1), None);
    /// # Ok::<(), firmware::Refusal>(())
    /// ```
    pub const fn accept(code_threshold: u32, ticks: u32) -> Result<Self, Refusal> {
        let codes = [1, Self::MAX_CODE_THRESHOLD];
        accepted!(What::EncoderLossCode.word_within(code_threshold, codes));
        accepted!(What::EncoderLossSamples.word_within(ticks, [1, u32::MAX]));
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
        let [samples, limit] = [state.samples, self.ticks];
        (samples >= limit).then_some(Trip::new(
            FaultCause::EncoderLoss,
            i64::from(samples),
            i64::from(limit),
        ))
    }
}

/// Memory of an [`EncoderLossMonitor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EncoderLossState {
    samples: u32,
}

/// Guards against an output that stands at a limit: an axis that cannot do what
/// it is asked to, because it is blocked or the motion asks too much.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SaturationMonitor {
    ticks: u32,
}

impl SaturationMonitor {
    /// Allows `ticks` samples in a row.
    ///
    /// # Errors
    /// A [`Refusal`] of 2^32 − 1, which the counter never passes.
    ///
    /// ```
    /// use firmware::monitor::{SaturationState, SaturationMonitor};
    ///
    /// let monitor = SaturationMonitor::accept(1)?;
    /// let mut state = SaturationState::default();
    /// assert_eq!(monitor.check(&mut state, true), None);
    /// assert!(monitor.check(&mut state, true).is_some());
    /// # Ok::<(), firmware::Refusal>(())
    /// ```
    pub const fn accept(ticks: u32) -> Result<Self, Refusal> {
        accepted!(What::SaturationSamples.word_within(ticks, [0, u32::MAX - 1]));
        Ok(Self { ticks })
    }

    /// Samples in a row that are allowed.
    pub const fn limit(&self) -> u32 {
        self.ticks
    }

    /// One sample: takes whether the output stands at a limit.
    #[inline]
    pub fn check(&self, state: &mut SaturationState, at_limit: bool) -> Option<Trip> {
        state.samples = lengthened(state.samples, at_limit);
        let [samples, limit] = [state.samples, self.ticks];
        (samples > limit).then_some(Trip::new(
            FaultCause::SaturationTooLong,
            i64::from(samples),
            i64::from(limit),
        ))
    }
}

/// Memory of a [`SaturationMonitor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SaturationState {
    samples: u32,
}

/// Checks that the control loop runs at every tick, once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickMonitor;

impl TickMonitor {
    /// One sample: takes the number of its tick, counted by the hardware timer
    /// and not by the loop. The first one may be any; after a trip the next one
    /// is compared with the number that came.
    ///
    /// ```
    /// use firmware::monitor::{TickState, TickMonitor};
    ///
    /// let mut state = TickState::default();
    /// assert_eq!(TickMonitor.check(&mut state, 41), None);
    /// assert_eq!(TickMonitor.check(&mut state, 42), None);
    /// let trip = TickMonitor.check(&mut state, 45).expect("43 and 44 are missing");
    /// assert_eq!(trip.measured, 2);
    /// ```
    #[inline]
    pub fn check(&self, state: &mut TickState, tick: u64) -> Option<Trip> {
        // Counted modulo 2^64, so that no end has to be looked at.
        let expected = state.expected.replace(tick.wrapping_add(1))?;
        let missed = tick.wrapping_sub(expected).cast_signed();
        (missed != 0).then_some(Trip::new(FaultCause::MissedTick, missed, 0))
    }
}

/// Memory of a [`TickMonitor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickState {
    /// The number that comes next; none before the first tick.
    expected: Option<u64>,
}

/// The length of a run of samples after one more; it ends where the condition
/// does, and stays at its largest value.
#[inline]
const fn lengthened(samples: u32, goes_on: bool) -> u32 {
    if goes_on {
        samples.saturating_add(1)
    } else {
        0
    }
}
