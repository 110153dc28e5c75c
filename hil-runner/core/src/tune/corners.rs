//! The axes that a setting has to serve: the file's own, its corners, and axes drawn from
//! distributions; and those on which its yield is told.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::problem::Corner;
use crate::distribution::{Distribution, Normal};
use crate::number;
use crate::runfile::tune_settings::{Drawn, Over, OverSpread};
use crate::runfile::{KeyPath, KeyValue, Template};

/// Keys with the values that they take together.
type Point = Vec<(KeyPath, KeyValue)>;

/// Corners at most: four keys of three values.
pub const MOST_CORNERS: usize = 81;

/// The corners of a template, its own axis first: every value of every key with every value
/// of the others, then axes drawn from the distributions with the other keys as they are.
///
/// # Errors
/// The sentence that says which corner makes no run, or that there are too many.
pub fn corners(
    template: &Template,
    over: &[Over],
    draws: u64,
    seed: u64,
) -> Result<Vec<Corner>, String> {
    let (mut points, mut drawn) = (vec![Point::new()], Vec::new());
    for over in over {
        if let OverSpread::Drawn(own) = &over.spread {
            drawn.push((over.key, own.clone()));
        }
        let values = values(template, over)?;
        if values.is_empty() {
            continue;
        }
        let with = |value: KeyValue| {
            let points = points.iter().cloned();
            let more = points.map(move |mut point| {
                point.push((over.key, value.clone()));
                point
            });
            more.collect::<Vec<_>>()
        };
        points = values.into_iter().flat_map(with).collect();
        if points.len() > MOST_CORNERS {
            return Err(format!("tune.over makes more than {MOST_CORNERS} corners"));
        }
    }
    points.extend(drawn_points(template, &drawn, draws, seed)?);
    // The file's own comes first, whether or not the corners have it.
    let own = template.base().clone();
    let mut corners = vec![Corner::new(label(&[]), own)];
    for point in points {
        let label = label(&point);
        let corner = match template.case(point.iter().map(|(key, value)| (key, value))) {
            Ok(case) => Corner::new(label, case),
            Err(errors) => {
                let corner = format!("the corner {label} of tune.over");
                return Err(format!("{corner} makes no run: {errors}"));
            }
        };
        if corners.iter().all(|known| known.case != corner.case) {
            corners.push(corner);
        }
    }
    Ok(corners)
}

/// The values of a key; none of one that is drawn.
fn values(template: &Template, over: &Over) -> Result<Vec<KeyValue>, String> {
    let key = over.key;
    Ok(match &over.spread {
        OverSpread::Values(values) => values.iter().map(|value| key.value(*value)).collect(),
        OverSpread::Factors(factors) => {
            let own = own(template, &key)?;
            if own == 0.0 {
                let path = key.path();
                return Err(format!(
                    "tune.over has factors of {path}, which is 0; give values"
                ));
            }
            factors
                .iter()
                .map(|factor| key.value(factor * own))
                .collect()
        }
        OverSpread::Words(words) => {
            let words = words.iter().map(|word| format!("\"{word}\""));
            words.map(KeyValue::Toml).collect()
        }
        OverSpread::Drawn(_) => Vec::new(),
    })
}

/// The file's own value of a key.
fn own(template: &Template, key: &KeyPath) -> Result<f64, String> {
    let path = key.path();
    template.own_number(key).ok_or_else(|| {
        format!("tune.over has factors of {path}, which the file does not give; give values")
    })
}

/// So many times a value of every key.
fn drawn_points(
    template: &Template,
    drawn: &[(KeyPath, Drawn)],
    count: u64,
    seed: u64,
) -> Result<Vec<Point>, String> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut value = |(key, drawn): &(KeyPath, Drawn)| {
        let part = number::of_bits(random.next_u64());
        let value = drawn.distribution.quantile(part);
        let factor = match drawn.is_factor {
            true => own(template, key)?,
            false => 1.0,
        };
        Ok((*key, key.value(factor * value)))
    };
    let point = |_| drawn.iter().map(&mut value).collect();
    (0..count).map(point).collect()
}

/// Axes on which a yield is told, drawn from what `[tune]` is over, corners as uniform
/// distributions between their ends; without any from the tolerances of the ready study
/// `tolerance`; and what they are drawn from, in words. Axes that make no run are left out.
///
/// # Errors
/// As [`corners`].
pub fn tolerance(
    template: &Template,
    over: &[Over],
    axes: u64,
    seed: u64,
) -> Result<(Vec<Corner>, Vec<String>), String> {
    let mut drawn = Vec::new();
    for over in over {
        let uniform = |values: &[f64], is_factor| {
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let distribution = Distribution::Uniform { low, high };
            (low < high).then_some(Drawn {
                distribution,
                is_factor,
            })
        };
        let spread = match &over.spread {
            OverSpread::Factors(factors) => uniform(factors, true),
            OverSpread::Values(values) => uniform(values, false),
            OverSpread::Words(_) => None,
            OverSpread::Drawn(drawn) => Some(drawn.clone()),
        };
        drawn.extend(spread.map(|spread| (over.key, spread)));
    }
    if drawn.is_empty() {
        drawn = usual(template);
    }
    let points = drawn_points(template, &drawn, axes, seed)?;
    let all = points.iter().filter_map(|point| {
        let case = template.case(point.iter().map(|(key, value)| (key, value)));
        Some(Corner::new(String::new(), case.ok()?))
    });
    let words = drawn.iter().map(|(key, drawn)| {
        let factor = if drawn.is_factor { "× " } else { "" };
        format!("{} {factor}{}", key.path(), drawn.distribution)
    });
    Ok((all.collect(), words.collect()))
}

/// The tolerances of the ready study of that name, of the keys that the file gives.
fn usual(template: &Template) -> Vec<(KeyPath, Drawn)> {
    let triangular = |low, mode, high| Distribution::Triangular { low, mode, high };
    let uniform = |low, high| Distribution::Uniform { low, high };
    let log_uniform = |low, high| Distribution::LogUniform { low, high };
    let normal = |deviation, low, high| {
        Distribution::Normal(Normal {
            mean: 1.0,
            deviation,
            low: Some(low),
            high,
        })
    };
    let spreads = [
        ("transmission.backlash_half_deg", triangular(0.4, 1.0, 1.3)),
        ("transmission.stiffness_nm_per_rad", normal(0.1, 0.6, None)),
        ("transmission.damping_nms_per_rad", log_uniform(0.5, 2.0)),
        ("carriage.mass_kg", uniform(0.8, 1.2)),
        (
            "motor.torque_constant_nm_per_a",
            normal(0.03, 0.8, Some(1.2)),
        ),
        ("motor.resistance_ohm", normal(0.05, 0.8, Some(1.2))),
        ("drive.amplifier_gain", normal(0.01, 0.9, Some(1.1))),
        ("drive.amplifier_gain_a_per_v", normal(0.01, 0.9, Some(1.1))),
    ];
    let known = spreads.into_iter().filter_map(|(path, distribution)| {
        let key = KeyPath::find(path).ok()?;
        let has = template.own_number(&key).is_some_and(|own| own > 0.0);
        let drawn = Drawn {
            distribution,
            is_factor: true,
        };
        has.then_some((key, drawn))
    });
    known.collect()
}

/// The keys and values of a corner in words.
fn label(point: &[(KeyPath, KeyValue)]) -> String {
    let part = |(key, value): &(KeyPath, KeyValue)| {
        let value = value
            .number()
            .map_or_else(|| value.to_toml(), number::table);
        format!("{} = {value}", key.key.name)
    };
    match point {
        [] => "as in the file".to_owned(),
        point => point.iter().map(part).collect::<Vec<_>>().join(", "),
    }
}
