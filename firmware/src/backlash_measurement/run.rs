//! A run of the routine, sample by sample.

use super::{BacklashMeasurement, BacklashMeasurementError, Detection, Gap};
use crate::counts::{difference, wrap};
use crate::reference::{Next, Observed, Setpoint, SetpointSource};

/// Fraction bits of the speed, of `ρ` and of everything that is computed.
const FRACTION_BITS: u32 = 16;

/// One run of the routine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BacklashMeasurementRun {
    settings: BacklashMeasurement,
    state: RunState,
}

/// The four legs of the routine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leg {
    /// Creep + to the first flank.
    First,
    /// Creep − across the gap.
    Second,
    /// Creep + across the gap.
    Third,
    /// Creep − across the gap.
    Fourth,
}

/// What the run does at present.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Creeping,
    /// Resting before the present leg.
    Pausing {
        left: u32,
    },
    Ended(Result<Gap, BacklashMeasurementError>),
}

/// Memory of a run. Marks, distances and gaps are in 2^−16 counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RunState {
    leg: Leg,
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
            state: RunState {
                leg: Leg::First,
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
            },
        }
    }
}

impl Leg {
    /// Direction of the creep.
    const fn direction(self) -> i64 {
        match self {
            Self::First | Self::Third => 1,
            Self::Second | Self::Fourth => -1,
        }
    }
}

impl RunState {
    /// The reference of this sample.
    const fn setpoint(&self) -> Setpoint {
        let way = nearest(self.crept).wrapping_mul(self.leg.direction());
        Setpoint {
            position: self.origin.wrapping_add(wrap(way)),
            velocity: 0,
            acceleration: 0,
        }
    }
}

impl BacklashMeasurementRun {
    /// What came of it; `None` while it runs. A failure leaves the axis where
    /// it stands.
    pub const fn result(&self) -> Option<Result<Gap, BacklashMeasurementError>> {
        match self.state.phase {
            Phase::Ended(result) => Some(result),
            Phase::Creeping | Phase::Pausing { .. } => None,
        }
    }

    /// One sample of the routine; `Ok` while nothing has come of it.
    fn advance(&mut self, observed: &Observed) -> Result<Option<Gap>, BacklashMeasurementError> {
        let (creep, s) = (self.settings.creep, &mut self.state);
        let direction = s.leg.direction();
        let position = scaled(difference(observed.position, s.start));

        // The mark of this sample, and whether the load follows or resists.
        let (mark, resists, needed) = match self.settings.detection {
            Detection::LoadEncoder { counts, ratio } => {
                let load = observed
                    .load_position
                    .ok_or(BacklashMeasurementError::NoLoadEncoder)?;
                if s.crept == 0 {
                    s.load_start = load;
                    if s.leg == Leg::First {
                        s.load_zero = load;
                    }
                }
                // The edge just crossed: |l| ≤ 2^31, ρ ≤ 2^28.
                let upper = i64::from(direction < 0);
                let edge = i64::from(difference(load, s.load_zero)).wrapping_add(upper);
                let mark = position.wrapping_sub(i64::from(ratio).wrapping_mul(edge));
                let moved = i64::from(difference(load, s.load_start)).wrapping_mul(direction);
                (mark, moved >= i64::from(counts), 1)
            }
            Detection::Effort { codes, samples } => {
                // The flank behind was left where the motor stood furthest out.
                let further = s.departure.wrapping_sub(position).wrapping_mul(direction) > 0;
                s.departure = if further { position } else { s.departure };
                let effort = i64::from(observed.code).wrapping_mul(direction);
                (position, effort >= i64::from(codes), samples)
            }
        };

        if let Phase::Pausing { left } = s.phase {
            s.phase = match left.checked_sub(1) {
                Some(left) => Phase::Pausing { left },
                None => Phase::Creeping,
            };
            return Ok(None);
        }
        if s.streak == 0 {
            s.arrival = mark;
        }
        s.streak = if resists { s.streak.wrapping_add(1) } else { 0 };
        if s.streak >= needed {
            return self.arrive(mark);
        }
        // crept ≤ 2^28·2^16 + 2^24
        s.crept = s.crept.wrapping_add(i64::from(creep.speed));
        if s.crept > i64::from(creep.longest_counts).wrapping_shl(FRACTION_BITS) {
            let counts = creep.longest_counts;
            return Err(BacklashMeasurementError::NeverFollowed { counts });
        }
        Ok(None)
    }

    /// The motor has engaged: notes the gap and turns to the next leg.
    fn arrive(&mut self, mark: i64) -> Result<Option<Gap>, BacklashMeasurementError> {
        let s = &mut self.state;
        // Marks are below 2^60.
        let direction = s.leg.direction();
        let gap = s.arrival.wrapping_sub(s.departure).wrapping_mul(direction);
        let [first, second] = s.gaps;
        let next = match s.leg {
            Leg::First => Leg::Second,
            Leg::Second => {
                s.gaps = [gap, 0];
                Leg::Third
            }
            Leg::Third => {
                s.gaps = [first, gap];
                Leg::Fourth
            }
            Leg::Fourth => return self.conclude([first, second, gap]).map(Some),
        };
        s.origin = s.setpoint().position;
        s.leg = next;
        s.crept = 0;
        s.streak = 0;
        s.departure = mark;
        s.phase = Phase::Pausing {
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
            self.state.phase = Phase::Ended(result);
        }
        let setpoint = self.state.setpoint();
        match self.state.phase {
            Phase::Ended(_) => Next::Last(setpoint),
            Phase::Creeping | Phase::Pausing { .. } => Next::Setpoint(setpoint),
        }
    }
}
