//! The pictures of a study from its results.

use std::path::Path;

use super::base::own_number;
use super::border::borders;
use super::cell::{Cell, Column};
use super::definition::Study;
use super::picture::{self, Curve, Kind, Picture, PictureError, Table, Values};
use super::results::{ResultsError, for_each_row};
use hil_core::runfile::KeyPath;

/// Rows that pictures show: the first ones. Of a plan that draws, these are
/// drawn like all others.
pub const MOST_ROWS: u64 = 100_000;

/// A picture that has been drawn.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// What it was asked to be.
    pub picture: Picture,
    /// The picture, or why there is none.
    pub svg: Result<String, PictureError>,
}

/// Draws the pictures of a study whose results lie in a folder.
///
/// # Errors
/// If the results cannot be read.
pub fn draw(study: &Study, folder: &Path, columns: &[Column]) -> Result<Vec<Drawn>, ResultsError> {
    if study.pictures.is_empty() {
        return Ok(Vec::new());
    }
    let table = table(study, folder, columns)?;
    let drawn = study.pictures.iter().map(|picture| Drawn {
        picture: picture.clone(),
        svg: picture::draw(picture, &table, &curves(study, picture)),
    });
    Ok(drawn.collect())
}

fn curves(study: &Study, picture: &Picture) -> Vec<Curve> {
    match &picture.kind {
        Kind::Map(map) if !map.border.is_empty() => borders(study, &map.x, &map.y, &map.border),
        _ => Vec::new(),
    }
}

/// The columns that any of the pictures needs, and those that every picture
/// may look at.
fn table(study: &Study, folder: &Path, columns: &[Column]) -> Result<Table, ResultsError> {
    let needed = |name: &str| {
        matches!(name, "pass" | "status")
            || study
                .pictures
                .iter()
                .any(|picture| picture.columns().contains(&name))
    };
    let places: Vec<usize> = (0..columns.len())
        .filter(|&place| needed(&columns[place].name))
        .collect();
    let mut table = Table {
        columns: places
            .iter()
            .map(|&place| picture::Column {
                name: columns[place].name.clone(),
                values: if columns[place].kind.is_number() {
                    Values::Number(Vec::new())
                } else {
                    Values::Text(Vec::new())
                },
                own: KeyPath::find(&columns[place].name)
                    .ok()
                    .and_then(|key| own_number(&study.reference, &key)),
            })
            .collect(),
    };
    for_each_row(folder, columns, MOST_ROWS, |row| {
        for (&place, column) in places.iter().zip(&mut table.columns) {
            match (&mut column.values, row.get(place)) {
                (Values::Number(numbers), cell) => numbers.push(cell.and_then(Cell::as_number)),
                (Values::Text(texts), Some(Cell::Text(text))) => texts.push(text.to_string()),
                (Values::Text(texts), Some(Cell::Flag(flag))) => texts.push(flag.to_string()),
                (Values::Text(texts), _) => texts.push(String::new()),
            }
        }
        Ok(())
    })?;
    Ok(table)
}
