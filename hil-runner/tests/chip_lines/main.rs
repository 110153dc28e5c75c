//! The host's side of the line to a chip: nothing is left behind, nothing is
//! waited for without limit.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[cfg(target_os = "linux")]
mod fifo;
#[cfg(target_os = "linux")]
mod guard;
#[cfg(unix)]
mod image;
#[cfg(target_os = "linux")]
mod qemu;
#[cfg(unix)]
mod serial;
mod support;
#[cfg(target_os = "linux")]
mod targets;
