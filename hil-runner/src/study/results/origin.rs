//! Origin of the results of a folder: `study.toml`, `base.toml` and
//! `study.json`, which says which study and which part of it.

use core::fmt;
use core::ops::Range;
use core::str::FromStr;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use plant::Course;
use serde::{Deserialize, Serialize};

use super::{ResultsError, damaged, io};
use crate::files::crc64;
use crate::report::{command_line, each_with};
use crate::study::plan::{Changes, Study};
use crate::study::rows::columns;
use hil_core::case::Law;

/// Changes whenever the same study file would give other bytes.
const FORMAT: u32 = 3;

/// Names of the texts that the manifest has the checksums of, and its own.
const STUDY_FILE: &str = "study.toml";
const BASE_FILE: &str = "base.toml";
const MANIFEST: &str = "study.json";

/// A part of a study: number `number` of `of` parts, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Number of the part.
    pub number: u64,
    /// Number of parts.
    pub of: u64,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// The blocks of this part.
    pub fn blocks(self, blocks: u64) -> Range<u64> {
        // No overflow: the product has 128 bits.
        let cut = |part: u64| (u128::from(blocks) * u128::from(part) / u128::from(self.of)) as u64;
        cut(self.number - 1)..cut(self.number)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `2/8`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(number, of)| {
            Some(Self {
                number: number.trim().parse().ok()?,
                of: of.trim().parse().ok()?,
            })
        });
        parts
            .filter(|shard| (1..=shard.of).contains(&shard.number))
            .ok_or_else(|| "a shard is NUMBER/OF, from 1/OF to OF/OF, such as 2/8".to_owned())
    }
}

/// All that a study and its rows are made from, wherever the files lie that it
/// was read from first; without the two texts the contents of `study.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// The study file as it was run.
    #[serde(skip)]
    pub study_text: String,
    /// The run file of the base case.
    #[serde(skip)]
    pub base_text: String,
    /// Name of the study.
    pub study: String,
    /// Version of this file and of all that decides the bytes of the results.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Rows of the whole study.
    pub rows: u64,
    /// Rows of a block.
    pub block_rows: u64,
    /// Part of the study that lies here.
    pub shard: Shard,
    /// Study file or ready study, as the command line had it.
    pub source: String,
    /// The base case of the command line.
    pub base: Option<String>,
    /// Every `--set` of the command line.
    pub sets: Vec<String>,
    /// Rungs that the command line asks for instead of the study's.
    pub rungs: Option<Vec<String>>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Checksum of every key that the runs have of study and command line, in
    /// their order, and of a profile's points.
    pub sets_crc64: String,
    /// Checksum of `study.toml`.
    pub study_crc64: String,
    /// Checksum of `base.toml`.
    pub base_crc64: String,
    /// Checksum of this file, with this key empty.
    crc64: String,
}

impl Origin {
    /// That of a study, or a part of it.
    pub fn new(study: &Study, shard: Shard, source: &str, changes: &Changes) -> Self {
        let rungs = changes.rungs.as_ref().map(|laws| laws.iter());
        let columns = columns(study).into_iter();
        let base_text = study.template().text().to_owned();
        let origin = Self {
            study: study.name.clone(),
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            rows: study.rows(),
            block_rows: study.block_rows(),
            shard,
            source: source.to_owned(),
            base: changes.base.clone(),
            sets: changes.sets.clone(),
            rungs: rungs.map(|laws| laws.map(|law| law.name().to_owned()).collect()),
            columns: columns.map(|column| column.name).collect(),
            sets_crc64: crc64(keys_of_runs(study).as_bytes()),
            study_crc64: crc64(study.text.as_bytes()),
            base_crc64: crc64(base_text.as_bytes()),
            crc64: String::new(),
            study_text: study.text.clone(),
            base_text,
        };
        origin.signed()
    }

    /// With the checksum that belongs to it.
    fn signed(mut self) -> Self {
        self.crc64.clear();
        self.crc64 = crc64(self.manifest().as_bytes());
        self
    }

    /// Additions of the command line to the study.
    fn changes(&self) -> Changes {
        let rungs = self.rungs.as_ref().map(|names| names.iter());
        Changes {
            base: self.base.clone(),
            sets: self.sets.clone(),
            rungs: rungs.map(|names| names.filter_map(|name| Law::find(name)).collect()),
            base_text: Some(self.base_text.clone()),
        }
    }

    /// The command that makes these results, in `out` where that was given.
    pub fn command_line(&self, out: Option<&Path>) -> String {
        let shard = (self.shard != Shard::WHOLE).then(|| self.shard.to_string());
        let rungs = self.rungs.as_ref().map(|rungs| rungs.join(","));
        let out = out.map(|out| out.to_string_lossy().into_owned());
        let words = ["study", &self.source]
            .into_iter()
            .chain(each_with("--base", &self.base))
            .chain(each_with("--set", &self.sets))
            .chain(each_with("--rungs", &rungs))
            .chain(each_with("--shard", &shard))
            .chain(each_with("--out", &out));
        command_line(words)
    }

    /// Blocks that lie here once all is done.
    pub fn own_blocks(&self) -> Range<u64> {
        self.shard.blocks(self.rows.div_ceil(self.block_rows))
    }

    /// Rows that lie here before a block of this part, or the end of its last.
    pub(super) fn rows_before(&self, block: u64) -> u64 {
        let first_row = |block: u64| (block * self.block_rows).min(self.rows);
        first_row(block) - first_row(self.own_blocks().start)
    }

    /// The same for all of the study.
    pub fn whole(&self) -> Self {
        let whole = Self {
            shard: Shard::WHOLE,
            ..self.clone()
        };
        whole.signed()
    }

    /// True if the rows are those of the same study, wherever its file and its
    /// base lie.
    pub(super) fn is_same_study(&self, other: &Self) -> bool {
        let placed = Self {
            source: self.source.clone(),
            base: self.base.clone(),
            ..other.whole()
        };
        self.whole() == placed.signed()
    }

    /// Reads that of a folder.
    ///
    /// # Errors
    /// If a file of it is missing, or is not what was written, or another version of
    /// the program has written it.
    pub fn read(folder: &Path) -> Result<Self, ResultsError> {
        let path = folder.join(MANIFEST);
        let other = |version: &str, format: u32| {
            ResultsError(format!(
                "{} holds results of version {version}, format {format}, not of {}, format {FORMAT}; give another folder with --out, or remove this one",
                folder.display(),
                env!("CARGO_PKG_VERSION")
            ))
        };
        let bytes = fs::read(&path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => ResultsError(format!(
                "{} holds no results of a study: {} is missing",
                folder.display(),
                path.display()
            )),
            _ => io(&path)(error),
        })?;
        let mut origin: Self = serde_json::from_slice(&bytes).map_err(|error| {
            // Another format has other keys.
            match serde_json::from_slice(&bytes) {
                Ok(Format { format, version }) if format != FORMAT => other(&version, format),
                _ => damaged(&path, format!("is not what was written: {error}")),
            }
        })?;
        if origin.clone().signed().manifest().as_bytes() != bytes {
            let words = "is not what was written: its checksum is that of another text";
            return Err(damaged(&path, words));
        }
        if (origin.format, origin.version.as_str()) != (FORMAT, env!("CARGO_PKG_VERSION")) {
            return Err(other(&origin.version, origin.format));
        }
        origin.study_text = text(&folder.join(STUDY_FILE), &origin.study_crc64)?;
        origin.base_text = text(&folder.join(BASE_FILE), &origin.base_crc64)?;
        Ok(origin)
    }

    /// The text of `study.json`.
    fn manifest(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// The study of a folder, from what lies there alone.
    ///
    /// # Errors
    /// If this program does not make the same study of it.
    pub fn study(&self, folder: &Path) -> Result<Study, ResultsError> {
        let path = folder.join(STUDY_FILE);
        let changes = self.changes();
        let study = Study::parse(&self.source, &self.study_text, &changes)
            .map_err(|error| damaged(&path, format!("is no study: {error}")))?;
        if Self::new(&study, self.shard, &self.source, &changes) != *self {
            return Err(damaged(
                &path,
                "gives another study than study.json says, or the profile of its base has changed",
            ));
        }
        Ok(study)
    }

    /// Metadata of the Parquet file.
    pub(super) fn metadata(&self, command_line: &str) -> [(&'static str, String); 6] {
        // Texts alone: nothing can fail.
        let sets = serde_json::to_string(&self.sets).unwrap_or_default();
        [
            ("study", self.study.clone()),
            ("program", format!("hil-runner {}", self.version)),
            ("command_line", command_line.to_owned()),
            ("sets", sets),
            (STUDY_FILE, self.study_text.clone()),
            (BASE_FILE, self.base_text.clone()),
        ]
    }

    /// Writes the files; the manifest, by which a folder is known, comes last.
    pub(super) fn write(&self, folder: &Path) -> Result<(), ResultsError> {
        write_new(&folder.join(STUDY_FILE), &self.study_text)?;
        write_new(&folder.join(BASE_FILE), &self.base_text)?;
        write_new(&folder.join(MANIFEST), &self.manifest())
    }

    /// True of a file that [`Origin::write`] leaves where it is ended
    /// before the manifest is there.
    pub(super) fn has_begun(&self, folder: &Path, name: &str) -> bool {
        let is = |text: &str| fs::read(folder.join(name)).is_ok_and(|it| it == text.as_bytes());
        match name {
            STUDY_FILE => is(&self.study_text),
            BASE_FILE => is(&self.base_text),
            name => {
                (name.starts_with("study.") || name.starts_with("base.")) && name.ends_with(".part")
            }
        }
    }
}

/// All that the runs have of study and command line, and what lies in a file of its own.
fn keys_of_runs(study: &Study) -> String {
    let keys = study.sets.join("\n");
    let motion = &study.template().base().motion;
    match motion.course() {
        Course::Profile(_) => format!("{keys}\n{motion:?}"),
        _ => keys,
    }
}

/// Keys that every format has.
#[derive(Deserialize)]
struct Format {
    format: u32,
    version: String,
}

/// A text that must have this checksum.
fn text(path: &Path, crc: &str) -> Result<String, ResultsError> {
    let bytes = fs::read(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => damaged(path, "is missing"),
        _ => io(path)(error),
    })?;
    let found = crc64(&bytes);
    if found != crc {
        let words = "is not what was written: its checksum is";
        let words = format!("{words} {found}, and study.json has {crc}");
        return Err(damaged(path, words));
    }
    String::from_utf8(bytes).map_err(|_| damaged(path, "is no UTF-8 text"))
}

/// Writes a file that is complete or not there; what a killed study leaves of it
/// is written over.
fn write_new(path: &Path, text: &str) -> Result<(), ResultsError> {
    let unfinished = path.with_added_extension("part");
    fs::write(&unfinished, text)
        .and_then(|()| fs::rename(&unfinished, path))
        .map_err(io(path))
}

/// The shards with what made them, by number.
///
/// # Errors
/// If they are not all of one study, or one is damaged, missing or there twice.
pub fn shards_in_order(shards: &[PathBuf]) -> Result<Vec<(PathBuf, Origin)>, ResultsError> {
    let read = |path: &PathBuf| Ok((path.clone(), Origin::read(path)?));
    let found: Result<Vec<_>, ResultsError> = shards.iter().map(read).collect();
    let mut found = found?;
    found.sort_by_key(|(_, origin)| origin.shard.number);
    let Some((first_path, first)) = found.first() else {
        return Ok(found);
    };
    let of = first.shard.of;
    let refuse = |words: String| Err(ResultsError(words));
    for (path, origin) in &found {
        if !origin.is_same_study(first) || origin.shard.of != of {
            return refuse(format!(
                "{} and {} are not shards of the same study, cut into as many parts",
                first_path.display(),
                path.display()
            ));
        }
    }
    let numbers = found.iter().map(|(_, origin)| origin.shard.number);
    let numbers: Vec<u64> = numbers.collect();
    let missing: Vec<String> = (1..=of.min(1 << 20))
        .filter(|number| numbers.binary_search(number).is_err())
        .map(|number| format!("{number}/{of}"))
        .take(10)
        .collect();
    if !missing.is_empty() {
        return refuse(format!("shards are missing: {}", missing.join(", ")));
    }
    match numbers.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(twice) => refuse(format!("shard {}/{of} is given twice", twice[0])),
        None => Ok(found),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_the_blocks_without_gap_or_overlap() {
        for (blocks, of) in [(1, 1), (10, 3), (3, 10), (1_000_003, 7), (0, 2)] {
            let mut next = 0;
            for number in 1..=of {
                let range = Shard { number, of }.blocks(blocks);
                assert_eq!(range.start, next);
                next = range.end;
            }
            assert_eq!(next, blocks);
        }
    }

    #[test]
    fn a_shard_reads_as_it_shows() {
        let shard: Shard = "2/8".parse().unwrap();
        assert_eq!((shard.to_string().as_str(), shard.number), ("2/8", 2));
        for wrong in ["", "0/2", "3/2", "1", "a/b", "1/0", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
