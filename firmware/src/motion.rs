//! Motion command with seven intervals (paper, Fig. 6) in stretches, planned in
//! integers.
//!
//! The acceleration is a quarter sine up (`t1`), constant (`t2`), a quarter
//! cosine down (`t3`), rest (`t4`), then the mirrored three below zero
//! (`t5`-`t7`). Any interval may be zero. Both amplitudes follow from zero
//! final speed and the travel `h`. [`MotionPlan`] computes once what its
//! [`Stretches`] need, a [`PlannedMotion`] keeps them, and [`Motion`] hands them
//! to an axis, of which any number can run the same one. A [`Planner`] does both in
//! one place, for a chip with little memory.
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
//! * The feed-forward is within 1/8 code of `Kv·v + Ka·a + Kf·sign(v)` of the
//!   exact command. At a jump the acceleration is that of what follows.
//!
//! # Equations
//!
//! Time is in samples, `τ` from the start of an interval of length `T`, where
//! position and velocity are `x0` and `v0`; `A` is the amplitude, `ω = π/(2·T)`
//! and `S = A/ω²`. Two integrations by hand give a line and a sine:
//!
//! ```text
//! constant  x = x0 + v0·τ + A·τ²/2
//! rise      x = x0     + (v0 + A/ω)·τ − S·sin ωτ,   v = v0 + (A/ω)·(1 − cos ωτ),   a = A·sin ωτ
//! fall      x = x0 + S +  v0·τ        − S·cos ωτ,   v = v0 + (A/ω)·sin ωτ,         a = A·cos ωτ
//! ```
//!
//! A stretch of `N` samples is the cubic through `x` at its first sample, at a
//! third and two thirds, and at the sample behind it; its feed-forward is the
//! parabola through three points. Both go over into differences of a sample,
//! rounded to 2^−32. Every stretch begins with the exact command: no error
//! outlives it. The sine is turned from point to point of an interval in numbers
//! of 62 bits (`real.rs`), and computed anew at the first sample of each.
//!
//! # Error
//!
//! | from | bound | where |
//! | --- | --- | --- |
//! | cubic through four points, `\|x⁗\| ≤ A·ω²` | `A·ω²·N⁴/1944 ≤ 1/8` count | sine |
//! | jerk to 2^−33, summed three times, `N ≤ 2^10` | `N³/6·2^−33 ≤ 0.021` counts | sine |
//! | acceleration to 2^−33, `N ≤ 2^10`; `N ≤ 2^14` | `N²/2·2^−33` ≤ 10^−4; 0.016 counts | sine; parabola |
//! | velocity to 2^−33, `N ≤ 2^26` | `N·2^−33 ≤ 0.008` counts | all |
//! | planning: 62 bits a number, up to 2^33 counts | 2^−20 counts | all |
//! | parabola through three points, `\|f‴\| ≤ Kv·A·ω² + Ka·A·ω³` | `\|f‴\|·N³/124.7 ≤ 1/16` code | sine |
//!
//! The largest sum is 0.16 < ¼ count, and below 1/8 code.
//!
//! # Range and cost
//!
//! Travels up to 2^31 counts, intervals up to 53 days together, sample times
//! from 1 ns to 4.29 s. Refused are, besides what is no motion, only speeds and
//! accelerations of 2^24 and more ([`crate::Refusal`]). Positions are modulo 2^32,
//! so that a motion may pass the end of the counter's range. A sample is five
//! additions of 64 bits; planning is done once a move, by a table of equations
//! (`equations.rs`) for the sake of its bytes: some 10^5 instructions a stretch.

mod equations;
mod numbers;
mod plan;
mod planner;
mod real;

pub use self::plan::{Motion, MotionPlan, PlannedMotion, Stretches};
pub use self::planner::{PlanHead, Planner};
