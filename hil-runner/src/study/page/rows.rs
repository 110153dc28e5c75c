//! The rows of a study as its page carries them: what a row's run has set, and its
//! values, column by column.

use std::collections::BTreeSet;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use crate::study::picture::Label;
use crate::study::plan::Study;
use crate::study::rows::cell::{Cell, Column};
use hil_core::number::significant;

/// Rows that a page carries: the first ones.
const MOST_ROWS: usize = 5_000;
/// Digits of a page's figures, for so many cells at most: the page of a study of any
/// size stays one that can be mailed.
const DIGITS: [(usize, usize); 3] = [(20_000, 17), (100_000, 6), (usize::MAX, 3)];

/// So many different numbers are text nonetheless.
const FEW: usize = 100;

/// The first rows of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct PageRows {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

impl PageRows {
    /// Nothing added yet, for rows with these columns, of which the first is the row's
    /// number.
    pub(super) fn new(columns: &[Column]) -> Self {
        Self {
            columns: columns.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row, if it is one of the first.
    pub(super) fn add(&mut self, row: &[Cell]) {
        if self.rows.len() < MOST_ROWS {
            self.rows.push(row.to_vec());
        }
    }

    /// The rows as data of a page.
    pub(super) fn data(&self, study: &Study) -> Value {
        let sets = sets(study, self.rows.len());
        let numbers = self.columns.iter().filter(|column| column.kind.is_number());
        let cells = numbers.count() * self.rows.len();
        let digits = DIGITS.iter().find(|(most, _)| cells <= *most);
        let digits = digits.map_or(3, |(_, digits)| *digits);
        let axes: Vec<String> = study.axes.iter().map(|axis| axis.key.path()).collect();
        let places = (1..self.columns.len()).map(|place| {
            let Column { name, kind } = &self.columns[place];
            let label = Label::of(name);
            let mut column = json!({"name": name, "label": label.words, "unit": label.unit});
            // What a set says need not be said again.
            if kind.is_number() && axes.contains(name) && sets.iter().any(|set| set["key"] == *name)
            {
                return column;
            }
            let cells = self.rows.iter().map(|row| match row.get(place) {
                Some(Cell::Number(number)) => json!(significant(*number, digits)),
                Some(Cell::Flag(flag)) => json!(flag),
                Some(Cell::Text(text)) => json!(text),
                Some(Cell::Empty) | None => Value::Null,
            });
            put(&mut column, cells.collect());
            column
        });
        json!({
            "study": study.name,
            "base": study.template().source_name(),
            "rows": self.rows.len(),
            "of": study.rows(),
            "digits": digits,
            "axes": axes,
            "sets": sets,
            "columns": places.collect::<Vec<_>>(),
        })
    }
}

/// What the first rows set, key by key in the order of their overrides: `values` has
/// each row's TOML, or none.
fn sets(study: &Study, rows: usize) -> Vec<Value> {
    let mut columns: Vec<((String, usize), Vec<Value>)> = Vec::new();
    for row in 0..rows {
        let planned = study.planned_row(row as u64);
        let mut seen: Vec<String> = Vec::new();
        for set in study.row_sets(&planned.point, planned.rung) {
            let (key, value) = set.split_once('=').unwrap_or((&set, ""));
            // A key that is set again is one more column: the later one counts.
            let again = seen.iter().filter(|known| *known == key).count();
            seen.push(key.to_owned());
            let name = (key.to_owned(), again);
            let place = columns.iter().position(|(known, _)| *known == name);
            let place = place.unwrap_or_else(|| {
                columns.push((name, Vec::new()));
                columns.len() - 1
            });
            let values = &mut columns[place].1;
            values.resize(row, Value::Null);
            values.push(json!(value));
        }
    }
    let column = |((key, _), mut values): ((String, usize), Vec<Value>)| {
        values.resize(rows, Value::Null);
        let mut column = json!({"key": key});
        put(&mut column, values);
        column
    };
    columns.into_iter().map(column).collect()
}

/// The values as numbers, if they are and hardly any is there twice: as text they would
/// take a third more.
fn numbers(values: &[Value]) -> Option<Vec<f64>> {
    let of_text = |value: &Value| value.as_str()?.parse::<f64>().ok();
    let numbers = values.iter().map(of_text).collect::<Option<Vec<f64>>>()?;
    let different: BTreeSet<u64> = numbers.iter().map(|number| number.to_bits()).collect();
    (different.len() > FEW && 2 * different.len() > numbers.len()).then_some(numbers)
}

/// All first bytes of numbers (little-endian), then all second ones, and so on: those that
/// are alike lie side by side.
fn planes(numbers: &[f64]) -> String {
    let plane = |at: usize| numbers.iter().map(move |number| number.to_le_bytes()[at]);
    let bytes: Vec<u8> = (0..8).flat_map(plane).collect();
    BASE64_STANDARD.encode(bytes)
}

/// Puts the values into a column: one, if all are the same.
fn put(column: &mut Value, values: Vec<Value>) {
    if let Some(numbers) = numbers(&values) {
        column["planes"] = planes(&numbers).into();
        return;
    }
    let same = values.windows(2).all(|pair| pair[0] == pair[1]);
    match values.first() {
        Some(first) if same => column["value"] = first.clone(),
        _ => column["values"] = Value::Array(values),
    }
}
