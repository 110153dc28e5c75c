//! Whether a source file has changed since the last build.

use std::fs;
use std::io;
use std::path::Path;
use std::time::SystemTime;

/// What goes into an image, from the project's folder: the firmware takes its
/// edition and the versions of its dependencies from the project's manifest.
const SOURCES: [&str; 6] = [
    "Cargo.toml",
    "firmware/Cargo.toml",
    "firmware/src",
    "firmware/link/Cargo.toml",
    "firmware/link/src",
    "firmware/cortex-m",
];

/// Whether any source in `project` is as new as `stamp` or newer. A stamp or a
/// source that cannot be read counts as changed.
pub(super) fn newer_than(stamp: &Path, project: &Path) -> bool {
    let Ok(built) = fs::metadata(stamp).and_then(|stamp| stamp.modified()) else {
        return true;
    };
    SOURCES
        .iter()
        .any(|source| changed_since(built, &project.join(source)).unwrap_or(true))
}

/// A folder's own time tells of files that were added or removed.
fn changed_since(built: SystemTime, path: &Path) -> io::Result<bool> {
    let metadata = fs::metadata(path)?;
    // Equal times may hide a change: file systems count in milliseconds.
    if metadata.modified()? >= built {
        return Ok(true);
    }
    if !metadata.is_dir() {
        return Ok(false);
    }
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        let name = entry.file_name();
        // Built files, and an editor's or a file manager's own.
        if name == "target" || name.as_encoded_bytes().starts_with(b".") {
            continue;
        }
        if changed_since(built, &entry.path())? {
            return Ok(true);
        }
    }
    Ok(false)
}
