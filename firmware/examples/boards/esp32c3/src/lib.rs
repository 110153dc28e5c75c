//! An ESP32-C3, such as an ESP32-C3-DevKitM-1, as the board of an axis.
//!
//! | pin | direction | connects to |
//! | --- | --- | --- |
//! | GPIO0, GPIO1 | in, pull-up | encoder A, B, 3.3 V |
//! | GPIO6, GPIO7 | out, LEDC channels 0, 1 | inputs of an H-bridge: forth, back |
//! | GPIO10 | out, high: power on | enable of the H-bridge, **and 10 kΩ to ground** |
//! | GPIO3 | in, pull-down, low: stop | normally closed contacts to 3.3 V |
//! | GPIO9 | in, pull-up, low: pressed | the board's BOOT button; free once the program runs |
//!
//! | clock or period | |
//! | --- | --- |
//! | core | 160 MHz from the crystal of 40 MHz |
//! | encoder | **no counter in this chip**: an interrupt at each edge of A and B, above the sample's. It is for slow axes; two edges before their interrupt is served are a fault, and the position is lost |
//! | PWM | 80 MHz / 4,096 = 19.5 kHz; a code acts at the next period, 51 µs later at most |
//! | Δt | 1 ms, system timer; its 1 MHz count as the count of samples |
//! | watchdog | 10 ms: a program that hangs is a reset, and behind it the resistor keeps the power off |
//!
//! Built by `scripts/test`, **never run on a chip**; the rate of edges that it serves
//! is not measured.

#![no_std]

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use critical_section::Mutex;
use drive::{PERIOD_US, Panel, Quadrature, duties};
use esp_hal::gpio::{DriveMode, Event, Input, InputConfig, Io, Level, Output, OutputConfig, Pull};
use esp_hal::interrupt::Priority;
use esp_hal::ledc::channel::{self, Channel, ChannelHW, ChannelIFace};
use esp_hal::ledc::timer::{self, LSClockSource, TimerIFace};
use esp_hal::ledc::{LSGlobalClkSource, Ledc, LowSpeed};
use esp_hal::peripherals::{Peripherals, SYSTIMER, TIMG0};
use esp_hal::time::{Duration, Instant, Rate};
use esp_hal::timer::timg::{MwdtStage, TimerGroup, Wdt};
use firmware::Board;
use static_cell::StaticCell;

/// The encoder's levels and pins, for the interrupt.
type Encoder = (Quadrature, [Input<'static>; 2]);
static ENCODER: Mutex<RefCell<Option<Encoder>>> = Mutex::new(RefCell::new(None));
static COUNT: AtomicU32 = AtomicU32::new(0);
static LOST: AtomicBool = AtomicBool::new(false);

/// Encoder, H-bridge, stop, button and watchdog.
pub struct Electronics {
    forth: Channel<'static, LowSpeed>,
    back: Channel<'static, LowSpeed>,
    power: Output<'static>,
    closed_loop: Input<'static>,
    button: Input<'static>,
    watchdog: Wdt<TIMG0<'static>>,
}

// SAFETY: a channel is no `Send` for the reference to its timer, which nothing
// changes any more.
unsafe impl Send for Electronics {}

/// Two edges came before the interrupt of the first was served: the position is
/// lost until a reset.
#[derive(Debug)]
pub struct LostEdge;

impl Electronics {
    /// The board without power, and the timer for the samples; `None` if the chip
    /// refuses the PWM. From here on [`Panel::feed`] must come within 10 ms.
    pub fn new(chip: Peripherals) -> Option<(Self, SYSTIMER<'static>)> {
        static TIMER: StaticCell<timer::Timer<'static, LowSpeed>> = StaticCell::new();
        let pull = |pull| InputConfig::default().with_pull(pull);
        let mut inputs = [
            Input::new(chip.GPIO0, pull(Pull::Up)),
            Input::new(chip.GPIO1, pull(Pull::Up)),
        ];
        Io::new(chip.IO_MUX).set_interrupt_handler(edge);
        critical_section::with(|section| {
            inputs
                .iter_mut()
                .for_each(|input| input.listen(Event::AnyEdge));
            let quadrature = Quadrature::new(levels(&inputs));
            ENCODER
                .borrow_ref_mut(section)
                .replace((quadrature, inputs));
        });

        let mut ledc = Ledc::new(chip.LEDC);
        ledc.set_global_slow_clock(LSGlobalClkSource::APBClk);
        let timer = TIMER.try_init(ledc.timer(timer::Number::Timer0))?;
        let of_timer = timer::config::Config {
            duty: timer::config::Duty::Duty12Bit,
            clock_source: LSClockSource::APBClk,
            frequency: Rate::from_hz(19_531),
        };
        timer.configure(of_timer).ok()?;
        let of_channel = channel::config::Config {
            timer,
            duty_pct: 0,
            drive_mode: DriveMode::PushPull,
        };
        let mut forth = ledc.channel(channel::Number::Channel0, chip.GPIO6);
        let mut back = ledc.channel(channel::Number::Channel1, chip.GPIO7);
        forth.configure(of_channel).ok()?;
        back.configure(of_channel).ok()?;

        let mut watchdog = TimerGroup::new(chip.TIMG0).wdt;
        watchdog.set_timeout(MwdtStage::Stage0, Duration::from_millis(10));
        watchdog.enable();
        let electronics = Self {
            forth,
            back,
            power: Output::new(chip.GPIO10, Level::Low, OutputConfig::default()),
            closed_loop: Input::new(chip.GPIO3, pull(Pull::Down)),
            button: Input::new(chip.GPIO9, pull(Pull::Up)),
            watchdog,
        };
        Some((electronics, chip.SYSTIMER))
    }
}

fn levels(inputs: &[Input<'_>; 2]) -> [bool; 2] {
    inputs.each_ref().map(Input::is_high)
}

/// An edge of A or B.
#[esp_hal::handler(priority = Priority::Priority3)]
fn edge() {
    critical_section::with(|section| {
        if let Some((quadrature, inputs)) = ENCODER.borrow_ref_mut(section).as_mut() {
            // First, so that an edge after the levels are read comes again.
            inputs.iter_mut().for_each(Input::clear_interrupt);
            match quadrature.step(levels(inputs)) {
                Some(step) => {
                    let count = COUNT.load(Ordering::Relaxed);
                    COUNT.store(count.wrapping_add_signed(step), Ordering::Relaxed);
                }
                None => LOST.store(true, Ordering::Relaxed),
            }
        }
    });
}

impl Board for Electronics {
    type Error = LostEdge;

    fn motor_register(&mut self) -> Result<u32, LostEdge> {
        if LOST.load(Ordering::Relaxed) {
            return Err(LostEdge);
        }
        Ok(COUNT.load(Ordering::Relaxed))
    }

    fn set_code(&mut self, code: i32) -> Result<(), LostEdge> {
        let [forth, back] = duties(code).map(u32::from);
        self.forth.set_duty_hw(forth);
        self.back.set_duty_hw(back);
        Ok(())
    }

    fn set_power(&mut self, on: bool) -> Result<(), LostEdge> {
        self.power.set_level(on.into());
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, LostEdge> {
        Ok(self.closed_loop.is_low())
    }
}

impl Panel for Electronics {
    const COUNTS_PER_SAMPLE: u32 = PERIOD_US;

    fn counter(&self) -> u32 {
        let now_us = Instant::now().duration_since_epoch().as_micros();
        let [a, b, c, d, ..] = now_us.to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }

    fn button_is_down(&self) -> bool {
        self.button.is_low()
    }

    fn feed(&mut self) {
        self.watchdog.feed();
    }
}
