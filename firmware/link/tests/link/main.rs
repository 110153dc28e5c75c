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
mod planned;
mod plans;
mod rates;
mod serving;

use firmware_link::Nak;

/// Every refusal, in the order of their numbers on the line.
const NAKS: [Nak; 9] = [
    Nak::Damaged,
    Nak::Session,
    Nak::Number { expected: 7 },
    Nak::Request,
    Nak::Configuration { here: 9 },
    Nak::Settings { word: 3 },
    Nak::Memory,
    Nak::Driving,
    Nak::Plan { stretch: 2 },
];
