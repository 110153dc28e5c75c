//! AD5721R and AD5761R: driver and chip.

use firmware::hardware::{Ad57x1r, Ad57x1rError, Ad57x1rModel};
use hil_core::io::{Ad57x1rChip, DacOutput, ModelBus, ModelBusError, Spoiling};
use proptest::prelude::*;

use super::{say, spoiled};

const MODELS: [Ad57x1rModel; 2] = [Ad57x1rModel::Ad5721r, Ad57x1rModel::Ad5761r];

type Converter = Ad57x1r<ModelBus<Ad57x1rChip>>;

fn converter(model: Ad57x1rModel) -> Converter {
    let mut converter = Ad57x1r::new(ModelBus::new(Ad57x1rChip::new(model)), model);
    converter.initialise().expect("the chip is whole");
    converter
}

fn output(converter: &Converter) -> DacOutput {
    converter.spi.chip.output()
}

/// Written, at the output, read back, and in volts: the same code.
fn assert_passes(converter: &mut Converter, code: i32) {
    converter.set_code(code).expect("the code is in range");
    assert_eq!(output(converter), DacOutput::Code(code));
    assert_eq!(converter.code(), Ok(code));
    let codes = f64::from(1 << converter.model().bits());
    // Every term has few bits: the sums are exact.
    let volts = 20.0 * f64::from(code) / codes;
    assert_eq!(converter.spi.chip.output_v(), volts);
}

#[test]
fn every_code_of_12_bits_stands_at_the_output() {
    let mut converter = converter(Ad57x1rModel::Ad5721r);
    (-2_048..=2_047).for_each(|code| assert_passes(&mut converter, code));
}

#[test]
fn codes_of_16_bits_stand_at_the_output() {
    let mut converter = converter(Ad57x1rModel::Ad5761r);
    // An odd step and 2^16 have no common divisor: this meets every code once.
    let mut code = 0_i16;
    for _ in 0..=u16::MAX {
        code = code.wrapping_add(7_919);
        assert_passes(&mut converter, i32::from(code));
    }
    assert_eq!(code, 0);
}

/// The contrast: what a driver would do that forgets the left-justification,
/// or swaps the bytes of the data. Right only where the mistake has no effect.
#[test]
fn misplaced_bits_show_at_the_output() {
    let mut chip = converter(Ad57x1rModel::Ad5721r).spi.chip.clone();
    let mut right = [0, 0];
    for code in -2_048..=2_047_i16 {
        let [high, low] = code.to_be_bytes();
        say(&mut chip, [0x03, high, low]);
        right[0] += u32::from(chip.output() == DacOutput::Code(code.into()));
        let [high, low] = (code << 4).to_be_bytes();
        say(&mut chip, [0x03, low, high]);
        right[1] += u32::from(chip.output() == DacOutput::Code(code.into()));
    }
    // Unjustified, code/16 rounded down is the code for 0 and −1 alone. Swapped,
    // both bytes have to be the same, with a low half of 0: 16 of them are.
    assert_eq!(right, [2, 16]);
}

/// The contrast to midscale: the chip's own default is −10 V, which the driver
/// never lets out.
#[test]
fn the_output_is_at_0_v_all_through_the_initialisation() {
    for model in MODELS {
        // The control word 02E8 without its PV bits.
        let mut chip = Ad57x1rChip::new(model);
        assert_eq!(chip.output(), DacOutput::Clamped);
        say(&mut chip, [0x04, 0x02, 0xE0]);
        assert_eq!(chip.output_v(), -10.0);

        // A chip that a crashed program has left at full speed: it is lost
        // again in every transaction of the initialisation but the first.
        say(&mut chip, [0x03, 0x7F, 0xFF]);
        assert!(chip.output_v() > 9.99);
        for lost in 1..6 {
            let bus = spoiled(chip.clone(), lost, Spoiling::Error);
            let mut converter = Ad57x1r::new(bus, model);
            let error = Ad57x1rError::Bus(ModelBusError { transaction: lost });
            assert_eq!(converter.initialise(), Err(error));
            assert_eq!(converter.spi.chip.output_v(), 0.0);
            assert_eq!(converter.initialise(), Ok(()));
            assert_passes(&mut converter, 5);
        }
    }
}

/// A bit that turns over on its way to the chip is found out, or leaves the
/// chip as it should be.
#[test]
fn no_single_bit_error_leaves_a_wrong_setting_behind() {
    for model in MODELS {
        // Left with another range, coding and code.
        let mut chip = Ad57x1rChip::new(model);
        say(&mut chip, [0x04, 0x05, 0x03]);
        say(&mut chip, [0x03, 0x12, 0x34]);
        for bit in 0..6 * 24 {
            let (transaction, byte, mask) = (bit / 24, bit / 8 % 3, 1 << (bit % 8));
            let byte = usize::try_from(byte).expect("below 3");
            let bus = spoiled(chip.clone(), transaction, Spoiling::Mosi { byte, mask });
            let mut converter = Ad57x1r::new(bus, model);
            let refused = converter.initialise().is_err();
            // The control register is written by transaction 1: a command of
            // four bits and a 0, eleven bits of data.
            let matters = match byte {
                0 => mask < 0x20,
                1 => mask < 0x08,
                _ => true,
            };
            assert!(
                refused || transaction != 1 || !matters,
                "byte {byte}, {mask:#x}"
            );
            if !refused {
                assert_eq!(converter.spi.chip.output_v(), 0.0);
                assert_passes(&mut converter, -1_000);
            }
        }
        // Back: the command that is answered, control, code.
        for (transaction, byte, bits) in [(3, 0, 0..5), (3, 1, 0..5), (3, 2, 0..8), (5, 1, 0..8)] {
            for bit in bits {
                let spoiling = Spoiling::Miso {
                    byte,
                    mask: 1 << bit,
                };
                let bus = spoiled(Ad57x1rChip::new(model), transaction, spoiling);
                assert!(Ad57x1r::new(bus, model).initialise().is_err());
            }
        }
    }
}

#[test]
fn a_lost_code_leaves_the_last_one_and_the_next_one_works() {
    for model in MODELS {
        // Transactions 0 to 5 are the initialisation, 6 and 7 the first code: 8
        // asks for the control register, 9 carries the code.
        for lost in [8, 9] {
            let bus = spoiled(Ad57x1rChip::new(model), lost, Spoiling::Error);
            let mut converter = Ad57x1r::new(bus, model);
            converter.initialise().expect("whole up to here");
            converter.set_code(100).expect("whole up to here");
            let error = Ad57x1rError::Bus(ModelBusError { transaction: lost });
            assert_eq!(converter.set_code(200), Err(error));
            assert_eq!(output(&converter), DacOutput::Code(100));
            assert_passes(&mut converter, 300);

            let beyond = 1 << (model.bits() - 1);
            assert!(converter.set_code(beyond).is_err());
            assert!(converter.set_code(-beyond - 1).is_err());
            assert_eq!(output(&converter), DacOutput::Code(300));
        }
    }
}

/// A bit that turns over in the question for the control register, or in the
/// answer to it, is not taken for a chip in order, and leaves one behind.
#[test]
fn no_single_bit_error_hides_in_the_look_at_the_chip() {
    for model in MODELS {
        let question = (0..24).map(|bit| (6, bit));
        let answer = (0..24).map(|bit| (7, bit));
        for (transaction, bit) in question.chain(answer) {
            let (byte, mask) = (bit / 8, 1 << (bit % 8));
            let (spoiling, matters) = if transaction == 6 {
                (Spoiling::Mosi { byte, mask }, byte == 0 && mask < 0x20)
            } else {
                (Spoiling::Miso { byte, mask }, byte == 2 || mask < 0x20)
            };
            let bus = spoiled(Ad57x1rChip::new(model), transaction, spoiling);
            let mut converter = Ad57x1r::new(bus, model);
            converter.initialise().expect("whole up to here");
            let set = converter.set_code(100);
            assert_eq!(set.is_err(), matters, "{transaction}, {byte}, {mask:#x}");
            assert_passes(&mut converter, 200);
        }
    }
}

/// Something that happens to a chip.
type Happen = fn(&mut Ad57x1rChip);

/// A short circuit and a brown-out fail every code from the next one on, until
/// the chip is initialised; the contrast: none has been, and none does.
#[test]
fn conditions_of_the_chip_fail_the_next_code() {
    let conditions: [(Happen, u16); 3] = [
        (Ad57x1rChip::short_circuit, 0x12E8),
        (Ad57x1rChip::brown_out, 0x0AE8),
        (|_| {}, 0x02E8),
    ];
    for model in MODELS {
        for (happen, read) in conditions {
            let mut converter = converter(model);
            assert_passes(&mut converter, 100);
            happen(&mut converter.spi.chip);
            for code in [200, 0] {
                let expected = if read == 0x02E8 {
                    Ok(())
                } else {
                    Err(Ad57x1rError::Control {
                        written: 0x02E8,
                        read,
                    })
                };
                assert_eq!(converter.set_code(code), expected);
                assert_eq!(output(&converter), DacOutput::Code(code));
            }
            converter.initialise().expect("the chip is whole");
            assert_passes(&mut converter, 300);
        }
    }
}

/// Commands and ways of the chip that the driver does not use.
#[test]
fn the_chip_keeps_its_other_promises() {
    let mut chip = Ad57x1rChip::new(Ad57x1rModel::Ad5721r);
    // Straight binary, power-up at full scale, ±5 V.
    say(&mut chip, [0x04, 0x00, 0x12]);
    assert_eq!(chip.output(), DacOutput::Code(2_047));
    // The input register alone changes nothing; the update takes it over.
    say(&mut chip, [0x01, 0x00, 0x1F]);
    assert_eq!(chip.output(), DacOutput::Code(2_047));
    say(&mut chip, [0x0A, 0, 0]);
    assert_eq!(say(&mut chip, [0x02, 0, 0]), [0x0A, 0x00, 0x10]);
    assert_eq!(chip.output(), DacOutput::Code(1 - 2_048));
    assert!((chip.output_v() - (-5.0 + 10.0 / 4_096.0)).abs() < 1e-12);
    // A frame comes out behind itself: daisy chain.
    say(&mut chip, [0x00, 0xAB, 0xCD]);
    assert_eq!(say(&mut chip, [0x00, 0, 0]), [0x00, 0xAB, 0xCD]);
    // Of five bytes the last three count; two are none; bit 20 must be 0.
    say(&mut chip, [0xFF, 0xFF, 0x03, 0x80, 0x00]);
    assert_eq!(chip.output(), DacOutput::Code(0));
    say(&mut chip, [0x03, 0x90]);
    say(&mut chip, [0x13, 0x90, 0x00]);
    assert_eq!(chip.output(), DacOutput::Code(0));
    // Data reset: to the power-up value. Without daisy chain, silence.
    say(&mut chip, [0x07, 0, 0]);
    assert_eq!(chip.output(), DacOutput::Code(2_047));
    say(&mut chip, [0x09, 0, 1]);
    say(&mut chip, [0x0C, 0, 0]);
    assert_eq!(say(&mut chip, [0x00, 0, 0]), [0; 3]);
    say(&mut chip, [0x0F, 0, 0]);
    assert_eq!(chip.output(), DacOutput::Clamped);
}

proptest! {
    /// Without supply the output is clamped, whatever was written before, and the
    /// next code fails.
    #[test]
    fn power_lost_is_0_v(code in -2_048..=2_047) {
        let mut converter = converter(Ad57x1rModel::Ad5721r);
        converter.set_code(code).expect("in range");
        converter.spi.chip.lose_power();
        prop_assert_eq!(converter.spi.chip.output_v(), 0.0);
        let set = converter.set_code(code);
        prop_assert!(matches!(set, Err(Ad57x1rError::Control { .. })), "{set:?}");
        prop_assert_eq!(output(&converter), DacOutput::Clamped);
        converter.initialise().expect("the chip is whole");
        assert_passes(&mut converter, code);
    }

    /// No sequence of bytes brings the chip to a code beyond its range.
    #[test]
    fn noise_on_the_bus_stays_within_the_range(
        frames in prop::collection::vec(any::<[u8; 3]>(), 0..60),
    ) {
        for model in MODELS {
            let mut chip = Ad57x1rChip::new(model);
            let end = 1 << (model.bits() - 1);
            for frame in &frames {
                say(&mut chip, *frame);
                if let DacOutput::Code(code) = chip.output() {
                    prop_assert!((-end..end).contains(&code));
                }
                prop_assert!((-10.0..20.0).contains(&chip.output_v()));
            }
        }
    }
}
