//! The whole board: controller on one side, plant on the other.

use firmware::hardware::SpiBoardError;
use firmware::law::{Law, LawWords};
use firmware::{Board, Controller, ControllerState, Dac, GainWord, SetpointTable};
use hil_core::io::{ModelBoard, Part, SpiIo};
use proptest::prelude::*;

fn controller(dac_bits: u32) -> Controller<3> {
    let words = LawWords {
        kp: GainWord::new(1_717_986_918, 29),
        ki_dt: GainWord::new(21_474_836, 32),
        kd_per_dt: GainWord::new(1_677_721_600, 25),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(dac_bits).expect("supported");
    Controller::new(
        Law::accept(words, dac).expect("words that are accepted"),
        SetpointTable::from_counts(&[0, 40, 90]).expect("three setpoints"),
    )
}

#[test]
fn other_widths_are_refused_with_what_there_is() {
    for (dac_bits, counter_bits) in [(12, 16), (12, 32), (16, 16), (16, 32)] {
        assert!(SpiIo::new(dac_bits, counter_bits).is_ok());
    }
    let error = SpiIo::new(14, 32).expect_err("no such converter");
    assert_eq!(
        error.to_string(),
        "drive.dac_bits = 14: there is no converter of 14 bits on SPI; \
         it must have 12 bits (AD5721R) or 16 bits (AD5761R)"
    );
    let error = SpiIo::new(16, 24).expect_err("no such counter");
    assert_eq!(
        error.to_string(),
        "encoder.counter_bits = 24: there is no counter of 24 bits on SPI; \
         the LS7366R must be used with 16 or 32 bits"
    );
}

#[test]
fn the_board_moves_into_a_thread() {
    let mut io = SpiIo::new(16, 32).expect("supported");
    let code = std::thread::spawn(move || {
        io.board().set_code(-7).expect("whole");
        io.code()
    });
    assert_eq!(code.join().expect("no panic"), -7);
}

proptest! {
    /// Through drivers, bytes and chips the controller gives the codes that it
    /// gives without them.
    #[test]
    fn the_loop_through_the_chips_is_the_loop(
        positions in prop::collection::vec(-60_000_i64..60_000, 1..200),
    ) {
        for dac_bits in [12, 16] {
            let mut io = SpiIo::new(dac_bits, 32).expect("supported");
            let controller = controller(dac_bits);
            let mut state = ControllerState::start(&controller);
            let mut direct = state;
            io.board().set_power(true).expect("whole");
            for &position in &positions {
                io.start_tick(position);
                prop_assert_eq!(io.board().emergency_stop(), Ok(false));
                let count = io.board().motor_register().expect("whole").cast_signed();
                let code = controller.tick(&mut state, count).code;
                io.board().set_code(code).expect("whole");

                let position = i32::try_from(position).expect("below 2^31");
                prop_assert_eq!(io.code(), controller.tick(&mut direct, position).code);
            }
            prop_assert!(io.powered());
        }
    }
}

type Access = fn(&mut ModelBoard) -> Result<(), <ModelBoard as Board>::Error>;

/// Every part with an access that needs it.
const ACCESSES: [(Part, Access); 4] = [
    (Part::Counter, |board| board.motor_register().map(drop)),
    (Part::Converter, |board| board.set_code(1)),
    (Part::Enable, |board| board.set_power(true)),
    (Part::EmergencyStop, |board| {
        board.emergency_stop().map(drop)
    }),
];

const fn failed(error: &<ModelBoard as Board>::Error) -> Option<Part> {
    match error {
        SpiBoardError::Counter(_) => Some(Part::Counter),
        SpiBoardError::Converter(_) => Some(Part::Converter),
        SpiBoardError::Enable(_) => Some(Part::Enable),
        SpiBoardError::EmergencyStop(_) => Some(Part::EmergencyStop),
        _ => None,
    }
}

#[test]
fn a_part_fails_in_its_ticks_alone_and_under_its_name() {
    for (part, _) in ACCESSES {
        let mut io = SpiIo::new(12, 16).expect("supported");
        io.fail(part, 3..5);
        for tick in 0..8 {
            io.start_tick(-tick);
            for (other, access) in ACCESSES {
                let fails = other == part && (3..5).contains(&tick);
                match access(io.board()) {
                    Ok(()) => assert!(!fails, "{part:?} works in tick {tick}"),
                    Err(error) => {
                        assert!(fails, "{other:?} fails in tick {tick}");
                        assert_eq!(failed(&error), Some(part), "{error}");
                    }
                }
            }
        }
        // The position has not been lost on the way.
        assert_eq!(io.board().motor_register(), Ok(65_536 - 7));
    }
}

#[test]
fn switching_off_takes_effect_where_it_can() {
    for (part, powered, code) in [
        (Part::Counter, false, 0),
        (Part::EmergencyStop, false, 0),
        (Part::Converter, false, 1_000),
        (Part::Enable, true, 0),
    ] {
        let mut io = SpiIo::new(12, 32).expect("supported");
        io.fail(part, 0..u64::MAX);
        io.board().set_power(true).expect("no tick has begun");
        io.board().set_code(1_000).expect("no tick has begun");
        io.start_tick(0);
        let outcome = io.board().switch_off();
        assert_eq!(outcome.is_err(), powered || code != 0);
        assert_eq!((io.powered(), io.code()), (powered, code));
    }
}

#[test]
fn an_open_loop_is_an_emergency_stop() {
    let mut io = SpiIo::new(12, 32).expect("supported");
    for asserted in [false, true, false] {
        io.set_emergency_stop(asserted);
        assert_eq!(io.board().emergency_stop(), Ok(asserted));
    }
}
