//! Run files to make an axis of one's own from (`hil-runner init --template`), and which
//! of their values a run file still has.
//!
//! A file names its template by the key `template`. A value is the template's while the
//! file writes it as the template does; one that is right by chance is written in
//! another way, `0.170` for `0.17`.

use std::sync::LazyLock;

use super::check::{self, Values};
use super::errors::{Findings, Place};
use super::keys::{Key, Kind, path};
use super::tree;
use super::values::Choices;
use crate::case::{AxisTemplate, Case};

/// The run files, in the order of [`AxisTemplate`].
const TEXTS: [&str; 4] = [
    include_str!("../../../../cases/templates/ballscrew.toml"),
    include_str!("../../../../cases/templates/belt.toml"),
    include_str!("../../../../cases/templates/rack.toml"),
    include_str!("../../../../cases/templates/gearbox.toml"),
];

/// Names of the templates.
pub fn template_names() -> impl Iterator<Item = &'static str> {
    AxisTemplate::NAMES.iter().copied()
}

/// The run file of a template.
///
/// ```
/// use hil_core::runfile::template_text;
///
/// assert!(template_text("belt").is_some_and(|text| text.contains("mass_kg = 8.0")));
/// assert!(template_text("hydraulics").is_none());
/// ```
pub fn template_text(name: &str) -> Option<&'static str> {
    let mut texts = template_names().zip(TEXTS);
    let (_, text) = texts.find(|(known, _)| *known == name)?;
    Some(text)
}

/// Paths of the values of every template, and how it writes them.
static OWN: LazyLock<Vec<Vec<(String, String)>>> = LazyLock::new(|| {
    let of = |text: &&str| {
        let tree = tree::parse_document(text).unwrap_or_default();
        let values = check::check(&tree, &mut Findings::new("template"));
        written(&values).collect()
    };
    TEXTS.iter().map(of).collect()
});

/// Paths of the values of a file that describe an axis, and how it writes them: numbers,
/// but for those of `[run]`.
fn written(values: &Values) -> impl Iterator<Item = (String, String)> {
    let describes = |section: &str, key: &Key| {
        use Kind::{Choice, Flag, Strings, Table, Text};
        let is_other = matches!(key.kind, Text | Flag | Choice(_) | Strings | Table);
        !is_other && section != "run"
    };
    let given = values.given();
    given.filter_map(move |(section, key, entry)| {
        let in_file = matches!(entry.place, Some(Place::Line(_)));
        (in_file && describes(section, key)).then(|| (path(section, key.name), entry.text.clone()))
    })
}

/// The values of a template.
fn own(template: AxisTemplate) -> &'static [(String, String)] {
    let own = OWN.get(template as usize);
    own.map_or(&[], Vec::as_slice)
}

/// Paths of the values that a file still has from its template.
pub(super) fn unchanged(template: Option<AxisTemplate>, values: &Values) -> Vec<String> {
    let own = template.map_or(&[][..], own);
    let unchanged = written(values).filter(|value| own.contains(value));
    unchanged.map(|(path, _)| path).collect()
}

fn section_of(path: &str) -> &str {
    path.split_once('.').map_or("", |(section, _)| section)
}

/// The sentence about the values that a case still has from its template; none where it
/// has none.
pub fn values_of_template(case: &Case) -> Option<String> {
    let template = case.template?;
    let values = &case.template_values;
    let sections = values.chunk_by(|path, next| section_of(path) == section_of(next));
    let words = sections.map(|paths| {
        let section = paths.first().map_or("", |path| section_of(path));
        let names = paths.iter().filter_map(|path| path.split_once('.'));
        let names: Vec<&str> = names.map(|(_, name)| name).collect();
        let all = own(template).iter();
        let all = all.filter(|(path, _)| section_of(path) == section);
        match names.len() == all.count() {
            true => format!("[{section}] all"),
            false => format!("[{section}] {}", names.join(", ")),
        }
    });
    let words = words.collect::<Vec<String>>().join("; ");
    let name = AxisTemplate::NAMES.get(template as usize)?;
    let sentence = format!("values of template {name}, not of an axis of your own: {words}");
    (!values.is_empty()).then_some(sentence)
}
