//! The LS7366R's driver.

use firmware::hardware::{CounterWidth, Ls7366r, Ls7366rError};

use crate::script::{Script, spoiled};

/// Exchange of an LS7366R and an initialisation of 32 bits.
pub(crate) const COUNTER_32: [(&[u8], &[u8]); 8] = [
    (&[0x88, 0x03], &[]),
    (&[0x90, 0x00], &[]),
    (&[0x70, 0], &[0xFF, 0x0C]),
    (&[0x20], &[]),
    (&[0x30], &[]),
    (&[0x48, 0], &[0xFF, 0x03]),
    (&[0x50, 0], &[0xFF, 0x00]),
    (&[0x70, 0], &[0xFF, 0x08]),
];

#[test]
fn the_counter_is_set_up_cleared_and_read_back() {
    let mut counter = Ls7366r::new(Script::of(&COUNTER_32), CounterWidth::Bits32);
    counter.initialise().expect("as planned");
    counter.spi.assert_done();

    let mut two_bytes = COUNTER_32;
    two_bytes[1].0 = &[0x90, 0x02];
    two_bytes[6].1 = &[0xFF, 0x02];
    let mut counter = Ls7366r::new(Script::of(&two_bytes), CounterWidth::Bits16);
    counter.initialise().expect("as planned");
    counter.spi.assert_done();
}

#[test]
fn a_count_is_one_transfer_and_its_status() {
    let status: (&[u8], &[u8]) = (&[0x70, 0], &[0, 0xC8]);
    let script = Script::of(&[(&[0x60, 0, 0, 0, 0], &[0, 0x12, 0x34, 0xAB, 0xCD]), status]);
    let mut counter = Ls7366r::new(script, CounterWidth::Bits32);
    assert_eq!(counter.count(), Ok(0x1234_ABCD));
    counter.spi.assert_done();

    let script = Script::of(&[(&[0x60, 0, 0], &[0, 0xFE, 0xDC]), status, status]);
    let mut counter = Ls7366r::new(script, CounterWidth::Bits16);
    assert_eq!(counter.count(), Ok(0xFEDC));
    let status = counter.status().expect("as planned");
    assert!(status.carry() && status.borrow() && status.counting() && !status.power_lost());
    counter.spi.assert_done();
}

#[test]
fn a_counter_that_answers_wrong_is_refused() {
    let initialise = |script| Ls7366r::new(script, CounterWidth::Bits32).initialise();
    // No chip: the line floats low, or high.
    for (read, answer) in [(0x00, &[0, 0]), (0xFF, &[0xFF, 0xFF])] {
        let error = Ls7366rError::ModeRegister {
            register: "MDR0",
            written: 0x03,
            read,
        };
        assert_eq!(initialise(spoiled(&COUNTER_32, 5, answer)), Err(error));
    }
    let error = initialise(spoiled(&COUNTER_32, 6, &[0, 0x04])).expect_err("MDR1 is off");
    assert_eq!(
        error.to_string(),
        "the counter's MDR1 was set to 0x00 and reads 0x04; the chip must answer as written"
    );
    let error = initialise(spoiled(&COUNTER_32, 7, &[0, 0x0C])).expect_err("PLS is on");
    assert!(matches!(error, Ls7366rError::PowerLost { .. }), "{error}");

    let lost_power = Script::of(&[
        (&[0x60, 0, 0, 0, 0], &[0, 0, 0, 0, 9]),
        (&[0x70, 0], &[0, 4]),
    ]);
    let error = Ls7366r::new(lost_power, CounterWidth::Bits32).count();
    assert!(matches!(error, Err(Ls7366rError::PowerLost { .. })));
}

/// CEN counts before CLR STR alone, and only in a chip whose power has just come:
/// behind CLR STR it may read anything.
#[test]
fn cen_is_asked_before_the_status_is_cleared() {
    let initialise = |before: u8, behind: u8| {
        let mut steps: Vec<(&[u8], &[u8])> = COUNTER_32.to_vec();
        let (before, behind) = ([0, before], [0, behind]);
        (steps[2].1, steps[7].1) = (&before, &behind);
        Ls7366r::new(Script::of(&steps), CounterWidth::Bits32).initialise()
    };
    for behind in [0x00, 0x08] {
        // Powered up and enabled; not powered up, and CEN cleared or not.
        for before in [0x0C, 0x00, 0x08] {
            assert_eq!(initialise(before, behind), Ok(()));
        }
        // The contrast: powered up, and the pin is low.
        let error = initialise(0x04, behind).expect_err("CEN is off");
        assert_eq!(
            error.to_string(),
            "the counter is not counting (status 0x04); its enable pin must be high"
        );
    }
}
