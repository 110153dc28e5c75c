//! The checked values of a run file, each with its place for messages that
//! concern several of them.

use super::errors::Place;
use super::keys::{DefaultValue, Key, Need, path};
use super::tree::Node;

/// A value of the type and in the range that its key asks for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Checked {
    Text(String),
    Flag(bool),
    Choice(&'static str),
    Number(f64),
    Whole(i64),
    Nanoseconds(u64),
    Intervals([f64; 7]),
}

impl From<DefaultValue> for Checked {
    fn from(default: DefaultValue) -> Self {
        match default {
            DefaultValue::Flag(flag) => Self::Flag(flag),
            DefaultValue::Choice(choice) => Self::Choice(choice),
            DefaultValue::Number(number) => Self::Number(number),
            DefaultValue::Whole(whole) => Self::Whole(i64::from(whole)),
            DefaultValue::Nanoseconds(ns) => Self::Nanoseconds(ns),
        }
    }
}

/// A key that is given or has a default.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    /// Where it is given; [`None`] for a default.
    pub(super) place: Option<Place>,
    /// As it was written.
    pub(super) text: String,
    /// [`None`] if it was refused.
    checked: Option<Checked>,
}

impl Entry {
    pub(super) fn given(node: &Node, checked: Checked) -> Self {
        Self {
            checked: Some(checked),
            ..Self::refused(node)
        }
    }

    pub(super) fn refused(node: &Node) -> Self {
        Self {
            place: Some(node.place.clone()),
            text: node.text.clone(),
            checked: None,
        }
    }

    pub(super) fn default_value(checked: Checked, text: String) -> Self {
        Self {
            place: None,
            text,
            checked: Some(checked),
        }
    }

    /// Whether the value is what would hold without the key.
    fn is_default_of(&self, key: &Key) -> bool {
        match key.need {
            Need::Default(default) => self.checked == Some(default.into()),
            _ => false,
        }
    }
}

/// All keys that are given or have a default.
#[derive(Debug, Clone, Default)]
pub(super) struct Values {
    entries: Vec<(&'static str, &'static Key, Entry)>,
}

impl Values {
    pub(super) fn insert(&mut self, section: &'static str, key: &'static Key, entry: Entry) {
        self.entries.push((section, key, entry));
    }

    pub(super) fn entry(&self, section: &str, key: &str) -> Option<&Entry> {
        self.entries
            .iter()
            .find(|(s, k, _)| *s == section && k.name == key)
            .map(|(_, _, entry)| entry)
    }

    /// Whether the file or the command line says anything about the key, right
    /// or wrong.
    pub(super) fn is_given(&self, section: &str, key: &str) -> bool {
        self.entry(section, key)
            .is_some_and(|entry| entry.place.is_some())
    }

    /// Section, key and entry of what the file or the command line sets to
    /// another value than its default.
    pub(super) fn set(&self) -> impl Iterator<Item = (&'static str, &'static Key, &Entry)> {
        let entries = self.entries.iter();
        entries
            .filter(|(_, key, entry)| entry.place.is_some() && !entry.is_default_of(key))
            .map(|(section, key, entry)| (*section, *key, entry))
    }

    /// `controller.sample_time_s = 0.001 (line 40)`, for a sentence about
    /// another key.
    pub(super) fn quote(&self, section: &str, key: &str) -> String {
        let path = path(section, key);
        let Some(entry) = self.entry(section, key) else {
            return path;
        };
        let origin = match &entry.place {
            None => "the default".to_owned(),
            Some(Place::File) => "the file".to_owned(),
            Some(Place::Line(line)) => format!("line {line}"),
            Some(Place::Set(_)) => "by --set".to_owned(),
        };
        format!("{path} = {} ({origin})", entry.text)
    }

    fn checked(&self, section: &str, key: &str) -> Option<&Checked> {
        self.entry(section, key)?.checked.as_ref()
    }

    pub(super) fn number(&self, section: &str, key: &str) -> Option<f64> {
        match self.checked(section, key)? {
            Checked::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// A whole number in the type of its setting, which holds whatever the
    /// key's range allows.
    pub(super) fn whole<T: TryFrom<i64>>(&self, section: &str, key: &str) -> Option<T> {
        match self.checked(section, key)? {
            Checked::Whole(whole) => T::try_from(*whole).ok(),
            _ => None,
        }
    }

    pub(super) fn nanoseconds(&self, section: &str, key: &str) -> Option<u64> {
        match self.checked(section, key)? {
            Checked::Nanoseconds(ns) => Some(*ns),
            _ => None,
        }
    }

    pub(super) fn flag(&self, section: &str, key: &str) -> Option<bool> {
        match self.checked(section, key)? {
            Checked::Flag(flag) => Some(*flag),
            _ => None,
        }
    }

    pub(super) fn choice(&self, section: &str, key: &str) -> Option<&'static str> {
        match self.checked(section, key)? {
            Checked::Choice(choice) => Some(choice),
            _ => None,
        }
    }

    pub(super) fn text(&self, section: &str, key: &str) -> Option<&str> {
        match self.checked(section, key)? {
            Checked::Text(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn intervals(&self, section: &str, key: &str) -> Option<[f64; 7]> {
        match self.checked(section, key)? {
            Checked::Intervals(intervals) => Some(*intervals),
            _ => None,
        }
    }
}
