//! Studies: one case over many values of its keys.
//!
//! ```text
//! study file ──► Study ──► plan ──► points ──► cases ──► lanes ──► rows ──► results (CSV, Parquet)
//!                 axes, rungs, limits                       threads      └──► pictures, report
//! ```

mod acting;
mod axis;
mod base;
mod border;
mod cell;
mod constraint;
mod definition;
mod differences;
mod distribution;
mod draw;
mod drawable;
mod drawing;
mod engine;
mod feeding;
mod file;
mod loop_gain;
mod margins;
mod page;
pub mod picture;
mod plan;
mod read_axes;
mod read_plan;
pub mod ready;
pub mod report;
pub mod results;
mod row;
mod tally;
mod theory;

pub use axis::{Axis, AxisValue, Chosen, Scale, Spread};
pub use base::sentences as base_sentences;
pub use cell::{Cell, Column, ColumnKind};
pub use constraint::Constraint;
pub use definition::{Changes, LoopGain, Point, Study};
pub use distribution::Distribution;
pub use drawing::{Drawn, MOST_ROWS, draw};
pub use engine::{Block, EngineError, make};
pub use file::StudyFileError;
pub use page::{best_table, enough_pass, figure_rows, page, unstable_words};
pub use plan::{MOST_SOBOL_AXES, Plan, PlanError, PlanKind, Position};
pub use row::{PlannedRow, RowMaker, Status, columns};
pub use tally::{Best, RungTally, Spread as FigureSpread, Tally};
pub use theory::Theory;
