//! What is rare in a sample: no power, first readings, faults with their
//! causes and records, and where the next part of the command comes from.

use super::{AxisOutput, AxisState, Inputs};
use crate::backlash_compensation::{Crossing, CrossingState};
use crate::counts::{self, Counts};
use crate::dac::Codes;
use crate::faults::{FaultCause, FaultValues, Trip, most_urgent};
use crate::law::{Begin, term::Term};
use crate::monitor::SPEED_BITS;
use crate::reference::{Next, Observed, Setpoint, SetpointSource, Stretch, nearest};
use crate::states::State;
use crate::wide;

/// How far a sample has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub(super) enum Done {
    Nothing,
    Positions,
    Reference,
}

/// From the unit of a velocity to that of a speed.
const SPEED_SHIFT: u32 = 32 - SPEED_BITS;

/// The register of the load's encoder did not come.
const LOAD_NOT_READ: Trip = Trip::new(FaultCause::HardwareBus, 1, 0);

impl AxisState {
    /// Brings an unusual sample to where it is a usual one; the code of one that
    /// ends without the law.
    #[cold]
    #[inline(never)]
    pub(super) fn prepare(
        &mut self,
        inputs: &Inputs,
        source: &mut impl SetpointSource,
    ) -> Option<i32> {
        let reported = self.reported(inputs);
        self.expected = inputs.tick.wrapping_add(1);
        self.ticked = true;
        if !self.state.is_powered() {
            return Some(self.without_power(inputs, reported));
        }
        if let Some(trip) = reported {
            return Some(self.trip(inputs, source, trip, Done::Nothing));
        }
        // The first readings define the positions.
        if !self.motor.known {
            let _ = self.read_motor(inputs);
        }
        self.law.dither(&self.operands.output);
        self.rare = self.operands.output.dithers();
        None
    }

    /// Trips that the hardware itself reports.
    fn reported(&self, inputs: &Inputs) -> Option<Trip> {
        if inputs.emergency_stop {
            return Some(Trip::EMERGENCY_STOP);
        }
        if inputs.failed_transfers != 0 {
            let failed = i64::from(inputs.failed_transfers);
            return Some(Trip::new(FaultCause::HardwareBus, failed, 0));
        }
        if self.operands.settings.feedback_of_load != 0 && inputs.load_register.is_none() {
            return Some(LOAD_NOT_READ);
        }
        // Counted modulo 2^64, so that no end has to be looked at.
        let missed = inputs.tick.wrapping_sub(self.expected).cast_signed();
        let watched = self.operands.settings.watches_ticks != 0 && self.ticked;
        (watched && missed != 0).then_some(Trip::new(FaultCause::MissedTick, missed, 0))
    }

    /// A sample without power: the position is followed, and a drive that is
    /// switched off in order runs down.
    fn without_power(&mut self, inputs: &Inputs, reported: Option<Trip>) -> i32 {
        let (moved, glitch) = self.read(inputs);
        let mut trip = most_urgent(reported, glitch);
        let code = self.law.code();
        // A drive that runs down is still one that drives.
        if moved == 0
            && code != 0
            && code.unsigned_abs() >= self.operands.settings.encoder_loss_codes
        {
            trip = most_urgent(trip, self.stood_still());
        } else if code != 0 {
            self.still = 0;
        }
        self.setpoint = self.place();
        self.error = 0;
        if let Some(trip) = trip {
            return self.fail(inputs.tick, self.values(trip), trip.cause);
        }
        match self.state {
            State::Fault => self.law.safe(),
            _ => self.law.towards_zero(&self.operands.output),
        }
    }

    /// Both counters, with what follows a disturbed reading; the movement, 0 where
    /// one of two stands still.
    fn read(&mut self, inputs: &Inputs) -> (i32, Option<Trip>) {
        let motor = self.read_motor(inputs);
        let load = if self.operands.settings.feedback_of_load != 0 {
            self.read_load(inputs)
        } else {
            motor
        };
        let moved = if load == Ok(0) { 0 } else { motor.unwrap_or(0) };
        (moved, most_urgent(motor.err(), load.err()))
    }

    fn read_motor(&mut self, inputs: &Inputs) -> Result<i32, Trip> {
        let settings = &self.operands.settings;
        let (shift, jump) = (bits(settings.counter_bits), settings.largest_jump_counts);
        self.motor.follow(inputs.motor_register, shift, jump)
    }

    /// The load's counter; by how much it has moved \[counts\].
    #[cold]
    #[inline(never)]
    pub(super) fn read_load(&mut self, inputs: &Inputs) -> Result<i32, Trip> {
        let register = inputs.load_register.ok_or(LOAD_NOT_READ)?;
        let settings = &self.operands.settings;
        let (shift, jump) = (
            bits(settings.load_counter_bits),
            settings.load_largest_jump_counts,
        );
        self.load.follow(register, shift, jump)
    }

    /// The motor's count has changed by more than it can.
    #[cold]
    #[inline(never)]
    pub(super) fn jumped(&mut self, inputs: &Inputs, source: &mut impl SetpointSource) -> i32 {
        let (_, glitch) = self.read(inputs);
        match glitch {
            Some(trip) => self.trip(inputs, source, trip, Done::Positions),
            // It has, by the caller.
            None => self.law.code(),
        }
    }

    /// One more sample without a count under a driving code.
    #[inline]
    pub(super) fn stood_still(&mut self) -> Option<Trip> {
        self.still = self.still.saturating_add(1);
        let [samples, limit] = [self.still, self.operands.settings.encoder_loss_samples];
        let [measured, allowed] = [samples, limit].map(i64::from);
        (samples >= limit).then_some(Trip::new(FaultCause::EncoderLoss, measured, allowed))
    }

    /// An error beyond the limit at rest: whether it is beyond that at this speed.
    ///
    /// ```text
    /// |e| > a + floor(s·|v|)                                          [counts]
    /// ```
    ///
    /// with `v` in 2^−16 counts per sample.
    #[cold]
    #[inline(never)]
    pub(super) fn too_far(&self, size: u32) -> Option<Trip> {
        let speed = self.motion.velocity.to_bits().unsigned_abs();
        let speed = u32::try_from(speed.wrapping_shr(SPEED_SHIFT)).unwrap_or(u32::MAX);
        let bits = self
            .operands
            .settings
            .lag_fraction_bits
            .wrapping_add(SPEED_BITS);
        let lag = wide::product(self.operands.settings.lag_mantissa, speed).wrapping_shr(bits);
        let limit = u64::from(self.operands.settings.following_error_counts).saturating_add(lag);
        let [measured, limit] = [u64::from(size), limit].map(wide::held);
        (measured > limit).then_some(Trip::new(FaultCause::FollowingError, measured, limit))
    }

    /// Power off: completes what the sample has not done yet, for the record, and
    /// keeps the first of the faults.
    #[cold]
    #[inline(never)]
    pub(super) fn trip(
        &mut self,
        inputs: &Inputs,
        source: &mut impl SetpointSource,
        trip: Trip,
        done: Done,
    ) -> i32 {
        if done < Done::Positions {
            let _ = self.read(inputs);
        }
        if done < Done::Reference {
            let goes_on = self.left != 0;
            if goes_on {
                self.motion.advance();
            }
            if goes_on || self.next_stretch(inputs, source) {
                self.setpoint = self.motion.setpoint();
            }
            if self.crossing.left != 0 {
                Crossing::advance(&mut self.crossing);
            }
        }
        let values = self.values(trip);
        self.error = values.error;
        self.peak = self.peak.max(self.error.unsigned_abs());
        self.fail(inputs.tick, values, trip.cause)
    }

    /// The sample of `tick` has computed its output, but the hardware did not
    /// take it: the axis stops in the same sample.
    pub fn output_failed(&mut self, tick: u64, failed_transfers: u32) -> AxisOutput {
        let trip = Trip::new(FaultCause::HardwareBus, failed_transfers.into(), 0);
        let code = self.fail(tick, self.values(trip), trip.cause);
        AxisOutput {
            code,
            power: false,
            state: self.state,
            error_counts: self.error,
            out_of_range: false,
        }
    }

    /// Record of a sample.
    fn values(&self, trip: Trip) -> FaultValues {
        let offset = if self.state.is_powered() {
            self.crossing.offset
        } else {
            0
        };
        let (setpoint, position) = (self.setpoint.wrapping_add(offset), self.place());
        FaultValues {
            setpoint,
            position,
            error: counts::difference(setpoint, position),
            code: self.law.code(),
            measured: trip.measured,
            limit: trip.limit,
        }
    }

    /// The position that the setpoints are for \[counts, modulo 2^32\].
    fn place(&self) -> i32 {
        if self.operands.settings.feedback_of_load != 0 {
            self.load.position
        } else {
            self.motor.position
        }
    }

    /// The next part of the command; false where there is none.
    #[inline(never)]
    pub(super) fn next_stretch(
        &mut self,
        inputs: &Inputs,
        source: &mut impl SetpointSource,
    ) -> bool {
        if self.position_to_hold {
            self.hold_position();
        }
        if self.state != State::Moving {
            self.motion = Stretch::resting_at(self.setpoint);
            self.left = self.motion.samples;
            self.stand_or_move();
            return true;
        }
        let load = if self.operands.settings.feedback_of_load != 0 {
            self.load.position()
        } else {
            inputs.load_register.map(u32::cast_signed)
        };
        let observed = Observed {
            position: self.motor.position,
            load_position: load,
            code: self.law.code(),
        };
        let flank = match source.next(&observed) {
            Next::Stretch(stretch) => {
                self.motion = Stretch {
                    ahead: self.operands.law.held_ahead(stretch.ahead),
                    ..stretch
                };
                self.left = stretch.samples.saturating_sub(1);
                self.operands.crossing.sign_of(&stretch)
            }
            Next::Setpoint(setpoint) => self.take(&setpoint),
            Next::Last(setpoint) => {
                self.state = State::Holding;
                self.stand_or_move();
                self.take(&setpoint)
            }
            Next::Underrun => return false,
        };
        if flank != 0 && self.crossing.asks_for(flank) {
            self.operands.crossing.begin(&mut self.crossing);
            self.stand_or_move();
        }
        true
    }

    /// Enabled since the last sample: holds where the axis stands, and goes on from
    /// the code in force.
    #[cold]
    #[inline(never)]
    fn hold_position(&mut self) {
        self.position_to_hold = false;
        self.setpoint = self.place();
        self.crossing = CrossingState::default();
        let goes_on = self.state == State::Enabled || self.law.code() != 0;
        self.begin = Some(if goes_on {
            Begin::FromCode
        } else {
            // Started in the same breath, from rest.
            Begin::AtRest
        });
        self.stand_or_move();
    }

    /// A setpoint of its own; the flank that it asks for.
    #[inline]
    fn take(&mut self, setpoint: &Setpoint) -> i8 {
        let operands = &self.operands;
        let Setpoint {
            position,
            velocity,
            acceleration,
            ahead,
        } = *setpoint;
        let moved = position.wrapping_sub(self.setpoint);
        // What follows from one sample to the next is not asked for.
        let motion = &mut self.motion;
        motion.position = nearest(position);
        if operands.settings.lag_mantissa != 0 {
            let bits = operands.settings.velocity_fraction_bits;
            motion.velocity = counts_per_sample(velocity, bits);
        }
        motion.ahead = match ahead {
            Some(ahead) => operands.law.held_ahead(ahead),
            None if operands.law.feeds_forward => operands.law.feed_forward(velocity, acceleration),
            None => Codes::ZERO,
        };
        operands.crossing.sign(velocity, acceleration, moved)
    }

    /// The operands that follow from whether the axis is to stand.
    #[inline(never)]
    pub(super) fn stand_or_move(&mut self) {
        let stands = self.state != State::Moving && !self.crossing.is_under_way();
        let (settings, law) = (&self.operands.settings, &self.operands.law);
        (self.band, self.ki_dt) = match (stands, settings.hold_integral) {
            (false, _) => (0, law.ki_dt),
            (true, 0) => (settings.dead_band_counts.saturating_add(1), law.ki_dt),
            (true, _) => (settings.dead_band_counts.saturating_add(1), Term::ZERO),
        };
    }

    /// A move across the gap has come to its middle, or to its end.
    #[cold]
    #[inline(never)]
    pub(super) fn crossed(&mut self) {
        self.operands.crossing.turn(&mut self.crossing);
        self.stand_or_move();
    }
}

/// A velocity with so many fraction bits, in counts per sample.
fn counts_per_sample(velocity: i32, fraction_bits: u32) -> Counts {
    let bits = i64::from(velocity.unsigned_abs());
    let size = Counts::from_bits(match 32_u32.checked_sub(fraction_bits) {
        Some(up) => bits.wrapping_shl(up),
        None => bits.wrapping_shr(fraction_bits.wrapping_sub(32)),
    });
    if velocity < 0 {
        size.wrapping_neg()
    } else {
        size
    }
}

/// Bits that a counter has less than a word.
const fn bits(counter: u32) -> u32 {
    u32::BITS.wrapping_sub(counter)
}
