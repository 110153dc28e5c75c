//! The shards of a study put together: to the bytes of the study made at once.

use std::path::{Path, PathBuf};

use super::folder::{Progress, Results};
use super::manifest::Manifest;
use super::read::{Reading, entries};
use super::{ResultsError, journal};
use crate::study::cell::{Cell, Column};

/// Puts shards together in `folder`, in their order; `each` gets every row.
/// Goes on where an earlier merge was ended.
///
/// # Errors
/// If the shards are not all of one study, or one is missing, there twice or
/// not complete; and those of the folder.
pub fn merge(
    folder: &Path,
    shards: &[PathBuf],
    columns: &[Column],
    study_text: &str,
    mut each: impl FnMut(&[Cell]),
) -> Result<Progress, ResultsError> {
    let ordered = in_order(shards)?;
    let Some((_, first)) = ordered.first() else {
        return Err(ResultsError::Other(
            "there are no shards to merge".to_owned(),
        ));
    };
    let mut results = Results::open(folder, first.whole(), columns, study_text, &mut each)?;
    for (path, manifest) in &ordered {
        let csv = path.join("results.csv");
        let mut reading = Reading::open(&csv, columns)?;
        let mut next = manifest.own_blocks().start;
        entries(&path.join("results.journal"), |entry| {
            if entry.block != next {
                return Err(ResultsError::Damaged(format!(
                    "{}: block {next} is missing",
                    csv.display()
                )));
            }
            next += 1;
            if entry.block < results.missing_blocks().start {
                return reading.block(entry).map(|_| ());
            }
            let mut rows = Vec::new();
            reading.rows(entry, |row| {
                each(row);
                rows.push(row.to_owned());
                Ok(())
            })?;
            let bytes = reading.last();
            results.append(bytes, journal::checksum(bytes))?;
            rows.iter().try_for_each(|row| results.add_to_parts(row))
        })?;
        if next != manifest.own_blocks().end {
            return Err(ResultsError::Other(format!(
                "{}: shard {} is not complete; run it again and it goes on",
                path.display(),
                manifest.shard
            )));
        }
    }
    results.close()
}

/// The shards with their manifests, by number.
fn in_order(shards: &[PathBuf]) -> Result<Vec<(PathBuf, Manifest)>, ResultsError> {
    let mut found: Vec<(PathBuf, Manifest)> = Vec::new();
    for path in shards {
        found.push((path.clone(), Manifest::read(path)?));
    }
    found.sort_by_key(|(_, manifest)| manifest.shard.number);
    let Some((first_path, first)) = found.first() else {
        return Ok(found);
    };
    let of = first.shard.of;
    for (path, manifest) in &found {
        if !manifest.is_same_study(first) || manifest.shard.of != of {
            return Err(ResultsError::Other(format!(
                "{} and {} are not shards of the same study, cut into as many parts",
                first_path.display(),
                path.display()
            )));
        }
    }
    let numbers: Vec<u64> = found
        .iter()
        .map(|(_, manifest)| manifest.shard.number)
        .collect();
    let missing: Vec<String> = (1..=of.min(1 << 20))
        .filter(|number| numbers.binary_search(number).is_err())
        .map(|number| format!("{number}/{of}"))
        .take(10)
        .collect();
    if !missing.is_empty() {
        return Err(ResultsError::Other(format!(
            "shards are missing: {}",
            missing.join(", ")
        )));
    }
    if let Some(twice) = numbers.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(ResultsError::Other(format!(
            "shard {}/{of} is given twice",
            twice[0]
        )));
    }
    Ok(found)
}
