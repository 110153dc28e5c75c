//! A run file with every key of the table, to change one of them at a time.

use hil_core::case::Case;
use hil_core::runfile::{Key, Kind, Need, Range, SECTIONS, Section};

use super::parse;

/// A run file that gives every key, one a line.
pub(crate) struct Document(Vec<(&'static str, &'static Key, String)>);

impl Document {
    /// Every key with the first of its samples; of several ways the first only.
    pub(crate) fn full() -> Self {
        let first = |(section, key): &(&Section, &Key)| {
            let ways = section.ways_with(key.name);
            let leads = ways.first().is_none_or(|way| way.contains(&key.name));
            leads && !is_of_current_drive(key)
        };
        let entry = |(section, key): (&Section, &'static Key)| (section.name, key, samples(key).0);
        Self(all_keys().filter(first).map(entry).collect())
    }

    /// With another value for a key, in its way where there are several.
    pub(crate) fn with(mut self, section: &Section, key: &'static Key, value: &str) -> Self {
        if is_of_current_drive(key) || (key.name, value) == ("kind", "\"current\"") {
            self.make_current();
        }
        let is_it = |s: &str, k: &Key| s == section.name && k.name == key.name;
        if !self.0.iter().any(|(s, k, _)| is_it(s, k)) {
            let excluded =
                |s: &str, k: &Key| s == section.name && section.excludes(key.name, k.name);
            self.0.retain(|(s, k, _)| !excluded(s, k));
            let mut ways = section.ways_with(key.name).iter();
            let way = ways
                .find(|way| way.contains(&key.name))
                .copied()
                .unwrap_or_default();
            for name in way {
                let key = section.key(name).unwrap();
                if !self
                    .0
                    .iter()
                    .any(|(s, k, _)| *s == section.name && k.name == *name)
                {
                    self.0.push((section.name, key, samples(key).0));
                }
            }
        }
        if !self.0.iter().any(|(s, k, _)| is_it(s, k)) {
            self.0.push((section.name, key, String::new()));
        }
        for (s, k, v) in &mut self.0 {
            if is_it(s, k) {
                *v = value.to_owned();
            }
        }
        self
    }

    /// With a current drive.
    fn make_current(&mut self) {
        for (section, key, value) in &mut self.0 {
            match (*section, key.name) {
                ("drive", "kind") => *value = "\"current\"".to_owned(),
                ("drive", "amplifier_gain") => {
                    let drive = SECTIONS.iter().find(|section| section.name == "drive");
                    *key = drive.unwrap().key("amplifier_gain_a_per_v").unwrap();
                }
                _ => {}
            }
        }
    }

    /// Without a key, other ways to give it and what may stand only with it.
    pub(crate) fn without(self, section: &Section, key: &'static Key) -> Self {
        let mut document = self.with(section, key, "1");
        document.0.retain(|(s, k, _)| {
            let follows = k.need == Need::OnlyWith(key.name);
            !(*s == section.name && (k.name == key.name || follows))
        });
        document
    }

    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        // [tune] makes no case, and cannot stand without its keys.
        for section in SECTIONS.iter().filter(|section| section.name != "tune") {
            if !section.name.is_empty() {
                text.push_str(&format!("[{}]\n", section.name));
            }
            for (_, key, value) in self.0.iter().filter(|(s, _, _)| *s == section.name) {
                text.push_str(&format!("{} = {value}\n", key.name));
            }
        }
        text
    }

    /// Line of a key in [`Document::text`].
    pub(crate) fn line(&self, section: &Section, key: &Key) -> usize {
        let text = self.text();
        let header = format!("[{}]", section.name);
        let mut inside = section.name.is_empty();
        let start = format!("{} = ", key.name);
        let at = text.lines().position(|line| {
            inside |= line == header;
            inside && line.starts_with(&start)
        });
        at.unwrap() + 1
    }

    /// The case that it makes, without the list of what its rung leaves out: a
    /// key that does no more than stand there is dead.
    pub(crate) fn case(&self) -> Case {
        let case = parse(&self.text(), &[]).unwrap_or_else(|errors| panic!("{errors}"));
        Case {
            keys_without_effect: Vec::new(),
            ..case
        }
    }
}

/// Every key that makes the case; those of `[tune]` change none.
pub(crate) fn all_keys() -> impl Iterator<Item = (&'static Section, &'static Key)> {
    SECTIONS
        .iter()
        .filter(|section| section.name != "tune")
        .flat_map(|section| section.keys.iter().map(move |key| (section, key)))
}

/// True of a key that only a current drive has.
pub(crate) fn is_of_current_drive(key: &Key) -> bool {
    ["_a_per_v", "_a_per_rad", "_a_per_rad_s", "_as_per_rad"]
        .iter()
        .any(|unit| key.name.ends_with(unit))
        || key.name == "current_bandwidth_hz"
}

/// Further keys without which a key cannot stand or acts on nothing, as sets.
pub(crate) fn beside(path: &str) -> Vec<&'static str> {
    let mut lines = include_str!("beside.txt").lines();
    let sets = lines.find_map(|line| line.strip_prefix(path)?.strip_prefix(": "));
    sets.unwrap_or_default().split_whitespace().collect()
}

/// Two allowed values of a key that go with the first values of the others.
pub(crate) fn samples(key: &Key) -> (String, String) {
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    match key.kind {
        Kind::Text => pair("\"one\"", "\"two\""),
        Kind::Flag => pair("true", "false"),
        Kind::Choice(choices) => {
            let last = choices[choices.len() - 1];
            let (first, second) = match key.name {
                // "continuous" needs no sample time.
                "law" => (choices[1], last),
                // Only a queue goes with feed-forward and can run dry.
                "setpoints" => (last, choices[0]),
                _ => (choices[0], last),
            };
            (format!("\"{first}\""), format!("\"{second}\""))
        }
        Kind::Number(Range::Between(low, high)) => {
            (format!("{low:e}"), format!("{:e}", (low + high) / 2.0))
        }
        Kind::Number(_) => match key.name {
            // A command of 2 mm that each of its limits limits.
            "max_velocity_mps" => pair("0.05", "0.04"),
            "max_jerk_mps3" => pair("1000", "2000"),
            _ => pair("2", "3.5"),
        },
        Kind::Whole(..) => pair("12", "14"),
        Kind::Time(Range::NotNegative) => pair("0", "0.001"),
        Kind::Time(_) => match key.name {
            // Long enough for a rest, and a window within it.
            "duration_s" => pair("1000", "999"),
            "rest_window_s" => pair("200", "300"),
            _ => pair("0.002", "0.001"),
        },
        Kind::Intervals => pair("[1, 0, 1, 0, 1, 0, 1]", "[1, 0.5, 1, 0, 1, 0, 1]"),
        Kind::Strings => pair("[\"one\"]", "[\"two\"]"),
        Kind::Table => pair("{ one = 1 }", "{ two = 2 }"),
    }
}
