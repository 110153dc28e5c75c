//! Following error: the distance of the axis from its setpoint.

use super::MonitorError;
use crate::faults::{FaultCause, Trip};
use crate::product;
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
/// # Ok::<(), firmware::MonitorError>(())
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
    /// [`MonitorError::LimitCounts`] unless the limit is 1 to 2^31 − 1,
    /// [`MonitorError::Negative`] for a lag below 0, [`MonitorError::FractionBits`]
    /// where lag and velocity have more than 62 fraction bits together.
    pub const fn accept(
        limit_counts: u32,
        per_speed: GainWord,
        velocity_fraction_bits: u8,
    ) -> Result<Self, MonitorError> {
        if limit_counts == 0 || limit_counts > Self::MAX_LIMIT_COUNTS {
            return Err(MonitorError::LimitCounts { limit_counts });
        }
        if per_speed.mantissa < 0 {
            return Err(MonitorError::Negative { per_speed });
        }
        let fraction_bits = per_speed
            .fraction_bits
            .saturating_add(velocity_fraction_bits);
        if fraction_bits > Self::MAX_FRACTION_BITS {
            return Err(MonitorError::FractionBits {
                per_speed,
                velocity_fraction_bits,
            });
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
        let lag = product::unsigned(self.mantissa, velocity.unsigned_abs())
            .wrapping_shr(u32::from(self.fraction_bits));
        let limit = u64::from(self.limit_counts).wrapping_add(lag).cast_signed();

        let measured = i64::from(size);
        (measured > limit).then_some(Trip {
            cause: FaultCause::FollowingError,
            measured,
            limit,
        })
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
