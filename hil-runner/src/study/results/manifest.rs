//! `study.json`: which study a folder belongs to, and which part of it.

use core::fmt;
use core::ops::Range;
use core::str::FromStr;
use std::path::Path;

use crc::{CRC_64_XZ, Crc};
use serde::{Deserialize, Serialize};

use super::origin::crc32;
use super::{ResultsError, io};
use crate::command_line::{command_line, each_with};
use crate::study::definition::{Changes, Study};
use crate::study::row::columns;
use hil_core::case::Law;

/// Changes whenever the same study file would give other bytes.
const FORMAT: u32 = 2;

/// A part of a study: number `number` of `of` parts, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which part.
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

/// What `study.json` says.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Name of the study.
    pub study: String,
    /// Version of this file and of all that decides the bytes of the results.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Checksum of the study file, the base case and the changes of the command
    /// line.
    pub fingerprint: String,
    /// Rows of the whole study.
    pub rows: u64,
    /// Rows of a block.
    pub block_rows: u64,
    /// Which part of the study lies here.
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
    /// Checksum of `study.toml`.
    pub study_crc32: String,
    /// Checksum of `base.toml`.
    pub base_crc32: String,
    /// Checksum of this file, with this key empty.
    crc32: String,
}

impl Manifest {
    /// That of a study, or a part of it.
    pub fn new(study: &Study, shard: Shard, source: &str, changes: &Changes) -> Self {
        let manifest = Self {
            study: study.name.clone(),
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            fingerprint: fingerprint(study),
            rows: study.rows(),
            block_rows: study.block_rows(),
            shard,
            source: source.to_owned(),
            base: changes.base.clone(),
            sets: changes.sets.clone(),
            rungs: changes
                .rungs
                .as_ref()
                .map(|laws| laws.iter().map(|law| law.name().to_owned()).collect()),
            columns: columns(study)
                .into_iter()
                .map(|column| column.name)
                .collect(),
            study_crc32: crc32(study.text.as_bytes()),
            base_crc32: crc32(study.base_text().as_bytes()),
            crc32: String::new(),
        };
        manifest.signed()
    }

    /// With the checksum that belongs to it.
    fn signed(mut self) -> Self {
        self.crc32.clear();
        self.crc32 = crc32(self.text().as_bytes());
        self
    }

    /// What the command line had added to the study.
    pub fn changes(&self) -> Changes {
        Changes {
            base: self.base.clone(),
            sets: self.sets.clone(),
            rungs: self
                .rungs
                .as_ref()
                .map(|names| names.iter().filter_map(|name| Law::find(name)).collect()),
            ..Changes::default()
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

    /// Blocks of the whole study.
    pub fn blocks(&self) -> u64 {
        self.rows.div_ceil(self.block_rows)
    }

    /// Rows of a block.
    pub fn rows_of(&self, block: u64) -> Range<u64> {
        let first = block * self.block_rows;
        first..(first + self.block_rows).min(self.rows)
    }

    /// Blocks that lie here once all is done.
    pub fn own_blocks(&self) -> Range<u64> {
        self.shard.blocks(self.blocks())
    }

    /// Rows that lie here once all is done.
    pub fn own_rows(&self) -> Range<u64> {
        let blocks = self.own_blocks();
        (blocks.start * self.block_rows).min(self.rows)
            ..(blocks.end * self.block_rows).min(self.rows)
    }

    /// The same for all of the study.
    pub fn whole(&self) -> Self {
        let whole = Self {
            shard: Shard::WHOLE,
            ..self.clone()
        };
        whole.signed()
    }

    /// Whether the rows are those of the same study, wherever its file and its
    /// base lie.
    pub fn is_same_study(&self, other: &Self) -> bool {
        let placed = Self {
            source: self.source.clone(),
            base: self.base.clone(),
            ..other.whole()
        };
        self.whole() == placed.signed()
    }

    /// Reads the manifest of a folder.
    ///
    /// # Errors
    /// If there is none, it is not what was written, or another version of the
    /// program has written it.
    pub fn read(folder: &Path) -> Result<Self, ResultsError> {
        let path = folder.join("study.json");
        let (shown, path_shown) = (folder.display(), path.display());
        let damaged = |words: String| ResultsError::Damaged(format!("{path_shown} {words}"));
        let other = |version: &str| {
            ResultsError::Other(format!(
                "{shown} holds results of version {version}, not {}; give another folder with --out, or remove this one",
                env!("CARGO_PKG_VERSION")
            ))
        };
        let bytes = std::fs::read(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => ResultsError::Other(format!(
                "{shown} holds no results of a study: {path_shown} is missing"
            )),
            _ => io(&path, &error),
        })?;
        let manifest: Self = serde_json::from_slice(&bytes).map_err(|error| {
            // Another format has other keys.
            match serde_json::from_slice(&bytes) {
                Ok(Format { format, version }) if format != FORMAT => other(&version),
                _ => damaged(format!("is not what was written: {error}")),
            }
        })?;
        if manifest.clone().signed().text().as_bytes() != bytes {
            return Err(damaged(
                "is not what was written: its checksum is that of another text".to_owned(),
            ));
        }
        if (manifest.format, manifest.version.as_str()) != (FORMAT, env!("CARGO_PKG_VERSION")) {
            return Err(other(&manifest.version));
        }
        Ok(manifest)
    }

    /// The manifest as it is written.
    pub(super) fn text(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// What every format has.
#[derive(Deserialize)]
struct Format {
    format: u32,
    version: String,
}

/// A checksum of all that decides what the rows are.
fn fingerprint(study: &Study) -> String {
    let crc = Crc::<u64>::new(&CRC_64_XZ);
    let mut digest = crc.digest();
    let mut add = |text: &str| {
        // With its length, so that no two lists of texts run into the same one.
        digest.update(&(text.len() as u64).to_le_bytes());
        digest.update(text.as_bytes());
    };
    add(&study.name);
    add(&study.text);
    for (law, template) in &study.rungs {
        add(law.name());
        add(template.text());
    }
    for set in &study.sets {
        add(set);
    }
    format!("{:016x}", digest.finalize())
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
