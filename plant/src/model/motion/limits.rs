//! The fastest move of Fig. 6 within limits of velocity, acceleration and jerk.

use core::f64::consts::{FRAC_PI_2, PI};

use super::point::MotionPoint;
use super::{Course, Motion, MotionError};

/// Limits of a move; an infinite one is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// \[m/s\]
    pub velocity_mps: f64,
    /// \[m/s²\]
    pub acceleration_mps2: f64,
    /// \[m/s³\]
    pub jerk_mps3: f64,
}

impl Motion {
    /// The fastest motion of Fig. 6 over `travel_m` that keeps to the limits: equal
    /// quarters of a sine up and down, so that the jerk is largest where they begin and
    /// end at rest. An infinite velocity or jerk is no limit; without travel there is no
    /// motion.
    ///
    /// # Errors
    /// [`MotionError`] if the travel is not finite, a limit is not greater than 0, the
    /// acceleration's is not finite, or the intervals that follow are too short or too
    /// long to compute with.
    ///
    /// ```
    /// use plant::{Motion, MotionLimits};
    ///
    /// let limits = MotionLimits {
    ///     velocity_mps: 0.5,
    ///     acceleration_mps2: 2.0,
    ///     jerk_mps3: f64::INFINITY,
    /// };
    /// let motion = Motion::limited(0.25, limits)?;
    /// assert_eq!(motion.intervals_s(), Some([0.0, 0.25, 0.0, 0.25, 0.0, 0.25, 0.0]));
    /// # Ok::<(), plant::MotionError>(())
    /// ```
    pub fn limited(travel_m: f64, limits: MotionLimits) -> Result<Self, MotionError> {
        let (mut v, mut a) = (limits.velocity_mps, limits.acceleration_mps2);
        let j = limits.jerk_mps3;
        for (limit, name) in [(v, "velocity"), (a, "acceleration"), (j, "jerk")] {
            if limit.is_nan() || limit <= 0.0 || name == "acceleration" && limit.is_infinite() {
                return Err(MotionError::Limit { name, limit });
            }
        }
        if !travel_m.is_finite() {
            return Err(MotionError::Travel(travel_m));
        }
        let h = travel_m.abs();
        if h == 0.0 {
            let course = Course::Limits(limits, [0.0; 7]);
            return Self::of_segments(Vec::new(), Vec::new(), MotionPoint::default(), course);
        }
        // Rise and fall of the velocity take T_a = v/a + (π−2)·a/j each.
        let round = PI - 2.0;
        if v < 2.0 * a * a / j {
            a = (v * j / 2.0).sqrt();
        }
        if v * (v / a + round * a / j) > h {
            // v·T_a = h, the root without cancellation.
            let g = round * a * a / j;
            v = 2.0 * a * h / ((g * g + 4.0 * a * h).sqrt() + g);
            if v < 2.0 * a * a / j {
                a = libm::cbrt(h * j * j / (2.0 * PI));
                v = 2.0 * a * a / j;
            }
        }
        let quarter_s = FRAC_PI_2 * a / j;
        let constant_s = (v / a - 2.0 * a / j).max(0.0);
        let cruise_s = (h / v - (v / a + round * a / j)).max(0.0);
        let (q, c) = (quarter_s, constant_s);
        let intervals_s = [q, c, q, cruise_s, q, c, q];
        Ok(Self {
            course: Course::Limits(limits, intervals_s),
            ..Self::new(travel_m, intervals_s)?
        })
    }
}
