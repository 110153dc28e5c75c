//! `where`: what a row must have to be shown.

use std::fmt;

use serde::Deserialize;

use crate::study::picture::PictureError;
use crate::study::picture::label::{Label, within};
use crate::study::picture::table::{Table, Values};
use hil_core::number;

/// A column and the values that it may have.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Name of the column.
    pub column: String,
    /// The values; a row needs one of them.
    pub any_of: Vec<Atom>,
}

/// A value that a row may have.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Atom {
    /// A number; equal up to rounding, 10⁻⁹ of it.
    Number(f64),
    /// A word.
    Text(String),
    /// A flag, told by 1 and 0 or by words.
    Flag(bool),
}

/// The conditions of a table; `drive.dac_bits` may be a dotted key or a quoted
/// one.
pub(super) fn conditions(value: toml::Value) -> Result<Vec<Condition>, String> {
    let toml::Value::Table(table) = value else {
        return Err("where is a table of columns and values".to_owned());
    };
    let mut found = Vec::new();
    collect("", table, &mut found)?;
    Ok(found)
}

fn collect(above: &str, table: toml::Table, found: &mut Vec<Condition>) -> Result<(), String> {
    for (key, value) in table {
        let column = match above {
            "" => key,
            above => format!("{above}.{key}"),
        };
        let any_of = match value {
            toml::Value::Table(table) => {
                collect(&column, table, found)?;
                continue;
            }
            toml::Value::Array(values) if !values.is_empty() => values
                .into_iter()
                .map(|value| atom(&column, value))
                .collect::<Result<_, _>>()?,
            value => vec![atom(&column, value)?],
        };
        found.push(Condition { column, any_of });
    }
    Ok(())
}

fn atom(column: &str, value: toml::Value) -> Result<Atom, String> {
    value.try_into().map_err(|_| {
        format!("where.{column} must be a number, a text, true or false, or a list of these")
    })
}

impl Condition {
    /// Says of each row of the table if it has one of the values.
    pub(in crate::study::picture) fn holds(
        &self,
        table: &Table,
    ) -> Result<Vec<bool>, PictureError> {
        let column = table.column(&self.column)?;
        let holds = |row: usize, atom: &Atom| match (atom, &column.values) {
            (Atom::Flag(flag), _) => column.verdict(row) == Some(*flag),
            (Atom::Number(wanted), Values::Number(values)) => {
                let value = values.get(row).copied().flatten();
                value.is_some_and(|value| (value - wanted).abs() <= 1e-9 * wanted.abs())
            }
            (Atom::Text(wanted), Values::Text(values)) => values.get(row) == Some(wanted),
            (Atom::Number(_), Values::Text(_)) | (Atom::Text(_), Values::Number(_)) => false,
        };
        Ok((0..table.rows())
            .map(|row| self.any_of.iter().any(|atom| holds(row, atom)))
            .collect())
    }
}

/// In words, for a remark below the plots.
impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let label = Label::of(&self.column);
        let words = |atom: &Atom| match atom {
            Atom::Number(number) if label.unit.is_empty() => number::table(*number),
            Atom::Number(number) => format!("{} {}", number::table(*number), label.unit),
            Atom::Text(text) => text.clone(),
            Atom::Flag(flag) => if *flag { "yes" } else { "no" }.to_owned(),
        };
        let any_of: Vec<String> = self.any_of.iter().map(words).collect();
        write!(f, "{} = {}", within(&label.words), any_of.join(" or "))
    }
}
