//! A command through given points: the clamped cubic spline.

use super::point::MotionPoint;
use super::segment::{Segment, Shape};
use super::{Course, Motion, MotionError};

impl Motion {
    /// The twice continuously differentiable cubic spline through the points, time
    /// \[s\] and displacement \[m\], with slope 0 at both ends: the acceleration jumps
    /// there, and between two points the spline can leave the range that they span.
    ///
    /// # Errors
    /// [`MotionError`] if there are fewer than two points, the first is not (0, 0), a
    /// number is not finite, the times do not rise, or the spline is not finite.
    ///
    /// ```
    /// let motion = plant::Motion::profile(&[(0.0, 0.0), (0.5, 0.2), (1.0, 0.25)])?;
    /// assert_eq!(motion.at(0.5).displacement_m, 0.2);
    /// assert_eq!(motion.at(2.0).displacement_m, 0.25);
    /// # Ok::<(), plant::MotionError>(())
    /// ```
    pub fn profile(points: &[(f64, f64)]) -> Result<Self, MotionError> {
        if points.len() < 2 {
            return Err(MotionError::FewPoints(points.len()));
        }
        if points[0] != (0.0, 0.0) {
            return Err(MotionError::FirstPoint);
        }
        for (index, pair) in points.windows(2).enumerate() {
            let (time_s, x_m) = pair[1];
            let number = index + 2;
            if !(time_s.is_finite() && x_m.is_finite()) {
                return Err(MotionError::Point { number });
            }
            if time_s <= pair[0].0 {
                return Err(MotionError::Order { number });
            }
        }
        let slopes_mps = clamped_slopes(points);
        let mut segments = Vec::with_capacity(points.len() - 1);
        let mut displacement_integral_ms = 0.0;
        let mut overshoot_m: f64 = 0.0;
        for (ends, slopes) in points.windows(2).zip(slopes_mps.windows(2)) {
            let ((start_s, x0), (end_s, x1)) = (ends[0], ends[1]);
            let (t, chord) = (end_s - start_s, (x1 - x0) / (end_s - start_s));
            let (v0, v1) = (slopes[0], slopes[1]);
            let segment = Segment {
                start_s,
                duration_s: t,
                shape: Shape::Ramp(6.0 * ((v0 - chord) + (v1 - chord)) / (t * t)),
                amplitude_mps2: 2.0 * (2.0 * (chord - v0) + (chord - v1)) / t,
                start: MotionPoint {
                    acceleration_mps2: 0.0,
                    velocity_mps: v0,
                    displacement_m: x0,
                    displacement_integral_ms,
                },
            };
            displacement_integral_ms = segment.at(t).displacement_integral_ms;
            let (lowest, highest) = segment.displacements_m();
            let beyond = (x0.min(x1) - lowest).max(highest - x0.max(x1));
            overshoot_m = overshoot_m.max(beyond);
            segments.push(segment);
        }
        let (first, last) = (&segments[0], &segments[segments.len() - 1]);
        let profile = Profile {
            points: points.len(),
            overshoot_m,
            start_jump_mps2: first.amplitude_mps2.abs(),
            end_jump_mps2: last.at(last.duration_s).acceleration_mps2.abs(),
        };
        let end = MotionPoint {
            displacement_m: points[points.len() - 1].1,
            displacement_integral_ms,
            ..MotionPoint::default()
        };
        let breaks_s = points[1..].iter().map(|(time_s, _)| *time_s).collect();
        Self::of_segments(segments, breaks_s, end, Course::Profile(profile))
    }
}

/// Figures of a profile that its points do not show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// Number of points.
    pub points: usize,
    /// Farthest that the spline goes beyond the two points around it \[m\].
    pub overshoot_m: f64,
    /// Jump of the acceleration at the first point \[m/s²\].
    pub start_jump_mps2: f64,
    /// Jump of the acceleration at the last point \[m/s²\].
    pub end_jump_mps2: f64,
}

/// Slopes of the clamped cubic spline at its points, by Thomas' algorithm:
///
/// ```text
/// vᵢ₋₁/hᵢ₋₁ + 2·(1/hᵢ₋₁ + 1/hᵢ)·vᵢ + vᵢ₊₁/hᵢ = 3·(Δᵢ₋₁/hᵢ₋₁ + Δᵢ/hᵢ),   v₀ = vₙ = 0
/// ```
///
/// with the lengths h and the chords' slopes Δ (de Boor, A Practical Guide to Splines,
/// chapter IV). The matrix is dominated by its diagonal: no pivot is needed.
fn clamped_slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let pieces: Vec<(f64, f64)> = points
        .windows(2)
        .map(|pair| {
            let length_s = pair[1].0 - pair[0].0;
            (1.0 / length_s, (pair[1].1 - pair[0].1) / length_s)
        })
        .collect();
    // Forward: vᵢ = right − upper·vᵢ₊₁.
    let mut rows = vec![(0.0, 0.0)];
    for pair in pieces.windows(2) {
        let ((before, chord_before), (after, chord_after)) = (pair[0], pair[1]);
        let (upper, right) = rows[rows.len() - 1];
        let pivot = 2.0 * (before + after) - before * upper;
        let sum = 3.0 * (chord_before * before + chord_after * after);
        rows.push((after / pivot, (sum - before * right) / pivot));
    }
    let mut slopes = vec![0.0; points.len()];
    for (i, (upper, right)) in rows.iter().enumerate().skip(1).rev() {
        slopes[i] = right - upper * slopes[i + 1];
    }
    slopes
}
