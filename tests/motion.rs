//! The motion command of Fig. 6 against numerical integration, hand formulas
//! and its own promises.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::{FRAC_PI_2, PI};

use bench_tests::quadrature::integral;
use plant::{Motion, MotionError, MotionPoint};
use proptest::prelude::*;

/// Intervals of the paper's Table 2 \[s\].
const PAPER: [[f64; 7]; 4] = [
    [0.0, 0.333, 0.0, 0.333, 0.0, 0.333, 0.0],
    [0.25, 0.0, 0.25, 0.0, 0.25, 0.0, 0.25],
    [0.125, 0.0, 0.375, 0.0, 0.375, 0.0, 0.125],
    [0.1, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2],
];

/// Parts of an integral. The worst integrand is a quarter sine, `ω·h = π/8`: Gauss's rule is
/// off by 1.3e-17 of `A/ω` per part, below the rounding of one sum.
const PARTS: u32 = 4;

/// Errors in velocity, displacement and its integral that rounding explains.
///
/// A time is off by half an ulp of the end and moves each quantity by its
/// rate times that; each quantity is a sum of terms no larger than its peak.
/// Nothing is left of the quadrature itself ([`PARTS`]).
#[derive(Debug, Clone, Copy)]
struct Rounding {
    velocity: f64,
    displacement: f64,
    integral: f64,
}

impl Rounding {
    /// Of 20 000 random motions some need 2, none 2.5; the rest is margin.
    const UNITS: f64 = 8.0;

    fn of(motion: &Motion) -> Self {
        let (h, end_s) = (motion.travel_m().abs(), motion.end_s());
        let acceleration = motion.peak_acceleration_until_mps2(end_s);
        let velocity = motion
            .breaks_s()
            .iter()
            .map(|&t| motion.at(t).velocity_mps.abs());
        let velocity = velocity.into_iter().fold(0.0, f64::max);
        let unit = Self::UNITS * f64::EPSILON;
        Self {
            velocity: unit * (velocity + acceleration * end_s),
            displacement: unit * (h + velocity * end_s),
            integral: unit * (h * end_s),
        }
    }

    fn allows(&self, a: &MotionPoint, b: &MotionPoint) -> bool {
        (a.velocity_mps - b.velocity_mps).abs() <= self.velocity
            && (a.displacement_m - b.displacement_m).abs() <= self.displacement
            && (a.displacement_integral_ms - b.displacement_integral_ms).abs() <= self.integral
    }
}

/// Start and end of every interval that is not empty \[s\], with its index.
fn pieces(motion: &Motion) -> Vec<(usize, f64, f64)> {
    let ends = motion.breaks_s().iter().copied();
    let starts = [0.0].into_iter().chain(ends.clone());
    let pieces = starts.zip(ends).enumerate();
    let pieces = pieces.map(|(index, (start, end))| (index, start, end));
    pieces.filter(|(_, start, end)| end > start).collect()
}

/// `from` carried to `to` by integrating each quantity from the one above it.
fn carried(at: impl Fn(f64) -> MotionPoint, from: f64, to: f64) -> MotionPoint {
    let start = at(from);
    MotionPoint {
        acceleration_mps2: 0.0,
        velocity_mps: start.velocity_mps + integral(|t| at(t).acceleration_mps2, from, to, PARTS),
        displacement_m: start.displacement_m + integral(|t| at(t).velocity_mps, from, to, PARTS),
        displacement_integral_ms: start.displacement_integral_ms
            + integral(|t| at(t).displacement_m, from, to, PARTS),
    }
}

/// The interval over which the closed form and the integration disagree.
fn disagreement(motion: &Motion, at: impl Fn(f64) -> MotionPoint, theta: f64) -> Option<usize> {
    let rounding = Rounding::of(motion);
    let wrong = |&(_, from, to): &(usize, f64, f64)| {
        let inside = from + theta * (to - from);
        // To somewhere inside, and across the break to the next interval.
        [inside, to]
            .iter()
            .any(|&t| !rounding.allows(&at(t), &carried(&at, from, t)))
    };
    pieces(motion).iter().find(|p| wrong(p)).map(|p| p.0)
}

/// Zero or 1 ms to 3 s.
fn interval() -> impl Strategy<Value = f64> {
    prop_oneof![2 => Just(0.0), 3 => 1e-3..3.0]
}

/// Any interval that a program might ask for, 1 ns to 1e6 s.
fn extreme_interval() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        Just(1e-9),
        Just(1e6),
        (-9.0..6.0).prop_map(|e| 10_f64.powf(e))
    ]
}

/// Motions that accelerate and decelerate.
fn motions(interval: impl Strategy<Value = f64>) -> impl Strategy<Value = Motion> {
    let intervals = prop::collection::vec(interval, 7);
    let travel = prop_oneof![-2.0..-1e-4, 1e-4..2.0];
    (travel, intervals).prop_filter_map("no acceleration or no deceleration", |(h, t)| {
        Motion::new(h, t.try_into().ok()?).ok()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn closed_form_is_the_integral(motion in motions(interval()), theta in 0.0..1.0) {
        prop_assert_eq!(motion.at(0.0).velocity_mps, 0.0);
        prop_assert_eq!(motion.at(0.0).displacement_m, 0.0);
        prop_assert_eq!(motion.at(0.0).displacement_integral_ms, 0.0);
        let wrong = disagreement(&motion, |t| motion.at(t), theta);
        prop_assert_eq!(wrong, None, "interval number {:?}, from 0", wrong);
    }

    /// The contrast: a jump of three times the bound in any one quantity.
    #[test]
    fn a_wrong_closed_form_is_found(motion in motions(1e-3..3.0), which in 0..3) {
        let rounding = Rounding::of(&motion);
        let (_, from, to) = pieces(&motion)[4];
        let middle = 0.5 * (from + to);
        let wrong = |t: f64| {
            let mut point = motion.at(t);
            if t > middle {
                match which {
                    0 => point.velocity_mps += 3.0 * rounding.velocity,
                    1 => point.displacement_m += 3.0 * rounding.displacement,
                    _ => point.displacement_integral_ms += 3.0 * rounding.integral,
                }
            }
            point
        };
        prop_assert!(disagreement(&motion, wrong, 0.75).is_some());
    }

    #[test]
    fn the_end_is_exact_and_at_rest(motion in motions(interval()), later_s in 0.0..1e3_f64) {
        let h = motion.travel_m();
        for time_s in [motion.end_s(), motion.end_s().next_up(), motion.end_s() + later_s] {
            let point = motion.at(time_s);
            prop_assert_eq!(point.displacement_m.to_bits(), h.to_bits());
            prop_assert_eq!(point.velocity_mps.to_bits(), 0.0_f64.to_bits());
            prop_assert_eq!(point.acceleration_mps2.to_bits(), 0.0_f64.to_bits());
            // From then on the integral grows by h per second.
            let grown = point.displacement_integral_ms
                - motion.at(motion.end_s()).displacement_integral_ms;
            let expected = h * (time_s - motion.end_s());
            prop_assert!((grown - expected).abs() <= 4e-16 * h.abs() * time_s);
        }
        for time_s in [-1e-300, -1e-9 - later_s] {
            prop_assert_eq!(motion.at(time_s), MotionPoint::default());
            prop_assert_eq!(motion.acceleration_before_mps2(time_s), 0.0);
        }
        prop_assert_eq!(motion.acceleration_before_mps2(0.0), 0.0);
        // A row later than the rounding of the sum is past the end.
        let past_s = motion.end_s() * (1.0 + 1e-14);
        prop_assert_eq!(motion.acceleration_before_mps2(past_s), 0.0);
    }

    #[test]
    fn breaks_are_the_sums_of_the_intervals(motion in motions(interval())) {
        let mut sum_s = 0.0;
        let sums = motion.intervals_s().unwrap().map(|t| {
            sum_s += t;
            sum_s
        });
        prop_assert_eq!(motion.breaks_s(), sums);
        prop_assert_eq!(motion.end_s(), sum_s);
    }

    /// Velocity, displacement and integral do not jump, whatever the
    /// acceleration does.
    #[test]
    fn only_the_acceleration_jumps(motion in motions(interval())) {
        let rounding = Rounding::of(&motion);
        for time_s in motion.breaks_s().iter().copied().filter(|&t| t > 0.0) {
            let (before, after) = (motion.at(time_s.next_down()), motion.at(time_s));
            prop_assert!(rounding.allows(&before, &after), "at {} s", time_s);
        }
    }

    /// The acceleration is the one of Fig. 6, written down a second time from
    /// the figure; both one-sided limits at the breaks included.
    #[test]
    fn acceleration_is_the_figures(motion in motions(interval()), theta in 0.0..1.0) {
        let [t1, t2, t3, _, t5, t6, t7] = motion.intervals_s().unwrap();
        let (gain, loss) = (t2 + 2.0 * (t1 + t3) / PI, t6 + 2.0 * (t5 + t7) / PI);
        // Constant velocity between t3 and t5, taken from the motion.
        let speed = motion.at(motion.breaks_s()[2]).velocity_mps;
        let shape = |index: usize, theta: f64| {
            let amplitude = match index {
                0..=2 => speed / gain,
                3 => 0.0,
                _ => -speed / loss,
            };
            match index {
                0 | 4 => amplitude * (FRAC_PI_2 * theta).sin(),
                2 | 6 => amplitude * (FRAC_PI_2 * (1.0 - theta)).sin(),
                _ => amplitude,
            }
        };
        let peak = motion.peak_acceleration_until_mps2(motion.end_s());
        for &(index, from, to) in &pieces(&motion) {
            // A time is off by half an ulp of itself, in parts of the interval.
            let bound = 8.0 * f64::EPSILON * peak * (1.0 + to / (to - from));
            let close = |a: f64, b: f64| (a - b).abs() <= bound;
            let time_s = from + theta * (to - from);
            prop_assert!(close(motion.at(time_s).acceleration_mps2, shape(index, theta)));
            // Right-continuous: the value at the start belongs to this interval.
            prop_assert!(close(motion.at(from).acceleration_mps2, shape(index, 0.0)));
            prop_assert!(close(motion.acceleration_before_mps2(to), shape(index, 1.0)));
            // Elsewhere nothing jumps.
            let inside = motion.acceleration_before_mps2(time_s);
            prop_assert!(time_s == from || inside == motion.at(time_s).acceleration_mps2);
        }
    }

    #[test]
    fn peak_is_what_sampling_finds(motion in motions(interval()), share in 0.0..1.3) {
        prop_assert_eq!(motion.peak_acceleration_until_mps2(-1e-9 - share), 0.0);
        let until_s = share * motion.end_s();
        let breaks = [0.0].into_iter().chain(motion.breaks_s().iter().copied());
        let grid = (0..=2000).map(|i| until_s * f64::from(i) / 2000.0);
        let times = breaks.chain(grid).chain([until_s]).filter(|&t| t <= until_s);
        let sampled = times.fold(0.0_f64, |peak, t| {
            peak.max(motion.at(t).acceleration_mps2.abs())
                .max(motion.acceleration_before_mps2(t).abs())
        });
        let peak = motion.peak_acceleration_until_mps2(until_s);
        let whole = motion.peak_acceleration_until_mps2(motion.end_s());
        prop_assert!((sampled - peak).abs() <= 4.0 * f64::EPSILON * whole);
        prop_assert_eq!(peak == 0.0, sampled == 0.0);
    }

    #[test]
    fn mirrored_travel_is_mirrored_to_the_bit(
        motion in motions(extreme_interval()),
        share in 0.0..1.2,
    ) {
        let back = Motion::new(-motion.travel_m(), motion.intervals_s().unwrap()).unwrap();
        let inside = [share * motion.end_s()];
        for time_s in motion.breaks_s().iter().copied().chain(inside) {
            let (there, here) = (motion.at(time_s), back.at(time_s));
            prop_assert_eq!(there.acceleration_mps2, -here.acceleration_mps2);
            prop_assert_eq!(there.velocity_mps, -here.velocity_mps);
            prop_assert_eq!(there.displacement_m, -here.displacement_m);
            prop_assert_eq!(there.displacement_integral_ms, -here.displacement_integral_ms);
            prop_assert_eq!(
                motion.acceleration_before_mps2(time_s),
                -back.acceleration_before_mps2(time_s)
            );
            prop_assert_eq!(
                motion.peak_acceleration_until_mps2(time_s),
                back.peak_acceleration_until_mps2(time_s)
            );
        }
    }

    /// Nanoseconds next to days: finite throughout, exact at the end, and on
    /// the way between start and target as far as the time resolves it.
    #[test]
    fn extreme_intervals_stay_finite(motion in motions(extreme_interval()), share in 0.0..1.0) {
        let (h, end_s) = (motion.travel_m(), motion.end_s());
        let rounding = Rounding::of(&motion);
        let times = pieces(&motion).into_iter();
        let times = times.flat_map(|(_, a, b)| [a, a + share * (b - a), b.next_down()]);
        for time_s in times {
            let p = motion.at(time_s);
            prop_assert!(p.acceleration_mps2.is_finite() && p.velocity_mps.is_finite());
            prop_assert!(p.displacement_integral_ms.is_finite());
            let way = p.displacement_m * h.signum();
            let slack = rounding.displacement;
            prop_assert!((-slack..=h.abs() + slack).contains(&way), "{} of {} m", way, h);
        }
        prop_assert_eq!(motion.at(end_s).displacement_m.to_bits(), h.to_bits());
        prop_assert_eq!(motion.at(end_s).velocity_mps, 0.0);
        prop_assert!(motion.at(end_s).displacement_integral_ms.is_finite());
    }
}

#[test]
fn the_papers_peaks_follow_from_hand_formulas() {
    let h = 0.25;
    let peaks = [
        // Speed A·T for T, reached and left in T each: h = 2·A·T².
        h / (2.0 * 0.333 * 0.333),
        // One sine over T_0 = 1 s: h = A·T_0²/2π.
        2.0 * PI * h,
        // Quarters of 1/8 and 3/8 s and their mirror image in time:
        // h = 2·A·(2/π)·(T1²·(1 − 2/π) + T1·T3 + T3²·2/π).
        4.0 * PI * PI * h / (PI + 4.0),
        // Speed A·0.1·(1 + 4/π), half of it on average over 0.3 and 0.6 s,
        // all of it over 0.1 s: h = 0.55 s times the speed.
        h / (0.55 * 0.1 * (1.0 + 4.0 / PI)),
    ];
    for (intervals_s, peak) in PAPER.into_iter().zip(peaks) {
        for travel_m in [h, -h] {
            let motion = Motion::new(travel_m, intervals_s).unwrap();
            let found = motion.peak_acceleration_until_mps2(motion.end_s());
            assert!((found - peak).abs() < 4e-15, "{found} for {peak}");
        }
    }
    // 1.127, 1.571, 1.382 and 2.000 m/s²: the four differ, so none can stand
    // for another.
    assert!(peaks.windows(2).all(|p| (p[0] - p[1]).abs() > 0.1));
}

#[test]
fn nanoseconds_next_to_seconds_end_exactly() {
    for intervals_s in [
        [0.0, 1e-9, 0.0, 1.0, 0.0, 1e-9, 0.0],
        [1e-9, 1.0, 1e-9, 1e-9, 1e-9, 1.0, 1e-9],
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-9],
        [1e6, 1e6, 1e6, 1e6, 1e6, 1e6, 1e6],
        [1e-9, 0.0, 0.0, 1e6, 1e6, 0.0, 0.0],
        [1e-9; 7],
    ] {
        let motion = Motion::new(0.25, intervals_s).unwrap();
        assert_eq!(motion.at(motion.end_s()).displacement_m, 0.25);
        let found = disagreement(&motion, |t| motion.at(t), 0.3);
        assert_eq!(found, None, "{intervals_s:?}");
    }
}

/// `NoDuration` and the like carry no number; `Interval` and `Travel` do, and
/// NaN equals nothing, so the text is compared.
#[test]
fn every_error_names_what_offends() {
    let good = PAPER[3];
    let refusal = |travel_m, intervals_s| Motion::new(travel_m, intervals_s).unwrap_err();
    for travel_m in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = refusal(travel_m, good);
        assert!(matches!(error, MotionError::Travel(v) if v.to_bits() == travel_m.to_bits()));
        let text = format!("the travel is {travel_m} m; it must be finite");
        assert_eq!(error.to_string(), text);
    }
    for index in 0..7 {
        for bad in [-1e-300, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut intervals_s = good;
            intervals_s[index] = bad;
            let error = refusal(0.25, intervals_s);
            assert!(matches!(error,
                MotionError::Interval { number, duration_s }
                    if number == index + 1 && duration_s.to_bits() == bad.to_bits()));
            let text = format!("interval t{} is {bad} s", index + 1);
            assert!(error.to_string().starts_with(&text), "{error}");
        }
    }
    let (none, rest) = ([0.0; 7], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let (up, down) = (
        [0.1, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.1, 0.0, 0.1],
    );
    assert_eq!(refusal(0.25, none), MotionError::NoDuration);
    assert_eq!(refusal(0.25, [-0.0; 7]), MotionError::NoDuration);
    assert_eq!(refusal(0.25, rest), MotionError::NoAcceleration);
    assert_eq!(refusal(0.25, down), MotionError::NoAcceleration);
    assert_eq!(refusal(0.25, up), MotionError::NoDeceleration);
    // A sum beyond the largest number, and ω = π/2T beyond it.
    for extreme in [1e308, 1e-310] {
        let error = refusal(0.25, [extreme; 7]);
        assert_eq!(error, MotionError::OutOfRange, "{extreme}");
    }
    for error in [
        MotionError::NoDuration,
        MotionError::NoAcceleration,
        MotionError::NoDeceleration,
    ] {
        assert!(error.to_string().contains("the motion needs a"), "{error}");
    }
}

#[test]
fn no_travel_is_a_rest_of_that_length() {
    for travel_m in [0.0, -0.0] {
        let motion = Motion::new(travel_m, PAPER[3]).unwrap();
        for i in 0..=110 {
            let point = motion.at(0.01 * f64::from(i));
            assert_eq!(point, MotionPoint::default());
        }
        assert_eq!(motion.peak_acceleration_until_mps2(2.0), 0.0);
    }
}

/// Intervals of 0.1 s add up to 0.30000000000000004 s: the row at 0.3 s is on
/// the right of the jump all the same, and the row before it on the left.
#[test]
fn jumps_at_decimal_times_are_right_continuous() {
    let motion = Motion::new(0.25, [0.0, 0.1, 0.0, 0.2, 0.0, 0.1, 0.0]).unwrap();
    let peak = motion.peak_acceleration_until_mps2(1.0);
    assert_eq!(motion.breaks_s()[4], 0.1 + 0.2);
    assert_eq!(motion.at(0.3).acceleration_mps2, -peak);
    assert_eq!(motion.acceleration_before_mps2(0.3), 0.0);
    assert_eq!(motion.at(0.3 - 1e-12).acceleration_mps2, 0.0);
    assert_eq!(motion.at(0.4).acceleration_mps2, 0.0);
    assert_eq!(motion.acceleration_before_mps2(0.4), -peak);
    assert_eq!(motion.at(0.4).displacement_m, 0.25);
}
