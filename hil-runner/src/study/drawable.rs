//! What can be told about a study's pictures before anything is run.

use super::axis::{Axis, Spread};
use super::cell::Column;
use super::definition::Study;
use super::file::{Findings, StudyFileError};
use super::picture::{self, Kind, Map, Table, Values};
use super::plan::PlanKind;
use super::row::columns;
use hil_core::renamed::renamed;

/// What can be known of a picture before anything is run is told then.
pub(super) fn pictures_can_be_drawn(
    study: &Study,
    source_name: &str,
) -> Result<(), StudyFileError> {
    let mut findings = Findings::new(source_name, &study.text);
    let columns = columns(study);
    let mut files: Vec<&str> = Vec::new();
    for picture in &study.pictures {
        let file = picture.file.as_str();
        let known = |name: &&str| columns.iter().any(|column| column.name == *name);
        let wanted = picture.columns();
        for name in wanted.iter().filter(|name| !known(name)) {
            let why = match renamed(name) {
                Some(now) => format!("{name} is now {now}"),
                None => format!("the results of this study have no column {name}"),
            };
            findings.push_whole(format!("picture {file:?}: {why}"));
        }
        if let Kind::Map(map) = &picture.kind
            && let Err(sentence) = map_has_grid(study, map)
        {
            findings.push_whole(format!("picture {file:?}: {sentence}"));
        }
        // With no row at all: what does not fit together does not then either.
        if wanted.iter().all(known)
            && let Err(error) = picture::draw(picture, &empty_table(&columns), &[])
        {
            findings.push_whole(error);
        }
        if files.contains(&file) {
            findings.push_whole(format!("there are two pictures with file = {file:?}"));
        }
        files.push(file);
    }
    findings.into_result()
}

/// A table of these columns without rows.
fn empty_table(columns: &[Column]) -> Table {
    let empty = |column: &Column| picture::Column {
        name: column.name.clone(),
        values: if column.kind.is_number() {
            Values::Number(Vec::new())
        } else {
            Values::Text(Vec::new())
        },
        own: None,
    };
    Table {
        columns: columns.iter().map(empty).collect(),
    }
}

/// Whether the axes of a map make a grid, and one that its borders can be
/// computed over.
///
/// # Errors
/// The sentence that says what is needed.
fn map_has_grid(study: &Study, map: &Map) -> Result<(), String> {
    let axis = |name: &str| study.axes.iter().find(|axis| axis.key.path() == name);
    let places = [axis(&map.x), axis(&map.y)];
    let drawn = |axis: &&Axis| !matches!(axis.spread, Spread::List(_));
    if study.plan_kind != PlanKind::Grid
        && let Some(axis) = places.iter().flatten().copied().find(drawn)
    {
        return Err(format!(
            "a map needs a grid, and plan = {:?} draws {}; kind \"scatter\" can show it",
            study.plan_kind.name(),
            axis.key.path()
        ));
    }
    let ranges = places.map(|axis| {
        axis.is_some_and(|axis| matches!(axis.spread, Spread::Range { .. }) && axis.times.is_none())
    });
    if !map.border.is_empty() && ranges != [true; 2] {
        return Err(
            "a border needs x and y to be axes with from and to, and without times".to_owned(),
        );
    }
    Ok(())
}
