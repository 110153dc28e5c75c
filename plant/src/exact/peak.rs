//! Extremes of a quantity along the exact solution, between the samples, and how
//! far it is behind the command: the command as the slopes of a sketch, and where
//! the difference turns.

use super::crossing::{Flow, Leg, Sought, Stretch};
use super::curve::{Curve, SLOPES};
use super::grid::{LocalCoefficients, Window, derivative, horner, scaled, zero_near};
use super::table::Linear;
use crate::model::motion::Motion;
use crate::numerics::width::{One, Width};

/// An extreme counts if it exceeds the ends by more than their rounding.
const ABOVE_THE_ENDS: f64 = 1.0 + 1e-14;

/// Difference of two searches, as a share: another floor leads through
/// other steps.
const BELOW_THE_FLOOR: f64 = 1.0 - 1e-12;

impl<const D: usize> Flow<'_, D> {
    /// The quantity over the whole step as a sketch, without the command.
    pub(super) fn whole_curve(&self, sought: &Sought<'_, D>) -> Option<Curve<One>> {
        let (levels, given) = (&self.table.levels, (sought.scale, sought.offset));
        let from = (&self.start.into(), &self.rate.into());
        sought.linear.curve(One, levels, from, given)
    }

    /// The quantity over `length_s` as a sketch; `None` without a grid, and where
    /// the command is not smooth.
    pub(crate) fn curve(&self, sought: &Sought<'_, D>, length_s: f64) -> Option<Curve<One>> {
        let whole = self.whole_curve(sought)?;
        let own = whole.until(One, length_s / self.table.levels.steps[0].length_s);
        match sought.command {
            None => Some(own),
            Some((motion, start_s)) => {
                let command = command_slopes(motion, start_s, length_s)?;
                Some(own.less_from(One, command))
            }
        }
    }

    /// A quantity around `time_s`; `None` without grid and sketch.
    pub(crate) fn around(
        &self,
        linear: &Linear<D>,
        time_s: f64,
    ) -> Option<(Window<One>, LocalCoefficients<One>)> {
        if let Some(local) = self.near(time_s) {
            return Some((local.window, local.quantity(One, &linear.row)));
        }
        let length_s = self.table.levels.steps[0].length_s;
        let sketch = linear.sketch(&self.table.levels)?;
        Some(sketch.around(&self.rate, linear.value(&self.start), (time_s, length_s)))
    }

    /// Raises `peak` to the supremum of the quantity's magnitude over `length_s`, which at the
    /// ends is known; `level` and `slack` are those of [`super::levels::Levels::over`].
    pub(super) fn raise(
        &self,
        sought: &Sought<'_, D>,
        length_s: f64,
        (level, slack): (usize, f64),
        [from, to]: [f64; 2],
        peak: &mut f64,
        work: &mut u64,
    ) {
        let chord = sought.chord_bound(level, &self.rate, length_s);
        if from.abs().max(to.abs()) + slack * chord <= *peak {
            return;
        }
        if slack == 1.0 && (to - from).abs() >= sought.slope_bound(level, &self.rate, length_s) {
            return;
        }
        match self.sketched_peak(sought, length_s, *peak) {
            Some(raised) => *peak = raised,
            None => self.search(sought, length_s, peak, work),
        }
    }

    /// `floor`, or the magnitude at the one place within `length_s` where the quantity turns
    /// if that is larger; `None` where the sketch does not tell. The magnitude does not depend
    /// on the floor.
    fn sketched_peak(&self, sought: &Sought<'_, D>, length_s: f64, floor: f64) -> Option<f64> {
        let curve = self.curve(sought, length_s)?;
        if curve.upper(One) <= floor || curve.is_monotone(One) != 0 {
            return Some(floor);
        }
        let (theta, known) = curve.turn(One, 1);
        if known == 0 {
            return None;
        }
        let time_s = theta * length_s;
        let (window, q) = self.around(sought.linear, time_s)?;
        let q = scaled::<One>(q, (sought.scale, sought.offset));
        let sigma = window.sigma(time_s);
        let magnitude = match sought.command {
            Some(command) => magnitude_behind(&window, &q, command, sigma),
            None => {
                let (magnitude, known) = magnitude_at_turn(One, &q, sigma, 1);
                (known != 0).then_some(magnitude)
            }
        };
        magnitude.map(|magnitude| floor.max(magnitude))
    }

    /// Raises `peak` by searching the piece; where the command is not smooth, its parts.
    fn search(&self, sought: &Sought<'_, D>, length_s: f64, peak: &mut f64, work: &mut u64) {
        let Some((motion, start_s)) = sought.command else {
            return self.raise_within(sought, length_s, peak, work);
        };
        let mut from_s = 0.0;
        let inner = motion.breaks_from(start_s).iter().map(|t| t - start_s);
        for to_s in inner.take_while(|&t| t <= length_s).chain([length_s]) {
            if to_s <= from_s {
                continue;
            }
            let part = Sought {
                command: Some((motion, start_s + from_s)),
                ..*sought
            };
            if to_s < length_s {
                *peak = peak.max(part.value(&self.at(to_s), to_s - from_s).abs());
            }
            let flow = Flow::new(self.table, self.input, self.at(from_s));
            flow.raise_within(&part, to_s - from_s, peak, work);
            from_s = to_s;
        }
    }

    /// Raises `peak` to the supremum of the quantity's magnitude within `length_s`, if it is
    /// larger than at both ends. Where there is one, it depends on nothing but the solution:
    /// the largest of several is the same whichever of them a bound has spared.
    fn raise_within(&self, sought: &Sought<'_, D>, length_s: f64, peak: &mut f64, work: &mut u64) {
        let ends = sought.value(&self.start, 0.0).abs();
        let ends = ends.max(sought.value(&self.at(length_s), length_s).abs()) * ABOVE_THE_ENDS;
        let low = *peak * BELOW_THE_FLOOR;
        if low > ends && self.peak_above(sought, length_s, low, work) <= low {
            return;
        }
        let within = self.peak_above(sought, length_s, ends, work);
        if within > ends {
            *peak = peak.max(within);
        }
    }

    /// The supremum between the ends, or `floor` if that is larger.
    fn peak_above(&self, sought: &Sought<'_, D>, length_s: f64, floor: f64, work: &mut u64) -> f64 {
        let mut peak = floor;
        let mut walk = self.walk(length_s, 0);
        // A walk as long as this one has been taken before, so it ends.
        while let Some(stretch) = walk.next(|leg| sought.stays_below(leg, peak)) {
            match stretch {
                Stretch::Settled(leg) => {
                    let end_s = leg.start_s + leg.length_s;
                    if end_s < length_s {
                        peak = peak.max(sought.value(&leg.to, end_s).abs());
                    }
                }
                Stretch::Leaf { leg, series, end } => {
                    peak = sought.polynomial(&leg, &series, end).peak_above(peak);
                }
            }
        }
        *work += walk.work();
        peak
    }

    /// Last time within `length_s` at which the quantity's magnitude is above `band`.
    pub(crate) fn last_outside(
        &self,
        sought: &Sought<'_, D>,
        band: f64,
        length_s: f64,
        work: &mut u64,
    ) -> Option<f64> {
        let mut last = None;
        let mut walk = self.walk(length_s, 0);
        let inside = |leg: &Leg<D>| {
            let end_s = leg.start_s + leg.length_s;
            let ends = sought.value(&leg.from, leg.start_s).abs();
            let ends = ends.max(sought.value(&leg.to, end_s).abs());
            ends + sought.chord_bound(leg.level, &leg.rate, leg.length_s) <= band
        };
        // Outside at its end, so that the next one has a later instant. The last
        // leg ends inside.
        let leaves_outside = |leg: &Leg<D>| {
            let end_s = leg.start_s + leg.length_s;
            end_s < length_s * BELOW_THE_FLOOR
                && sought.value(&leg.to, end_s).abs() * BELOW_THE_FLOOR > band
        };
        while let Some(stretch) = walk.next(inside) {
            if let Stretch::Leaf { leg, series, end } = stretch
                && !leaves_outside(&leg)
                && let Some(theta) = sought.polynomial(&leg, &series, end).last_outside(band)
            {
                last = Some(leg.start_s + theta * leg.length_s);
            }
        }
        *work += walk.work();
        last
    }
}

/// `ELEVATE·b` writes a polynomial of degree 2 with degree 10: row i has
/// `C(2,j)·C(8,i−j)/C(10,i)`.
const ELEVATE: [[f64; 3]; SLOPES] = elevate();

const fn elevate() -> [[f64; 3]; SLOPES] {
    let mut rows = [[0.0; 3]; SLOPES];
    let mut i = 0;
    while i < SLOPES {
        // Of ten, i are chosen; two of the ten are marked.
        let (n, k) = (i as f64, (SLOPES - 1 - i) as f64);
        rows[i] = [
            k * (k - 1.0) / 90.0,
            2.0 * k * n / 90.0,
            n * (n - 1.0) / 90.0,
        ];
        i += 1;
    }
    rows
}

/// `h⁴·sup|x⁗|` times this bounds how far `h·ẋ` is from that of the cubic with
/// the same values and slopes at both ends: √3/216 (Hermite's remainder).
const HERMITE_SLOPE: f64 = 0.008_02;

/// The command over a stretch as its start and the slopes of a sketch, with the bound of their
/// error; none over a break.
pub(crate) fn command_slopes(
    motion: &Motion,
    start_s: f64,
    length_s: f64,
) -> Option<(f64, [f64; SLOPES], f64)> {
    let end_s = start_s + length_s;
    if !motion.breaks_between(start_s, end_s).is_empty() {
        return None;
    }
    let (from, to) = (motion.at(start_s), motion.at(end_s));
    let (v0, v1) = (from.velocity_mps * length_s, to.velocity_mps * length_s);
    let change = to.displacement_m - from.displacement_m;
    let middle = 3.0 * change - (v0 + v1);
    let slopes = ELEVATE.map(|[a, b, c]| (a * v0 + b * middle) + c * v1);
    let size = from.displacement_m.abs() + to.displacement_m.abs() + v0.abs() + v1.abs();
    let rough = motion.fourth_derivatives.displacement_m * length_s * length_s;
    let stray = HERMITE_SLOPE * rough * length_s * length_s + 16.0 * f64::EPSILON * size;
    Some((from.displacement_m, slopes, stray))
}

/// The magnitude of a quantity at its turn near σ, and the lanes of `asked` in which that is
/// there.
#[inline(always)]
pub(crate) fn magnitude_at_turn<W: Width>(
    w: W,
    q: &LocalCoefficients<W>,
    sigma: W::Vector,
    asked: u64,
) -> (W::Vector, u64) {
    let (sigma, known) = zero_near(w, &derivative(w, q), sigma, asked);
    (w.abs(horner(w, q, sigma).0), known)
}

/// Newton steps at most towards a turn of |command − quantity|, and the step,
/// in half cells, that ends them: the value there is known to its square.
const MOST_NEWTON: usize = 8;
const CLOSE: f64 = 1e-9;

/// The magnitude of |command − quantity| at its turn near σ.
pub(crate) fn magnitude_behind(
    window: &Window<One>,
    q: &LocalCoefficients<One>,
    (motion, start_s): (&Motion, f64),
    mut sigma: f64,
) -> Option<f64> {
    let h = window.half_s;
    let slopes = derivative(One, q);
    for _ in 0..MOST_NEWTON {
        let command = motion.at(start_s + window.time_s(sigma));
        let (speed, bend) = horner(One, &slopes, sigma);
        let step =
            (command.velocity_mps * h - speed) / (command.acceleration_mps2 * (h * h) - bend);
        sigma -= step;
        let inside = sigma.abs() <= 1.25;
        if !inside {
            return None;
        }
        if step.abs() <= CLOSE {
            let x_m = motion.at(start_s + window.time_s(sigma)).displacement_m;
            return Some((x_m - horner(One, q, sigma).0).abs());
        }
    }
    None
}
