//! The run file as a form: every key with its words, unit and range, and what a file says
//! of it. Sections and keys are those of the table, rows of lists those that the file has.

use serde::Serialize;

use super::check::Part;
use super::keys::{Key, Kind, LONGEST_TIME_S, Range, path};
use super::{RunFile, Value};
use crate::case::Law;

/// A section, or a row of a list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormSection {
    /// Name without brackets, empty at the top of the file; `load.1` for the first row.
    pub name: String,
    /// Subject of the section.
    pub meaning: &'static str,
    /// Its keys.
    pub keys: Vec<FormKey>,
}

/// A key.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormKey {
    /// Path, as `--set` has it.
    pub path: String,
    /// Unit as it is printed; empty where there is none.
    pub unit: &'static str,
    /// Its meaning in words.
    pub meaning: &'static str,
    /// Remark, if there is one.
    pub note: String,
    /// Type of the value: `number`, `time`, `whole`, `flag`, `choice`, `text`, `intervals`,
    /// `strings` or `table`.
    pub kind: &'static str,
    /// The word that serves in the place of a number.
    pub word: Option<&'static str>,
    /// The words to choose from.
    pub choices: Option<&'static [&'static str]>,
    /// Least number; with `above` it is not allowed itself.
    pub low: Option<f64>,
    /// Largest number.
    pub high: Option<f64>,
    /// True if a number must be greater than `low`.
    pub above: bool,
    /// What is allowed, in words.
    pub allowed: String,
    /// The value that holds if the key is left out, as TOML.
    pub default: Option<String>,
    /// What the file says, as TOML.
    pub value: Option<String>,
    /// The number that the run has, given or derived.
    pub held: Option<f64>,
    /// Rungs on which the key changes anything.
    pub acts: Vec<&'static str>,
    /// Paths of the keys that say the same in another way.
    pub excludes: Vec<String>,
}

impl RunFile {
    /// The file as a form.
    ///
    /// ```
    /// use hil_core::runfile::{RunFile, builtin_text};
    ///
    /// let text = builtin_text("paper-2").unwrap_or_default();
    /// let file = RunFile::parse("paper-2", text, &[], |_, _| Err("none".to_owned()))?;
    /// let form = file.form();
    /// let mut keys = form.iter().flat_map(|section| &section.keys);
    /// let kp = keys.find(|key| key.path == "controller.kp");
    /// assert_eq!(kp.and_then(|key| key.held), Some(3.2));
    /// # Ok::<(), hil_core::runfile::RunFileErrors>(())
    /// ```
    pub fn form(&self) -> Vec<FormSection> {
        let of = |part: &Part| {
            let keys = part.section.keys.iter();
            FormSection {
                name: part.name.clone(),
                meaning: part.section.meaning,
                keys: keys.map(|key| self.form_key(part, key)).collect(),
            }
        };
        self.values.parts.iter().map(of).collect()
    }

    fn form_key(&self, part: &Part, key: &Key) -> FormKey {
        let of = |name: &str| path(&part.name, name);
        let full = of(key.name);
        let entry = self.values.entry(&full);
        let given = entry.filter(|entry| entry.place.is_some());
        // A row has no place in a case by itself.
        let held = match self.values.value(&full).and_then(Value::number) {
            None if part.list.is_none() => key.get(&self.case).and_then(Value::number),
            given => given,
        };
        let is_given = |other: &str| self.values.is_given(&of(other));
        let laws = Law::ALL.into_iter();
        let acting = laws.filter(|law| key.acts.on(*law, is_given));
        let (kind, range) = kind_and_range(key.kind);
        let choices = match key.kind {
            Kind::Choice(choices) => Some(choices),
            _ => None,
        };
        let (low, high) = match range {
            None | Some(Range::Any) => (None, None),
            Some(Range::Positive | Range::NotNegative) => (Some(0.0), None),
            Some(Range::Between(low, high)) => (Some(low), Some(high)),
        };
        FormKey {
            unit: key.unit,
            meaning: key.meaning.trim_end_matches(','),
            note: key.note.join(" "),
            kind,
            word: key.word,
            choices,
            low,
            high: high.or((kind == "time").then_some(LONGEST_TIME_S)),
            above: range == Some(Range::Positive),
            allowed: key.allowed(),
            default: key.default().map(Value::to_toml),
            value: given.map(|entry| entry.text.clone()),
            held,
            acts: acting.map(Law::name).collect(),
            excludes: part.section.others(key.name).map(of).collect(),
            path: full,
        }
    }
}

/// The name of a kind, and the range of its numbers.
fn kind_and_range(kind: Kind) -> (&'static str, Option<Range>) {
    match kind {
        Kind::Text => ("text", None),
        Kind::Flag => ("flag", None),
        Kind::Choice(_) => ("choice", None),
        Kind::Number(range) => ("number", Some(range)),
        Kind::Whole(low, high) => ("whole", Some(Range::Between(low as f64, high as f64))),
        Kind::Time(range) => ("time", Some(range)),
        Kind::Intervals => ("intervals", None),
        Kind::Strings => ("strings", None),
        Kind::Table => ("table", None),
    }
}

#[cfg(test)]
mod tests {
    use super::super::builtin_text;
    use super::super::table::{LISTS, SECTIONS};
    use super::*;

    fn file(sets: &[&str]) -> RunFile {
        let text = builtin_text("paper-2").unwrap().to_owned() + "\n[[load]]\nforce_n = 5\n";
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        RunFile::parse("paper-2", &text, &sets, |_, _| Err(String::new())).unwrap()
    }

    fn key(file: &RunFile, path: &str) -> FormKey {
        let sections = file.form();
        let mut keys = sections.iter().flat_map(|section| &section.keys);
        keys.find(|key| key.path == path).unwrap().clone()
    }

    #[test]
    fn a_form_has_every_key_and_what_the_file_says() {
        let file = file(&["controller.law=quantised"]);
        let keys: usize = SECTIONS.iter().map(|section| section.keys.len()).sum();
        let found: usize = file.form().iter().map(|section| section.keys.len()).sum();
        assert_eq!(found, keys + LISTS[0].row.keys.len());
        let kp = key(&file, "controller.kp");
        assert_eq!((kp.value.as_deref(), kp.held), (Some("3.2"), Some(3.2)));
        assert_eq!((kp.low, kp.above, kp.high), (Some(0.0), false, None));
        // Another way to say the same is derived, and not given.
        let whole = key(&file, "transmission.backlash_um");
        assert_eq!(whole.value, None);
        assert!(whole.held.is_some_and(|um| (um - 83.333).abs() < 1e-2));
        assert_eq!(whole.excludes, ["transmission.backlash_half_deg"]);
        assert_eq!(key(&file, "load.1.force_n").held, Some(5.0));
        let law = key(&file, "controller.law");
        assert_eq!(law.value.as_deref(), Some("quantised"));
        assert_eq!(law.choices.map(<[_]>::len), Some(4));
        let windup = key(&file, "controller.anti_windup");
        assert_eq!((windup.value, windup.acts), (None, vec!["firmware"]));
        assert_eq!(windup.default.as_deref(), Some("\"none\""));
    }
}
