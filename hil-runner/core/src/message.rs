//! The meeting of controller and plant: counts one way, codes the other, once per
//! sample.
//!
//! A [`Link`] carries one [`Measurement`] to the controller and its [`Command`]
//! back. In the same process that is a function call; between two threads it is a
//! pair of channels, to a chip a line. All give the same bits: the plant waits for
//! the answer.

use firmware::{Fault, State};

use crate::case::{Case, Law};
use crate::chip_cost::{ChipReport, ExecutionFigures, ExecutionTime};
use crate::quantise::FixedPointGains;

/// Steps of an encoder or of a converter, as the rung has them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Steps {
    /// Any number of them: rung `sampled`, which has neither encoder nor converter.
    Real(f64),
    /// Whole ones, from rung `quantised` up.
    Whole(i64),
}

impl Steps {
    /// As a real number; exact for whole ones below 2^53.
    #[inline]
    pub fn real(self) -> f64 {
        match self {
            Self::Real(steps) => steps,
            Self::Whole(steps) => steps as f64,
        }
    }

    /// As a whole number; a real one loses its fraction.
    #[inline]
    pub fn whole(self) -> i64 {
        match self {
            Self::Real(steps) => whole(steps),
            Self::Whole(steps) => steps,
        }
    }
}

/// A whole number as an integer.
// Whole by construction; beyond 2^63, far past any travel, `as` saturates.
#[inline]
pub fn whole(number: f64) -> i64 {
    number as i64
}

/// Encoders at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Number of the sample, k.
    pub tick: u64,
    /// Position of the motor shaft \[counts\]: `floor(K_enc·α)`, on rung `sampled`
    /// `K_enc·α` itself.
    pub position_counts: Steps,
    /// Position of an encoder at the load \[load counts\], where there is one.
    pub load_counts: Option<i64>,
}

impl Measurement {
    /// The encoders of `case` over an axis in `state`.
    pub fn new(case: &Case, tick: u64, state: &plant::State) -> Self {
        let alpha_rad = (state.beta_rad - case.start_rad()) / case.axis.transmission.gear_ratio;
        let load = case.options.encoders.load;
        Self {
            tick,
            position_counts: match case.controller.law {
                Law::Sampled => Steps::Real(case.encoder.position_counts(alpha_rad)),
                _ => Steps::Whole(whole(case.encoder.count(alpha_rad))),
            },
            load_counts: load.map(|encoder| whole(encoder.count(state.gamma_rad()))),
        }
    }
}

/// The controller's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Number of the sample that this answers.
    pub tick: u64,
    /// `e = r − c` \[counts\].
    pub error_counts: Steps,
    /// DAC code.
    pub dac_code: Steps,
    /// The firmware worked outside its declared ranges.
    pub out_of_range: bool,
    /// Execution time of the step; `None` where nobody measures.
    pub execution: Option<ExecutionTime>,
    /// Report of the axis; `None` where no supervision runs.
    pub axis: Option<AxisStatus>,
}

impl Command {
    /// Error and code, and nothing else to report.
    pub fn new(tick: u64, error_counts: Steps, dac_code: Steps) -> Self {
        Self {
            tick,
            error_counts,
            dac_code,
            out_of_range: false,
            execution: None,
            axis: None,
        }
    }

    /// The same in the firmware's integers.
    pub fn whole(tick: u64, error_counts: i32, dac_code: i32) -> Self {
        let [error_counts, dac_code] = [error_counts, dac_code].map(|n| Steps::Whole(n.into()));
        Self::new(tick, error_counts, dac_code)
    }
}

/// Report of the axis with every command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisStatus {
    /// State after the sample.
    pub state: State,
    /// The fault that is latched.
    pub fault: Option<Fault>,
    /// The first fault of the run, whether or not it was reset.
    pub first_fault: Option<Fault>,
    /// Faults so far.
    pub faults: u32,
    /// Largest `|e|` while the axis was powered \[counts\].
    pub peak_error_counts: u32,
    /// Requests that the state refused so far.
    pub refused_requests: u32,
}

/// A controller that gave no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The controller is gone.
    #[error("the controller stopped answering at sample {tick}")]
    Closed {
        /// Sample at which it was missed.
        tick: u64,
    },
    /// The controller answered another sample than the one asked.
    #[error("the controller answered sample {answered} when asked for sample {asked}")]
    WrongTick {
        /// Sample that was asked.
        asked: u64,
        /// Sample that was answered.
        answered: u64,
    },
    /// The chip does not take the controller, or tells nothing at the end; a
    /// sentence.
    #[error("{0}")]
    Refused(String),
    /// The controller on its chip gave no answer.
    #[error("at sample {tick}: {because}")]
    Chip {
        /// Sample that was asked.
        tick: u64,
        /// The reason, a sentence.
        because: String,
    },
}

/// A way to the controller.
pub trait Link {
    /// Sends a measurement and waits for the command.
    ///
    /// # Errors
    /// [`LinkError`] if no or another answer comes; the run cannot go on.
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError>;

    /// The controller's gains in fixed point; `None` where it computes in real
    /// numbers.
    fn gains(&self) -> Option<FixedPointGains> {
        None
    }

    /// True once the controller has done what it was started for: the run ends with
    /// the sample that it answered last.
    fn is_done(&self) -> bool {
        false
    }

    /// After the last sample: the cost of a chip's part of the run, whose steps
    /// took what `_execution` holds; `None` where no chip is at the end.
    ///
    /// # Errors
    /// [`LinkError`] if the chip does not answer any more.
    fn cost(
        &mut self,
        _execution: ExecutionFigures,
        _period_ns: u64,
    ) -> Result<Option<ChipReport>, LinkError> {
        Ok(None)
    }
}
