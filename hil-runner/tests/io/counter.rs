//! LS7366R: driver and chip.

use firmware::hardware::{CounterWidth, Ls7366r, Ls7366rError};
use hil_core::io::{Ls7366rChip, ModelBus, ModelBusError, SpiChip, Spoiling};
use proptest::prelude::*;

use super::{say, spoiled};

type Counter = Ls7366r<ModelBus<Ls7366rChip>>;

fn counter_at(position: i64, width: CounterWidth) -> Counter {
    let mut counter = Ls7366r::new(ModelBus::new(Ls7366rChip::new(position)), width);
    counter.initialise().expect("the chip is whole");
    counter
}

fn chip(counter: &mut Counter) -> &mut Ls7366rChip {
    &mut counter.spi.chip
}

proptest! {
    /// The count is the way gone since the start, modulo 2^16 or 2^32; carry
    /// and borrow tell whether an end was passed.
    #[test]
    fn counts_are_the_way_gone(
        start in -1_i64 << 40..1 << 40,
        steps in prop::collection::vec(
            prop_oneof![-3_i64..=3, -70_000_i64..=70_000, -1_i64 << 33..=1 << 33],
            1..40,
        ),
    ) {
        for width in [CounterWidth::Bits16, CounterWidth::Bits32] {
            let turn = 1_i64 << width.bits();
            let mut counter = counter_at(start, width);
            let (mut way, mut ends) = (0_i64, (false, false));
            for step in &steps {
                let turns = way.div_euclid(turn);
                way += step;
                ends.0 |= way.div_euclid(turn) > turns;
                ends.1 |= way.div_euclid(turn) < turns;
                chip(&mut counter).move_to(start + way);
                let count = counter.count().expect("the bus is whole");
                prop_assert_eq!(i64::from(count), way.rem_euclid(turn));
            }
            let status = counter.status().expect("the bus is whole");
            prop_assert_eq!((status.carry(), status.borrow()), ends);
        }
    }
}

#[test]
fn the_count_wraps_at_both_ends() {
    for (width, last) in [
        (CounterWidth::Bits16, 0xFFFF),
        (CounterWidth::Bits32, u32::MAX),
    ] {
        let mut counter = counter_at(100, width);
        chip(&mut counter).move_to(99);
        assert_eq!(counter.count(), Ok(last));
        let status = counter.status().expect("the bus is whole");
        assert!(status.borrow() && !status.carry());
        chip(&mut counter).move_to(101);
        assert_eq!(counter.count(), Ok(1));
        assert!(counter.status().expect("the bus is whole").carry());
    }
}

/// All bytes of a count are of the instant of its instruction.
#[test]
fn a_count_is_coherent_while_the_encoder_turns() {
    let mut counter = counter_at(0, CounterWidth::Bits32);
    let chip = chip(&mut counter);
    chip.move_to(0x00FF_FFFF);
    chip.select();
    chip.exchange(0x60);
    let bytes = [1, 2, 3, 4].map(|step| {
        chip.move_to(0x00FF_FFFF + step);
        chip.exchange(0)
    });
    assert_eq!(u32::from_be_bytes(bytes), 0x00FF_FFFF);
}

#[test]
fn a_chip_out_of_power_is_not_believed() {
    let mut fresh = Ls7366r::new(ModelBus::new(Ls7366rChip::new(0)), CounterWidth::Bits16);
    assert!(matches!(fresh.count(), Err(Ls7366rError::PowerLost { .. })));

    let mut counter = counter_at(0, CounterWidth::Bits16);
    chip(&mut counter).lose_power();
    for _ in 0..2 {
        assert!(matches!(
            counter.count(),
            Err(Ls7366rError::PowerLost { .. })
        ));
    }
    counter.initialise().expect("the chip is whole again");
    assert_eq!(counter.count(), Ok(0));
}

/// Both readings of CLR STR: a chip that counts is taken, at power-up and later;
/// the contrast, one with its enable pin held low, is found out at power-up.
#[test]
fn what_clr_str_does_to_cen_does_not_matter() {
    for clears in [false, true] {
        let mut chip = Ls7366rChip::new(0);
        chip.set_clears_cen(clears);
        let mut counter = Ls7366r::new(ModelBus::new(chip), CounterWidth::Bits32);
        for _ in 0..2 {
            counter.initialise().expect("the chip is whole");
            assert_eq!(counter.count(), Ok(0));
            let status = counter.status().expect("the bus is whole");
            assert_eq!(status.counting(), !clears);
        }
        counter.spi.chip.set_enable_pin(false);
        counter.spi.chip.lose_power();
        let error = counter.initialise();
        assert!(
            matches!(error, Err(Ls7366rError::NotCounting { .. })),
            "{error:?}"
        );
    }
}

/// A bit that turns over on its way to the chip is found out, or does not
/// matter: what then counts does count. On its way back it never passes.
#[test]
fn no_single_bit_error_leaves_a_wrong_mode_behind() {
    for width in [CounterWidth::Bits16, CounterWidth::Bits32] {
        for (transaction, byte, bit) in (0..8)
            .flat_map(|t| (0..2).flat_map(move |byte| (0..8).map(move |bit| (t, byte, 1 << bit))))
        {
            let spoiling = Spoiling::Mosi { byte, mask: bit };
            let bus = spoiled(Ls7366rChip::new(0), transaction, spoiling);
            let mut counter = Ls7366r::new(bus, width);
            if counter.initialise().is_err() {
                continue;
            }
            // The mode registers are the data of transactions 0 and 1.
            assert!(transaction > 1 || byte == 0, "{transaction} {bit:#x}");
            let before = counter.count().expect("the bus is whole again");
            chip(&mut counter).move_to(0x0001_2345);
            let way = counter
                .count()
                .expect("the bus is whole")
                .wrapping_sub(before);
            let seen = if width == CounterWidth::Bits16 {
                0xFFFF
            } else {
                u32::MAX
            };
            assert_eq!(
                way & seen,
                0x0001_2345 & seen,
                "{transaction} {byte} {bit:#x}"
            );
        }
        for (transaction, bit) in [(2, 3..4), (5, 0..8), (6, 0..8), (7, 2..3)] {
            for bit in bit {
                let spoiling = Spoiling::Miso {
                    byte: 1,
                    mask: 1 << bit,
                };
                let bus = spoiled(Ls7366rChip::new(0), transaction, spoiling);
                assert!(Ls7366r::new(bus, width).initialise().is_err());
            }
        }
    }
}

#[test]
fn every_lost_transaction_is_reported_and_the_next_one_works() {
    for transaction in 0..8 {
        let bus = spoiled(Ls7366rChip::new(0), transaction, Spoiling::Error);
        let mut counter = Ls7366r::new(bus, CounterWidth::Bits32);
        let lost = Ls7366rError::Bus(ModelBusError { transaction });
        assert_eq!(counter.initialise(), Err(lost));
        assert_eq!(counter.initialise(), Ok(()));
    }
    for lost in [8, 9] {
        let bus = spoiled(Ls7366rChip::new(0), lost, Spoiling::Error);
        let mut counter = Ls7366r::new(bus, CounterWidth::Bits32);
        counter.initialise().expect("whole up to here");
        chip(&mut counter).move_to(-2);
        let error = Ls7366rError::Bus(ModelBusError { transaction: lost });
        assert_eq!(counter.count(), Err(error));
        assert_eq!(counter.count(), Ok(u32::MAX - 1));
    }
}

/// The registers that the driver does not use, in each width.
#[test]
fn the_chip_loads_latches_and_cuts_to_its_bytes() {
    for (mdr1, bytes) in [(0x00, 4), (0x01, 3), (0x02, 2), (0x03, 1)] {
        let mut chip = Ls7366rChip::new(0);
        say(&mut chip, [0x88, 0x03]);
        say(&mut chip, [0x90, mdr1]);
        // DTR, then CNTR, then OTR; the bytes behind the width are ignored.
        say(&mut chip, [0x98, 0xA1, 0xB2, 0xC3, 0xD4]);
        say(&mut chip, [0xE0]);
        say(&mut chip, [0xE8]);
        chip.move_to(1);
        let mut expected = [0, 0xA1, 0xB2, 0xC3, 0xD4];
        expected[bytes + 1..].fill(0);
        let found = say(&mut chip, [0x68, 0, 0, 0, 0]);
        assert_eq!(found, expected, "OTR, {bytes} bytes");
        expected[bytes] += 1;
        let found = say(&mut chip, [0x60, 0, 0, 0, 0]);
        assert_eq!(found, expected, "CNTR, {bytes} bytes");

        // Counting off, then at the other resolutions: 8 quarters are 2 lines.
        let mut counted = |mdr0, mdr1, way| {
            say(&mut chip, [0x88, mdr0]);
            say(&mut chip, [0x90, mdr1]);
            say(&mut chip, [0x20]);
            chip.move_to(0);
            say(&mut chip, [0x20]);
            chip.move_to(way);
            say(&mut chip, [0x60, 0])[1]
        };
        if bytes == 1 {
            assert_eq!(counted(0x03, mdr1 | 0x04, 8), 0);
            assert_eq!(counted(0x03, mdr1, 8), 8);
            assert_eq!(counted(0x02, mdr1, 8), 4);
            assert_eq!(counted(0x01, mdr1, -8), 0xFE);
            // Not quadrature, or not free running: the model stands still.
            assert_eq!(counted(0x00, mdr1, 8), 0);
            assert_eq!(counted(0x07, mdr1, 8), 0);
        }
    }
}
