//! The bounds and the roots, held against the solution itself.

use proptest::prelude::*;

use super::crossing::{Flow, LinearGuard, Sought};
use super::curve::{Found, first_zero};
use super::grid::{CELLS, Grid, horner};
use super::levels::{ChordBounds, Levels, TERMS, Taylor, growth_down_to};
use super::memory::Tables;
use super::sketch::{NODE_PRODUCT, NODES, Sketch, cubic_strays};
use super::system::{Column, Matrix};
use super::table::{Quantity, Table};
use crate::model::axis::Axis;
use crate::model::axis::Mode;
use crate::model::direction::Direction;
use crate::model::joint::JointMode;
use crate::numerics::bernstein::{Polynomial, value_and_slope};
use crate::numerics::width::One;
use crate::{
    AxisParameters, Carriage, ElasticJoint, Joint, Motor, Resistance, Surroundings, Transmission,
};

/// The paper's axis (Table 1) with another joint.
pub(crate) fn of_the_paper(joint: Joint) -> AxisParameters {
    AxisParameters {
        motor: Motor {
            inertia_kg_m2: 2e-4,
            torque_constant_nm_per_a: 0.25,
            resistance_ohm: 1.5,
            inductance_h: 6.5e-3,
        },
        transmission: Transmission {
            gear_ratio: 2.0,
            joint,
            screw_inertia_kg_m2: 8.5e-4,
            screw_pitch_m_per_rad: 5e-3 / core::f64::consts::TAU,
        },
        carriage: Carriage {
            mass_kg: 50.0,
            resistance: Resistance::default(),
        },
    }
}

/// Systems with slow, fast, oscillating and undamped parts.
fn systems() -> impl Strategy<Value = Matrix<3>> {
    (1.0..1e4_f64, 0.0..2.0_f64, 0.1..1e3_f64, -50.0..50.0_f64).prop_map(|(w, zeta, r, c)| {
        Matrix::<3>::new(0.0, 1.0, 0.0, -w * w, -2.0 * zeta * w, c, 0.1, -1.0, -r)
    })
}

/// A system, a quantity's coefficients, and the rates that a step begins with.
type Case = (Matrix<3>, Column<3>, Column<3>);

fn cases() -> impl Strategy<Value = Case> {
    let rates = [-1.0..1.0_f64, -100.0..100.0_f64, -1.0..1.0_f64];
    let rows = prop_oneof![
        Just(Column::<3>::new(1.0, 0.0, 0.0)),
        Just(Column::<3>::new(0.0, 1.0, 0.0)),
        Just(Column::<3>::new(350.0, 0.2, -1.0)),
    ];
    (systems(), rows, rates.prop_map(Column::from))
}

/// The first state as a quantity: its rate is the second state, whose own rate has these
/// coefficients. Both begin with these rates.
fn driven(second: [f64; 3], rate: [f64; 2]) -> Case {
    let mut a = Matrix::<3>::zeros();
    a[(0, 1)] = 1.0;
    a.set_row(1, &Column::<3>::from(second).transpose());
    (
        a,
        Column::ith(0, 1.0),
        Column::from([rate[0], rate[1], 0.0]),
    )
}

/// The state's change after `time_s`, by the series over pieces so short that
/// it converges; none of the tables is used.
fn change_after(a: &Matrix<3>, rate: &Column<3>, time_s: f64) -> Column<3> {
    let pieces = (growth_down_to(a, 0.0) * time_s).ceil().max(1.0);
    let (mut x, mut v) = (Column::zeros(), *rate);
    let mut done = 0.0;
    while done < pieces {
        x = Taylor::new(a, &x, &v, time_s / pieces).at(1.0);
        v = a * x + rate;
        done += 1.0;
    }
    x
}

/// Largest deviation of a quantity from its chord over a step, and of its slope
/// from that of the chord times the length.
fn strays((a, row, rate): &Case, length_s: f64) -> (f64, f64) {
    let end = row.dot(&change_after(a, rate, length_s));
    let (mut chord, mut slope) = (0.0_f64, 0.0_f64);
    for i in 0..=60 {
        let theta = f64::from(i) / 60.0;
        let x = change_after(a, rate, theta * length_s);
        chord = chord.max((row.dot(&x) - theta * end).abs());
        slope = slope.max((row.dot(&(a * x + rate)) * length_s - end).abs());
    }
    (chord, slope)
}

/// True if the chord bound lets `offset + row·x` pass over a whole step from 0.
fn all_hold((a, row, rate): &Case, offset: f64, length_s: f64) -> bool {
    let table = Table::new(Levels::new(a, length_s), None, &[*row]);
    let guard = LinearGuard {
        quantity: Sought::plain(table.quantity(Quantity::Delta), offset),
        noise: 0.0,
        fresh: false,
    };
    Flow::new(&table, *rate, Column::zeros()).all_hold(&[Some(guard)], length_s)
}

/// Fails unless a sketch of `row·x` over a step of `length_s` is as near as it says,
/// in value and slope, whole and up to `end`.
fn sketch_holds(
    sketch: &Sketch<3>,
    (a, row, rate): &Case,
    (length_s, end): (f64, f64),
) -> Result<(), TestCaseError> {
    let curve = sketch.curve(One, &(*rate).into(), (2.0, 0.25));
    let part = curve.until(One, end);
    let size = a.abs() * rate.abs() * length_s + rate.abs();
    let rounding = 1e-13 * row.abs().dot(&size) * length_s;
    for i in 0..=40 {
        let theta = f64::from(i) / 40.0;
        let change = change_after(a, rate, theta * length_s);
        let exact = 0.25 + 2.0 * row.dot(&change);
        let slope = 2.0 * row.dot(&(a * change + rate)) * length_s;
        let (value, _) = value_and_slope(One, &curve.values, theta);
        let (steepness, _) = value_and_slope(One, &curve.slopes, theta);
        prop_assert!((value - exact).abs() <= curve.stray + rounding);
        prop_assert!((steepness - slope).abs() <= curve.stray + rounding);
        prop_assert!(exact.abs() <= curve.upper(One) + rounding);
        let within = change_after(a, rate, theta * end * length_s);
        let (value, _) = value_and_slope(One, &part.values, theta);
        prop_assert!((value - 0.25 - 2.0 * row.dot(&within)).abs() <= part.stray + rounding);
    }
    Ok(())
}

/// How far `row·x` is from the cubic with its values and slopes at both ends, what it may be,
/// and the rounding of both.
fn off_the_cubic(grid: &Grid<3>, (a, row, rate): &Case) -> (f64, f64, f64) {
    let length_s = grid.length_s;
    let end = change_after(a, rate, length_s);
    let slopes = [*rate, a * end + rate].map(|rate| row.dot(&rate) * length_s / 3.0);
    let value = row.dot(&end);
    let cubic = [0.0, slopes[0], value - slopes[1], value];
    let off = (0..=40).map(|i| {
        let theta = f64::from(i) / 40.0;
        let exact = row.dot(&change_after(a, rate, theta * length_s));
        let rest = 1.0 - theta;
        let weights = [
            rest * rest * rest,
            3.0 * rest * rest * theta,
            3.0 * rest * theta * theta,
            theta * theta * theta,
        ];
        let on_cubic: f64 = weights.iter().zip(cubic).map(|(w, c)| w * c).sum();
        (exact - on_cubic).abs()
    });
    let size = a.abs() * rate.abs() * length_s + rate.abs();
    let rounding = 1e-13 * row.abs().dot(&size) * length_s;
    let bound = cubic_strays(grid, a, row).dot(&rate.abs());
    (off.fold(0.0, f64::max), bound, rounding)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// The documentation proves it: no quantity strays further. Nor does a slope: the rates
    /// are a solution too, which begins with the rate A·v.
    #[test]
    fn bounds_hold(case in cases(), length_s in 1e-6..0.02_f64) {
        let (a, row, rate) = &case;
        let bounds: ChordBounds<3> = Levels::new(a, length_s).bounds(row);
        let (chord, slope) = strays(&case, length_s);
        let change = change_after(a, rate, length_s);
        let rounding = 1e-9 * (row.abs().dot(&change.abs()) + row.abs().dot(&rate.abs()) * length_s);
        prop_assert!(chord <= bounds.over(0, rate) + rounding);
        prop_assert!(slope <= bounds.slope_over(0, rate) + rounding);
        let bend = a * rate;
        let slope = |share: f64| row.dot(&(rate + a * change_after(a, rate, share * length_s)));
        let (from, to) = (slope(0.0), slope(1.0));
        let rounding = 1e-9 * row.abs().dot(&(a.abs() * change.abs() + rate.abs()));
        for i in 0..=40 {
            let share = f64::from(i) / 40.0;
            let stray = (slope(share) - (from + share * (to - from))).abs();
            prop_assert!(stray <= bounds.over(0, &bend) + rounding);
        }
    }

    /// A guard that passes over a step has no zero in it.
    #[test]
    fn guards_that_hold_have_no_zero(
        case in cases(),
        growth in 1e-3..8.0_f64,
        above in 0.5..4.0_f64,
    ) {
        let (a, row, rate) = &case;
        let length_s = growth / growth_down_to(a, 0.0);
        let guard = |i: u32| row.dot(&change_after(a, rate, f64::from(i) / 60.0 * length_s));
        let lowest = (0..=60).map(guard).fold(0.0, f64::min);
        // Above zero, or below it by as much as half of the dip.
        let holds = all_hold(&case, -above * lowest, length_s);
        prop_assert!(!holds || above > 1.0 - 1e-9, "{above}");
        prop_assert!(all_hold(&case, 1e9, length_s));
    }

    /// Both sketches, with a grid and without, are as near as they say, in value and slope, and
    /// their local series are the solution.
    #[test]
    fn sketches_hold(case in cases(), growth in 1e-3..8.0_f64, end in 0.05..1.0_f64) {
        let (a, row, rate) = &case;
        let length_s = growth / growth_down_to(a, 0.0);
        let levels = Levels::new(a, length_s);
        let grid = Grid::new(&levels).unwrap();
        let about_middle = Sketch::about_middle(&levels, row).unwrap();
        sketch_holds(&Sketch::over(&grid, a, row), &case, (length_s, end))?;
        sketch_holds(&about_middle, &case, (length_s, end))?;
        let (off, bound, rounding) = off_the_cubic(&grid, &case);
        prop_assert!(off <= bound + rounding, "{off} {bound}");
        for i in 0..=40 {
            let centre_s = f64::from(i) / 40.0 * length_s;
            let change = change_after(a, rate, centre_s);
            let local = grid.near(One, a, (&[0.0; 3], &(*rate).into()), centre_s);
            let near = Column::from(local.at(local.window.sigma(centre_s)));
            let size = change.abs() + rate.abs() * length_s;
            prop_assert!(row.dot(&(near - change)).abs() <= 1e-12 * row.abs().dot(&size));
            let (window, q) = about_middle.around(rate, 0.125, (centre_s, length_s));
            // At its centre, and a quarter of its width from there.
            for sigma in [0.0, 0.5] {
                let time_s = window.time_s(sigma);
                let change = change_after(a, rate, time_s);
                let size = row.abs().dot(&(change.abs() + rate.abs() * length_s));
                let near = horner(One, &q, window.sigma(time_s)).0 - 0.125;
                prop_assert!((near - row.dot(&change)).abs() <= 1e-12 * (size + 0.125));
            }
        }
    }

    /// Zeros that the sketch calls clear are so: that of (θ − r)·(θ − r − gap).
    #[test]
    fn clear_zeros_are_the_first(r in -0.4..1.4_f64, gap in 1e-9..0.9_f64, stray in 1e-13..1e-3_f64) {
        // Three Bernstein coefficients of degree 2, then raised to degree 11.
        let (c, b) = (r * (r + gap), -(2.0 * r + gap));
        let q = |theta: f64| (c + b * theta) + theta * theta;
        let [b0, b1, b2] = [c, c + b / 2.0, c + b + 1.0];
        let values: [f64; 12] = core::array::from_fn(|i| {
            let (n, k) = (i as f64, 11.0 - i as f64);
            (b0 * k * (k - 1.0) + b1 * 2.0 * k * n + b2 * n * (n - 1.0)) / 110.0
        });
        match first_zero(&values, stray, 0.0, 3) {
            Found::None => for i in 0..=200 {
                prop_assert!(q(f64::from(i) / 200.0) > 0.0);
            },
            Found::At([theta, from, to]) => {
                let first = if r >= 0.0 { r } else { r + gap };
                prop_assert!(from <= first && first <= to, "{first} {from} {to}");
                prop_assert!((theta - first).abs() <= to - from);
                prop_assert!(q(from) > stray && q(to) < -stray);
            }
            Found::Unclear => {}
        }
        // Far from the ends and from each other it must be clear.
        if stray < 1e-9 && (0.05..0.9).contains(&r) && r + gap > 1.05 {
            let clear = first_zero(&values, stray, 0.0, 3) != Found::Unclear;
            prop_assert!(clear);
        }
    }

    /// A crossing and its return are two roots, however close.
    #[test]
    fn finds_the_first_of_two_close_roots(r in 0.01..0.9_f64, gap in 1e-6..0.05_f64) {
        let (c, b) = (r * (r + gap), -(2.0 * r + gap));
        let root = parabola(c, b, 1.0).first_negative();
        prop_assert!((root.unwrap() - r).abs() < 1e-9 / gap.max(1e-4));
        // The contrast: both ends are positive, their signs show nothing.
        prop_assert!(c > 0.0 && c + b + 1.0 > 0.0);
        // Lifted clear of zero there is nothing to find.
        prop_assert_eq!(parabola(c + gap * gap, b, 1.0).first_negative(), None);
    }

    #[test]
    fn finds_the_peak_between_the_ends(at in 0.05..0.95_f64, height in -2.0..2.0_f64) {
        // height − (θ − at)²: the supremum of its magnitude.
        let ends = (height - at * at).abs().max((height - (1.0 - at) * (1.0 - at)).abs());
        let expected = ends.max(height.abs());
        let peak = parabola(height - at * at, 2.0 * at, -1.0).peak_above(0.0);
        prop_assert!((peak - expected).abs() < 1e-13);
    }

    #[test]
    fn finds_the_last_exit_from_a_band(at in 0.1..0.9_f64, band in 0.01..0.3_f64) {
        // θ − at leaves the band of ±band at at + band for good.
        let last = parabola(-at, 1.0, 0.0).last_outside(band);
        let expected = if at + band < 1.0 { Some(1.0) } else if at - band > 0.0 { Some(at - band) } else { None };
        match (last, expected) {
            (Some(last), Some(expected)) => prop_assert!((last - expected).abs() < 1e-9),
            (last, expected) => prop_assert_eq!(last.is_some(), expected.is_some()),
        }
    }
}

/// `c + b·θ + a·θ²`.
fn parabola(c: f64, b: f64, a: f64) -> Polynomial<{ TERMS + 1 }> {
    let mut q = [0.0; TERMS + 1];
    (q[0], q[1], q[2]) = (c, b, a);
    Polynomial::of_powers(&q, 1.0)
}

/// The contrast of `bounds_hold`: on an arc that is nearly a parabola half the
/// bound is too small, so the bound is no idle one.
#[test]
fn half_the_bound_is_too_small() {
    let case = driven([0.0; 3], [0.0, 3.0]);
    let bounds = Levels::new(&case.0, 1e-3).bounds(&case.1);
    let (chord, slope) = strays(&case, 1e-3);
    assert!(chord > 0.0 && chord > 0.5 * bounds.over(0, &case.2));
    assert!(slope > 0.5 * bounds.slope_over(0, &case.2));
}

/// The same of the cubic: of a slow swing the bound is no more than a third too large.
#[test]
fn the_cubics_bound_is_no_idle_one() {
    let case = driven([-0.01, 0.0, 0.0], [0.0, 3.0]);
    let grid = Grid::new(&Levels::new(&case.0, 1.0)).unwrap();
    let (off, bound, _) = off_the_cubic(&grid, &case);
    assert!(off > 0.75 * bound, "{off} {bound}");
}

/// Ends above zero show nothing: a swing of a whole step dips below it in between.
#[test]
fn a_dip_between_the_ends_does_not_hold() {
    let w = 1e3;
    let case = driven([-w * w, 0.0, 0.0], [1.0, 0.0]);
    // sin(w·t)/w
    let length_s = core::f64::consts::TAU / w;
    let holds = |offset: f64| all_hold(&case, offset / w, length_s);
    assert!(!holds(0.5) && !holds(0.999));
    // The contrast: far above it does, if by a bound that is not the best.
    assert!(holds(20.0));
}

/// The paper's axis has sketches at its sample times, with the joint open and
/// closed, and beyond 1.4 ms none: where the documentation says so.
#[test]
fn the_papers_axis_has_sketches() {
    let joint = Joint::Elastic(ElasticJoint {
        stiffness_nm_per_rad: 350.0,
        damping_nms_per_rad: 0.2,
        backlash_half_rad: 0.05,
        no_pull: false,
    });
    let axis = Axis::new(&of_the_paper(joint), &Surroundings::default(), 0.0);
    let has_sketch = |joint, length_ns| {
        let mode = Mode {
            joint,
            ..axis.mode_at_rest()
        };
        let mut tables = Tables::default();
        let table = &tables.held(&axis, &mode, length_ns).table;
        table.quantity(Quantity::Delta).sketch.is_some()
    };
    for joint in [JointMode::Open, JointMode::Loaded(Direction::Positive)] {
        assert!(has_sketch(joint, 100_000) && has_sketch(joint, 1_400_000));
    }
    assert!(!has_sketch(
        JointMode::Loaded(Direction::Positive),
        1_500_000
    ));
}

/// The largest product of the distances from the nodes, between neighbouring
/// points of a fine raster raised by what the slope allows.
#[test]
fn node_product_is_a_bound() {
    let (steps, mut largest) = (1_000_000_u32, 0.0_f64);
    for i in 0..=steps {
        let theta = f64::from(i) / f64::from(steps);
        let distances = NODES.map(|node| (theta - node as f64 / CELLS as f64).abs());
        largest = largest.max(distances.iter().product());
    }
    // A polynomial of degree 11 is at most that much steeper than it is large
    // (Markov's inequality: 2·11² on [0, 1]).
    let raised = largest / (1.0 - 242.0 / f64::from(2 * steps));
    assert!(
        raised < NODE_PRODUCT && largest > 0.99 * NODE_PRODUCT,
        "{raised}"
    );
}

/// The contrast of both: without its remainder a sketch of a fast
/// oscillation is off by more than rounding.
#[test]
fn remainder_is_no_idle_one() {
    let w = 1e3;
    let (a, row, rate) = driven([-w * w, 0.0, 0.0], [0.0, w * w]);
    let length_s = 7.9 / growth_down_to(&a, 0.0);
    let levels = Levels::new(&a, length_s);
    let grid = Grid::new(&levels).unwrap();
    for sketch in [
        Sketch::over(&grid, &a, &row),
        Sketch::about_middle(&levels, &row).unwrap(),
    ] {
        let curve = sketch.curve(One, &rate.into(), (1.0, 0.0));
        let mut off = 0.0_f64;
        for i in 0..=400 {
            let theta = f64::from(i) / 400.0;
            let exact = row.dot(&change_after(&a, &rate, theta * length_s));
            off = off.max((value_and_slope(One, &curve.values, theta).0 - exact).abs());
        }
        assert!(off > 1e-9 && off < curve.stray, "{off} {}", curve.stray);
    }
}

/// States that only integrate one another have a growth rate of zero, and a sketch of
/// them is the polynomial that the last of them is.
#[test]
fn a_chain_of_integrators_has_its_sketch() {
    let (a, row, mut rate) = driven([0.0, 0.0, 1.0], [0.25, -1.0]);
    rate[2] = 3.0;
    let length_s = 0.5;
    assert!(growth_down_to(&a, 0.0) < 1e-12);
    let sketch = Sketch::about_middle(&Levels::new(&a, length_s), &row).unwrap();
    let curve = sketch.curve(One, &rate.into(), (1.0, 0.0));
    let (mut off, mut parabola_off) = (0.0_f64, 0.0_f64);
    for i in 0..=40 {
        let theta = f64::from(i) / 40.0;
        let t = theta * length_s;
        let parabola = 0.25 * t - t * t / 2.0;
        let exact = parabola + 3.0 * t * t * t / 6.0;
        let (window, q) = sketch.around(&rate, 0.0, (t, length_s));
        let near = horner(One, &q, window.sigma(t)).0;
        let whole = value_and_slope(One, &curve.values, theta).0;
        off = off.max((near - exact).abs()).max((whole - exact).abs());
        parabola_off = parabola_off.max((parabola - exact).abs());
    }
    assert!(off < 1e-15, "{off:e}");
    // The contrast: a power less.
    assert!(parabola_off > 0.05, "{parabola_off}");
}

/// The series is as good as rounding where it may be used.
#[test]
fn series_reproduces_an_oscillation() {
    let w = 1e3;
    let (a, ..) = driven([-w * w, 0.0, 0.0], [0.0; 2]);
    let h = 1.0 / growth_down_to(&a, 0.0);
    let x = Column::<3>::new(0.0, w, 0.0);
    let end = Taylor::new(&a, &x, &(a * x), h).at(1.0);
    assert!((end[0] - libm::sin(w * h)).abs() < 4e-15);
    assert!((end[1] / w - libm::cos(w * h)).abs() < 4e-15);
}

/// A value that is not a number, or nothing but rounding, ends the search at once
/// instead of being halved for ever. A resistance that drives the carriage
/// once made runs that never ended.
#[test]
fn rounding_ends_the_search() {
    for value in [f64::NAN, f64::INFINITY, 1e308] {
        let mut q = [value; TERMS + 1];
        q.iter_mut().skip(1).step_by(2).for_each(|a| *a = -*a);
        let polynomial = Polynomial::of_powers(&q, 1.0);
        assert_eq!(polynomial.last_outside(1.0).is_some(), value == 1e308);
        let (first, peak) = (polynomial.first_negative(), polynomial.peak_above(0.0));
        assert!(first.is_none_or(|theta| theta <= 1.0));
        assert!(peak.is_nan() || peak >= 0.0);
        assert!(polynomial.peak_above(f64::NAN).is_nan() || !value.is_nan());
    }
}
