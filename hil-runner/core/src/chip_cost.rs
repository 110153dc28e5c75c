//! Cost of a chip's part of a run: instructions, cycles, memory.

use firmware::State;
use serde::Serialize;

/// Execution time of one sample on a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExecutionTime {
    /// Instructions; `None` on a board, which counts cycles.
    pub instructions: Option<u32>,
    /// Cycles of the core: counted, or instructions times a stated factor.
    pub cycles: u64,
    /// The same at the chip's clock \[ns\], rounded up.
    pub time_ns: u64,
}

/// The chip's part of a summary; its keys stand among those of the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
    /// Longest execution time as a share of the sample time \[%\].
    pub utilisation_max_percent: Option<f64>,
    /// Steps that took longer than the sample time.
    pub deadline_misses: Option<u64>,
    /// Flash that the image takes \[bytes\].
    pub flash_bytes: u32,
    /// Static RAM less the table of setpoints \[bytes\].
    pub ram_bytes: u32,
    /// Deepest stack \[bytes\]; `None` where the chip does not know it.
    pub stack_bytes: Option<u32>,
    /// The same by the state after the step.
    pub states: Vec<StateCost>,
    /// Words of a table of setpoints that the chip's memory has no room for, and its room: the
    /// setpoints came with the samples. The run tells it in a warning.
    #[serde(skip)]
    pub streamed_words: Option<[usize; 2]>,
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
            "deadline_misses" => self.deadline_misses.map(|steps| steps as f64),
            "flash_bytes" => Some(f64::from(self.flash_bytes)),
            "ram_bytes" => Some(f64::from(self.ram_bytes)),
            "stack_bytes" => self.stack_bytes.map(f64::from),
            _ => None,
        }
    }
}

/// Cost of the steps that end in one state.
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
pub struct ExecutionFigures {
    /// By state, in the order of [`State::ALL`], the paper's last: instructions
    /// or cycles.
    counts: [Vec<u64>; State::ALL.len() + 1],
    counts_instructions: bool,
    most_cycles: u64,
    longest_ns: u64,
    deadline_misses: u64,
}

impl ExecutionFigures {
    /// A step that ended in `state`, `None` for the paper's controller, with a
    /// sample time of `period_ns`.
    pub(crate) fn add(&mut self, time: ExecutionTime, state: Option<State>, period_ns: u64) {
        let place = state.and_then(|state| State::ALL.iter().position(|known| *known == state));
        let place = place.unwrap_or(State::ALL.len());
        self.counts_instructions = time.instructions.is_some();
        let count = time.instructions.map_or(time.cycles, u64::from);
        self.counts[place].push(count);
        self.most_cycles = self.most_cycles.max(time.cycles);
        self.longest_ns = self.longest_ns.max(time.time_ns);
        self.deadline_misses += u64::from(time.time_ns > period_ns);
    }

    /// The report on a chip that says `own` of itself, with everything that the steps
    /// of the run cost.
    pub fn report(mut self, own: ChipReport, period_ns: u64) -> ChipReport {
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
            link_steps: all.len() as u64,
            instructions_per_step_max: instructions(all.last().copied()),
            instructions_per_step_median: instructions(median(&all)),
            cycles_per_step_max: runs.then_some(self.most_cycles),
            utilisation_max_percent: runs
                .then_some(100.0 * self.longest_ns as f64 / period_ns as f64),
            deadline_misses: runs.then_some(self.deadline_misses),
            states,
            ..own
        }
    }
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
        let mut figures = ExecutionFigures::default();
        let time = |instructions| ExecutionTime {
            instructions: Some(instructions),
            cycles: 4 * u64::from(instructions),
            time_ns: 1_000 * u64::from(instructions),
        };
        for instructions in [10, 30, 20] {
            figures.add(time(instructions), Some(State::Moving), 25_000);
        }
        figures.add(time(5), Some(State::Fault), 25_000);
        let own = ChipReport {
            target: "m4".to_owned(),
            ..ChipReport::default()
        };
        let report = figures.report(own, 25_000);
        assert_eq!((report.target.as_str(), report.link_steps), ("m4", 4));
        assert_eq!(report.instructions_per_step_max, Some(30));
        assert_eq!(report.instructions_per_step_median, Some(10));
        assert_eq!(report.cycles_per_step_max, Some(120));
        assert_eq!(report.deadline_misses, Some(1));
        assert_eq!(report.utilisation_max_percent, Some(120.0));
        assert_eq!(report.stack_bytes, None);
        let cost = |state, steps, max, median| StateCost {
            state,
            steps,
            max,
            median,
        };
        let (moving, fault) = (cost("moving", 3, 30, 20), cost("fault", 1, 5, 5));
        assert_eq!(report.states, [moving, fault]);
    }
}
