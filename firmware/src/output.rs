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
//! * **Dither**: `ρ` uniform in [0, 1), from a generator with a seed. The mean
//!   code is then the sum, at the price of noise: the sum of `N` codes wanders
//!   about `Σy` by up to `½·√N` codes (standard deviation).

use crate::dac::Dac;
use crate::refusal::{Refusal, What, accepted};
use crate::settings::Words;

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
/// use firmware::law::{Law, LawInput, LawState, LawWords};
/// use firmware::output::{Output, Quantiser};
/// use firmware::{Dac, GainWord};
///
/// // 0.3 codes per count.
/// let words = LawWords { kp: GainWord::new(1_288_490_189, 32), ..LawWords::NONE };
/// let dac = Dac::with_bits(12)?;
/// let law = Law::accept(words, dac)?;
/// let output = Output::new(dac, None, Quantiser::ErrorFeedback)?;
/// let mut state = LawState::start(&output);
/// // The mean of the codes is the sum; the nearest would be 0.
/// let input = LawInput { error: 1, ..LawInput::default() };
/// let codes: i32 = (0..1_000).map(|_| law.step(&output, &mut state, &input)).sum();
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
        Ok(Self::limited(dac, slew, quantiser))
    }

    /// An output whose code may change by any step.
    pub const fn unlimited(dac: Dac, quantiser: Quantiser) -> Self {
        Self::limited(dac, Self::SLEW_MOST, quantiser)
    }

    /// That of checked settings.
    pub(crate) const fn of(settings: &Words) -> Self {
        let quantiser = match settings.quantiser() {
            0 => Quantiser::Nearest,
            1 => Quantiser::ErrorFeedback,
            _ => Quantiser::Dither {
                seed: settings.dither_seed(),
            },
        };
        Self::limited(
            Dac::of_bits(settings.dac_bits()),
            settings.slew_codes(),
            quantiser,
        )
    }

    /// All zeros, before an axis is started.
    pub(crate) const ZERO: Self = Self {
        dac: Dac::ZERO,
        slew: 0,
        quantiser: Quantiser::Nearest,
    };

    const fn limited(dac: Dac, slew: u32, quantiser: Quantiser) -> Self {
        Self {
            dac,
            slew: slew.cast_signed(),
            quantiser,
        }
    }

    /// Tells whether what rounding leaves is `ρ` of the next sample.
    #[inline(always)]
    pub(crate) const fn keeps_rest(&self) -> bool {
        matches!(self.quantiser, Quantiser::ErrorFeedback)
    }

    /// The same for another converter.
    pub(crate) const fn of_converter(mut self, dac: Dac) -> Self {
        self.dac = dac;
        self
    }

    /// Start of the dither's generator.
    pub(crate) const fn seed(&self) -> u32 {
        match self.quantiser {
            Quantiser::Dither { seed } => seed,
            Quantiser::Nearest | Quantiser::ErrorFeedback => 0,
        }
    }

    /// Tells whether `whole` is a code that can be reached from `code`, in steps of
    /// at most `slew` where there is such a limit.
    ///
    /// ```text
    /// 0 ≤ whole + 2^(n−1) < 2^n,   0 ≤ whole − code_prev + s ≤ 2·s
    /// ```
    #[inline(always)]
    pub(crate) const fn reaches(&self, code: i32, whole: i32, slew: Option<u32>) -> bool {
        let from_least = whole.wrapping_sub(self.dac.min_code()).cast_unsigned();
        let most = self.dac.max_code().cast_unsigned();
        from_least <= most.wrapping_mul(2).wrapping_add(1) && follows(code, whole, slew)
    }

    /// The same without the two codes at the ends.
    #[inline(always)]
    pub(crate) const fn reaches_within(&self, code: i32, whole: i32, slew: u32) -> bool {
        let most = self.dac.max_code().cast_unsigned();
        let from_second = whole.cast_unsigned().wrapping_add(most);
        from_second < most.wrapping_mul(2) && follows(code, whole, Some(slew))
    }

    /// Tells whether `ρ` is random.
    #[inline(always)]
    pub(crate) const fn dithers(&self) -> bool {
        matches!(self.quantiser, Quantiser::Dither { .. })
    }

    /// The code that can be reached from `code` and is nearest to `wanted`.
    #[inline(always)]
    pub(crate) fn nearest(&self, code: i32, wanted: i32) -> i32 {
        let mut nearest = wanted;
        if self.slew_codes().is_some() {
            // Codes have 24 bits, the step 25: no sum leaves 26.
            let [slowest, fastest] = [code.wrapping_sub(self.slew), code.wrapping_add(self.slew)];
            nearest = nearest.min(fastest).max(slowest);
        }
        nearest.min(self.dac.max_code()).max(self.dac.min_code())
    }

    /// The same, of an output that is no constant of the image.
    #[inline(never)]
    pub(crate) fn reachable(&self, code: i32, wanted: i32) -> i32 {
        self.nearest(code, wanted)
    }

    /// The converter.
    pub const fn dac(&self) -> Dac {
        self.dac
    }

    #[inline(always)]
    pub(crate) const fn slew(&self) -> u32 {
        self.slew.cast_unsigned()
    }

    /// Largest change of the code per sample \[codes\], where there is one.
    #[inline(always)]
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

/// `0 ≤ whole − code_prev + s ≤ 2·s`
#[inline(always)]
const fn follows(code: i32, whole: i32, slew: Option<u32>) -> bool {
    let Some(slew) = slew else { return true };
    let from_slowest = whole.wrapping_sub(code).cast_unsigned().wrapping_add(slew);
    from_slowest <= slew.wrapping_mul(2)
}
