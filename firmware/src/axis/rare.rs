//! What is rare in a sample: no power, first readings, faults with their
//! causes and records, and where the next part of the command comes from.

use super::state::TAKE_OVER;
use super::{AxisOutput, AxisState, Inputs};
use crate::counts::Counts;
use crate::dac::Codes;
use crate::faults::{FaultCause, FaultValues};
use crate::law::{Begin, Sum, TAKES_OVER};
use crate::monitor::SPEED_BITS;
use crate::reference::{InPlace, Observed, Setpoint, SetpointSource, nearest};
use crate::states::State;
use crate::wide;

/// An encoder of the axis.
enum Encoder {
    Motor,
    Load,
}

/// From the unit of a velocity to that of a speed.
const SPEED_SHIFT: u32 = 32 - SPEED_BITS;

impl AxisState {
    /// Brings an unusual sample to where it is a usual one, or one that ends where its
    /// error is known; false for one without power, which ends here.
    #[cold]
    #[inline(never)]
    pub(super) fn prepare(&mut self, inputs: &Inputs) -> bool {
        self.take_reports(inputs);
        self.expected = inputs.tick.wrapping_add(1);
        self.ticked = true;
        if !self.state.is_powered() {
            self.without_power(inputs);
            return false;
        }
        // The first readings define the positions.
        if !self.motor.known {
            self.read(Encoder::Motor, inputs.motor_register);
        }
        if !self.tripped {
            self.law.dither(&self.output);
        }
        self.usual = !self.output.dithers();
        true
    }

    /// A check has tripped: the most urgent of a sample is kept, and nothing where
    /// a fault is latched. The sample goes on to its error, for the record, and ends there.
    #[inline(never)]
    fn found(&mut self, cause: FaultCause, measured: u32, limit: u32) {
        self.found_signed(cause, measured.into(), limit);
    }

    /// The same with a value that has a sign.
    #[inline(never)]
    fn found_signed(&mut self, cause: FaultCause, measured: i64, limit: u32) {
        let more_urgent = !self.tripped || cause < self.fault.cause;
        if self.state != State::Fault && more_urgent {
            self.tripped = true;
            self.usual_sizes = 0;
            self.fault.cause = cause;
            self.fault.values.measured = measured;
            self.fault.values.limit = limit.into();
        }
    }

    /// What the hardware itself reports.
    fn take_reports(&mut self, inputs: &Inputs) {
        if inputs.emergency_stop {
            self.found(FaultCause::EmergencyStop, 0, 0);
        }
        if inputs.failed_transfers != 0 {
            self.found(FaultCause::HardwareBus, inputs.failed_transfers, 0);
        }
        // Counted modulo 2^64, so that no end has to be looked at.
        let missed = inputs.tick.wrapping_sub(self.expected).cast_signed();
        if self.settings.watches_ticks() != 0 && self.ticked && missed != 0 {
            self.found_signed(FaultCause::MissedTick, missed, 0);
        }
    }

    /// A sample without power: the position is followed, and a drive that is
    /// switched off in order runs down.
    fn without_power(&mut self, inputs: &Inputs) {
        let mut moved = self.read(Encoder::Motor, inputs.motor_register);
        if self.settings.feedback_of_load() != 0 && self.read_load(inputs.load_register) == 0 {
            moved = 0;
        }
        // A drive that runs down is still one that drives.
        let code = self.law.code();
        if code != 0 {
            if moved == 0 && code.unsigned_abs() >= self.settings.encoder_loss_codes() {
                self.stands_driven();
            } else {
                self.still = 0;
            }
        }
        self.error = 0;
        if self.tripped {
            self.fail();
        } else if self.state == State::Fault {
            self.law.safe();
        } else {
            self.law.towards_zero(&self.output);
        }
    }

    /// The load's counter; by how much it has moved \[counts\].
    #[cold]
    #[inline(never)]
    pub(super) fn read_load(&mut self, register: Option<u32>) -> i32 {
        let Some(register) = register else {
            self.found(FaultCause::HardwareBus, 1, 0);
            return 1;
        };
        self.read(Encoder::Load, register)
    }

    /// An encoder's counter; by how much it has moved, any other than 0 where the reading
    /// was disturbed, which trips \[counts\].
    #[inline(never)]
    fn read(&mut self, encoder: Encoder, register: u32) -> i32 {
        let settings = &self.settings;
        let (counter, bits, jump) = match encoder {
            Encoder::Motor => (
                &mut self.motor,
                settings.counter_bits(),
                settings.largest_jump_counts(),
            ),
            Encoder::Load => (
                &mut self.load,
                settings.load_counter_bits(),
                settings.load_largest_jump_counts(),
            ),
        };
        let moved = counter.follow(register, bits, jump);
        if counter.missed != 0 {
            let limit = counter.allowed(bits, jump);
            self.found_signed(FaultCause::EncoderGlitch, moved.into(), limit);
        }
        moved
    }

    /// The motor's count has changed by more than its limit, which trips, or than the law
    /// takes: the movement to follow, and what the law takes of it \[counts\].
    #[cold]
    #[inline(never)]
    pub(super) fn jumped(&mut self, register: u32) -> (i32, i32) {
        let before = self.motor.position;
        let moved = self.read(Encoder::Motor, register);
        if self.motor.missed != 0 {
            return (0, 0);
        }
        // The sample follows it.
        self.motor.position = before;
        // Of a sample that has tripped the law takes nothing.
        let taken = match self.tripped {
            true => 0,
            false => {
                let left_range = &mut self.law.left_range;
                self.settings.held_movement::<false>(moved, left_range)
            }
        };
        (moved, taken)
    }

    /// The encoder does not move under a driving code.
    #[cold]
    #[inline(never)]
    pub(super) fn stands_driven(&mut self) {
        self.still = self.still.saturating_add(1);
        let limit = self.settings.encoder_loss_samples();
        if self.still >= limit {
            self.found(FaultCause::EncoderLoss, self.still, limit);
        }
    }

    /// An error beyond what a usual sample has, or any where a check has tripped: begins
    /// anew, or is held within its range. `None` ends the sample with the power off.
    #[cold]
    #[inline(never)]
    pub(super) fn far(&mut self, moved: i32) -> Option<i32> {
        self.watch_following_error();
        if self.tripped {
            self.fail();
            return None;
        }
        let left_range = &mut self.law.left_range;
        let e = self.settings.held_error::<false>(self.error, left_range);
        let begin = core::mem::take(&mut self.begin);
        if begin != Begin::GoingOn {
            let sizes = self.settings.near().wrapping_add(1);
            self.usual_sizes = sizes.wrapping_sub(self.band);
            if self.settings.begin(&mut self.law, e, moved, begin) {
                self.slew = TAKE_OVER;
            }
        }
        Some(e)
    }

    /// An error beyond the limit at rest: whether it is beyond that at this speed.
    ///
    /// ```text
    /// |e| > a + floor(s·|v|)                                          [counts]
    /// ```
    ///
    /// with `v` in 2^−16 counts per sample.
    fn watch_following_error(&mut self) {
        let settings = &self.settings;
        let (size, at_rest) = (self.error.unsigned_abs(), settings.following_error_counts());
        if size <= at_rest {
            return;
        }
        let speed = self.motion.velocity.to_bits().unsigned_abs();
        let speed = wide::narrowed(speed.wrapping_shr(SPEED_SHIFT)).unwrap_or(u32::MAX);
        let bits = settings.lag_fraction_bits().wrapping_add(SPEED_BITS);
        let lag = wide::product(settings.lag_mantissa(), speed).wrapping_shr(bits);
        let limit = at_rest.saturating_add(wide::narrowed(lag).unwrap_or(u32::MAX));
        if size > limit {
            self.found(FaultCause::FollowingError, size, limit);
        }
    }

    /// A sum that the output cannot give, is not to, or only at an end of its range: the
    /// code.
    #[cfg_attr(target_pointer_width = "32", cold, inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    pub(super) fn limited(&mut self, sum: Sum) -> i32 {
        let (settings, output, law) = (&self.settings, &self.output, &mut self.law);
        let (wanted, treatment) = match self.slew {
            TAKE_OVER => (law.code(), TAKES_OVER),
            _ => (sum.code(), settings.anti_windup()),
        };
        self.slew = output.slew();
        let code = output.reachable(law.code(), wanted);
        let code = if code == sum.code() && treatment != TAKES_OVER {
            sum.take(output, law)
        } else {
            settings.limit(law, sum, code, treatment)
        };
        if !self.output.dac().is_limit(code) {
            self.saturated = 0;
            return code;
        }
        self.saturated = self.saturated.saturating_add(1);
        let limit = self.settings.saturation_samples();
        if self.saturated > limit {
            self.found(FaultCause::SaturationTooLong, self.saturated, limit);
            return self.fail();
        }
        code
    }

    /// Power off: keeps the first fault and ends in its state, with the safe output.
    fn fail(&mut self) -> i32 {
        self.tripped = false;
        if self.state != State::Fault {
            let (error, position) = (self.error, self.place());
            self.fault.tick = self.expected.wrapping_sub(1);
            self.fault.values = FaultValues {
                setpoint: position.wrapping_add(error),
                position,
                error,
                code: self.law.code(),
                ..self.fault.values
            };
        }
        // Any state ends in the fault; the table has no refusal for it.
        self.enter(State::Fault);
        self.law.safe()
    }

    /// The sample of `tick` has computed its output, but the hardware did not
    /// take it: the axis stops in the same sample.
    pub fn output_failed(&mut self, tick: u64, failed_transfers: u32) -> AxisOutput {
        self.expected = tick.wrapping_add(1);
        self.found(FaultCause::HardwareBus, failed_transfers, 0);
        let code = self.fail();
        AxisOutput {
            code,
            power: false,
            state: self.state,
            error_counts: self.error,
            out_of_range: false,
        }
    }

    /// The position that the setpoints are for \[counts, modulo 2^32\].
    #[inline(never)]
    fn place(&self) -> i32 {
        if self.settings.feedback_of_load() != 0 {
            self.load.position
        } else {
            self.motor.position
        }
    }

    /// The next part of the command; where there is none, that trips.
    #[inline(never)]
    pub(super) fn next_stretch(
        &mut self,
        load_register: Option<u32>,
        source: &mut impl SetpointSource,
    ) {
        if self.position_to_hold {
            // Enabled since the last sample: holds where the axis stands.
            self.position_to_hold = false;
            self.motion.position = nearest(self.place());
        }
        if self.state != State::Moving {
            return self.rest();
        }
        let observed = Observed {
            position: self.motor.position,
            load_position: if self.settings.feedback_of_load() != 0 {
                self.load.position()
            } else {
                load_register.map(u32::cast_signed)
            },
            code: self.law.code(),
        };
        let before = self.motion.signs();
        match source.next_in_place(&observed, &mut self.motion) {
            InPlace::Stretch => self.left = self.motion.samples.saturating_sub(1),
            InPlace::Setpoint(setpoint) => self.go_to(&setpoint),
            InPlace::Last(setpoint) => {
                self.state = State::Holding;
                self.go_to(&setpoint);
            }
            InPlace::Underrun => return self.found(FaultCause::SetpointUnderrun, 0, 1),
        }
        self.settings.hold_ahead(&mut self.motion.ahead);
        if self.motion.signs() != before {
            let flank = self.settings.flank_of(&self.motion);
            if flank != 0 && self.crossing.asks_for(flank) {
                self.crossing.begin(&self.settings);
            }
        }
        self.stand_where_it_rests();
    }

    /// Stays at the last setpoint.
    #[cold]
    #[inline(never)]
    fn rest(&mut self) {
        self.motion.rest_at(self.motion.setpoint());
        self.left = u32::MAX;
        self.stand_or_move();
    }

    /// A setpoint of its own: what leads from one sample to the next is not asked for.
    #[inline(never)]
    fn go_to(&mut self, setpoint: &Setpoint) {
        let (settings, motion) = (&self.settings, &mut self.motion);
        let (v, a) = (setpoint.velocity, setpoint.acceleration);
        // Of a source that knows positions only.
        let way = match v {
            0 => setpoint.position.wrapping_sub(motion.setpoint()),
            v => v,
        };
        motion.position = nearest(setpoint.position);
        // Its size is all that is asked for.
        motion.velocity = match v {
            v if v != 0 && settings.lag_mantissa() != 0 => {
                counts_per_sample(v, settings.velocity_fraction_bits())
            }
            _ => Counts::ZERO,
        };
        motion.ahead = match setpoint.ahead {
            Some(ahead) => ahead,
            None if settings.feeds_forward() => settings.feed_forward::<false>(v, a),
            None => Codes::ZERO,
        };
        (motion.velocity_sign, motion.acceleration_sign) = (sign(way), sign(a));
    }

    /// The operands that follow from whether the axis is to stand.
    #[inline(never)]
    pub(super) fn stand_or_move(&mut self) {
        let stands = self.state != State::Moving && !self.crossing.is_under_way();
        let settings = &self.settings;
        // At most 2^29.
        let near = settings.near();
        self.band = match stands {
            true => settings.dead_band_counts().min(near).wrapping_add(1),
            false => 0,
        };
        self.usual_sizes = match self.begin {
            Begin::GoingOn if !self.tripped => near.wrapping_add(1).wrapping_sub(self.band),
            _ => 0,
        };
        self.ki_dt_mantissa = match stands && settings.hold_integral() != 0 {
            true => 0,
            false => settings.ki_dt_mantissa().cast_signed(),
        };
    }

    /// A move across the gap has come to its middle, or to its end.
    #[cold]
    #[inline(never)]
    pub(super) fn crossed(&mut self) {
        self.crossing.turn(&self.settings);
        self.stand_where_it_rests();
    }

    /// While the axis moves, a crossing changes none of its operands.
    fn stand_where_it_rests(&mut self) {
        if self.state != State::Moving {
            self.stand_or_move();
        }
    }
}

/// The size of a velocity with so many fraction bits, in counts per sample.
fn counts_per_sample(velocity: i32, fraction_bits: u32) -> Counts {
    let size = wide::word(velocity.unsigned_abs()).wrapping_shl(32);
    Counts::from_bits(size.wrapping_shr(fraction_bits).cast_signed())
}

/// −1, 0 or 1.
fn sign(value: i32) -> i8 {
    match value {
        0 => 0,
        1.. => 1,
        _ => -1,
    }
}
