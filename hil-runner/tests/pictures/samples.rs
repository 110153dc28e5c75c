//! Tables and pictures to specify: ordinary ones and awkward ones.

use hil_runner::study::picture::{Curve, Picture, Table, Values, specify};

use serde::Deserialize;
use serde_json::Value;

use super::tables::{Rows, border};

/// One picture with what it is made from.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub(super) name: String,
    pub(super) keys: String,
    pub(super) table: Table,
    pub(super) curves: Vec<Curve>,
}

impl Sample {
    pub(super) fn of(name: &str, keys: &str, table: Table) -> Self {
        Self {
            name: name.into(),
            keys: keys.into(),
            table,
            curves: Vec::new(),
        }
    }

    pub(super) fn picture(&self) -> Picture {
        let text = format!("file = \"f\"\ntitle = \"{}\"\n{}", self.name, self.keys);
        toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    /// A number of a column that a mark shows.
    pub(super) fn value(&self, column: &str, row: usize) -> Option<f64> {
        match &self.table.find(column)?.values {
            Values::Number(values) => values[row],
            Values::Text(_) => None,
        }
    }

    pub(super) fn change_a_number(&mut self) {
        for column in &mut self.table.columns {
            if let Values::Number(values) = &mut column.values {
                values[0] = values[0].map(|value| 1.1 * value);
            }
        }
    }
}

pub(super) fn specified(sample: &Sample) -> Value {
    let specification = specify(&sample.picture(), &sample.table, &sample.curves);
    specification.unwrap_or_else(|error| panic!("{}: {error}", sample.name))
}

/// What stands in `samples.toml`.
#[derive(Deserialize)]
struct Written {
    sample: Vec<WrittenSample>,
}

#[derive(Deserialize)]
struct WrittenSample {
    name: String,
    table: Rows,
    keys: String,
}

/// All samples.
pub(super) fn all() -> Vec<Sample> {
    let written: Written = toml::from_str(include_str!("samples.toml")).unwrap();
    let samples = written.sample.into_iter().map(|written| {
        let mut sample = Sample::of(&written.name, &written.keys, written.table.table());
        if sample.name == "map" {
            sample.curves.push(border());
        }
        sample
    });
    samples.collect()
}
