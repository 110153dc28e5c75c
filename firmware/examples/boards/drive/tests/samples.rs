//! The drive on a board in memory: button, samples that are late or left out, stop.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use core::cell::Cell;
use core::convert::Infallible;

use drive::{Drive, PERIOD_US, Panel, Quadrature, duties};
use firmware::{Board, FaultCause, State};

/// A motor that turns by a count a sample for each 28 codes.
#[derive(Default)]
struct Bench {
    register: Cell<u32>,
    power: Cell<bool>,
    time_us: Cell<u32>,
    down: Cell<bool>,
    stop: Cell<bool>,
}

impl Board for &Bench {
    type Error = Infallible;

    fn motor_register(&mut self) -> Result<u32, Infallible> {
        Ok(self.register.get())
    }

    fn set_code(&mut self, code: i32) -> Result<(), Infallible> {
        let turned = self.register.get().wrapping_add_signed(code / 28);
        self.register.set(turned);
        Ok(())
    }

    fn set_power(&mut self, on: bool) -> Result<(), Infallible> {
        self.power.set(on);
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, Infallible> {
        Ok(self.stop.get())
    }
}

impl Panel for &Bench {
    const COUNTS_PER_SAMPLE: u32 = PERIOD_US;

    fn counter(&self) -> u32 {
        self.time_us.get()
    }

    fn button_is_down(&self) -> bool {
        self.down.get()
    }

    fn feed(&mut self) {}
}

#[test]
fn a_press_moves_and_a_sample_that_is_left_out_stops() {
    let bench = Bench::default();
    let mut drive = Drive::new(&bench).expect("the first one");
    assert!(Drive::new(&bench).is_none(), "a second one");
    // Across the end of the counter, up to 0.4 ms late.
    bench.time_us.set(u32::MAX - 100_000);
    let pass = |us| bench.time_us.set(bench.time_us.get().wrapping_add(us));
    let mut run = |samples, down| {
        bench.down.set(down);
        let mut last = State::Disabled;
        for sample in 0..samples {
            let late_us = sample % 5 * 100;
            pass(late_us);
            last = drive.sample().state;
            pass(PERIOD_US - late_us);
        }
        (last, drive.fault().map(|fault| fault.cause))
    };
    // A bounce, and a press.
    assert_eq!(run(19, false), (State::Disabled, None));
    assert_eq!(run(19, true), (State::Disabled, None));
    assert_eq!(run(1, false), (State::Disabled, None));
    assert_eq!(run(20, true), (State::Moving, None));
    assert_eq!(run(5_000, false), (State::Holding, None));
    let position = bench.register.get();
    assert!(position.abs_diff(10_000) < 20, "{position}");
    assert!(bench.power.get());

    // Contrast: a sample that does not come.
    bench
        .time_us
        .set(bench.time_us.get().wrapping_add(PERIOD_US));
    let missed = Some(FaultCause::MissedTick);
    assert_eq!(run(1, false), (State::Fault, missed));
    assert!(!bench.power.get());
    assert_eq!(run(20, true), (State::Disabled, None));

    bench.stop.set(true);
    let stop = Some(FaultCause::EmergencyStop);
    assert_eq!(run(1, false), (State::Fault, stop));
}

#[test]
fn a_code_is_a_duty_of_one_of_two_inputs() {
    let codes = [0, 1, 4_095, -1, -4_096];
    let wanted = [[0, 0], [1, 0], [4_095, 0], [0, 1], [0, 4_096]];
    assert_eq!(codes.map(duties), wanted);
}

#[test]
fn an_edge_is_a_count_and_two_at_once_are_none() {
    let forth = [[true, false], [true, true], [false, true], [false, false]];
    let mut quadrature = Quadrature::new([false; 2]);
    assert_eq!(forth.map(|levels| quadrature.step(levels)), [Some(1); 4]);
    let back = [[false, true], [true, true], [true, false], [false, false]];
    assert_eq!(back.map(|levels| quadrature.step(levels)), [Some(-1); 4]);
    assert_eq!(quadrature.step([false; 2]), Some(0));
    assert_eq!(quadrature.step([true; 2]), None);
}
