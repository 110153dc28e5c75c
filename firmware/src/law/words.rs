//! Words that the law (eq. 23) accepts, and the proof that nothing overflows.
//!
//! `E = 2^error_bits` is the largest error, `Q = 2^integral_bits` codes the
//! declared range of the integral, `R = 2^(n−1)` codes that of the converter.
//!
//! # Accuracy
//!
//! A word is within half a unit of its last place of the gain that it stands
//! for. Products and sums are exact, so these roundings are the only error
//! before the one rounding to a code:
//!
//! | term | integers | largest rounding \[codes\] | demand | allowed |
//! | --- | --- | --- | --- | --- |
//! | `Kp·e` | `\|e\| ≤ E` | `E·2^−(fp+1)` | `fp ≥ error_bits + 2` | 1/8 |
//! | `(Ki·Δt)·Σe` | `\|Σe\| ≤ S` | `S·2^−(fi+1)` | `S ≤ 2^(fi−1)` | 1/4 |
//! | `(Kd/Δt)·Δe` | `\|Δe\| ≤ D` | `D·2^−(fd+1)` | `D ≤ 2^fd` | 1/2 |
//! | filter of the derivative | 1 unit of `2^−h` | `(Kd/Δt)·2^−h` | `(Kd/Δt)·2^−h ≤ 1/16` | 1/16 |
//! | `Kv·v`, `Ka·a` | below 2^24 | `2^(23−f)` each | `f ≥ 29` | 1/32 |
//! | `Kf·sign(v)` | 1 | `2^−(f+1)` | `f ≥ 5` | 1/64 |
//! | together | | | | 63/64 |
//!
//! The last 64th is slack for gains that reach their word through arithmetic of
//! 53 bits instead of exactly. Two sums that lie at most 1 apart give codes that
//! lie at most 1 apart: `floor` steps once in every unit, and a limit never
//! moves two values away from each other.
//!
//! A gain of 0 has no rounding: any exponent up to 32 will do. The exact law has
//! the filter of the word `a`, not of the decimal that `a` was rounded from,
//! and no treatment of wind-up: a decision of the clamp can fall otherwise
//! for other gains, however near.
//!
//! The declared range of the sum of errors, `S`, is the smaller of `2^(fi−1)` and
//! `Q/(Ki·Δt)`; it must hold 2^8 errors of the largest size, or normal
//! operation would leave it. Leaving it is told in samples whose output is at a
//! limit and whose integral is not clamped. With 32 fraction bits a constant error of 2^17
//! fills it in 2^14 samples, one of 100 counts in 2^24.
//!
//! # Overflow
//!
//! The sum has 31 bits of codes above its point. With the largest magnitudes of
//! its terms, `T = Kp·E + (Kd/Δt)·D + FF + (Ki·Δt)·E`, the demand is
//!
//! ```text
//! T + R ≤ 2^30 codes
//! ```
//!
//! Then `|I| ≤ 2^30` always: within the window `I = y − direct` is at most
//! `R + T`; beyond it the clamp moves `I` inwards or to where the sum is in the
//! window, and the other two treatments hold it at 2^30. So the sum stays below
//! `2^30 + T < 2^31`. Velocities and accelerations beyond 2^24 are held there.
//!
//! A term is a product of two factors of 31 bits (`term`): one below 2^29 codes
//! always has them, one of 2^29 to 2^30 codes has them or is refused by name.
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
//! range, and leaving it is told; `D ≤ 2^29` leaves the filter's differences
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
    /// Not at all: the paper's law.
    #[default]
    None,
    /// The integral takes the sum to the last code and no further out: beyond,
    /// it moves only where the error brings the sum back.
    Clamp,
    /// Beyond the last code the integral is drawn back by the excess times
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
    /// The declared integral stays within `±2^integral_bits` codes; 0 to 30.
    pub integral_bits: u8,
    /// Quantity that the derivative is taken of.
    pub derivative: Derivative,
    /// Filter of the derivative.
    pub filter: Option<FilterWords>,
    /// Treatment of wind-up.
    pub anti_windup: AntiWindup,
}

/// Velocities and accelerations of a setpoint are smaller than this.
pub const LARGEST_RATE: u32 = 1 << 24;

impl LawWords {
    /// No gain at all, every addition off: what the words of an axis are
    /// written against. `Q` = 2^20 codes, errors up to 2^17 counts.
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
            integral_bits: 20,
            derivative: Derivative::Error,
            filter: None,
            anti_windup: AntiWindup::None,
        }
    };
}
