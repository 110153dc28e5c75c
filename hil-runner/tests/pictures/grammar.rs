//! Rules of Vega-Lite that every specification keeps, and a proof that each can be
//! broken.

use serde_json::json;

use super::check::wrong;
use super::samples::{all, specified};

#[test]
fn every_sample_is_grammatical() {
    for sample in all() {
        let wrong = wrong(&specified(&sample));
        assert!(wrong.is_empty(), "{}:\n{}", sample.name, wrong.join("\n"));
    }
}

/// The contrast: each rule is broken by a specification made wrong in one place.
#[test]
fn rules_can_be_broken() {
    let spec = specified(&all()[0]);
    assert!(wrong(&spec).is_empty());
    let layers = spec["layer"].as_array().unwrap();
    let of_marks = layers
        .iter()
        .position(|layer| layer["params"].is_array())
        .unwrap();
    let at = format!("/layer/{of_marks}");
    for (place, value, report) in [
        ("/$schema".to_owned(), json!("v5"), "no schema"),
        ("/layer".to_owned(), json!([]), "without layers"),
        ("/width".to_owned(), json!(null), "without a size"),
        (format!("{at}/mark/type"), json!("pie"), "no mark"),
        (format!("{at}/data/name"), json!("other"), "no data"),
        (
            format!("{at}/encoding"),
            json!({"colour": {}}),
            "no channel",
        ),
        ("/layer/0/data/values".to_owned(), json!([{}]), "not in {}"),
        (
            format!("{at}/encoding/x/scale/domain"),
            json!([2, 1]),
            "from 2 to 1",
        ),
        (
            format!("{at}/encoding/x/scale/domain"),
            json!([-1, 1]),
            "from -1 to 1",
        ),
        (format!("{at}/encoding/x/length"), json!(1), "a key length"),
        (format!("{at}/params"), json!([]), "no parameter chosen"),
    ] {
        let mut broken = spec.clone();
        match broken.pointer_mut(&place) {
            Some(found) => *found = value,
            None => broken.pointer_mut(&place.replace("/length", "")).unwrap()["length"] = value,
        }
        let wrong = wrong(&broken);
        assert!(
            wrong.iter().any(|line| line.contains(report)),
            "{report}: {wrong:?}"
        );
    }
    let mut twice = spec.clone();
    let layer = twice["layer"][of_marks].clone();
    twice["layer"].as_array_mut().unwrap().push(layer);
    assert!(
        wrong(&twice)
            .iter()
            .any(|line| line.contains("two parameters"))
    );
}

/// Same table, same bytes; another value, others.
#[test]
fn specifications_are_deterministic() {
    for sample in all() {
        let [one, two] = [0, 1].map(|_| specified(&sample).to_string());
        assert_eq!(one, two, "{}", sample.name);
    }
    let mut other = all().swap_remove(0);
    let before = specified(&other);
    other.change_a_number();
    assert!(specified(&other) != before);
}
