//! Run files on disk: from a name or a path to the case, or a sentence that says
//! why not.

pub mod output;

use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use hil_core::case::Case;
use hil_core::runfile::{RunFile, RunFileErrors, builtin_names, builtin_text};

/// Largest file that is read \[bytes\]. Run files have a few kilobytes; the
/// bound keeps a wrong path such as `/dev/zero` from being read for ever.
const LARGEST_FILE: u64 = 1 << 20;

/// Reads a built-in case or a file and applies the overrides
/// `section.key=value` of the command line.
///
/// A built-in name always means the built-in case, even next to a file of
/// that name.
///
/// # Errors
/// Everything that is wrong with the file and the overrides.
pub fn run_file(name_or_path: &str, sets: &[String]) -> Result<RunFile, RunFileErrors> {
    RunFile::parse(name_or_path, &text(name_or_path)?, sets)
}

/// The case alone; see [`run_file`].
///
/// # Errors
/// As [`run_file`].
pub fn case(name_or_path: &str, sets: &[String]) -> Result<Case, RunFileErrors> {
    run_file(name_or_path, sets).map(|file| file.case)
}

/// The text of a built-in case or a file.
///
/// # Errors
/// One sentence if the file cannot be read.
pub fn text(name_or_path: &str) -> Result<Cow<'static, str>, RunFileErrors> {
    match builtin_text(name_or_path) {
        Some(text) => Ok(Cow::Borrowed(text)),
        None => read(name_or_path).map(Cow::Owned),
    }
}

/// The text of the file.
///
/// # Errors
/// One sentence if the file is missing, is not a file, cannot be read, is not
/// UTF-8 or is far too large.
fn read(path: &str) -> Result<String, RunFileErrors> {
    let refuse = |why: String| RunFileErrors::unreadable(path, why);
    if path.is_empty() {
        return Err(refuse("the name of the run file is empty".to_owned()));
    }
    if Path::new(path).is_dir() {
        return Err(refuse(
            "this is a directory; give a run file (TOML) or a built-in case".to_owned(),
        ));
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LARGEST_FILE + 1).read_to_end(&mut bytes))
        .map_err(|error| match error.kind() {
            ErrorKind::NotFound => refuse(not_found(path)),
            ErrorKind::PermissionDenied => refuse("no permission to read this file".to_owned()),
            _ => refuse(format!("cannot be read: {error}")),
        })?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(refuse(
            "more than 1 MiB; a run file has a few kilobytes".to_owned(),
        ));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let before = error.as_bytes().get(..good).unwrap_or_default();
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        refuse(format!(
            "not UTF-8 text (line {line}); save the file as UTF-8"
        ))
    })
}

fn not_found(path: &str) -> String {
    let with_extension = format!("{path}.toml");
    if Path::new(&with_extension).is_file() {
        return format!("there is no such file; did you mean {with_extension}?");
    }
    // `paper-1.toml` that is not there: the built-in case may be meant.
    let stem = path.strip_suffix(".toml").unwrap_or(path);
    if builtin_text(stem).is_some() {
        return format!("there is no such file; the built-in case is called {stem}");
    }
    let names: Vec<&str> = builtin_names().collect();
    format!(
        "there is no such file; the built-in cases are {}",
        names.join(", ")
    )
}
