//! Golden vectors: what the axis gives for stored inputs, number by number, on
//! every processor.
//!
//! The files are `firmware/link/vectors/*.txt`, their format is in the `README.md`
//! beside them. Whoever brings the controller to another processor replays them
//! there, with [`replay()`] on the processor itself, or row by row from a host
//! that has it at the end of a line: [`rows()`] needs no axis.
//!
//! ```
//! use firmware_link::vectors::{What, replay};
//!
//! // Kp = 2 codes per count behind 12 bits; 10 counts behind its setpoint.
//! let file = "\
//! dac_bits = 12
//! kp = 1073741824 29
//!
//! ES 0 0 - 0 0 next 0 0 0 | 0 0 moving 1 0 -
//! - 1 90 - 0 0 last 100 0 0 | 20 10 holding 1 0 -
//! ";
//! assert_eq!(replay(file), Ok(2));
//!
//! // One code of it is another.
//! let other = file.replace("| 20 10", "| 21 10");
//! let mismatch = replay(&other).unwrap_err();
//! assert_eq!((mismatch.line, mismatch.what), (5, What::Outputs));
//! ```

mod replay;
mod row;
mod rows;
mod settings;

pub use replay::replay;
pub use row::{Given, Wanted};
pub use rows::{Mismatch, Row, Rows, What, rows};
pub use settings::Settings;
