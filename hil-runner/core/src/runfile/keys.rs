//! A key of the run file: name, kind, range, unit, when it must be given, its
//! place in a case, how a report and a commented file show it, and the words for
//! all of that. The keys themselves stand in [`SECTIONS`](super::SECTIONS).

use super::values::{Choices, Stored, Value, show_number};
use crate::case::{Case, Law};

/// One section of the run file; the name of the first one is empty, its keys
/// stand at the top of the file.
#[derive(Debug)]
pub struct Section {
    /// Name without brackets.
    pub name: &'static str,
    /// Subject of the section.
    pub meaning: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
    /// The quantities that can be given in several ways, each with its ways: a file
    /// gives the keys of one way. A key stands in the ways of one quantity at most,
    /// there in as many as it belongs to, and its need is that within its way. The
    /// first way is the one in which a case holds the quantity.
    pub ways: &'static [&'static [Way]],
}

/// A section of which a file may have several, `[[load]]`, each a row of a list.
#[derive(Debug)]
pub struct List {
    /// Name, subject and keys of a row.
    pub row: Section,
    /// The section that a file with rows of it does without; empty if there is none.
    pub instead_of: &'static str,
    /// Adds a row to a case, which the keys of the row then fill.
    pub(super) begin: fn(&mut Case),
}

/// The keys of a section that together give a quantity in one way.
pub type Way = &'static [&'static str];

impl Section {
    /// The key of that name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    pub(super) const fn ways(mut self, ways: &'static [&'static [Way]]) -> Self {
        self.ways = ways;
        self
    }

    /// The ways of the quantity that a key gives; none for a key that is the only one.
    pub fn ways_with(&self, key: &str) -> &'static [Way] {
        let mut quantities = self.ways.iter();
        let found = quantities.find(|ways| ways.iter().any(|way| way.contains(&key)));
        found.copied().unwrap_or_default()
    }

    /// True of two keys that give one quantity and stand together in no way.
    pub fn excludes(&self, key: &str, other: &str) -> bool {
        let ways = self.ways_with(key);
        let has = |names: &[&str]| {
            let mut ways = ways.iter();
            ways.any(|way| names.iter().all(|name| way.contains(name)))
        };
        has(&[other]) && !has(&[key, other])
    }

    /// Names of the keys that [`Section::excludes`] beside a key.
    pub(super) fn others(&self, key: &str) -> impl Iterator<Item = &'static str> {
        let names = self.keys.iter().map(|other| other.name);
        names.filter(move |other| self.excludes(key, other))
    }

    /// The keys of a way that must be given in it, and the others.
    pub(super) fn parts(&self, way: Way) -> (Vec<&'static Key>, Vec<&'static Key>) {
        let keys = way.iter().filter_map(|name| self.key(name));
        keys.partition(|key| key.need.is_required())
    }

    /// `travel_mm + intervals_s (+ total_time_s) or profile`.
    pub fn ways_words(&self, ways: &[Way]) -> String {
        let names = |keys: &[&Key], between| {
            let names: Vec<&str> = keys.iter().map(|key| key.name).collect();
            names.join(between)
        };
        let words = |way: &Way| match self.parts(way) {
            (required, optional) if optional.is_empty() => names(&required, " + "),
            (required, optional) if required.is_empty() => names(&optional, " / "),
            (required, optional) => {
                format!("{} (+ {})", names(&required, " + "), names(&optional, ", "))
            }
        };
        either(ways.iter().map(words))
    }

    /// True if the section must be there for every run.
    pub fn is_required(&self) -> bool {
        let always = |key: &Key| key.need == Need::Always;
        let has_always = |way: &Way| self.parts(way).0.into_iter().any(always);
        let alone = |key: &Key| always(key) && self.ways_with(key.name).is_empty();
        self.keys.iter().any(alone) || self.ways.iter().any(|ways| ways.iter().all(has_always))
    }
}

/// One key of the run file.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Name within its section; ends in the unit.
    pub name: &'static str,
    /// Type and range of the value.
    pub kind: Kind,
    /// The string that serves in the place of a number or a time, if one does.
    pub word: Option<&'static str>,
    /// Unit as it is printed; empty where there is none.
    pub unit: &'static str,
    /// When it must be given, and what holds if it is not.
    pub need: Need,
    /// Its meaning, worded so that `the {meaning} must be …` reads well; of a limit,
    /// the figure that it limits.
    pub meaning: &'static str,
    /// The rungs on which it changes anything.
    pub acts: Acts,
    /// Field of the controller's own settings that says it once more, as a path
    /// from [`Axis`](firmware::axis::Axis): the wire cannot read this table.
    pub field: Option<&'static str>,
    /// True if no check of several keys asks for it, so that a value in its
    /// range can be written straight into a case.
    pub(super) alone: bool,
    pub(super) access: Access,
    pub(crate) shown: Shown,
    /// Value that a commented file shows, where there is no default.
    pub example: &'static str,
    /// Remark beside it, in the lines that it takes.
    pub note: &'static [&'static str],
}

/// Place of the value in a case; none if a part is left out of the case.
type Place = fn(&mut Case) -> Option<&mut dyn Stored>;

/// The way of a value into a case and out of it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Access {
    /// Not by the key alone.
    None,
    /// The case has it as a part of a whole that is made elsewhere.
    Part(fn(&Case) -> Option<f64>),
    /// One place has it as it is.
    Place(Place),
    /// One place has the number times this.
    Times(fn(&Case) -> f64, Place),
    /// One place has the number divided by this.
    Per(fn(&Case) -> f64, Place),
    /// The case has the number in yet another way.
    Own(fn(&mut Case, f64), fn(&Case) -> Option<f64>),
}

/// A setting as a report shows it; without a label it does not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shown {
    pub(crate) label: &'static str,
    /// For numbers, from the key's unit to the one that is shown.
    pub(crate) factor: f64,
    /// The unit that is shown, if it is another than the key's.
    pub(crate) unit: Option<&'static str>,
    /// Words for a choice or a switch; one without any is not shown.
    pub(crate) words: &'static [(&'static str, &'static str)],
    /// Text in the place of all that.
    pub(crate) text: Option<fn(&Case) -> Option<String>>,
    /// When it is shown; otherwise wherever it acts, and beyond the paper's law
    /// only if it differs from its default.
    pub(crate) when: Option<fn(&Case) -> bool>,
}

/// The rungs on which a key changes anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// On every rung.
    Everywhere,
    /// On `continuous` alone.
    OnContinuous,
    /// On this rung and those above it.
    From(Law),
    /// On `quantised` and `firmware`; on every rung where this key of the same
    /// section is given.
    FromQuantisedOrWith(&'static str),
}

impl Acts {
    /// True if the key acts on a rung; `is_given` tells of other keys of its
    /// section.
    pub fn on(self, law: Law, is_given: impl Fn(&str) -> bool) -> bool {
        match self {
            Self::Everywhere => true,
            Self::OnContinuous => law == Law::Continuous,
            Self::From(first) => law >= first,
            Self::FromQuantisedOrWith(key) => law >= Law::Quantised || is_given(key),
        }
    }

    /// `firmware`, `quantised, firmware`; `every rung`.
    pub fn words(self) -> String {
        let always = Law::ALL.into_iter().filter(|law| self.on(*law, |_| false));
        let names: Vec<&str> = always.map(Law::name).collect();
        match self {
            Self::Everywhere => "every rung".to_owned(),
            Self::OnContinuous | Self::From(_) => names.join(", "),
            Self::FromQuantisedOrWith(key) => {
                format!("{} (with {key} every rung)", names.join(", "))
            }
        }
    }
}

/// Type and range of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A string, not empty.
    Text,
    /// `true` or `false`.
    Flag,
    /// One of these strings.
    Choice(&'static [&'static str]),
    /// A finite number; integers serve.
    Number(Range),
    /// A whole number within these limits, both included.
    Whole(i64, i64),
    /// A time of the run: a number of seconds that is a whole number of
    /// nanoseconds.
    Time(Range),
    /// The seven durations of the motion, each a finite number of at least 0.
    Intervals,
    /// A list of strings, with a reader of its own.
    Strings,
    /// A table, with a reader of its own.
    Table,
}

/// Range of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// Greater than 0.
    Positive,
    /// At least 0.
    NotNegative,
    /// Within these limits, both included.
    Between(f64, f64),
}

impl Range {
    /// Condition on a number, without its unit.
    fn words(self) -> String {
        match self {
            Self::Any => "a finite number".to_owned(),
            Self::Positive => "greater than 0".to_owned(),
            Self::NotNegative => "at least 0".to_owned(),
            Self::Between(low, high) => {
                format!("from {} to {}", show_number(low), show_number(high))
            }
        }
    }
}

/// When a key must be given, and what holds if it is not; of a quantity with several
/// ways ([`field@Section::ways`]) once its way is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Need {
    /// Required.
    Always,
    /// Required unless `transmission.joint = "rigid"`.
    ElasticJoint,
    /// Required on the rungs that sample: all but `continuous`.
    SampledLaw,
    /// Required with `drive.kind = "current"`, else it may be left out.
    CurrentDrive,
    /// Required unless the drive has an ideal current loop.
    VoltageAtLimit,
    /// May be left out; then nothing takes its place.
    Optional,
    /// May be left out; given only together with the named key of the same
    /// section.
    OnlyWith(&'static str),
    /// A limit of the budget: may be left out; then the figure is not limited.
    Limit,
    /// May be left out; then the stem of the file's name holds.
    FileStem,
    /// May be left out; then this holds.
    Default(Value),
}

impl Need {
    /// True if the key must be given, at least on some rung or with some joint.
    pub fn is_required(self) -> bool {
        matches!(
            self,
            Self::Always | Self::ElasticJoint | Self::SampledLaw | Self::VoltageAtLimit
        )
    }
}

/// Largest time that a run file may give \[s\]: 31 years. 1e18 ns fit well
/// into 64 bits, so no time of a run can overflow the count.
pub const LONGEST_TIME_S: f64 = 1e9;

/// Numbers other than 0 must lie between 1e-50 and 1e50 in magnitude. No axis
/// has others, and with these bounds none of the products and quotients of up
/// to six parameters that the equations form can overflow or vanish.
pub const LARGEST_MAGNITUDE: f64 = 1e50;

/// See [`LARGEST_MAGNITUDE`].
pub const SMALLEST_MAGNITUDE: f64 = 1e-50;

/// Builders of a key, each of which sets one field.
macro_rules! setters {
    ($($(#[$doc:meta])* $name:ident($value:ident: $type:ty): $($field:ident).+ = $set:expr;)+) => {
        impl Key {$(
            $(#[$doc])*
            pub(super) const fn $name(mut self, $value: $type) -> Self {
                self.$($field).+ = $set;
                self
            }
        )+}
    };
}

setters! {
    meaning(words: &'static str): meaning = words;
    word(word: &'static str): word = Some(word);
    or(default: Value): need = Need::Default(default);
    needed(need: Need): need = need;
    acting(acts: Acts): acts = acts;
    access(access: Access): access = access;
    field(path: &'static str): field = Some(path);
    shown(label: &'static str): shown.label = label;
    /// Words of choices; `true` is that of a switch.
    words(words: &'static [(&'static str, &'static str)]): shown.words = words;
    text(text: fn(&Case) -> Option<String>): shown.text = Some(text);
    when(when: fn(&Case) -> bool): shown.when = Some(when);
    /// A remark for the commented file, a line each.
    note(lines: &'static [&'static str]): note = lines;
}

impl Key {
    /// Condition on the value, unit included: `greater than 0 kg m²`.
    pub fn allowed(&self) -> String {
        self.condition(self.unit)
    }

    /// Subject of a sentence: `rotor inertia J_m`.
    pub fn subject(&self) -> &'static str {
        match self.need {
            Need::Limit => "limit",
            _ => self.meaning,
        }
    }

    /// Meaning, unit and range in one line, for lists of keys.
    pub fn description(&self) -> String {
        let unit = match self.kind {
            Kind::Intervals => "",
            _ => self.unit,
        };
        let meaning = self.meaning.trim_end_matches(',');
        let words = [meaning, unit, &self.range_words()];
        let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
        words.join(", ")
    }

    /// Condition on the value, without its unit.
    pub fn range_words(&self) -> String {
        self.condition("")
    }

    /// Condition on the value, with a unit or none.
    fn condition(&self, unit: &str) -> String {
        match self.kind {
            Kind::Text => "a string that is not empty".to_owned(),
            Kind::Flag => "true or false".to_owned(),
            Kind::Choice(choices) => either(choices.iter().map(|c| format!("\"{c}\""))),
            Kind::Number(range) | Kind::Time(range) => {
                let between = match range {
                    _ if unit.is_empty() => "",
                    Range::Any => " of ",
                    _ => " ",
                };
                let word = self.word.map(|word| format!(" or \"{word}\""));
                range.words() + between + unit + &word.unwrap_or_default()
            }
            Kind::Whole(low, high) => format!("a whole number from {low} to {high}"),
            Kind::Intervals => "seven numbers of seconds t1 to t7, each at least 0".to_owned(),
            Kind::Strings => "a list of strings".to_owned(),
            Kind::Table => "a table".to_owned(),
        }
    }

    /// Puts a value that the key allows into a case.
    pub(crate) fn set(&self, case: &mut Case, value: Value) {
        let (place, stored) = match (self.access, value.number()) {
            (Access::Place(place), _) => (place, value),
            (Access::Times(factor, place), Some(number)) => {
                (place, Value::Number(number * factor(case)))
            }
            (Access::Per(divisor, place), Some(number)) => {
                (place, Value::Number(number / divisor(case)))
            }
            (Access::Own(set, _), Some(number)) => return set(case, number),
            _ => return,
        };
        if let Some(place) = place(case) {
            place.store(stored);
        }
    }

    /// The value that a case has, [`None`] where it has none.
    ///
    /// ```
    /// use hil_core::runfile::{self, KeyPath, Value};
    ///
    /// let case = runfile::builtin("paper-2", &["controller.quantiser=dither".to_owned()])?;
    /// let value = |path| KeyPath::find(path).map(|found| found.key.get(&case));
    /// assert_eq!(value("controller.kp"), Ok(Some(Value::Number(3.2))));
    /// assert_eq!(value("controller.quantiser"), Ok(Some(Value::Choice("dither"))));
    /// assert_eq!(value("limits.saturation_s"), Ok(None));
    /// # Ok::<(), runfile::RunFileErrors>(())
    /// ```
    pub fn get(&self, case: &Case) -> Option<Value> {
        // One place serves both ways; the copy is what it is asked for.
        let load = |place: Place| place(&mut case.clone())?.load();
        let held = |place| load(place)?.number();
        let number = match self.access {
            Access::None => None,
            Access::Place(place) => return load(place),
            Access::Times(factor, place) => held(place).map(|held| held / factor(case)),
            Access::Per(divisor, place) => held(place).map(|held| held * divisor(case)),
            Access::Part(get) | Access::Own(_, get) => get(case),
        };
        number.map(Value::Number)
    }

    /// Value that holds if the key is left out.
    pub fn default(&self) -> Option<Value> {
        match self.need {
            Need::Default(value) => Some(value),
            _ => None,
        }
    }

    pub(super) const fn at(self, place: Place) -> Self {
        self.access(Access::Place(place))
    }

    /// For a key that no check asks for together with others.
    pub(super) const fn alone(mut self) -> Self {
        self.alone = true;
        self
    }

    pub(super) const fn alone_at(self, place: Place) -> Self {
        self.at(place).alone()
    }

    /// Its meaning, and its name in reports.
    pub(super) const fn named(self, meaning: &'static str, shown: &'static str) -> Self {
        self.meaning(meaning).shown(shown)
    }

    /// The place of a key that acts on rung `firmware` alone.
    pub(super) const fn firmware_at(self, place: Place) -> Self {
        self.acting(Acts::From(Law::Firmware)).at(place)
    }

    /// Shown in another unit.
    pub(super) const fn shown_in(
        mut self,
        label: &'static str,
        factor: f64,
        unit: &'static str,
    ) -> Self {
        self.shown.factor = factor;
        self.shown.unit = Some(unit);
        self.shown(label)
    }

    /// May be left out; the commented file shows an example then.
    pub(super) const fn optional(self, example: &'static str) -> Self {
        self.needing(Need::Optional, example)
    }

    pub(super) const fn optional_at(self, example: &'static str, place: Place) -> Self {
        self.optional(example).at(place)
    }

    pub(super) const fn or_at(self, default: Value, place: Place) -> Self {
        self.or(default).at(place)
    }

    pub(super) const fn needing(mut self, need: Need, example: &'static str) -> Self {
        self.need = need;
        self.example = example;
        self
    }

    /// True if it is one of those with which an axis goes beyond the paper's
    /// law: they act on rung `firmware` alone.
    pub fn is_of_firmware(&self) -> bool {
        self.acts == Acts::From(Law::Firmware)
    }
}

/// Keys that act on rung `firmware` alone.
pub(super) const fn of_firmware<const N: usize>(mut keys: [Key; N]) -> [Key; N] {
    let mut index = 0;
    while index < N {
        keys[index] = keys[index].acting(Acts::From(Law::Firmware));
        index += 1;
    }
    keys
}

/// A section of keys that are each given in one way.
pub(super) const fn section(
    name: &'static str,
    keys: &'static [Key],
    meaning: &'static str,
) -> Section {
    Section {
        name,
        meaning,
        keys,
        ways: &[],
    }
}

/// A required number.
pub(super) const fn number(name: &'static str, range: Range, unit: &'static str) -> Key {
    value(name, Kind::Number(range), unit)
}

/// A required whole number.
pub(super) const fn whole(name: &'static str, low: i64, high: i64, unit: &'static str) -> Key {
    value(name, Kind::Whole(low, high), unit)
}

/// A required time of the run.
pub(super) const fn time(name: &'static str, range: Range) -> Key {
    value(name, Kind::Time(range), "s")
}

/// A flag that is off unless it is set.
pub(super) const fn flag(name: &'static str) -> Key {
    value(name, Kind::Flag, "").or(Value::Flag(false))
}

/// One of the choices of a setting, the first unless another is given.
pub(super) const fn choice<T: Choices>(name: &'static str) -> Key {
    value(name, Kind::Choice(T::NAMES), "").or(Value::Choice(T::NAMES[0]))
}

/// A required value of any kind.
pub(super) const fn value(name: &'static str, kind: Kind, unit: &'static str) -> Key {
    Key {
        name,
        kind,
        word: None,
        unit,
        need: Need::Always,
        meaning: "",
        acts: Acts::Everywhere,
        field: None,
        alone: false,
        access: Access::None,
        shown: Shown {
            label: "",
            factor: 1.0,
            unit: None,
            words: &[],
            text: None,
            when: None,
        },
        example: "",
        note: &[],
    }
}

/// `a`, `a or b`, `a, b or c`.
pub(super) fn either(words: impl IntoIterator<Item = String>) -> String {
    match words.into_iter().collect::<Vec<_>>().as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// `motor.inertia_kg_m2`, or `name` at the top of the file.
pub(super) fn path(section: &str, key: &str) -> String {
    if section.is_empty() {
        key.to_owned()
    } else {
        format!("{section}.{key}")
    }
}
