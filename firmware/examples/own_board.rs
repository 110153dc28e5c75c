//! A board of one's own: four methods, here over a motor in memory.
//!
//! ```text
//!  emergency_stop, motor_register ──► Controller::tick ──► set_code, set_power
//!            ▲                                                  │
//!            └───────────── Bench: a motor in memory ◄──────────┘
//! ```
//!
//! `cargo run -p firmware --example own_board`

#![allow(clippy::expect_used, reason = "an example stops where its setup fails")]

use firmware::{Board, Controller, ControllerState, Dac, GainWord, Pid, PidWords, SetpointTable};

/// A motor whose shaft turns by one count per sample for every 8 codes.
#[derive(Debug, Default)]
struct Bench {
    register: u32,
    code: i32,
    powered: bool,
    stop_pressed: bool,
    cable_broken: bool,
}

/// The one thing that can fail on this board.
#[derive(Debug, PartialEq)]
struct BrokenCable;

impl Board for Bench {
    type Error = BrokenCable;

    fn motor_register(&mut self) -> Result<u32, BrokenCable> {
        if self.cable_broken {
            return Err(BrokenCable);
        }
        Ok(self.register)
    }

    fn set_code(&mut self, code: i32) -> Result<(), BrokenCable> {
        self.code = code;
        Ok(())
    }

    fn set_power(&mut self, on: bool) -> Result<(), BrokenCable> {
        self.powered = on;
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, BrokenCable> {
        Ok(self.stop_pressed)
    }
}

impl Bench {
    /// What the motor does until the next sample.
    fn turn(&mut self) {
        if self.powered {
            self.register = self.register.wrapping_add_signed(self.code / 8);
        }
    }
}

/// One sample: inputs, controller, outputs. Whether the axis may go on.
fn tick<B: Board, const N: usize>(
    board: &mut B,
    controller: &Controller<N>,
    state: &mut ControllerState,
) -> Result<bool, B::Error> {
    if board.emergency_stop()? {
        board.switch_off()?;
        return Ok(false);
    }
    let count = board.motor_register()?.cast_signed();
    board.set_code(controller.tick(state, count).code)?;
    Ok(true)
}

/// The same with the rule for errors: any of them switches off at once.
fn sample<B: Board, const N: usize>(
    board: &mut B,
    controller: &Controller<N>,
    state: &mut ControllerState,
) -> bool {
    tick(board, controller, state).unwrap_or_else(|fault| {
        println!("hardware fault, switching off: {fault:?}");
        board
            .switch_off()
            .expect("this board can always switch off");
        false
    })
}

fn main() {
    // Kp = 2 codes per count, nothing else; 400 counts to go.
    let words = PidWords {
        kp: GainWord::new(1 << 30, 29),
        ki_dt: GainWord::new(0, 40),
        kd_per_dt: GainWord::new(0, 32),
        error_bits: 17,
    };
    let pid = Pid::accept(words).expect("words for errors up to 2^17 counts");
    let dac = Dac::with_bits(12).expect("12 bits are supported");
    let setpoints = SetpointTable::<1>::from_counts(&[400]).expect("one setpoint");
    let controller = Controller::new(pid, dac, setpoints);

    let mut board = Bench::default();
    let mut state = ControllerState::default();
    board.set_code(0).expect("this board takes every code");
    board.set_power(true).expect("this board has power");
    for _ in 0..40 {
        assert!(sample(&mut board, &controller, &mut state));
        board.turn();
    }
    // A quarter of the error goes each sample, until 2·e/8 is less than a count.
    println!("after 40 samples: {} of 400 counts", board.register);
    assert_eq!(board.register, 397);

    board.cable_broken = true;
    assert!(!sample(&mut board, &controller, &mut state));
    assert_eq!((board.code, board.powered), (0, false));

    board.cable_broken = false;
    board.stop_pressed = true;
    assert!(!sample(&mut board, &controller, &mut state));
    println!("cable and emergency stop: power off, code 0");
}

#[test]
fn the_example_holds() {
    main();
}
