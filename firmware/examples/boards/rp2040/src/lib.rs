//! An RP2040, such as a Raspberry Pi Pico, as the board of an axis.
//!
//! | pin | direction | connects to |
//! | --- | --- | --- |
//! | GP2, GP3 | in, pull-up | encoder A, B, 3.3 V |
//! | GP4, GP5 | out, PWM slice 2 A, B | inputs of an H-bridge: forth, back |
//! | GP6 | out, high: power on | enable of the H-bridge, **and 10 kΩ to ground** |
//! | GP7 | in, pull-down, low: stop | normally closed contacts to 3.3 V |
//! | GP8 | in, pull-up, low: pressed | button to ground |
//! | GP0 | out, UART 0, 115,200 baud | host, for what an example says |
//!
//! | clock or period | |
//! | --- | --- |
//! | system | 125 MHz from the crystal of 12 MHz |
//! | encoder | PIO 0 at the system's clock: 11 cycles at most for a count, 11 million counts a second |
//! | PWM | 125 MHz / 4,096 = 30.5 kHz; a code acts at the next period, 33 µs later at most |
//! | Δt | 1 ms; 1 MHz timer as the count of samples |
//! | watchdog | 10 ms: a program that hangs is a reset, and behind it the resistor keeps the power off |
//!
//! Built by `scripts/test`, **never run on a chip**.

#![no_std]

use drive::{PERIOD_US, PWM_COUNTS, Panel, duties};
use embassy_rp::gpio::{Input, Level, Output, Pull};
use embassy_rp::peripherals::PIO0;
use embassy_rp::pio::program::pio_file;
use embassy_rp::pio::{Config, Direction, InterruptHandler, Pio, ShiftDirection, StateMachine};
use embassy_rp::pwm::{self, Pwm};
use embassy_rp::uart::{self, Blocking, UartTx};
use embassy_rp::watchdog::Watchdog;
use embassy_rp::{Peripherals, bind_interrupts};
use embassy_time::{Duration, Instant};
use firmware::Board;

bind_interrupts!(struct Irqs {
    PIO0_IRQ_0 => InterruptHandler<PIO0>;
});

/// Encoder, H-bridge, stop, button and watchdog.
pub struct Electronics {
    encoder: StateMachine<'static, PIO0, 0>,
    bridge: Pwm<'static>,
    power: Output<'static>,
    closed_loop: Input<'static>,
    button: Input<'static>,
    watchdog: Watchdog,
}

/// The state machine has pushed no count.
#[derive(Debug)]
pub struct NoCount;

/// The watchdog's time.
const PATIENCE: Duration = Duration::from_millis(10);

/// Waits for a count: far above 11 cycles.
const TRIES: u32 = 1_000;

impl Electronics {
    /// The board without power, its watchdog not yet started, and its UART.
    pub fn new(chip: Peripherals) -> (Self, UartTx<'static, Blocking>) {
        let mut watchdog = Watchdog::new(chip.WATCHDOG);
        watchdog.pause_on_debug(false);
        let Pio {
            mut common,
            sm0: mut encoder,
            ..
        } = Pio::new(chip.PIO0, Irqs);
        let program = pio_file!("src/quadrature.pio");
        let mut pins = [
            common.make_pio_pin(chip.PIN_2),
            common.make_pio_pin(chip.PIN_3),
        ];
        pins.iter_mut().for_each(|pin| pin.set_pull(Pull::Up));
        let [a, b] = &pins;
        let mut config = Config::default();
        config.use_program(&common.load_program(&program.program), &[]);
        config.set_in_pins(&[a, b]);
        config.shift_in.direction = ShiftDirection::Left;
        encoder.set_pin_dirs(Direction::In, &[a, b]);
        encoder.set_config(&config);
        encoder.set_enable(true);
        let bridge = Pwm::new_output_ab(chip.PWM_SLICE2, chip.PIN_4, chip.PIN_5, pwm([0, 0]));
        let electronics = Self {
            encoder,
            bridge,
            power: Output::new(chip.PIN_6, Level::Low),
            closed_loop: Input::new(chip.PIN_7, Pull::Down),
            button: Input::new(chip.PIN_8, Pull::Up),
            watchdog,
        };
        let uart = UartTx::new_blocking(chip.UART0, chip.PIN_0, uart::Config::default());
        (electronics, uart)
    }

    /// From here on [`Panel::feed`] must come within 10 ms.
    pub fn start_watchdog(&mut self) {
        self.watchdog.start(PATIENCE);
    }
}

fn pwm([forth, back]: [u16; 2]) -> pwm::Config {
    let mut config = pwm::Config::default();
    config.top = PWM_COUNTS - 1;
    (config.compare_a, config.compare_b) = (forth, back);
    config
}

impl Board for Electronics {
    type Error = NoCount;

    fn motor_register(&mut self) -> Result<u32, NoCount> {
        // The queue holds four counts, which may be old; the fifth is new.
        let mut fifth = None;
        for _ in 0..5 {
            fifth = (0..TRIES).find_map(|_| self.encoder.rx().try_pull());
        }
        fifth.ok_or(NoCount)
    }

    fn set_code(&mut self, code: i32) -> Result<(), NoCount> {
        self.bridge.set_config(&pwm(duties(code)));
        Ok(())
    }

    fn set_power(&mut self, on: bool) -> Result<(), NoCount> {
        self.power.set_level(on.into());
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, NoCount> {
        Ok(self.closed_loop.is_low())
    }
}

impl Panel for Electronics {
    const COUNTS_PER_SAMPLE: u32 = PERIOD_US;

    fn counter(&self) -> u32 {
        let [a, b, c, d, ..] = Instant::now().as_micros().to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }

    fn button_is_down(&self) -> bool {
        self.button.is_low()
    }

    fn feed(&mut self) {
        self.watchdog.feed(PATIENCE);
    }
}
