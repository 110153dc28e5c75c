//! The sampled PID law (eq. 23 at `t = k·Δt`) in fixed point.
//!
//! ```text
//! y = Kp·e + (Ki·Δt)·Σe + (Kd/Δt)·(e − e_prev)
//! ```
//!
//! `Σe` includes the present error; the difference is 0 at `k = 0`.
//!
//! # Proof that the sum is exact, and exactly odd
//!
//! A gain is `w·2^−f` with an integer `w`. Before the first step it is aligned
//! to the fraction bits of its term, 32 or 40, by a shift to the left, which
//! loses nothing. A term is then one integer product of gain and counts, the
//! sum three integer additions, each proven in [`crate::gains`] not to
//! overflow: no step rounds and none is cut off. Products and sums of integers
//! are odd in `e`, and so are the two limits that lie before them (`|e| ≤ E`,
//! `|Δe| ≤ D`). Thus the sequence `−e(0), −e(1), …` gives exactly `−y`, bit for
//! bit, as long as no error is `i32::MIN`, which has no opposite. A law with
//! truncating shifts gives `floor(−y)`, which is not `−floor(y)`: it creeps.
//!
//! The integral is kept as the sum of the products, not as the product of the
//! sum: the two are the same integer, and the product of a 43-bit gain and a
//! 40-bit sum would not fit a machine word.

use fixed::types::I24F40;

use crate::counts::{self, ErrorRange};
use crate::dac::{CodeSum, Codes};
use crate::gains::{Gain, PidWords};
use crate::refusal::Refusal;
use crate::word::power_of_two_or_most;

/// Step of the integral in one sample: 40 fraction bits, below 2^20 codes.
type IntegralStep = I24F40;

/// The PID law with accepted gains. Immutable; its memory is [`PidState`].
///
/// ```
/// use firmware::{Refusal, GainWord, Pid, PidState, PidWords};
///
/// // Kp = 3.2, Ki·Δt = 0.005, Kd/Δt = 50 codes per count: the paper at 1 ms.
/// let words = PidWords {
///     kp: GainWord::new(1_717_986_918, 29),
///     ki_dt: GainWord::new(1_374_389_535, 38),
///     kd_per_dt: GainWord::new(1_677_721_600, 25),
///     error_bits: 18,
/// };
/// let pid = Pid::accept(words)?;
/// assert_eq!(pid.error_limit(), 262_144);
/// assert_eq!(pid.error_sum_limit(), 1 << 35);
///
/// // y = 3.2·10 + 0.005·10 + 0 = 32.05 codes.
/// let mut state = PidState::default();
/// let there = pid.step(&mut state, 10);
/// assert_eq!(there.sum.round().to_string(), "32");
///
/// // Kp with 19 fraction bits where 20 are needed.
/// let coarse = PidWords { kp: GainWord::new(1_677_722, 19), ..words };
/// assert!(matches!(Pid::accept(coarse), Err(Refusal { least: 20, .. })));
/// # Ok::<(), Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pid {
    words: PidWords,
    range: ErrorRange,
    kp: Codes,
    ki_dt: IntegralStep,
    kd_per_dt: Codes,
    /// `D`: larger differences are held here \[counts\].
    slope_limit: i32,
    /// The integral at the limit of `Σe` \[codes\].
    integral_limit: CodeSum,
}

/// `word` with `fraction_bits` fraction bits, exactly.
fn aligned(gain: Gain, words: &PidWords, fraction_bits: u8) -> Result<i64, Refusal> {
    let word = match gain {
        Gain::Proportional => words.kp,
        Gain::Integral => words.ki_dt,
        Gain::Derivative => words.kd_per_dt,
    };
    word.aligned(fraction_bits).ok_or_else(|| {
        let least = gain.min_fraction_bits(words.error_bits);
        gain.fraction_bits(word, least)
    })
}

impl Pid {
    /// Accepts the words of the gains if the law with them stays within one
    /// code of the exact one and nothing can overflow ([`crate::gains`]).
    ///
    /// # Errors
    /// A [`Refusal`] that names the gain, its word and what is allowed.
    pub fn accept(words: PidWords) -> Result<Self, Refusal> {
        let range = words.check()?;
        let term = Gain::TERM_FRACTION_BITS;
        let integral = Gain::INTEGRAL_FRACTION_BITS;

        let kp = Codes::from_bits(aligned(Gain::Proportional, &words, term)?);
        let kd_per_dt = Codes::from_bits(aligned(Gain::Derivative, &words, term)?);
        let ki_dt = IntegralStep::from_bits(aligned(Gain::Integral, &words, integral)?);

        // (Ki·Δt)·2^s, at most 2^28 codes
        let integral_limit = CodeSum::from(ki_dt).wrapping_shl(words.error_sum_bits());

        Ok(Self {
            words,
            range,
            kp,
            ki_dt,
            kd_per_dt,
            slope_limit: words.slope_limit(range),
            integral_limit,
        })
    }

    /// One sample: takes the error `e` \[counts\], gives the sum `y` \[codes\]
    /// before rounding.
    pub fn step(&self, state: &mut PidState, error: i32) -> PidOutput {
        // The products and sums below cannot wrap (`gains`, section Overflow).
        let e = self.range.hold(error);

        // e − e_prev, 0 at k = 0; |e| ≤ 2^29, so the difference fits  [counts]
        let e_prev = state.previous_error.replace(e).unwrap_or(e);
        let slope = counts::within(e.wrapping_sub(e_prev), self.slope_limit);

        // Kp·e + (Kd/Δt)·(e − e_prev)                  eq. 23, 1st and 3rd term
        let proportional = self.kp.wrapping_mul_int(i64::from(e));
        let derivative = self.kd_per_dt.wrapping_mul_int(i64::from(slope));
        let direct = proportional.wrapping_add(derivative);

        // (Ki·Δt)·Σe ← (Ki·Δt)·Σe + (Ki·Δt)·e                 eq. 23, 2nd term
        let increment = self.ki_dt.wrapping_mul_int(i64::from(e));
        state.integral = state.integral.wrapping_add(CodeSum::from(increment));

        PidOutput {
            // y                                                          eq. 23
            sum: state.integral.wrapping_add(CodeSum::from(direct)),
            error_limited: e != error,
            error_sum_beyond_range: (state.integral > self.integral_limit)
                | (state.integral < self.integral_limit.wrapping_neg()),
        }
    }

    /// The words that were accepted.
    pub const fn words(&self) -> &PidWords {
        &self.words
    }

    /// `E`: errors up to this size are within the declared range \[counts\].
    pub const fn error_limit(&self) -> i32 {
        self.range.limit()
    }

    /// Largest `|Σe|` of the declared range \[counts\], 2^25 to 2^39.
    pub fn error_sum_limit(&self) -> u64 {
        power_of_two_or_most(self.words.error_sum_bits())
    }

    /// `D`: differences of successive errors beyond this one drive the code to
    /// its limit, whatever the other terms are, and are held here \[counts\].
    pub const fn slope_limit(&self) -> i32 {
        self.slope_limit
    }
}

/// Memory of the law: the previous error and the integral. The default is the
/// state before `k = 0`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PidState {
    /// `e(k−1)` \[counts\], within the error range; none before `k = 0`.
    previous_error: Option<i32>,
    /// `(Ki·Δt)·Σe` \[codes\].
    integral: CodeSum,
}

impl PidState {
    /// `(Ki·Δt)·Σe` up to the last sample \[codes\].
    pub const fn integral(&self) -> CodeSum {
        self.integral
    }

    /// The last error \[counts\], held within the error range; `None` before
    /// the first sample.
    pub const fn previous_error(&self) -> Option<i32> {
        self.previous_error
    }
}

/// Results of one step of the law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PidOutput {
    /// `y`, the sum before rounding \[codes\].
    pub sum: CodeSum,
    /// True if `|e|` was beyond the declared range and held at its limit.
    pub error_limited: bool,
    /// True if `|Σe|` is beyond the declared range.
    pub error_sum_beyond_range: bool,
}
