//! What runs in an axis: its memory, and beside it the settings as the samples
//! read them. Every option is an operand that does nothing where it is off.

use super::Axis;
use crate::backlash_compensation::CrossingState;
use crate::dac::Codes;
use crate::faults::Fault;
use crate::law::{Begin, LawState};
use crate::output::Output;
use crate::position::Counter;
use crate::reference::Stretch;
use crate::settings::{MOST, Settings, Unfit, Words};
use crate::states::{Event, Refused, State};
use crate::wide;

/// An axis that runs: its settings and its memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct AxisState {
    // What every sample needs comes first, where the smallest processors reach
    // it with one instruction.
    /// False where the next sample is not a usual one: without power, without a
    /// reading before, or with a random rounding.
    pub(super) usual: bool,
    pub(super) state: State,
    /// Memory that the next sample of the law begins with.
    pub(super) begin: Begin,
    /// True if the axis was enabled since the last sample.
    pub(super) position_to_hold: bool,
    // Asked for in rare samples, at hand for them too.
    /// True from the first tick on.
    pub(super) ticked: bool,
    /// True if a check has tripped in this sample.
    pub(super) tripped: bool,
    /// Sizes of `e` from [`Self::band`] on that are usual ones \[counts\].
    pub(super) usual_sizes: u32,
    /// Changes of the motor's count beyond this one are looked at \[counts\].
    pub(super) jump: u32,
    /// Usual errors below this count as 0 for `Kp` and `Ki` \[counts\]; 0 while it moves.
    pub(super) band: u32,
    /// Of `Ki·Δt`, 0 while the integral is held.
    pub(super) ki_dt_mantissa: i32,
    /// Largest step of the code, or [`TAKE_OVER`].
    pub(super) slew: u32,
    /// `e` of the last sample \[counts\].
    pub(super) error: i32,
    /// Largest `|e|` \[counts\].
    pub(super) peak: u32,
    /// Samples in a row without a count under a driving code.
    pub(super) still: u32,
    /// Samples in a row with the output at a limit.
    pub(super) saturated: u32,
    /// Samples of the command's stretch that are to come.
    pub(super) left: u32,
    pub(super) motor: Counter,
    /// Number of the tick that comes next.
    pub(super) expected: u64,
    pub(super) law: LawState,
    /// The command, at the last sample: its position is the last setpoint, without the
    /// backlash compensation.
    pub(super) motion: Stretch,
    pub(super) crossing: CrossingState,
    pub(super) output: Output,
    pub(super) settings: Words,
    // What rare samples need.
    pub(super) load: Counter,
    /// The fault that is latched, or of this sample's trip.
    pub(super) fault: Fault,
}

/// The whole of an axis is small enough for the smallest chips.
const _: () = assert!(size_of::<AxisState>() == 488, "an axis: 488 bytes");

impl Words {
    /// The largest error that is a usual one \[counts\].
    pub(super) fn near(&self) -> u32 {
        self.error_limit_counts().min(self.following_error_counts())
    }
}

/// In the place of a slew limit: no code can be reached, so that the output goes
/// on from the one in force. Twice it is 0 in 32 bits.
pub(super) const TAKE_OVER: u32 = 1 << 31;

impl AxisState {
    /// An axis that has not been started, all zeros: it stays disabled.
    pub const START: Self = Self {
        usual: false,
        state: State::Disabled,
        begin: Begin::GoingOn,
        position_to_hold: false,
        ticked: false,
        tripped: false,
        usual_sizes: 0,
        jump: 0,
        band: 0,
        ki_dt_mantissa: 0,
        slew: 0,
        error: 0,
        peak: 0,
        still: 0,
        saturated: 0,
        left: 0,
        motor: Counter::UNKNOWN,
        expected: 0,
        law: LawState::ZERO,
        motion: Stretch::ZERO,
        crossing: CrossingState::CENTRED,
        output: Output::ZERO,
        settings: Words::ZERO,
        load: Counter::UNKNOWN,
        fault: Fault::ZERO,
    };

    /// Before the first sample: disabled, code 0.
    pub fn start(axis: &Axis) -> Self {
        let mut state = Self::START;
        state.restart(&Words::of(&Settings::of(axis)));
        state
    }

    /// The same with settings that came from elsewhere.
    ///
    /// # Errors
    /// The first word that is not accepted ([`Settings::check`]).
    pub fn start_with(settings: &Settings) -> Result<Self, Unfit> {
        let mut state = Self::START;
        state.start_in_place(&Words::of(settings))?;
        Ok(state)
    }

    /// The same with words, in memory that is there already.
    ///
    /// # Errors
    /// The first word that is not accepted; nothing has changed then.
    pub fn start_in_place(&mut self, words: &Words) -> Result<(), Unfit> {
        words.check()?;
        self.restart(words);
        Ok(())
    }

    fn restart(&mut self, settings: &Words) {
        *self = Self::START;
        self.set(settings);
        self.begins(Begin::AtRest);
        self.law.start_in_place(&self.output);
    }

    fn set(&mut self, settings: &Words) {
        self.settings = *settings;
        self.output = Output::of(settings);
        self.slew = self.output.slew();
        self.motion.forget_signs();
        let takes = match settings.derivative_of_measurement() {
            0 => MOST,
            _ => settings.difference_limit_counts(),
        };
        self.jump = settings.largest_jump_counts().min(takes);
        self.stand_or_move();
    }

    /// Asks for another state; it acts from the next sample on.
    ///
    /// # Errors
    /// [`Refused`] if the state does not allow it, and for the two events that
    /// the axis finds out itself; nothing has changed then.
    #[inline(never)]
    pub fn request(&mut self, event: Event) -> Result<State, Refused> {
        let next = self.state.after(event)?;
        match event {
            Event::Enable => {
                self.position_to_hold = true;
                self.begins(Begin::FromCode);
                self.crossing = CrossingState::CENTRED;
                self.motion.forget_signs();
                // Samples in a row: those before the power went off do not count.
                self.still = 0;
                self.saturated = 0;
            }
            Event::Reset => {
                // A counter that never came back starts anew; the axis has
                // to be homed.
                self.motor.reset();
                self.load.reset();
            }
            // In the same breath as it was enabled, from rest.
            Event::Start if self.position_to_hold && self.law.code() == 0 => {
                self.begins(Begin::AtRest);
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

    /// Begins the law's next sample so.
    fn begins(&mut self, begin: Begin) {
        self.begin = begin;
        self.usual_sizes = 0;
    }

    /// Takes a state: the command of the one before has ended.
    pub(super) fn enter(&mut self, state: State) {
        self.state = state;
        self.left = 0;
        self.stand_or_move();
        self.set_usual();
    }

    /// Whether the next sample is a usual one, as far as is known before it.
    pub(super) fn set_usual(&mut self) {
        self.usual = self.state.is_powered() && self.motor.known && !self.output.dithers();
    }

    /// Takes other settings from the next sample on: the output goes on from
    /// where it stands, whatever the gains are.
    pub fn change(&mut self, axis: &Axis) {
        self.take_on(&Words::of(&Settings::of(axis)));
    }

    /// The same with settings that came from elsewhere.
    ///
    /// # Errors
    /// The first word that is not accepted; nothing has changed then.
    pub fn change_to(&mut self, settings: &Settings) -> Result<(), Unfit> {
        self.change_in_place(&Words::of(settings))
    }

    /// The same with words.
    ///
    /// # Errors
    /// The first word that is not accepted; nothing has changed then.
    pub fn change_in_place(&mut self, words: &Words) -> Result<(), Unfit> {
        words.check()?;
        self.take_on(words);
        Ok(())
    }

    fn take_on(&mut self, settings: &Words) {
        self.set(settings);
        self.begins(match self.begin {
            // It begins anew where it is enabled.
            begin if self.position_to_hold => begin,
            Begin::AtRest | Begin::FromCode => Begin::FromCode,
            Begin::OtherGains | Begin::GoingOn => Begin::OtherGains,
        });
        self.law.begin_rounding(&self.output);
        self.set_usual();
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
        match self.state {
            State::Fault => Some(&self.fault),
            _ => None,
        }
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
        whole <= self.settings.ahead_limit_codes()
    }

    /// Memory of the law.
    pub const fn law(&self) -> &LawState {
        &self.law
    }
}
