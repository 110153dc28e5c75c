//! Keys of the chip.

use super::super::keys::Range::Between;
use super::super::keys::{DefaultValue, Key, Kind, Need, number, of_firmware, value};

pub(super) const TARGET: &[Key] = &of_firmware([
    // Far above any microcontroller.
    value(
        "clock_hz",
        Kind::Whole(1, 10_000_000_000),
        "Hz",
        "clock of the core",
    )
    .needed(Need::Optional),
    // Below 1 for cores that begin two instructions in a cycle, above 100 for
    // code that runs from a serial flash.
    number(
        "cycles_per_instruction",
        Between(0.01, 1_000.0),
        "",
        "number of cycles that an instruction is allowed",
    )
    .or(DefaultValue::Number(4.0)),
]);
