//! The control law: the paper's PID (eq. 23 at `t = k·Δt`) with the additions
//! that an axis in service needs, in one 64-bit sum of 32 fraction bits.
//!
//! ```text
//! y = Kp·e + (Ki·Δt)·Σe + (Kd/Δt)·δ + Kv·v + Ka·a + Kf·sign(v)
//!     δ = e − e_prev  or  −(c − c_prev),  filtered or not
//! code = floor(y + ρ), limited
//! ```
//!
//! `Σe` includes the present error; the difference is 0 at `k = 0`. With every
//! addition off and `ρ = ½` this is the paper's law.
//!
//! # The sum is exact, and exactly odd
//!
//! A gain is `w·2^−f` with an integer `w` and `f` at most 32. A term is one
//! integer product of gain and counts, the sum three integer additions, proven
//! in [`words`] not to overflow: nothing rounds and nothing is cut off. Products
//! and sums of integers are odd, and so are the two limits that lie before them
//! (`|e| ≤ E`, `|δ| ≤ D`). Thus the errors `−e(0), −e(1), …` give exactly `−y`,
//! bit for bit, as long as the output is not at a limit. A law with truncating
//! shifts gives `floor(−y)`, which is not `−floor(y)`: it creeps.
//!
//! With 32 fraction bits the upper word of the sum is the code and the lower
//! one what rounding leaves, so that one test of the upper word tells whether
//! range or slew limit are left, whether wind-up is to be treated and whether a
//! remainder is kept.
//!
//! # Wind-up
//!
//! What the output cannot give is `x` codes, a whole number: beyond the
//! converter's range, cut by the slew limit ([`crate::output`]), of a sum
//! that contains the feed-forward. [`AntiWindup::Clamp`] refuses the part of the
//! integral's step that would push the sum further out: a step of `x` codes or
//! more ends in the last code, a smaller one is not made. (Refusing every step
//! would stop the integral for ever under a slew limit below `(Ki·Δt)·e`.)
//! [`AntiWindup::BackCalculation`] makes the step and takes back `x·Δt/T_t`. An
//! integral without a gain is none, and stays as it is.
//!
//! # Bumpless transfer
//!
//! Once the axis is enabled, or its gains change in motion, [`Law::begin`] puts
//! the integral where the sum equals the code in force: the output goes on from
//! where it stands. That needs an integral gain; without one the integral would
//! keep the difference for ever, so then it starts from zero.

mod bounds;
pub mod filter;
mod step;
pub(crate) mod term;
pub mod words;

pub use crate::word::Part;
pub use filter::FilterWords;
use filter::Filtered;
pub(crate) use step::{Inputs, Sum, TAKES_OVER};
pub use words::{AntiWindup, Derivative, LawWords};

use crate::dac::{Codes, Dac, HALF};
use crate::output::Output;
use crate::settings::Words;
use words::LARGEST_RATE;

/// The law with accepted words. Immutable; its memory is [`LawState`].
///
/// ```
/// use firmware::law::{Begin, Law, LawInput, LawState, LawWords};
/// use firmware::output::{Output, Quantiser};
/// use firmware::{Dac, GainWord};
///
/// // Kp = 3.2, Ki·Δt = 0.005, Kd/Δt = 50 codes per count: the paper at 1 ms.
/// let words = LawWords {
///     kp: GainWord::new(1_717_986_918, 29),
///     ki_dt: GainWord::new(21_474_836, 32),
///     kd_per_dt: GainWord::new(1_677_721_600, 25),
///     ..LawWords::NONE
/// };
/// let dac = Dac::with_bits(14)?;
/// let law = Law::accept(words, dac)?;
///
/// // y = 3.2·10 + 0.005·10 + 0 = 32.05 codes.
/// let output = Output::new(dac, None, Quantiser::Nearest)?;
/// let mut state = LawState::start(&output);
/// let input = LawInput { error: 10, ..LawInput::default() };
/// assert_eq!(law.begin(&output, &mut state, &input, Begin::AtRest), 32);
/// // 32.1 codes.
/// assert_eq!(law.step(&output, &mut state, &input), 32);
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
pub struct Law {
    /// Words that its samples read; those of no concern to it are off.
    pub(crate) settings: Words,
    words: LawWords,
    /// The converter that the words were accepted for.
    dac: Dac,
    /// `S` \[counts\].
    error_sum_limit: u64,
    /// Bits left above the largest sum.
    headroom_bits: u32,
}

impl Law {
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
        self.settings.error_limit_counts().cast_signed()
    }

    /// `S`: largest `|Σe|` of the declared range \[counts\].
    pub const fn error_sum_limit(&self) -> u64 {
        self.error_sum_limit
    }

    /// `D`: differences beyond this one are held here \[counts\].
    pub const fn difference_limit(&self) -> i32 {
        self.settings.difference_limit_counts().cast_signed()
    }

    /// Tells whether the output is at an end of its range beyond
    /// [`Law::difference_limit`], whatever the other terms are; else that is the
    /// end of a declared range.
    pub const fn difference_outweighs(&self) -> bool {
        self.settings.difference_is_declared() == 0 && self.settings.kd_per_dt_mantissa() != 0
    }

    /// Largest magnitude of a term over the declared ranges \[2^−32 codes\]; of
    /// the integral, of one step of it.
    pub const fn largest_term(&self, part: Part) -> u64 {
        let settings = &self.settings;
        let mut differences = settings.difference_limit_counts();
        if settings.filter_smoothing() != 0 {
            // D·2^h + 1 units of a filtered difference.
            differences = differences.wrapping_mul(settings.filter_scale());
            differences = differences.wrapping_add(1);
        }
        let limit = match part {
            Part::Proportional | Part::Integral => settings.error_limit_counts(),
            Part::Derivative => differences,
            Part::Velocity | Part::Acceleration => LARGEST_RATE,
            Part::Friction => 1,
        };
        settings.gain(part).largest(limit)
    }

    /// Bits that are left above the largest sum that the declared ranges allow.
    pub const fn headroom_bits(&self) -> u32 {
        self.headroom_bits
    }
}

/// Inputs of the law in one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LawInput {
    /// `e` \[counts\].
    pub error: i32,
    /// `c − c_prev` of the motor \[counts\].
    pub difference: i32,
    /// `v` of the setpoint, in its source's unit, below [`words::LARGEST_RATE`].
    pub velocity: i32,
    /// `a` of the setpoint, in its source's unit, below [`words::LARGEST_RATE`].
    pub acceleration: i32,
    /// Feed-forward that the source has computed itself \[codes\].
    pub ahead: Codes,
    /// True if the error is within the dead band of an axis at rest: it counts
    /// as 0 for `Kp` and `Ki`. Its difference does not, or the band's edge
    /// would be a step of the derivative.
    pub within_dead_band: bool,
    /// True if the integral stands still: an axis at rest may ask for it.
    pub hold_integral: bool,
}

/// Terms of a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Terms {
    /// Everything but the integral \[codes\].
    pub direct: Codes,
    /// `(Ki·Δt)·e`, by which the integral grows \[codes\].
    pub step: Codes,
}

/// Memory that a sample begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Begin {
    /// That of the sample before: a usual one.
    #[default]
    GoingOn,
    /// None: no error and no difference came before.
    AtRest,
    /// None, but the output goes on from the code in force.
    FromCode,
    /// That of a law with other gains; the output goes on from the code in
    /// force.
    OtherGains,
}

/// Memory of the law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct LawState {
    /// `(Ki·Δt)·Σe` \[codes\].
    integral: Codes,
    /// `ρ` of the error feedback \[2^−32 codes\].
    remainder: u32,
    /// The last code.
    code: i32,
    /// `e(k−1)` \[counts\].
    previous_error: i32,
    /// Of the dither's generator.
    random: u32,
    /// The filter's memory.
    filtered: Filtered,
    /// What filter that is of, 0 without a memory ([`step`]).
    filter_of: u32,
    /// True if a declared range was left since this was last asked.
    pub(crate) left_range: bool,
}

impl LawState {
    /// Before the first sample, which [`Law::begin`] makes: code 0, the
    /// generator of the dither at its seed.
    pub const fn start(output: &Output) -> Self {
        let mut state = Self::ZERO;
        state.start_in_place(output);
        state
    }

    /// The same in memory that is all zeros.
    pub(crate) const fn start_in_place(&mut self, output: &Output) {
        self.remainder = HALF;
        self.random = output.seed();
    }

    /// All zeros, before it is started.
    pub(crate) const ZERO: Self = Self {
        integral: Codes::ZERO,
        remainder: 0,
        code: 0,
        previous_error: 0,
        random: 0,
        filtered: Filtered::ZERO,
        filter_of: 0,
        left_range: false,
    };

    /// `(Ki·Δt)·Σe` \[codes\].
    pub const fn integral(&self) -> Codes {
        self.integral
    }

    /// The last code.
    pub const fn code(&self) -> i32 {
        self.code
    }

    /// Draws `ρ` of the next sample, where the output dithers.
    #[inline(always)]
    pub(crate) fn dither(&mut self, output: &Output) {
        if output.dithers() {
            // A linear congruential generator of full period (Numerical
            // Recipes, section 7.1, "quick and dirty"): modulo 2^32, its upper
            // bits are what rounding looks at.
            self.random = self
                .random
                .wrapping_mul(1_664_525)
                .wrapping_add(1_013_904_223);
            self.remainder = self.random;
        }
    }

    /// Forgets what rounding has left, and goes on within the converter's codes.
    pub(crate) fn begin_rounding(&mut self, output: &Output) {
        self.code = output.reachable(self.code, self.code);
        self.remainder = HALF;
    }

    /// One step towards code 0, for a drive that is switched off in order.
    pub fn towards_zero(&mut self, output: &Output) -> i32 {
        self.code = output.reachable(self.code, 0);
        self.remainder = HALF;
        self.code
    }

    /// Code 0 at once: the safe output of a fault.
    pub const fn safe(&mut self) -> i32 {
        self.code = 0;
        self.remainder = HALF;
        0
    }

    /// Tells whether a declared range was left since this was last asked: an
    /// error was held, a difference that does not outweigh the other terms, or
    /// the sum of errors was beyond its range in a sample whose output was at a
    /// limit. In other samples nobody looks at the sum of errors.
    #[inline(always)]
    pub const fn take_left_range(&mut self) -> bool {
        core::mem::replace(&mut self.left_range, false)
    }
}
