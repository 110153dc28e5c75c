//! Measuring the backlash: a routine that creeps to and fro and notes where
//! the load starts to follow.
//!
//! ```text
//! leg 1   creep +  until the load follows     engaged on the + flank
//! leg 2   creep −  until the load follows     engaged on the − flank:  gap G₁
//! leg 3   creep +  until the load follows     engaged on the + flank:  gap G₂
//! leg 4   creep −  until the load follows     engaged on the − flank:  gap G₃
//! ```
//!
//! with a pause before each leg but the first. Where the joint stands in its
//! gap at the start is unknown, so the first leg measures nothing. All three
//! gaps must agree within a tolerance. Two would not do: they share the
//! engagement of leg 2, and where that was seen too early, because the load
//! moved by itself or the motor ran over a tight spot, they would agree on a
//! gap that is too small. Of the four engagements no one is in all three gaps.
//!
//! The result is `B = (G₁ + G₃)/4`, in which each engagement counts once,
//! rounded once, half away from zero. At the end the axis rests on the − flank,
//! `B` behind the centre. A load that follows at once is no failure: its gap
//! is 0.
//!
//! The routine is a [`crate::SetpointSource`]; it gives positions only. The speed is
//! reached and left in one sample, so it must not exceed the axis' limit of
//! acceleration \[counts/sample²\]; feed-forward has nothing to add to it.
//!
//! # With an encoder on the load
//!
//! The load follows once its count has moved by `n` counts in the direction of
//! the creep. By then the motor has left the flank behind by the load's
//! travel, so this is subtracted, at the very same sample: on either flank
//!
//! ```text
//! m = P − ρ·l                                             [motor counts]
//! G = m(+ flank) − m(− flank)
//! ```
//!
//! with the motor's count `P`, the load's position `l` and `ρ` motor counts
//! per load count. `l` is an edge that the load has just crossed: the lower
//! one of the new count going up, the upper one going down. Without that the
//! gap would be short by `ρ`. An edge is seen one sample late at most, that is
//! `s` counts of creep, or one count where the motor follows each step of the
//! reference by itself; and a motor count is less than one below the position.
//! So `G` lies within −1 and `1 + 2·max(s, 1)` of the truth, and `B` within half
//! of that and half a count for its rounding: for `s ≤ 1` within −1 and 2.
//! `G` contains what friction winds up the joint on either flank, as does the
//! gap that a backlash compensation crosses.
//!
//! # By the effort
//!
//! The load resists once the code is at least `codes` in the direction of the
//! creep for `samples` samples on end. `codes` lies between the code of free
//! creep and the one that breaks the load away, `samples` beyond what the
//! start of a creep takes. It must be the code in the direction of the creep:
//! its magnitude still holds the push against the flank that is left behind.
//!
//! The motor arrives at a flank at the first of these samples, and drags the
//! load on from there. It leaves the flank where it stood furthest out, since
//! there it left the load:
//!
//! ```text
//! G = |furthest P on the flank left − P at the first sample on the other|
//! ```
//!
//! The flank is seen as late as an edge above and both are motor counts, so
//! `G` lies within −1 and `1 + max(s, 1)`, and `B` within −1 and 1.5 for `s ≤ 1`.
//!
//! # Ranges
//!
//! | quantity | unit | limit |
//! | --- | --- | --- |
//! | speed of creep | 2^−16 counts/sample | 1 to [`SPEED_MAX`] |
//! | longest creep | counts | 1 to [`CREEP_MAX`]; all four stay on one half of the wheel |
//! | `ρ` | 2^−16 | 1 to [`RATIO_MAX`]; `ρ·l` below 2^59, `m` below 2^60 |

mod error;
mod run;
mod settings;

pub use error::BacklashMeasurementError;
pub use run::BacklashMeasurementRun;
pub use settings::{BacklashMeasurementRefused, CREEP_MAX, Creep, Detection, RATIO_MAX, SPEED_MAX};

/// The routine with accepted settings. Immutable; [`BacklashMeasurement::start`] gives a
/// run of it.
///
/// ```
/// use firmware::{Creep, Detection, BacklashMeasurement, Next, Observed, SetpointSource};
///
/// // 1/4 count a sample; four load counts to one motor count.
/// let creep = Creep { speed: 1 << 14, longest_counts: 100, pause_samples: 10, tolerance_counts: 2 };
/// let detection = Detection::LoadEncoder { counts: 4, ratio: 1 << 14 };
/// let mut run = BacklashMeasurement::accept(creep, detection)?.start(0);
///
/// // A motor that stands where it is told to, and a load 7 counts to either side.
/// let (mut motor, mut load) = (0_i32, 3_i32);
/// loop {
///     load = load.clamp(motor - 7, motor + 7);
///     let seen = Observed { position: motor, load_position: Some(load * 4), code: 0 };
///     match run.next(&seen) {
///         Next::Setpoint(setpoint) => motor = setpoint.position,
///         Next::Last(_) | Next::Underrun => break,
///     }
/// }
/// assert_eq!(run.result().and_then(Result::ok).map(|gap| gap.half_counts), Some(7));
/// # Ok::<(), firmware::BacklashMeasurementRefused>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BacklashMeasurement {
    creep: Creep,
    detection: Detection,
}

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// `B`, the half gap \[motor counts\].
    pub half_counts: u32,
    /// The whole gap at each crossing, to the nearest \[motor counts\].
    pub full_counts: [i64; 3],
}
