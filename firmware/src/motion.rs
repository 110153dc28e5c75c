//! Motion command with seven intervals (paper, Fig. 6), generated sample by
//! sample in integers.
//!
//! The acceleration is a quarter sine up (`t1`), constant (`t2`), a quarter
//! cosine down (`t3`), rest (`t4`), then the mirrored three below zero
//! (`t5`-`t7`). Any interval may be zero. Both amplitudes follow from zero
//! final speed and the travel `h`. [`MotionPlan`] computes once what
//! [`MotionGenerator`] needs at every sample; [`MotionState`] is all that
//! changes, so that any number of axes can run the same plan.
//!
//! # Promises
//!
//! * Sample `k` stands for `t = k·Δt`, counted from the start of the motion.
//!   Before its one rounding, `floor(x + ½)`, the position is within ¼ count
//!   of the exact command, so that the rounded one is within ¾ of it, and is
//!   the nearest integer wherever the exact command is not within ¼ of a half.
//! * From the first sample at or after the end it is exactly `floor(h + ½)`,
//!   at rest, and reported as [`crate::Next::Last`].
//! * A mirrored travel gives exactly mirrored sums: those of the magnitude are
//!   formed, and the sign comes just before the rounding.
//! * Velocity and acceleration are within `3 + N·2^−27` units of theirs, where
//!   `N` is the number of samples of the interval; the exponents are such that
//!   the peaks lie between 2^23 and 2^24 units (60 fraction bits at most). At a
//!   jump the acceleration is that of what follows.
//!
//! # Equations
//!
//! Time is in samples, `τ` from the start of an interval of length `T`, where
//! position and velocity are `x0` and `v0`; `A` is the amplitude, `ω = π/(2·T)`
//! and `S = A/ω²`. Two integrations by hand give a line and a sine:
//!
//! ```text
//! constant  x = x0 + v0·τ + A·τ²/2
//! rise      x = x0     + (v0 + A/ω)·τ − S·sin φ,   φ = ω·τ
//! fall      x = x0 + S +  v0·τ        − S·sin φ,   φ = ω·τ + π/2
//!           v =          slope of line − S·ω·cos φ,   a = S·ω²·sin φ
//! ```
//!
//! The parabola is summed by its differences. The sine is turned: with
//! `s = S·sin φ`, `c` = `S·cos φ` half a sample later, and `ε = 2·sin(ω/2)`,
//!
//! ```text
//! s ← s + ε·c,   c ← c − ε·s
//! ```
//!
//! is exact, as `sin(φ+ω) − sin φ = ε·cos(φ+ω/2)`; and the cosine at the sample
//! is the mean of the two beside it over `cos(ω/2)`. Line and sine are computed
//! anew at the first sample of every interval, from the exact whole number of
//! picoseconds that it comes after the interval's start: no error outlives its
//! interval, and there is none from the resolution of time. An interval with
//! one sample needs no turning; with two or more `ω < π/2`.
//!
//! # Error of the position, in counts
//!
//! The sine has `Fy` fraction bits such that `S·2^Fy` lies between 2^61 and
//! 2^62. `N` is the number of samples of the interval.
//!
//! | from | bound | where |
//! | --- | --- | --- |
//! | turning: 1.5 units a product (`piece.rs`), two a sample. One unit off in `s` or `c` never becomes more than `1/cos(ω/2) ≤ √2` units in `s` | `√2·3·N·2^−Fy` | sine |
//! | `ε` to 2^−63: `φ` is off by at most `√2·2^−63` a sample, `S < 2^(62−Fy)` | `0.71·N·2^−Fy` | sine |
//! | `s` and `c` at the first sample, to a unit each | `2·√2·2^−Fy` | sine |
//! | together for `N ≥ 2`, with `N ≤ 2^(Fy−5)` | `6.4·N·2^−Fy ≤ 0.2` | sine |
//! | differences to 2^−63, with `N ≤ 2^30` | `(N/2 + N²/4)·2^−62 ≤ 0.07` | parabola |
//! | the step of a line to 2^−63, with `N < 2^32` | `N·2^−63 ≤ 2^−31` | line |
//! | the sine cut off where it meets the line | 2^−30 | sine |
//! | planning: 62 bits a number, 40 operations in a row, up to 2^33 counts | 2^−23 | all |
//!
//! The largest sum is 0.2 + 2^−30 + 2^−22 < ¼. What `N` may be follows from `Fy`,
//! that is from `S`, at most 1.75 times what the interval travels: 2^25
//! samples, 9 hours at 1 ms, for `S` of 2^32 counts, and more for less. Measured
//! over 1.67·10^7 samples with `S` of 2^30: 0.0015 counts.
//!
//! At a change of interval the sum returns to the exact command by what it was
//! off. There, a motion that is slower than that per sample may go back by one
//! count: after 10^6 samples, one slower than 0.007 counts a sample.
//!
//! # Error of velocity and acceleration, in their units
//!
//! | from | velocity | acceleration |
//! | --- | --- | --- |
//! | rounding | 0.5 | 0.5 |
//! | weight to half a unit, times `2^31·2^−30` and `2^30·2^−29` | 1 | 1 |
//! | low words left out, about their mean: 1 and ½ units times the weight, `√2·2^30·2^−30` and `2^30·2^−29`, and 1/64 for the margin of `S` | 1.44 | 1.02 |
//! | drift of cosine and sine, `6.4·N·2^−32` in each word, times the same | `N·2^−27.7` | `N·2^−28.3` |
//!
//! With constant acceleration the velocity is summed in `2^−30` units: at most
//! `0.5 + (N + 1)·2^−31`.
//!
//! # Range and cost
//!
//! Travels up to 2^31 counts, intervals up to 53 days together, sample times
//! from 1 ns to 4.29 s. Refused are, besides what is no motion, only speeds and
//! accelerations of 2^24 and more and the intervals with too many samples
//! ([`crate::Refusal`]). Positions are modulo 2^32, so that a motion may pass the
//! end of the counter's range. Per sample there are eight products 32×32→64, no
//! division and nothing wider than 64 bits; planning divides and uses 128.

mod interval;
pub mod piece;
mod plan;
mod real;
#[cfg(test)]
mod tests;

pub use self::plan::{MotionGenerator, MotionPlan, MotionState, PlanHead};
