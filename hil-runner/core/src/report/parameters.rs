//! The settings of a case as a report shows them beside the results: everything
//! that a run file can say, less what the rung does not use and what is off. The
//! words are those of the table of keys.

use plant::Load;
use serde::Serialize;

use plant::Course;

use crate::case::Case;
use crate::number::{self, seconds};
use crate::quantise::FixedPointGains;
use crate::runfile::{Key, SECTIONS, Value};

/// The order of the report: the first keys of blocks that stand together in the
/// table. A block goes on there to the first key of another one.
const BLOCKS: &str = "\
    controller.kp controller.rest_dead_band_counts controller.setpoints encoder.counter_bits \
    controller.feedback backlash.compensation limits.following_error_counts sequence.disable_s \
    motion.travel_mm encoder.counts_per_rad drive.dac_bits motor.inertia_kg_m2 \
    transmission.backlash_half_deg transmission.joint transmission.no_pull \
    transmission.gear_ratio transmission.screw_inertia_kg_m2 carriage.mass_kg run.duration_s";

/// One setting of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Parameter {
    /// Its name, such as `Sample time Δt`.
    pub label: String,
    /// Its value as it should be read; text, because not every setting is a
    /// number.
    pub value: String,
    /// Unit of the value, empty where there is none.
    pub unit: String,
}

pub(crate) fn text(label: &str, value: &str, unit: &str) -> Parameter {
    Parameter {
        label: label.to_owned(),
        value: value.to_owned(),
        unit: unit.to_owned(),
    }
}

pub(crate) fn value(label: &str, value: f64, unit: &str) -> Parameter {
    text(label, &number::table(value), unit)
}

/// All settings that are shown of a case.
pub(crate) fn of(case: &Case) -> Vec<Parameter> {
    let mut rows: Vec<(usize, Parameter)> = Vec::new();
    let mut block = 0;
    for section in SECTIONS {
        for key in section.keys {
            let path = format!("{}.{}", section.name, key.name);
            let first = BLOCKS.split(' ').position(|first| first == path);
            block = first.unwrap_or(block);
            rows.extend(row(key, case).map(|row| (block, row)));
        }
        if section.name == "motion" {
            rows.extend(moves(case).map(|row| (block, row)));
        }
    }
    rows.sort_by_key(|(block, _)| *block);
    let rows = rows.into_iter().map(|(_, row)| row);
    rows.chain(case.loads.iter().map(load)).collect()
}

/// A load that acts for a time.
fn load(load: &Load) -> Parameter {
    let time = |ns| format!("{} s", number::table(seconds(ns)));
    let end = load.to_ns.map(|to_ns| format!("to {}", time(to_ns)));
    let end = end.unwrap_or("on".to_owned());
    let label = format!("Load from {} {end}", time(load.from_ns));
    value(&label, load.force_n, "N")
}

/// The moves of a row, a line each.
fn moves(case: &Case) -> impl Iterator<Item = Parameter> {
    let moves: &[_] = match case.motion.course() {
        Course::Row(moves) => moves,
        _ => &[],
    };
    (1..).zip(moves).map(|(place, (motion, dwell_s))| {
        let [travel, time, dwell] =
            [1e3 * motion.travel_m(), motion.end_s(), *dwell_s].map(number::table);
        let words = format!("{travel} mm in {time} s, then {dwell} s of rest");
        text(&format!("Move {place}"), &words, "")
    })
}

/// One setting; nothing where it is not shown.
fn row(key: &Key, case: &Case) -> Option<Parameter> {
    let (shown, setting) = (&key.shown, key.get(case));
    let wanted = match shown.when {
        Some(when) => when(case),
        None => !key.is_of_firmware() || setting != key.default(),
    };
    if shown.label.is_empty() || !wanted || !key.acts.on(case.controller.law, |_| false) {
        return None;
    }
    let own_unit = key.unit.replace(' ', "·");
    let unit = shown.unit.unwrap_or(&own_unit);
    if let Some(own) = shown.text {
        return own(case).map(|own| text(shown.label, &own, unit));
    }
    let worded = |name: &str| {
        let words = shown.words.iter().find(|(known, _)| *known == name);
        words.map(|(_, words)| text(shown.label, words, ""))
    };
    match setting? {
        Value::Choice(name) => worded(name),
        Value::Flag(flag) => worded(if flag { "true" } else { "false" }),
        number => Some(value(shown.label, shown.factor * number.number()?, unit)),
    }
}

/// The fixed-point gains, with what rounding costs.
pub(crate) fn of_words(words: &FixedPointGains) -> Vec<Parameter> {
    let gains = words.rows.iter().map(|gain| {
        let rounding = number::relative_error(gain.relative_error());
        let of_plant = gain.of_plant().map(|of_plant| format!(", {of_plant}"));
        let of_plant = of_plant.unwrap_or_default();
        let word = format!("{} ({rounding}){of_plant}", gain.word);
        let label = format!("{} in fixed point (rounding)", gain.name());
        text(&label, &word, gain.unit())
    });
    let limit = words.error_limit.to_string();
    let range = text("Declared range of |e|", &limit, "counts");
    gains.chain([range]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runfile::{self, builtin_text};

    #[test]
    fn limits_and_moves_are_shown() {
        let shown = |lines: &str, label: &str| {
            let text = builtin_text("paper-1").unwrap();
            let (before, rest) = text.split_once("[motion]\n").unwrap();
            let (_, after) = rest.split_once("\n[").unwrap();
            let case = runfile::parse("x.toml", &format!("{before}{lines}\n[{after}"), &[]);
            let found = of(&case.unwrap())
                .into_iter()
                .find(|row| row.label == label);
            found.map(|row| format!("{} {}", row.value, row.unit))
        };
        let limits = "[motion]\ntravel_mm = 40\nmax_acceleration_mps2 = 4\n";
        let found = shown(limits, "Motion's acceleration limit");
        assert_eq!(found.unwrap(), "4 m/s²");
        assert_eq!(shown(limits, "Motion's jerk limit"), None);
        let moves = limits.replace("[motion]", "[[move]]") + "dwell_s = 0.5\n";
        let found = shown(&moves, "Move 1");
        assert_eq!(found.unwrap(), "40 mm in 0.2 s, then 0.5 s of rest ");
    }
}
