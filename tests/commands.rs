//! Motion commands beyond seven given intervals: limits, moves in a row, profiles.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::PI;

use bench_tests::quadrature::integral;
use bench_tests::{case, rows};
use hil_core::case::Case;
use hil_core::trace::Row;
use hil_runner::host::LinkKind;
use plant::{Course, Motion, MotionError, MotionLimits, MotionPoint};
use proptest::prelude::*;

const NONE: f64 = f64::INFINITY;

fn limits(velocity_mps: f64, acceleration_mps2: f64, jerk_mps3: f64) -> MotionLimits {
    MotionLimits {
        velocity_mps,
        acceleration_mps2,
        jerk_mps3,
    }
}

/// The shortest intervals over `h` by bisection, without the closed forms: at a top
/// speed v the largest acceleration is the smaller of a and √(v·j/2), which leaves
/// `t2 ≥ 0`; a higher top speed is always faster, until rise and fall make up `h`.
fn shortest(h: f64, of: &MotionLimits) -> [f64; 7] {
    let (a, j) = (of.acceleration_mps2, of.jerk_mps3);
    let peak = |v: f64| a.min((v * j / 2.0).sqrt());
    let rise_s = |v: f64| v / peak(v) + (PI - 2.0) * peak(v) / j;
    let (mut low, mut high) = (0.0, of.velocity_mps.min(4.0 * (a * h).sqrt()));
    if high * rise_s(high) <= h {
        low = high;
    }
    for _ in 0..200 {
        let middle = f64::midpoint(low, high);
        *(if middle * rise_s(middle) <= h {
            &mut low
        } else {
            &mut high
        }) = middle;
    }
    let (v, a) = (low, peak(low));
    let (quarter, constant) = (PI * a / (2.0 * j), v / a - 2.0 * a / j);
    let cruise = h / v - rise_s(v);
    [
        quarter, constant, quarter, cruise, quarter, constant, quarter,
    ]
}

/// Largest speed, acceleration and jerk that sampling finds.
fn peaks(motion: &Motion) -> [f64; 3] {
    let (mut peaks, mut start_s) = ([0.0_f64; 3], 0.0);
    for &end_s in motion.breaks_s() {
        let step_s = (end_s - start_s) / 2000.0;
        let at = |i: u32| motion.at(start_s + step_s * (f64::from(i) + 0.5));
        for (from, to) in (0..1999).map(|i| (at(i), at(i + 1))) {
            let jerk = (to.acceleration_mps2 - from.acceleration_mps2) / step_s;
            let found = [to.velocity_mps, to.acceleration_mps2, jerk];
            for (peak, value) in peaks.iter_mut().zip(found) {
                *peak = peak.max(value.abs());
            }
        }
        start_s = end_s;
    }
    peaks
}

/// v, a and j that do and do not come to act, each branch of the formulas.
const BRANCHES: [(f64, MotionLimits); 7] = [
    // Cruise, and acceleration constant for a while.
    (
        0.25,
        MotionLimits {
            velocity_mps: 0.5,
            acceleration_mps2: 2.0,
            jerk_mps3: 40.0,
        },
    ),
    // Cruise, and the speed too small for that acceleration.
    (
        0.25,
        MotionLimits {
            velocity_mps: 0.05,
            acceleration_mps2: 2.0,
            jerk_mps3: 40.0,
        },
    ),
    // No cruise, acceleration constant for a while.
    (
        0.25,
        MotionLimits {
            velocity_mps: 3.0,
            acceleration_mps2: 2.0,
            jerk_mps3: 40.0,
        },
    ),
    // The jerk alone.
    (
        0.01,
        MotionLimits {
            velocity_mps: 3.0,
            acceleration_mps2: 2.0,
            jerk_mps3: 10.0,
        },
    ),
    // The speed too small for the acceleration, and the travel for the speed.
    (
        0.001,
        MotionLimits {
            velocity_mps: 0.3,
            acceleration_mps2: 2.0,
            jerk_mps3: 10.0,
        },
    ),
    // No limit of the jerk, with and without cruise.
    (
        0.25,
        MotionLimits {
            velocity_mps: 0.5,
            acceleration_mps2: 2.0,
            jerk_mps3: NONE,
        },
    ),
    (
        0.25,
        MotionLimits {
            velocity_mps: NONE,
            acceleration_mps2: 2.0,
            jerk_mps3: NONE,
        },
    ),
];

#[test]
fn limits_make_the_shortest_intervals_in_every_branch() {
    for (h, of) in BRANCHES {
        let motion = Motion::limited(h, of).unwrap();
        let (found, expected) = (motion.intervals_s().unwrap(), shortest(h, &of));
        for (found, expected) in found.into_iter().zip(expected) {
            // A bisection of v leaves ε·v; h/v − T_a cancels.
            assert!(
                (found - expected).abs() < 1e-13,
                "{of:?}: {found} for {expected}"
            );
        }
        assert_eq!(motion.travel_m(), h);
        let [v, a, j] = peaks(&motion);
        let within = |peak: f64, limit: f64| peak <= limit * (1.0 + 1e-9);
        assert!(
            within(v, of.velocity_mps) && within(a, of.acceleration_mps2),
            "{v} {a} {of:?}"
        );
        assert!(
            of.jerk_mps3 == NONE || within(j, of.jerk_mps3),
            "{j} {of:?}"
        );
        // The contrast: a thousandth faster breaks a limit.
        let hurried = Motion::new(h, found.map(|t| 0.999 * t)).unwrap();
        let [v, a, j] = peaks(&hurried);
        let kept = within(v, of.velocity_mps) && within(a, of.acceleration_mps2);
        assert!(
            !kept || of.jerk_mps3 != NONE && !within(j, of.jerk_mps3),
            "{of:?}"
        );
        let mirrored = Motion::limited(-h, of).unwrap();
        assert_eq!(mirrored.intervals_s().unwrap(), found);
        assert_eq!(
            mirrored.at(0.1).displacement_m,
            -motion.at(0.1).displacement_m
        );
    }
}

proptest! {
    #[test]
    fn any_limits_make_the_shortest_intervals(
        h in 1e-4..2.0_f64, v in 1e-3..5.0_f64, a in 1e-2..50.0_f64, j in 1e-1..1e4_f64,
    ) {
        let of = limits(v, a, j);
        let motion = Motion::limited(h, of).unwrap();
        let total: f64 = motion.end_s();
        for (found, expected) in motion.intervals_s().unwrap().into_iter().zip(shortest(h, &of)) {
            // Where t2 or t4 begins, each is a difference of what is nearly equal.
            prop_assert!((found - expected).abs() < 1e-7 * total, "{} {}", found, expected);
        }
        let expected: f64 = shortest(h, &of).iter().sum();
        prop_assert!((total - expected).abs() < 1e-12 * total, "{} {}", total, expected);
    }
}

#[test]
fn no_travel_is_no_motion_and_a_limit_of_nothing_is_refused() {
    let rest = Motion::limited(0.0, limits(0.5, 2.0, 40.0)).unwrap();
    assert_eq!((rest.end_s(), rest.breaks_s().len()), (0.0, 0));
    assert_eq!(rest.at(0.0), MotionPoint::default());
    assert_eq!(rest.at(1.0), MotionPoint::default());
    for (of, name) in [
        (limits(0.0, 2.0, 40.0), "velocity"),
        (limits(0.5, -2.0, 40.0), "acceleration"),
        (limits(0.5, NONE, 40.0), "acceleration"),
        (limits(0.5, 2.0, f64::NAN), "jerk"),
    ] {
        let error = Motion::limited(0.1, of).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    assert!(matches!(
        Motion::limited(NONE, limits(1.0, 1.0, 1.0)),
        Err(MotionError::Travel(_))
    ));
}

/// Largest difference between what the command says at the end of each interval and the
/// integrals of the acceleration, velocity and displacement over it, of the largest of
/// each: Gauss's rule with five nodes on eight parts.
fn off_its_integrals(motion: &Motion, at: impl Fn(f64) -> MotionPoint) -> f64 {
    let values = |p: MotionPoint| {
        [
            p.acceleration_mps2,
            p.velocity_mps,
            p.displacement_m,
            p.displacement_integral_ms,
        ]
    };
    let (mut start_s, mut off, mut sizes) = (0.0, [0.0_f64; 3], [f64::MIN_POSITIVE; 3]);
    let end_s = motion.end_s() + 0.1;
    for &break_s in motion.breaks_s().iter().chain([&end_s]) {
        let (from, to) = (values(at(start_s)), values(at(break_s)));
        for i in 0..3 {
            let rise = integral(|t| values(at(t))[i], start_s, break_s, 8);
            off[i] = off[i].max((from[i + 1] + rise - to[i + 1]).abs());
            sizes[i] = sizes[i].max(to[i + 1].abs());
        }
        start_s = break_s;
    }
    (0..3).fold(0.0, |worst: f64, i| worst.max(off[i] / sizes[i]))
}

fn moves() -> Motion {
    let forth = Motion::new(0.12, [0.1, 0.1, 0.1, 0.05, 0.1, 0.1, 0.1]).unwrap();
    let on = Motion::limited(0.03, limits(0.2, 3.0, 60.0)).unwrap();
    let back = Motion::limited(-0.19, limits(0.9, 5.0, NONE)).unwrap();
    Motion::row(&[(forth, 0.15), (on, 0.0), (back, 0.3)]).unwrap()
}

/// Uneven in time, and up and down.
const POINTS: [(f64, f64); 8] = [
    (0.0, 0.0),
    (0.08, 0.0031),
    (0.17, 0.0142),
    (0.3, 0.06),
    (0.35, 0.055),
    (0.6, 0.11),
    (0.61, 0.1102),
    (0.9, 0.02),
];

fn profile() -> Motion {
    Motion::profile(&POINTS).unwrap()
}

#[test]
fn each_quantity_is_the_integral_of_the_one_above() {
    for motion in [
        moves(),
        profile(),
        Motion::limited(0.1, BRANCHES[3].1).unwrap(),
    ] {
        let off = off_its_integrals(&motion, |t| motion.at(t));
        assert!(off < 2e-14, "{off}");
        // The contrast: an acceleration that is larger by 1e-12 over all.
        let off = off_its_integrals(&motion, |t| {
            let mut point = motion.at(t);
            point.acceleration_mps2 *= 1.0 + 1e-12;
            point
        });
        assert!(off > 2e-14, "{off}");
    }
}

#[test]
fn a_row_is_its_moves_one_after_the_other() {
    let motion = moves();
    let Course::Row(parts) = motion.course() else {
        unreachable!()
    };
    let (mut start_s, mut from_m) = (0.0, 0.0);
    for (part, dwell_s) in parts.iter() {
        for i in 0..=100 {
            let tau_s = part.end_s() * (f64::from(i) + 0.5) / 101.0;
            let (own, found) = (part.at(tau_s), motion.at(start_s + tau_s));
            let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 1e-12 * size;
            let peak = part.peak_acceleration_until_mps2(part.end_s());
            assert!(near(
                found.acceleration_mps2,
                own.acceleration_mps2,
                10.0 * peak
            ));
            assert!(near(found.velocity_mps, own.velocity_mps, 1.0));
            assert!(near(found.displacement_m, from_m + own.displacement_m, 1.0));
        }
        from_m += part.travel_m();
        let end_s = start_s + part.end_s();
        let rest = motion.at(end_s + 0.5 * dwell_s);
        if *dwell_s > 0.0 {
            assert_eq!(
                (
                    rest.acceleration_mps2,
                    rest.velocity_mps,
                    rest.displacement_m
                ),
                (0.0, 0.0, from_m)
            );
        }
        start_s = end_s + dwell_s;
    }
    // The last dwell is no part of the motion.
    assert!((motion.end_s() - (start_s - 0.3)).abs() < 1e-12);
    assert_eq!(motion.travel_m(), from_m);
    assert_eq!(motion.largest_displacement_m(), 0.12 + 0.03);
    assert!((motion.peak_velocity_mps() - peaks(&motion)[0]).abs() < 1e-5);
}

/// 0.1 s + 0.2 s is no whole number of nanoseconds as a sum; 2 ps beside one stay there.
#[test]
fn joints_within_a_picosecond_of_a_nanosecond_are_there() {
    let step = |t1: f64| Motion::new(0.1, [0.0, t1, 0.0, 0.2, 0.0, t1, 0.0]).unwrap();
    let motion = Motion::row(&[(step(0.1), 0.1), (step(0.1), 0.0)]).unwrap();
    let on = |times: &[f64]| times.iter().all(|t| t * 1e9 == (t * 1e9).round());
    assert!(on(motion.breaks_s()), "{:?}", motion.breaks_s());
    assert_eq!(motion.end_s(), 0.9);
    assert!(!on(step(0.1).breaks_s()));
    // The row at a joint stands on its right.
    assert_eq!(motion.acceleration_before_mps2(0.8), 0.0);
    assert!(motion.at(0.8).acceleration_mps2 < -1.0);
    let near = Motion::row(&[(step(0.1 + 0.4e-12), 0.1), (step(0.1), 0.0)]).unwrap();
    assert!(on(near.breaks_s()), "{:?}", near.breaks_s());
    let far = Motion::row(&[(step(0.1 + 2e-12), 0.1), (step(0.1), 0.0)]).unwrap();
    assert!(!on(far.breaks_s()), "{:?}", far.breaks_s());
    for dwell_s in [-1e-9, f64::NAN, NONE] {
        let refused = Motion::row(&[(step(0.1), dwell_s)]);
        assert!(matches!(refused, Err(MotionError::Dwell { number: 1, .. })));
    }
    assert_eq!(Motion::row(&[]), Err(MotionError::NoDuration));
}

/// The accelerations at the points of the clamped spline, from the equations in these,
/// by elimination with a full matrix.
fn moments(points: &[(f64, f64)], clamped: bool) -> Vec<f64> {
    let n = points.len();
    let h = |i: usize| points[i + 1].0 - points[i].0;
    let chord = |i: usize| (points[i + 1].1 - points[i].1) / h(i);
    let mut rows = vec![vec![0.0; n + 1]; n];
    for i in 1..n - 1 {
        rows[i][i - 1] = h(i - 1) / 6.0;
        rows[i][i] = (h(i - 1) + h(i)) / 3.0;
        rows[i][i + 1] = h(i) / 6.0;
        rows[i][n] = chord(i) - chord(i - 1);
    }
    if clamped {
        (rows[0][0], rows[0][1], rows[0][n]) = (h(0) / 3.0, h(0) / 6.0, chord(0));
        (rows[n - 1][n - 1], rows[n - 1][n - 2]) = (h(n - 2) / 3.0, h(n - 2) / 6.0);
        rows[n - 1][n] = -chord(n - 2);
    } else {
        (rows[0][0], rows[n - 1][n - 1]) = (1.0, 1.0);
    }
    for i in 0..n {
        let pivot = rows[i].clone();
        for (k, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != i) {
            let factor = row[i] / pivot[i];
            assert!(factor.is_finite(), "{k}");
            for (value, of_pivot) in row.iter_mut().zip(&pivot) {
                *value -= factor * of_pivot;
            }
        }
    }
    (0..n).map(|i| rows[i][n] / rows[i][i]).collect()
}

/// x and its acceleration between two points from the accelerations there.
fn by_moments(points: &[(f64, f64)], m: &[f64], t: f64) -> (f64, f64) {
    let i = (0..points.len() - 2)
        .find(|&i| t < points[i + 1].0)
        .unwrap_or(points.len() - 2);
    let ((t0, x0), (t1, x1)) = (points[i], points[i + 1]);
    let (h, a, b) = (t1 - t0, t1 - t, t - t0);
    let linear = (x0 / h - m[i] * h / 6.0) * a + (x1 / h - m[i + 1] * h / 6.0) * b;
    let x = (m[i] * a * a * a + m[i + 1] * b * b * b) / (6.0 * h) + linear;
    (x, (m[i] * a + m[i + 1] * b) / h)
}

fn off_moments(motion: &Motion, clamped: bool) -> (f64, f64) {
    let m = moments(&POINTS, clamped);
    (0..2000).fold((0.0, 0.0), |worst: (f64, f64), i| {
        let t = 0.9 * (f64::from(i) + 0.5) / 2000.0;
        let ((x, a), found) = (by_moments(&POINTS, &m, t), motion.at(t));
        let off = (found.displacement_m - x).abs();
        (
            worst.0.max(off),
            worst.1.max((found.acceleration_mps2 - a).abs()),
        )
    })
}

#[test]
fn a_profile_is_the_clamped_spline() {
    let motion = profile();
    let (x_m, a_mps2) = off_moments(&motion, true);
    assert!(x_m < 1e-15 && a_mps2 < 1e-10, "{x_m} {a_mps2}");
    // The contrast: the natural spline through the same points.
    let (x_m, a_mps2) = off_moments(&motion, false);
    assert!(x_m > 1e-4 && a_mps2 > 0.1, "{x_m} {a_mps2}");
    let m = moments(&POINTS, true);
    let Course::Profile(of) = motion.course() else {
        unreachable!()
    };
    assert!((of.start_jump_mps2 - m[0].abs()).abs() < 1e-11);
    assert!((of.end_jump_mps2 - m[7].abs()).abs() < 1e-11);
    assert_eq!(motion.acceleration_before_mps2(0.0), 0.0);
    assert_eq!(motion.at(0.9).acceleration_mps2, 0.0);
    for (t, x) in POINTS {
        assert_eq!(motion.at(t).displacement_m, x);
    }
    assert_eq!((motion.travel_m(), motion.end_s()), (0.02, 0.9));
    let sampled = peaks(&motion);
    let velocity = motion.peak_velocity_mps();
    assert!(
        (velocity - sampled[0]).abs() < 1e-4 * velocity,
        "{velocity} {sampled:?}"
    );
    let peak = motion.peak_acceleration_until_mps2(0.9);
    assert!(
        (peak - sampled[1]).abs() < 1e-2 * peak,
        "{peak} {sampled:?}"
    );
}

/// A cubic with slope 0 at both ends is its own clamped spline, and between its points
/// it does not overshoot; a step in the points does.
#[test]
fn a_cubic_is_reproduced_and_a_step_overshoots() {
    let cubic = |t: f64| t * t * (3.0 - 2.0 * t);
    let times = [0.0, 0.11, 0.2, 0.47, 0.5, 0.83, 1.0];
    let motion = Motion::profile(&times.map(|t| (t, cubic(t)))).unwrap();
    for i in 0..=1000 {
        let t = f64::from(i) / 1000.0;
        let point = motion.at(t);
        assert!((point.displacement_m - cubic(t)).abs() < 1e-15);
        assert!((point.velocity_mps - 6.0 * t * (1.0 - t)).abs() < 1e-13);
    }
    let overshoot_m = |motion: &Motion| match motion.course() {
        Course::Profile(of) => of.overshoot_m,
        _ => f64::NAN,
    };
    assert!(overshoot_m(&motion) < 1e-15);
    let steps = [(0.0, 0.0), (0.1, 0.0), (0.2, 1.0), (0.3, 1.0)];
    let motion = Motion::profile(&steps).unwrap();
    let lowest = (0..=1000).map(|i| motion.at(1e-4 * f64::from(i)).displacement_m);
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    assert!(lowest < -0.05, "{lowest}");
    assert!((overshoot_m(&motion) + lowest).abs() < 1e-5, "{lowest}");
    let highest = motion.largest_displacement_m();
    assert!((highest - (1.0 - lowest)).abs() < 1e-5, "{highest}");
}

#[test]
fn points_that_make_no_profile_are_refused() {
    let refusal = |points: &[(f64, f64)]| Motion::profile(points).unwrap_err();
    assert_eq!(refusal(&[(0.0, 0.0)]), MotionError::FewPoints(1));
    assert_eq!(refusal(&[(0.0, 0.1), (1.0, 0.2)]), MotionError::FirstPoint);
    assert_eq!(
        refusal(&[(0.0, 0.0), (1.0, f64::NAN)]),
        MotionError::Point { number: 2 }
    );
    let still = [(0.0, 0.0), (1.0, 0.1), (1.0, 0.2)];
    assert_eq!(refusal(&still), MotionError::Order { number: 3 });
    assert_eq!(
        refusal(&[(0.0, 0.0), (1e-300, 1e300)]),
        MotionError::OutOfRange
    );
}

/// Largest difference in β and I between two solvers on rung `continuous`.
fn apart(motion: &Motion, sets: &[&str]) -> (f64, f64) {
    let of = |sets: &[&str]| {
        let sets = [
            &["controller.law=continuous", "run.row_interval_s=1.7e-3"],
            sets,
        ]
        .concat();
        let case = Case {
            motion: motion.clone(),
            ..case("paper-2", &sets)
        };
        rows(&case, LinkKind::InProcess).0
    };
    let (exact, other) = (of(&["run.solver=exact"]), of(sets));
    assert_eq!(exact.len(), other.len());
    exact
        .iter()
        .zip(&other)
        .fold((0.0, 0.0), |worst: (f64, f64), (a, b)| {
            let off = (a.beta_rad - b.beta_rad).abs();
            (
                worst.0.max(off),
                worst.1.max((a.current_a - b.current_a).abs()),
            )
        })
}

#[test]
fn solvers_agree_on_moves_and_profiles() {
    for motion in [moves(), profile()] {
        let (beta_rad, current_a) = apart(&motion, &["run.solver=dopri5"]);
        assert!(
            beta_rad < 1e-9 && current_a < 1e-7,
            "{beta_rad} {current_a}"
        );
        // The contrast: a tolerance that the comparison sees.
        let (beta_rad, _) = apart(&motion, &["run.solver=dopri5", "run.tolerance=1e-4"]);
        assert!(beta_rad > 1e-9, "{beta_rad}");
    }
}

/// Longer than the clock's range of 2^64 ns: the run sees the beginning, as the rung
/// below does.
#[test]
fn a_motion_beyond_the_clock_s_range_is_run_as_far_as_the_run_goes() {
    let firmware = "controller.law=firmware";
    let of = |sets: &[&str]| rows(&case("paper-2", sets), LinkKind::InProcess).0;
    for slow in [
        "motion.max_acceleration_mps2=1e-49",
        "motion.intervals_s=[1e24,0,1e24,0,1e24,0,1e24]",
    ] {
        let rows = of(&[slow, firmware]);
        let below = of(&[slow, "controller.law=quantised"]);
        assert_eq!(rows.len(), 1501);
        let travelled = |rows: &[Row]| rows.iter().map(|row| row.beta_rad).collect::<Vec<_>>();
        assert_eq!(travelled(&rows), travelled(&below), "{slow}");
    }
    // The contrast: a motion that moves the axis.
    assert!(of(&[firmware]).last().unwrap().beta_rad > 1.0);
}
