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

use firmware::law::words::LARGEST_RATE;
use firmware::law::{Begin, LawInput};
use firmware::{Axis, AxisOutput, Codes, Inputs, Next, Setpoint, State, Stretch};
use firmware_link::vectors::Given;

use model::{CODE, MOST, Model, value};

/// The law in exact integers, with the inputs that an axis gives it.
pub(crate) struct Judge {
    axis: Axis,
    model: Model,
    /// Memory that the next sample of the law begins with.
    begin: Option<Begin>,
    moves: bool,
    /// The stretch that was given last, and its samples so far.
    stretch: (Stretch, u32),
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
            stretch: (Stretch::default(), 0),
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
            Some(Begin::OtherGains | Begin::GoingOn) | None => Begin::OtherGains,
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
        if given.requests != "-" {
            self.stretch = (Stretch::default(), 0);
        }
        let (setpoint, ahead) = self.command(given.next, self.moves || asks('S'));
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
                    ahead: Codes::from_bits(i64::try_from(ahead).expect("32 bits of codes")),
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

    /// What is asked of this sample, and the feed-forward that came with it
    /// \[2^−32 codes\]. The axis asks its source while it moves, once a stretch.
    fn command(&mut self, next: Next, moves: bool) -> (Setpoint, i128) {
        if !moves {
            return (Setpoint::default(), 0);
        }
        if self.stretch.0.samples == self.stretch.1 {
            self.stretch = match next {
                Next::Stretch(stretch) => (stretch, 0),
                Next::Setpoint(Setpoint {
                    ahead: Some(ahead), ..
                }) => {
                    // Whole codes that 2^30 leave beside the other terms.
                    let words = self.axis.law().words();
                    let rates = value(words.velocity_ff) + value(words.acceleration_ff);
                    let most = rates * i128::from(LARGEST_RATE) + value(words.friction_ff);
                    let left = MOST - self.model.ranges.largest + most;
                    let most = left.div_euclid(CODE) * CODE;
                    let ahead = i128::from(ahead.to_bits()).clamp(-most, most);
                    return (Setpoint::default(), ahead);
                }
                Next::Setpoint(next) | Next::Last(next) => return (next, 0),
                Next::Underrun => return (Setpoint::default(), 0),
            };
        }
        // f + k·d + k·(k − 1)/2·g, the sum of its differences.
        let (stretch, samples) = &mut self.stretch;
        let k = i128::from(*samples);
        *samples += 1;
        let [f, d, g] = [stretch.ahead, stretch.ahead_change, stretch.ahead_growth]
            .map(|codes| i128::from(codes.to_bits()));
        (Setpoint::default(), f + k * d + k * (k - 1) / 2 * g)
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
