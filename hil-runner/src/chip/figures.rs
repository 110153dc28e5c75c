//! What a chip's part of a run costs: instructions, cycles, memory.

use firmware::State;
use firmware_link::{Identity, Status};
use serde::Serialize;

use crate::message::Busy;

/// The chip's part of a summary; its keys stand among those of the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChipReport {
    /// Name of the target, as the image says it.
    pub target: String,
    /// CRC-32 of the image, as the chip read it from its flash.
    pub image_hash: String,
    /// Samples that the chip has computed.
    pub link_steps: u64,
    /// Clock that times are given at \[Hz\].
    pub clock_hz: u64,
    /// Most instructions of a step; `None` on a board, which counts cycles.
    pub instructions_per_step_max: Option<u32>,
    /// Median of the instructions of a step.
    pub instructions_per_step_median: Option<u32>,
    /// Most cycles of a step: counted, or instructions times
    /// `target.cycles_per_instruction`.
    ///
    /// `None`, like the next two, where the chip's timer stands still.
    pub cycles_per_step_max: Option<u64>,
    /// Longest step as a share of the sample time \[%\].
    pub utilisation_max_percent: Option<f64>,
    /// Steps that took longer than the sample time.
    pub late_steps: Option<u64>,
    /// Flash that the image takes \[bytes\].
    pub flash_bytes: u32,
    /// Static RAM less the table of setpoints \[bytes\].
    pub ram_bytes: u32,
    /// Deepest stack \[bytes\]; `None` where the chip does not know it.
    pub stack_bytes: Option<u32>,
    /// The same by the state after the step.
    pub states: Vec<StateCost>,
}

impl ChipReport {
    /// A figure by its key; `None` where the chip gives none, and for keys that
    /// are no figure of a chip.
    pub fn figure(&self, key: &str) -> Option<f64> {
        match key {
            "instructions_per_step_max" => self.instructions_per_step_max.map(f64::from),
            "instructions_per_step_median" => self.instructions_per_step_median.map(f64::from),
            "cycles_per_step_max" => self.cycles_per_step_max.map(|cycles| cycles as f64),
            "utilisation_max_percent" => self.utilisation_max_percent,
            "late_steps" => self.late_steps.map(|steps| steps as f64),
            "flash_bytes" => Some(f64::from(self.flash_bytes)),
            "ram_bytes" => Some(f64::from(self.ram_bytes)),
            "stack_bytes" => self.stack_bytes.map(f64::from),
            _ => None,
        }
    }
}

/// What the steps that end in one state cost.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StateCost {
    /// The state; "paper" for the controller without states.
    pub state: &'static str,
    /// Steps.
    pub steps: u64,
    /// Most instructions of a step; of cycles on a board.
    pub max: u64,
    /// Median.
    pub median: u64,
}

/// Name of the steps of the paper's controller, which has no states.
const NO_STATE: &str = "paper";

/// Collects what the steps of a run cost.
#[derive(Debug, Clone, Default)]
pub(crate) struct BusyFigures {
    /// By state, in the order of [`State::ALL`], the paper's last: instructions
    /// or cycles.
    counts: [Vec<u64>; State::ALL.len() + 1],
    counts_instructions: bool,
    most_cycles: u64,
    longest_ns: u64,
    late_steps: u64,
}

impl BusyFigures {
    /// A step that ended in `state`, `None` for the paper's controller, with a
    /// sample time of `period_ns`.
    pub(crate) fn add(&mut self, busy: Busy, state: Option<State>, period_ns: u64) {
        let place = state.and_then(|state| State::ALL.iter().position(|known| *known == state));
        let place = place.unwrap_or(State::ALL.len());
        self.counts_instructions = busy.instructions.is_some();
        let count = busy.instructions.map_or(busy.cycles, u64::from);
        if let Some(counts) = self.counts.get_mut(place) {
            counts.push(count);
        }
        self.most_cycles = self.most_cycles.max(busy.cycles);
        self.longest_ns = self.longest_ns.max(busy.time_ns);
        self.late_steps += u64::from(busy.time_ns > period_ns);
    }

    /// The report on a chip that says `identity` and `status` of itself.
    pub(crate) fn report(
        mut self,
        identity: &Identity,
        status: &Status,
        clock_hz: u64,
        period_ns: u64,
    ) -> ChipReport {
        let names = State::ALL.iter().map(|state| state.name());
        let mut states = Vec::new();
        let mut all = Vec::new();
        for (name, counts) in names.chain([NO_STATE]).zip(&mut self.counts) {
            counts.sort_unstable();
            if let (Some(max), Some(median)) = (counts.last(), median(counts)) {
                states.push(StateCost {
                    state: name,
                    steps: counts.len() as u64,
                    max: *max,
                    median,
                });
            }
            all.append(counts);
        }
        all.sort_unstable();
        let instructions = |count: Option<u64>| {
            let count = count.filter(|_| self.counts_instructions)?;
            u32::try_from(count).ok()
        };
        // Every step takes some cycles, where the timer runs.
        let runs = self.most_cycles > 0;
        ChipReport {
            target: name_of(identity),
            image_hash: format!("{:08x}", identity.image_crc),
            link_steps: all.len() as u64,
            clock_hz,
            instructions_per_step_max: instructions(all.last().copied()),
            instructions_per_step_median: instructions(median(&all)),
            cycles_per_step_max: runs.then_some(self.most_cycles),
            utilisation_max_percent: runs
                .then_some(100.0 * self.longest_ns as f64 / period_ns as f64),
            late_steps: runs.then_some(self.late_steps),
            flash_bytes: identity.flash_bytes,
            ram_bytes: identity.ram_bytes,
            stack_bytes: Some(status.stack_bytes).filter(|bytes| *bytes > 0),
            states,
        }
    }
}

/// What a chip calls itself; what is no letter, number or sign is a question
/// mark.
pub fn name_of(identity: &Identity) -> String {
    let name = identity.target.iter().take_while(|byte| **byte != 0);
    name.map(|byte| match char::from(*byte) {
        sign if sign.is_ascii_graphic() => sign,
        _ => '?',
    })
    .collect()
}

/// The lower median of sorted counts.
fn median(sorted: &[u64]) -> Option<u64> {
    sorted.get(sorted.len().saturating_sub(1) / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_told_by_state() {
        let mut figures = BusyFigures::default();
        let busy = |instructions| Busy {
            instructions: Some(instructions),
            cycles: 4 * u64::from(instructions),
            time_ns: 1_000 * u64::from(instructions),
        };
        for (instructions, state) in [
            (10, State::Moving),
            (30, State::Moving),
            (20, State::Moving),
            (5, State::Fault),
        ] {
            figures.add(busy(instructions), Some(state), 25_000);
        }
        let identity = Identity {
            version: 1,
            target: *b"m4\0\0\0\0\0\0",
            image_crc: 0xab,
            flash_bytes: 1,
            ram_bytes: 2,
            table_capacity: 3,
            timer_hz: 4,
        };
        let status = Status {
            stack_bytes: 0,
            steps: 4,
        };
        let report = figures.report(&identity, &status, 1, 25_000);
        assert_eq!(
            (report.target.as_str(), report.image_hash.as_str()),
            ("m4", "000000ab")
        );
        assert_eq!(report.instructions_per_step_max, Some(30));
        assert_eq!(report.instructions_per_step_median, Some(10));
        assert_eq!(report.cycles_per_step_max, Some(120));
        assert_eq!(report.late_steps, Some(1));
        assert_eq!(report.utilisation_max_percent, Some(120.0));
        assert_eq!(report.stack_bytes, None);
        let moving = StateCost {
            state: "moving",
            steps: 3,
            max: 30,
            median: 20,
        };
        let fault = StateCost {
            state: "fault",
            steps: 1,
            max: 5,
            median: 5,
        };
        assert_eq!(report.states, [moving, fault]);
    }
}
