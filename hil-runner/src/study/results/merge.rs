//! The shards of a study put together: to the bytes of the study made at once.

use std::path::{Path, PathBuf};

use super::folder::{Progress, Results};
use super::origin::Origin;
use super::read::{Reading, entries};
use super::{ResultsError, io, journal};
use crate::study::cell::{Cell, Column};

/// Puts shards, in their order, together in `folder`; `each` gets every row.
/// Goes on where an earlier merge was ended.
///
/// # Errors
/// If a shard is not complete, and those of the folder.
pub fn merge(
    folder: &Path,
    ordered: &[(PathBuf, Origin)],
    columns: &[Column],
    command_line: &str,
    mut each: impl FnMut(&[Cell]),
) -> Result<Progress, ResultsError> {
    let Some((_, first)) = ordered.first() else {
        return Err(ResultsError::Other(
            "there are no shards to merge".to_owned(),
        ));
    };
    let mut results = Results::open(folder, &first.whole(), columns, command_line, &mut each)?;
    for (path, Origin { manifest, .. }) in ordered {
        let csv = path.join("results.csv");
        let mut reading = Reading::open(&csv, columns)?;
        let (mut next, mut end_byte) = (manifest.own_blocks().start, 0);
        entries(&path.join("results.journal"), |entry| {
            if entry.block != next {
                return Err(ResultsError::Damaged(format!(
                    "{}: block {next} is missing",
                    csv.display()
                )));
            }
            (next, end_byte) = (next + 1, entry.end_byte);
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
        let length = std::fs::metadata(&csv).map_err(|error| io(&csv, &error))?;
        if length.len() > end_byte && next > manifest.own_blocks().start {
            return Err(ResultsError::Damaged(format!(
                "{} goes on after its last row",
                csv.display()
            )));
        }
    }
    results.close()
}

/// The shards with what made them, by number.
///
/// # Errors
/// If they are not all of one study, or one is damaged, missing or there twice.
pub fn shards_in_order(shards: &[PathBuf]) -> Result<Vec<(PathBuf, Origin)>, ResultsError> {
    let mut found: Vec<(PathBuf, Origin)> = Vec::new();
    for path in shards {
        found.push((path.clone(), Origin::read(path)?));
    }
    found.sort_by_key(|(_, origin)| origin.manifest.shard.number);
    let Some((first_path, first)) = found.first() else {
        return Ok(found);
    };
    let of = first.manifest.shard.of;
    for (path, Origin { manifest, .. }) in &found {
        if !manifest.is_same_study(&first.manifest) || manifest.shard.of != of {
            return Err(ResultsError::Other(format!(
                "{} and {} are not shards of the same study, cut into as many parts",
                first_path.display(),
                path.display()
            )));
        }
    }
    let numbers: Vec<u64> = found
        .iter()
        .map(|(_, origin)| origin.manifest.shard.number)
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
