//! Words into wider ones and back, in constant evaluation: `From` and
//! `TryFrom` cannot run there. The bytes say the same, and cost the same.

/// A byte as a word.
pub(crate) const fn byte(value: u8) -> u32 {
    u32::from_le_bytes([value, 0, 0, 0])
}

/// A word as a double one.
pub(crate) const fn word(value: u32) -> u64 {
    let [b0, b1, b2, b3] = value.to_le_bytes();
    u64::from_le_bytes([b0, b1, b2, b3, 0, 0, 0, 0])
}

/// A word as a double one with a sign.
pub(crate) const fn unsigned(value: u32) -> i64 {
    word(value).cast_signed()
}

/// A word with a sign as a double one.
pub(crate) const fn signed(value: i32) -> i64 {
    let magnitude = unsigned(value.unsigned_abs());
    if value < 0 {
        magnitude.wrapping_neg()
    } else {
        magnitude
    }
}

/// The word that a double one fits, if it does.
pub(crate) const fn narrowed(value: u64) -> Option<u32> {
    match value.to_le_bytes() {
        [b0, b1, b2, b3, 0, 0, 0, 0] => Some(u32::from_le_bytes([b0, b1, b2, b3])),
        _ => None,
    }
}

/// A double word with a sign, held at the end of the type.
pub(crate) const fn held(value: u64) -> i64 {
    if value > i64::MAX.unsigned_abs() {
        i64::MAX
    } else {
        value.cast_signed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_what_from_and_try_from_give() {
        for value in [0, 1, 0x7f, 0x80, 0xff] {
            assert_eq!(byte(value), u32::from(value));
        }
        for value in [0, 1, 0xff00, 0x1234_5678, u32::MAX] {
            assert_eq!(word(value), u64::from(value));
            assert_eq!(unsigned(value), i64::from(value));
            assert_eq!(narrowed(u64::from(value)), Some(value));
            let beyond = u64::from(value) + (1 << 32);
            assert_eq!(narrowed(beyond), u32::try_from(beyond).ok());
        }
        assert_eq!([held(7), held(1 << 63)], [7, i64::MAX]);
        for value in [0, 1, -1, i32::MIN, i32::MAX] {
            assert_eq!(signed(value), i64::from(value));
        }
    }
}
