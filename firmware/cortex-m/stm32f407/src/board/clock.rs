//! The clock tree: 168 MHz from the crystal, or 16 MHz where it does not start.
//!
//! ```text
//!  crystal 8 MHz ─ /8 ─ ×336 ─ /2 ─► 168 MHz core ─ /4 ─► 42 MHz APB1: USART2, SPI2
//!                                                └─ ×2 ─► 84 MHz its timers
//! ```

use stm32f4::stm32f407::{FLASH, RCC};
use stm32f407_drive::axis::{PERIOD_NS, SAMPLES_PER_S};

/// Baud rate of the line.
pub(super) const BAUD: u32 = 921_600;

/// Polls for an oscillator, a PLL or a switch: above 35 ms at 16 MHz, where the
/// data sheet gives a crystal 2 ms (DS 5.3.8) and a PLL 0.3 ms (DS 5.3.10).
const TRIES: u32 = 100_000;

/// RM 7.3.2: from the crystal (bit 22); M = 8 makes 1 MHz of it, N = 336 336 MHz,
/// P = 2 (bits 17 and 16: 0) the core's, Q = 7 the 48 MHz of a USB. Allowed are
/// M 2 to 63, N 50 to 432, Q 2 to 15, and 1 to 2 MHz behind M, 100 to 432 MHz
/// behind N. The regulator stands at scale 1 after reset (RM 5.4.1), as 168 MHz
/// need.
const PLL: u32 = (1 << 22) | 8 | (336 << 6) | (7 << 24);

/// Fields of that register: Q, source, P, N and M. The others are reserved and
/// "must be kept at reset value" (RM 7.3.2), which is not 0 for bit 29.
const PLL_FIELDS: u32 = (0xf << 24) | (1 << 22) | (3 << 16) | (0x1ff << 6) | 0x3f;

/// The register with this PLL in it.
const fn with_pll(register: u32) -> u32 {
    (register & !PLL_FIELDS) | PLL
}

/// From RM 7.3.2's reset value, bit 29 is kept; Q = 4, N = 192 and M = 16 are not.
const _: () = assert!(with_pll(0x2400_3010) == 0x2740_5408 && PLL & !PLL_FIELDS == 0);

/// Clocks and their speeds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clocks {
    /// The core \[Hz\].
    pub(super) core_hz: u32,
    /// Divisor of the line's baud rate, in sixteenths (RM 30.3.4).
    pub(super) baud_sixteenths: u8,
    /// Prescaler of a timer on APB1 that counts microseconds.
    pub(super) timer_prescaler: u16,
    /// True if the crystal runs: ±50 ppm, the RC oscillator ±1 % at 25 °C.
    pub(super) crystal: bool,
}

impl Clocks {
    const fn new(core_hz: u32, apb1_hz: u32, timer_mhz: u16, crystal: bool) -> Self {
        // 16·f/(16·baud), to the nearest.
        let sixteenths = (apb1_hz + BAUD / 2) / BAUD;
        assert!(
            16 <= sixteenths && sixteenths < 256,
            "the divisor's range here"
        );
        let [baud_sixteenths, ..] = sixteenths.to_le_bytes();
        Self {
            core_hz,
            baud_sixteenths,
            timer_prescaler: timer_mhz - 1,
            crystal,
        }
    }

    /// 913,043 baud, 0.9 % slow.
    const CRYSTAL: Self = Self::new(168_000_000, 42_000_000, 84, true);
    /// 941,176 baud, 2.1 % fast.
    const NO_CRYSTAL: Self = Self::new(16_000_000, 16_000_000, 16, false);
}

/// Microseconds of a sample fill the timer's 16 bits.
const _: () = assert!(PERIOD_NS.is_multiple_of(1_000) && PERIOD_NS / 1_000 <= 1 << 16);
const _: () = assert!(SAMPLES_PER_S > 0);

/// From the state after reset, where the core runs from the RC oscillator.
pub(super) fn start(rcc: &RCC, flash: &FLASH) -> Clocks {
    if run_from_crystal(rcc, flash) {
        return Clocks::CRYSTAL;
    }
    // Back, wherever it stopped; the RC oscillator has never been off.
    rcc.cfgr()
        .modify(|_, w| w.sw().hsi().ppre1().div1().ppre2().div1());
    rcc.cr().modify(|_, w| w.pllon().off().hseon().off());
    Clocks::NO_CRYSTAL
}

fn run_from_crystal(rcc: &RCC, flash: &FLASH) -> bool {
    rcc.cr().modify(|_, w| w.hseon().on());
    if !soon(TRIES, || rcc.cr().read().hserdy().is_ready()) {
        return false;
    }
    // SAFETY: `PLL` keeps to what the manual allows, and all else stays.
    rcc.pllcfgr()
        .modify(|r, w| unsafe { w.bits(with_pll(r.bits())) });
    rcc.cr().modify(|_, w| w.pllon().on());
    if !soon(TRIES, || rcc.cr().read().pllrdy().is_ready()) {
        return false;
    }
    // RM 3.5.1, table 10: 5 wait states at 168 MHz and 2.7 V to 3.6 V; the caches
    // hide most of them. The new number holds when it is read back.
    flash.acr().write(|w| {
        w.latency().ws5().prften().enabled();
        w.icen().enabled().dcen().enabled()
    });
    if !soon(TRIES, || flash.acr().read().latency().is_ws5()) {
        return false;
    }
    // DS table 14: APB1 at most 42 MHz, APB2 84 MHz.
    rcc.cfgr()
        .modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll());
    soon(TRIES, || rcc.cfgr().read().sws().is_pll())
}

/// Polls until something is ready, `tries` times at most; no wait is endless.
pub(super) fn soon(tries: u32, mut ready: impl FnMut() -> bool) -> bool {
    (0..tries).any(|_| ready())
}
