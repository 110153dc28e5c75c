//! From a study file to what is run at its points: name, keys, rungs,
//! constraints, plan.

use crate::files;
use core::ops::Range;
use std::path::Path;

use toml::Spanned;

use super::axis::Axis;
use super::constraint::Constraint;
use super::definition::Changes;
use super::file::{Findings, StudyFile};
use super::plan::{Plan, PlanKind};
use super::read_axes::has_number;
use hil_core::case::Law;
use hil_core::runfile::{KeyPath, RunFileErrors, Template};

pub(super) fn name(file: &StudyFile, source_name: &str) -> String {
    file.name.clone().unwrap_or_else(|| {
        let stem = Path::new(source_name).file_stem();
        stem.map_or_else(
            || "study".into(),
            |stem| stem.to_string_lossy().into_owned(),
        )
    })
}

/// A name is also that of a folder.
pub(super) fn is_a_name(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    !name.is_empty() && name.len() <= 100 && name.chars().all(plain)
}

/// `section.key=value` of `[set]`, the budget and the command line, which has the
/// last word; but what a study has that is made around its base was made from
/// the command line already.
pub(super) fn sets(
    file: &StudyFile,
    axes: &[Axis],
    changes: &Changes,
    around_base: bool,
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
    let path = |set: &String| -> String {
        let (path, _) = set.split_once('=').unwrap_or((set, ""));
        path.split_whitespace().collect()
    };
    let partner = |path: &str| Some(KeyPath::find(path).ok()?.partner()?.path());
    let over = |path: &str| -> Option<String> {
        let other = partner(path);
        let mut axes = axes.iter().map(|axis| axis.key.path());
        axes.find(|axis| *axis == path || Some(axis) == other.as_ref())
    };
    // Of a pair, too, what comes later takes the place of what was before.
    let (mut earlier, later) = match around_base {
        true => (changes.sets.clone(), sets),
        false => (sets, changes.sets.clone()),
    };
    let replaced: Vec<String> = later.iter().filter_map(|set| partner(&path(set))).collect();
    earlier.retain(|set| !replaced.contains(&path(set)));
    if around_base {
        // The axes have been made from it.
        earlier.retain(|set| over(&path(set)).is_none());
    }
    let sets = [earlier, later].concat();
    for set in &sets {
        let path = path(set);
        if !path.contains('.') && !matches!(path.as_str(), "budget" | "name") {
            findings.push_whole(format!(
                "{set}: a study takes a section's keys one by one, section.key=value"
            ));
        }
        let has_rungs = file.rungs.is_some() && !around_base || changes.rungs.is_some();
        if path == "controller.law" && has_rungs {
            findings.push_whole(format!("{set} would be overridden by rungs"));
        }
        if let Some(axis) = over(&path) {
            findings.push_whole(format!("{set} would be overridden by the axis over {axis}"));
        }
    }
    sets
}

/// The base case with these values, from its path or from the text that
/// `changes` has of it.
///
/// # Errors
/// What is wrong with the base and the values.
pub(super) fn base_with(
    base: &str,
    changes: &Changes,
    sets: &[String],
) -> Result<Template, RunFileErrors> {
    match &changes.base_text {
        Some(text) => Template::parse(base, text, sets),
        None => Template::parse(base, &files::text(base)?, sets),
    }
}

pub(super) fn rungs(
    file: &StudyFile,
    base: &str,
    changes: &Changes,
    sets: &[String],
    findings: &mut Findings<'_>,
) -> Vec<(Law, Template)> {
    let mut load = |sets: &[String], span: Range<usize>| match base_with(base, changes, sets) {
        Ok(template) => Some(template),
        Err(errors) => {
            for error in errors.entries() {
                findings.push(span.clone(), format!("base: {error}"));
            }
            None
        }
    };
    let asked: Option<Vec<&str>> = match (&changes.rungs, &file.rungs) {
        (Some(laws), _) => Some(laws.iter().map(|law| law.name()).collect()),
        (None, names) => names
            .as_ref()
            .map(|names| names.get_ref().iter().map(String::as_str).collect()),
    };
    let Some(names) = asked else {
        let template = load(sets, file.base.span());
        return template
            .map(|template| (template.base().controller.law, template))
            .into_iter()
            .collect();
    };
    let mut rungs: Vec<(Law, Template)> = Vec::new();
    let span = file
        .rungs
        .as_ref()
        .map_or_else(|| file.base.span(), Spanned::span);
    let known: Vec<&str> = Law::ALL.iter().map(|law| law.name()).collect();
    let mut wrong = names.is_empty();
    for (place, name) in names.iter().enumerate() {
        let Some(law) = Law::find(name) else {
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

pub(super) fn constraints(
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

pub(super) fn plan(file: &StudyFile, axes: &[Axis], findings: &mut Findings<'_>) -> Option<Plan> {
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

pub(super) fn required_yield(file: &StudyFile, findings: &mut Findings<'_>) -> Option<f64> {
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
