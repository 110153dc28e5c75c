//! Drive mode on a motor in memory: the button's way through the states, and
//! what each fault does.

#![allow(
    clippy::as_conversions,
    clippy::expect_used,
    clippy::float_arithmetic,
    reason = "a motor in memory, and tests that stop where their setup fails"
)]

use firmware::axis::AxisOutput;
use firmware::{Board, FaultCause, State};
use stm32f407_drive::axis::{AXIS, TRAVEL_COUNTS, motions};
use stm32f407_drive::{Drive, Planned, Ticks};

/// The paper's motor without load, roughly: 120 V at the largest code, 0.25 V s/rad,
/// 636.6 counts/rad, a time constant of 5 samples.
#[derive(Debug, Default)]
struct Motor {
    position: f64,
    speed: f64,
    code: i32,
    powered: bool,
    stop: bool,
    /// Counts do not come any more.
    encoder_cut: bool,
    register: u32,
    converter_cut: bool,
}

#[derive(Debug)]
struct Cut;

impl Board for Motor {
    type Error = Cut;

    fn motor_register(&mut self) -> Result<u32, Cut> {
        if !self.encoder_cut {
            self.register = (self.position.floor() as i32).cast_unsigned();
        }
        Ok(self.register)
    }

    fn set_code(&mut self, code: i32) -> Result<(), Cut> {
        if self.converter_cut {
            return Err(Cut);
        }
        self.code = code;
        Ok(())
    }

    fn set_power(&mut self, on: bool) -> Result<(), Cut> {
        self.powered = on;
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, Cut> {
        Ok(self.stop)
    }
}

impl Motor {
    fn turn(&mut self) {
        let volts = if self.powered {
            f64::from(self.code) * 120.0 / 32_768.0
        } else {
            0.0
        };
        let steady = volts / 0.25 * 636.6 * 1e-3;
        self.speed += (steady - self.speed) / 5.0;
        self.position += self.speed;
    }
}

struct Bench<'p> {
    drive: Drive<'p, Motor>,
    ticks: Ticks,
    counter: u32,
}

impl Bench<'_> {
    fn run(&mut self, samples: u32, down: bool) -> AxisOutput {
        let mut last = None;
        for _ in 0..samples {
            self.counter += 1;
            let tick = self.ticks.number(self.counter);
            last = Some(self.drive.sample(tick, down));
            self.drive.board.turn();
        }
        last.expect("a sample")
    }

    fn press(&mut self) -> AxisOutput {
        self.run(30, true);
        self.run(30, false)
    }

    fn fault(&self) -> Option<FaultCause> {
        self.drive.state().fault().map(|fault| fault.cause)
    }

    fn assert_safe(&self, cause: FaultCause) {
        assert_eq!(self.drive.state().state(), State::Fault);
        assert_eq!(self.fault(), Some(cause));
        assert!(!self.drive.board.powered);
        if cause != FaultCause::HardwareBus {
            assert_eq!(self.drive.board.code, 0);
        }
    }
}

fn bench(plans: &[Planned; 2]) -> Bench<'_> {
    let [forth, back] = plans;
    let mut bench = Bench {
        drive: Drive::new(AXIS, Motor::default(), forth, back),
        ticks: Ticks::default(),
        counter: 0,
    };
    bench.run(30, false);
    bench
}

/// Enabled, and 300 ms into its first motion.
fn moving(plans: &[Planned; 2]) -> Bench<'_> {
    let mut bench = bench(plans);
    bench.press();
    bench.press();
    let output = bench.run(240, false);
    assert_eq!((output.state, output.power), (State::Moving, true));
    assert!(bench.drive.board.position > 100.0);
    bench
}

#[test]
fn presses_enable_and_move_to_and_fro() {
    let plans = motions().expect("two motions");
    let mut bench = bench(&plans);
    assert_eq!(bench.run(50, false).state, State::Disabled);
    assert!(!bench.drive.board.powered);
    assert_eq!(bench.press().state, State::Enabled);
    for end in [TRAVEL_COUNTS, 0, TRAVEL_COUNTS] {
        assert_eq!(bench.press().state, State::Moving);
        assert_eq!(bench.run(5_000, false).state, State::Holding);
        let off = bench.drive.board.position - f64::from(end);
        assert!(off.abs() < 3.0, "{off} counts beside {end}");
    }
    assert_eq!(bench.fault(), None);
}

#[test]
fn a_press_in_motion_switches_off_and_the_next_motions_stay_near() {
    let plans = motions().expect("two motions");
    let mut bench = bench(&plans);
    bench.press();
    for _ in 0..6 {
        bench.press();
        bench.run(500, false);
        let output = bench.press();
        assert_eq!((output.state, output.power), (State::Disabled, false));
        bench.run(50, false);
        bench.press();
        let position = bench.drive.board.position;
        let half = f64::from(TRAVEL_COUNTS) / 2.0;
        assert!(position > -half && position < 3.0 * half, "{position}");
    }
    assert_eq!(bench.fault(), None);
}

#[test]
fn the_stop_acts_in_its_sample_and_waits_for_two_presses() {
    let plans = motions().expect("two motions");
    let mut bench = moving(&plans);
    bench.drive.board.stop = true;
    bench.run(1, false);
    bench.assert_safe(FaultCause::EmergencyStop);
    // A press while it is asserted does not help.
    bench.press();
    bench.assert_safe(FaultCause::EmergencyStop);
    bench.drive.board.stop = false;
    bench.run(100, false);
    assert_eq!(bench.press().state, State::Disabled);
    assert_eq!(bench.press().state, State::Enabled);
    assert_eq!(bench.fault(), None);
}

#[test]
fn a_missed_tick_and_an_overrun_are_faults() {
    let plans = motions().expect("two motions");
    let mut bench = moving(&plans);
    bench.counter += 1;
    bench.run(1, false);
    bench.assert_safe(FaultCause::MissedTick);

    let mut bench = moving(&plans);
    bench.ticks.overrun();
    bench.run(1, false);
    bench.assert_safe(FaultCause::MissedTick);
}

#[test]
fn a_lost_encoder_is_a_fault_before_a_millimetre_is_gone() {
    let plans = motions().expect("two motions");
    let mut bench = moving(&plans);
    bench.drive.board.encoder_cut = true;
    let before = bench.drive.board.position;
    bench.run(200, false);
    bench.assert_safe(FaultCause::FollowingError);
    // 400 counts of error, and what the motor does until it stands.
    assert!(bench.drive.board.position - before < 4_000.0);
}

#[test]
fn a_converter_that_does_not_answer_is_a_fault() {
    let plans = motions().expect("two motions");
    let mut bench = moving(&plans);
    bench.drive.board.converter_cut = true;
    bench.run(1, false);
    bench.assert_safe(FaultCause::HardwareBus);
    // A press resets it, and the next sample finds it again: 0 is a code, too.
    bench.press();
    bench.assert_safe(FaultCause::HardwareBus);
    // The contrast: mended, the same press leaves the fault.
    bench.drive.board.converter_cut = false;
    assert_eq!(bench.press().state, State::Disabled);
    assert_eq!(bench.fault(), None);
}
