//! From the text of a study file, or the name of a ready study, to a study.

mod axes;
pub(super) mod file;
pub mod ready;
pub(super) mod schema;

use core::ops::Range;
use std::path::Path;

use toml::Spanned;

use self::file::{Findings, StudyFile, StudyFileError};
use crate::files;
use crate::study::page::pictures::mistakes_in_pictures;
use crate::study::picture::{is_stem, is_text};
use crate::study::plan::axis::Axis;
use crate::study::plan::points::{Constraint, Plan, PlanKind, TOO_MANY};
use crate::study::plan::{Changes, Study};
use hil_core::budget::limits;
use hil_core::case::Law;
use hil_core::runfile::{Acts, Key, KeyPath, Place, RunFileErrors, Template, builtin_text};

/// Rows of a study at most: their numbers are exact as floats.
const MOST_ROWS: u64 = 1 << 53;

impl Study {
    /// Reads a ready study or a file.
    ///
    /// # Errors
    /// Everything that is wrong with the study or its base.
    ///
    /// ```
    /// use hil_runner::study::{Changes, Study};
    ///
    /// let study = Study::load("backlash", &Changes::default())?;
    /// assert!(study.rows() > 0);
    /// let case = study.case(&study.point(0), 0)?;
    /// assert!(study.rungs.iter().any(|(law, _)| *law == case.controller.law));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn load(name_or_path: &str, changes: &Changes) -> Result<Self, StudyFileError> {
        Self::parse(name_or_path, &Self::text(name_or_path, changes)?, changes)
    }

    /// The study file of a ready study, rendered over its base, or that of a
    /// file.
    ///
    /// # Errors
    /// If there is none, or the ready study cannot be made of the base.
    pub fn text(name_or_path: &str, changes: &Changes) -> Result<String, StudyFileError> {
        if !ready::is_ready(name_or_path) {
            return file::read(name_or_path);
        }
        let refuse = |why: String| StudyFileError::of(name_or_path, why);
        let name = changes.base.as_deref().unwrap_or(ready::BASE);
        let base = files::text(name)
            .and_then(|text| Template::parse(name, &text, &changes.sets, files::profile));
        let base = base.map_err(|errors| {
            let lines = errors.entries().iter().map(|e| format!("base: {e}"));
            refuse(lines.collect::<Vec<_>>().join("\n"))
        })?;
        ready::render(name_or_path, name, &base, changes.rungs.as_deref()).map_err(refuse)
    }

    /// Reads a study from its text; `source_name` stands in messages, its stem
    /// is the default of `name`, and paths in it are relative to its folder.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn parse(source_name: &str, text: &str, changes: &Changes) -> Result<Self, StudyFileError> {
        let mut reading = Reading {
            file: file::parse(source_name, text)?,
            changes,
            axes: Vec::new(),
            sets: Vec::new(),
            rungs: Vec::new(),
            findings: Findings::new(source_name, text),
        };
        let name = reading.name(source_name);
        reading.refuse_what_is_no_text();
        reading.axes = axes::axes(&reading.file, &mut reading.findings);
        reading.sets = reading.sets(ready::is_ready(source_name));
        let own = reading.file.base.get_ref();
        let base = match &changes.base {
            Some(base) => base.clone(),
            None if builtin_text(own).is_some() => own.clone(),
            None => file::beside(source_name, own),
        };
        let reference = base_with(&base, changes, &changes.sets).ok();
        reading.rungs = reading.rungs(&base, reference.as_ref());
        // A base that only the study's own keys make a run stands for itself.
        let reference = reference.or_else(|| Some(reading.rungs.first()?.1.clone()));
        let constraints = reading.constraints();
        let plan = reading.plan();
        reading.refuse_other_yields();
        reading.refuse_unknown_times();
        reading.refuse_without_effect();
        reading.findings.into_result()?;
        let file = reading.file;
        let (Some(plan), Some(reference)) = (plan, reference) else {
            return Err(StudyFileError::of(source_name, "has no plan"));
        };
        let mut study = Self {
            title: file.title.clone().unwrap_or_else(|| name.clone()),
            name,
            description: file.description,
            notes: file.notes,
            base,
            reference,
            plan,
            axes: reading.axes,
            rungs: reading.rungs,
            constraints,
            loop_gain: file.loop_gain,
            theory: file.theory,
            feeding: file.feeding,
            differences: file.differences,
            required_yield_percent: file.required_yield_percent.map(Spanned::into_inner),
            pictures: file.picture,
            text: text.to_owned(),
            sets: reading.sets,
        };
        let rows = study.plan.points().checked_mul(study.rungs.len() as u64);
        if rows.is_none_or(|rows| rows > MOST_ROWS) {
            return Err(StudyFileError::of(source_name, TOO_MANY));
        }
        let mut findings = Findings::new(source_name, text);
        for sentence in mistakes_in_pictures(&study) {
            findings.push_whole(sentence);
        }
        findings.into_result()?;
        let (limits, _) = limits(study.template().base());
        for picture in &mut study.pictures {
            picture.take_budget(|column| {
                let of_column = limits.iter().find(|limit| limit.figure == column);
                of_column.map(|limit| limit.limit)
            });
        }
        Ok(study)
    }
}

/// A study file, and what has been made of it so far.
#[derive(Debug)]
struct Reading<'t> {
    file: StudyFile,
    changes: &'t Changes,
    axes: Vec<Axis>,
    /// Keys that differ from the base in every run, as on a command line.
    sets: Vec<String>,
    /// Each with its run file; they differ in their law alone.
    rungs: Vec<(Law, Template)>,
    findings: Findings<'t>,
}

impl Reading<'_> {
    /// The name of the study, which is also that of a folder.
    fn name(&mut self, source_name: &str) -> String {
        let stem = Path::new(source_name).file_stem();
        let stem = stem.unwrap_or("study".as_ref());
        let name = self.file.name.clone();
        let name = name.unwrap_or_else(|| stem.to_string_lossy().into_owned());
        if !is_stem(&name) {
            self.findings.push_whole(format!(
                "name = {name:?} is not allowed: the study's name must have letters, digits, - and _ alone"
            ));
        }
        name
    }

    fn refuse_what_is_no_text(&mut self) {
        let title = self.file.title.iter().map(|text| ("title", text));
        let notes = self.file.notes.iter().map(|text| ("notes", text));
        let texts = title
            .chain([("description", &self.file.description)])
            .chain(notes);
        for (key, text) in texts.filter(|(_, text)| !is_text(text)) {
            let words = format!("{key} = {text:?} has characters that are no text");
            self.findings.push_whole(words);
        }
    }

    /// `section.key=value` of `[set]`, the budget and the command line, which has the
    /// last word; but what a study has that is made around its base was made from
    /// the command line already.
    fn sets(&mut self, around_base: bool) -> Vec<String> {
        let mut sets = Vec::new();
        for (section, value) in &self.file.set {
            let Some(keys) = value.as_table() else {
                sets.push(format!("{section}={value}"));
                continue;
            };
            let keys = keys.iter();
            sets.extend(keys.map(|(key, value)| format!("{section}.{key}={value}")));
        }
        if let Some(budget) = &self.file.budget {
            let limits = budget.iter().map(|(key, value)| format!("{key}={value}"));
            let limits: Vec<String> = limits.collect();
            sets.push(format!("budget={{{}}}", limits.join(", ")));
        }
        let path = |set: &String| -> String {
            let (path, _) = set.split_once('=').unwrap_or((set, ""));
            path.split_whitespace().collect()
        };
        let over = |path: &str| -> Option<String> {
            let known = KeyPath::find(path).ok();
            let excludes = |axis: &KeyPath| known.is_some_and(|key| key.excludes(axis));
            let mut axes = self.axes.iter().map(|axis| &axis.key);
            let axis = axes.find(|axis| axis.path() == path || excludes(axis))?;
            Some(axis.path())
        };
        // In another way, too, what comes later takes the place of what was before.
        let (mut earlier, later) = match around_base {
            true => (self.changes.sets.clone(), sets),
            false => (sets, self.changes.sets.clone()),
        };
        let known = |set: &String| KeyPath::find(&path(set)).ok();
        let later_keys: Vec<KeyPath> = later.iter().filter_map(known).collect();
        earlier.retain(|set| {
            let is_replaced = |key: KeyPath| later_keys.iter().any(|later| key.excludes(later));
            !known(set).is_some_and(is_replaced)
        });
        if around_base {
            // The axes have been made from it.
            earlier.retain(|set| over(&path(set)).is_none());
        }
        let sets = [earlier, later].concat();
        for set in &sets {
            let path = path(set);
            if !path.contains('.') && !matches!(path.as_str(), "budget" | "name" | "template") {
                self.findings.push_whole(format!(
                    "{set}: a study takes a section's keys one by one, section.key=value"
                ));
            }
            let has_rungs =
                self.file.rungs.is_some() && !around_base || self.changes.rungs.is_some();
            let rungs = (path == "controller.law" && has_rungs).then(|| "rungs".to_owned());
            let axis = over(&path).map(|axis| format!("the axis over {axis}"));
            for other in rungs.into_iter().chain(axis) {
                let words = format!("{set} would be overridden by {other}");
                self.findings.push_whole(words);
            }
        }
        sets
    }

    /// The base's own numbers for the keys of axes that belong to another way of several
    /// keys than the base takes: with the sets of the study they make the new way whole.
    fn begun_ways(&self, reference: &Template) -> Vec<String> {
        let begins = |key: &&KeyPath| {
            key.key.need.is_required()
                && key.ways().iter().any(|way| way.len() > 1)
                && !reference.is_given(key.section, key.key.name)
        };
        let keys = self.axes.iter().map(|axis| &axis.key).filter(begins);
        let own = keys.filter_map(|key| Some((key, reference.own_number(key)?)));
        own.map(|(key, number)| format!("{}={number:?}", key.path()))
            .collect()
    }

    /// The rungs that the command line or the file asks for, or that of the base.
    fn rungs(&mut self, base: &str, reference: Option<&Template>) -> Vec<(Law, Template)> {
        let begun = reference.map_or(Vec::new(), |reference| self.begun_ways(reference));
        let (file, changes, findings) = (&self.file, self.changes, &mut self.findings);
        let asked: Option<Vec<&str>> = match (&changes.rungs, &file.rungs) {
            (Some(laws), _) => Some(laws.iter().map(|law| law.name()).collect()),
            (None, Some(names)) => Some(names.get_ref().iter().map(String::as_str).collect()),
            (None, None) => None,
        };
        if file.differences && asked.as_ref().map_or(1, Vec::len) == 1 {
            findings.push_whole("differences = true needs at least two rungs to compare");
        }
        let mut load = |sets: &[String], law: Range<usize>| {
            let errors = match base_with(base, changes, &[&begun, sets].concat()) {
                Ok(template) => return Some(template),
                Err(errors) => errors,
            };
            for error in errors.entries() {
                match &error.place {
                    Place::Set(set) if changes.sets.contains(set) => findings.push_whole(error),
                    Place::Set(set) => {
                        let place = findings.place_of(set, &error.problem.to_string());
                        findings.push(place.unwrap_or(law.clone()), &error.problem);
                    }
                    _ => findings.push(file.base.span(), format!("base: {error}")),
                }
            }
            None
        };
        let Some(names) = asked else {
            let own = load(&self.sets, file.base.span());
            return Vec::from_iter(own.map(|own| (own.base().controller.law, own)));
        };
        let mut rungs: Vec<(Law, Template)> = Vec::new();
        let span = file.rungs.as_ref().map(Spanned::span);
        let span = span.unwrap_or_else(|| file.base.span());
        let mut wrong = names.is_empty();
        for (place, name) in names.iter().enumerate() {
            let Some(law) = Law::find(name) else {
                wrong = true;
                continue;
            };
            wrong |= names[..place].contains(name);
            let mut sets = self.sets.clone();
            sets.push(format!("controller.law={name}"));
            match load(&sets, span.clone()) {
                Some(template) => rungs.push((law, template)),
                // What is wrong with one rung is mostly wrong with all.
                None => break,
            }
        }
        if wrong {
            let known = Law::ALL.map(Law::name).join(", ");
            let words =
                format!("rungs = {names:?} is not allowed: one or more of {known}, each once");
            findings.push(span, words);
        }
        rungs
    }

    fn constraints(&mut self) -> Vec<Constraint> {
        let mut constraints = Vec::new();
        for text in &self.file.constraints {
            let mut refuse = |words: String| {
                let words = format!("constraint {:?}: {words}", text.get_ref());
                self.findings.push(text.span(), words);
            };
            match Constraint::parse(text.get_ref()) {
                Ok(constraint) => {
                    let known = |key: &&KeyPath| has_number(key, &self.axes, &self.rungs);
                    for key in constraint.keys().filter(|key| !known(key)) {
                        refuse(format!("{} has no number here", key.path()));
                    }
                    constraints.push(constraint);
                }
                Err(sentence) => refuse(sentence),
            }
        }
        constraints
    }

    fn plan(&mut self) -> Option<Plan> {
        let (file, findings) = (&self.file, &mut self.findings);
        let counts: Vec<u64> = self.axes.iter().map(Axis::count).collect();
        let runs = file.runs.as_ref().map(|runs| *runs.get_ref());
        let plan = match (runs, file.plan) {
            (Some(_), PlanKind::Grid) => Err(
                "runs is not allowed: the axes' values decide how many points a grid has"
                    .to_owned(),
            ),
            (None, kind) if kind != PlanKind::Grid => Err(format!(
                "plan = {:?} needs runs, the number of its points",
                kind.name()
            )),
            (Some(0), _) => Err("runs = 0 is not allowed: a study has at least one run".to_owned()),
            (runs, kind) => Plan::new(kind, &counts, runs.unwrap_or(0), file.seed),
        };
        let refuse = |sentence: String| match &file.runs {
            Some(runs) if sentence.starts_with("runs") => findings.push(runs.span(), sentence),
            _ => findings.push_whole(sentence),
        };
        plan.map_err(refuse).ok()
    }

    fn refuse_other_yields(&mut self) {
        if let Some(asked) = &self.file.required_yield_percent
            && !(0.0..=100.0).contains(asked.get_ref())
        {
            let percent = asked.get_ref();
            let words = format!("required_yield_percent = {percent} is not allowed: from 0 to 100");
            self.findings.push(asked.span(), words);
        }
    }

    /// Refuses axes with times of a key that has no number of its own.
    fn refuse_unknown_times(&mut self) {
        let (rungs, axes, findings) = (&self.rungs, &self.axes, &mut self.findings);
        for axis in axes {
            let Some(times) = &axis.times else { continue };
            let (key, path) = (axis.key.path(), times.path());
            let other = axes.iter().find(|other| other.key.path() == path);
            let is_factor = |other: &Axis| other.times.is_some() && !other.is_of_base();
            let has_own = |(_, base): &(Law, Template)| base.own_number(times).is_some();
            let has_number = match axis.is_of_base() {
                true => rungs.first().is_none_or(has_own),
                false => has_number(times, axes, rungs),
            };
            let what = match has_number {
                _ if !axis.is_of_base() && other.is_some_and(is_factor) => {
                    "is itself an axis with times"
                }
                false => "has no number here",
                true => continue,
            };
            findings.push_whole(format!("axis {key}: times = {path:?} {what}"));
        }
    }

    /// Refuses axes over keys, and values for keys, that act on no rung.
    fn refuse_without_effect(&mut self) {
        let (rungs, axes, findings) = (&self.rungs, &self.axes, &mut self.findings);
        let Some((_, template)) = rungs.first() else {
            return;
        };
        let acts = |section: &str, key: &Key| {
            let is_given = |other: &str| {
                let of_axis =
                    |axis: &Axis| (axis.key.section, axis.key.key.name) == (section, other);
                template.is_given(section, other) || axes.iter().any(of_axis)
            };
            rungs.iter().any(|(law, _)| key.acts.on(*law, is_given))
        };
        for KeyPath { section, key, .. } in axes.iter().map(|axis| &axis.key) {
            let path = format!("{section}.{}", key.name);
            let mut described = self.file.axis.iter().map(|axis| &axis.key);
            if !acts(section, key)
                && let Some(described) = described.find(|key| *key.get_ref() == path)
            {
                let why = changes_nothing(key.acts, rungs);
                findings.push(described.span(), format!("axis {path}: it {why}"));
            }
        }
        for (section, key, text) in template.overridden() {
            if !acts(section, key) {
                let why = changes_nothing(key.acts, rungs);
                let name = key.name;
                findings.push_whole(format!("{section}.{name} = {text} {why}; or leave it out"));
            }
        }
    }
}

/// The base case with these values, from its path or from the text that
/// `changes` has of it.
///
/// # Errors
/// Mistakes in the base and the values.
fn base_with(base: &str, changes: &Changes, sets: &[String]) -> Result<Template, RunFileErrors> {
    match &changes.base_text {
        Some(text) => Template::parse(base, text, sets, files::profile),
        None => Template::parse(base, &files::text(base)?, sets, files::profile),
    }
}

/// True if a key has a number in every run.
fn has_number(key: &KeyPath, axes: &[Axis], rungs: &[(Law, Template)]) -> bool {
    let path = key.path();
    match axes.iter().find(|axis| axis.key.path() == path) {
        Some(axis) => axis.is_numeric(),
        // An axis that gives the same in another way takes its place.
        None if axes.iter().any(|axis| key.excludes(&axis.key)) => false,
        None => rungs
            .first()
            .is_none_or(|(_, template)| template.number(key).is_some()),
    }
}

/// The reason that a key has no place in a study on these rungs, and what to do.
fn changes_nothing(acts: Acts, rungs: &[(Law, Template)]) -> String {
    let names: Vec<&str> = rungs.iter().map(|(law, _)| law.name()).collect();
    let noun = if names.len() == 1 { "rung" } else { "rungs" };
    let first = Law::ALL.into_iter().find(|law| acts.on(*law, |_| false));
    let first = first.map_or("", Law::name);
    format!(
        "changes nothing on {noun} {} of this study: it acts on {}; add rungs = [\"{first}\"] or give \
         --rungs {first}",
        names.join(", "),
        acts.words()
    )
}
