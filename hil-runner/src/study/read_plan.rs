//! From a study file to what is run at its points: name, keys, rungs,
//! constraints, plan.

use core::ops::Range;
use std::path::Path;

use super::axis::Axis;
use super::constraint::Constraint;
use super::definition::Changes;
use super::file::{Findings, StudyFile};
use super::plan::{Plan, PlanKind};
use super::read_axes::has_number;
use crate::case::Law;
use crate::runfile::Template;

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

/// `section.key=value` of `[set]`, the budget and the command line.
pub(super) fn sets(
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
        let path: String = set
            .split_once('=')
            .map_or(set.as_str(), |(path, _)| path)
            .split_whitespace()
            .collect();
        if path == "controller.law" && file.rungs.is_some() {
            findings.push_whole(format!("{set} would be overridden by rungs"));
        }
        if axes.iter().any(|axis| axis.key.path() == path) {
            findings.push_whole(format!("{set} would be overridden by the axis over {path}"));
        }
    }
    sets
}

pub(super) fn rungs(
    file: &StudyFile,
    base: &str,
    changes: &Changes,
    sets: &[String],
    findings: &mut Findings<'_>,
) -> Vec<(Law, Template)> {
    let mut load = |sets: &[String], span: Range<usize>| {
        let template = match &changes.base_text {
            Some(text) => Template::parse(base, text, sets),
            None => Template::load(base, sets),
        };
        match template {
            Ok(template) => Some(template),
            Err(errors) => {
                for error in errors.entries() {
                    findings.push(span.clone(), format!("base: {error}"));
                }
                None
            }
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
