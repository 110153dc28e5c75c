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

use thiserror::Error;

use crate::counts::{difference, wrap};
use crate::reference::{Next, Observed, Setpoint, SetpointSource};
use crate::refusal::{Refusal, What};

/// Fastest creep, 256 counts per sample \[2^−16 counts per sample\].
pub const SPEED_MAX: u32 = 1 << 24;

/// Longest creep \[counts\].
pub const CREEP_MAX: u32 = 1 << 28;

/// Most motor counts per load count, 4096 \[2^−16\].
pub const RATIO_MAX: u32 = 1 << 28;

/// Evidence that the load follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detection {
    /// By the load's own encoder, which must count up where the motor's does.
    LoadEncoder {
        /// `n`, by which the load's count must have moved since the creep
        /// started, at least 1; 2 where it may flicker by one \[load counts\].
        counts: u32,
        /// `ρ`, motor counts per load count \[2^−16\].
        ratio: u32,
    },
    /// By the code that it takes.
    Effort {
        /// Smallest code that free creep never takes for `samples` samples on
        /// end, at least 1 \[codes\].
        codes: u32,
        /// Time for which it must be taken, at least 1 \[samples\].
        samples: u32,
    },
}

/// Settings of the creep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Creep {
    /// Speed \[2^−16 motor counts per sample\].
    pub speed: u32,
    /// The load must follow within this distance, which each leg starts anew
    /// \[motor counts\].
    pub longest_counts: u32,
    /// Rest between two legs \[samples\].
    pub pause_samples: u32,
    /// Largest difference of the three gaps \[motor counts\].
    pub tolerance_counts: u32,
}

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
///         Next::Stretch(_) | Next::Last(_) | Next::Underrun => break,
///     }
/// }
/// assert_eq!(run.result().and_then(Result::ok).map(|gap| gap.half_counts), Some(7));
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BacklashMeasurement {
    creep: Creep,
    detection: Detection,
}

/// Result of the measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// `B`, the half gap \[motor counts\].
    pub half_counts: u32,
    /// The whole gap at each crossing, to the nearest \[motor counts\].
    pub full_counts: [i64; 3],
}

impl BacklashMeasurement {
    /// Accepts settings if nothing can overflow with them.
    ///
    /// # Errors
    /// A [`Refusal`] that names what is out of its range.
    pub fn accept(creep: Creep, detection: Detection) -> Result<Self, Refusal> {
        What::CreepSpeed.word_within(creep.speed, [1, SPEED_MAX])?;
        What::LongestCreep.word_within(creep.longest_counts, [1, CREEP_MAX])?;
        let threshold = match detection {
            Detection::LoadEncoder { counts, ratio } => {
                What::LoadRatio.word_within(ratio, [1, RATIO_MAX])?;
                counts
            }
            Detection::Effort { codes, samples } => codes.min(samples),
        };
        What::Detection.word_within(threshold, [1, u32::MAX])?;
        Ok(Self { creep, detection })
    }
}

/// Reason for which the routine gave no gap. The axis rests where it was; the routine can
/// be started again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum BacklashMeasurementError {
    /// The load did not follow within the longest creep.
    #[error(
        "the load did not follow the motor within {counts} counts of creep; \
         the gap is wider than that, or the load follows below the threshold"
    )]
    NeverFollowed {
        /// Distance over which the motor was sent \[motor counts\].
        counts: u32,
    },
    /// The gap was not the same at each crossing.
    #[error(
        "three crossings gave gaps of {}, {} and {} counts; they may differ by {tolerance_counts}",
        .full_counts[0], .full_counts[1], .full_counts[2]
    )]
    Disagree {
        /// The whole gap at each crossing \[motor counts\].
        full_counts: [i64; 3],
        /// Largest difference allowed between them \[motor counts\].
        tolerance_counts: u32,
    },
    /// The load moved further than the motor.
    #[error(
        "three crossings gave gaps of {}, {} and {} counts; a load that moves further than \
         the motor means that the ratio of the two encoders is wrong",
        .full_counts[0], .full_counts[1], .full_counts[2]
    )]
    Negative {
        /// The whole gap at each crossing \[motor counts\].
        full_counts: [i64; 3],
    },
    /// The load is to be seen by an encoder that is not there.
    #[error("the gap is to be measured by the load's encoder but there is no count of it")]
    NoLoadEncoder,
}

/// Fraction bits of the speed, of `ρ` and of everything that is computed.
const FRACTION_BITS: u32 = 16;

/// Phase of the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Creeping,
    /// Resting before the present leg.
    Pausing {
        left: u32,
    },
    Ended(Result<Gap, BacklashMeasurementError>),
}

/// One run of the routine. Marks, distances and gaps are in 2^−16 counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BacklashMeasurementRun {
    settings: BacklashMeasurement,
    /// Legs that have ended, 0 to 3; where that is odd the present one creeps backwards.
    legs: u8,
    phase: Phase,
    /// Reference at the start, from which motor counts are measured.
    start: i32,
    /// Reference at the start of the leg.
    origin: i32,
    /// Distance crept in this leg.
    crept: i64,
    /// The load's count at the start of the run.
    load_zero: i32,
    /// The load's count at the start of the leg.
    load_start: i32,
    /// For how many samples on end the load has resisted.
    streak: u32,
    /// Mark of the first of them.
    arrival: i64,
    /// Mark at which the flank of the leg before was left.
    departure: i64,
    /// `G₁` and `G₂`.
    gaps: [i64; 2],
}

/// `value` [2^−16 counts] to the nearest count, half away from zero.
const fn nearest(value: i64) -> i64 {
    // Distances and gaps are below 2^61.
    let magnitude = value.unsigned_abs().wrapping_add(1 << 15);
    let whole = magnitude.wrapping_shr(FRACTION_BITS).cast_signed();
    whole.wrapping_mul(value.signum())
}

/// Counts in units of 2^−16 counts.
fn scaled(counts: i32) -> i64 {
    i64::from(counts).wrapping_shl(FRACTION_BITS)
}

impl BacklashMeasurement {
    /// A run that starts from the reference `position` \[counts\], at rest.
    pub const fn start(&self, position: i32) -> BacklashMeasurementRun {
        BacklashMeasurementRun {
            settings: *self,
            legs: 0,
            phase: Phase::Creeping,
            start: position,
            origin: position,
            crept: 0,
            load_zero: 0,
            load_start: 0,
            streak: 0,
            arrival: 0,
            departure: 0,
            gaps: [0; 2],
        }
    }
}

impl BacklashMeasurementRun {
    /// Result; `None` while it runs. A failure leaves the axis where
    /// it stands.
    pub const fn result(&self) -> Option<Result<Gap, BacklashMeasurementError>> {
        match self.phase {
            Phase::Ended(result) => Some(result),
            Phase::Creeping | Phase::Pausing { .. } => None,
        }
    }

    /// Direction of the present leg's creep.
    const fn direction(&self) -> i64 {
        if self.legs & 1 == 0 { 1 } else { -1 }
    }

    /// The reference of this sample.
    fn setpoint(&self) -> Setpoint {
        let way = nearest(self.crept).wrapping_mul(self.direction());
        Setpoint {
            position: self.origin.wrapping_add(wrap(way)),
            ..Setpoint::default()
        }
    }

    /// One sample of the routine; `Ok` while nothing has come of it.
    fn advance(&mut self, observed: &Observed) -> Result<Option<Gap>, BacklashMeasurementError> {
        let (creep, direction) = (self.settings.creep, self.direction());
        let position = scaled(difference(observed.position, self.start));

        // The mark of this sample, and whether the load follows or resists.
        let (mark, resists, needed) = match self.settings.detection {
            Detection::LoadEncoder { counts, ratio } => {
                let load = observed
                    .load_position
                    .ok_or(BacklashMeasurementError::NoLoadEncoder)?;
                if self.crept == 0 {
                    self.load_start = load;
                    if self.legs == 0 {
                        self.load_zero = load;
                    }
                }
                // The edge just crossed: |l| ≤ 2^31, ρ ≤ 2^28.
                let upper = i64::from(direction < 0);
                let edge = i64::from(difference(load, self.load_zero)).wrapping_add(upper);
                let mark = position.wrapping_sub(i64::from(ratio).wrapping_mul(edge));
                let moved = i64::from(difference(load, self.load_start)).wrapping_mul(direction);
                (mark, moved >= i64::from(counts), 1)
            }
            Detection::Effort { codes, samples } => {
                // The flank behind was left where the motor stood furthest out.
                let further = self
                    .departure
                    .wrapping_sub(position)
                    .wrapping_mul(direction)
                    > 0;
                self.departure = if further { position } else { self.departure };
                let effort = i64::from(observed.code).wrapping_mul(direction);
                (position, effort >= i64::from(codes), samples)
            }
        };

        if let Phase::Pausing { left } = self.phase {
            self.phase = match left.checked_sub(1) {
                Some(left) => Phase::Pausing { left },
                None => Phase::Creeping,
            };
            return Ok(None);
        }
        if self.streak == 0 {
            self.arrival = mark;
        }
        self.streak = if resists {
            self.streak.wrapping_add(1)
        } else {
            0
        };
        if self.streak >= needed {
            return self.arrive(mark);
        }
        // crept ≤ 2^28·2^16 + 2^24
        self.crept = self.crept.wrapping_add(i64::from(creep.speed));
        if self.crept > i64::from(creep.longest_counts).wrapping_shl(FRACTION_BITS) {
            let counts = creep.longest_counts;
            return Err(BacklashMeasurementError::NeverFollowed { counts });
        }
        Ok(None)
    }

    /// The motor has engaged: notes the gap and turns to the next leg.
    fn arrive(&mut self, mark: i64) -> Result<Option<Gap>, BacklashMeasurementError> {
        // Marks are below 2^60.
        let gap = self.arrival.wrapping_sub(self.departure);
        let gap = gap.wrapping_mul(self.direction());
        let [first, second] = self.gaps;
        match self.legs {
            // The first leg began anywhere in the gap: its distance is no gap.
            0 => {}
            1 => self.gaps = [gap, 0],
            2 => self.gaps = [first, gap],
            _ => return self.conclude([first, second, gap]).map(Some),
        }
        self.origin = self.setpoint().position;
        self.legs = self.legs.wrapping_add(1);
        self.crept = 0;
        self.streak = 0;
        self.departure = mark;
        self.phase = Phase::Pausing {
            left: self.settings.creep.pause_samples,
        };
        Ok(None)
    }

    fn conclude(&self, gaps: [i64; 3]) -> Result<Gap, BacklashMeasurementError> {
        let full_counts = gaps.map(nearest);
        let tolerance_counts = self.settings.creep.tolerance_counts;
        let tolerance = i64::from(tolerance_counts).wrapping_shl(FRACTION_BITS);
        // Gaps are below 2^61.
        let [first, second, third] = gaps;
        let most = first.max(second).max(third);
        let least = first.min(second).min(third);
        if most.wrapping_sub(least) > tolerance {
            return Err(BacklashMeasurementError::Disagree {
                full_counts,
                tolerance_counts,
            });
        }
        if most < tolerance.wrapping_neg() {
            return Err(BacklashMeasurementError::Negative { full_counts });
        }
        // B = (G₁ + G₃)/4, half up; a little below 0 is 0.
        let sum = first.wrapping_add(third).max(0);
        let quarter = sum.wrapping_add(1 << 17).wrapping_shr(18);
        Ok(Gap {
            half_counts: u32::try_from(quarter).unwrap_or(u32::MAX),
            full_counts,
        })
    }
}

impl SetpointSource for BacklashMeasurementRun {
    fn next(&mut self, observed: &Observed) -> Next {
        if self.result().is_none()
            && let Some(result) = self.advance(observed).transpose()
        {
            self.phase = Phase::Ended(result);
        }
        let setpoint = self.setpoint();
        match self.phase {
            Phase::Ended(_) => Next::Last(setpoint),
            Phase::Creeping | Phase::Pausing { .. } => Next::Setpoint(setpoint),
        }
    }
}
