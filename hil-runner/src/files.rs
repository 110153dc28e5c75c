//! Files on disk. Run files: from a name or a path to the case, or a sentence that
//! says why not. Output files: found writable before the run, and renamed into
//! place after it. What stood at the path before stays until then; a file that is
//! never committed is removed, unless the program is killed outright and leaves a
//! `.part` beside it.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crc::{CRC_64_XZ, Crc};
use hil_core::case::Case;
use hil_core::runfile::{RunFile, RunFileErrors, builtin_names, builtin_text, file_beside};
use serde::Serialize;
use tempfile::NamedTempFile;

/// Largest file that is read \[bytes\]. Run files have a few kilobytes; the
/// bound keeps a wrong path such as `/dev/zero` from being read for ever.
const LARGEST_FILE: u64 = 1 << 20;

/// Usual size of run files.
const OF_RUN_FILE: &str = "a run file has a few kilobytes";

/// The name of standard input among outputs and run files.
const STANDARD: &str = "-";

/// The name of a run file that came over standard input, in messages and of its
/// run.
const STDIN: &str = "stdin";

/// Reads a built-in case, a file or, as `-`, standard input, and applies the
/// overrides `section.key=value` of the command line.
///
/// A built-in name always means the built-in case, even next to a file of
/// that name. Standard input is read once; it is the same at every later call.
///
/// # Errors
/// Everything that is wrong with the file and the overrides.
pub fn run_file(name_or_path: &str, sets: &[String]) -> Result<RunFile, RunFileErrors> {
    let (name, text) = named_text(name_or_path)?;
    RunFile::parse(name, &text, sets, profile)
}

/// The name in messages and the text of what [`run_file`] reads.
///
/// # Errors
/// One sentence if it cannot be read.
pub fn named_text(name_or_path: &str) -> Result<(&str, Cow<'static, str>), RunFileErrors> {
    if name_or_path != STANDARD {
        return Ok((name_or_path, text(name_or_path)?));
    }
    static TEXT: OnceLock<Result<String, RunFileErrors>> = OnceLock::new();
    let text = TEXT.get_or_init(|| {
        let text = text_of(io::stdin(), OF_RUN_FILE);
        text.map_err(|why| RunFileErrors::unreadable(STDIN, why))
    });
    let text = text.as_ref().map_err(Clone::clone)?;
    Ok((STDIN, Cow::Borrowed(text)))
}

/// The case alone; see [`run_file`].
///
/// # Errors
/// As [`run_file`].
pub fn case(name_or_path: &str, sets: &[String]) -> Result<Case, RunFileErrors> {
    run_file(name_or_path, sets).map(|file| file.case)
}

/// The text of a built-in case or a file that can be read again.
///
/// # Errors
/// One sentence if the file cannot be read, or is standard input.
pub fn text(name_or_path: &str) -> Result<Cow<'static, str>, RunFileErrors> {
    match builtin_text(name_or_path) {
        Some(text) => Ok(Cow::Borrowed(text)),
        None => read(name_or_path).map(Cow::Owned),
    }
}

/// The text of a file that a run file names, relative to its folder; see
/// [`Beside`](hil_core::runfile::Beside).
///
/// # Errors
/// The sentence that says why there is none.
pub fn profile(run_file: &str, path: &str) -> Result<String, String> {
    let file = file_beside(run_file, path);
    if file.is_dir() {
        return Err(format!("{} is a directory", file.display()));
    }
    let missing = || "there is no such file".to_owned();
    let text = contents(&file, missing, "a profile has some thousand points");
    text.map_err(|why| format!("{}: {why}", file.display()))
}

/// The text of the file.
///
/// # Errors
/// One sentence if the file is missing, is not a file or has no text.
fn read(path: &str) -> Result<String, RunFileErrors> {
    let refuse = |why| RunFileErrors::unreadable(path, why);
    let file = Path::new(path);
    let why = match path {
        "" => "the name of the run file is empty",
        _ if file.is_dir() => "this is a directory; give a run file (TOML) or a built-in case",
        STANDARD => "standard input is read once, and this needs its base again; give a run file",
        _ => return contents(file, || not_found(path), OF_RUN_FILE).map_err(refuse),
    };
    Err(refuse(why.to_owned()))
}

/// The text of a file, or why there is none; `usual` says how large such files are.
fn contents(path: &Path, missing: impl FnOnce() -> String, usual: &str) -> Result<String, String> {
    let file = File::open(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => missing(),
        ErrorKind::PermissionDenied => "no permission to read this file".to_owned(),
        _ => format!("cannot be read: {error}"),
    })?;
    text_of(file, usual)
}

/// What a file or standard input has, or why that is no text.
fn text_of(source: impl Read, usual: &str) -> Result<String, String> {
    let mut bytes = Vec::new();
    let read = source.take(LARGEST_FILE + 1).read_to_end(&mut bytes);
    read.map_err(|error| format!("cannot be read: {error}"))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(format!("more than 1 MiB; {usual}"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let before = error.as_bytes().get(..good).unwrap_or_default();
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        format!("not UTF-8 text (line {line}); save the file as UTF-8")
    })
}

/// Largest log that is read \[bytes\]: all of it goes into the page.
const LARGEST_LOG: u64 = 64 << 20;

/// The text of a measured log.
///
/// # Errors
/// If it cannot be read, is not UTF-8 or larger than 64 MiB.
pub fn log_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let read = File::open(path)?
        .take(LARGEST_LOG + 1)
        .read_to_string(&mut text)?;
    if read as u64 > LARGEST_LOG {
        return Err(io::Error::other(
            "more than 64 MiB; a part of the log is allowed",
        ));
    }
    Ok(text)
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
    let names = builtin_names().collect::<Vec<_>>().join(", ");
    format!("there is no such file; the built-in cases are {names}")
}

/// A file that appears under its name when it is committed.
#[derive(Debug)]
pub struct OutputFile {
    sink: BufWriter<Sink>,
    path: PathBuf,
}

#[derive(Debug)]
enum Sink {
    /// `-`: standard output.
    Stdout(io::Stdout),
    /// A device or pipe, written as it is.
    Direct(File),
    /// A new file beside the target, renamed to it on commit.
    Renamed(NamedTempFile, PathBuf),
}

impl OutputFile {
    /// Prepares to write to `path`; `-` is standard output.
    ///
    /// # Errors
    /// If the path cannot be written: the sentence names it.
    pub fn create(path: &Path) -> io::Result<Self> {
        let sink = sink(path).map_err(|error| named(path, &error))?;
        Ok(Self {
            sink: BufWriter::new(sink),
            path: path.to_owned(),
        })
    }

    /// Writes the whole contents of the file and commits it.
    ///
    /// # Errors
    /// As [`OutputFile::commit`].
    pub fn write_whole(mut self, text: &str) -> io::Result<()> {
        self.write_all(text.as_bytes())?;
        self.commit()
    }

    /// Writes a value as JSON, on lines that a reader can follow, and commits the
    /// file.
    ///
    /// # Errors
    /// As [`OutputFile::commit`].
    pub fn write_json(self, value: &impl Serialize) -> io::Result<()> {
        self.write_whole(&(serde_json::to_string_pretty(value)? + "\n"))
    }

    /// Makes what was written so far appear at the path.
    ///
    /// # Errors
    /// If the last bytes cannot be written or the file cannot be renamed.
    pub fn commit(self) -> io::Result<()> {
        let path = self.path;
        let commit = |sink: BufWriter<Sink>| -> io::Result<()> {
            let mut sink = sink.into_inner().map_err(|error| error.into_error())?;
            sink.flush()?;
            if let Sink::Renamed(file, target) = sink {
                file.persist(target).map_err(|error| error.error)?;
            }
            Ok(())
        };
        commit(self.sink).map_err(|error| named(&path, &error))
    }
}

/// The error with the path that it is about.
fn named(path: &Path, error: &io::Error) -> io::Error {
    let path = path.display();
    io::Error::new(error.kind(), format!("{path} cannot be written: {error}"))
}

/// True if two paths lead to the same file, be it there yet or not. A device
/// or pipe is no file: nothing is lost if two outputs go there.
pub fn same_file(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| -> Option<PathBuf> {
        if path == Path::new("-") {
            return Some(path.to_owned());
        }
        let path = target_of(path).ok()?;
        match fs::metadata(&path) {
            Ok(meta) if !meta.is_file() => None,
            Ok(_) => fs::canonicalize(path).ok(),
            Err(_) => {
                let folder = fs::canonicalize(folder_of(&path)).ok()?;
                Some(folder.join(path.file_name()?))
            }
        }
    };
    place(one).is_some_and(|one| place(other) == Some(one))
}

/// The folder that a path lies in.
fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.sink.write(bytes);
        written.map_err(|error| named(&self.path, &error))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.sink.flush().map_err(|error| named(&self.path, &error))
    }
}

impl Sink {
    /// Does something to it; a reader of standard output that hangs up has what it wanted.
    fn with<T>(
        &mut self,
        hung_up: T,
        act: impl FnOnce(&mut dyn Write) -> io::Result<T>,
    ) -> io::Result<T> {
        match self {
            Self::Stdout(stdout) => match act(stdout) {
                Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(hung_up),
                result => result,
            },
            Self::Direct(file) => act(file),
            Self::Renamed(file, _) => act(file),
        }
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.with(bytes.len(), |sink| sink.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.with((), |sink| sink.flush())
    }
}

fn sink(path: &Path) -> io::Result<Sink> {
    if path == Path::new("-") {
        return Ok(Sink::Stdout(io::stdout()));
    }
    let target = target_of(path)?;
    match fs::metadata(&target) {
        Ok(meta) if meta.is_dir() => Err(io::Error::other("it is a folder")),
        Ok(meta) if meta.is_file() && meta.permissions().readonly() => {
            Err(io::Error::other("the file is read-only"))
        }
        Ok(meta) if !meta.is_file() => Ok(Sink::Direct(File::options().write(true).open(&target)?)),
        _ => match beside(&target) {
            Ok(file) => Ok(Sink::Renamed(file, target)),
            Err(error) if target != path => {
                let why = format!("it is a link to {}: {error}", target.display());
                Err(io::Error::new(error.kind(), why))
            }
            Err(error) => Err(error),
        },
    }
}

/// A new file beside `path`, named after it, with the permissions of the file
/// that it will replace, or those that any new file would have.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    let name = path.file_name().unwrap_or_default();
    let mut prefix = name.to_owned();
    prefix.push(".");
    builder.prefix(&prefix).suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder_of(path)).map_err(|error| {
        // Without the name of the temporary file, which means nothing to a
        // reader.
        let why = match error.kind() {
            ErrorKind::NotFound => "its folder does not exist".to_owned(),
            kind => kind.to_string(),
        };
        io::Error::new(error.kind(), why)
    })?;
    if let Ok(meta) = fs::metadata(path) {
        file.as_file().set_permissions(meta.permissions())?;
    }
    Ok(file)
}

/// The path with links followed, so that a rename replaces what the link points
/// at, be it there yet or not, and never the link.
fn target_of(path: &Path) -> io::Result<PathBuf> {
    /// As many links as Linux follows.
    const MOST_LINKS: usize = 40;
    // The system knows the way better, such as that of /dev/stdout to a pipe.
    if fs::metadata(path).is_ok() {
        return Ok(fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()));
    }
    let mut target = path.to_owned();
    for _ in 0..=MOST_LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = target.with_file_name(next),
            // No link, or nothing at all.
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("its links lead in a circle"))
}

/// CRC-64/XZ of bytes in sixteen hexadecimal digits.
pub fn crc64(bytes: &[u8]) -> String {
    format!("{:016x}", Crc::<u64>::new(&CRC_64_XZ).checksum(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_old_file_until_the_new_one_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.csv");
        fs::write(&path, "old").unwrap();
        let mut file = OutputFile::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        file.commit().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// A link stays one, whether what it points at is there yet or not.
    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_stay() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let is_link = |name: &str| fs::symlink_metadata(place(name)).unwrap().is_symlink();
        let write = |name: &str| -> io::Result<()> {
            let mut file = OutputFile::create(&place(name))?;
            file.write_all(b"data")?;
            file.commit()
        };
        fs::create_dir(place("data")).unwrap();
        // Over another link, relative to its own folder.
        symlink("data/second", place("first")).unwrap();
        symlink("trace.csv", place("data/second")).unwrap();
        assert!(same_file(&place("first"), &place("data/trace.csv")));
        for _ in ["not there yet", "there already"] {
            write("first").unwrap();
            assert_eq!(fs::read(place("data/trace.csv")).unwrap(), b"data");
            assert!(is_link("first") && is_link("data/second"));
            fs::write(place("data/trace.csv"), "old").unwrap();
        }
        symlink(place("data/other.csv"), place("absolute")).unwrap();
        write("absolute").unwrap();
        assert_eq!(fs::read(place("data/other.csv")).unwrap(), b"data");
        symlink("/dev/null", place("null")).unwrap();
        write("null").unwrap();
        assert!(is_link("null") && !Path::new("/dev/null").is_file());
        // What cannot be written has its sentence, and stays a link.
        symlink("nowhere/trace.csv", place("lost")).unwrap();
        symlink("circle", place("circle")).unwrap();
        symlink("/dev/full", place("full")).unwrap();
        for (name, why) in [
            ("lost", "nowhere/trace.csv: its folder does not exist"),
            (
                "circle",
                "circle cannot be written: its links lead in a circle",
            ),
            (
                "full",
                "full cannot be written: No space left on device (os error 28)",
            ),
        ] {
            let told = write(name).unwrap_err().to_string();
            assert!(told.ends_with(why), "{told}");
            assert!(is_link(name));
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 7);
        assert_eq!(fs::read_dir(place("data")).unwrap().count(), 3);
    }

    #[test]
    fn names_a_path_that_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/trace.csv");
        let error = OutputFile::create(&missing).unwrap_err().to_string();
        let words = "no/such/trace.csv cannot be written: its folder does not exist";
        assert!(error.ends_with(words), "{error}");
        let error = OutputFile::create(folder.path()).unwrap_err().to_string();
        let words = "cannot be written: it is a folder";
        assert!(error.ends_with(words), "{error}");
    }
}
