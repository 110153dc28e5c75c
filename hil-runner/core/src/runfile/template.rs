//! A run file that stands for many runs: some of its keys get other values
//! from run to run, as a study wants it.
//!
//! Most changes go the way of a file: text, checks, assembly, some tenths of a
//! millisecond. Gains, gap, masses and the like, on which no check of several
//! keys depends, are written straight into the case, in less than a microsecond.

use super::RunFile;
use super::check::check_number;
use super::errors::{Place, RunFileErrors};
use super::key_path::{KeyPath, KeyValue};
use super::keys::{Key, Kind, path};
use super::profile::Beside;
use super::values::Value;
use crate::case::Case;

/// A run file with all that holds for every run.
#[derive(Debug, Clone)]
pub struct Template {
    text: String,
    sets: Vec<String>,
    beside: Beside,
    file: RunFile,
    /// What the file gives in another way than the case holds it; other keys may
    /// count in it.
    converted: Vec<(&'static Key, Value)>,
}

impl Template {
    /// A run file from its text, with overrides that hold for every run;
    /// `source_name` stands in messages.
    ///
    /// # Errors
    /// Everything that is wrong with the text and the overrides.
    pub fn parse(
        source_name: &str,
        text: &str,
        sets: &[String],
        beside: Beside,
    ) -> Result<Self, RunFileErrors> {
        let file = RunFile::parse(source_name, text, sets, beside)?;
        let is_converted = |section, key: &'static Key| {
            let ways = KeyPath { section, key }.ways();
            ways.iter().skip(1).any(|way| way.contains(&key.name))
        };
        let set = file.values.set();
        let converted = set.filter_map(|(section, key, entry)| {
            let value = entry.value.filter(|_| is_converted(section, key))?;
            Some((key, value))
        });
        Ok(Self {
            converted: converted.collect(),
            file,
            text: text.to_owned(),
            sets: sets.to_owned(),
            beside,
        })
    }

    /// The same file with other overrides that hold for every run.
    ///
    /// # Errors
    /// As [`Template::parse`].
    pub fn with_sets(&self, sets: &[String]) -> Result<Self, RunFileErrors> {
        Self::parse(&self.file.source_name, &self.text, sets, self.beside)
    }

    /// The run without any change.
    pub fn base(&self) -> &Case {
        &self.file.case
    }

    /// The name of the file in messages, beside which its profile lies.
    pub fn source_name(&self) -> &str {
        &self.file.source_name
    }

    /// The overrides that hold for every run.
    pub fn sets(&self) -> &[String] {
        &self.sets
    }

    /// The text of the file, without the overrides.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Value of a key without any change, where that is a number.
    pub fn number(&self, key: &KeyPath) -> Option<f64> {
        self.file.values.value(&key.path())?.number()
    }

    /// The same, or what the base makes of it where it gives the quantity in another way.
    pub fn own_number(&self, key: &KeyPath) -> Option<f64> {
        let of_case = || key.key.get(self.base())?.number();
        self.number(key).or_else(of_case)
    }

    /// Section, key and value, as it was written, of what the overrides set to
    /// another value than its default.
    pub fn overridden(&self) -> impl Iterator<Item = (&'static str, &'static Key, &str)> {
        let set = self.file.values.set();
        set.filter(|(_, _, entry)| matches!(entry.place, Some(Place::Set(_))))
            .map(|(section, key, entry)| (section, key, entry.text.as_str()))
    }

    /// True if the file or an override gives a key.
    pub fn is_given(&self, section: &str, key: &str) -> bool {
        self.file.values.is_given(&path(section, key))
    }

    /// The run with these values instead.
    ///
    /// # Errors
    /// Everything that is wrong with the values; each stands there as the
    /// `--set` that would give it to a single run.
    pub fn case<'v>(
        &self,
        changes: impl Iterator<Item = (&'v KeyPath, &'v KeyValue)> + Clone,
    ) -> Result<Case, RunFileErrors> {
        match self.written(changes.clone()) {
            Some(case) => Ok(case),
            None => self.file(changes).map(|file| file.case),
        }
    }

    /// The run file with these values instead, read as `--set` would have it.
    ///
    /// # Errors
    /// As [`Template::case`].
    pub fn file<'v>(
        &self,
        changes: impl Iterator<Item = (&'v KeyPath, &'v KeyValue)>,
    ) -> Result<RunFile, RunFileErrors> {
        let mut sets = self.sets.clone();
        sets.extend(changes.map(|(key, value)| format!("{}={}", key.path(), value.to_toml())));
        RunFile::parse(&self.file.source_name, &self.text, &sets, self.beside)
    }

    /// The run, if every change can be written straight into the case.
    fn written<'v>(
        &self,
        changes: impl Iterator<Item = (&'v KeyPath, &'v KeyValue)> + Clone,
    ) -> Option<Case> {
        // What an axis adds to the paper's law may depend on any of the keys.
        if !self.base().options.is_off() {
            return None;
        }
        let mut case = None;
        for (key, value) in changes.clone() {
            let (Kind::Number(range), KeyValue::Number(number)) = (key.key.kind, value) else {
                return None;
            };
            // The text of a file has no −0 either.
            let number = check_number(*number + 0.0, range, key.key).ok()?;
            if !key.key.alone || self.takes_another_way(key) {
                return None;
            }
            let case = case.get_or_insert_with(|| self.base().clone());
            key.key.set(case, Value::Number(number));
        }
        let case = case.as_mut()?;
        for (key, value) in &self.converted {
            let mut changes = changes.clone();
            let changed = changes.find(|(path, _)| core::ptr::eq(path.key, *key));
            let changed = changed.and_then(|(_, value)| value.number());
            key.set(case, changed.map_or(*value, Value::Number));
        }
        Some(case.clone())
    }

    /// True if the base gives what a key gives in another way.
    fn takes_another_way(&self, key: &KeyPath) -> bool {
        !key.ways().is_empty() && !self.is_given(key.section, key.key.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runfile::profile::nothing_beside;
    use crate::runfile::{SECTIONS, builtin_text};

    fn parsed(sets: &[&str]) -> Result<Template, RunFileErrors> {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let text = builtin_text("paper-2").unwrap();
        Template::parse("paper-2", text, &sets, nothing_beside)
    }

    fn template(sets: &[&str]) -> Template {
        parsed(sets).unwrap()
    }

    /// Every key that is written straight gives the case that the file would.
    #[test]
    fn what_is_written_is_what_the_file_says() {
        let mut written = 0;
        for section in SECTIONS {
            for key in section.keys {
                let key = KeyPath::find(&path(section.name, key.name)).unwrap();
                if !key.key.alone {
                    continue;
                }
                let mut ways = section.ways_with(key.key.name).iter();
                let way = ways.find(|way| way.contains(&key.key.name));
                let sets = way.into_iter().copied().flatten();
                let sets: Vec<String> = sets
                    .map(|name| format!("{}=0.7", path(section.name, name)))
                    .collect();
                let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
                let template = template(&sets);
                for number in [0.001, 0.3, 1.0 / 3.0, 2.0, 17.77] {
                    let value = KeyValue::Number(number);
                    let change = [(&key, &value)];
                    let quick = template.written(change.into_iter()).unwrap();
                    let set = format!("{}={}", key.path(), value.to_toml());
                    let sets = [template.sets(), &[set]].concat();
                    let text = template.text();
                    let slow = RunFile::parse("paper-2", text, &sets, nothing_beside).unwrap();
                    assert_eq!(quick, slow.case, "{} = {number}", key.path());
                    assert_ne!(&quick, template.base(), "{} has no effect", key.path());
                    written += 1;
                }
            }
        }
        assert_eq!(written, 25 * 5);
    }

    /// A gain in volts per radian stays that whatever the amplifier has.
    #[test]
    fn what_the_file_gives_in_another_way_is_converted_anew() {
        let kp = "controller.kp_v_per_rad";
        let sets = [
            &format!("{kp}=30"),
            "controller.ki_v_per_rad_s=46",
            "controller.kd_vs_per_rad=0.5",
        ];
        let template = template(&sets.map(|set| set as &str));
        let find = |path: &str| KeyPath::find(path).unwrap();
        let (amplifier, kp) = (find("drive.amplifier_gain"), find(kp));
        let (doubled, twenty) = (amplifier.value(6.0), kp.value(20.0));
        let changes = [(&kp, &twenty), (&amplifier, &doubled)];
        let quick = template.written(changes.into_iter()).unwrap();
        assert_eq!(quick, template.file(changes.into_iter()).unwrap().case);
        let base = template.base().controller.gains;
        assert_eq!(quick.controller.gains.ki_per_s, base.ki_per_s / 2.0);
        assert_ne!(quick.controller.gains.kp, base.kp / 2.0);
        // Another way than the base's is no number beside it, and goes the way of a file.
        let codes = find("controller.kp");
        let one = codes.value(1.0);
        assert_eq!(template.written([(&codes, &one)].into_iter()), None);
        assert!(template.file([(&codes, &one)].into_iter()).is_err());
    }

    #[test]
    fn a_value_out_of_range_is_refused_as_in_a_file() {
        let key = KeyPath::find("controller.kp").unwrap();
        let value = KeyValue::Number(-1.0);
        let error = template(&[])
            .case([(&key, &value)].into_iter())
            .unwrap_err();
        assert_eq!(
            error.to_string(),
            "--set controller.kp=-1.0: controller.kp = -1.0 is not allowed: \
             the proportional gain K_p must be at least 0 codes/count"
        );
    }

    #[test]
    fn times_are_whole_nanoseconds_and_bits_whole_numbers() {
        let time = KeyPath::find("controller.sample_time_s").unwrap();
        assert_eq!(time.value(1.2345e-4), KeyValue::Nanoseconds(123_450));
        assert_eq!(time.value(1.0 / 3e3), KeyValue::Nanoseconds(333_333));
        assert_eq!(time.value(1e-3).to_toml(), "1000000e-9");
        let bits = KeyPath::find("drive.dac_bits").unwrap();
        assert_eq!(bits.value(11.7), KeyValue::Whole(12));
        let case = template(&[])
            .case([(&time, &time.value(2e-3)), (&bits, &bits.value(12.0))].into_iter())
            .unwrap();
        assert_eq!(case.controller.sample_time_ns, Some(2_000_000));
        assert_eq!(case.dac.bits, 12);
    }

    #[test]
    fn one_of_a_pair_takes_the_place_of_the_other() {
        let lines = KeyPath::find("encoder.lines").unwrap();
        let change = (&lines, &lines.value(500.0));
        let case = template(&["drive.dac_range_v=80"])
            .case([change].into_iter())
            .unwrap();
        assert_eq!(case.encoder, plant::Encoder::with_lines(500.0));
        assert_eq!(case.dac, plant::Dac::with_range(14, 80.0));
        // Both at once are refused.
        assert!(parsed(&["drive.dac_range_v=80", "drive.dac_lsb_v=0.1"]).is_err());
    }

    #[test]
    fn numbers_of_the_base_can_be_asked_for() {
        let number = |path: &str| template(&[]).number(&KeyPath::find(path).unwrap());
        assert_eq!(number("controller.sample_time_s"), Some(1e-3));
        assert_eq!(number("drive.dac_bits"), Some(14.0));
        assert_eq!(number("controller.kp"), Some(3.2));
        assert_eq!(number("encoder.lines"), None);
    }
}
