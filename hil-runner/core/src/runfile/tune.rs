//! `[tune]`: which keys are tuned, for what, and over which axes.

use serde::Deserialize;

use super::check::{self, Values};
use super::errors::{Findings, RunFileErrors};
use super::key_path::{KeyPath, renamed};
use super::keys::{Kind, Range, path};
use super::overrides;
use super::tree::{Node, Table, Toml};
use super::tune_settings::{
    Bound, Drawn, Objective, Over, OverSpread, Requirement, TuneSettings, TunedKey,
};
use super::values::show_number;
use crate::distribution::Distribution;
use crate::figures::{self, SUMMARY_FIGURES};

/// Axes that are drawn where there is a distribution and no number of them.
const DRAWS: u64 = 16;

/// Reads `[tune]` from a file of its own, with the overrides of its keys, for the run file
/// with the values `of_case`.
///
/// # Errors
/// Everything that is wrong with the text.
pub(super) fn read_file(
    source_name: &str,
    text: &str,
    sets: &[String],
    of_case: &Values,
) -> Result<TuneSettings, RunFileErrors> {
    let (tree, mut findings) = overrides::document(source_name, text, sets)?;
    for (name, node) in tree.entries.iter().filter(|(name, _)| name != "tune") {
        let because = "a file for --tune has the section [tune] alone".to_owned();
        findings.refuse(node, name, because);
    }
    let values = check::section(&tree, "tune", &mut findings);
    let settings = read(&tree, &values, of_case, &mut findings);
    if settings.is_none() && findings.is_empty() {
        findings.push_missing(None, "lacks the section [tune] with keys".to_owned());
    }
    let settings = settings.filter(|_| findings.is_empty());
    settings.ok_or_else(|| findings.into_errors())
}

/// Reads `[tune]` of a tree whose keys have been checked; `of_case` has the values of the run
/// file. Nothing if there is none.
pub(super) fn read(
    tree: &Table,
    values: &Values,
    of_case: &Values,
    findings: &mut Findings,
) -> Option<TuneSettings> {
    let table = tree.section("tune")?;
    let mut reader = Reader { findings, of_case };
    let keys = match table.get("keys") {
        Some(node) => reader.keys(node),
        None => {
            let place = tree.get("tune").map(|node| &node.place);
            let sentence = "[tune] lacks keys: keys that are tuned, a list of strings".to_owned();
            reader.findings.push_missing(place, sentence);
            Vec::new()
        }
    };
    let keys = reader.ranges(table.get("range"), keys);
    let minimise = table.get("minimise").map(|node| reader.minimise(node));
    let require = table.get("require").map(|node| reader.require(node));
    let over = table.get("over").map(|node| reader.over(node, &keys));
    let over = over.unwrap_or_default();
    let whole = |key: &str| {
        let number = values.value(&path("tune", key))?.number()?;
        Some(number as u64)
    };
    let is_drawn = |over: &Over| matches!(over.spread, OverSpread::Drawn(_));
    let usual = if over.iter().any(is_drawn) { DRAWS } else { 0 };
    if let Some(node) = table.get("draws")
        && (usual > 0) == (whole("draws") == Some(0))
    {
        let because = match usual {
            0 => "tune.over has no distribution to draw from",
            _ => "tune.over has a distribution, of which at least one axis has to be drawn",
        };
        reader.refuse(node, "draws", because.to_owned());
    }
    Some(TuneSettings {
        keys,
        minimise: minimise.unwrap_or_else(|| {
            let weight = 1.0;
            let usual = ["peak_following_error_mm", "peak_abs_acc_mps2"];
            usual.map(|figure| Objective { figure, weight }).to_vec()
        }),
        require,
        draws: whole("draws").unwrap_or(usual),
        seed: whole("seed").unwrap_or(1),
        runs: whole("runs"),
        over,
    })
}

struct Reader<'r> {
    findings: &'r mut Findings,
    of_case: &'r Values,
}

impl Reader<'_> {
    fn refuse(&mut self, node: &Node, key: &str, because: String) {
        self.findings.refuse(node, &path("tune", key), because);
    }

    /// What was read of a node, unless it is refused.
    fn taken<T>(&mut self, node: &Node, key: &str, read: Result<T, String>) -> Option<T> {
        let refuse = |because| self.refuse(node, key, because);
        read.map_err(refuse).ok()
    }

    /// The strings of a list, each with its node.
    fn strings<'n>(&mut self, node: &'n Node, key: &str) -> Vec<(&'n Node, &'n str)> {
        let Toml::Array(items) = &node.value else {
            return Vec::new();
        };
        if items.is_empty() {
            let because = "the list is empty; it has at least one string".to_owned();
            self.refuse(node, key, because);
        }
        let read = |item: &'n Node| {
            let is = item.value.type_words();
            let text = item.value.text();
            let text = text.ok_or(format!("the list has strings, and this is {is}"));
            Some((item, self.taken(item, key, text)?))
        };
        items.iter().filter_map(read).collect()
    }

    fn keys(&mut self, node: &Node) -> Vec<TunedKey> {
        let mut keys: Vec<TunedKey> = Vec::new();
        for (item, text) in self.strings(node, "keys") {
            let key = self.key(text, &keys);
            keys.extend(self.taken(item, "keys", key));
        }
        keys
    }

    /// # Errors
    /// The sentence that says what can be tuned.
    fn key(&self, text: &str, others: &[TunedKey]) -> Result<TunedKey, String> {
        let (base, element) = match text.rsplit_once('.') {
            Some((base @ "motion.intervals_s", number)) => match number.as_bytes() {
                [digit @ b'1'..=b'7'] => (base, Some(usize::from(digit - b'0'))),
                _ => {
                    let words = "the intervals are motion.intervals_s.1 to motion.intervals_s.7";
                    return Err(words.to_owned());
                }
            },
            _ => (text, None),
        };
        let key = KeyPath::find(base)?;
        let is_number = matches!(key.key.kind, Kind::Number(_));
        let is_word = matches!(base, "controller.feedback" | "backlash.compensation");
        let has_section = matches!(key.section, "controller" | "backlash" | "motion");
        if base == "motion.travel_mm"
            || !(has_section && (is_number || is_word || element.is_some()))
        {
            let words = "what can be tuned are numbers of [controller], [backlash] and [motion] but for the travel, \
                         controller.feedback, backlash.compensation, and motion.intervals_s.1 to 7";
            return Err(words.to_owned());
        }
        if others.iter().any(|other| other.path() == text) {
            return Err("it is there already".to_owned());
        }
        if let Some(other) = others.iter().find(|other| key.excludes(&other.key)) {
            return Err(format!("{} gives the same in another way", other.path()));
        }
        // What the file gives in another way would stand beside what is written.
        if let Some(other) = self.of_case.given_instead(&key) {
            return Err(format!("the run file gives the same by {other}; tune that"));
        }
        if element.is_some() && !self.of_case.is_given("motion.intervals_s") {
            return Err("the run file has no intervals_s".to_owned());
        }
        Ok(TunedKey {
            key,
            element,
            range: None,
        })
    }

    /// The keys with their ranges.
    fn ranges(&mut self, node: Option<&Node>, mut keys: Vec<TunedKey>) -> Vec<TunedKey> {
        let table = node.and_then(|node| node.value.table());
        for (name, item) in table.into_iter().flat_map(|table| &table.entries) {
            let key = format!("range.\"{name}\"");
            let Some(tuned) = keys.iter_mut().find(|tuned| tuned.path() == *name) else {
                self.refuse(item, &key, "a range is for one of tune.keys".to_owned());
                continue;
            };
            tuned.range = self.taken(item, &key, range(item, tuned));
        }
        keys
    }

    fn minimise(&mut self, node: &Node) -> Vec<Objective> {
        let Some(table) = node.value.table() else {
            return Vec::new();
        };
        if table.entries.is_empty() {
            let because = "the table is empty; it has at least one figure".to_owned();
            self.refuse(node, "minimise", because);
        }
        let read = |(name, item): &(String, Node)| {
            let objective = figure(name).and_then(|figure| {
                let weight = item.value.number();
                let weight = weight.filter(|weight| weight.is_finite() && *weight > 0.0);
                let weight = weight.ok_or("a weight is a finite number greater than 0")?;
                Ok(Objective { figure, weight })
            });
            self.taken(item, &format!("minimise.{name}"), objective)
        };
        table.entries.iter().filter_map(read).collect()
    }

    fn require(&mut self, node: &Node) -> Vec<Requirement> {
        let strings = self.strings(node, "require").into_iter();
        let read = |(item, text)| self.taken(item, "require", requirement(text));
        strings.filter_map(read).collect()
    }

    fn over(&mut self, node: &Node, tuned: &[TunedKey]) -> Vec<Over> {
        let read = |(name, item): &(String, Node)| {
            self.taken(item, &format!("over.\"{name}\""), over(name, item, tuned))
        };
        let table = node.value.table().into_iter();
        let entries = table.flat_map(|table| &table.entries);
        entries.filter_map(read).collect()
    }
}

/// # Errors
/// The sentence that says what is allowed.
fn range(node: &Node, tuned: &TunedKey) -> Result<[f64; 2], String> {
    let key = tuned.key.key;
    if let Kind::Choice(_) = key.kind {
        return Err("a key with words is tuned over all of them".to_owned());
    }
    let items = node.value.rows().into_iter();
    let numbers: Option<Vec<f64>> = items.map(|(item, _)| item.value.number()).collect();
    let ends = numbers.and_then(|numbers| <[f64; 2]>::try_from(numbers).ok());
    let ends = ends.filter(|[low, high]| low.is_finite() && high.is_finite() && low < high);
    let [low, high] = ends.ok_or("a range is two finite numbers, the lower one first")?;
    let allowed = match key.kind {
        Kind::Number(range) => range,
        _ => Range::NotNegative,
    };
    for end in [low, high] {
        check::check_number(end, allowed, key)
            .map_err(|words| format!("each end must be {words}"))?;
    }
    Ok([low, high])
}

/// The key of a figure of the summary.
///
/// # Errors
/// The sentence that names what may have been meant.
fn figure(name: &str) -> Result<&'static str, String> {
    let known = SUMMARY_FIGURES.iter().find(|figure| figure.key == name);
    let known = known.map(|figure| figure.key);
    known.ok_or_else(|| match renamed(name) {
        Some(now) => format!("{name} is now {now}"),
        None => match KeyPath::find(&format!("budget.{name}")) {
            Ok(_) => format!("{name} is no figure of the summary of a run on this host"),
            Err(unknown) => unknown
                .replace("budget.", "")
                .replace("unknown key", "unknown figure"),
        },
    })
}

/// # Errors
/// The sentence that says what is allowed.
fn requirement(text: &str) -> Result<Requirement, String> {
    let sides = [(">=", Bound::AtLeast), ("<=", Bound::AtMost)];
    let mut sides = sides.into_iter();
    let parts = sides.find_map(|(sign, bound)| Some((text.split_once(sign)?, bound)));
    let words =
        "a requirement is \"FIGURE >= NUMBER\", \"FIGURE <= NUMBER\" or \"FIGURE <= before\"";
    let ((name, limit), bound) = parts.ok_or(words)?;
    let of_before = limit.trim() == "before";
    let number = limit.trim().parse::<f64>().ok();
    let limit = number
        .or(of_before.then_some(1.0))
        .filter(|limit| limit.is_finite())
        .ok_or("the limit of a requirement is a finite number, or the word before")?;
    if bound == Bound::AtMost && limit < 0.0 {
        return Err("what is limited is a magnitude: the limit is at least 0".to_owned());
    }
    let figure = figure(name.trim())?;
    let is_least = figures::find(figure).is_some_and(|figure| figure.at_least);
    if is_least != (bound == Bound::AtLeast) {
        let (sign, why) = match is_least {
            true => (">=", "more of it is better"),
            false => ("<=", "less of it is better"),
        };
        return Err(format!("{figure} takes {sign}: {why}"));
    }
    if of_before && is_least {
        let words = "takes a number: before serves a figure of runs";
        return Err(format!("{figure} {words}"));
    }
    Ok(Requirement {
        figure,
        bound: if of_before { Bound::OfBefore } else { bound },
        limit,
    })
}

/// # Errors
/// The sentence that says what is allowed.
fn over(name: &str, node: &Node, tuned: &[TunedKey]) -> Result<Over, String> {
    let key = KeyPath::find(name)?;
    let is_of_axis = matches!(
        key.section,
        "motor" | "transmission" | "carriage" | "drive" | "encoder" | "load_encoder"
    );
    let is_number = matches!(key.key.kind, Kind::Number(_));
    let is_start = name == "transmission.start";
    if !is_of_axis || !(is_number || is_start) {
        let words = "an axis differs in numbers of [motor], [transmission], [carriage], [drive], [encoder] \
                     and [load_encoder], and in transmission.start";
        return Err(words.to_owned());
    }
    if tuned.iter().any(|tuned| tuned.key == key) {
        return Err("it is tuned".to_owned());
    }
    Ok(Over {
        key,
        spread: spread(node, &key)?,
    })
}

/// # Errors
/// The sentence that says what is allowed.
fn spread(node: &Node, key: &KeyPath) -> Result<OverSpread, String> {
    match (&node.value, key.key.kind) {
        (Toml::Array(items), Kind::Choice(words)) => {
            let known = |item: &Node| match &item.value {
                Toml::Text(text) if words.contains(&text.as_str()) => Ok(text.clone()),
                _ => Err(format!("it must be {}", key.key.allowed())),
            };
            let all: Vec<String> = items.iter().map(known).collect::<Result<_, _>>()?;
            Some(all)
                .filter(|all| !all.is_empty())
                .map(OverSpread::Words)
                .ok_or("the list is empty".to_owned())
        }
        (_, Kind::Choice(_)) => Err("it takes a list of its words".to_owned()),
        (Toml::Array(items), _) => {
            let values: Option<Vec<f64>> = items.iter().map(|item| item.value.number()).collect();
            values
                .filter(|values| !values.is_empty() && values.iter().all(|value| value.is_finite()))
                .map(OverSpread::Values)
                .ok_or_else(|| "a list has finite numbers, at least one".to_owned())
        }
        (Toml::Text(text), _) => factors_or_values(text),
        (Toml::Table(table), _) => drawn(table).map(OverSpread::Drawn),
        _ => Err(WORDS.to_owned()),
    }
}

const WORDS: &str = "it takes \"0.5..2 x\", \"0.5, 1, 2 x\" (factors of the file's own value), \"LOW..HIGH\", a \
                     list of numbers, or a distribution";

/// `0.5..2 x`, `0.5, 1, 2 x`; without the x values.
fn factors_or_values(text: &str) -> Result<OverSpread, String> {
    let text = text.trim();
    let (numbers, are_factors) = match text.strip_suffix(['x', '×']) {
        Some(numbers) => (numbers, true),
        None => (text, false),
    };
    let parse = |number: &str| {
        let number = number.trim().parse::<f64>().ok();
        number.filter(|number| number.is_finite())
    };
    let values: Option<Vec<f64>> = match numbers.split_once("..") {
        None => numbers.split(',').map(parse).collect(),
        Some((low, high)) => match (parse(low), parse(high)) {
            (Some(low), Some(high)) if low < high => {
                let own = (are_factors && low < 1.0 && 1.0 < high).then_some(1.0);
                Some([Some(low), own, Some(high)].into_iter().flatten().collect())
            }
            (Some(low), Some(high)) => {
                let (low, high) = (show_number(low), show_number(high));
                return Err(format!("{low}..{high} is empty: the lower one comes first"));
            }
            _ => None,
        },
    };
    let values = values.ok_or_else(|| WORDS.to_owned())?;
    Ok(match are_factors {
        true => OverSpread::Factors(values),
        false => OverSpread::Values(values),
    })
}

/// A distribution as in studies; `times = true` makes its values factors of the file's own.
fn drawn(table: &Table) -> Result<Drawn, String> {
    let mut plain = toml::Table::new();
    let mut is_factor = false;
    for (name, node) in &table.entries {
        let value = match &node.value {
            Toml::Flag(flag) if name == "times" => {
                is_factor = *flag;
                continue;
            }
            Toml::Text(text) => toml::Value::String(text.clone()),
            Toml::Number(value, _) => toml::Value::Float(*value),
            other => return Err(format!("{name} is {}; {WORDS}", other.type_words())),
        };
        plain.insert(name.clone(), value);
    }
    let read = Distribution::deserialize(toml::Value::Table(plain));
    let distribution = read.map_err(|error| error.message().trim().to_owned())?;
    distribution.check()?;
    Ok(Drawn {
        distribution,
        is_factor,
    })
}
