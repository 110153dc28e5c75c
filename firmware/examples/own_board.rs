//! A board of one's own: four methods, and an axis served on it once per
//! sample. Here the board is a motor in memory.
//!
//! ```text
//!                       Motion
//!                              │ setpoints
//!                              ▼
//!  emergency_stop, ────► serve: Axis::tick ────► set_code, set_power
//!  motor_register                                       │
//!        ▲                                              │
//!        └─────────── Bench: a motor in memory ◄────────┘
//! ```
//!
//! `cargo run -p firmware --example own_board`

#![allow(clippy::expect_used, reason = "an example stops where its setup fails")]

use firmware::axis::{Axis, AxisState};
use firmware::hardware::{Board, serve};
use firmware::law::{Law, LawWords};
use firmware::monitor::FollowingErrorMonitor;
use firmware::output::{Output, Quantiser};
use firmware::{Dac, Event, FaultCause, GainWord, Motion, MotionPlan, PlannedMotion, State};

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
    /// Moves the motor to the next sample.
    fn turn(&mut self) {
        if self.powered {
            self.register = self.register.wrapping_add_signed(self.code / 8);
        }
    }
}

/// Kp = 2 codes per count behind 12 bits; more than 100 counts of following
/// error are a fault.
fn axis() -> Axis {
    let dac = Dac::with_bits(12).expect("12 bits are supported");
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let law = Law::accept(words, dac).expect("words for errors up to 2^17 counts");
    let output = Output::new(dac, None, Quantiser::Nearest).expect("no slew limit");
    let mut axis = Axis::new(law, output);
    let at_any_speed = GainWord::new(0, 0);
    let monitor = FollowingErrorMonitor::accept(100, at_any_speed, 0).expect("100 counts");
    axis.monitors.following_error = Some(monitor);
    axis
}

/// Resets a fault, enables and starts.
fn start(state: &mut AxisState) {
    if state.state() == State::Fault {
        state.request(Event::Reset).expect("out of a fault");
    }
    for event in [Event::Enable, Event::Start] {
        state.request(event).expect("out of disabled");
    }
}

fn main() {
    let axis = axis();
    let mut state = AxisState::start(&axis);
    let mut board = Bench::default();
    // The number of the sample; on a chip the timer's interrupt counts it.
    let mut ticks = 0_u64..;
    let mut tick = || ticks.next().expect("2^64 samples");

    // 400 counts, 40 ms up to speed and 40 ms down, a sample every 1 ms.
    let intervals_ps = [0, 40_000_000_000, 0, 0, 0, 40_000_000_000, 0];
    let planned = |counts: i64| {
        let plan = MotionPlan::new(counts << 32, intervals_ps, 1_000_000).expect("a short motion");
        PlannedMotion::<8>::new(&plan, axis.law().words()).expect("few stretches")
    };
    let forth = planned(400);
    let mut motion = Motion::new(&forth, 0);
    start(&mut state);
    for _ in 0..120 {
        serve(&mut state, &mut board, &mut motion, tick());
        board.turn();
    }
    // A quarter of the error goes each sample, until 2·e/8 is less than a count.
    println!("{:?}: {} of 400 counts", state.state(), board.register);
    assert_eq!((state.state(), board.register), (State::Holding, 397));

    // A fault acts in the sample that finds it, and says what it was.
    board.cable_broken = true;
    serve(&mut state, &mut board, &mut motion, tick());
    let fault = state.fault().expect("the cable is broken");
    println!("{}: {fault}", fault.cause.name());
    assert_eq!(fault.cause, FaultCause::HardwareBus);
    assert_eq!((board.code, board.powered), (0, false));

    // Mended, and back to 0: the axis goes on from where it stands.
    board.cable_broken = false;
    let back = planned(-397);
    let mut motion = Motion::new(&back, 397);
    start(&mut state);
    for _ in 0..40 {
        serve(&mut state, &mut board, &mut motion, tick());
        board.turn();
    }
    assert_eq!((state.state(), board.powered), (State::Moving, true));

    board.stop_pressed = true;
    let output = serve(&mut state, &mut board, &mut motion, tick());
    let fault = state.fault().expect("the emergency stop is pressed");
    println!("{}: {fault}", fault.cause.name());
    assert_eq!((output.state, output.power), (State::Fault, false));
    assert_eq!((board.code, board.powered), (0, false));
}

#[test]
fn the_example_holds() {
    main();
}
