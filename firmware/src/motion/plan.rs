//! From travel and intervals to a plan.

use heapless::Vec;

use super::error::MotionError;
use super::interval::{chain, sample_from};
use super::piece::Piece;
use super::real::Real;

/// Fraction bits of velocity and acceleration at most.
const OUTPUT_BITS_MAX: i32 = 60;
/// The intervals together last at most this long \[ps\].
const DURATION_MAX_PS: u64 = 1 << 62;

/// A motion that can be generated: checked and computed once.
///
/// ```
/// use firmware::MotionPlan;
///
/// // 2^20 counts in four quarter waves of 0.25 s, at 1 ms.
/// let quarter_ps = 250_000_000_000;
/// let intervals_ps = [quarter_ps, 0, quarter_ps, 0, quarter_ps, 0, quarter_ps];
/// let plan = MotionPlan::new(1 << 52, intervals_ps, 1_000_000)?;
/// assert_eq!(plan.last_sample(), 1_000);
/// // The peak is 2^21 counts per second, 2^11.03 per sample, in 30 bits.
/// assert_eq!(plan.velocity_fraction_bits(), 18);
/// # Ok::<(), firmware::MotionError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MotionPlan {
    /// Those of the intervals that have samples, for the travel's magnitude.
    pub(super) pieces: Vec<Piece, 7>,
    pub(super) head: PlanHead,
}

/// A plan without its pieces; the default is no motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlanHead {
    /// −1 where the travel is negative, otherwise 0.
    pub sign: i32,
    /// The end of the motion, `floor(h + ½)` \[counts, modulo 2^32\].
    pub end: i32,
    /// Number of the sample at which the motion has ended.
    pub last_sample: u64,
    /// Fraction bits of the setpoints' velocities.
    pub velocity_fraction_bits: u8,
    /// Fraction bits of the setpoints' accelerations.
    pub acceleration_fraction_bits: u8,
}

impl MotionPlan {
    /// The motion over `travel` \[2^−32 counts\] in the intervals `t1` to `t7`
    /// \[ps\], with a sample every `period_ns` from its start on.
    ///
    /// # Errors
    /// [`MotionError`] if there is no acceleration or no deceleration, or what
    /// is asked for cannot be generated to a quarter of a count.
    pub fn new(travel: i64, intervals_ps: [u64; 7], period_ns: u32) -> Result<Self, MotionError> {
        if period_ns == 0 {
            return Err(MotionError::Period);
        }
        if travel == i64::MIN {
            return Err(MotionError::Travel { travel });
        }
        let total_ps = intervals_ps
            .iter()
            .fold(0_u64, |sum, &t| sum.saturating_add(t));
        if total_ps > DURATION_MAX_PS {
            return Err(MotionError::Duration { total_ps });
        }
        // Below 2^42.
        let period_ps = u64::from(period_ns).saturating_mul(1_000);
        let (peak, intervals) = chain(travel.unsigned_abs(), intervals_ps, period_ps)?;

        let velocity_bits = output_bits(peak).ok_or_else(|| MotionError::Speed {
            counts_per_sample: rounded(peak),
        })?;
        let mut acceleration_bits = OUTPUT_BITS_MAX;
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            let largest = interval.largest_acceleration();
            let bits = output_bits(largest).ok_or_else(|| MotionError::Acceleration {
                interval: interval.number,
                counts_per_sample2: rounded(largest),
            })?;
            acceleration_bits = acceleration_bits.min(bits);
        }

        let mut pieces = Vec::new();
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            // There is room for all seven.
            let _ = pieces.push(interval.piece(velocity_bits, acceleration_bits)?);
        }
        let half = 1_i128 << 31_u32;
        let end = i128::from(travel).wrapping_add(half).wrapping_shr(32);
        let [a, b, c, d, ..] = end.to_le_bytes();
        Ok(Self {
            pieces,
            head: PlanHead {
                sign: i32::from(travel < 0).wrapping_neg(),
                end: i32::from_le_bytes([a, b, c, d]),
                last_sample: sample_from(total_ps, period_ps),
                velocity_fraction_bits: u8::try_from(velocity_bits).unwrap_or(0),
                acceleration_fraction_bits: u8::try_from(acceleration_bits).unwrap_or(0),
            },
        })
    }

    /// No motion: the axis stays at 0.
    pub const fn at_rest() -> Self {
        Self {
            pieces: Vec::new(),
            head: PlanHead {
                sign: 0,
                end: 0,
                last_sample: 0,
                velocity_fraction_bits: 0,
                acceleration_fraction_bits: 0,
            },
        }
    }

    /// The plan less its pieces.
    pub const fn head(&self) -> PlanHead {
        self.head
    }

    /// The pieces in their order.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Begins a plan that another machine has computed; its pieces follow. In
    /// place: a plan is too large to pass over a chip's stack.
    pub fn begin(&mut self, head: PlanHead) {
        self.pieces.clear();
        self.head = head;
    }

    /// Adds the next piece; `None` if there is no room for it.
    pub fn push(&mut self, piece: Piece) -> Option<()> {
        self.pieces.push(piece).ok()
    }

    /// Fraction bits of the setpoints' velocities, 0 to 60.
    pub const fn velocity_fraction_bits(&self) -> u8 {
        self.head.velocity_fraction_bits
    }

    /// Fraction bits of the setpoints' accelerations, 0 to 60.
    pub const fn acceleration_fraction_bits(&self) -> u8 {
        self.head.acceleration_fraction_bits
    }

    /// Number of the sample at which the motion has ended; the first is 0.
    pub const fn last_sample(&self) -> u64 {
        self.head.last_sample
    }

    /// The travel, rounded \[counts, modulo 2^32\].
    pub const fn end(&self) -> i32 {
        self.head.end
    }
}

/// Fraction bits that bring a peak to 2^29 to 2^30; none if it is larger.
fn output_bits(peak: Real) -> Option<i32> {
    let bits = 30_i32.saturating_sub(peak.bits());
    (bits >= 0).then_some(bits.min(OUTPUT_BITS_MAX))
}

/// Magnitude in whole units, for messages.
fn rounded(value: Real) -> u64 {
    u64::try_from(value.to_fixed(0).unsigned_abs()).unwrap_or(u64::MAX)
}
