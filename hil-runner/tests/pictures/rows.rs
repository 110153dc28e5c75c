//! Every row is shown or counted as left out, and its marks have its values.

use hil_runner::study::picture::Kind;
use serde_json::json;

use super::check::{false_marks, lost, marks, rows_of};
use super::samples::{all, specified};

#[test]
fn every_row_is_shown_or_counted() {
    for sample in all() {
        let spec = specified(&sample);
        assert_eq!(
            lost(&sample.picture(), sample.table.rows(), &spec),
            0,
            "{}",
            sample.name
        );
        let wrong = false_marks(
            &sample.picture(),
            |column, row| sample.value(column, row),
            &spec,
        );
        assert!(wrong.is_empty(), "{}: {wrong:?}", sample.name);
    }
}

/// The contrast: a mark that is gone, a run that is, and a value that is 1 % off.
#[test]
fn lost_and_false_marks_are_seen() {
    for sample in all() {
        let mut spec = specified(&sample);
        let Some(mark) = marks(&spec)
            .into_iter()
            .find(|mark| !rows_of(mark).is_empty())
        else {
            continue;
        };
        let gone = mark.clone();
        let (name, at) = spec["datasets"]
            .as_object()
            .unwrap()
            .iter()
            .find_map(|(name, marks)| {
                let at = marks
                    .as_array()
                    .unwrap()
                    .iter()
                    .position(|other| *other == gone);
                Some((name.clone(), at?))
            })
            .unwrap();
        for field in ["x", "y", "z"] {
            let mark = &mut spec["datasets"][&name][at];
            if let Some(value) = mark[field].as_f64() {
                mark[field] = json!(if value == 0.0 { 1.0 } else { 1.01 * value });
            }
        }
        let is_told = match sample.picture().kind {
            Kind::Histogram(_) => false,
            Kind::Map(_) => !gone["z"].is_null(),
            _ => true,
        };
        assert!(
            !is_told
                || !false_marks(
                    &sample.picture(),
                    |column, row| sample.value(column, row),
                    &spec
                )
                .is_empty(),
            "{}",
            sample.name
        );
        spec["datasets"][&name].as_array_mut().unwrap().remove(at);
        assert!(
            lost(&sample.picture(), sample.table.rows(), &spec) > 0,
            "{}",
            sample.name
        );
    }
}
