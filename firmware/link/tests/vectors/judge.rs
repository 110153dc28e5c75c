//! Codes of the golden vectors, from the law in exact integers: a mistake that
//! host and chip have in common would be written down by either of them.
//!
//! Besides the law's own definition ([`model`]) stands here, in words of its own,
//! what leads to its inputs: where a sample begins anew, when the axis stands,
//! and what the output does without power. Error and state of a row are the
//! axis'. What the law rounds besides its code is the filter's value, to 2^−h
//! counts; the gains are what they are in fixed point.

#[path = "../../../tests/exact/model.rs"]
#[allow(dead_code, reason = "the law's own tests measure more of it")]
mod model;

use firmware::law::{Begin, LawInput};
use firmware::{Axis, AxisOutput, Inputs, Next, Setpoint, State};
use firmware_link::vectors::Given;

use model::Model;

/// The law in exact integers, with the inputs that an axis gives it.
pub(crate) struct Judge {
    axis: Axis,
    model: Model,
    /// Memory that the next sample of the law begins with.
    begin: Option<Begin>,
    moves: bool,
    /// Register of the motor's last credible reading.
    register: Option<u32>,
}

impl Judge {
    pub(crate) fn of(axis: Axis) -> Self {
        let (law, output) = (axis.law(), axis.output());
        let (words, bits) = (*law.words(), law.dac().bits());
        Self {
            axis,
            model: Model::new(words, bits, output.slew_codes(), output.quantiser()),
            begin: Some(Begin::AtRest),
            moves: false,
            register: None,
        }
    }

    /// Takes other settings from the next row on.
    pub(crate) fn change(&mut self, axis: Axis) {
        self.axis = axis;
        self.model.change(*axis.law().words());
        self.model.slew = axis.output().slew_codes();
        self.model.quantiser = axis.output().quantiser();
        self.begin = Some(match self.begin {
            Some(Begin::AtRest | Begin::FromCode) => Begin::FromCode,
            Some(Begin::OtherGains) | None => Begin::OtherGains,
        });
    }

    /// The code of a row whose other outputs are these, and whether the law has
    /// left a declared range.
    pub(crate) fn code(&mut self, given: &Given<'_>, output: &AxisOutput) -> (i32, bool) {
        let difference = self.difference(&given.inputs);
        let asks = |letter| given.requests.contains(letter);
        if asks('E') {
            // Both at once is a start from rest, but for a code in force.
            let from_rest = asks('S') && self.model.code == 0;
            self.begin = Some(if from_rest {
                Begin::AtRest
            } else {
                Begin::FromCode
            });
        }
        // The axis asks its source while it moves.
        let setpoint = match given.next {
            Next::Setpoint(next) | Next::Last(next) if self.moves || asks('S') => next,
            _ => Setpoint::default(),
        };
        self.moves = output.state == State::Moving;
        let stands = matches!(output.state, State::Enabled | State::Holding);
        let rest = self.axis.rest;
        let error = output.error_counts;
        let (code, told) = match output.state {
            State::Fault => (0, false),
            // Towards 0, as far as the slew limit lets it.
            State::Disabled => {
                let (low, high) = self.model.window();
                (low.max(high.min(0)), false)
            }
            State::Enabled | State::Moving | State::Holding => {
                let input = LawInput {
                    error,
                    difference,
                    velocity: setpoint.velocity,
                    acceleration: setpoint.acceleration,
                    within_dead_band: stands && error.unsigned_abs() <= rest.dead_band,
                    hold_integral: stands && rest.hold_integral,
                };
                let sample = self.model.step(&input, self.begin.take());
                (sample.code, sample.told)
            }
        };
        if !output.state.is_powered() {
            self.model.rest_at(code);
        }
        (i32::try_from(code).expect("a code"), told)
    }

    /// `c − c_prev` of the motor's counter \[counts\]; 0 where it is not credible.
    fn difference(&mut self, inputs: &Inputs) -> i32 {
        let register = inputs.motor_register;
        let counter = self.axis.counter;
        let wheel = 1_i64 << counter.bits();
        let last = i64::from(self.register.unwrap_or(register));
        let ahead = (i64::from(register) - last).rem_euclid(wheel);
        let difference = if ahead < wheel / 2 {
            ahead
        } else {
            ahead - wheel
        };
        let most = counter.largest_jump().map_or(wheel, i64::from);
        if difference.abs() > most {
            return 0;
        }
        self.register = Some(register);
        i32::try_from(difference).expect("within the wheel")
    }
}
