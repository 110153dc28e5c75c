//! The firmware's drivers against the chips, bit for bit: what goes in at one
//! end comes out at the other, and what a mistake or a fault does shows.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod converter;
mod counter;
mod wiring;

use hil_core::io::{BusFault, ModelBus, SpiChip, Spoiling};

/// A bus whose transaction `transaction` is spoiled.
fn spoiled<Chip>(chip: Chip, transaction: u64, spoiling: Spoiling) -> ModelBus<Chip> {
    let mut bus = ModelBus::new(chip);
    bus.set_fault(Some(BusFault {
        transactions: transaction..transaction + 1,
        spoiling,
    }));
    bus
}

/// One select with these bytes; what the chip says to them.
fn say<const N: usize>(chip: &mut impl SpiChip, bytes: [u8; N]) -> [u8; N] {
    chip.select();
    let answer = bytes.map(|byte| chip.exchange(byte));
    chip.deselect();
    answer
}
