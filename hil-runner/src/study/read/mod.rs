//! From the text of a study file, or the name of a ready study, to a study.

pub(super) mod axes;
pub(super) mod file;
mod plan;
pub mod ready;

use self::axes::{axes, times_are_known};
use self::file::{Findings, StudyFileError};
use self::plan::{
    base_with, constraints, is_a_name, name, plan, refuse_without_effect, required_yield, rungs,
    sets,
};
use crate::files;
use crate::study::page::pictures::mistakes_in_pictures;
use crate::study::picture::is_text;
use crate::study::plan::points::PlanError;
use crate::study::plan::{Changes, Study};
use hil_core::budget::limits;
use hil_core::runfile::{Template, builtin_text};

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
        let file = file::parse(source_name, text)?;
        let mut findings = Findings::new(source_name, text);
        let name = name(&file, source_name);
        let title = file.title.iter().map(|text| ("title", text));
        let notes = file.notes.iter().map(|text| ("notes", text));
        let texts = title
            .chain([("description", &file.description)])
            .chain(notes);
        for (key, text) in texts.filter(|(_, text)| !is_text(text)) {
            findings.push_whole(format!("{key} = {text:?} has characters that are no text"));
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
            return Err(StudyFileError::of(source_name, PlanError::TooMany));
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
