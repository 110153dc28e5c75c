//! The line between a host and the controller on its chip.
//!
//! ```text
//!  host                                    chip
//!  HELLO session ─────────────────────►    forgets what was
//!        ◄─── identity: version, image     
//!  1: SETTINGS, 2: MEMORY, … ─────────►    checks, each in its turn
//!        ◄──────────────────────── TAKEN
//!  n: BEGIN, CRC of all of them ──────►    compares
//!        ◄──────────────────────── TAKEN
//!  n+1: STEP register, events ────────►    one sample
//!        ◄─── STEPPED code, error, state
//! ```
//!
//! One request is under way at a time, so the plant's time stands still until
//! the answer is there, however slow the line is.
//!
//! # Promises
//!
//! * A request acts once. It has a number; the one that was carried out last is
//!   answered again from memory, any other is refused ([`Nak::Number`]).
//! * A damaged frame is never acted on ([`frame`]): the chip says so
//!   ([`Nak::Damaged`]) and the host asks again, or asks again when no answer
//!   came in time.
//! * A frame of another session is never acted on. After a restart the chip has
//!   no session: the host learns that its controller has lost its memory
//!   ([`Nak::Session`]).
//! * Both sides have the same configuration: the chip compares the CRC-32 of all
//!   that it was sent ([`Nak::Configuration`]), and checks every word
//!   ([`Nak::Settings`]).
//!
//! # Bytes
//!
//! `docs/LINE.md` has every frame and body byte by byte, for hosts in other
//! languages, and `docs/line_client.py` is one; a test holds the page to this
//! package.
//!
//! [`Nak::Number`]: reply::Nak::Number
//! [`Nak::Damaged`]: reply::Nak::Damaged
//! [`Nak::Session`]: reply::Nak::Session
//! [`Nak::Configuration`]: reply::Nak::Configuration
//! [`Nak::Settings`]: reply::Nak::Settings

#![no_std]
#![deny(
    clippy::arithmetic_side_effects,
    clippy::as_conversions,
    clippy::float_arithmetic,
    clippy::indexing_slicing,
    clippy::integer_division_remainder_used,
    clippy::string_slice,
    clippy::unreachable
)]

pub mod body;
pub mod frame;
pub mod plan;
pub mod planned;
mod planning;
pub mod reply;
pub mod request;
pub mod server;
pub mod settings;
pub mod vectors;

pub use planned::Planned;
pub use reply::{Identity, Nak, Reply, Status, Stepped};
pub use request::{Events, Request, SourceKind, Step};
pub use server::{Server, Target};
