//! Drivers and lines together.

use std::convert::Infallible;

use embedded_hal::digital::{self, InputPin, OutputPin, PinState};
use firmware::Board;
use firmware::hardware::{
    Ad57x1r, Ad57x1rError, Ad57x1rModel, CounterWidth, Line, Ls7366r, Ls7366rError, SpiBoard,
    SpiBoardError,
};

use crate::converter::CONVERTER;
use crate::counter::COUNTER_32;
use crate::script::{Lost, Script};

/// A pin that remembers its levels, or fails.
#[derive(Debug, Default)]
struct Pin {
    levels: Vec<PinState>,
    broken: bool,
}

impl digital::ErrorType for Pin {
    type Error = digital::ErrorKind;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        self.levels.push(PinState::Low);
        if self.broken {
            Err(digital::ErrorKind::Other)
        } else {
            Ok(())
        }
    }
    fn set_high(&mut self) -> Result<(), Self::Error> {
        self.levels.push(PinState::High);
        if self.broken {
            Err(digital::ErrorKind::Other)
        } else {
            Ok(())
        }
    }
}

impl InputPin for Pin {
    fn is_high(&mut self) -> Result<bool, Self::Error> {
        if self.broken {
            Err(digital::ErrorKind::Other)
        } else {
            Ok(!self.levels.is_empty())
        }
    }
    fn is_low(&mut self) -> Result<bool, Self::Error> {
        self.is_high().map(|high| !high)
    }
}

fn board(
    counter: Script,
    converter: Script,
    active: PinState,
) -> SpiBoard<Script, Script, Pin, Pin> {
    let line = || Line {
        pin: Pin::default(),
        active,
    };
    SpiBoard {
        counter: Ls7366r::new(counter, CounterWidth::Bits32),
        converter: Ad57x1r::new(converter, Ad57x1rModel::Ad5761r),
        enable: line(),
        stop: line(),
    }
}

#[test]
fn both_lines_obey_their_polarity() {
    for active in [PinState::High, PinState::Low] {
        let mut board = board(Script::of(&COUNTER_32), Script::of(&CONVERTER), active);
        board.initialise().expect("as planned");
        board.set_power(true).expect("whole");
        assert_eq!(board.enable.pin.levels, [!active, active]);
        // The stop pin is low until it has seen a level.
        assert_eq!(board.emergency_stop(), Ok(active == PinState::Low));
        board.stop.pin.levels.push(PinState::High);
        assert_eq!(board.emergency_stop(), Ok(active == PinState::High));
        assert_eq!(board.load_register(), Ok(None));
    }
}

#[test]
fn every_lost_transaction_of_an_initialisation_is_reported_as_it_is() {
    for at in 0..COUNTER_32.len() {
        let counter = Script::of(&COUNTER_32[..at]).then_lost(COUNTER_32[at].0, 7);
        let mut board = board(counter, Script::of(&CONVERTER), PinState::High);
        let lost = SpiBoardError::Counter(Ls7366rError::Bus(Lost(7)));
        assert_eq!(board.initialise(), Err(lost));
        assert_eq!(board.enable.pin.levels, [PinState::Low]);
        board.counter.spi.assert_done();
    }
    for at in 0..CONVERTER.len() {
        let converter = Script::of(&CONVERTER[..at]).then_lost(CONVERTER[at].0, 8);
        let mut board = board(Script::of(&[]), converter, PinState::High);
        let lost = SpiBoardError::Converter(Ad57x1rError::Bus(Lost(8)));
        assert_eq!(board.initialise(), Err(lost));
        assert_eq!(board.enable.pin.levels, [PinState::Low]);
        board.converter.spi.assert_done();
    }
}

#[test]
fn switching_off_tries_both_and_power_first() {
    // The enable line fails: the code is set to 0 all the same.
    let mut broken = board(
        Script::of(&[]),
        Script::of(&[(&[0x03, 0, 0], &[])]),
        PinState::High,
    );
    broken.enable.pin.broken = true;
    let error = broken.switch_off().expect_err("the line is broken");
    assert_eq!(error, SpiBoardError::Enable(digital::ErrorKind::Other));
    broken.converter.spi.assert_done();

    // The bus fails: the power is off all the same.
    let lost = Script::of(&[]).then_lost(&[0x03, 0, 0], 9);
    let mut board = board(Script::of(&[]), lost, PinState::High);
    let error = board.switch_off().expect_err("the bus is broken");
    assert_eq!(
        error.to_string(),
        "the transfer to the converter failed: Lost(9)"
    );
    assert_eq!(board.enable.pin.levels, [PinState::Low]);

    board.stop.pin.broken = true;
    let error = board.emergency_stop().expect_err("the line is broken");
    assert_eq!(
        error,
        SpiBoardError::EmergencyStop(digital::ErrorKind::Other)
    );
}

/// A board with a load-side encoder overrides one method; errors of its own
/// need no more than `Debug`.
#[test]
fn a_board_may_have_a_second_encoder() {
    struct Two;
    impl Board for Two {
        type Error = Infallible;
        fn motor_register(&mut self) -> Result<u32, Infallible> {
            Ok(1)
        }
        fn set_code(&mut self, _: i32) -> Result<(), Infallible> {
            Ok(())
        }
        fn set_power(&mut self, _: bool) -> Result<(), Infallible> {
            Ok(())
        }
        fn emergency_stop(&mut self) -> Result<bool, Infallible> {
            Ok(false)
        }
        fn load_register(&mut self) -> Result<Option<u32>, Infallible> {
            Ok(Some(2))
        }
    }
    assert_eq!(
        (Two.motor_register(), Two.load_register()),
        (Ok(1), Ok(Some(2)))
    );
}
