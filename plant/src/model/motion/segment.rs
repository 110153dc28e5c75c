//! One interval of the motion command, and the seven strung together.

use core::f64::consts::FRAC_PI_2;

use super::MotionPoint;

/// Shape of the acceleration within one interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// `sin ωτ`, from 0 to the amplitude.
    Rise,
    /// The amplitude throughout.
    Constant,
    /// `cos ωτ`, from the amplitude to 0.
    Fall,
}

const SHAPES: [Shape; 7] = [
    Shape::Rise,
    Shape::Constant,
    Shape::Fall,
    Shape::Constant,
    Shape::Rise,
    Shape::Constant,
    Shape::Fall,
];

/// One interval with the command at its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) start_s: f64,
    pub(super) duration_s: f64,
    pub(super) shape: Shape,
    pub(super) amplitude_mps2: f64,
    start: MotionPoint,
}

impl Segment {
    /// The command `tau_s` after the start of the segment.
    pub(super) fn at(&self, tau_s: f64) -> MotionPoint {
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
pub(super) fn chain(
    intervals_s: &[f64; 7],
    accelerate: f64,
    decelerate: f64,
) -> ([Segment; 7], MotionPoint) {
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
pub(super) fn fourth_derivatives(segments: &[Segment; 7]) -> MotionPoint {
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

/// When the last of them ends \[s\].
pub(super) fn end_of(segments: &[Segment; 7]) -> f64 {
    let last = &segments[6];
    last.start_s + last.duration_s
}
