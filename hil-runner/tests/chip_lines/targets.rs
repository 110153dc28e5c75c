//! Targets that a test can run.

use hil_runner::chip;
use hil_runner::chip::spec::{Target, Transport};

/// Says that a test was left out, and why; fails it where nothing may be:
/// `CHIP_TESTS=required`.
pub(crate) fn left_out(test: &str, because: &str) {
    assert!(
        std::env::var_os("CHIP_TESTS").is_none_or(|value| value != "required"),
        "{test} must not be left out: {because}"
    );
    // Standard error of a test is captured, its file is not.
    let line = format!("left out: {test} because {because}\n");
    let _ = std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes());
}

/// The targets that can be run here; tells of each that cannot.
pub(crate) fn targets(test: &str, transport: Transport) -> Vec<Target> {
    let mut here = Vec::new();
    for (target, there) in chip::installed(transport) {
        match there {
            Ok(()) => here.push(target),
            Err(error) => left_out(&format!("{test} on {}", target.name()), &error.to_string()),
        }
    }
    here
}
