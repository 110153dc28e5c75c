//! The drivers on a scripted bus: byte for byte what the data sheets ask for,
//! and every failure reported by the part that failed.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod board;
mod converter;
mod counter;
mod script;
