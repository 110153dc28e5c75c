//! What made the results of a folder: `study.toml`, `base.toml`, `study.json`.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::Path;

use super::journal::checksum;
use super::manifest::{Manifest, Shard};
use super::{ResultsError, io};
use crate::files::output::OutputFile;
use crate::study::definition::{Changes, Study};

/// Names of the texts that the manifest has the checksums of.
pub(super) const STUDY_FILE: &str = "study.toml";
pub(super) const BASE_FILE: &str = "base.toml";

/// All that a study and its rows are made from, wherever the files lie that it
/// was read from first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// Which study, and which part of it.
    pub manifest: Manifest,
    /// The study file as it was run.
    pub study_text: String,
    /// The run file of the base case.
    pub base_text: String,
}

impl Origin {
    /// That of a study, or a part of it.
    pub fn new(study: &Study, shard: Shard, source: &str, changes: &Changes) -> Self {
        Self {
            manifest: Manifest::new(study, shard, source, changes),
            study_text: study.text.clone(),
            base_text: study.base_text().to_owned(),
        }
    }

    /// Reads that of a folder.
    ///
    /// # Errors
    /// If a file of it is missing, or is not what was written.
    pub fn read(folder: &Path) -> Result<Self, ResultsError> {
        let manifest = Manifest::read(folder)?;
        let study_text = text(&folder.join(STUDY_FILE), &manifest.study_crc32)?;
        let base_text = text(&folder.join(BASE_FILE), &manifest.base_crc32)?;
        Ok(Self {
            manifest,
            study_text,
            base_text,
        })
    }

    /// The study of a folder, from what lies there alone.
    ///
    /// # Errors
    /// If this program does not make the same study of it.
    pub fn study(&self, folder: &Path) -> Result<Study, ResultsError> {
        let path = folder.join(STUDY_FILE);
        let damaged = |words: String| ResultsError::Damaged(format!("{}: {words}", path.display()));
        let Manifest { source, shard, .. } = &self.manifest;
        let changes = Changes {
            base_text: Some(self.base_text.clone()),
            ..self.manifest.changes()
        };
        let study = Study::parse(source, &self.study_text, &changes)
            .map_err(|error| damaged(error.to_string()))?;
        if Manifest::new(&study, *shard, source, &changes) != self.manifest {
            return Err(damaged(
                "gives another study than study.json says".to_owned(),
            ));
        }
        Ok(study)
    }

    /// The same for all of the study.
    #[must_use]
    pub fn whole(&self) -> Self {
        Self {
            manifest: self.manifest.whole(),
            ..self.clone()
        }
    }

    /// What the Parquet copy says of itself.
    pub(super) fn metadata(&self, command_line: &str) -> [(&'static str, String); 6] {
        let Manifest {
            study,
            version,
            sets,
            ..
        } = &self.manifest;
        [
            ("study", study.clone()),
            ("program", format!("hil-runner {version}")),
            ("command_line", command_line.to_owned()),
            // Texts alone: nothing can fail.
            ("sets", serde_json::to_string(sets).unwrap_or_default()),
            (STUDY_FILE, self.study_text.clone()),
            (BASE_FILE, self.base_text.clone()),
        ]
    }

    /// Writes the files; the manifest, by which a folder is known, comes last.
    pub(super) fn write(&self, folder: &Path) -> Result<(), ResultsError> {
        write_new(&folder.join(STUDY_FILE), &self.study_text)?;
        write_new(&folder.join(BASE_FILE), &self.base_text)?;
        write_new(&folder.join("study.json"), &self.manifest.text())
    }

    /// Whether a file is one that [`Origin::write`] leaves where it is ended
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

/// The checksum of a text as the manifest has it.
pub(super) fn crc32(text: &[u8]) -> String {
    format!("{:08x}", checksum(text))
}

/// A text that must have this checksum.
fn text(path: &Path, crc: &str) -> Result<String, ResultsError> {
    let damaged = |words: String| ResultsError::Damaged(format!("{} {words}", path.display()));
    let bytes = fs::read(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => damaged("is missing".to_owned()),
        _ => io(path, &error),
    })?;
    let found = crc32(&bytes);
    if found != crc {
        return Err(damaged(format!(
            "is not what was written: its checksum is {found}, and study.json has {crc}"
        )));
    }
    String::from_utf8(bytes).map_err(|_| damaged("is no UTF-8 text".to_owned()))
}

/// Writes a file that is complete or not there.
fn write_new(path: &Path, text: &str) -> Result<(), ResultsError> {
    let write = || -> std::io::Result<()> {
        let mut file = OutputFile::create(path)?;
        file.write_all(text.as_bytes())?;
        file.commit()
    };
    // The sentence names the path already.
    write().map_err(|error| ResultsError::Io(error.to_string()))
}
