//! Drivers and lines together.

use std::convert::Infallible;

use embedded_hal::digital::{self, InputPin, OutputPin, PinState};
use firmware::axis::{Axis, AxisState};
use firmware::hardware::{
    Ad57x1r, Ad57x1rError, Ad57x1rModel, CounterWidth, Line, Ls7366r, Ls7366rError, SpiBoard,
    SpiBoardError, serve,
};
use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::reference::TableSource;
use firmware::{Board, Dac, Event, FaultCause, GainWord, SetpointTable, State};

use crate::converter::{CONVERTER, LOOK};
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
        Script::of(&[LOOK, CONVERTER[3]]),
        PinState::High,
    );
    broken.enable.pin.broken = true;
    let error = broken.switch_off().expect_err("the line is broken");
    assert_eq!(error, SpiBoardError::Enable(digital::ErrorKind::Other));
    broken.converter.spi.assert_done();

    // The bus fails: the power is off all the same.
    let lost = Script::of(&[]).then_lost(LOOK.0, 9);
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

/// A short circuit at the converter is a fault of the sample that finds it, with
/// its record; the contrast: the same sample without the bit.
#[test]
fn a_short_circuit_is_a_fault_of_its_sample() {
    let dac = Dac::with_bits(16).expect("supported");
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let law = Law::accept(words, dac).expect("2 codes a count");
    let output = Output::new(dac, None, Quantiser::Nearest).expect("no slew limit");
    let axis = Axis::new(law, output);
    let table = SetpointTable::<4>::from_counts(&[0, 100]).expect("two setpoints");

    for shorted in [false, true] {
        let answer: &[u8] = if shorted {
            &[0x0C, 0x12, 0xE8]
        } else {
            &[0x0C, 0x02, 0xE8]
        };
        let mut counter: Vec<(&[u8], &[u8])> = Vec::new();
        for _ in 0..2 {
            counter.push((&[0x60, 0, 0, 0, 0], &[0; 5]));
            counter.push((&[0x70, 0], &[0, 0x08]));
        }
        let mut converter = vec![LOOK, CONVERTER[3], LOOK, (&[0x03, 0x00, 0xC8], answer)];
        if shorted {
            // Switched off by the sample, and looked at once more.
            converter.extend([LOOK, (&[0x03, 0, 0], answer)]);
        }
        let mut board = board(Script::of(&counter), Script::of(&converter), PinState::High);

        let mut state = AxisState::start(&axis);
        let mut source = TableSource::new(&table);
        for event in [Event::Enable, Event::Start] {
            state.request(event).expect("out of disabled");
        }
        serve(&mut state, &mut board, &mut source, 0);
        let output = serve(&mut state, &mut board, &mut source, 1);
        board.counter.spi.assert_done();
        board.converter.spi.assert_done();
        let power = board.enable.pin.levels.last();
        if shorted {
            assert_eq!((output.state, output.code), (State::Fault, 0));
            assert_eq!(power, Some(&PinState::Low));
            let fault = state.fault().expect("a short circuit");
            assert_eq!((fault.cause, fault.tick), (FaultCause::HardwareBus, 1));
            assert_eq!((fault.values.measured, fault.values.limit), (1, 0));
            assert_eq!((fault.values.setpoint, fault.values.code), (100, 200));
        } else {
            assert_eq!((output.state, output.code), (State::Holding, 200));
            assert_eq!(power, Some(&PinState::High));
            assert_eq!(state.fault(), None);
        }
    }
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
    let found = (Two.motor_register(), Two.load_register());
    assert_eq!(found, (Ok(1), Ok(Some(2))));
}
