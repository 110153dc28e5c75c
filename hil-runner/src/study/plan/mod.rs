//! A study that was read and found right: from its file to points and cases.

use super::acting::refuse_without_effect;
use super::axis::{Axis, Chosen};
use super::constraint::Constraint;
use super::drawable::pictures_can_be_drawn;
use super::file::{self, Findings, StudyFileError, is_text};
use super::loop_gain::at_other_steps;
use super::picture::Picture;
use super::plan::{Plan, PlanKind};
use super::read_axes::{axes, times_are_known};
use super::read_plan::{
    base_with, constraints, is_a_name, name, plan, required_yield, rungs, sets,
};
use super::ready;
use super::theory::Theory;
use crate::files;
use hil_core::budget::limits;
use hil_core::case::{Case, Law};
use hil_core::runfile::{KeyPath, KeyValue, RunFileErrors, Template, builtin_text};

/// What becomes of the loop where steps of encoder or converter change
/// (`loop_gain`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoopGain {
    /// Gains stay in codes per count: with finer steps the loop changes.
    #[default]
    PerCount,
    /// Gains, feed-forward and limits keep their volts and radians, those that
    /// they have with the steps of the base: only the resolution changes.
    Constant,
}

/// A study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// Its title.
    pub title: String,
    /// What it asks.
    pub description: String,
    /// What to know before a figure is quoted.
    pub notes: Vec<String>,
    /// Name or path of the base case.
    pub base: String,
    /// The base with the command line's `--set` alone, before what the study
    /// changes.
    pub reference: Template,
    /// Kind of plan.
    pub plan_kind: PlanKind,
    /// The points.
    pub plan: Plan,
    /// Seed of plans that draw.
    pub seed: u64,
    /// The axes.
    pub axes: Vec<Axis>,
    /// Rungs that every point is run on, each with its run file.
    pub rungs: Vec<(Law, Template)>,
    /// Points that do not fulfil these are left out.
    pub constraints: Vec<Constraint>,
    /// What becomes of the gains where encoder or converter change.
    pub loop_gain: LoopGain,
    /// Predictions that stand beside the figures.
    pub theory: Vec<Theory>,
    /// Whether it is found out what feeds a limit cycle.
    pub feeding: bool,
    /// Whether each rung is compared with the one before it, row by row.
    pub differences: bool,
    /// Part of the runs that must pass \[%\].
    pub required_yield_percent: Option<f64>,
    /// Pictures of the results.
    pub pictures: Vec<Picture>,
    /// Text of the study file.
    pub text: String,
    /// Keys that differ from the base in every run, as on a command line.
    pub sets: Vec<String>,
}

/// One point: what every axis has there.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The values, as the axes give them.
    pub chosen: Vec<Chosen>,
    /// The values that the keys take.
    pub values: Vec<KeyValue>,
}

/// What the command line adds to a study.
#[derive(Debug, Clone, Default)]
pub struct Changes {
    /// Another base case than that of the file.
    pub base: Option<String>,
    /// The base's run file, where it is not to be read from its path.
    pub base_text: Option<String>,
    /// Further `section.key=value`.
    pub sets: Vec<String>,
    /// Other rungs than those of the file.
    pub rungs: Option<Vec<Law>>,
}

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
        let base = files::text(name).and_then(|text| Template::parse(name, &text, &changes.sets));
        let base = base.map_err(|errors| {
            let lines: Vec<String> = errors
                .entries()
                .iter()
                .map(|e| format!("base: {e}"))
                .collect();
            refuse(lines.join("\n"))
        })?;
        ready::render(name_or_path, name, &base, changes.rungs.as_deref()).map_err(refuse)
    }

    /// Reads a study from its text; `source_name` stands in messages, its stem
    /// is the default of `name`, and paths in it are relative to its folder.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn parse(source_name: &str, text: &str, changes: &Changes) -> Result<Self, StudyFileError> {
        let file = file::parse(source_name, text)?;
        let mut findings = Findings::new(source_name, text);
        let name = name(&file, source_name);
        let title = file.title.iter().map(|text| ("title", text));
        let notes = file.notes.iter().map(|text| ("notes", text));
        for (key, text) in title
            .chain([("description", &file.description)])
            .chain(notes)
        {
            if !is_text(text) {
                findings.push_whole(format!("{key} = {text:?} has characters that are no text"));
            }
        }
        if !is_a_name(&name) {
            findings.push_whole(format!(
                "name = {name:?} is not allowed: the study's name must have letters, digits, - and _ alone"
            ));
        }
        let axes = axes(&file, &mut findings);
        let around_base = ready::is_ready(source_name);
        let sets = sets(&file, &axes, changes, around_base, &mut findings);
        let base = match &changes.base {
            Some(base) => base.clone(),
            None if builtin_text(file.base.get_ref()).is_some() => file.base.get_ref().clone(),
            None => file::beside(source_name, file.base.get_ref()),
        };
        let rungs = rungs(&file, &base, changes, &sets, &mut findings);
        // A base that only the study's own keys make a run stands for itself.
        let reference = base_with(&base, changes, &changes.sets).ok();
        let reference = reference.or_else(|| Some(rungs.first()?.1.clone()));
        let constraints = constraints(&file, &axes, &rungs, &mut findings);
        let plan = plan(&file, &axes, &mut findings);
        let required_yield_percent = required_yield(&file, &mut findings);
        let asked = changes.rungs.as_ref().map(Vec::len);
        let asked = asked.or(file.rungs.as_ref().map(|names| names.get_ref().len()));
        if file.differences && asked.unwrap_or(1) == 1 {
            findings.push_whole("differences = true needs at least two rungs to compare");
        }
        times_are_known(&axes, &rungs, &mut findings);
        refuse_without_effect(&file, &axes, &rungs, &mut findings);
        findings.into_result()?;
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
            plan_kind: file.plan,
            plan,
            seed: file.seed,
            axes,
            rungs,
            constraints,
            loop_gain: file.loop_gain,
            theory: file.theory,
            feeding: file.feeding,
            differences: file.differences,
            required_yield_percent,
            pictures: file.picture,
            text: text.to_owned(),
            sets,
        };
        let rows = study.plan.points().checked_mul(study.rungs.len() as u64);
        if rows.is_none_or(|rows| rows > MOST_ROWS) {
            return Err(StudyFileError::of(
                source_name,
                super::plan::PlanError::TooMany,
            ));
        }
        pictures_can_be_drawn(&study, source_name)?;
        let limits = study.rungs.first().map(|(_, base)| limits(base.base()).0);
        for picture in &mut study.pictures {
            picture.take_budget(|column| {
                let limits = limits.iter().flatten();
                let mut of_column = limits.filter(|limit| limit.figure == column);
                of_column.next().map(|limit| limit.limit)
            });
        }
        Ok(study)
    }

    /// The run file of the base case; every rung has the same.
    pub fn base_text(&self) -> &str {
        self.rungs.first().map_or("", |(_, base)| base.text())
    }

    /// Rows of the results: points times rungs.
    pub fn rows(&self) -> u64 {
        self.plan.points() * self.rungs.len() as u64
    }

    /// A point, 0 ≤ `number` < points of the plan.
    pub fn point(&self, number: u64) -> Point {
        let chosen: Vec<Chosen> = self
            .axes
            .iter()
            .enumerate()
            .map(|(place, axis)| axis.at(self.plan.position(number, place)))
            .collect();
        let mut values: Vec<KeyValue> = self
            .axes
            .iter()
            .zip(&chosen)
            .map(|(axis, chosen)| chosen.value(&axis.key, None))
            .collect();
        // Factors of what the base has come first: others may be factors of them.
        for of_base in [true, false] {
            for (place, axis) in self.axes.iter().enumerate() {
                let Some(times) = axis.times.filter(|_| axis.is_of_base() == of_base) else {
                    continue;
                };
                let factor = match of_base {
                    true => self.rungs.first().and_then(|(_, base)| base.number(&times)),
                    false => self.number(&values, &times),
                };
                let factor = factor.unwrap_or(f64::NAN);
                values[place] = chosen[place].value(&axis.key, Some(factor));
            }
        }
        Point { chosen, values }
    }

    /// What a key has at a point, where that is a number.
    fn number(&self, values: &[KeyValue], key: &KeyPath) -> Option<f64> {
        let path = key.path();
        match self.axes.iter().position(|axis| axis.key.path() == path) {
            Some(place) => values.get(place)?.number(),
            None => self.rungs.first()?.1.number(key),
        }
    }

    /// The constraint that keeps a point from being run.
    pub fn broken_constraint(&self, point: &Point) -> Option<&Constraint> {
        self.constraints
            .iter()
            .find(|constraint| !constraint.holds(|key| self.number(&point.values, key)))
    }

    /// Every `section.key=value` that makes the base case the run of a point on
    /// rung number `rung`, as a command line would have them.
    pub fn row_sets(&self, point: &Point, rung: usize) -> Vec<String> {
        let mut sets = self.sets.clone();
        sets.push(format!("controller.law={}", self.rungs[rung].0.name()));
        // A point that makes no run has the values of its axes.
        let changes = self.changes(point, rung);
        let changes = changes.unwrap_or_else(|_| self.chosen(point));
        let lines = changes
            .iter()
            .map(|(key, value)| format!("{}={}", key.path(), value.to_toml()));
        sets.extend(lines);
        sets
    }

    /// The run of a point on rung number `rung`.
    ///
    /// # Errors
    /// What is wrong with the values of the point.
    pub fn case(&self, point: &Point, rung: usize) -> Result<Case, RunFileErrors> {
        let (_, template) = &self.rungs[rung];
        let changes = self.changes(point, rung)?;
        if changes.is_empty() {
            return Ok(template.base().clone());
        }
        template.case(changes.iter().map(|(key, value)| (key, value)))
    }

    /// Every key that a point gives another value than its rung's run file:
    /// those of the axes, and what keeps the loop where steps change.
    ///
    /// # Errors
    /// What is wrong with the values of the point.
    pub fn changes(
        &self,
        point: &Point,
        rung: usize,
    ) -> Result<Vec<(KeyPath, KeyValue)>, RunFileErrors> {
        let mut changes = self.chosen(point);
        if self.loop_gain == LoopGain::Constant {
            let (_, template) = &self.rungs[rung];
            let case = template.case(changes.iter().map(|(key, value)| (key, value)))?;
            for (key, value) in at_other_steps(self.reference.base(), &case, template, &changes) {
                changes.retain(|(axis, _)| axis.path() != key.path());
                changes.push((key, value));
            }
        }
        Ok(changes)
    }

    /// The keys of the axes with their values at a point.
    fn chosen(&self, point: &Point) -> Vec<(KeyPath, KeyValue)> {
        let keys = self.axes.iter().map(|axis| axis.key);
        keys.zip(point.values.iter().cloned()).collect()
    }
}
