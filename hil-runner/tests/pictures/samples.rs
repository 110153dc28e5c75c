//! Tables and pictures to draw: ordinary ones and awkward ones.

use hil_runner::study::picture::{Curve, Picture, Table, Values, draw};

use serde::Deserialize;

use super::tables::{Rows, border};

/// One picture with what it is drawn from.
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

    pub(super) fn has_words(&self) -> bool {
        let mut columns = self.table.columns.iter();
        columns.any(|column| matches!(column.values, Values::Text(_)))
    }

    pub(super) fn turn_rows_round(&mut self) {
        for column in &mut self.table.columns {
            match &mut column.values {
                Values::Number(values) => values.reverse(),
                Values::Text(values) => values.reverse(),
            }
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

pub(super) fn draw_sample(sample: &Sample) -> String {
    let svg = draw(&sample.picture(), &sample.table, &sample.curves);
    svg.unwrap_or_else(|error| panic!("{}: {error}", sample.name))
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
    curve: Option<Vec<(f64, f64)>>,
    keys: String,
}

/// All samples.
pub(super) fn all() -> Vec<Sample> {
    let written: Written = toml::from_str(include_str!("samples.toml")).unwrap();
    let samples = written.sample.into_iter().map(|written| {
        let mut sample = Sample::of(&written.name, &written.keys, written.table.table());
        let given = written.curve.map(|points| Curve {
            label: "given".into(),
            points,
        });
        sample.curves.extend(given);
        if sample.name == "map" {
            sample.curves.push(border());
        }
        sample
    });
    samples.collect()
}
