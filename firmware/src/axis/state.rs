//! What runs in an axis: its memory, and beside it the settings as the samples
//! read them. Every option is an operand that does nothing where it is off.

use super::Axis;
use crate::backlash_compensation::{Crossing, CrossingState};
use crate::counts::Counts;
use crate::dac::{Codes, Dac};
use crate::faults::{Fault, FaultCause, FaultLatch, FaultValues};
use crate::law::{Begin, Law, LawState, LawWords, Operands, term::Term};
use crate::output::{Output, Quantiser};
use crate::position::Counter;
use crate::reference::Stretch;
use crate::settings::{Settings, Unfit};
use crate::states::{Event, Refused, State};
use crate::wide;

/// An axis that runs: its settings and its memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct AxisState {
    // What every sample needs comes first, where the smallest processors reach
    // it with one instruction.
    /// True where the next sample is not a usual one: without power, or without
    /// a reading before.
    pub(super) rare: bool,
    pub(super) state: State,
    /// Memory that the next sample of the law begins with, where it does not go
    /// on from the one before.
    pub(super) begin: Option<Begin>,
    /// Errors below this count as 0 for `Kp` and `Ki` \[counts\]; 0 while it moves.
    pub(super) band: u32,
    /// `Ki·Δt`, 0 while the integral is held.
    pub(super) ki_dt: Term,
    /// Number of the tick that comes next.
    pub(super) expected: u64,
    pub(super) motor: Counter,
    /// The last setpoint, without the backlash compensation \[counts, modulo 2^32\].
    pub(super) setpoint: i32,
    /// `e` of the last sample \[counts\].
    pub(super) error: i32,
    /// Largest `|e|` \[counts\].
    pub(super) peak: u32,
    /// Samples in a row without a count under a driving code.
    pub(super) still: u32,
    /// Samples in a row with the output at a limit.
    pub(super) saturated: u32,
    pub(super) law: LawState,
    /// The command, at the last sample.
    pub(super) motion: Stretch,
    /// Samples of its stretch that are to come.
    pub(super) left: u32,
    pub(super) crossing: CrossingState,
    pub(super) operands: AxisOperands,
    // What rare samples need.
    pub(super) load: Counter,
    /// True from the first tick on.
    pub(super) ticked: bool,
    /// True if the axis was enabled since the last sample.
    pub(super) position_to_hold: bool,
    pub(super) latch: FaultLatch,
}

/// Settings as the samples read them: their words, and what is made of them once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub(super) struct AxisOperands {
    pub(super) law: Operands,
    pub(super) output: Output,
    pub(super) crossing: Crossing,
    pub(super) settings: Settings,
}

impl AxisOperands {
    /// Settings whose law has been accepted.
    const fn new(settings: &Settings, law: Operands) -> Self {
        Self {
            law,
            output: Output::of(settings),
            crossing: Crossing::of(settings),
            settings: *settings,
        }
    }

    const fn of(axis: &Axis) -> Self {
        Self::new(&Settings::of(axis), axis.law.operands)
    }

    /// Settings that came from elsewhere.
    fn checked(settings: &Settings) -> Result<Self, Unfit> {
        settings.operands().map(|law| Self::new(settings, law))
    }
}

/// The whole of an axis is small enough for the smallest chips, on which each of
/// its terms has two forms.
const _: () = assert!(size_of::<AxisState>() <= 832, "an axis: 832 bytes");

impl AxisState {
    /// An axis that has no settings yet.
    #[allow(clippy::empty_loop, reason = "a constant does not wait")]
    pub const START: Self = {
        let dac = Dac::of_bits(16);
        let Ok(law) = Law::accept(LawWords::NONE, dac) else {
            loop {}
        };
        let output = Output::unlimited(dac, Quantiser::Nearest);
        Self::with(AxisOperands::of(&Axis::new(law, output)))
    };

    /// Before the first sample: disabled, code 0.
    pub fn start(axis: &Axis) -> Self {
        Self::with(AxisOperands::of(axis))
    }

    /// The same with settings that came from elsewhere.
    ///
    /// # Errors
    /// The first word that is not accepted ([`Settings::check`]).
    pub fn start_with(settings: &Settings) -> Result<Self, Unfit> {
        AxisOperands::checked(settings).map(Self::with)
    }

    /// Takes checked settings and starts anew, as [`AxisState::start_with`], where
    /// the axis stands in memory.
    ///
    /// # Errors
    /// The first word that is not accepted; nothing has changed then.
    #[inline(never)]
    pub fn start_in_place(&mut self, settings: &Settings) -> Result<(), Unfit> {
        *self = Self::with(AxisOperands::checked(settings)?);
        Ok(())
    }

    const fn with(operands: AxisOperands) -> Self {
        Self {
            rare: true,
            state: State::Disabled,
            begin: Some(Begin::AtRest),
            band: 0,
            ki_dt: operands.law.ki_dt,
            expected: 0,
            motor: Counter::START,
            setpoint: 0,
            error: 0,
            peak: 0,
            still: 0,
            saturated: 0,
            law: LawState::start(&operands.output),
            motion: Stretch {
                position: Counts::ZERO,
                samples: 0,
                ..Stretch::resting_at(0)
            },
            left: 0,
            crossing: CrossingState::START,
            operands,
            load: Counter::START,
            ticked: false,
            position_to_hold: false,
            latch: FaultLatch::EMPTY,
        }
    }

    /// Asks for another state; it acts from the next sample on.
    ///
    /// # Errors
    /// [`Refused`] if the state does not allow it, and for the two events that
    /// the axis finds out itself; nothing has changed then.
    pub fn request(&mut self, event: Event) -> Result<State, Refused> {
        let next = self.state.after(event)?;
        match event {
            Event::Enable => {
                self.position_to_hold = true;
                // Samples in a row: those before the power went off do not count.
                self.still = 0;
                self.saturated = 0;
            }
            Event::Reset => {
                self.latch.clear();
                // A counter that never came back starts anew; the axis has
                // to be homed.
                self.motor.reset();
                self.load.reset();
            }
            Event::Disable | Event::Start => {}
            // A fault without its record, a motion that ends where its source
            // does not: neither is for others to say.
            Event::MotionEnded | Event::Fail => {
                return Err(Refused {
                    state: self.state,
                    event,
                });
            }
        }
        self.enter(next);
        Ok(next)
    }

    /// Takes a state: the command of the one before has ended.
    pub(super) fn enter(&mut self, state: State) {
        self.state = state;
        self.left = 0;
        self.stand_or_move();
        self.rare = !(state.is_powered() && self.motor.known) || self.operands.output.dithers();
    }

    /// Takes other settings from the next sample on: the output goes on from
    /// where it stands, whatever the gains are.
    pub fn change(&mut self, axis: &Axis) {
        self.operands = AxisOperands::of(axis);
        self.gains_changed();
    }

    /// The same with settings that came from elsewhere.
    ///
    /// # Errors
    /// The first word that is not accepted; nothing has changed then.
    #[inline(never)]
    pub fn change_to(&mut self, settings: &Settings) -> Result<(), Unfit> {
        self.operands = AxisOperands::checked(settings)?;
        self.gains_changed();
        Ok(())
    }

    fn gains_changed(&mut self) {
        self.stand_or_move();
        self.law.begin_rounding(self.operands.output.dac());
        self.rare |= self.operands.output.dithers();
        self.begin = Some(match self.begin {
            Some(Begin::AtRest | Begin::FromCode) => Begin::FromCode,
            Some(Begin::OtherGains) | None => Begin::OtherGains,
        });
    }

    /// Registers of the last good readings of the encoders, for a sample whose
    /// reading failed.
    pub fn last_registers(&self) -> (u32, Option<u32>) {
        let load = self.load.position().map(i32::cast_unsigned);
        (self.motor.position.cast_unsigned(), load)
    }

    /// The state.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Position of the motor \[counts, modulo 2^32\]; `None` before the first
    /// sample, and after the reset of a glitch that never came back: the axis
    /// has lost its reference then and must be homed.
    pub fn position(&self) -> Option<i32> {
        self.motor.position()
    }

    /// The fault that is latched.
    pub const fn fault(&self) -> Option<&Fault> {
        self.latch.get()
    }

    /// Largest `|e|` under power since the start or the last reset of the peak
    /// \[counts\].
    pub const fn peak_error_counts(&self) -> u32 {
        self.peak
    }

    /// Starts the peak of `|e|` anew.
    pub const fn reset_peak_error(&mut self) {
        self.peak = 0;
    }

    /// Tells whether a feed-forward that its source has computed is within its
    /// declared range.
    pub const fn takes_ahead(&self, ahead: Codes) -> bool {
        let whole = wide::upper(ahead.to_bits()).unsigned_abs();
        whole <= self.operands.settings.ahead_limit_codes
    }

    /// Memory of the law.
    pub const fn law(&self) -> &LawState {
        &self.law
    }

    /// Keeps the first fault and ends in its state, with the safe output.
    pub(super) fn fail(&mut self, tick: u64, values: FaultValues, cause: FaultCause) -> i32 {
        self.latch.trip(Fault {
            cause,
            tick,
            values,
        });
        // Any state ends in the fault; the table has no refusal for it.
        self.enter(State::Fault);
        self.law.safe()
    }
}
