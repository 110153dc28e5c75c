//! Motion command in closed form: seven intervals (paper, Fig. 6), such moves in a row,
//! or a profile through given points.
//!
//! Within the seven intervals the acceleration is a quarter sine up (`t1`), constant (`t2`),
//! a quarter cosine down (`t3`), rest (`t4`), then the mirrored three below zero
//! (`t5`-`t7`), any of them possibly zero. Either amplitude follows from zero
//! final speed and the travel; before 0 and from the end on the axis rests.
//! Each segment has the form
//!
//! ```text
//! a(τ) = A·{1, sin ωτ, cos ωτ, 0},   ω = π/(2·T),   0 ≤ τ < T
//! ```
//!
//! and is integrated by hand three times: velocity, displacement and the
//! integral of displacement, which the continuous PID needs (eq. 28-29). For solver `exact` the command is the state of a linear system
//! ([`Oscillator`]) and a power series.

mod limits;
mod oscillator;
mod point;
mod profile;
mod segment;

use core::f64::consts::FRAC_PI_2;
use std::sync::Arc;

pub use limits::MotionLimits;
pub(crate) use oscillator::{Coupling, Oscillator, OscillatorStep};
pub use point::MotionPoint;
pub use profile::Profile;
use segment::{Segment, Shape};

/// A motion command. Clones share its segments.
#[derive(Debug, Clone)]
pub struct Motion {
    course: Course,
    /// In the order of time, none of them empty.
    segments: Arc<[Segment]>,
    breaks_s: Arc<[f64]>,
    end: MotionPoint,
    end_s: f64,
    largest_displacement_m: f64,
    peak_velocity_mps: f64,
    /// Where the command does not accelerate.
    still: Coupling,
    /// Largest magnitude of the fourth derivative of each, over all segments:
    /// how rough the command is. The acceleration's is not given.
    pub(crate) fourth_derivatives: MotionPoint,
    /// Largest magnitude of the commanded acceleration \[m/s²\].
    pub(crate) peak_acceleration_mps2: f64,
}

/// Where a motion comes from.
#[derive(Debug, Clone)]
pub enum Course {
    /// One move in seven intervals \[s\].
    Intervals([f64; 7]),
    /// The fastest move within limits, and its intervals \[s\].
    Limits(MotionLimits, [f64; 7]),
    /// Moves one after the other, each with the dwell after it \[s\].
    Row(Arc<[(Motion, f64)]>),
    /// A spline through points.
    Profile(Profile),
}

/// Two motions are the same if they command the same at every instant.
impl PartialEq for Motion {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.segments, &other.segments)
            || self.end == other.end
                && self.end_s == other.end_s
                && self.breaks_s == other.breaks_s
                && self.segments == other.segments
    }
}

/// Reason why there is no such motion.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// An interval is negative or not finite.
    #[error("interval t{number} is {duration_s} s; every interval must be finite and at least 0")]
    Interval {
        /// Number of the interval, 1 to 7.
        number: usize,
        /// The offending duration \[s\].
        duration_s: f64,
    },
    /// The travel is not finite \[m\].
    #[error("the travel is {0} m; it must be finite")]
    Travel(f64),
    /// All seven intervals are zero.
    #[error("all seven intervals are 0; the motion needs a duration")]
    NoDuration,
    /// `t1` to `t3` are all zero: nothing accelerates the axis.
    #[error("t1, t2 and t3 are all 0; the motion needs an acceleration")]
    NoAcceleration,
    /// `t5` to `t7` are all zero: nothing stops the axis.
    #[error("t5, t6 and t7 are all 0; the motion needs a deceleration")]
    NoDeceleration,
    /// A limit of velocity, acceleration or jerk is not greater than 0, or that of the
    /// acceleration is none.
    #[error("the limit of the {name} is {limit}; it must be greater than 0")]
    Limit {
        /// What is limited.
        name: &'static str,
        /// The offending limit, in SI units.
        limit: f64,
    },
    /// A dwell after a move is negative or not finite \[s\].
    #[error("the dwell after move {number} is {dwell_s} s; it must be finite and at least 0")]
    Dwell {
        /// Number of the move, from 1.
        number: usize,
        /// The offending dwell \[s\].
        dwell_s: f64,
    },
    /// A profile has fewer than two points.
    #[error("the profile has {0} points; it needs at least 2")]
    FewPoints(usize),
    /// A profile does not begin at rest at zero.
    #[error("the profile's first point must be at time 0 and displacement 0")]
    FirstPoint,
    /// A point of a profile is not finite.
    #[error("point {number} of the profile is not finite")]
    Point {
        /// Number of the point, from 1.
        number: usize,
    },
    /// The times of a profile do not rise.
    #[error("point {number} of the profile is not later than the one before it")]
    Order {
        /// Number of the later point, from 1.
        number: usize,
    },
    /// Interval and travel are finite, but the motion they make is not.
    #[error("the intervals or the travel are too large or too small to compute with")]
    OutOfRange,
}

/// Segments of two moves and what is between them.
const FEW: usize = 15;

impl Motion {
    /// The motion over `travel_m` in the given intervals `t1` to `t7` \[s\].
    ///
    /// # Errors
    /// [`MotionError`] if an interval or the travel is not finite, an interval
    /// is negative, there is no acceleration or no deceleration, or the
    /// numbers are so extreme that the motion is not finite.
    ///
    /// ```
    /// let motion = plant::Motion::new(0.25, [0.25, 0.0, 0.25, 0.0, 0.25, 0.0, 0.25])?;
    /// assert_eq!(motion.at(2.0).displacement_m, 0.25);
    /// assert!((motion.at(0.5).velocity_mps - 0.5).abs() < 1e-15);
    /// # Ok::<(), plant::MotionError>(())
    /// ```
    pub fn new(travel_m: f64, intervals_s: [f64; 7]) -> Result<Self, MotionError> {
        if !travel_m.is_finite() {
            return Err(MotionError::Travel(travel_m));
        }
        for (index, &duration_s) in intervals_s.iter().enumerate() {
            if !(duration_s.is_finite() && duration_s >= 0.0) {
                return Err(MotionError::Interval {
                    number: index + 1,
                    duration_s,
                });
            }
        }
        let [t1, t2, t3, _, t5, t6, t7] = intervals_s;
        // Speed gained per unit of amplitude: ∫ of a quarter sine is 2T/π.
        let gain_s = t2 + (t1 + t3) / FRAC_PI_2;
        let loss_s = t6 + (t5 + t7) / FRAC_PI_2;
        match (gain_s > 0.0, loss_s > 0.0) {
            (true, true) => {}
            (false, false) if intervals_s.iter().all(|&t| t == 0.0) => {
                return Err(MotionError::NoDuration);
            }
            (false, _) => return Err(MotionError::NoAcceleration),
            (true, false) => return Err(MotionError::NoDeceleration),
        }
        // Zero final speed: A·gain = B·loss, so with A = 1/gain the speed in
        // between is 1 and the travel a pure number of seconds; scale by it.
        let unit = chain(&intervals_s, 1.0 / gain_s, -1.0 / loss_s);
        let speed_mps = travel_m / unit.1.displacement_m;
        let (segments, mut end) = chain(&intervals_s, speed_mps / gain_s, -speed_mps / loss_s);
        // The end is exact by construction; rounding is taken out of it.
        end = MotionPoint {
            displacement_m: travel_m,
            displacement_integral_ms: end.displacement_integral_ms,
            ..MotionPoint::default()
        };
        let end_s = segments[6].start_s + segments[6].duration_s;
        let starts_s = segments[1..].iter().map(|s| s.start_s);
        let breaks_s = starts_s.chain([end_s]).collect();
        if !segments.iter().all(|s| s.amplitude_mps2.is_finite()) {
            return Err(MotionError::OutOfRange);
        }
        let segments = segments.into_iter().filter(|s| s.duration_s > 0.0);
        let course = Course::Intervals(intervals_s);
        Self::of_segments(segments.collect(), breaks_s, end, course)
    }

    /// The moves one after the other, each from where the one before it ended, with a
    /// dwell \[s\] after each. The motion ends with the last move; the dwell after that
    /// is not part of it. What begins or ends within 1 ps of a whole nanosecond does so
    /// at that nanosecond.
    ///
    /// # Errors
    /// [`MotionError`] if there is no move, a dwell is negative or not finite, or the
    /// motion that they make is not finite.
    ///
    /// ```
    /// let intervals_s = [0.0, 0.25, 0.0, 0.25, 0.0, 0.25, 0.0];
    /// let forth = plant::Motion::new(0.25, intervals_s)?;
    /// let back = plant::Motion::new(-0.25, intervals_s)?;
    /// let motion = plant::Motion::row(&[(forth, 0.2), (back, 0.0)])?;
    /// assert_eq!(motion.at(0.8).displacement_m, 0.25);
    /// assert_eq!((motion.end_s(), motion.travel_m()), (1.7, 0.0));
    /// # Ok::<(), plant::MotionError>(())
    /// ```
    pub fn row(moves: &[(Self, f64)]) -> Result<Self, MotionError> {
        if moves.is_empty() {
            return Err(MotionError::NoDuration);
        }
        let (mut segments, mut breaks_s) = (Vec::new(), Vec::new());
        let (mut now_s, mut here) = (0.0, MotionPoint::default());
        for (index, (motion, dwell_s)) in moves.iter().enumerate() {
            let (dwell_s, number) = (*dwell_s, index + 1);
            if !(dwell_s.is_finite() && dwell_s >= 0.0) {
                return Err(MotionError::Dwell { number, dwell_s });
            }
            for s in motion.segments.iter() {
                let start_s = on_nanosecond(now_s + s.start_s);
                segments.push(Segment {
                    start_s,
                    start: here.and(&s.start, start_s - now_s),
                    ..*s
                });
            }
            let ends = motion.breaks_s.iter();
            breaks_s.extend(ends.map(|break_s| on_nanosecond(now_s + break_s)));
            let end_s = on_nanosecond(now_s + motion.end_s);
            here = here.and(&motion.end, end_s - now_s);
            now_s = end_s;
            if dwell_s > 0.0 && number < moves.len() {
                now_s = on_nanosecond(end_s + dwell_s);
                segments.push(Segment {
                    start_s: end_s,
                    duration_s: now_s - end_s,
                    shape: Shape::Constant,
                    amplitude_mps2: 0.0,
                    start: here,
                });
                breaks_s.push(now_s);
                here = here.and(&MotionPoint::default(), now_s - end_s);
            }
        }
        Self::of_segments(segments, breaks_s, here, Course::Row(moves.into()))
    }

    /// The motion of segments that are not empty, in the order of time.
    fn of_segments(
        segments: Vec<Segment>,
        breaks_s: Vec<f64>,
        end: MotionPoint,
        course: Course,
    ) -> Result<Self, MotionError> {
        let end_s = breaks_s.last().copied().unwrap_or(0.0);
        let peak_mps2 = |s: &Segment| {
            let at_end_mps2 = s.peak_acceleration_mps2(s.duration_s);
            s.amplitude_mps2.abs().max(at_end_mps2)
        };
        let ends = [end.displacement_m, end.displacement_integral_ms, end_s];
        let mut numbers = segments.iter().map(peak_mps2).chain(ends);
        if !numbers.all(f64::is_finite) {
            return Err(MotionError::OutOfRange);
        }
        let largest = |of: fn(&Segment) -> f64| segments.iter().map(of).fold(0.0, f64::max);
        Ok(Self {
            course,
            end,
            end_s,
            // The end is exact, the last segment's is not.
            largest_displacement_m: largest(|s| {
                let (lowest_m, highest_m) = s.displacements_m();
                highest_m.max(-lowest_m)
            })
            .max(end.displacement_m.abs()),
            peak_velocity_mps: largest(Segment::peak_velocity_mps),
            still: segments
                .iter()
                .find_map(Segment::coupling)
                .unwrap_or_default(),
            fourth_derivatives: MotionPoint {
                acceleration_mps2: 0.0,
                velocity_mps: largest(|s| s.fourth_derivatives().velocity_mps),
                displacement_m: largest(|s| s.fourth_derivatives().displacement_m),
                displacement_integral_ms: largest(|s| {
                    s.fourth_derivatives().displacement_integral_ms
                }),
            },
            peak_acceleration_mps2: largest(peak_mps2),
            segments: segments.into(),
            breaks_s: breaks_s.into(),
        })
    }

    /// Displacement at the end, the sum of all travels \[m\].
    pub fn travel_m(&self) -> f64 {
        self.end.displacement_m
    }

    /// Largest magnitude of the displacement \[m\].
    pub fn largest_displacement_m(&self) -> f64 {
        self.largest_displacement_m
    }

    /// Largest magnitude of the velocity \[m/s\].
    pub fn peak_velocity_mps(&self) -> f64 {
        self.peak_velocity_mps
    }

    /// Where the motion comes from.
    pub fn course(&self) -> &Course {
        &self.course
    }

    /// The seven intervals \[s\] of a single move.
    pub fn intervals_s(&self) -> Option<[f64; 7]> {
        match &self.course {
            Course::Intervals(intervals_s) | Course::Limits(_, intervals_s) => Some(*intervals_s),
            Course::Row(moves) if moves.len() == 1 => moves[0].0.intervals_s(),
            Course::Row(_) | Course::Profile(_) => None,
        }
    }

    /// End of the motion \[s\]: the sum of the intervals.
    pub fn end_s(&self) -> f64 {
        self.end_s
    }

    /// The instants at which one interval gives way to the next \[s\], in
    /// order, the end included; between them the command is smooth.
    pub fn breaks_s(&self) -> &[f64] {
        &self.breaks_s
    }

    /// Those from `time_s` on.
    pub(crate) fn breaks_from(&self, time_s: f64) -> &[f64] {
        let first = self.breaks_s.partition_point(|&t| t < time_s);
        self.breaks_s.get(first..).unwrap_or_default()
    }

    /// Those between two instants, neither included.
    pub fn breaks_between(&self, start_s: f64, end_s: f64) -> &[f64] {
        let first = self.breaks_s.partition_point(|&t| t <= start_s);
        let last = self.breaks_s.partition_point(|&t| t < end_s);
        self.breaks_s.get(first..last).unwrap_or_default()
    }

    /// Largest magnitude of the commanded acceleration from 0 to `time_s`
    /// \[m/s²\], both one-sided limits at its jumps included.
    pub fn peak_acceleration_until_mps2(&self, time_s: f64) -> f64 {
        self.segments
            .iter()
            .take_while(|s| s.start_s <= time_s)
            .fold(0.0, |peak: f64, s| {
                peak.max(s.peak_acceleration_mps2(time_s - s.start_s))
            })
    }

    /// The command at `time_s`.
    pub fn at(&self, time_s: f64) -> MotionPoint {
        match self.segment_at(time_s) {
            Some(segment) => segment.at((time_s - segment.start_s).max(0.0)),
            None if time_s >= 0.0 && time_s + self.rounding_s() >= self.end_s => MotionPoint {
                displacement_integral_ms: self.end.displacement_integral_ms
                    + self.end.displacement_m * (time_s - self.end_s),
                ..self.end
            },
            None => MotionPoint::default(),
        }
    }

    /// The interval that `time_s` belongs to; none before and after the motion.
    fn segment_at(&self, time_s: f64) -> Option<&Segment> {
        let now_s = time_s + self.rounding_s();
        if time_s < 0.0 || now_s >= self.end_s {
            return None;
        }
        let begun = |s: &Segment| s.start_s <= now_s;
        // Of a few a look at each, the last first, is quicker than halving.
        if self.segments.len() <= FEW {
            return self.segments.iter().rev().find(|s| begun(s));
        }
        let count = self.segments.partition_point(begun);
        self.segments.get(count.checked_sub(1)?)
    }

    /// The left-hand limit of the commanded acceleration at `time_s` \[m/s²\]:
    /// differs from [`Motion::at`] only where the command jumps (but for
    /// rounding).
    pub fn acceleration_before_mps2(&self, time_s: f64) -> f64 {
        let rounding_s = self.rounding_s();
        let begun = |s: &Segment| time_s > s.start_s + rounding_s;
        let last = self.segments.partition_point(begun).checked_sub(1);
        match last.and_then(|last| self.segments.get(last)) {
            Some(segment) if time_s <= self.end_s + rounding_s => {
                let tau_s = (time_s - segment.start_s).min(segment.duration_s);
                segment.at(tau_s).acceleration_mps2
            }
            _ => 0.0,
        }
    }

    /// Error of the sums of the intervals. Intervals of 0.1 s add up
    /// to 0.30000000000000004 s; the row at 0.3 s belongs to the next one.
    fn rounding_s(&self) -> f64 {
        8.0 * f64::EPSILON * self.end_s
    }

    /// The command at `time_s` as a linear system, right-continuous. Where it does not
    /// accelerate any will do, and the first one spares a solver another system.
    pub(crate) fn oscillator(&self, time_s: f64) -> Oscillator {
        let segment = self.segment_at(time_s);
        let moved = segment.and_then(|s| s.oscillator((time_s - s.start_s).max(0.0)));
        moved.unwrap_or_else(|| {
            let point = self.at(time_s);
            let coupling = match point.acceleration_mps2 {
                0.0 => self.still,
                _ => Coupling::default(),
            };
            Oscillator {
                point,
                quadrature_mps2: 0.0,
                coupling,
            }
        })
    }
}

/// The time, or the whole nanosecond that it is within 1 ps of.
fn on_nanosecond(time_s: f64) -> f64 {
    let ns = (time_s * 1e9).round();
    if (time_s * 1e9 - ns).abs() <= 1e-3 {
        ns / 1e9
    } else {
        time_s
    }
}

/// Strings the seven segments together and returns them with the end point.
fn chain(intervals_s: &[f64; 7], up: f64, down: f64) -> ([Segment; 7], MotionPoint) {
    use Shape::{Constant, Fall, Rise};
    let shapes = [Rise, Constant, Fall, Constant, Rise, Constant, Fall];
    let amplitudes_mps2 = [up, up, up, 0.0, down, down, down];
    let (mut point, mut start_s) = (MotionPoint::default(), 0.0);
    let segments = core::array::from_fn(|index| {
        let segment = Segment {
            start_s,
            duration_s: intervals_s[index],
            shape: shapes[index],
            amplitude_mps2: amplitudes_mps2[index],
            start: point,
        };
        if segment.duration_s > 0.0 {
            point = segment.at(segment.duration_s);
        }
        start_s += segment.duration_s;
        segment
    });
    (segments, point)
}
