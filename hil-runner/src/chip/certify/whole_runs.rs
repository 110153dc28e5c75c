//! Whole runs in a web page's simulator held against the host's: every figure, every point of
//! every curve, every sentence, on every rung.

use hil_core::case::Law;
use hil_core::requests;
use serde_json::{Map, Value, json};

use super::{Comparison, Difference};
use crate::chip::line::ChipError;
use crate::chip::wasm::Page;
use crate::live::LiveCase;

/// Holds a run of a case on one rung in the page's image against the host's; numbers are the
/// same if their bits are.
///
/// # Errors
/// [`ChipError`] if the image fails, or the case makes no run on the host.
pub fn compare_run(case: &LiveCase, page: &mut Page, law: Law) -> Result<Comparison, ChipError> {
    let request = request(case, law).to_string();
    let host = requests::simulate(request.as_bytes()).to_bytes();
    let image = page.ask("simulate", request.as_bytes())?;
    let [host, image] = [Answered::read(&host)?, Answered::read(&image)?];
    let name = format!("{}, {}", case.name, law.name());
    if let Some(errors) = host.json.get("errors") {
        return Err(ChipError(format!("{name}: {errors}")));
    }
    let place = host.first_difference(&image);
    Ok(Comparison {
        compared: host.numbers(),
        difference: place.map(|place| Difference {
            at: 0,
            place: format!("{place} of {name}"),
            numbers: Vec::new(),
            other: "here",
        }),
    })
}

/// All that a page can ask of a run.
fn request(case: &LiveCase, law: Law) -> Value {
    let law = format!("controller.law={}", law.name());
    let sets: Vec<&String> = case.sets.iter().chain([&law]).collect();
    json!({
        "name": case.file,
        "text": case.text,
        "beside": case.beside,
        "sets": sets,
        "columns": true,
        "loops": true,
        "summary": true,
    })
}

/// An answer, read back.
#[derive(Debug, PartialEq)]
struct Answered {
    json: Map<String, Value>,
    /// Bits of the values of all columns.
    values: Vec<u64>,
}

impl Answered {
    fn read(bytes: &[u8]) -> Result<Self, ChipError> {
        let cut = || ChipError("the simulator's answer is cut short".to_owned());
        let length = |at: usize| {
            let four = bytes.get(at..at + 4)?.try_into().ok()?;
            usize::try_from(u32::from_le_bytes(four)).ok()
        };
        let (json, count) = length(0).zip(length(4)).ok_or_else(cut)?;
        let text = bytes.get(8..8 + json).ok_or_else(cut)?;
        let values = bytes.get((8 + json).next_multiple_of(8)..);
        let (values, _) = values.ok_or_else(cut)?.as_chunks::<8>();
        let values: Vec<u64> = values.iter().copied().map(u64::from_le_bytes).collect();
        if values.len() != count {
            return Err(cut());
        }
        let json = serde_json::from_slice(text).map_err(|error| ChipError(error.to_string()))?;
        Ok(Self { json, values })
    }

    /// Numbers of the columns and in the JSON.
    fn numbers(&self) -> u64 {
        let in_json: u64 = self.json.values().map(numbers_in).sum();
        in_json + self.values.len() as u64
    }

    /// What differs in the other one, in words.
    fn first_difference(&self, other: &Self) -> Option<String> {
        for key in self.json.keys().chain(other.json.keys()) {
            let [one, two] = [&self.json, &other.json].map(|json| json.get(key));
            if one != two {
                let (one, two) = narrowed(one?, two?);
                return Some(format!("{key}: {two}, {one} here,"));
            }
        }
        let mut pairs = self.values.iter().zip(&other.values);
        let at = pairs.position(|(one, two)| one != two)?;
        let columns = self.json.get("columns").and_then(Value::as_object)?;
        let (name, row) = columns.iter().find_map(|(name, place)| {
            let first = usize::try_from(place.get(0)?.as_u64()?).ok()?;
            let length = usize::try_from(place.get(1)?.as_u64()?).ok()?;
            let row = at.checked_sub(first).filter(|row| *row < length)?;
            Some((name, row))
        })?;
        let [one, two] = [&self.values, &other.values].map(|values| f64::from_bits(values[at]));
        Some(format!("{name}, row {row}: {two:?}, {one:?} here,"))
    }
}

/// The first parts of two values that differ.
fn narrowed<'v>(one: &'v Value, two: &'v Value) -> (&'v Value, &'v Value) {
    let parts = match (one, two) {
        (Value::Object(one), Value::Object(two)) => one
            .iter()
            .find_map(|(key, one)| Some((one, two.get(key)?)).filter(|(a, b)| a != b)),
        (Value::Array(one), Value::Array(two)) => one.iter().zip(two).find(|(a, b)| a != b),
        _ => None,
    };
    parts.map_or((one, two), |(one, two)| narrowed(one, two))
}

fn numbers_in(value: &Value) -> u64 {
    match value {
        Value::Number(_) => 1,
        Value::Array(values) => values.iter().map(numbers_in).sum(),
        Value::Object(values) => values.values().map(numbers_in).sum(),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use hil_core::runfile::builtin_text;

    use super::*;

    fn answered(sets: &[&str]) -> Answered {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let text = builtin_text("paper-2").unwrap();
        let case = LiveCase::new("paper-2", text, &sets).unwrap();
        let request = request(&case, Law::Quantised).to_string();
        Answered::read(&requests::simulate(request.as_bytes()).to_bytes()).unwrap()
    }

    #[test]
    fn a_last_bit_is_a_difference() {
        let [one, mut two] = [(); 2].map(|()| answered(&[]));
        assert_eq!(one.first_difference(&two), None);
        assert!(one.numbers() > 20_000);
        two.values[4_000] ^= 1;
        let found = one.first_difference(&two).unwrap();
        assert!(found.starts_with("acc_ref_mps2, row "), "{found}");
        let heavier = answered(&["carriage.mass_kg=50.00000000001"]);
        let found = one.first_difference(&heavier).unwrap();
        assert!(
            found.starts_with("figures: 1.64") && found.ends_with("here,"),
            "{found}"
        );
    }
}
