//! Frames: whatever a line does to them, what comes out is what went in, or
//! nothing.

use firmware_link::frame::{
    LARGEST_BODY, LARGEST_FRAME, Received, Receiver, crc32, crc32_on, encode,
};
use proptest::prelude::*;

/// The bodies that a receiver finds on a line.
fn bodies(line: &[u8]) -> Vec<Option<Vec<u8>>> {
    let mut receiver = Receiver::new();
    let mut found = Vec::new();
    for byte in line {
        match receiver.take(*byte) {
            Some(Received::Body(body)) => found.push(Some(body.to_vec())),
            Some(Received::Damaged) => found.push(None),
            None => {}
        }
    }
    found
}

fn frame(body: &[u8]) -> Vec<u8> {
    encode::<LARGEST_FRAME>(body).unwrap().to_vec()
}

#[test]
fn the_crc_is_the_one_of_the_catalogue() {
    // The check value of CRC-32/ISO-HDLC.
    assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    assert_eq!(crc32_on(crc32(b"1234"), b"56789"), 0xcbf4_3926);
    assert_eq!(crc32_on(0, b"123456789"), 0xcbf4_3926);
}

#[test]
fn a_body_may_be_as_large_as_is_said_and_no_larger() {
    let body = [0xff; LARGEST_BODY];
    assert_eq!(bodies(&frame(&body)), [Some(body.to_vec())]);
    // It still fits a line, but no receiver.
    let larger = [0xff; LARGEST_BODY + 1];
    let line = encode::<{ LARGEST_FRAME + 1 }>(&larger).unwrap();
    assert_eq!(bodies(&line), [None]);
    assert!(encode::<LARGEST_FRAME>(&larger).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn what_goes_in_comes_out(sent in prop::collection::vec(
        prop::collection::vec(any::<u8>(), 0..=LARGEST_BODY), 0..5,
    )) {
        let line: Vec<u8> = sent.iter().flat_map(|body| frame(body)).collect();
        prop_assert!(sent.iter().all(|body| frame(body).iter().rev().skip(1).all(|b| *b != 0)));
        let sent: Vec<_> = sent.into_iter().map(Some).collect();
        prop_assert_eq!(bodies(&line), sent);
    }

    /// By halves of a byte, and in any pieces, it is what the catalogue's is.
    #[test]
    fn the_crc_agrees_with_the_catalogues(
        bytes in prop::collection::vec(any::<u8>(), 0..300), cut in 0_usize..300,
    ) {
        let expected = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
        let (front, back) = bytes.split_at(cut.min(bytes.len()));
        prop_assert_eq!(crc32(&bytes), expected);
        prop_assert_eq!(crc32_on(crc32(front), back), expected);
    }

    /// Whatever was on the line before, a 0 ends it.
    #[test]
    fn a_frame_behind_noise_is_found(
        noise in prop::collection::vec(any::<u8>(), 0..600),
        body in prop::collection::vec(any::<u8>(), 0..=LARGEST_BODY),
    ) {
        let mut line = noise;
        line.push(0);
        line.extend(frame(&body));
        prop_assert_eq!(bodies(&line).pop(), Some(Some(body)));
    }

    /// One to four changed bits in a frame of this size are always found: that
    /// is the distance of the CRC for bodies below 90 bytes and more.
    #[test]
    fn a_damaged_frame_is_no_frame(
        body in prop::collection::vec(any::<u8>(), 1..80),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..8), 1..4),
    ) {
        let good = frame(&body);
        let mut line = good.clone();
        for (at, bit) in flips {
            let at = at.index(line.len());
            line[at] ^= 1 << bit;
        }
        prop_assume!(line != good);
        let found = bodies(&line);
        prop_assert!(found.iter().flatten().all(|found| *found == body), "{:?}", found);
    }
}
