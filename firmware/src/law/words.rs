//! Words that the law accepts, and the proof that nothing overflows.
//!
//! `E = 2^error_bits` is the largest error, `F = sum_fraction_bits` the
//! exponent of the sum, `Q = 2^integral_bits` codes the range of the integral,
//! `R = 2^(n−1)` codes that of the converter.
//!
//! # Accuracy
//!
//! A word is within half a unit of its last place of the gain that it stands
//! for. Products and sums are exact, so these roundings are the only error
//! before the quantiser:
//!
//! | term | integers | largest rounding \[codes\] | demand | allowed |
//! | --- | --- | --- | --- | --- |
//! | `Kp·e` | `\|e\| ≤ E` | `E·2^−(fp+1)` | `fp ≥ error_bits + 2` | 1/8 |
//! | `(Ki·Δt)·Σe` | `\|Σe\| ≤ S` | `S·2^−(fi+1)` | `S ≤ 2^(fi−1)` | 1/4 |
//! | `(Kd/Δt)·Δe` | `\|Δe\| ≤ D` | `D·2^−(fd+1)` | `D ≤ 2^fd` | 1/2 |
//! | filter of the derivative | 1 unit of `2^−h` | `(Kd/Δt)·2^−h` | `(Kd/Δt)·2^−h ≤ 1/16` | 1/16 |
//! | `Kv·v`, `Ka·a` | to 2^30 | `2^(29−f)` each | `f ≥ 35` | 1/32 |
//! | `Kf·sign(v)` | 1 | `2^−(f+1)` | `f ≥ 5` | 1/64 |
//! | together | | | | 63/64 |
//!
//! A gain of 0 has no rounding: any exponent up to `F` will do. The exact law has
//! the filter of the word `a`, not of the decimal that `a` was rounded from,
//! and no treatment of wind-up: a decision of the clamp can fall otherwise
//! for other gains, however near.
//!
//! The range of the sum of errors, `S`, is the smaller of `2^(fi−1)` and
//! `Q/(Ki·Δt)`; it must hold 2^8 errors of the largest size, or normal
//! operation would leave it.
//!
//! # Overflow
//!
//! The sum is an `i64` in units of 2^−F codes. With the largest magnitudes of
//! its parts
//!
//! ```text
//! Kp·E + FF + D-term + 3·Q + 3·R < 2^(62−F) codes
//! ```
//!
//! no order of adding them leaves 62 bits. Three times `Q` and `R`, because
//! one step may add `(Ki·Δt)·E ≤ Q/2^8`, and back-calculation the distance to
//! the limit, before the integral is held at `Q` again. Velocities and
//! accelerations of an `i32` beyond 2^30 double their terms at most, so that
//! even they stay within the 63 bits of an `i64`.
//!
//! # Derivative
//!
//! At small `Δt` one count of difference is worth thousands of codes. `Δe` is
//! held at the first count `D` whose term outweighs everything else,
//!
//! ```text
//! (Kd/Δt)·D ≥ Kp·E + FF + Q + 2·R,   D ≤ 2·E
//! ```
//!
//! Beyond `D` the sum has the sign of `Δe` and at least `2·R` codes, here as
//! in the exact law: both stand at the same end of the converter. With a
//! filter the held difference stays in its memory, so there it is a declared
//! range, and leaving it is flagged; `D ≤ 2^29` leaves the filter's differences
//! 31 bits. So is leaving `2·E` where not even that outweighs the rest: only a
//! measured difference can.

use super::filter::FilterWords;
use crate::counts::ErrorRange;
use crate::word::GainWord;

/// Quantity that the derivative is taken of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Derivative {
    /// `e − e_prev`: the paper's law.
    #[default]
    Error,
    /// `−(c − c_prev)`: a step of the setpoint gives no kick.
    Measurement,
}

/// Treatment of the integrator's wind-up while the output stands at a
/// limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AntiWindup {
    /// Not at all: the paper's law. The integral ends at its declared range.
    #[default]
    None,
    /// The integral takes the sum to the end of the headroom and no further
    /// out: beyond, it moves only where the error brings the sum back.
    Clamp,
    /// Beyond the headroom the integral is drawn back by the excess times
    /// `Δt/T_t`.
    BackCalculation {
        /// `Δt/T_t·2^31`, 1 to 2^31 − 1.
        tracking: i32,
    },
}

/// The law's gains and options as words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LawWords {
    /// `Kp` \[codes per count\].
    pub kp: GainWord,
    /// `Ki·Δt` \[codes per count\].
    pub ki_dt: GainWord,
    /// `Kd/Δt` \[codes per count\].
    pub kd_per_dt: GainWord,
    /// Velocity feed-forward \[codes per unit of [`crate::Setpoint::velocity`]\].
    pub velocity_ff: GainWord,
    /// Acceleration feed-forward \[codes per unit of
    /// [`crate::Setpoint::acceleration`]\].
    pub acceleration_ff: GainWord,
    /// Friction feed-forward \[codes\], with the sign of the velocity.
    pub friction_ff: GainWord,
    /// The declared errors are `|e| ≤ 2^error_bits` counts; 17 to 29.
    pub error_bits: u8,
    /// The sum counts `2^−F` codes; 33 to 40.
    pub sum_fraction_bits: u8,
    /// The integral stays within `±2^integral_bits` codes.
    pub integral_bits: u8,
    /// Quantity that the derivative is taken of.
    pub derivative: Derivative,
    /// Filter of the derivative.
    pub filter: Option<FilterWords>,
    /// Treatment of wind-up.
    pub anti_windup: AntiWindup,
}

/// Largest magnitude of [`crate::Setpoint::velocity`] and `acceleration`.
pub const LARGEST_RATE: u32 = 1 << 30;

impl LawWords {
    /// Smallest and largest `F`.
    pub const SUM_FRACTION_BITS: core::ops::RangeInclusive<u8> = 33..=40;

    /// No gain at all, every addition off: what the words of an axis are
    /// written against. `F` = 38, `Q` = 2^20 codes, errors up to 2^17 counts.
    pub const NONE: Self = {
        let none = GainWord::new(0, 0);
        Self {
            kp: none,
            ki_dt: none,
            kd_per_dt: none,
            velocity_ff: none,
            acceleration_ff: none,
            friction_ff: none,
            error_bits: ErrorRange::MIN_BITS,
            sum_fraction_bits: 38,
            integral_bits: 20,
            derivative: Derivative::Error,
            filter: None,
            anti_windup: AntiWindup::None,
        }
    };
}
