//! An answer: JSON, and columns of numbers that would be long in JSON.

use crate::runfile::RunFileErrors;
use serde_json::{Map, Value, json};

/// JSON with columns beside it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Answer {
    /// Everything but the columns.
    pub json: Value,
    /// The values of the columns, one column after the other.
    pub values: Vec<f64>,
    /// Name of each column, and its place and length in the values.
    columns: Map<String, Value>,
}

impl Answer {
    /// An answer without columns.
    pub fn of(json: Value) -> Self {
        Self {
            json,
            ..Self::default()
        }
    }

    /// What is wrong with a run file, a sentence for each mistake.
    pub fn errors(errors: &[RunFileErrors]) -> Self {
        let entries = errors.iter().flat_map(RunFileErrors::entries);
        let each = entries.map(|error| json!({"key": error.key(), "sentence": error.to_string()}));
        Self::of(json!({"errors": each.collect::<Vec<_>>()}))
    }

    /// The reason why there is no other answer.
    pub fn error(sentence: &str) -> Self {
        Self::of(json!({"errors": [{"key": null, "sentence": sentence}]}))
    }

    /// Adds a column.
    pub fn add(&mut self, name: &str, column: &[f64]) {
        let place = json!([self.values.len(), column.len()]);
        self.columns.insert(name.to_owned(), place);
        self.values.extend(column);
    }

    /// Lengths, JSON with the places of the columns, and their values.
    pub fn to_bytes(mut self) -> Vec<u8> {
        if !self.columns.is_empty() {
            self.json["columns"] = Value::Object(self.columns);
        }
        let json = self.json.to_string();
        let mut bytes = Vec::with_capacity(16 + json.len() + 8 * self.values.len());
        for length in [json.len(), self.values.len()] {
            // No answer is longer than the memory of an image, 4 GiB.
            bytes.extend(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
        }
        bytes.extend(json.into_bytes());
        bytes.resize(bytes.len().next_multiple_of(8), b' ');
        for value in self.values {
            bytes.extend(value.to_le_bytes());
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_of_the_page_above() {
        let mut answer = Answer::of(json!({"a": 1}));
        answer.add("t_s", &[0.5, -2.0]);
        let bytes = answer.to_bytes();
        let json = br#"{"a":1,"columns":{"t_s":[0,2]}}"#;
        assert_eq!(bytes[..8], [json.len() as u8, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!(bytes[8..8 + json.len()], *json);
        assert_eq!(
            bytes[bytes.len() - 16..bytes.len() - 8],
            0.5_f64.to_le_bytes()
        );
        assert_eq!(bytes[bytes.len() - 8..], (-2.0_f64).to_le_bytes());
        assert_eq!(bytes.len() % 8, 0);
    }
}
