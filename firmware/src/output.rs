//! From the law's sum to the converter's code: slew limit, quantiser, range.
//!
//! ```text
//! code = clamp(floor(y + ρ), low, high)
//! low  = max(−2^(n−1),     code_prev − s)        s: largest step per sample
//! high = min(2^(n−1) − 1,  code_prev + s)
//! ```
//!
//! The three quantisers differ in `ρ`, which lies in [0, 1) codes:
//!
//! * **Nearest** (the paper): `ρ = ½`. A sum that stands still between two
//!   codes gives one of them for ever; an integrator behind it then hunts.
//! * **Error feedback**: `ρ(0) = ½`, and what `floor` cuts off is kept:
//!   `ρ ← y + ρ − code`. This is first-order noise shaping: the error of the
//!   codes is the difference of two successive `ρ`, so their sum over `N`
//!   samples telescopes, `Σcode = Σy + ρ(0) − ρ(N)`: it is never off by a
//!   whole code, however long it runs. The codes for `+y` and `−y` therefore
//!   add up to `1 − ρ⁺(N) − ρ⁻(N)`, at most 1 in size: their means are
//!   opposite to within 1 code/N. At a limit nothing is carried over.
//! * **Dither**: `ρ` uniform in (0, 1), from a generator with a seed. The mean
//!   code is then the sum, at the price of noise: the sum of `N` codes wanders
//!   about `Σy` by up to `½·√N` codes (standard deviation).

use crate::dac::Dac;
use crate::refusal::{Refusal, What, accepted};
use crate::wide::upper;

/// The codes that this sample can reach, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    low: i32,
    high: i32,
}

impl Window {
    /// The whole range of a converter.
    pub const fn of(dac: Dac) -> Self {
        Self {
            low: dac.min_code(),
            high: dac.max_code(),
        }
    }

    /// Smallest code.
    pub const fn low(self) -> i32 {
        self.low
    }

    /// Largest code.
    pub const fn high(self) -> i32 {
        self.high
    }

    /// Tells whether the upper word of `sum` alone tells that it is within: both ends
    /// fill theirs alone, so it mostly does.
    #[inline(always)]
    pub(crate) fn surely_holds(self, sum: i64, fraction_bits: u8) -> bool {
        let low = upper(sum_of(self.low, fraction_bits));
        let high = upper(sum_of(self.high, fraction_bits));
        let above = upper(sum).wrapping_sub(low).cast_unsigned();
        above < high.wrapping_sub(low).cast_unsigned()
    }

    /// Distance of `sum` beyond the window, 0 inside; in the unit of the sum,
    /// 2^−`fraction_bits` codes, below 2^62.
    #[inline(always)]
    pub fn excess(self, sum: i64, fraction_bits: u8) -> i64 {
        let low = sum_of(self.low, fraction_bits);
        let high = sum_of(self.high, fraction_bits);
        if sum > high {
            sum.wrapping_sub(high)
        } else if sum < low {
            sum.wrapping_sub(low)
        } else {
            0
        }
    }
}

/// A code in units of 2^−F codes. F is at least 33, so that only the upper
/// word is shifted; a code has 24 bits and F − 32 is at most 8, so it fits.
#[inline(always)]
pub(crate) fn sum_of(code: i32, fraction_bits: u8) -> i64 {
    let upper = code.wrapping_shl(u32::from(fraction_bits).wrapping_sub(32));
    i64::from(upper).wrapping_shl(32)
}

/// Way from a sum to a whole code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Quantiser {
    /// The nearest code, halves up: the paper's.
    #[default]
    Nearest,
    /// The part that rounding cuts off is added to the next sample.
    ErrorFeedback,
    /// Random rounding whose mean is the sum.
    Dither {
        /// Start of the generator; any value.
        seed: u32,
    },
}

/// Parameters of the output: converter, slew limit and quantiser.
///
/// ```
/// use firmware::Dac;
/// use firmware::output::{Output, OutputState, Quantiser};
///
/// let output = Output::new(Dac::with_bits(12)?, None, Quantiser::ErrorFeedback)?;
/// let mut state = output.start();
/// // 0.3 codes: the mean of the codes is the sum, nearest would give 0.
/// let sum = (3_i64 << 38) / 10;
/// let codes: i32 = (0..1_000)
///     .map(|_| {
///         let window = output.window(&state);
///         output.code(&mut state, sum, 38, window)
///     })
///     .sum();
/// assert_eq!(codes, 300);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    dac: Dac,
    /// Largest step per sample \[codes\]; larger than any where there is none.
    slew: i32,
    quantiser: Quantiser,
}

/// Memory of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OutputState {
    /// The last code.
    code: i32,
    /// `ρ − ½` \[2^−F codes\].
    remainder: i64,
    /// Of the dither's generator.
    random: u32,
}

impl OutputState {
    /// The last code.
    pub const fn code(&self) -> i32 {
        self.code
    }

    /// Forgets what rounding kept: its unit is that of the sum, which other
    /// words may change.
    pub(crate) const fn forget_remainder(&mut self) {
        self.remainder = 0;
    }
}

impl Output {
    /// Largest slew limit, the whole range of the widest converter \[codes\].
    pub const SLEW_MOST: u32 = 1 << 24;

    /// An output whose codes change by at most `slew_codes` per sample.
    ///
    /// # Errors
    /// [`Refusal`] for a slew limit that is not 1 to 2^24 codes.
    pub const fn new(
        dac: Dac,
        slew_codes: Option<u32>,
        quantiser: Quantiser,
    ) -> Result<Self, Refusal> {
        let slew = match slew_codes {
            None => Self::SLEW_MOST,
            Some(codes) => codes,
        };
        accepted!(What::SlewCodes.word_within(slew, [1, Self::SLEW_MOST]));
        Ok(Self {
            dac,
            slew: slew.cast_signed(),
            quantiser,
        })
    }

    /// The same for another converter.
    pub(crate) const fn of_converter(mut self, dac: Dac) -> Self {
        self.dac = dac;
        self
    }

    /// The memory before the first sample: code 0, the generator at its seed.
    pub const fn start(&self) -> OutputState {
        OutputState {
            code: 0,
            remainder: 0,
            random: match self.quantiser {
                Quantiser::Dither { seed } => seed,
                Quantiser::Nearest | Quantiser::ErrorFeedback => 0,
            },
        }
    }

    /// The codes that can be reached from the last one.
    #[inline(always)]
    pub fn window(&self, state: &OutputState) -> Window {
        if self.slew == Output::SLEW_MOST.cast_signed() {
            // Wider than any converter.
            return Window::of(self.dac);
        }
        // Codes have 24 bits, the step 25: no sum leaves 26.
        Window {
            low: self.dac.min_code().max(state.code.wrapping_sub(self.slew)),
            high: self.dac.max_code().min(state.code.wrapping_add(self.slew)),
        }
    }

    /// The code for a sum in units of 2^−`fraction_bits` codes (33 to 40),
    /// |sum| < 2^62.
    #[inline(always)]
    pub fn code(
        &self,
        state: &mut OutputState,
        sum: i64,
        fraction_bits: u8,
        window: Window,
    ) -> i32 {
        // F − 32: how far the point lies above the lower word.
        let above = u32::from(fraction_bits).wrapping_sub(32);
        let half = 1_i32.wrapping_shl(above.wrapping_sub(1));
        // y + ρ − ½, below 2^62 + 2^40
        let shifted = match self.quantiser {
            Quantiser::Nearest => sum,
            Quantiser::ErrorFeedback => sum.wrapping_add(state.remainder),
            Quantiser::Dither { .. } => sum.wrapping_add(state.uniform(above)),
        };
        // floor(y + ρ): the half lies in the upper word, and so does the code.
        let whole = upper(shifted).wrapping_add(half).wrapping_shr(above);
        let code = whole.min(window.high).max(window.low);
        if self.quantiser == Quantiser::ErrorFeedback {
            state.remainder = if code == whole {
                shifted.wrapping_sub(sum_of(whole, fraction_bits))
            } else {
                0
            };
        }
        state.code = code;
        code
    }

    /// One step towards code 0, for a drive that is switched off in order.
    pub fn towards_zero(&self, state: &mut OutputState) -> i32 {
        state.code = 0
            .max(state.code.wrapping_sub(self.slew))
            .min(state.code.wrapping_add(self.slew));
        state.forget_remainder();
        state.code
    }

    /// Code 0 at once: the safe output of a fault.
    pub const fn safe(&self, state: &mut OutputState) -> i32 {
        state.code = 0;
        state.forget_remainder();
        0
    }

    /// The converter.
    pub const fn dac(&self) -> Dac {
        self.dac
    }

    /// Largest change of the code per sample \[codes\], where there is one.
    pub const fn slew_codes(&self) -> Option<u32> {
        let codes = self.slew.cast_unsigned();
        if codes == Output::SLEW_MOST {
            None
        } else {
            Some(codes)
        }
    }

    /// Way from a sum to a whole code.
    pub const fn quantiser(&self) -> Quantiser {
        self.quantiser
    }
}

impl OutputState {
    /// Uniform in (−½, ½) codes, in units of 2^−(32 + `above`): every one of
    /// 2^32 values, each in the middle of its cell, once in a period.
    #[inline(always)]
    fn uniform(&mut self, above: u32) -> i64 {
        // A linear congruential generator of full period (Numerical Recipes,
        // section 7.1, "quick and dirty"): modulo 2^32, its upper bits are
        // what rounding looks at.
        self.random = self
            .random
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        // (2·random + 1)/2^33 − ½ codes, a multiple of 2^−33
        let cell = i64::from(self.random.cast_signed().wrapping_sub(i32::MIN))
            .wrapping_shl(1)
            .wrapping_add(1);
        cell.wrapping_shl(above.wrapping_sub(1))
    }
}
