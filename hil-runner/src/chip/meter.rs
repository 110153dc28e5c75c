//! From a chip's timer to instructions, cycles and time.
//!
//! QEMU counts instructions, not cycles: with `-icount shift=7` every
//! instruction takes 128 ns of the machine's time, and the chip's timer shows
//! that time. A board's timer counts the cycles of its core.

use firmware_link::Identity;
use hil_core::case::TargetSettings;
use hil_core::chip_cost::ExecutionTime;
use hil_core::message::whole;

use super::spec::Target;

/// Machine time of an instruction in QEMU with `-icount shift=7` \[ns\].
const NS_PER_INSTRUCTION: u64 = 1 << 7;

/// Meaning of a tick of a chip's timer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meter {
    timer_hz: u32,
    /// True if the timer shows instructions, as QEMU's does.
    counts_instructions: bool,
    clock_hz: u64,
    cycles_per_instruction: f64,
}

/// Clocks of common parts \[Hz\]: STM32F407, nRF51, STM32F103, GD32VF103.
const COMMON_CLOCKS_HZ: [(Target, u64); 4] = [
    (Target::M4, 168_000_000),
    (Target::M0, 16_000_000),
    (Target::M3, 72_000_000),
    (Target::Rv32, 108_000_000),
];

impl Meter {
    /// For a chip that says `identity` of itself; one in QEMU counts
    /// instructions.
    pub fn new(identity: &Identity, in_qemu: bool, settings: TargetSettings) -> Self {
        let common = COMMON_CLOCKS_HZ
            .into_iter()
            .find(|(target, _)| identity.target.starts_with(target.name().as_bytes()));
        let clock_hz = settings.clock_hz.or(common.map(|(_, clock_hz)| clock_hz));
        let clock_hz = clock_hz.filter(|_| in_qemu);
        Self {
            timer_hz: identity.timer_hz.max(1),
            counts_instructions: in_qemu,
            clock_hz: clock_hz.unwrap_or(u64::from(identity.timer_hz)),
            cycles_per_instruction: settings.cycles_per_instruction,
        }
    }

    /// The clock that times are given at \[Hz\].
    pub fn clock_hz(&self) -> u64 {
        self.clock_hz
    }

    /// The time that `ticks` stand for.
    pub fn time(&self, ticks: u32) -> ExecutionTime {
        // instructions = round(ticks/f/128 ns)
        let unit = u128::from(self.timer_hz) * u128::from(NS_PER_INSTRUCTION);
        let instructions = (u128::from(ticks) * 2_000_000_000 + unit) / (2 * unit);
        // Below 2^32·10^9/128; what does not fit is no sample's time.
        let instructions = u32::try_from(instructions).unwrap_or(u32::MAX);
        let instructions = self.counts_instructions.then_some(instructions);
        // The cycles of a board.
        let cycles = u64::from(ticks);
        let counted = (cycles, rounded_up(cycles, self.clock_hz));
        let (cycles, time_ns) = instructions.map_or(counted, |n| self.of_instructions(n));
        ExecutionTime {
            instructions,
            cycles,
            time_ns,
        }
    }

    /// Cycles that are allowed for as many instructions, rounded up, and their time
    /// \[ns\].
    pub fn of_instructions(&self, instructions: u32) -> (u64, u64) {
        let cycles = f64::from(instructions) * self.cycles_per_instruction;
        let cycles = whole(cycles.ceil()).unsigned_abs();
        (cycles, rounded_up(cycles, self.clock_hz))
    }
}

/// Time of `cycles` at `hz`, rounded up to whole nanoseconds.
fn rounded_up(cycles: u64, hz: u64) -> u64 {
    let time = (u128::from(cycles) * 1_000_000_000).div_ceil(u128::from(hz.max(1)));
    u64::try_from(time).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meter(timer_hz: u32, in_qemu: bool) -> Meter {
        let identity = Identity {
            version: 1,
            target: [0; 8],
            image_crc: 0,
            flash_bytes: 0,
            ram_bytes: 0,
            table_capacity: 0,
            timer_hz,
        };
        let settings = TargetSettings {
            clock_hz: Some(168_000_000),
            cycles_per_instruction: 4.0,
        };
        Meter::new(&identity, in_qemu, settings)
    }

    #[test]
    fn ticks_of_40_ns_are_instructions_of_128_ns() {
        // The nearest whole number of ticks for each count of instructions.
        for instructions in [0, 1, 2, 100, 744, 1_604, 100_000_u32] {
            let ticks = (f64::from(instructions) * 128.0 / 40.0).round() as u32;
            let time = meter(25_000_000, true).time(ticks);
            assert_eq!(time.instructions, Some(instructions));
            assert_eq!(time.cycles, 4 * u64::from(instructions));
        }
        // 100 instructions, 400 cycles at 168 MHz: 2380.95 ns.
        assert_eq!(meter(25_000_000, true).time(320).time_ns, 2_381);
    }

    #[test]
    fn a_board_counts_cycles() {
        let time = meter(168_000_000, false).time(168);
        assert_eq!(
            (time.instructions, time.cycles, time.time_ns),
            (None, 168, 1_000)
        );
    }
}
