//! The law of the product: the paper's PID (eq. 23) with the additions that an
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
//! # No bump
//!
//! When the axis is enabled ([`LawState::take_over`]), or its gains change in
//! motion, the next sample puts the integral where the sum equals the last
//! code: the output goes on from where it stands. That needs an integral gain;
//! without one the integral would keep the difference for ever, so then it
//! starts from zero. And it needs the other terms to be within `Q` of the code;
//! beyond, the integral starts at its end and says so.

mod error;
pub mod filter;
mod term;
pub mod words;

pub use error::{LawError, Part};
pub use filter::FilterWords;
pub use words::{AntiWindup, Derivative, LawWords};

use crate::counts::{self, ErrorRange};
use crate::dac::Dac;
use crate::output::{self, Window};
use words::Aligned;

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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Law {
    words: LawWords,
    aligned: Aligned,
    /// Whether any feed-forward is not zero.
    feeds_forward: bool,
    /// The converter that the words were accepted for.
    dac: Dac,
}

/// What one sample brings to the law.
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
    /// Whether the error is within the dead band of an axis at rest: it counts
    /// as 0 for `Kp` and `Ki`. Its difference does not, or the band's edge
    /// would be a step of the derivative.
    pub within_dead_band: bool,
    /// Whether the integral stands still: an axis at rest may ask for it.
    pub hold_integral: bool,
}

/// What one sample of the law gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawOutput {
    /// `y` before rounding \[2^−F codes\].
    pub sum: i64,
    /// Whether `|e|` was beyond the declared range and held at its limit.
    pub error_limited: bool,
    /// Whether a difference was beyond its declared range and held at its
    /// limit; not where the limit is one that outweighs everything else.
    pub difference_limited: bool,
    /// Whether the integral was held at the end of its declared range.
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

/// What a sample begins with.
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
    /// Whether the sample before was one of this law's.
    const fn goes_on(self) -> bool {
        matches!(self, Self::Running | Self::ChangeOver(_))
    }
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

impl LawWords {
    /// No gain at all, every addition off: what the words of an axis are
    /// written against. `F` = 38, `Q` = 2^20 codes, errors up to 2^17 counts.
    pub const NONE: Self = {
        let none = crate::GainWord::new(0, 0);
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

impl Law {
    /// Accepts words if the law with them stays within one code of the exact
    /// one over the declared ranges, and nothing can overflow ([`words`]).
    ///
    /// # Errors
    /// A [`LawError`] that names the part, its word and what is allowed.
    pub fn accept(words: LawWords, dac: Dac) -> Result<Self, LawError> {
        let aligned = words.check(dac)?;
        let feeds_forward = [words.velocity_ff, words.acceleration_ff, words.friction_ff]
            .map(|word| word.mantissa != 0);
        Ok(Self {
            words,
            aligned,
            feeds_forward: feeds_forward.contains(&true),
            dac,
        })
    }

    /// One sample: the sum `y` for the errors and the motion of this sample.
    ///
    /// The sums below cannot wrap ([`words`], section Overflow).
    pub fn step(&self, state: &mut LawState, input: &LawInput, window: Window) -> LawOutput {
        let law = &self.aligned;
        let e = law.range.hold(input.error);
        let error_limited = e != input.error;

        let phase = core::mem::replace(&mut state.phase, Phase::Running);

        // Kp·e + (Kd/Δt)·δ                              eq. 23, 1st and 3rd term
        let (derivative, difference_limited) = self.derivative(state, input, e, phase);
        let e = if input.within_dead_band { 0 } else { e };
        let pd = law.proportional.times(e).wrapping_add(derivative);
        // Kv·v + Ka·a + Kf·sign(v)
        let direct = if self.feeds_forward {
            pd.wrapping_add(self.feed_forward(input))
        } else {
            pd
        };

        let integral = match phase {
            // I with y = the last code, which the window holds: in range, it
            // can be shifted
            Phase::TakeOver(code) | Phase::ChangeOver(code) if !law.integral.is_zero() => {
                let code = code.min(window.high()).max(window.low());
                output::sum_of(code, self.words.sum_fraction_bits).wrapping_sub(direct)
            }
            // A step that an integral gain of 0 would keep for ever.
            Phase::TakeOver(_) | Phase::ChangeOver(_) => 0,
            _ if input.hold_integral => state.integral,
            _ => self.integrated(state.integral, e, direct, window),
        };
        let held = self.within_range(integral);
        state.integral = held;

        LawOutput {
            // y                                                          eq. 23
            sum: direct.wrapping_add(held),
            error_limited,
            difference_limited,
            integral_limited: held != integral,
        }
    }

    /// `|I| ≤ Q`, held at its end.
    #[inline]
    fn within_range(&self, integral: i64) -> i64 {
        let limit = self.aligned.integral_limit;
        // Q is a power of two and fills the upper word alone, in which one
        // addition and one comparison tell for all but Q itself.
        let [above, whole] = [integral.wrapping_add(limit), limit].map(output::upper);
        if above.cast_unsigned() < whole.wrapping_mul(2).cast_unsigned() {
            integral
        } else {
            integral.min(limit).max(limit.wrapping_neg())
        }
    }

    /// `(Kd/Δt)·δ` \[2^−F codes\], and whether a δ was held that does not
    /// outweigh everything else.
    fn derivative(
        &self,
        state: &mut LawState,
        input: &LawInput,
        e: i32,
        phase: Phase,
    ) -> (i64, bool) {
        let law = &self.aligned;
        let e_prev = core::mem::replace(&mut state.previous_error, e);
        let difference = match self.words.derivative {
            // e − e_prev; |e| ≤ 2^29, so the difference fits          [counts]
            Derivative::Error if phase.goes_on() => e.wrapping_sub(e_prev),
            Derivative::Error => 0,
            // −(c − c_prev); its only magnitude without an opposite is held
            Derivative::Measurement => input.difference.saturating_neg(),
        };
        let held = counts::within(difference, law.slope_limit);
        let Some(filter) = self.words.filter else {
            state.filter_bits = None;
            let outweighs = law.slope_limit < law.range.limit().wrapping_mul(2);
            return (law.derivative.times(held), held != difference && !outweighs);
        };
        if phase != Phase::Running {
            let most = filter::settled(filter, law.slope_limit);
            let bits = Some(filter.fraction_bits);
            state.filtered = if phase.goes_on() && state.filter_bits == bits {
                // The speed is what it was; other words may declare less of it.
                state.filtered.min(most).max(most.wrapping_neg())
            } else {
                // Nothing was filtered yet: start settled, without a transient.
                filter::settled(filter, held)
            };
            state.filter_bits = bits;
        }
        let filtered = filter::step(filter, &mut state.filtered, held);
        (law.derivative.times(filtered), held != difference)
    }

    fn feed_forward(&self, input: &LawInput) -> i64 {
        let law = &self.aligned;
        let friction = i64::from(input.velocity.signum()).wrapping_mul(law.friction);
        law.velocity
            .times(input.velocity)
            .wrapping_add(law.acceleration.times(input.acceleration))
            .wrapping_add(friction)
    }

    /// The integral after this sample.
    #[inline]
    fn integrated(&self, integral: i64, e: i32, direct: i64, window: Window) -> i64 {
        // (Ki·Δt)·Σe ← (Ki·Δt)·Σe + (Ki·Δt)·e                 eq. 23, 2nd term
        let next = integral.wrapping_add(self.aligned.integral.times(e));
        let sum = next.wrapping_add(direct);
        let bits = self.words.sum_fraction_bits;
        match self.words.anti_windup {
            AntiWindup::None => next,
            // Beyond the headroom, and e pushes further out: up to its end, if
            // the sum was not there before.
            AntiWindup::Clamp => match window.excess(sum, bits) {
                excess if excess > 0 && e > 0 => next.wrapping_sub(excess).max(integral),
                excess if excess < 0 && e < 0 => next.wrapping_sub(excess).min(integral),
                _ => next,
            },
            AntiWindup::BackCalculation { tracking } => {
                // I ← I + (u − y)·Δt/T_t
                next.wrapping_sub(term::scaled(window.excess(sum, bits), tracking))
            }
        }
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
    pub fn largest_term(&self, part: Part) -> u64 {
        match part {
            Part::Proportional => self.aligned.proportional.largest(),
            Part::Integral => self.aligned.integral.largest(),
            Part::Derivative => self.aligned.derivative.largest(),
            Part::Velocity => self.aligned.velocity.largest(),
            Part::Acceleration => self.aligned.acceleration.largest(),
            Part::Friction => self.aligned.friction.unsigned_abs(),
        }
    }

    /// Bits that are left above the largest sum that the declared ranges allow.
    pub const fn headroom_bits(&self) -> u32 {
        self.aligned.headroom_bits
    }
}
