//! The image for an STM32F407G-DISC1.
//!
//! ```text
//!                    ┌── no jumper ── bench: link::Server on USART2 ◄──► host
//!  reset ── clock ───┤
//!                    └── jumper ───── drive: Drive every Δt; USART2 says who it is
//! ```
//!
//! Pins, wiring and the order of the first power-up are in `README.md`. Where a
//! register is set, the section of the reference manual stands beside it:
//! "RM" is ST's RM0090, "DS" the data sheet DS8626 of the STM32F407.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this image runs on a chip; build it with --target thumbv7em-none-eabihf");
    std::process::exit(2);
}
