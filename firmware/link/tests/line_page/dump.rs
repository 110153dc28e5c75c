//! Bodies in words, read here once more: a description of the bytes that shares
//! nothing with what writes and reads them.

use std::fmt::Write;

use firmware::{FaultCause, Settings, State};
use firmware_link::frame::crc32;

/// Meaning of the bytes of a field.
#[derive(Clone, Copy)]
enum Unit {
    Whole,
    Signed,
    Hex,
    Text,
    /// The name that a number stands for.
    Name(&'static [&'static str]),
    /// Names of the bits, from the lowest on.
    Bits(&'static [&'static str]),
}

use Unit::{Bits, Hex, Name, Signed, Text, Whole};

/// Name, bytes and meaning.
type Field = (&'static str, usize, Unit);

const HEADER: [Field; 3] = [("kind", 1, Hex), ("session", 2, Hex), ("number", 4, Whole)];

const EVENTS: [&str; 4] = ["disable", "reset", "enable", "start"];
const SOURCES: [&str; 4] = ["table", "plan", "step", "rates"];
const NAKS: [&str; 9] = [
    "damaged",
    "session",
    "number",
    "request",
    "configuration",
    "settings",
    "memory",
    "driving",
    "plan",
];
const STEP_FLAGS: [&str; 8] = [
    "disable",
    "reset",
    "enable",
    "start",
    "emergency stop",
    "load",
    "odd",
    "next",
];
const REPLY_FLAGS: [&str; 7] = [
    "disable refused",
    "reset refused",
    "enable refused",
    "start refused",
    "power",
    "out of range",
    "fault",
];

const HELLO: [Field; 7] = [
    ("version", 1, Whole),
    ("target", 8, Text),
    ("image_crc", 4, Hex),
    ("flash_bytes", 4, Whole),
    ("ram_bytes", 4, Whole),
    ("table_capacity", 4, Whole),
    ("timer_hz", 4, Whole),
];
const STEPPED: [Field; 5] = [
    ("code", 4, Signed),
    ("error_counts", 4, Signed),
    ("state", 1, Name(&STATES)),
    ("flags", 1, Bits(&REPLY_FLAGS)),
    ("ticks", 4, Whole),
];
const FAULT: [Field; 8] = [
    ("cause", 1, Name(&CAUSES)),
    ("tick", 8, Whole),
    ("setpoint", 4, Signed),
    ("position", 4, Signed),
    ("error", 4, Signed),
    ("code", 4, Signed),
    ("measured", 8, Signed),
    ("limit", 8, Signed),
];

const STATES: [&str; 5] = {
    let [a, b, c, d, e] = State::ALL;
    [a.name(), b.name(), c.name(), d.name(), e.name()]
};
const CAUSES: [&str; 8] = {
    let [a, b, c, d, e, f, g, h] = FaultCause::ALL;
    [
        a.name(),
        b.name(),
        c.name(),
        d.name(),
        e.name(),
        f.name(),
        g.name(),
        h.name(),
    ]
};

/// The fields of a body.
fn fields(body: &[u8]) -> Vec<Field> {
    let mut fields = HEADER.to_vec();
    match body[0] {
        0x01 | 0x82 | 0x09 => {}
        0x03 => fields.extend(Settings::NAMES.map(|name| (name, 4, Whole))),
        0x04 => fields.extend(vec![("word", 4, Signed); (body.len() - 7) / 4]),
        0x06 => fields.extend([
            ("configuration", 4, Hex),
            ("events", 1, Bits(&EVENTS)),
            ("source", 1, Name(&SOURCES)),
        ]),
        0x07 => {
            fields.extend([
                ("flags", 1, Bits(&STEP_FLAGS)),
                ("motor_register", 4, Whole),
            ]);
            if body[7] & 0x20 != 0 {
                fields.push(("load_register", 4, Whole));
            }
            if body[7] & 0x40 != 0 {
                fields.extend([
                    ("tick", 8, Whole),
                    ("failed_transfers", 4, Whole),
                    ("motor_unread", 1, Whole),
                ]);
            }
        }
        0x81 => fields.extend(HELLO),
        0x87 => {
            fields.extend(STEPPED);
            if body[16] & 0x40 != 0 {
                fields.extend(FAULT);
            }
        }
        0x89 => fields.extend([("stack_bytes", 4, Whole), ("steps", 4, Whole)]),
        0xff => fields.extend([("cause", 1, Name(&NAKS)), ("value", 4, Whole)]),
        other => panic!("kind {other:#x} has no description"),
    }
    fields
}

fn value(bytes: &[u8], unit: Unit) -> String {
    let mut word = [0; 8];
    word[..bytes.len()].copy_from_slice(bytes);
    let number = u64::from_le_bytes(word);
    let named = |names: &[&str], place: u64| {
        let name = names.get(usize::try_from(place).unwrap());
        (*name.unwrap_or(&"?")).to_owned()
    };
    match unit {
        Whole => number.to_string(),
        Signed => {
            let above = 64 - 8 * bytes.len();
            (number.cast_signed() << above >> above).to_string()
        }
        Hex => format!("0x{number:0width$x}", width = 2 * bytes.len()),
        Text => String::from_utf8_lossy(bytes).replace('\0', "·"),
        Name(names) => format!("{number}, {}", named(names, number)),
        Bits(names) => {
            let set = (0..8).filter(|bit| number >> bit & 1 == 1);
            let set: Vec<String> = set.map(|bit| named(names, bit)).collect();
            let set = if set.is_empty() {
                "none".to_owned()
            } else {
                set.join(", ")
            };
            format!("0x{number:02x}, {set}")
        }
    }
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    bytes.join(" ")
}

/// A frame with its bytes in words; `line` is what goes over the line for `body`.
pub(crate) fn described(title: &str, body: &[u8], line: &[u8]) -> String {
    let mut text = format!("{title}\n");
    let mut at = 0;
    for (name, length, unit) in fields(body) {
        let bytes = &body[at..at + length];
        let value = value(bytes, unit);
        writeln!(text, "{at:5}  {:23}  {name} = {value}", hex(bytes)).unwrap();
        at += length;
    }
    assert_eq!(at, body.len(), "{title}: bytes without a description");
    let crc = crc32(body);
    writeln!(
        text,
        "       {:23}  CRC-32 = {crc:#010x}",
        hex(&crc.to_le_bytes())
    )
    .unwrap();
    for bytes in line.chunks(24) {
        writeln!(text, "line   {}", hex(bytes)).unwrap();
    }
    text
}
