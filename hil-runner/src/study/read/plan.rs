//! From a study file to what is run at its points: name, keys, rungs,
//! constraints, plan.

use crate::files;
use core::ops::Range;
use std::path::Path;

use toml::Spanned;

use super::axes::has_number;
use super::file::{Findings, StudyFile};
use crate::study::plan::Changes;
use crate::study::plan::axis::Axis;
use crate::study::plan::points::{Constraint, Plan, PlanKind};
use hil_core::case::Law;
use hil_core::runfile::{Acts, Key, KeyPath, RunFileErrors, Template};

pub(super) fn name(file: &StudyFile, source_name: &str) -> String {
    let stem = Path::new(source_name)
        .file_stem()
        .unwrap_or("study".as_ref());
    let name = file.name.clone();
    name.unwrap_or_else(|| stem.to_string_lossy().into_owned())
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
        let Some(keys) = value.as_table() else {
            sets.push(format!("{section}={value}"));
            continue;
        };
        let keys = keys.iter();
        sets.extend(keys.map(|(key, value)| format!("{section}.{key}={value}")));
    }
    if let Some(budget) = &file.budget {
        let limits = budget.iter().map(|(key, value)| format!("{key}={value}"));
        let limits: Vec<String> = limits.collect();
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
/// Mistakes in the base and the values.
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
    let of_file = file.rungs.as_ref().map(|names| names.get_ref().iter());
    let of_file = of_file.map(|names| names.map(String::as_str).collect());
    let of_changes = changes.rungs.as_ref().map(|laws| laws.iter());
    let asked: Option<Vec<&str>> = of_changes
        .map(|laws| laws.map(|law| law.name()).collect())
        .or(of_file);
    let Some(names) = asked else {
        let own = load(sets, file.base.span());
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
        let mut sets = sets.to_owned();
        sets.push(format!("controller.law={name}"));
        match load(&sets, span.clone()) {
            Some(template) => rungs.push((law, template)),
            // What is wrong with one rung is mostly wrong with all.
            None => break,
        }
    }
    if wrong {
        let known = Law::ALL.map(Law::name).join(", ");
        let words = format!("rungs = {names:?} is not allowed: one or more of {known}, each once");
        findings.push(span, words);
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
        let mut refuse = |words: String| {
            let words = format!("constraint {:?}: {words}", text.get_ref());
            findings.push(text.span(), words);
        };
        match Constraint::parse(text.get_ref()) {
            Ok(constraint) => {
                for key in constraint
                    .keys()
                    .filter(|key| !has_number(key, axes, rungs))
                {
                    refuse(format!("{} has no number here", key.path()));
                }
                constraints.push(constraint);
            }
            Err(sentence) => refuse(sentence),
        }
    }
    constraints
}

pub(super) fn plan(file: &StudyFile, axes: &[Axis], findings: &mut Findings<'_>) -> Option<Plan> {
    let counts: Vec<u64> = axes.iter().map(Axis::count).collect();
    let runs = file.runs.as_ref().map(|runs| *runs.get_ref());
    let refused = match (runs, file.plan) {
        (Some(_), PlanKind::Grid) => Some(
            "runs is not allowed: the axes' values decide how many points a grid has".to_owned(),
        ),
        (None, kind) if kind != PlanKind::Grid => Some(format!(
            "plan = {:?} needs runs, the number of its points",
            kind.name()
        )),
        (Some(0), _) => Some("runs = 0 is not allowed: a study has at least one run".to_owned()),
        _ => None,
    };
    let plan = match refused {
        Some(sentence) => Err(sentence),
        None => Plan::new(file.plan, &counts, runs.unwrap_or(0), file.seed)
            .map_err(|error| error.to_string()),
    };
    let refuse = |sentence: String| match &file.runs {
        Some(runs) if sentence.starts_with("runs") => findings.push(runs.span(), sentence),
        _ => findings.push_whole(sentence),
    };
    plan.map_err(refuse).ok()
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

/// Refuses axes over keys, and values for keys, that act on no rung.
pub(super) fn refuse_without_effect(
    file: &StudyFile,
    axes: &[Axis],
    rungs: &[(Law, Template)],
    findings: &mut Findings<'_>,
) {
    // They differ in their law alone.
    let Some((_, template)) = rungs.first() else {
        return;
    };
    let acts = |section: &str, key: &Key| {
        let is_given = |other: &str| {
            let of_axis = |axis: &Axis| (axis.key.section, axis.key.key.name) == (section, other);
            template.is_given(section, other) || axes.iter().any(of_axis)
        };
        rungs.iter().any(|(law, _)| key.acts.on(*law, is_given))
    };
    for KeyPath { section, key, .. } in axes.iter().map(|axis| &axis.key) {
        let path = format!("{section}.{}", key.name);
        let mut described = file.axis.iter().map(|axis| &axis.key);
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

/// The reason that a key has no place in a study on these rungs, and what to do.
fn changes_nothing(acts: Acts, rungs: &[(Law, Template)]) -> String {
    let names: Vec<&str> = rungs.iter().map(|(law, _)| law.name()).collect();
    let noun = if names.len() == 1 { "rung" } else { "rungs" };
    let mut laws = Law::ALL.into_iter();
    let first = laws
        .find(|law| acts.on(*law, |_| false))
        .map_or("", Law::name);
    format!(
        "changes nothing on {noun} {} of this study: it acts on {}; add rungs = [\"{first}\"] or give \
         --rungs {first}",
        names.join(", "),
        acts.words()
    )
}
