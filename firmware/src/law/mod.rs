//! The axis' law: the paper's PID (eq. 23) with the additions that an
//! axis in service needs, in one 64-bit sum.
//!
//! ```text
//! y = Kp·e + (Ki·Δt)·Σe + (Kd/Δt)·δ + Kv·v + Ka·a + Kf·sign(v)
//!     δ = e − e_prev  or  −(c − c_prev),  filtered or not
//! ```
//!
//! Everything that [`crate::Pid`] promises holds here: words with an exponent
//! of their own, exact products, exact sums, one rounding behind them, the sum
//! before rounding exactly odd. What differs is the integral: it is bounded
//! (`Q`, [`words`]), which is what lets the sum fit 64 bits, and it can be
//! kept from winding up. With every addition off the codes are those of the
//! paper's law, bit for bit, as long as `|Σe|` stays within the declared range.
//!
//! # Wind-up
//!
//! The headroom is what the converter really has left at this sample: its
//! range, cut by the slew limit ([`crate::output::Window`]), against a sum
//! that contains the feed-forward. [`AntiWindup::Clamp`] refuses the part of
//! the integral's step that would push a sum beyond the headroom further out:
//! not the whole step, or a slew limit below `(Ki·Δt)·e` would stop the integral
//! for ever.
//! [`AntiWindup::BackCalculation`] makes the step and takes back the excess
//! times `Δt/T_t`, rounded to `2^−F` codes with halves away from zero.
//!
//! # Bumpless transfer
//!
//! Once the axis is enabled ([`LawState::take_over`]), or its gains change in
//! motion, the next sample puts the integral where the sum equals the last
//! code: the output goes on from where it stands. That needs an integral gain;
//! without one the integral would keep the difference for ever, so then it
//! starts from zero. And it needs the other terms to be within `Q` of the code;
//! beyond, the integral starts at its end and says so.

mod bounds;
pub mod filter;
mod step;
mod term;
pub mod words;

pub use crate::word::Part;
pub use filter::FilterWords;
pub use words::{AntiWindup, Derivative, LawWords};

use crate::dac::Dac;
use crate::refusal::{Refusal, accepted};
use bounds::Aligned;

/// The law with accepted words. Immutable; its memory is [`LawState`].
///
/// ```
/// use firmware::law::{Law, LawInput, LawState, LawWords};
/// use firmware::output::Window;
/// use firmware::{Dac, GainWord};
///
/// // Kp = 3.2, Ki·Δt = 0.005, Kd/Δt = 50 codes per count: the paper at 1 ms.
/// let words = LawWords {
///     kp: GainWord::new(1_717_986_918, 29),
///     ki_dt: GainWord::new(1_374_389_535, 38),
///     kd_per_dt: GainWord::new(1_677_721_600, 25),
///     error_bits: 18,
///     sum_fraction_bits: 38,
///     integral_bits: 20,
///     ..LawWords::NONE
/// };
/// let dac = Dac::with_bits(14)?;
/// let law = Law::accept(words, dac)?;
///
/// // y = 3.2·10 + 0.005·10 + 0 = 32.05 codes, in units of 2^−38 of them.
/// let mut state = LawState::default();
/// let input = LawInput { error: 10, ..LawInput::default() };
/// let y = law.step(&mut state, &input, Window::of(dac)).sum;
/// assert_eq!((y * 100 + (1 << 37)) >> 38, 3_205);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
///
/// # As a constant
///
/// If the words are known when the image is built, so is the law. Options
/// that are off then cost nothing at run time, and limits and gains stand in
/// the instructions. Words that are refused end the build:
///
/// ```
/// use firmware::law::{Law, LawWords};
/// use firmware::output::{Output, Quantiser};
/// use firmware::{Axis, Dac, GainWord};
///
/// const AXIS: Axis = {
///     let words = LawWords { kp: GainWord::new(1 << 29, 29), ..LawWords::NONE };
///     let Ok(dac) = Dac::with_bits(12) else { panic!("bits of the converter") };
///     let Ok(law) = Law::accept(words, dac) else { panic!("words of the law") };
///     let Ok(output) = Output::new(dac, None, Quantiser::Nearest) else { panic!("slew limit") };
///     Axis::new(law, output)
/// };
/// assert_eq!(AXIS.law().error_limit(), 1 << 17);
/// ```
///
/// A gain of the same size with too few fraction bits for the accuracy:
///
/// ```compile_fail,E0080
/// # use firmware::law::{Law, LawWords};
/// # use firmware::output::{Output, Quantiser};
/// # use firmware::{Axis, Dac, GainWord};
/// const AXIS: Axis = {
///     let words = LawWords { kp: GainWord::new(1 << 18, 18), ..LawWords::NONE };
///     let Ok(dac) = Dac::with_bits(12) else { panic!("bits of the converter") };
///     let Ok(law) = Law::accept(words, dac) else { panic!("words of the law") };
///     let Ok(output) = Output::new(dac, None, Quantiser::Nearest) else { panic!("slew limit") };
///     Axis::new(law, output)
/// };
/// # assert_eq!(AXIS.law().error_limit(), 1 << 17);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Law {
    /// True if any feed-forward is not zero.
    feeds_forward: bool,
    aligned: Aligned,
    words: LawWords,
    /// The converter that the words were accepted for.
    dac: Dac,
}

impl Law {
    /// Accepts words if the law with them stays within one code of the exact
    /// one over the declared ranges, and nothing can overflow ([`words`]).
    ///
    /// # Errors
    /// A [`Refusal`] that names the part, its word and what is allowed.
    #[inline(always)]
    pub const fn accept(words: LawWords, dac: Dac) -> Result<Self, Refusal> {
        let aligned = accepted!(words.check(dac));
        let feeds_forward = words.velocity_ff.mantissa != 0
            || words.acceleration_ff.mantissa != 0
            || words.friction_ff.mantissa != 0;
        Ok(Self {
            words,
            aligned,
            feeds_forward,
            dac,
        })
    }

    /// The converter that the words were accepted for.
    pub const fn dac(&self) -> Dac {
        self.dac
    }

    /// The words that were accepted.
    pub const fn words(&self) -> &LawWords {
        &self.words
    }

    /// `E`: errors up to this size are within the declared range \[counts\].
    pub const fn error_limit(&self) -> i32 {
        self.aligned.range.limit()
    }

    /// `S`: largest `|Σe|` of the declared range \[counts\].
    pub const fn error_sum_limit(&self) -> u64 {
        self.aligned.error_sum_limit
    }

    /// `D`: differences beyond this one are held here \[counts\].
    pub const fn slope_limit(&self) -> i32 {
        self.aligned.slope_limit
    }

    /// Largest magnitude of a term over the declared ranges \[2^−F codes\]; of
    /// the integral, of one step of it.
    pub const fn largest_term(&self, part: Part) -> u64 {
        match part {
            Part::Proportional => self.aligned.largest.proportional,
            Part::Integral => self.aligned.largest.integral,
            Part::Derivative => self.aligned.largest.derivative,
            Part::Velocity => self.aligned.largest.velocity,
            Part::Acceleration => self.aligned.largest.acceleration,
            Part::Friction => self.aligned.friction.unsigned_abs(),
        }
    }

    /// Bits that are left above the largest sum that the declared ranges allow.
    pub const fn headroom_bits(&self) -> u32 {
        self.aligned.headroom_bits
    }
}

/// Inputs of the law in one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LawInput {
    /// `e` \[counts\].
    pub error: i32,
    /// `c − c_prev` of the motor \[counts\].
    pub difference: i32,
    /// `v` of the setpoint, in its source's unit, below 2^30.
    pub velocity: i32,
    /// `a` of the setpoint, in its source's unit, below 2^30.
    pub acceleration: i32,
    /// True if the error is within the dead band of an axis at rest: it counts
    /// as 0 for `Kp` and `Ki`. Its difference does not, or the band's edge
    /// would be a step of the derivative.
    pub within_dead_band: bool,
    /// True if the integral stands still: an axis at rest may ask for it.
    pub hold_integral: bool,
}

/// Results of the law in one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawOutput {
    /// `y` before rounding \[2^−F codes\].
    pub sum: i64,
    /// True if `|e|` was beyond the declared range and held at its limit.
    pub error_limited: bool,
    /// True if a difference was beyond its declared range and held at its
    /// limit; not where the limit is one that outweighs everything else.
    pub difference_limited: bool,
    /// True if the integral was held at the end of its declared range.
    pub integral_limited: bool,
}

/// Memory of the law. The default is the state before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LawState {
    /// `(Ki·Δt)·Σe` \[2^−F codes\].
    integral: i64,
    /// The filter's memory.
    filtered: i64,
    /// `e(k−1)` \[counts\].
    previous_error: i32,
    phase: Phase,
    /// `h` of the filter whose memory that is.
    filter_bits: Option<u8>,
}

impl LawState {
    /// Before a first sample that goes on from `code`, the last one that the
    /// converter was given: after enabling, or with other gains than before.
    /// A code outside the window of that sample counts as its nearer end.
    pub const fn take_over(code: i32) -> Self {
        Self {
            integral: 0,
            filtered: 0,
            previous_error: 0,
            phase: Phase::TakeOver(code),
            filter_bits: None,
        }
    }

    /// The next sample comes with other words; it goes on from `code`, the last
    /// one that the converter was given.
    pub(crate) const fn change_over(&mut self, code: i32) {
        self.phase = match self.phase {
            Phase::First | Phase::TakeOver(_) => Phase::TakeOver(code),
            Phase::Running | Phase::ChangeOver(_) => Phase::ChangeOver(code),
        };
    }

    /// `(Ki·Δt)·Σe` \[2^−F codes\].
    pub const fn integral(&self) -> i64 {
        self.integral
    }
}

/// Memory that a sample begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Phase {
    /// Nothing: no error and no difference came before.
    #[default]
    First,
    /// As the first, but the output goes on from this code.
    TakeOver(i32),
    /// The memory of the sample before, but the output goes on from this code.
    ChangeOver(i32),
    /// The memory of the sample before.
    Running,
}

impl Phase {
    /// Tells whether the sample before was one of this law's.
    const fn goes_on(self) -> bool {
        matches!(self, Self::Running | Self::ChangeOver(_))
    }
}
