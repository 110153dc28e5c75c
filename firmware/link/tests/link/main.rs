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
