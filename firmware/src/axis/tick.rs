//! One sample of the axis, top to bottom: its usual case. What is rare leaves by
//! one branch for each cause to [`super::rare`].

use super::rare::Done;
use super::{AxisOutput, AxisState, Inputs};
use crate::counts;
use crate::dac::Codes;
use crate::law::term::Term;
use crate::law::{self, Begin};
use crate::position::signed;
use crate::reference::SetpointSource;

impl AxisState {
    /// One sample.
    #[inline(always)]
    pub fn tick(&mut self, inputs: &Inputs, source: &mut impl SetpointSource) -> AxisOutput {
        let code = self.sample(inputs, source);
        AxisOutput {
            code,
            power: self.state.is_powered() || code != 0,
            state: self.state,
            error_counts: self.error,
            out_of_range: self.law.take_left_range(),
        }
    }

    /// The code of one sample.
    #[inline]
    fn sample(&mut self, inputs: &Inputs, source: &mut impl SetpointSource) -> i32 {
        // 1. Whether it is a usual sample
        let reported = u32::from(inputs.emergency_stop) | inputs.failed_transfers;
        let unusual = reported | u32::from(!self.usual);
        if u64::from(unusual) | (inputs.tick ^ self.expected) != 0 && !self.prepare(inputs, source)
        {
            return self.law.code();
        }
        self.expected = inputs.tick.wrapping_add(1);

        // 2. c ← c + d                                                 [counts]
        let register = inputs.motor_register;
        let difference = signed(
            register.wrapping_sub(self.motor.position.cast_unsigned()),
            u32::BITS.wrapping_sub(self.settings.counter_bits()),
        );
        let (mut law_moved, jump) = (difference, self.jump);
        if difference.cast_unsigned().wrapping_add(jump) > jump.wrapping_mul(2) {
            law_moved = match self.jumped(inputs, source, difference) {
                Some(held) => held,
                None => return self.law.code(),
            };
        }
        self.motor.position = self.motor.position.wrapping_add(difference);
        let (mut position, mut moved) = (self.motor.position, difference);
        if self.settings.feedback_of_load() != 0 {
            // With two encoders both must move.
            if self.read_load(inputs) == 0 {
                moved = 0;
            }
            if self.tripped {
                return self.trip(inputs, source, Done::Positions);
            }
            position = self.load.position;
        }
        let mut still = 0;
        if moved == 0 && self.law.code().unsigned_abs() >= self.settings.encoder_loss_codes() {
            still = self.still.saturating_add(1);
            if still >= self.settings.encoder_loss_samples() {
                return self.lost(inputs, source, still);
            }
        }
        self.still = still;

        // 3. Reference
        if self.left != 0 {
            self.left = self.left.wrapping_sub(1);
            self.motion.advance();
        } else if !self.next_stretch(inputs, source) {
            return self.trip(inputs, source, Done::Reference);
        }
        let setpoint = self.motion.setpoint();
        self.setpoint = setpoint;
        if self.crossing.left != 0 {
            self.crossing.advance();
            if self.crossing.left == 0 {
                self.crossed();
            }
        }

        // 4. e = r − c                                       eq. 20, 22 [counts]
        let error = counts::difference(setpoint.wrapping_add(self.crossing.offset), position);
        self.error = error;
        let size = error.unsigned_abs();
        self.peak = self.peak.max(size);
        let (mut e, mut counted) = (error, error);
        if size.wrapping_sub(self.band) >= self.usual_sizes {
            if size < self.band && self.begin == Begin::GoingOn {
                counted = 0;
            } else {
                e = match self.far(inputs, source, law_moved) {
                    Some(held) => held,
                    None => return self.law.code(),
                };
                let stands = self.band != 0;
                counted = match stands && size <= self.settings.dead_band_counts() {
                    true => 0,
                    false => e,
                };
            }
        }

        // 5. Law and output
        let law_inputs = law::Inputs {
            e,
            counted,
            moved: law_moved,
            ahead: self.motion.ahead,
            ki_dt: Term {
                mantissa: self.ki_dt_mantissa,
                scale: self.settings.ki_dt_scale().cast_signed(),
            },
        };
        let rounding = Codes::from_bits(i64::from(self.law.remainder()));
        let terms = self
            .settings
            .terms::<false>(rounding, &mut self.law, law_inputs);
        let (output, before, slew) = (&self.output, self.law.code(), self.slew);
        let reaches = |code| output.reaches_within(before, code, slew);
        match terms.code(output, &mut self.law, reaches) {
            Some(code) => {
                self.saturated = 0;
                code
            }
            None => self.limited(inputs, source, terms),
        }
    }
}
