//! Studies: one case over many values of its keys.
//!
//! ```text
//! study file ──► Study ──► plan ──► points ──► cases ──► lanes ──► rows ──► results (CSV, Parquet)
//!                 axes, rungs, limits                       threads      └──► pictures, report
//! ```

mod acting;
#[path = "plan/axis.rs"]
mod axis;
#[path = "page/base.rs"]
mod base;
mod border;
#[path = "rows/cell.rs"]
mod cell;
mod constraint;
#[path = "plan/mod.rs"]
mod definition;
mod differences;
#[path = "plan/distribution.rs"]
mod distribution;
mod draw;
mod drawable;
#[path = "page/pictures.rs"]
mod drawing;
#[path = "rows/engine.rs"]
mod engine;
mod feeding;
#[path = "read/file.rs"]
mod file;
#[path = "plan/loop_gain.rs"]
mod loop_gain;
#[path = "rows/beside.rs"]
mod margins;
#[path = "page/mod.rs"]
mod page;
pub mod picture;
#[path = "plan/points.rs"]
mod plan;
#[path = "read/axes.rs"]
mod read_axes;
#[path = "read/plan.rs"]
mod read_plan;
#[path = "read/ready.rs"]
pub mod ready;
#[path = "page/render.rs"]
pub mod report;
pub mod results;
#[path = "rows/mod.rs"]
mod row;
#[path = "page/tally.rs"]
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
