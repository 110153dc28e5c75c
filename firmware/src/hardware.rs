//! The electronics of the axis through `embedded-hal` 1.0.
//!
//! ```text
//!  your loop, once per sample                     the board
//!  ─────────────────────────   board.rs: Board    ─────────────────────────
//!  inputs   ◄── emergency_stop, motor_register ── stop loop, LS7366R counter
//!  one tick of the controller
//!  outputs  ──► set_code, set_power ────────────► AD57x1R converter, enable
//! ```
//!
//! [`Board`] is all that a controller needs to know of its electronics. A board
//! of your own implements it: four methods, no registration, no macro. For
//! boards made of an LS7366R quadrature counter ([`ls7366r`]) and an AD5721R or
//! AD5761R converter ([`ad57x1r`]) it is implemented already: [`SpiBoard`].

pub mod ad57x1r;
pub mod board;
pub mod ls7366r;
pub mod spi_board;

pub use ad57x1r::{Ad57x1r, Ad57x1rError, Ad57x1rModel};
pub use board::{Board, serve};
pub use ls7366r::{CounterWidth, Ls7366r, Ls7366rError, Ls7366rStatus};
pub use spi_board::{Line, SpiBoard, SpiBoardError};
