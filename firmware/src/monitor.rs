//! Limits of the four monitors over an axis. The axis looks at them in every
//! sample, and stops with a [`crate::Fault`] when one is passed.
//!
//! | monitor | trips when |
//! | --- | --- |
//! | [`FollowingErrorMonitor`] | `\|e\| > a + s·\|v_ref\|` |
//! | [`EncoderLossMonitor`] | `\|code\|` ≥ threshold and no count for `ticks` samples in a row |
//! | [`SaturationMonitor`] | output at a limit for more than `ticks` samples in a row |
//! | [`TickMonitor`] | a tick is not the successor of the last one |
//!
//! A monitor goes on tripping while its condition lasts; the axis latches the fault
//! that was the first.

use crate::refusal::{Refusal, What, accepted};
use crate::word::GainWord;

/// Monitors the distance of the axis from its setpoint.
///
/// Without feed-forward an axis follows at a distance that grows with its
/// speed, `v` over the velocity gain, so a fixed limit would have to allow at
/// rest what is only normal at full speed. `s` is that lag \[samples\], a word
/// `w·2^−f`, and `V` the setpoint's speed cut off to 2^−16 counts per sample.
/// `|e|` and `a` are whole, so that one product and one shift decide without
/// any error:
///
/// ```text
/// |e| > a + floor(w·V·2^−(f + 16))
/// ```
///
/// The right side is the largest `|e|` that is allowed, which is what a fault has
/// to report. Rounding the speed to whole counts per sample or the product to the
/// nearest count would decide wrongly.
///
/// | value | magnitude | of |
/// | --- | --- | --- |
/// | `\|e\|` | ≤ 2^31 | 2^32 |
/// | `a` | < 2^31 | 2^32 |
/// | `w·V` | < 2^31·2^32 = 2^63 | 2^64 |
/// | `f` | ≤ 46; beyond, the second part would always be 0 | 64 − 16 |
///
/// ```
/// use firmware::monitor::FollowingErrorMonitor;
/// use firmware::GainWord;
///
/// // 200 counts at rest and 2.5 samples of lag; velocities in 2^-16 counts/sample.
/// let monitor = FollowingErrorMonitor::accept(200, GainWord::new(5, 1), 16)?;
/// assert_eq!(monitor.limits(), (200, GainWord::new(5, 1)));
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FollowingErrorMonitor {
    /// `a` \[counts\].
    limit_counts: u32,
    /// `s = w·2^−f`.
    per_speed: GainWord,
    /// Fraction bits of the setpoints' velocities.
    velocity_fraction_bits: u8,
}

/// Speeds are taken in 2^−16 counts per sample.
pub(crate) const SPEED_BITS: u32 = 16;

impl FollowingErrorMonitor {
    /// Largest limit at rest \[counts\]: `|e|` can only just pass it.
    pub const MAX_LIMIT_COUNTS: u32 = i32::MAX.cast_unsigned();
    /// Most fraction bits of the lag.
    pub const MAX_FRACTION_BITS: u8 = 46;

    /// A limit of `limit_counts` at rest, and of `per_speed` more for each
    /// count per sample of the setpoint, that is a lag \[samples\]; the
    /// setpoint's velocity has `velocity_fraction_bits` fraction bits.
    ///
    /// # Errors
    /// A [`Refusal`] unless the limit is 1 to 2^31 − 1, of a lag below 0 or with
    /// more than 46 fraction bits.
    pub const fn accept(
        limit_counts: u32,
        per_speed: GainWord,
        velocity_fraction_bits: u8,
    ) -> Result<Self, Refusal> {
        accepted!(What::FollowingError.word_within(limit_counts, [1, Self::MAX_LIMIT_COUNTS]));
        accepted!(What::Lag(per_speed).not_negative(per_speed.mantissa));
        let most = [0, Self::MAX_FRACTION_BITS];
        accepted!(What::LagFractionBits(per_speed).byte_within(per_speed.fraction_bits, most));
        accepted!(What::VelocityFractionBits.byte_within(velocity_fraction_bits, [0, 60]));
        Ok(Self {
            limit_counts,
            per_speed,
            velocity_fraction_bits,
        })
    }

    /// The limit at rest \[counts\], and the lag \[samples\].
    pub const fn limits(&self) -> (u32, GainWord) {
        (self.limit_counts, self.per_speed)
    }

    /// Fraction bits of the setpoints' velocities.
    pub const fn velocity_fraction_bits(&self) -> u8 {
        self.velocity_fraction_bits
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
    /// use firmware::monitor::EncoderLossMonitor;
    ///
    /// assert_eq!(EncoderLossMonitor::accept(300, 2)?.limits(), (300, 2));
    /// assert!(EncoderLossMonitor::accept(0, 2).is_err());
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
    /// use firmware::monitor::SaturationMonitor;
    ///
    /// assert_eq!(SaturationMonitor::accept(1)?.limit(), 1);
    /// assert!(SaturationMonitor::accept(u32::MAX).is_err());
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
}

/// Checks that the control loop runs at every tick, once, by the number of its
/// tick, which the hardware timer counts and not the loop. The first one may be
/// any; after a trip the next one is compared with the number that came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickMonitor;
