//! One sample of the axis, top to bottom: its usual case. What is rare leaves by
//! one branch for each cause to [`super::rare`].

use super::rare::Done;
use super::{AxisOutput, AxisState, Inputs};
use crate::backlash_compensation::Crossing;
use crate::counts;
use crate::dac::Codes;
use crate::faults::{FaultCause, Trip};
use crate::law::LawInput;
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
        if u64::from(self.rare | inputs.trips()) | (inputs.tick ^ self.expected) != 0
            && let Some(code) = self.prepare(inputs, source)
        {
            return code;
        }
        self.expected = inputs.tick.wrapping_add(1);

        // 2. c ← c + d                                                 [counts]
        let difference = signed(
            inputs
                .motor_register
                .wrapping_sub(self.motor.position.cast_unsigned()),
            u32::BITS.wrapping_sub(self.operands.settings.counter_bits),
        );
        if difference.unsigned_abs() > self.operands.settings.largest_jump_counts {
            return self.jumped(inputs, source);
        }
        self.motor.position = self.motor.position.wrapping_add(difference);
        let (mut position, mut moved) = (self.motor.position, difference);
        if self.operands.settings.feedback_of_load != 0 {
            match self.read_load(inputs) {
                // With two encoders both must move.
                Ok(0) => moved = 0,
                Ok(_) => {}
                Err(trip) => return self.trip(inputs, source, trip, Done::Positions),
            }
            position = self.load.position;
        }
        let code = self.law.code();
        if moved == 0 && code.unsigned_abs() >= self.operands.settings.encoder_loss_codes {
            if let Some(lost) = self.stood_still() {
                return self.trip(inputs, source, lost, Done::Positions);
            }
        } else {
            self.still = 0;
        }

        // 3. Reference
        if self.left != 0 {
            self.left = self.left.wrapping_sub(1);
            self.motion.advance();
        } else if !self.next_stretch(inputs, source) {
            return self.trip(inputs, source, Trip::SETPOINT_UNDERRUN, Done::Reference);
        }
        let setpoint = self.motion.setpoint();
        let ahead = self.motion.ahead;
        self.setpoint = setpoint;
        let crossing = &mut self.crossing;
        if crossing.left != 0 {
            Crossing::advance(crossing);
            if crossing.left == 0 {
                self.crossed();
            }
        }

        // 4. e = r − c                                       eq. 20, 22 [counts]
        let error = counts::difference(setpoint.wrapping_add(self.crossing.offset), position);
        self.error = error;
        let size = error.unsigned_abs();
        self.peak = self.peak.max(size);
        if size > self.operands.settings.following_error_counts
            && let Some(far) = self.too_far(size)
        {
            return self.trip(inputs, source, far, Done::Reference);
        }

        // 5. Law and output
        let input = LawInput {
            error,
            difference,
            ahead,
            within_dead_band: size < self.band,
            ..LawInput::default()
        };
        let (law, output) = (&self.operands.law, &self.operands.output);
        let mut takes_over = false;
        if let Some(begin) = self.begin {
            self.begin = None;
            takes_over = law.prepare(&mut self.law, error, difference, begin);
        }
        let rounding = Codes::from_bits(i64::from(self.law.remainder()));
        let terms = law.terms(rounding, &mut self.law, &input, self.ki_dt);
        let code = if takes_over {
            law.take_over(output, &mut self.law, terms.direct.wrapping_sub(rounding))
        } else {
            law.code(output, &mut self.law, terms)
        };
        if self.operands.output.dac().is_limit(code) {
            self.saturated = self.saturated.saturating_add(1);
            let [samples, limit] = [self.saturated, self.operands.settings.saturation_samples];
            if samples > limit {
                let [measured, limit] = [samples, limit].map(i64::from);
                let trip = Trip::new(FaultCause::SaturationTooLong, measured, limit);
                return self.trip(inputs, source, trip, Done::Reference);
            }
        } else {
            self.saturated = 0;
        }
        code
    }
}

impl Inputs {
    /// Tells whether the hardware itself reports a fault.
    #[inline(always)]
    fn trips(&self) -> bool {
        self.emergency_stop | (self.failed_transfers != 0)
    }
}
