//! Motion command with seven intervals (paper, Fig. 6), in closed form.
//!
//! The acceleration is a quarter sine up (`t1`), constant (`t2`), a quarter
//! cosine down (`t3`), rest (`t4`), then the mirrored three below zero
//! (`t5`-`t7`). Any interval may be zero. Either amplitude follows from zero
//! final speed and the travel; before 0 and from the end on the axis rests.
//! Each segment has the form
//!
//! ```text
//! a(τ) = A·{1, sin ωτ, cos ωτ, 0},   ω = π/(2·T),   0 ≤ τ < T
//! ```
//!
//! and is integrated by hand three times: velocity, displacement and the
//! integral of displacement, which the continuous PID needs (eq. 28-29).
//! Sine and cosine come from the `libm` crate so that every machine computes
//! the same bits. For solver `exact` the command is the state of a linear system
//! ([`Oscillator`]) and a power series.

use core::f64::consts::FRAC_PI_2;

/// The command at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPoint {
    /// Acceleration \[m/s²\]; right-continuous where it jumps.
    pub acceleration_mps2: f64,
    /// Velocity \[m/s\].
    pub velocity_mps: f64,
    /// Displacement \[m\].
    pub displacement_m: f64,
    /// Integral of the displacement from 0 \[m s\] (the hat of eq. 29).
    pub displacement_integral_ms: f64,
}

/// The motion command of Fig. 6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    travel_m: f64,
    intervals_s: [f64; 7],
    segments: [Segment; 7],
    end: MotionPoint,
    end_s: f64,
    /// Largest magnitude of the fourth derivative of each, over all intervals:
    /// how rough the command is. The acceleration's is not given.
    pub(crate) fourth_derivatives: MotionPoint,
    /// Largest magnitude of the commanded acceleration \[m/s²\].
    pub(crate) peak_acceleration_mps2: f64,
}

/// Reason why seven intervals and a travel make no motion.
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
    /// Interval and travel are finite, but the motion they make is not.
    #[error("the intervals or the travel are too large or too small to compute with")]
    OutOfRange,
}

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
        let finite = segments.iter().all(|s| s.amplitude_mps2.is_finite())
            && end.displacement_integral_ms.is_finite()
            && end_s.is_finite();
        if !finite {
            return Err(MotionError::OutOfRange);
        }
        Ok(Self {
            travel_m,
            intervals_s,
            segments,
            end,
            end_s,
            fourth_derivatives: fourth_derivatives(&segments),
            peak_acceleration_mps2: segments
                .iter()
                .filter(|s| s.duration_s > 0.0)
                .fold(0.0, |peak: f64, s| peak.max(s.amplitude_mps2.abs())),
        })
    }

    /// Total travel `h` \[m\].
    pub fn travel_m(&self) -> f64 {
        self.travel_m
    }

    /// The seven intervals \[s\].
    pub fn intervals_s(&self) -> [f64; 7] {
        self.intervals_s
    }

    /// End of the motion \[s\]: the sum of the intervals.
    pub fn end_s(&self) -> f64 {
        self.end_s
    }

    /// The instants at which one interval gives way to the next \[s\], in
    /// order, the end included; between them the command is smooth.
    pub fn breaks_s(&self) -> [f64; 7] {
        let mut breaks = [self.end_s; 7];
        for (index, segment) in self.segments.iter().enumerate().skip(1) {
            breaks[index - 1] = segment.start_s;
        }
        breaks
    }

    /// Largest magnitude of the commanded acceleration from 0 to `time_s`
    /// \[m/s²\], both one-sided limits at its jumps included.
    pub fn peak_acceleration_until_mps2(&self, time_s: f64) -> f64 {
        self.segments
            .iter()
            .filter(|s| s.duration_s > 0.0 && s.start_s <= time_s)
            .fold(0.0, |peak: f64, s| {
                // A rise is largest at its end, which may not be reached.
                let tau_s = match s.shape {
                    Shape::Rise => (time_s - s.start_s).min(s.duration_s),
                    Shape::Constant | Shape::Fall => 0.0,
                };
                peak.max(s.at(tau_s).acceleration_mps2.abs())
            })
    }

    /// The command at `time_s`.
    pub fn at(&self, time_s: f64) -> MotionPoint {
        match self.segment_at(time_s) {
            Some(segment) => segment.at((time_s - segment.start_s).max(0.0)),
            None if time_s >= 0.0 && time_s + self.rounding_s() >= self.end_s => MotionPoint {
                displacement_integral_ms: self.end.displacement_integral_ms
                    + self.travel_m * (time_s - self.end_s),
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
        self.segments
            .iter()
            .rev()
            .find(|segment| segment.duration_s > 0.0 && now_s >= segment.start_s)
    }

    /// The left-hand limit of the commanded acceleration at `time_s` \[m/s²\]:
    /// differs from [`Motion::at`] only where the command jumps (but for
    /// rounding).
    pub fn acceleration_before_mps2(&self, time_s: f64) -> f64 {
        for segment in self.segments.iter().rev() {
            if segment.duration_s > 0.0 && time_s > segment.start_s + self.rounding_s() {
                let tau_s = time_s - segment.start_s;
                return if time_s <= self.end_s + self.rounding_s() {
                    segment.at(tau_s.min(segment.duration_s)).acceleration_mps2
                } else {
                    0.0
                };
            }
        }
        0.0
    }

    /// Error of the sums of the intervals. Intervals of 0.1 s add up
    /// to 0.30000000000000004 s; the row at 0.3 s belongs to the next one.
    fn rounding_s(&self) -> f64 {
        8.0 * f64::EPSILON * self.end_s
    }

    /// The command at `time_s` as an oscillator, right-continuous. Where it does not
    /// accelerate any ω will do, and the first one spares a solver another system.
    pub(crate) fn oscillator(&self, time_s: f64) -> Oscillator {
        let still = |point: MotionPoint| {
            let first = |s: &&Segment| s.duration_s > 0.0 && s.shape != Shape::Constant;
            let first = self.segments.iter().find(first);
            Oscillator {
                point,
                quadrature_mps2: 0.0,
                omega_radps: match first {
                    Some(first) if point.acceleration_mps2 == 0.0 => FRAC_PI_2 / first.duration_s,
                    _ => 0.0,
                },
            }
        };
        match self.segment_at(time_s) {
            None => still(self.at(time_s)),
            Some(segment) => {
                let tau_s = (time_s - segment.start_s).max(0.0);
                let point = segment.at(tau_s);
                let omega_radps = FRAC_PI_2 / segment.duration_s;
                let (a, phase) = (segment.amplitude_mps2, omega_radps * tau_s);
                let quadrature_mps2 = match segment.shape {
                    Shape::Constant => return still(point),
                    Shape::Rise => a * libm::cos(phase),
                    Shape::Fall => -a * libm::sin(phase),
                };
                Oscillator {
                    point,
                    quadrature_mps2,
                    omega_radps,
                }
            }
        }
    }

    /// Coefficients of x_ref as a power series in θ = t/length from `time_s`
    /// on, valid until the interval of the command ends.
    pub(crate) fn series(&self, time_s: f64, length_s: f64, coefficients: &mut [f64]) {
        let Oscillator {
            point,
            quadrature_mps2,
            omega_radps,
        } = self.oscillator(time_s);
        let phase = omega_radps * length_s;
        // x, v·h and then a·h²/2!, ω·w·h³/3!, −ω²·a·h⁴/4!, …
        let mut scale = length_s * length_s / 2.0;
        let derivatives = [
            point.acceleration_mps2,
            quadrature_mps2,
            -point.acceleration_mps2,
            -quadrature_mps2,
        ];
        for (n, c) in (0_u16..).zip(coefficients.iter_mut()) {
            *c = match n {
                0 => point.displacement_m,
                1 => point.velocity_mps * length_s,
                _ => {
                    let term = derivatives[usize::from(n - 2) % 4] * scale;
                    scale *= phase / f64::from(n + 1);
                    term
                }
            };
        }
    }
}

/// The command as a linear oscillator: within one interval of Fig. 6 its
/// acceleration obeys `ȧ = ω·w`, `ẇ = −ω·a` (with ω = 0 it is constant).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Oscillator {
    pub(crate) point: MotionPoint,
    /// `w` \[m/s²\].
    pub(crate) quadrature_mps2: f64,
    /// `ω` \[rad/s\].
    pub(crate) omega_radps: f64,
}

/// What a step of one length makes of the command within an interval, in closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OscillatorStep {
    length_s: f64,
    omega_radps: f64,
    cos: f64,
    sin: f64,
    /// `cos ωt` integrated one to four times over the step.
    integrals: [f64; 4],
}

impl OscillatorStep {
    pub(crate) fn new(omega_radps: f64, length_s: f64) -> Self {
        let (t, w) = (length_s, omega_radps);
        let (sin, cos) = (libm::sin(w * t), libm::cos(w * t));
        let integrals = if w == 0.0 {
            [t, t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0]
        } else {
            let (once, twice) = (sin / w, versine(w * t) / (w * w));
            let (w, rest) = (w * w, t * t / 2.0 - twice);
            [once, twice, (t - once) / w, rest / w]
        };
        Self {
            length_s,
            omega_radps,
            cos,
            sin,
            integrals,
        }
    }
}

impl Oscillator {
    /// The command a step later.
    #[inline]
    pub(crate) fn after(&self, step: &OscillatorStep) -> Self {
        // a(t) = a·cos ωt + jerk·∫cos ωt dt, and so on for its integrals.
        let (a, w, t) = (
            self.point.acceleration_mps2,
            self.quadrature_mps2,
            step.length_s,
        );
        let jerk = w * step.omega_radps;
        let [once, twice, thrice, last] = step.integrals;
        let (v, x) = (self.point.velocity_mps, self.point.displacement_m);
        let q = self.point.displacement_integral_ms;
        Self {
            point: MotionPoint {
                acceleration_mps2: step.cos * a + step.sin * w,
                velocity_mps: v + (once * a + twice * jerk),
                displacement_m: x + (v * t + (twice * a + thrice * jerk)),
                displacement_integral_ms: q
                    + (x * t + (v * t * t / 2.0 + (thrice * a + last * jerk))),
            },
            quadrature_mps2: step.cos * w - step.sin * a,
            omega_radps: self.omega_radps,
        }
    }
}

/// Shape of the acceleration within one interval.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// `sin ωτ`, from 0 to the amplitude.
    Rise,
    /// The amplitude throughout.
    Constant,
    /// `cos ωτ`, from the amplitude to 0.
    Fall,
}

const SHAPES: [Shape; 7] = {
    use Shape::{Constant, Fall, Rise};
    [Rise, Constant, Fall, Constant, Rise, Constant, Fall]
};

/// One interval with the command at its start.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Segment {
    start_s: f64,
    duration_s: f64,
    shape: Shape,
    amplitude_mps2: f64,
    start: MotionPoint,
}

impl Segment {
    /// The command `tau_s` after the start of the segment.
    fn at(&self, tau_s: f64) -> MotionPoint {
        let (a, t) = (self.amplitude_mps2, tau_s);
        // The three integrals of the shape, each 0 at τ = 0.
        let (shape, once, twice, thrice) = match self.shape {
            Shape::Constant => (1.0, t, t * t / 2.0, t * t * t / 6.0),
            Shape::Rise => {
                let w = FRAC_PI_2 / self.duration_s;
                let sin = libm::sin(w * t);
                let versine = versine(w * t);
                (
                    sin,
                    versine / w,
                    (t - sin / w) / w,
                    (t * t / 2.0 - versine / (w * w)) / w,
                )
            }
            Shape::Fall => {
                let w = FRAC_PI_2 / self.duration_s;
                let (sin, cos) = (libm::sin(w * t), libm::cos(w * t));
                let versine = versine(w * t);
                (cos, sin / w, versine / (w * w), (t - sin / w) / (w * w))
            }
        };
        let s = &self.start;
        let (v0, x0, q0) = (s.velocity_mps, s.displacement_m, s.displacement_integral_ms);
        MotionPoint {
            acceleration_mps2: a * shape,
            velocity_mps: v0 + a * once,
            displacement_m: x0 + (v0 * t + a * twice),
            displacement_integral_ms: q0 + (x0 * t + (v0 * t * t / 2.0 + a * thrice)),
        }
    }
}

/// `1 − cos φ` without cancellation.
fn versine(phi: f64) -> f64 {
    let half = libm::sin(phi / 2.0);
    2.0 * half * half
}

/// Strings the seven segments together and returns them with the end point.
fn chain(intervals_s: &[f64; 7], accelerate: f64, decelerate: f64) -> ([Segment; 7], MotionPoint) {
    let mut point = MotionPoint::default();
    let mut start_s = 0.0;
    let mut index = 0;
    let segments = intervals_s.map(|duration_s| {
        let amplitude_mps2 = match index {
            0..=2 => accelerate,
            3 => 0.0,
            _ => decelerate,
        };
        let segment = Segment {
            start_s,
            duration_s,
            shape: SHAPES[index],
            amplitude_mps2,
            start: point,
        };
        if duration_s > 0.0 {
            point = segment.at(duration_s);
        }
        start_s += duration_s;
        index += 1;
        segment
    });
    (segments, point)
}

/// `d⁴/dt⁴` of v, x and its integral are a⁗ less one to three integrations:
/// `A·ω³`, `A·ω²` and `A·ω` with the segment's own ω, 0 where a is constant.
fn fourth_derivatives(segments: &[Segment; 7]) -> MotionPoint {
    let mut largest = MotionPoint::default();
    for s in segments {
        if s.duration_s > 0.0 && s.shape != Shape::Constant {
            let (a, w) = (s.amplitude_mps2.abs(), FRAC_PI_2 / s.duration_s);
            largest.velocity_mps = largest.velocity_mps.max(a * w * w * w);
            largest.displacement_m = largest.displacement_m.max(a * w * w);
            largest.displacement_integral_ms = largest.displacement_integral_ms.max(a * w);
        }
    }
    largest
}
