//! Ripple of the carriage: its distance from a straight line, so that a creep at
//! constant speed is taken out, and whether it oscillates regularly.
//!
//! The line is that of least squares with the weights `(1 − u²)²`, u going from −1
//! to 1 over the window. A cycle that stands in the window a few times tilts it: a
//! sine of amplitude 1 and n whole periods moves its two ends by up to
//! `105/(πn)³·|1 − 15/(πn)²|`, one down and one up, without weights by `3/(πn)`.
//!
//! ```text
//!                     ends of the line        amplitude too large by
//! n             weights        without        weights         without
//! 3              0.1042         0.3183         0.087            0.160
//! 8              0.0065         0.1194         0.006            0.097
//! ```
//!
//! A ripple is a limit cycle if all of this holds:
//!
//! 1. It is an oscillation: it rises at least four times, which is three
//!    periods. A rise goes from a lowest to a highest point by more than a quarter
//!    of peak to peak, and back by as much; neither noise on it nor the steps of
//!    an encoder make another one. Its time is that at half its height.
//! 2. It is sustained: the second half of the window has at least half
//!    the amplitude of the first. A step that rings out does not.
//! 3. It is regular: the periods scatter by at most a fifth of their mean (one
//!    standard deviation), which noise does not keep, and the mean of their later
//!    half is within 15 % of the earlier's, which a chirp does not.
//! 4. It is larger than rounding: 1e-6 µm.
//!
//! Rises and not crossings of one level: a hunting axis need not go equally
//! far every time, and one that sticks and slips keeps close to one side for
//! most of the period. `tests/cases/limit-cycle.toml` has every other
//! period half as large; its periods scatter by 0.13 to 0.17.

use plant::Width;

/// Ripple of the carriage in the window of rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ripple {
    /// Amplitude of the carriage about its straight line \[µm\].
    pub(crate) ripple_um: f64,
    /// The same where it is a sustained oscillation, else 0 \[µm\].
    pub(crate) limit_cycle_um: f64,
    /// Period of the oscillation \[s\].
    pub(crate) limit_cycle_period_s: Option<f64>,
}

/// The straight line of a window, but for how steep it is: what depends on the number
/// of positions alone.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Line {
    /// u of one position after the other, and `(1 − u²)²·u`.
    places: Vec<(f64, f64)>,
    /// `Σ (1 − u²)²·u²`.
    inertia: f64,
}

impl Line {
    /// Of as many positions at equal distances.
    pub(super) fn of(positions: usize) -> Self {
        let n = count(positions);
        // From whole numbers.
        let mut next = -1.0 - n;
        let mut inertia = 0.0;
        let place = |_| {
            next += 2.0;
            let u = next / n;
            let root = 1.0 - u * u;
            let arm = root * root * u;
            inertia += arm * u;
            (u, arm)
        };
        Self {
            places: (0..positions).map(place).collect(),
            inertia,
        }
    }
}

/// Positions less a straight line, side by side; where the line lies does not
/// matter, only how steep it is.
#[derive(Debug, Clone)]
pub(super) struct Residual<W: Width> {
    /// The line from the window's middle to its end \[m\].
    pub(super) slope_m: W::Array,
    /// Lowest and highest in either half of the window \[m\].
    halves_m: [[W::Array; 2]; 2],
}

impl<W: Width> Residual<W> {
    /// Of positions at equal distances, as many as those of the line.
    #[inline(always)]
    pub(super) fn of(w: W, line: &Line, positions_m: &[W::Array]) -> Self {
        // From the first on: what they share would cost the small ones digits.
        let first_m = w.load(positions_m.first().unwrap_or(&W::array(0.0)));
        let mut moment = w.splat(0.0);
        for (position_m, (_, arm)) in positions_m.iter().zip(&line.places) {
            moment = moment + w.splat(*arm) * (w.load(position_m) - first_m);
        }
        let slope_m = match line.inertia > 0.0 {
            true => moment / w.splat(line.inertia),
            false => w.splat(0.0),
        };
        let half = positions_m.len() / 2;
        let halves_m = [0..half, half..positions_m.len()].map(|rows| {
            let (mut lowest, mut highest) = (w.splat(f64::INFINITY), w.splat(f64::NEG_INFINITY));
            let places = line.places[rows.clone()].iter();
            for (position_m, (u, _)) in positions_m[rows].iter().zip(places) {
                let value = (w.load(position_m) - first_m) - slope_m * w.splat(*u);
                lowest = w.smaller(value, lowest);
                highest = w.larger(value, highest);
            }
            [w.stored(lowest), w.stored(highest)]
        });
        Self {
            slope_m: w.stored(slope_m),
            halves_m,
        }
    }

    /// Lowest and highest in both halves of a lane \[m\].
    fn halves_m(&self, lane: usize) -> [[f64; 2]; 2] {
        let of_lane = |array: &W::Array| array.as_ref()[lane];
        self.halves_m
            .each_ref()
            .map(|half| half.each_ref().map(of_lane))
    }

    /// Half of the way from the lowest to the highest of a lane \[m\].
    pub(super) fn amplitude_m(&self, lane: usize) -> f64 {
        let [[low_1, high_1], [low_2, high_2]] = self.halves_m(lane);
        0.5 * (high_1.max(high_2) - low_1.min(low_2))
    }

    /// Ripple of a lane's positions, `interval_s` apart.
    pub(super) fn ripple(
        &self,
        lane: usize,
        line: &Line,
        positions_m: &[W::Array],
        interval_s: f64,
    ) -> Ripple {
        let amplitude_m = self.amplitude_m(lane);
        let ripple_um = 1e6 * amplitude_m;
        let [first, second] = self.halves_m(lane).map(|[low, high]| high - low);
        // Neither is a residual that is not a number.
        let may_be = amplitude_m > ROUNDING_M && second >= SUSTAINED * first;
        let period = may_be.then(|| {
            let position_m = |array: &W::Array| array.as_ref()[lane];
            let first_m = positions_m.first().map_or(0.0, position_m);
            let slope_m = position_m(&self.slope_m);
            let rows = positions_m.iter().zip(&line.places);
            let values_m: Vec<f64> = rows
                .map(|(row, (u, _))| (position_m(row) - first_m) - slope_m * u)
                .collect();
            period_samples(&values_m, amplitude_m)
        });
        let period = period.flatten();
        Ripple {
            ripple_um,
            limit_cycle_um: period.map_or(0.0, |_| ripple_um),
            limit_cycle_period_s: period.map(|samples| samples * interval_s),
        }
    }
}

/// A number of samples; far below 2^53.
pub(super) fn count(n: usize) -> f64 {
    n as f64
}

/// Share of peak to peak by which a rise, and the fall after it, must go.
const RISE: f64 = 0.25;

/// Rises that make three periods.
const FEWEST_RISES: usize = 4;

/// Amplitude of the second half in units of the first's, at least.
const SUSTAINED: f64 = 0.5;

/// Standard deviation of the periods in units of their mean, at most: of 300
/// windows of 64 samples of noise one or two stay below, of 250 samples none.
const SCATTER: f64 = 0.2;

/// Change of the mean period from the earlier half of the periods to the later.
const DRIFT: f64 = 0.15;

/// Amplitude of rounding \[m\]: 10⁴ times that of a position of a metre.
const ROUNDING_M: f64 = 1e-12;

/// The period of a sustained oscillation \[samples\]; `None` if it is no limit cycle.
fn period_samples(values_m: &[f64], amplitude_m: f64) -> Option<f64> {
    let rises = rises(values_m, RISE * 2.0 * amplitude_m);
    if rises.len() < FEWEST_RISES {
        return None;
    }
    let periods: Vec<f64> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
    is_regular(&periods).then(|| mean(&periods))
}

/// Direction that the residual went last, and the place where it began to.
enum Way {
    /// It has not gone far enough to tell.
    Unknown,
    /// Up, from this place.
    Up(usize),
    Down,
}

/// The times of the rises that are complete \[samples\].
fn rises(values: &[f64], reversal: f64) -> Vec<f64> {
    let mut rises = Vec::new();
    let mut way = Way::Unknown;
    // Places of the extremes since the last reversal.
    let (mut lowest, mut highest) = (0, 0);
    for (place, &value) in values.iter().enumerate() {
        if value > values[highest] {
            highest = place;
        }
        if value < values[lowest] {
            lowest = place;
        }
        let (risen, fallen) = (value - values[lowest], values[highest] - value);
        match way {
            Way::Unknown | Way::Down if risen > reversal => {
                // From the window's first place it may have come from further down.
                way = Way::Up(lowest);
                highest = place;
            }
            Way::Unknown if fallen > reversal => {
                way = Way::Down;
                lowest = place;
            }
            Way::Up(from) if fallen > reversal => {
                if from > 0 {
                    rises.push(half_way(values, from, highest));
                }
                way = Way::Down;
                lowest = place;
            }
            _ => {}
        }
    }
    rises
}

/// The time at which the residual is first half way up from one place to a later one, by
/// straight lines between the samples.
fn half_way(values: &[f64], from: usize, to: usize) -> f64 {
    let half = 0.5 * (values[from] + values[to]);
    let above = (from + 1..to).find(|&place| values[place] > half);
    let place = above.unwrap_or(to);
    let (before, value) = (values[place - 1], values[place]);
    count(place) - (value - half) / (value - before)
}

fn is_regular(periods: &[f64]) -> bool {
    let all = mean(periods);
    let squares: f64 = periods.iter().map(|p| (p - all) * (p - all)).sum();
    let scatter = (squares / count(periods.len())).sqrt();
    // Of an odd number the middle one belongs to neither half.
    let half = periods.len() / 2;
    let earlier = mean(&periods[..half]);
    let later = mean(&periods[periods.len() - half..]);
    scatter <= SCATTER * all && (later - earlier).abs() <= DRIFT * earlier.min(later)
}

fn mean(periods: &[f64]) -> f64 {
    periods.iter().sum::<f64>() / count(periods.len())
}
