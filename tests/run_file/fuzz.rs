//! Whatever stands in a file: an answer, one line an error, and no panic.

use hil_core::runfile::{self, MOST_MISTAKES, builtin_text};
use proptest::collection::vec;
use proptest::prelude::*;

use super::BASE;
use super::document::Document;

/// Pieces that TOML or the run file knows, to get past the first character.
const PIECES: &[&str] = &[
    "[motor]\n",
    "[budget]\n",
    "[[run]]\n",
    "motor",
    "inertia_kg_m2",
    "kp",
    ".",
    " = ",
    "=",
    "\n",
    "\r\n",
    "1",
    "-",
    "0.001",
    "1e-9",
    "1e999",
    "0x1F",
    "1_0",
    "nan",
    "inf",
    "true",
    "\"",
    "'''",
    "\"\\u0000\"",
    "[",
    "]",
    "{",
    "}",
    ",",
    "#",
    "2020-01-01",
    "°",
    "\u{feff}",
    "\u{202e}",
    "\t",
    "lines = 1\n",
    "dac_range_v = 20\n",
    "joint = \"rigid\"\n",
    "total_time_s = 1e-40\n",
];

fn answer(text: &str, sets: &[String]) -> Result<(), TestCaseError> {
    if let Err(errors) = runfile::parse("x.toml", text, sets) {
        prop_assert!(!errors.entries().is_empty());
        let lines = errors.entries().len().min(MOST_MISTAKES + 1);
        prop_assert_eq!(errors.to_string().lines().count(), lines);
    }
    Ok(())
}

/// A text with some of its bytes cut out and a piece put in their place.
fn mutated(text: String) -> impl Strategy<Value = String> {
    let cut = (
        any::<prop::sample::Index>(),
        0_usize..12,
        prop::sample::select(PIECES),
    );
    vec(cut, 1..6).prop_map(move |cuts| {
        let mut characters: Vec<char> = text.chars().collect();
        for (at, length, piece) in cuts {
            let start = at.index(characters.len() + 1);
            let end = (start + length).min(characters.len());
            characters.splice(start..end, piece.chars());
        }
        characters.into_iter().collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes(bytes in vec(any::<u8>(), 0..200)) {
        answer(&String::from_utf8_lossy(&bytes), &[])?;
    }

    #[test]
    fn any_text(text in any::<String>()) {
        answer(&text, &[])?;
    }

    #[test]
    fn any_pieces(pieces in vec(prop::sample::select(PIECES), 0..40)) {
        answer(&pieces.concat(), &[])?;
    }

    #[test]
    fn damaged_files(text in mutated(BASE.to_owned())) {
        answer(&text, &[])?;
    }

    #[test]
    fn damaged_built_in_files(text in mutated(builtin_text("paper-1").unwrap_or_default().to_owned())) {
        answer(&text, &[])?;
    }

    #[test]
    fn damaged_files_with_every_key(text in mutated(Document::full().text())) {
        answer(&text, &[])?;
    }

    #[test]
    fn any_overrides(sets in vec(any::<String>(), 0..3), pieces in vec(prop::sample::select(PIECES), 0..6)) {
        answer(BASE, &sets)?;
        answer(BASE, &[format!("controller.kp={}", pieces.concat())])?;
        answer(BASE, &[pieces.concat()])?;
    }

    #[test]
    fn any_number_for_any_key(index in any::<prop::sample::Index>(), value in any::<f64>()) {
        let numbers: Vec<&str> = BASE.lines().filter(|line| line.contains(" = ")).collect();
        let line = numbers[index.index(numbers.len())];
        let key = line.split(' ').next().unwrap_or_default();
        answer(&BASE.replace(line, &format!("{key} = {value:e}")), &[])?;
        answer(&BASE.replace(line, &format!("{key} = {value}")), &[])?;
    }
}

#[test]
fn depth_and_length_are_bounded() {
    for piece in ["[", "{a=", "a."] {
        let text = format!("a = {}", piece.repeat(100_000));
        assert!(runfile::parse("x.toml", &text, &[]).is_err());
    }
    let deep = format!("{}b = 1", "a.".repeat(100_000));
    assert!(runfile::parse("x.toml", &deep, &[]).is_err());
    let set = format!("name={}", "[".repeat(100_000));
    assert!(runfile::parse("x.toml", BASE, &[set]).is_err());
    let long = format!("{} = 1\n{BASE}", "k".repeat(500_000));
    let printed = runfile::parse("x.toml", &long, &[])
        .unwrap_err()
        .to_string();
    assert!(printed.len() < 400, "{}", printed.len());
}
