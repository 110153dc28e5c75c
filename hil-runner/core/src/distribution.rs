//! Scatter of a parameter, by its quantiles: one number in (0, 1) gives one value, so that
//! Latin hypercubes and Sobol points keep their order.

use core::f64::consts::SQRT_2;
use core::fmt;

use schemars::JsonSchema;
use serde::Deserialize;

/// Scatter of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Distribution {
    /// Every value from `low` to `high` is as likely as another.
    Uniform {
        /// Lowest value.
        low: f64,
        /// Highest value.
        high: f64,
    },
    /// The logarithm is uniform; both limits are greater than 0.
    LogUniform {
        /// Lowest value.
        low: f64,
        /// Highest value.
        high: f64,
    },
    /// The normal distribution.
    Normal(Normal),
    /// Most likely at `mode`, falling in straight lines to `low` and `high`.
    Triangular {
        /// Lowest value.
        low: f64,
        /// Most likely value.
        mode: f64,
        /// Highest value.
        high: f64,
    },
}

/// The normal distribution; what lies outside `low` and `high` is never drawn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    /// Mean μ.
    pub mean: f64,
    /// Standard deviation σ, greater than 0.
    pub deviation: f64,
    /// Lowest value; none if left out.
    pub low: Option<f64>,
    /// Highest value; none if left out.
    pub high: Option<f64>,
}

impl Normal {
    /// The lowest and the highest value.
    fn limits(&self) -> [f64; 2] {
        let low = self.low.unwrap_or(f64::NEG_INFINITY);
        [low, self.high.unwrap_or(f64::INFINITY)]
    }

    /// The parts of the whole distribution below them.
    fn parts(&self) -> [f64; 2] {
        let below = |limit| 0.5 * libm::erfc((self.mean - limit) / (self.deviation * SQRT_2));
        [self.low.map_or(0.0, below), self.high.map_or(1.0, below)]
    }
}

impl Distribution {
    /// Checks that the parameters make a distribution.
    ///
    /// # Errors
    /// The sentence that says what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let (is_right, needs) = match *self {
            Self::Uniform { low, high } => (
                finite(&[low, high]) && low < high,
                format!("uniform distribution needs low < high, both finite, not {low} and {high}"),
            ),
            Self::LogUniform { low, high } => (
                finite(&[low, high]) && 0.0 < low && low < high,
                format!(
                    "log-uniform distribution needs 0 < low < high, both finite, not {low} and {high}"
                ),
            ),
            Self::Normal(Normal {
                mean, deviation, ..
            }) if !finite(&[mean, deviation]) || deviation <= 0.0 => {
                let needs = format!(
                    "normal distribution needs a finite mean and a deviation greater than 0, not {mean} and {deviation}"
                );
                (false, needs)
            }
            Self::Normal(normal) => {
                let ([low, high], [from, to]) = (normal.limits(), normal.parts());
                let needs = format!(
                    "normal distribution needs low < high with at least a millionth of it between them, not {low} and {high}"
                );
                (low < high && to - from > 1e-6, needs)
            }
            Self::Triangular { low, mode, high } => (
                finite(&[low, mode, high]) && low <= mode && mode <= high && low < high,
                format!(
                    "triangular distribution needs low ≤ mode ≤ high and low < high, not {low}, {mode} and {high}"
                ),
            ),
        };
        is_right.then_some(()).ok_or(format!("a {needs}"))
    }

    /// The value below which a part `u` of all values lies, 0 ≤ `u` < 1.
    pub fn quantile(&self, u: f64) -> f64 {
        match *self {
            Self::Uniform { low, high } => low + u * (high - low),
            Self::LogUniform { low, high } => log_between(low, high, u),
            Self::Normal(normal) => {
                let ([low, high], [from, to]) = (normal.limits(), normal.parts());
                let quantile = normal_quantile(from + u * (to - from));
                let value = normal.mean + normal.deviation * quantile;
                value.max(low).min(high)
            }
            Self::Triangular { low, mode, high } => {
                let (rise, fall, width) = (mode - low, high - mode, high - low);
                if u * width < rise {
                    low + (u * width * rise).sqrt()
                } else {
                    high - ((1.0 - u) * width * fall).sqrt()
                }
            }
        }
    }
}

impl fmt::Display for Distribution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uniform { low, high } => write!(f, "uniform from {low} to {high}"),
            Self::LogUniform { low, high } => write!(f, "log-uniform from {low} to {high}"),
            Self::Normal(normal) => {
                let (mean, deviation) = (normal.mean, normal.deviation);
                write!(f, "normal, mean {mean}, standard deviation {deviation}")?;
                for (words, limit) in [("not below", normal.low), ("not above", normal.high)] {
                    limit.map_or(Ok(()), |limit| write!(f, ", {words} {limit}"))?;
                }
                Ok(())
            }
            Self::Triangular { low, mode, high } => {
                write!(f, "triangular from {low} over {mode} to {high}")
            }
        }
    }
}

/// `low·(high/low)^u`, both ends exact.
pub fn log_between(low: f64, high: f64, u: f64) -> f64 {
    if u <= 0.0 {
        low
    } else if u >= 1.0 {
        high
    } else {
        libm::exp(libm::log(low) + u * (libm::log(high) - libm::log(low)))
    }
}

/// Largest magnitude that is drawn of a standard normal distribution: what
/// 53 bits can tell from 0.
const FARTHEST: f64 = 8.2;

/// The inverse of the standard normal distribution: a start by the logistic
/// approximation, then Newton's method on `erfc`, which converges from there
/// in both tails (error below 1e-14 of the value).
fn normal_quantile(part: f64) -> f64 {
    // By symmetry only the lower half, where `erfc` keeps its digits.
    if part > 0.5 {
        return -normal_quantile(1.0 - part);
    }
    if part <= 1e-16 {
        return -FARTHEST;
    }
    // In the tail log(part) ≈ −x²/2 − log(−x·√2π); near 0 the logistic curve.
    let mut x = if part < 0.02 {
        -(-2.0 * libm::log(part)).sqrt()
    } else {
        libm::log(part / (1.0 - part)) / 1.702
    };
    for _ in 0..60 {
        // Newton on log Φ, which is concave: Φ(x) = ½·erfc(−x/√2).
        let below = 0.5 * libm::erfc(-x / SQRT_2);
        let density = libm::exp(-0.5 * x * x) / 2.506_628_274_631_000_7; // √2π
        let step = libm::log(below / part) * below / density;
        x -= step;
        if step.abs() <= 1e-15 * x.abs() {
            break;
        }
    }
    x.max(-FARTHEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the standard normal distribution as tables have them
    /// (Abramowitz & Stegun, table 26.5, and NIST's handbook).
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (part, quantile) in [
            (0.5, 0.0),
            (0.975, 1.959_963_984_540_054),
            (0.995, 2.575_829_303_548_901),
            (0.841_344_746_068_542_9, 1.0),
            (0.001, -3.090_232_306_167_813_5),
            (1e-10, -6.361_340_902_404_056),
        ] {
            let found = normal_quantile(part);
            let off = (found - quantile).abs();
            assert!(off < 2e-14 * quantile.abs().max(1.0), "{part}: {found}");
        }
    }

    /// The distribution of the quantile is the part again, everywhere.
    #[test]
    fn the_quantile_inverts_the_distribution() {
        for i in 1..2000 {
            let part = f64::from(i) / 2000.0;
            let below = 0.5 * libm::erfc(-normal_quantile(part) / SQRT_2);
            assert!((below - part).abs() < 1e-15 + 1e-14 * part, "{part}");
        }
    }

    fn uniform(low: f64, high: f64) -> Distribution {
        Distribution::Uniform { low, high }
    }

    fn triangular(low: f64, mode: f64, high: f64) -> Distribution {
        Distribution::Triangular { low, mode, high }
    }

    fn normal(mean: f64, deviation: f64, low: Option<f64>, high: Option<f64>) -> Distribution {
        Distribution::Normal(Normal {
            mean,
            deviation,
            low,
            high,
        })
    }

    #[test]
    fn limits_are_never_passed_and_moments_are_right() {
        let n = 20_000;
        let moments = |distribution: Distribution| {
            distribution.check().unwrap();
            let values: Vec<f64> = (0..n)
                .map(|i| distribution.quantile((f64::from(i) + 0.5) / f64::from(n)))
                .collect();
            let mean = values.iter().sum::<f64>() / f64::from(n);
            let variance =
                values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / f64::from(n);
            assert!(values.is_sorted());
            (values[0], mean, variance, values[values.len() - 1])
        };
        let near = |found: f64, wanted: f64| {
            assert!(
                (found - wanted).abs() < 1e-3 * wanted.abs().max(1.0),
                "{found} {wanted}"
            )
        };
        let (_, mean, variance, _) = moments(normal(5.0, 2.0, None, None));
        near(mean, 5.0);
        near(variance, 4.0);
        // Cut at ±1σ: variance 1 − 2φ(1)/(2Φ(1) − 1).
        let (low, mean, variance, high) = moments(normal(0.0, 1.0, Some(-1.0), Some(1.0)));
        assert!(low >= -1.0 && high <= 1.0);
        near(mean, 0.0);
        near(variance, 0.291_125);
        let (low, mean, variance, high) = moments(triangular(1.0, 2.0, 4.0));
        assert!(low >= 1.0 && high <= 4.0);
        near(mean, 7.0 / 3.0);
        near(variance, (1.0 + 4.0 + 16.0 - 2.0 - 4.0 - 8.0) / 18.0);
        let (low, high) = (0.1, 10.0);
        let (low, mean, _, high) = moments(Distribution::LogUniform { low, high });
        assert!(low >= 0.1 && high <= 10.0);
        near(mean, 9.9 / 100.0_f64.ln());
        let (_, mean, variance, _) = moments(uniform(-1.0, 3.0));
        near(mean, 1.0);
        near(variance, 16.0 / 12.0);
    }

    #[test]
    fn what_is_no_distribution_is_refused() {
        let (low, high) = (0.0, 1.0);
        for wrong in [
            uniform(1.0, 1.0),
            Distribution::LogUniform { low, high },
            normal(0.0, 0.0, None, None),
            normal(0.0, 1.0, Some(9.0), None),
            triangular(0.0, 2.0, 1.0),
            uniform(f64::NAN, 1.0),
        ] {
            assert!(wrong.check().is_err(), "{wrong:?}");
        }
    }
}
