//! Studies: one case over many values of its keys.
//!
//! ```text
//! study file ──► read ──► plan: points ──► cases ──► rows ──► results (CSV, Parquet)
//!                          axes, rungs      lanes, threads └──► page: tally, pictures
//! ```
//!
//! `plan` what is to be run, `rows` the runs and their figures, `page` what is
//! shown of them, `read` the study file, `results` the folder on the disk; each
//! knows those before it. `picture` draws, and knows none of them.

mod page;
pub mod picture;
mod plan;
mod read;
pub mod results;
mod rows;

pub use hil_core::distribution::{Distribution, Normal};
pub use page::base::base_sentences;
pub use page::pictures::{MOST_ROWS, Specified, specify};
pub use page::rows::PageRows;
pub use page::tally::{Best, RungTally, Spread as FigureSpread, Tally};
pub use page::{
    FigureTable, StudyPageError, best_table, enough_pass, figure_rows, render, unstable_words,
};
pub use plan::axis::{Axis, AxisValue, Range, Scale, Setting, Spread};
pub use plan::points::{Constraint, MOST_SOBOL_AXES, Plan, PlanKind, Position};
pub use plan::{Changes, LoopGain, Point, Study, Theory};
pub use read::file::StudyFileError;
pub use read::ready;
pub use read::schema::schema;
pub use rows::cell::{Cell, Column, ColumnKind};
pub use rows::engine::{Block, EngineError, make};
pub use rows::{PlannedRow, RowMaker, Status, columns};
