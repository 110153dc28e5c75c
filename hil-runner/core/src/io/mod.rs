//! The firmware's own drivers over bit-true models of their chips.
//!
//! ```text
//!  position [counts] ──► LS7366R ──┐                ┌──► AD57x1R ──► code
//!                                  ├─ SPI, drivers ─┤
//!  emergency stop ────► line ──────┘   (firmware)   └──► line ─────► power
//! ```
//!
//! [`SpiIo`] wires it up: the controller has its [`Board`](firmware::Board) on
//! one side, the plant its position and code on the other, and every bit in
//! between goes through the drivers that a product would run.
//!
//! | file | thing |
//! | --- | --- |
//! | `ls7366r_chip.rs` | the counter |
//! | `ad57x1r_chip.rs` | the converter |
//! | `bus.rs` | SPI with faults |
//! | `pins.rs` | the two lines |
//! | `wiring.rs` | all of it together |

mod ad57x1r_chip;
mod bus;
mod ls7366r_chip;
mod pins;
mod wiring;

pub use ad57x1r_chip::{Ad57x1rChip, DacOutput};
pub use bus::{BusFault, ModelBus, ModelBusError, SpiChip, Spoiling};
pub use ls7366r_chip::Ls7366rChip;
pub use pins::{ModelPin, ModelPinError};
pub use wiring::{ModelBoard, Part, SpiIo, SpiIoError};
