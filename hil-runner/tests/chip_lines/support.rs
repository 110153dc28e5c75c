//! Parts that the tests of the lines share.

use std::time::{Duration, Instant};

/// True if `condition` comes true within `limit`.
pub(crate) fn within(limit: Duration, mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() > limit {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    true
}

/// Processes that work in a folder, or did until it was removed.
#[cfg(target_os = "linux")]
pub(crate) fn processes_in(folder: &std::path::Path) -> Vec<u32> {
    let folder = folder.to_str().unwrap();
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc").unwrap().flatten() {
        let Some(id) = entry
            .file_name()
            .to_str()
            .and_then(|name| name.parse().ok())
        else {
            continue;
        };
        // A process that has just ended has no folder.
        let at = std::fs::read_link(entry.path().join("cwd")).unwrap_or_default();
        if at.to_string_lossy().starts_with(folder) {
            found.push(id);
        }
    }
    found
}

/// Sends a signal as a user does.
#[cfg(unix)]
pub(crate) fn signal(name: &str, process: &str) {
    let kill = std::process::Command::new("kill")
        .args(["-s", name, "--", process])
        .status();
    assert!(kill.unwrap().success());
}
