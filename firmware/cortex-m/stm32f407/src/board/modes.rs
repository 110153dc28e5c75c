//! The two modes: bench, a server behind the line; drive, the axis in the sample
//! interrupt and the line beside it.

use core::cell::Cell;

use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use firmware::{CAPACITY, SetpointTable, State};
use firmware_link::frame::{LARGEST_FRAME, Receiver, encode};
use firmware_link::{Server, Target};
use stm32f4::stm32f407::{IWDG, Interrupt, interrupt};
use stm32f407_drive::axis::{AXIS, motions};
use stm32f407_drive::{Drive, Ticks, answer_while_driving};

use super::chip::Chip;
use super::clock::Clocks;
use super::electronics::Electronics;
use super::line::Line;
use super::pins::{Lamp, Panel};
use super::samples::{Samples, Watchdog};

/// Bench mode: the controller on this chip, the plant at the other end of the
/// line. Serves one host after another; the electronics stay as the reset has
/// left them, off and at 0 V.
pub(super) fn bench(
    mut line: Line,
    mut chip: Chip,
    server: &mut Server,
    table: &mut SetpointTable<CAPACITY>,
) -> ! {
    loop {
        let byte = line.next_byte();
        line.send(server.take(byte, table, &mut chip));
    }
}

/// Drive mode's end of the line.
fn serve(mut line: Line, chip: &Chip) -> ! {
    let mut receiver = Receiver::new();
    loop {
        let received = receiver.take(line.next_byte());
        let reply = received.and_then(|received| answer_while_driving(received, chip.identity()));
        if let Some(frame) = reply.and_then(|reply| encode::<LARGEST_FRAME>(&reply)) {
            line.send(&frame);
        }
    }
}

/// All that the interrupt owns.
#[derive(Debug)]
struct Service {
    drive: Drive<'static, Electronics>,
    panel: Panel,
    samples: Samples,
    ticks: Ticks,
    watchdog: Watchdog,
}

impl Service {
    fn sample(&mut self) {
        let tick = self.ticks.number(self.samples.begin());
        let output = self.drive.sample(tick, self.panel.button_is_down());
        self.panel.show(Lamp::Bench, output.power);
        self.panel.show(Lamp::Fault, output.state == State::Fault);
        self.watchdog.feed();
        if self.samples.is_over() {
            self.ticks.overrun();
        }
    }
}

/// On its way to the interrupt.
static HANDOVER: Mutex<Cell<Option<Service>>> = Mutex::new(Cell::new(None));

/// Drive mode: drives the axis if it can, and answers the line. Without its electronics, or
/// with a motion that has no plan, nothing is driven: the power stays off and
/// the red lamp is lit.
pub(super) fn drive(
    electronics: Option<Electronics>,
    mut panel: Panel,
    samples: Samples,
    watchdog: IWDG,
    clocks: &Clocks,
    line: Line,
    chip: &Chip,
) -> ! {
    panel.show(Lamp::Drive, true);
    match electronics.and_then(planned) {
        Some(drive) => start(drive, panel, samples, watchdog, clocks),
        None => panel.show(Lamp::Fault, true),
    }
    serve(line, chip)
}

fn planned(electronics: Electronics) -> Option<Drive<'static, Electronics>> {
    let motions = motions().ok()?;
    let [forth, back] = cortex_m::singleton!(: [stm32f407_drive::Planned; 2] = motions)?;
    Some(Drive::new(AXIS, electronics, forth, back))
}

fn start(
    drive: Drive<'static, Electronics>,
    panel: Panel,
    mut samples: Samples,
    watchdog: IWDG,
    clocks: &Clocks,
) {
    // The watchdog first: it waits for its oscillator, and a sample is not to.
    let watchdog = Watchdog::start(watchdog);
    samples.start(clocks);
    let service = Service {
        drive,
        panel,
        samples,
        ticks: Ticks::default(),
        watchdog,
    };
    critical_section::with(|section| HANDOVER.borrow(section).set(Some(service)));
    // SAFETY: no critical section relies on this interrupt being masked.
    unsafe { NVIC::unmask(Interrupt::TIM3) };
}

#[interrupt]
fn TIM3() {
    static mut SERVICE: Option<Service> = None;

    if SERVICE.is_none() {
        *SERVICE = critical_section::with(|section| HANDOVER.borrow(section).take());
    }
    if let Some(service) = SERVICE {
        service.sample();
    }
}
