//! A study that was read and found right: from its file to points and cases.

use core::ops::Range;
use std::path::Path;

use toml::Spanned;

use super::axis::{Axis, AxisValue, Chosen, Scale, Spread};
use super::constraint::Constraint;
use super::file::{self, AxisFile, Findings, StudyFile, StudyFileError};
use super::picture::Picture;
use super::plan::{Plan, PlanKind};
use super::ready;
use super::row::columns;
use super::theory::Theory;
use crate::case::{Case, Law};
use crate::runfile::{KeyPath, KeyValue, RunFileErrors, Template, builtin_text};

/// What becomes of the gains where steps of encoder or converter change
/// (`loop_gain`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoopGain {
    /// The gains stay in codes per count: with finer steps the loop changes.
    #[default]
    PerCount,
    /// The gains keep their volts per radian, those of the base with its
    /// `K_enc·K_dac`: only the resolution changes.
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
    /// Further `section.key=value`.
    pub sets: Vec<String>,
}

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
        match ready::text(name_or_path) {
            Some(text) => Self::parse(name_or_path, text, changes),
            None => Self::parse(name_or_path, &file::read(name_or_path)?, changes),
        }
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
        if !is_a_name(&name) {
            findings.push_whole(format!(
                "name = {name:?} is not allowed: the study's name must have letters, digits, - and _ alone"
            ));
        }
        let axes = axes(&file, &mut findings);
        let sets = sets(&file, &axes, changes, &mut findings);
        let base = match &changes.base {
            Some(base) => base.clone(),
            None if builtin_text(file.base.get_ref()).is_some() => file.base.get_ref().clone(),
            None => file::beside(source_name, file.base.get_ref()),
        };
        let rungs = rungs(&file, &base, &sets, &mut findings);
        let constraints = constraints(&file, &axes, &rungs, &mut findings);
        let plan = plan(&file, &axes, &mut findings);
        let required_yield_percent = required_yield(&file, &mut findings);
        if file.differences && rungs.len() == 1 {
            findings.push_whole("differences = true needs at least two rungs to compare");
        }
        times_are_known(&axes, &rungs, &mut findings);
        findings.into_result()?;
        let Some(plan) = plan else {
            return Err(StudyFileError::of(source_name, "has no plan"));
        };
        let study = Self {
            title: file.title.clone().unwrap_or_else(|| name.clone()),
            name,
            description: file.description,
            notes: file.notes,
            base,
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
        if study
            .plan
            .points()
            .checked_mul(study.rungs.len() as u64)
            .is_none()
        {
            return Err(StudyFileError::of(
                source_name,
                super::plan::PlanError::TooMany,
            ));
        }
        pictures_have_columns(&study, source_name)?;
        Ok(study)
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
        // Factors of other keys, which have no factor themselves.
        for (place, axis) in self.axes.iter().enumerate() {
            if let Some(times) = &axis.times {
                let factor = self.number(&values, times).unwrap_or(f64::NAN);
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

    /// The run of a point on rung number `rung`.
    ///
    /// # Errors
    /// What is wrong with the values of the point.
    pub fn case(&self, point: &Point, rung: usize) -> Result<Case, RunFileErrors> {
        let (_, template) = &self.rungs[rung];
        if self.axes.is_empty() {
            return Ok(template.base().clone());
        }
        let keys = self.axes.iter().map(|axis| &axis.key);
        let mut case = template.case(keys.zip(&point.values))?;
        if self.loop_gain == LoopGain::Constant {
            let per_rad = |case: &Case| case.encoder.counts_per_rad * case.dac.step_v;
            let ratio = per_rad(template.base()) / per_rad(&case);
            let gains = &mut case.controller.gains;
            for gain in [&mut gains.kp, &mut gains.ki_per_s, &mut gains.kd_s] {
                *gain *= ratio;
            }
        }
        Ok(case)
    }
}

/// A picture of a column that there is not is told before anything is run.
fn pictures_have_columns(study: &Study, source_name: &str) -> Result<(), StudyFileError> {
    let mut findings = Findings::new(source_name, &study.text);
    let columns = columns(study);
    let mut files: Vec<&str> = Vec::new();
    for picture in &study.pictures {
        let file = picture.file.as_str();
        for name in picture.columns() {
            if !columns.iter().any(|column| column.name == name) {
                findings.push_whole(format!(
                    "picture {file:?}: the results of this study have no column {name}"
                ));
            }
        }
        if files.contains(&file) {
            findings.push_whole(format!("there are two pictures with file = {file:?}"));
        }
        files.push(file);
    }
    findings.into_result()
}

fn name(file: &StudyFile, source_name: &str) -> String {
    file.name.clone().unwrap_or_else(|| {
        let stem = Path::new(source_name).file_stem();
        stem.map_or_else(
            || "study".into(),
            |stem| stem.to_string_lossy().into_owned(),
        )
    })
}

/// A name is also that of a folder.
fn is_a_name(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    !name.is_empty() && name.len() <= 100 && name.chars().all(plain)
}

/// Most values of an axis: more are rather a slip of the keyboard.
const MOST_VALUES: u64 = 1_000_000_000;

fn axes(file: &StudyFile, findings: &mut Findings<'_>) -> Vec<Axis> {
    let mut axes: Vec<Axis> = Vec::new();
    for described in &file.axis {
        let (span, path) = (described.key.span(), described.key.get_ref());
        let mut refuse =
            |sentence: String| findings.push(span.clone(), format!("axis {path}: {sentence}"));
        let key = match KeyPath::find(path) {
            Ok(key) => key,
            Err(sentence) => {
                findings.push(span, sentence);
                continue;
            }
        };
        if matches!(path.as_str(), "name" | "controller.law") || key.section == "budget" {
            refuse(match path.as_str() {
                "controller.law" => {
                    "give the rungs at the top: rungs = [\"sampled\", \"quantised\"]".to_owned()
                }
                _ => "it changes nothing in a run; an axis is over a key that does".to_owned(),
            });
            continue;
        }
        if axes.iter().any(|axis| axis.key.path() == *path) {
            refuse("there is an axis over this key already".to_owned());
            continue;
        }
        let times = match described
            .times
            .as_ref()
            .map(|times| KeyPath::find(times.get_ref()))
        {
            None => None,
            Some(Ok(times)) => Some(times),
            Some(Err(sentence)) => {
                refuse(sentence);
                continue;
            }
        };
        let spread = match spread(described, &key, times.is_some()) {
            Ok(spread) => spread,
            Err(sentence) => {
                refuse(sentence);
                continue;
            }
        };
        let axis = Axis { key, spread, times };
        match axis.check(file.plan) {
            Ok(()) => axes.push(axis),
            Err(sentence) => refuse(sentence),
        }
    }
    axes
}

/// The values of an axis.
///
/// # Errors
/// The sentence that says what is allowed.
fn spread(file: &AxisFile, key: &KeyPath, is_factor: bool) -> Result<Spread, String> {
    let range =
        file.from.is_some() || file.to.is_some() || file.points.is_some() || file.scale.is_some();
    match (&file.values, range, &file.distribution) {
        (Some(values), false, None) => list(values, file.labels.as_deref(), key, is_factor),
        (None, true, None) => {
            let (Some(from), Some(to)) = (file.from, file.to) else {
                return Err("a range needs from and to".to_owned());
            };
            let scale = file.scale.unwrap_or_default();
            if !(from.is_finite() && to.is_finite())
                || (scale == Scale::Log && !(from > 0.0 && to > 0.0))
            {
                return Err(format!(
                    "a range needs finite from and to, on a log scale both greater than 0, not {from} and {to}"
                ));
            }
            let Some(points) = file.points else {
                return Err("a range needs points, the number of its values".to_owned());
            };
            if points == 0 || points > MOST_VALUES || (points > 1 && from == to) {
                return Err(format!(
                    "points = {points} is not allowed: from 1 to {MOST_VALUES}, and more than 1 only where from and to differ"
                ));
            }
            Ok(Spread::Range {
                from,
                to,
                points,
                scale,
            })
        }
        (None, false, Some(distribution)) => {
            distribution.check()?;
            Ok(Spread::Random(*distribution))
        }
        (None, false, None) => Err(
            "it has no values; give values, or from, to and points, or a distribution".to_owned(),
        ),
        _ => Err("give one of values; from, to and points; distribution".to_owned()),
    }
}

fn list(
    values: &Spanned<Vec<toml::Value>>,
    labels: Option<&[String]>,
    key: &KeyPath,
    is_factor: bool,
) -> Result<Spread, String> {
    let values = values.get_ref();
    if values.is_empty() {
        return Err("the list of values is empty; an axis has at least one".to_owned());
    }
    if labels.is_some_and(|labels| labels.len() != values.len()) {
        return Err(format!(
            "labels must be as many as values, {}",
            values.len()
        ));
    }
    let one = |(place, value): (usize, &toml::Value)| {
        let number = match value {
            toml::Value::Integer(whole) => Some(*whole as f64),
            toml::Value::Float(number) => Some(*number),
            _ => None,
        };
        if is_factor && number.is_none() {
            return Err(format!(
                "{value} is no number, and with times every value is one"
            ));
        }
        if number.is_some_and(|number| !number.is_finite()) {
            return Err(format!("{value} is no finite number"));
        }
        if let Some(number) = number
            && labels.is_none()
        {
            // What a range would round is refused in a list: it is meant so.
            let taken = key.value(number).number().unwrap_or(f64::NAN);
            if !is_factor && (taken - number).abs() > 1e-15_f64.max(1e-12 * number.abs()) {
                return Err(format!("{value} is not allowed: {}", key.key.allowed()));
            }
            return Ok(AxisValue::Number(number));
        }
        let label = match (labels.and_then(|labels| labels.get(place)), value) {
            (Some(label), _) => label.clone(),
            (None, toml::Value::String(text)) => text.clone(),
            (None, other) => other.to_string(),
        };
        Ok(AxisValue::Other {
            toml: value.to_string(),
            label,
        })
    };
    let list: Result<Vec<_>, String> = values.iter().enumerate().map(one).collect();
    Ok(Spread::List(list?))
}

/// `section.key=value` of `[set]`, the budget and the command line.
fn sets(
    file: &StudyFile,
    axes: &[Axis],
    changes: &Changes,
    findings: &mut Findings<'_>,
) -> Vec<String> {
    let mut sets = Vec::new();
    for (section, value) in &file.set {
        match value {
            toml::Value::Table(keys) => {
                sets.extend(
                    keys.iter()
                        .map(|(key, value)| format!("{section}.{key}={value}")),
                );
            }
            value => sets.push(format!("{section}={value}")),
        }
    }
    if let Some(budget) = &file.budget {
        let limits: Vec<String> = budget
            .iter()
            .map(|(key, value)| format!("{key}={value}"))
            .collect();
        sets.push(format!("budget={{{}}}", limits.join(", ")));
    }
    sets.extend(changes.sets.iter().cloned());
    for set in &sets {
        let path = set
            .split_once('=')
            .map_or(set.as_str(), |(path, _)| path.trim());
        if axes.iter().any(|axis| axis.key.path() == path) {
            findings.push_whole(format!("{set} would be overridden by the axis over {path}"));
        }
    }
    sets
}

fn rungs(
    file: &StudyFile,
    base: &str,
    sets: &[String],
    findings: &mut Findings<'_>,
) -> Vec<(Law, Template)> {
    let mut load = |sets: &[String], span: Range<usize>| match Template::load(base, sets) {
        Ok(template) => Some(template),
        Err(errors) => {
            for error in errors.entries() {
                findings.push(span.clone(), format!("base: {error}"));
            }
            None
        }
    };
    let Some(names) = &file.rungs else {
        let template = load(sets, file.base.span());
        return template
            .map(|template| (template.base().controller.law, template))
            .into_iter()
            .collect();
    };
    let mut rungs: Vec<(Law, Template)> = Vec::new();
    let (names, span) = (names.get_ref(), names.span());
    let known: Vec<&str> = Law::ALL.iter().map(|law| law.name()).collect();
    let mut wrong = names.is_empty();
    for (place, name) in names.iter().enumerate() {
        let Some(law) = Law::ALL.into_iter().find(|law| law.name() == name) else {
            wrong = true;
            continue;
        };
        wrong |= names[..place].contains(name);
        let mut sets = sets.to_owned();
        sets.push(format!("controller.law={name}"));
        match load(&sets, span.clone()) {
            Some(template) => rungs.push((law, template)),
            // What is wrong with one rung is mostly wrong with all.
            None => break,
        }
    }
    if wrong {
        findings.push(
            span,
            format!(
                "rungs = {names:?} is not allowed: one or more of {}, each once",
                known.join(", ")
            ),
        );
    }
    rungs
}

fn constraints(
    file: &StudyFile,
    axes: &[Axis],
    rungs: &[(Law, Template)],
    findings: &mut Findings<'_>,
) -> Vec<Constraint> {
    let mut constraints = Vec::new();
    for text in &file.constraints {
        let constraint = match Constraint::parse(text.get_ref()) {
            Ok(constraint) => constraint,
            Err(sentence) => {
                findings.push(
                    text.span(),
                    format!("constraint {:?}: {sentence}", text.get_ref()),
                );
                continue;
            }
        };
        for key in constraint.keys() {
            if !has_number(key, axes, rungs) {
                let path = key.path();
                findings.push(
                    text.span(),
                    format!("constraint {:?}: {path} has no number here", text.get_ref()),
                );
            }
        }
        constraints.push(constraint);
    }
    constraints
}

/// Whether a key has a number in every run.
fn has_number(key: &KeyPath, axes: &[Axis], rungs: &[(Law, Template)]) -> bool {
    let path = key.path();
    match axes.iter().find(|axis| axis.key.path() == path) {
        Some(axis) => axis.is_numeric(),
        None => rungs
            .first()
            .is_none_or(|(_, template)| template.number(key).is_some()),
    }
}

fn times_are_known(axes: &[Axis], rungs: &[(Law, Template)], findings: &mut Findings<'_>) {
    for axis in axes {
        let Some(times) = &axis.times else { continue };
        let (key, path) = (axis.key.path(), times.path());
        let other = axes.iter().find(|other| other.key.path() == path);
        if other.is_some_and(|other| other.times.is_some()) {
            findings.push_whole(format!(
                "axis {key}: times = {path:?} is itself an axis with times"
            ));
        } else if !has_number(times, axes, rungs) {
            findings.push_whole(format!("axis {key}: times = {path:?} has no number here"));
        }
    }
}

fn plan(file: &StudyFile, axes: &[Axis], findings: &mut Findings<'_>) -> Option<Plan> {
    let counts: Vec<u64> = axes.iter().map(Axis::count).collect();
    let runs = match (&file.runs, file.plan) {
        (None, PlanKind::Grid) => 0,
        (Some(runs), PlanKind::Grid) => {
            findings.push(
                runs.span(),
                "runs is not allowed: the axes' values decide how many points a grid has",
            );
            return None;
        }
        (None, kind) => {
            findings.push_whole(format!(
                "plan = {:?} needs runs, the number of its points",
                kind.name()
            ));
            return None;
        }
        (Some(runs), _) if *runs.get_ref() == 0 => {
            findings.push(
                runs.span(),
                "runs = 0 is not allowed: a study has at least one run",
            );
            return None;
        }
        (Some(runs), _) => *runs.get_ref(),
    };
    match Plan::new(file.plan, &counts, runs, file.seed) {
        Ok(plan) => Some(plan),
        Err(error) => {
            findings.push_whole(error);
            None
        }
    }
}

fn required_yield(file: &StudyFile, findings: &mut Findings<'_>) -> Option<f64> {
    let asked = file.required_yield_percent.as_ref()?;
    let percent = *asked.get_ref();
    if !(0.0..=100.0).contains(&percent) {
        findings.push(
            asked.span(),
            format!("required_yield_percent = {percent} is not allowed: from 0 to 100"),
        );
    }
    Some(percent)
}
