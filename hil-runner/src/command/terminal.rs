//! The terminal: messages and tables of at most 100 columns, progress, and
//! signals.
//!
//! SIGINT (Ctrl-C), SIGTERM and SIGHUP end a run as an error does: the trace so
//! far is kept, unfinished files are removed. The sender is not known, so no
//! message names the user.

use std::io::{self, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Row, Table, TableStyle};
use hil_core::case::Case;
use hil_core::number::seconds;
use hil_core::trace;
use hil_runner::files::OutputFile;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// Writes formatted words to standard error.
macro_rules! tell {
    ($($words:tt)*) => {
        crate::command::terminal::print_error(&format!($($words)*))
    };
}

/// Writes formatted words to standard output.
macro_rules! say {
    ($($words:tt)*) => {
        crate::command::terminal::print(&format!($($words)*))
    };
}
pub(super) use {say, tell};

const WIDTH: u16 = 100;

/// Lines around the table and under its header only.
const STYLE: TableStyle = {
    let line = LineStyle::none().fill('─').junction('─');
    TableStyle::new()
        .top_border(line)
        .header_separator(line)
        .bottom_border(line)
};

/// Writes to standard output; a reader that hangs up is no error.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes());
    match written.and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Writes a value to standard output as JSON.
pub(super) fn print_json(value: &impl Serialize) -> io::Result<()> {
    OutputFile::create(Path::new("-"))?.write_json(value)
}

/// Writes a message to standard error; nobody there to read it is no error.
pub(crate) fn print_error(text: &str) {
    let mut stderr = io::stderr().lock();
    // There is nowhere left to complain.
    let _ = stderr.write_all(text.as_bytes());
}

/// The same of a line without its end.
pub(super) fn tell_line(line: &str) {
    tell!("{line}\n");
}

/// Prints a text, but to standard error where an output goes to standard output:
/// data stays alone there.
pub(super) fn print_beside(outputs: &[&Path], text: &str) -> io::Result<()> {
    if outputs.contains(&Path::new("-")) {
        print_error(text);
        return Ok(());
    }
    print(text)
}

/// A name that leaves room for the other columns.
pub(super) fn short(name: &str) -> String {
    const LONGEST: usize = 20;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST - 1).chain(['…']).collect()
}

/// A table, the first `names` columns left, the others right, without the padding
/// at the ends of its lines.
pub(super) fn table<R: Into<Row>>(
    header: impl IntoIterator<Item = impl AsRef<str>>,
    names: usize,
    rows: impl IntoIterator<Item = R>,
) -> String {
    let mut table = Table::new();
    table
        .load_style(STYLE)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH)
        .set_header(header.into_iter().map(|head| head.as_ref().to_owned()))
        .add_rows(rows);
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 1));
        if i >= names {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.trim_fmt() + "\n"
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static HANDLER: OnceLock<()> = OnceLock::new();

/// Status of an interrupted program, as shells have it.
const STATUS: i32 = 130;

/// Notes interrupts from now on: the first one is answered with these words, the second
/// one ends the program at once.
pub(super) fn watch_signals(words: &'static str) {
    HANDLER.get_or_init(|| {
        let handler = move || {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(STATUS);
            }
            print_error(words);
        };
        // Without a handler an interrupt ends the program as it always does.
        let _ = ctrlc::set_handler(handler);
    });
}

/// An error once the run was interrupted.
pub(super) fn check_signals() -> io::Result<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        return Err(io::Error::other("interrupted"));
    }
    Ok(())
}

/// Time before the first look at the bar, and between two: a run that is over at
/// once shows none.
const FIRST_LOOK: Duration = Duration::from_secs(1);
const NEXT_LOOK: Duration = Duration::from_millis(100);

/// A bar that follows a run by its rows, silent where stderr is no terminal;
/// gone when dropped.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
    rows: u32,
    next_look: Instant,
    limit: Option<TimeLimit>,
}

/// Wall-clock time that the program's runs may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimeLimit {
    end: Instant,
    limit_s: f64,
}

impl TimeLimit {
    /// A limit from now on; none that ends after the clock does.
    pub(super) fn new(limit_s: f64) -> Option<Self> {
        let end = Instant::now().checked_add(Duration::try_from_secs_f64(limit_s).ok()?)?;
        Some(Self { end, limit_s })
    }
}

impl Progress {
    pub(super) fn of(case: &Case) -> Self {
        Self::labelled(case, &case.name)
    }

    /// The same of the second run of a case.
    pub(super) fn again(case: &Case) -> Self {
        Self::labelled(case, &format!("{}, again", case.name))
    }

    /// The same under another name than that of the case.
    pub(super) fn labelled(case: &Case, label: &str) -> Self {
        let microseconds = case.run.duration_ns / 1000;
        let duration_s = seconds(case.run.duration_ns);
        let template = format!(
            "{{prefix}}: {{bar:30}} t = {{msg}} s of {duration_s} s ({{percent}} %), {{eta}} left"
        );
        Self::new(label, microseconds, &template)
    }

    /// The same, ended where a limit is reached.
    #[must_use]
    pub(super) fn within(mut self, limit: Option<TimeLimit>) -> Self {
        self.limit = limit;
        self
    }

    /// Follows so many rows that are no rows of a run.
    pub(super) fn of_rows(label: &str, rows: u64) -> Self {
        Self::new(label, rows, "{prefix}: {bar:30} {pos} rows, {eta} left")
    }

    fn new(label: &str, length: u64, template: &str) -> Self {
        watch_signals("");
        let bar = bar(label, length, template);
        Self {
            bar,
            rows: 0,
            next_look: Instant::now() + FIRST_LOOK,
            limit: None,
        }
    }

    /// A row was computed.
    ///
    /// # Errors
    /// If the run was interrupted, or has taken too long.
    pub(super) fn row(&mut self, row: &trace::Row) -> io::Result<()> {
        let now = self.step(|bar, _| {
            // In whole microseconds.
            bar.set_position((row.t_s / seconds(1000)) as u64);
            bar.set_message(format!("{:.3}", row.t_s));
        })?;
        match self.limit {
            Some(TimeLimit { end, limit_s }) if now >= end => Err(io::Error::other(format!(
                "stopped at t = {} s: --time-limit {limit_s} allows no more seconds; the rows up \
                 to there are in the trace, if one was asked for",
                row.t_s
            ))),
            _ => Ok(()),
        }
    }

    /// One of the rows that are no rows of a run.
    ///
    /// # Errors
    /// If the program was interrupted.
    pub(super) fn one(&mut self) -> io::Result<()> {
        self.step(|bar, rows| bar.set_position(rows.into()))?;
        Ok(())
    }

    /// Counts a row, and looks at the bar if it is time; the time now.
    fn step(&mut self, look: impl FnOnce(&ProgressBar, u32)) -> io::Result<Instant> {
        self.rows += 1;
        let now = Instant::now();
        if now >= self.next_look {
            look(&self.bar, self.rows);
            self.next_look = now + NEXT_LOOK;
        }
        check_signals()?;
        Ok(now)
    }
}

/// A bar of so many steps, gone when dropped.
pub(super) fn bar(label: &str, length: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length).with_prefix(label.to_owned());
    // A template that does not parse would leave the plain bar.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}
