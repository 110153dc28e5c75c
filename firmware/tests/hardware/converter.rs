//! The AD57x1R's driver.

use firmware::hardware::{Ad57x1r, Ad57x1rError, Ad57x1rModel};
use proptest::prelude::*;

use crate::script::{Script, spoiled};

/// The question for the control register, which goes before every code.
pub(crate) const LOOK: (&[u8], &[u8]) = (&[0x0C, 0x02, 0xE8], &[]);

/// The answer of a converter in order.
const IN_ORDER: &[u8] = &[0x0C, 0x02, 0xE8];

/// Exchange of a converter and its initialisation.
pub(crate) const CONVERTER: [(&[u8], &[u8]); 6] = [
    (&[0x0F, 0, 0], &[]),
    (&[0x04, 0x02, 0xE8], &[]),
    LOOK,
    (&[0x03, 0, 0], &[0xEC, 0xE2, 0xE8]),
    (&[0x0B, 0, 0], &[]),
    (&[0x00, 0x02, 0xE8], &[0x0B, 0, 0]),
];

#[test]
fn the_converter_is_reset_set_to_midscale_and_read_back() {
    for model in [Ad57x1rModel::Ad5721r, Ad57x1rModel::Ad5761r] {
        let mut converter = Ad57x1r::new(Script::of(&CONVERTER), model);
        converter.initialise().expect("as planned");
        converter.spi.assert_done();
    }
}

#[test]
fn a_converter_that_answers_wrong_is_refused() {
    let initialise = |at, answer| {
        let script = spoiled(&CONVERTER, at, answer);
        Ad57x1r::new(script, Ad57x1rModel::Ad5721r).initialise()
    };
    // No chip, another command's answer.
    for answer in [&[0, 0, 0], &[0xFF; 3], &[0x0B, 0x02, 0xE8]] {
        let error = initialise(3, answer);
        assert!(
            matches!(error, Err(Ad57x1rError::Answer { .. })),
            "{error:?}"
        );
    }
    // Straight binary, zero scale, bytes swapped, short circuit, brown-out.
    for read in [
        [0x02, 0x68],
        [0x00, 0xE0],
        [0xE8, 0x02],
        [0x12, 0xE8],
        [0x0A, 0xE8],
    ] {
        let answer: &'static [u8] = Box::leak(Box::new([0x0C, read[0], read[1]]));
        let error = Ad57x1rError::Control {
            written: 0x02E8,
            read: u16::from_be_bytes(read),
        };
        assert_eq!(initialise(3, answer), Err(error));
    }
    let error = initialise(5, &[0x0B, 0x80, 0x00]).expect_err("−10 V");
    assert_eq!(
        error.to_string(),
        "the converter was set to the code 0 and reads -2048; the chip must answer as written"
    );
}

/// Every code looks at the converter; the contrast: one in order, whose undefined
/// bits are set.
#[test]
fn a_converter_that_reports_a_condition_fails_the_code() {
    let set_code = |answer: &[u8]| {
        let script = Script::of(&[LOOK, (&[0x03, 0x12, 0x34], answer)]);
        let mut converter = Ad57x1r::new(script, Ad57x1rModel::Ad5761r);
        let set = converter.set_code(0x1234);
        converter.spi.assert_done();
        set
    };
    assert_eq!(set_code(&[0xEC, 0xE2, 0xE8]), Ok(()));
    // Short circuit, brown-out, both, a register that went with the supply.
    for read in [0x12E8_u16, 0x0AE8, 0x1AE8, 0x0000] {
        let [high, low] = read.to_be_bytes();
        let error = Ad57x1rError::Control {
            written: 0x02E8,
            read,
        };
        assert_eq!(set_code(&[0x0C, high, low]), Err(error));
    }
    assert_eq!(
        set_code(&[0x0C, 0x12, 0xE8]).map_err(|error| error.to_string()),
        Err(
            "the converter's control register was set to 0x02e8 and reads 0x12e8; the chip \
             must answer as written, without short circuit (bit 12) or brown-out (bit 11)"
                .to_owned()
        )
    );
    // No chip at all.
    for answer in [[0; 3], [0xFF; 3]] {
        assert!(matches!(
            set_code(&answer),
            Err(Ad57x1rError::Answer { .. })
        ));
    }
}

#[test]
fn all_codes_of_12_bits_are_left_justified_and_read_back() {
    for code in -2_048..=2_047_i16 {
        let [high, low] = (code << 4).to_be_bytes();
        let written = [0x03, high, low];
        // The four bits below have no meaning.
        let answer = [0x0B, high, low | 0x0A];
        let script = Script::of(&[
            LOOK,
            (&written, IN_ORDER),
            (&[0x0B, 0, 0], &[]),
            (&[0x00, 0x02, 0xE8], &answer),
        ]);
        let mut converter = Ad57x1r::new(script, Ad57x1rModel::Ad5721r);
        assert_eq!(converter.set_code(i32::from(code)), Ok(()));
        assert_eq!(converter.code(), Ok(i32::from(code)));
        converter.spi.assert_done();
    }
}

proptest! {
    #[test]
    fn codes_of_16_bits_go_out_as_they_are(code: i16) {
        let [high, low] = code.to_be_bytes();
        let script = Script::of(&[LOOK, (&[0x03, high, low], IN_ORDER)]);
        let mut converter = Ad57x1r::new(script, Ad57x1rModel::Ad5761r);
        prop_assert_eq!(converter.set_code(i32::from(code)), Ok(()));
        converter.spi.assert_done();
    }

    /// Nothing is said on the bus: the script is empty.
    #[test]
    fn a_code_beyond_the_range_is_refused_in_silence(beyond in 0..=i32::MAX - 32_768) {
        for (model, bits, end) in
            [(Ad57x1rModel::Ad5721r, 12, 2_048), (Ad57x1rModel::Ad5761r, 16, 32_768)]
        {
            for code in [end + beyond, -end - 1 - beyond] {
                let error = Ad57x1r::new(Script::of(&[]), model).set_code(code);
                prop_assert_eq!(error, Err(Ad57x1rError::CodeOutOfRange { code, bits }));
            }
        }
    }
}
