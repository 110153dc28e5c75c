//! One sample of the axis, top to bottom: its usual case. What is rare leaves by
//! one branch for each cause to [`super::rare`].

use super::{AxisOutput, AxisState, Inputs};
use crate::counts;
use crate::law;
use crate::law::term::Term;
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
        if u64::from(unusual) | (inputs.tick ^ self.expected) != 0 && !self.prepare(inputs) {
            return self.law.code();
        }
        self.expected = inputs.tick.wrapping_add(1);

        // 2. c ← c + d                                                 [counts]
        let register = inputs.motor_register;
        let mut moved = signed(
            register.wrapping_sub(self.motor.position.cast_unsigned()),
            u32::BITS.wrapping_sub(self.settings.counter_bits()),
        );
        let (mut law_moved, jump) = (moved, self.jump);
        if moved.cast_unsigned().wrapping_add(jump) > jump.wrapping_mul(2) {
            (moved, law_moved) = self.jumped(register);
        }
        self.motor.position = self.motor.position.wrapping_add(moved);
        let mut position = self.motor.position;
        if self.settings.feedback_of_load() != 0 {
            // With two encoders both must move.
            if self.read_load(inputs.load_register) == 0 {
                moved = 0;
            }
            position = self.load.position;
        }
        if moved == 0 && self.law.code().unsigned_abs() >= self.settings.encoder_loss_codes() {
            self.stands_driven();
        } else {
            self.still = 0;
        }

        // 3. Reference
        if self.left != 0 {
            self.left = self.left.wrapping_sub(1);
            self.motion.advance();
        } else {
            self.next_stretch(inputs.load_register, source);
        }
        if self.crossing.left != 0 {
            self.crossing.advance();
            if self.crossing.left == 0 {
                self.crossed();
            }
        }

        // 4. e = r − c                                       eq. 20, 22 [counts]
        let setpoint = self.motion.setpoint().wrapping_add(self.crossing.offset);
        let error = counts::difference(setpoint, position);
        self.error = error;
        let size = error.unsigned_abs();
        self.peak = self.peak.max(size);
        let (mut e, mut counted) = (error, error);
        if size.wrapping_sub(self.band) >= self.usual_sizes {
            if size < self.band && self.usual_sizes != 0 {
                counted = 0;
            } else {
                e = match self.far(law_moved) {
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
        let sum = self.settings.sum::<false>(&mut self.law, law_inputs);
        if self
            .output
            .reaches_within(self.law.code(), sum.code(), self.slew)
        {
            self.saturated = 0;
            sum.take(&self.output, &mut self.law)
        } else {
            self.limited(sum)
        }
    }
}
