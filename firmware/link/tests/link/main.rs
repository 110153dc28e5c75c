//! The line to a host: frames, settings, and a server that acts once.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test stops where its setup fails"
)]

mod bytes;
mod frames;
mod parameters;
mod serving;

use firmware_link::Nak;

/// Every refusal, in the order of their numbers on the line.
const NAKS: [Nak; 8] = [
    Nak::Damaged,
    Nak::Session,
    Nak::Number { expected: 7 },
    Nak::Request,
    Nak::Configuration { here: 9 },
    Nak::Settings,
    Nak::Table,
    Nak::Driving,
];
