//! Keys that change nothing on the rungs of a study: an axis over one, or a
//! value for one, is refused; what the base has of them is told.

use super::axis::Axis;
use super::definition::Study;
use super::file::{Findings, StudyFile};
use hil_core::case::Law;
use hil_core::case_run::rungs_leave_out;
use hil_core::runfile::{Acts, Key, Template};

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
    for axis in axes
        .iter()
        .filter(|axis| !acts(axis.key.section, axis.key.key))
    {
        let path = axis.key.path();
        let why = changes_nothing(axis.key.key.acts, rungs);
        if let Some(described) = file.axis.iter().find(|a| *a.key.get_ref() == path) {
            findings.push(described.key.span(), format!("axis {path}: it {why}"));
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

/// Why a key has no place in a study on these rungs, and what to do.
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

impl Study {
    /// The sentence about the keys beyond the paper's law that the base or an
    /// axis sets and some of the rungs leave out.
    pub fn keys_without_effect(&self) -> Option<String> {
        let leaving = self.rungs.iter().filter(|(law, _)| *law != Law::Firmware);
        let laws: Vec<Law> = leaving.clone().map(|(law, _)| *law).collect();
        let (_, template) = leaving.clone().next()?;
        let mut keys = template.base().keys_without_effect.clone();
        let of_axes = self
            .axes
            .iter()
            .filter(|axis| axis.key.key.is_of_firmware());
        for path in of_axes.map(|axis| axis.key.path()) {
            if !keys.contains(&path) {
                keys.push(path);
            }
        }
        rungs_leave_out(&laws, &keys)
    }
}
