//! The rules on signals that are known.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use plant::{One, Width};

use super::ripple::{Line, Residual, Ripple};
use super::*;

const INTERVAL_S: f64 = 1e-3;
const TAU: f64 = core::f64::consts::TAU;

/// A window of `n` positions \[µm\].
fn look(n: u32, position_um: impl FnMut(f64) -> f64) -> Ripple {
    let mut position_um = position_um;
    let positions = (0..n).map(|i| One::array(1e-6 * position_um(f64::from(i))));
    let positions: Vec<_> = positions.collect();
    let line = Line::of(positions.len());
    Residual::of(One, &line, &positions).ripple(0, &line, &positions, INTERVAL_S)
}

fn sine(i: f64, period: f64) -> f64 {
    (TAU * i / period + 0.7).sin()
}

/// The cycle's amplitude and its period in samples.
fn cycle(ripple: Ripple) -> Option<(f64, f64)> {
    let samples = ripple.limit_cycle_period_s? / INTERVAL_S;
    assert_eq!(ripple.limit_cycle_um, ripple.ripple_um);
    Some((ripple.limit_cycle_um, samples))
}

fn is_close(found: Option<(f64, f64)>, (amplitude, period): (f64, f64), share: f64) -> bool {
    found.is_some_and(|(a, p)| {
        (a / amplitude - 1.0).abs() < share && (p / period - 1.0).abs() < share
    })
}

/// Noise between −1 and 1, the same every time.
fn noise() -> impl FnMut() -> f64 {
    let mut random = Pcg64::seed_from_u64(7);
    move || (random.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

#[test]
fn a_sine_is_a_cycle() {
    for (n, period) in [
        (250, 17.3),
        (250, 45.0),
        (4096, 5.5),
        (4096, 500.0),
        (100, 3.7),
    ] {
        // A creep and a distance take nothing from it.
        let found = look(n, |i| 250_000.0 + 0.3 * i + 5.0 * sine(i, period));
        assert!(
            is_close(cycle(found), (5.0, period), 0.05),
            "{period}: {found:?}"
        );
    }
}

/// A cycle that stands in the window a few times does not tilt the line by much,
/// whatever its phase.
#[test]
fn few_periods_tilt_the_line_a_little() {
    for (periods, share) in [(3.2, 0.1), (4.0, 0.05), (5.5, 0.02), (8.0, 0.007)] {
        let mut worst = 0.0_f64;
        for phase in 0..64 {
            let turn = TAU * f64::from(phase) / 64.0;
            let found = look(1000, |i| (TAU * periods * i / 1000.0 + turn).sin());
            worst = worst.max((found.ripple_um - 1.0).abs());
        }
        assert!(worst < share, "{periods}: {worst}");
        // The contrast: it is no idle bound.
        assert!(worst > 0.25 * share, "{periods}: {worst}");
    }
}

/// With fewer than three periods nothing is said.
#[test]
fn two_periods_are_not_enough() {
    let found = look(250, |i| sine(i, 110.0));
    assert_eq!((cycle(found), found.limit_cycle_um), (None, 0.0));
    assert!(found.ripple_um > 0.5);
}

/// A step that rings out is none: the second half is less than half of the first. The
/// contrast: slowly enough it is one.
#[test]
fn a_decaying_sine_is_a_cycle_if_it_takes_long() {
    let decaying = |time: f64| look(500, move |i| (-i / time).exp() * sine(i, 20.0));
    assert_eq!(cycle(decaying(250.0)), None);
    assert!(cycle(decaying(1000.0)).is_some());
}

#[test]
fn drift_alone_is_nothing() {
    let line = look(1000, |i| 3.0 * i - 70.0);
    assert!(line.ripple_um < 1e-8 && cycle(line).is_none(), "{line:?}");
    // A motion that comes to rest late bends, but does not swing.
    let late = look(1000, |i| (-i / 300.0).exp());
    assert!(late.ripple_um > 0.01 && cycle(late).is_none(), "{late:?}");
    let still = look(1000, |_| 123_456.789);
    assert_eq!((still.ripple_um, cycle(still)), (0.0, None));
}

/// A window of noise is taken for a cycle where its few rises happen to come at
/// equal distances; so the shorter, the likelier.
#[test]
fn noise_is_no_cycle() {
    let mut draw = noise();
    for (samples, wrong) in [(64, 3), (250, 0), (1000, 0), (4096, 0)] {
        let found = (0..300).filter(|_| cycle(look(samples, |_| draw())).is_some());
        let found = found.count();
        println!("{samples} samples: {found} of 300");
        assert!(found <= wrong, "{samples}: {found}");
    }
    // The sum of ten is slower.
    for n in [1000, 4096] {
        let mut last = [0.0; 10];
        let found = look(n, |i| {
            last[i as usize % 10] = draw();
            last.iter().sum()
        });
        assert_eq!(cycle(found), None, "{n}: {found:?}");
    }
}

/// Noise on a cycle does not hide it, and makes no crossings of its own.
#[test]
fn a_noisy_cycle_is_one() {
    let mut draw = noise();
    let found = look(2000, |i| 5.0 * sine(i, 40.0) + 0.8 * draw());
    assert!(is_close(cycle(found), (5.8, 40.0), 0.03), "{found:?}");
}

/// One count to and fro, with equal times and with unequal ones.
#[test]
fn a_square_of_one_count_is_a_cycle() {
    for (period, high) in [(20, 10), (20, 2), (50, 47), (2, 1)] {
        let found = look(400, |i| if i as u64 % period < high { 2.5 } else { -2.5 });
        assert!(
            is_close(cycle(found), (2.5, period as f64), 0.02),
            "{period}: {found:?}"
        );
    }
}

/// Hunting with two kinds of swings: every other one is half as large, and not
/// quite as long. The middle between the extremes is passed every other time.
#[test]
fn unequal_swings_are_a_cycle() {
    let swing = |i: f64| {
        let turn = i % 340.0;
        let (turn, period, depth) = match turn {
            t if t < 190.0 => (t, 190.0, 1.0),
            t => (t - 190.0, 150.0, 0.45),
        };
        -12.0 * depth * (0.5 - 0.5 * (TAU * turn / period).cos())
    };
    let found = look(2500, swing);
    assert!(is_close(cycle(found), (6.0, 170.0), 0.05), "{found:?}");
}

/// An odd knock three times as high as the swing does not hide it.
#[test]
fn a_knock_does_not_hide_a_cycle() {
    let found = look(500, |i| if i == 260.0 { 6.0 } else { sine(i, 25.0) });
    let samples = found.limit_cycle_period_s.unwrap() / INTERVAL_S;
    assert!((samples / 25.0 - 1.0).abs() < 0.05, "{found:?}");
}

/// A stick-slip motion: it creeps up and jumps back.
#[test]
fn a_saw_is_a_cycle() {
    let found = look(900, |i| i % 75.0);
    assert!(is_close(cycle(found), (37.0, 75.0), 0.03), "{found:?}");
}

/// A chirp is none: its period goes from long to short.
#[test]
fn a_chirp_is_no_cycle() {
    let chirp = |ratio: f64| {
        look(1000, move |i| {
            let share = i / 1000.0;
            (TAU * 15.0 * share * (1.0 + 0.5 * (ratio - 1.0) * share)).sin()
        })
    };
    assert_eq!(cycle(chirp(3.0)), None);
    assert_eq!(cycle(chirp(1.5)), None);
    // The contrast: a period that changes by a tenth.
    assert!(cycle(chirp(1.1)).is_some());
}

/// The rest that rounding leaves is no cycle, however regular.
#[test]
fn rounding_is_no_cycle() {
    let found = look(100, |i| 1e-7 * sine(i, 10.0));
    assert!(found.ripple_um > 0.0 && cycle(found).is_none());
    assert!(cycle(look(100, |i| 1e-5 * sine(i, 10.0))).is_some());
}

#[test]
fn what_is_no_number_is_no_cycle() {
    let found = cycle(look(100, |i| if i == 50.0 { f64::NAN } else { i }));
    assert_eq!(found, None);
    assert_eq!(cycle(look(100, |_| f64::NAN)), None);
}

#[test]
fn bits_are_those_of_the_range() {
    let range = |values: &[f64]| {
        let one = |&value| Range {
            lowest: value,
            highest: value,
        };
        values.iter().map(one).fold(Range::EMPTY, Range::with)
    };
    for (values, bits) in [
        (&[0.0][..], 1),
        (&[-1.0, 0.0], 1),
        (&[1.0], 2),
        (&[-2.0, 1.0], 2),
        (&[-3.0, 1.0], 3),
        (&[-2.0, 2.0], 3),
        (&[-2048.0, 2047.0], 12),
        (&[-2049.0], 13),
        (&[2048.0], 13),
    ] {
        assert_eq!(range(values).signed_bits(), bits, "{values:?}");
    }
    for (values, bits) in [
        (&[7.0][..], 0),
        (&[7.0, 8.0], 1),
        (&[-1.0, 1.0], 2),
        (&[0.0, 3.0], 2),
        (&[0.0, 4.0], 3),
        (&[-100.0, 155.0], 8),
        (&[-100.0, 156.0], 9),
    ] {
        assert_eq!(range(values).bits_of_width(), bits, "{values:?}");
    }
}

/// Effect of a sine of whole periods on the line and on the amplitude, at
/// worst over its phases: the figures of `ripple.rs` and docs/OUTPUTS.md. The
/// contrast is the line without weights.
#[test]
fn the_weights_keep_the_line_straight() {
    use super::ripple::count;
    const N: usize = 4096;
    let places: Vec<f64> = (0..N)
        .map(|i| (2.0 * count(i) + 1.0) / count(N) - 1.0)
        .collect();
    let amplitude = |values: &[f64]| {
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), x| {
            (low.min(*x), high.max(*x))
        });
        0.5 * (high - low)
    };
    for (periods, line, swing, line_without, swing_without) in
        [(3.0, 10.42, 8.7, 31.83, 16.0), (8.0, 0.65, 0.6, 11.94, 9.7)]
    {
        let mut worst = [0.0_f64; 4];
        for phase in 0..360 {
            let sine = |u: &f64| (0.5 * TAU * (periods * u + f64::from(phase) / 180.0)).sin();
            let positions: Vec<f64> = places.iter().map(sine).collect();
            let rows: Vec<_> = positions.iter().copied().map(One::array).collect();
            let residual = Residual::of(One, &Line::of(N), &rows);
            let slope = residual.slope_m.as_ref()[0];
            let moment: f64 = places.iter().zip(&positions).map(|(u, x)| u * x).sum();
            let slope_without = moment / places.iter().map(|u| u * u).sum::<f64>();
            let without: Vec<f64> = (places.iter().zip(&positions))
                .map(|(u, x)| x - slope_without * u)
                .collect();
            let found = [
                slope.abs(),
                residual.amplitude_m(0) - 1.0,
                slope_without.abs(),
                amplitude(&without) - 1.0,
            ];
            for (worst, found) in worst.iter_mut().zip(found) {
                *worst = worst.max(found);
            }
        }
        println!("{periods} periods: line, amplitude, both without weights {worst:.4?}");
        let k = 0.5 * TAU * periods;
        let formula = 105.0 / k.powi(3) * (1.0 - 15.0 / k.powi(2));
        assert!((worst[0] - formula).abs() < 1e-5 && (worst[2] - 3.0 / k).abs() < 1e-5);
        let percent = [line, swing, line_without, swing_without];
        for ((worst, percent), half_digit) in
            worst.iter().zip(percent).zip([5e-3, 0.05, 5e-3, 0.05])
        {
            let off = (100.0 * worst - percent).abs();
            assert!(off < half_digit, "{worst}, not {percent} %");
        }
    }
}
