//! The pictures of a study: what is wrong with them before anything is run, the
//! border of stability that theory knows, and their specification from the results.

use crate::study::picture::{
    self, Border, Curve, Field, Kind, Map, Picture, PictureError, Table, Values,
};
use crate::study::plan::Study;
use crate::study::plan::axis::{Axis, Spread};
use crate::study::plan::points::PlanKind;
use crate::study::rows::cell::{Cell, Column};
use crate::study::rows::columns;
use hil_core::runfile::KeyPath;
use hil_core::runfile::renamed;
use hil_core::theory::Loops;
use serde_json::Value;

/// Rows that pictures show: the first ones. Of a plan that draws, these are
/// drawn like all others.
pub const MOST_ROWS: u64 = 100_000;

/// A picture that has been specified.
#[derive(Debug, Clone)]
pub struct Specified {
    /// The picture that was asked for.
    pub picture: Picture,
    /// Its Vega-Lite specification, or why there is none.
    pub specification: Result<Value, PictureError>,
}

/// The columns that any of the pictures needs, and those that every picture may
/// look at, with the first rows.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureRows {
    /// Places of the columns in a row.
    places: Vec<usize>,
    table: Table,
}

impl PictureRows {
    /// Nothing added yet, for rows with these columns.
    pub(super) fn new(study: &Study, columns: &[Column]) -> Self {
        let needed = |name: &str| {
            let by_all = matches!(name, "pass" | "status");
            let needs = |picture: &Picture| by_all || picture.columns().contains(&name);
            study.pictures.iter().any(needs)
        };
        let places = (0..columns.len()).filter(|&place| needed(&columns[place].name));
        let places: Vec<usize> = places.collect();
        let columns = places.iter().map(|&place| &columns[place]);
        let table = empty_table(study, columns);
        Self { places, table }
    }

    /// Adds a row, if it is one of the first.
    pub(super) fn add(&mut self, row: &[Cell]) {
        if self.table.rows() as u64 >= MOST_ROWS {
            return;
        }
        for (&place, column) in self.places.iter().zip(&mut self.table.columns) {
            match (&mut column.values, row.get(place)) {
                (Values::Number(numbers), cell) => numbers.push(cell.and_then(Cell::as_number)),
                (Values::Text(texts), Some(Cell::Text(text))) => texts.push(text.to_string()),
                (Values::Text(texts), Some(Cell::Flag(flag))) => texts.push(flag.to_string()),
                (Values::Text(texts), _) => texts.push(String::new()),
            }
        }
    }
}

/// A table of these columns without rows.
fn empty_table<'c>(study: &Study, columns: impl Iterator<Item = &'c Column>) -> Table {
    let own = |name: &str| study.reference.own_number(&KeyPath::find(name).ok()?);
    let empty = |column: &Column| picture::Column {
        name: column.name.clone(),
        values: match column.kind.is_number() {
            true => Values::Number(Vec::new()),
            false => Values::Text(Vec::new()),
        },
        own: own(&column.name),
    };
    Table {
        columns: columns.map(empty).collect(),
    }
}

/// Specifies the pictures of a study from its rows.
pub fn specify(study: &Study, rows: &PictureRows) -> Vec<Specified> {
    let curves = |picture: &Picture| match &picture.kind {
        Kind::Map(map) if !map.border.is_empty() => borders(study, map),
        _ => Vec::new(),
    };
    let specified = study.pictures.iter().map(|picture| Specified {
        picture: picture.clone(),
        specification: picture::specify(picture, &rows.table, &curves(picture)),
    });
    specified.collect()
}

/// Points along each axis at which the margin is computed.
const POINTS: u32 = 81;

/// The borders in contact and in the gap over the axes of these columns,
/// whatever rung of the study has a margin; none where the columns are no
/// numeric axes.
fn borders(study: &Study, map: &Map) -> Vec<Curve> {
    let axis = |name: &str| {
        let place = study.axes.iter().position(|axis| axis.key.path() == name)?;
        Some((place, places(&study.axes[place])?))
    };
    let (Some((x_place, x)), Some((y_place, y))) = (axis(&map.x), axis(&map.y)) else {
        return Vec::new();
    };
    let mut loops = Loops::default();
    let mut fields = [Vec::new(), Vec::new()];
    for &y in &y {
        for &x in &x {
            let mut point = study.point(0);
            for (place, value) in [(x_place, x), (y_place, y)] {
                point.values[place] = study.axes[place].key.value(value);
            }
            let case = study.case(&point, study.rungs.len() - 1);
            let margins = case.map_or([None, None], |case| loops.signed_modulus(&case));
            for (field, margin) in fields.iter_mut().zip(margins) {
                field.push(margin);
            }
        }
    }
    let words = [
        (Border::Contact, "border of stability, in contact"),
        (Border::Gap, "border of stability, in the gap"),
    ];
    let wanted = words.into_iter().zip(&fields);
    let wanted = wanted.filter(|((border, _), _)| map.border.contains(border));
    let (x, y) = (&x, &y);
    let curves = wanted.flat_map(|((_, words), values)| {
        let lines = Field { x, y, values }.lines(0.0).into_iter();
        lines.map(|points| Curve {
            label: words.to_owned(),
            points,
        })
    });
    curves.collect()
}

/// Finely spaced values of an axis over numbers.
fn places(axis: &Axis) -> Option<Vec<f64>> {
    let parts = (0..POINTS).map(|i| f64::from(i) / f64::from(POINTS - 1));
    match &axis.spread {
        Spread::Range(range) if axis.times.is_none() => {
            Some(parts.map(|part| range.between(part)).collect())
        }
        _ => None,
    }
}

/// Mistakes in pictures that can be known before anything is run, a sentence
/// each.
pub(in crate::study) fn mistakes_in_pictures(study: &Study) -> Vec<String> {
    let columns = columns(study);
    let table = empty_table(study, columns.iter());
    let mut mistakes = Vec::new();
    for (place, picture) in study.pictures.iter().enumerate() {
        let file = picture.file.as_str();
        let known = |name: &&str| columns.iter().any(|column| column.name == *name);
        let wanted = picture.columns();
        for name in wanted.iter().filter(|name| !known(name)) {
            let why = match renamed(name) {
                Some(now) => format!("{name} is now {now}"),
                None => format!("the results of this study have no column {name}"),
            };
            mistakes.push(format!("picture {file:?}: {why}"));
        }
        if let Kind::Map(map) = &picture.kind
            && let Err(sentence) = map_has_grid(study, map)
        {
            mistakes.push(format!("picture {file:?}: {sentence}"));
        }
        // With no row at all: what does not fit together does not then either.
        if wanted.iter().all(known)
            && let Err(error) = picture::specify(picture, &table, &[])
        {
            mistakes.push(error.to_string());
        }
        let same = |other: &Picture| other.file == file;
        if study.pictures[..place].iter().any(same) {
            mistakes.push(format!("there are two pictures with file = {file:?}"));
        }
    }
    mistakes
}

/// Checks that the axes of a map make a grid, and one that its borders can be
/// computed over.
///
/// # Errors
/// The sentence that says what is needed.
fn map_has_grid(study: &Study, map: &Map) -> Result<(), String> {
    let axis = |name: &str| study.axes.iter().find(|axis| axis.key.path() == name);
    let axes = [axis(&map.x), axis(&map.y)];
    let drawn = |axis: &&Axis| !matches!(axis.spread, Spread::List(_));
    if study.plan.kind != PlanKind::Grid
        && let Some(axis) = axes.iter().flatten().copied().find(drawn)
    {
        return Err(format!(
            "a map needs a grid, and plan = {:?} draws {}; kind \"scatter\" can show it",
            study.plan.kind.name(),
            axis.key.path()
        ));
    }
    let has_places = |axis: &Option<&Axis>| axis.and_then(places).is_some();
    if !map.border.is_empty() && !axes.iter().all(has_places) {
        return Err(
            "a border needs x and y to be axes with from and to, and without times".to_owned(),
        );
    }
    Ok(())
}
