//! `settings.csv`, a line for each setting that a tune has looked at, in order: its keys, its
//! figures and the runs that it took. A tune that was interrupted reads them back in the place
//! of runs and goes on.
//!
//! ```text
//! # what was tuned, as it was asked for: a tune of anything else does not go on here
//! controller.kp,controller.ki_per_s,peak_following_error_mm,…,runs
//! 3.2,5,3.4353,…,1
//! ```

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use hil_core::tune::problem::{Problem, Seen};

/// Name of the file.
const SETTINGS: &str = "settings.csv";

/// A file that cannot be gone on with.
#[derive(Debug, thiserror::Error)]
pub(super) enum SettingsError {
    /// It cannot be read or written, and why.
    #[error("{}: {}", .0.display(), .1)]
    Io(PathBuf, io::Error),
    /// It is that of another tune.
    #[error(
        "{} holds the settings of another tune: the case, [tune], --set or the program have changed; \
         give another --out, or remove the file", .0.display()
    )]
    Other(PathBuf),
    /// A line, from 1, is no setting of this tune, or not the one that comes next.
    #[error("{}:{}: this is not what the tune writes there; remove the file to begin anew", .0.display(), .1)]
    Damaged(PathBuf, usize),
}

/// A setting of the file: values, figures and runs.
type Line = (Vec<f64>, Vec<Option<f64>>, u64);

/// The settings of a tune.
#[derive(Debug)]
pub(super) struct SettingsFile {
    path: PathBuf,
    file: File,
    /// Line of its first setting, from 1.
    first: usize,
    known: Vec<Line>,
    read: usize,
}

impl SettingsFile {
    /// Opens the file in a folder, which is made if it is not there, and reads the settings
    /// that it has. `origin` says what is tuned: lines of text that begin the file.
    ///
    /// # Errors
    /// [`SettingsError`].
    pub(super) fn open(
        folder: &Path,
        origin: &str,
        problem: &Problem,
    ) -> Result<Self, SettingsError> {
        let path = folder.join(SETTINGS);
        let io = |error| SettingsError::Io(path.clone(), error);
        fs::create_dir_all(folder).map_err(io)?;
        let head = head(origin, problem);
        let mut options = OpenOptions::new();
        options.create(true).read(true).write(true).truncate(false);
        let mut file = options.open(&path).map_err(io)?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(io)?;
        let (first, mut known) = (head.lines().count() + 1, Vec::new());
        let mut whole = 0;
        if !head.as_bytes().starts_with(&text) {
            // A line without its end was cut off.
            let last = text.iter().rposition(|&byte| byte == b'\n');
            whole = last.map_or(0, |last| last + 1);
            let lines = core::str::from_utf8(&text[..whole]).ok();
            let Some(lines) = lines.and_then(|text| text.strip_prefix(head.as_str())) else {
                return Err(SettingsError::Other(path));
            };
            for (text, line) in lines.lines().zip(first..) {
                let damaged = || SettingsError::Damaged(path.clone(), line);
                known.push(parse(text, problem).ok_or_else(damaged)?);
            }
        }
        file.set_len(whole as u64).map_err(io)?;
        file.seek(SeekFrom::End(0)).map_err(io)?;
        if whole == 0 {
            file.write_all(head.as_bytes()).map_err(io)?;
        }
        let read = known.len();
        Ok(Self {
            path,
            file,
            first,
            known,
            read,
        })
    }

    /// Removes the file: of a tune that was refused before it had anything.
    ///
    /// # Errors
    /// [`SettingsError::Io`].
    pub(super) fn remove(&self) -> Result<(), SettingsError> {
        fs::remove_file(&self.path).map_err(|error| SettingsError::Io(self.path.clone(), error))
    }

    /// Settings that were there.
    pub(super) fn read(&self) -> usize {
        self.read
    }

    /// The settings in the order asked: those that are known, then those that `look` makes,
    /// which are written.
    ///
    /// # Errors
    /// [`SettingsError`]; the file has what was looked at before.
    pub(super) fn look(
        &mut self,
        problem: &mut Problem,
        mut settings: Vec<Vec<f64>>,
        look: impl FnOnce(&mut Problem, Vec<Vec<f64>>) -> Vec<Seen>,
    ) -> Result<Vec<Seen>, SettingsError> {
        let mut seen = Vec::with_capacity(settings.len());
        let next = self.first + self.read - self.known.len();
        let rest = settings.split_off(self.known.len().min(settings.len()));
        let known = self.known.drain(..settings.len()).zip(next..);
        for (asked, ((values, figures, runs), line)) in settings.into_iter().zip(known) {
            if asked != values {
                return Err(SettingsError::Damaged(self.path.clone(), line));
            }
            seen.push(problem.judge(values, figures, runs));
        }
        if rest.is_empty() {
            return Ok(seen);
        }
        let made = look(problem, rest);
        let lines: String = made.iter().map(line).collect();
        let written = self.file.write_all(lines.as_bytes());
        written.map_err(|error| SettingsError::Io(self.path.clone(), error))?;
        seen.extend(made);
        Ok(seen)
    }
}

/// The lines before the first setting.
fn head(origin: &str, problem: &Problem) -> String {
    let origin: String = origin.lines().map(|line| format!("# {line}\n")).collect();
    let keys = problem.variables.iter().map(|variable| variable.path());
    let figures = problem.figures().map(str::to_owned);
    let columns: Vec<String> = keys.chain(figures).chain(["runs".to_owned()]).collect();
    format!("{origin}{}\n", columns.join(","))
}

fn line(seen: &Seen) -> String {
    let values = seen.values.iter().map(|value| Some(*value));
    let figures = values.chain(seen.figures.iter().copied());
    let cells = figures.map(|value| value.map_or_else(String::new, |value| format!("{value:?}")));
    let cells: Vec<String> = cells.chain([seen.runs.to_string()]).collect();
    cells.join(",") + "\n"
}

fn parse(line: &str, problem: &Problem) -> Option<Line> {
    let cells: Vec<&str> = line.split(',').collect();
    let (values, rest) = cells.split_at_checked(problem.variables.len())?;
    let (runs, figures) = rest.split_last()?;
    let runs = runs.parse().ok()?;
    if runs > problem.corners.len() as u64 || figures.len() != problem.figures().count() {
        return None;
    }
    let number = |cell: &&str| cell.parse().ok().filter(|number: &f64| !number.is_nan());
    let figure = |cell: &&str| match *cell {
        "" => Some(None),
        _ => number(cell).map(Some),
    };
    let values = values.iter().map(number).collect::<Option<_>>()?;
    let figures = figures.iter().map(figure).collect::<Option<_>>()?;
    Some((values, figures, runs))
}
