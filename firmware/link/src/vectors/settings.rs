//! An axis from lines `key = value`, numbers and names only.

use firmware::axis::{Axis, Feedback, Monitors, Rest};
use firmware::backlash_compensation::{BacklashCompensation, Room, Trigger};
use firmware::dac::Dac;
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::position::CounterParameters;
use firmware::word::GainWord;

use super::row::Columns;

/// Values that belong together.
impl Columns<'_> {
    fn word(&mut self) -> Option<GainWord> {
        Some(GainWord::new(self.number()?, self.number()?))
    }

    fn counter(&mut self) -> Option<CounterParameters> {
        CounterParameters::accept(self.number()?, self.optional()?).ok()
    }

    fn backlash_compensation(&mut self) -> Option<BacklashCompensation> {
        let half_gap = self.number()?;
        let room = Room {
            velocity: self.number()?,
            acceleration: self.number()?,
        };
        let trigger = match self.name()? {
            "velocity" => Trigger::Velocity,
            "acceleration" => Trigger::Acceleration,
            _ => return None,
        };
        BacklashCompensation::plan(half_gap, room, trigger).ok()
    }
}

/// Settings of an axis, not accepted yet. The default is everything off, and
/// no converter: that one has to be named.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    dac_bits: u32,
    words: LawWords,
    slew: Option<u32>,
    quantiser: Quantiser,
    counter: CounterParameters,
    feedback: Feedback,
    backlash_compensation: Option<BacklashCompensation>,
    rest: Rest,
    monitors: Monitors,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            dac_bits: 0,
            words: LawWords::NONE,
            slew: None,
            quantiser: Quantiser::Nearest,
            counter: CounterParameters::WORD,
            feedback: Feedback::Motor,
            backlash_compensation: None,
            rest: Rest::NONE,
            monitors: Monitors::NONE,
        }
    }
}

impl Settings {
    /// The axis; `None` where the firmware refuses it.
    pub fn axis(&self) -> Option<Axis> {
        let law = Law::accept(self.words, Dac::with_bits(self.dac_bits).ok()?).ok()?;
        let output = Output::new(law.dac(), self.slew, self.quantiser).ok()?;
        let mut axis = Axis::new(law, output);
        axis.counter = self.counter;
        axis.feedback = self.feedback;
        axis.backlash_compensation = self.backlash_compensation;
        axis.rest = self.rest;
        axis.monitors = self.monitors;
        Some(axis)
    }

    /// Takes the line `key = value`; `None` where it says nothing known, or a
    /// value that the firmware refuses.
    pub fn set(&mut self, line: &str) -> Option<()> {
        let (key, values) = line.split_once('=')?;
        let mut v = Columns::of(values);
        let (words, monitors) = (&mut self.words, &mut self.monitors);
        match key.trim() {
            "dac_bits" => self.dac_bits = v.number()?,
            "slew_codes" => self.slew = Some(v.number()?),
            "quantiser" => {
                self.quantiser = match v.name()? {
                    "error-feedback" => Quantiser::ErrorFeedback,
                    "dither" => Quantiser::Dither { seed: v.number()? },
                    _ => return None,
                };
            }
            "kp" => words.kp = v.word()?,
            "ki_dt" => words.ki_dt = v.word()?,
            "kd_per_dt" => words.kd_per_dt = v.word()?,
            "velocity_ff" => words.velocity_ff = v.word()?,
            "acceleration_ff" => words.acceleration_ff = v.word()?,
            "friction_ff" => words.friction_ff = v.word()?,
            "error_bits" => words.error_bits = v.number()?,
            "integral_bits" => words.integral_bits = v.number()?,
            "derivative" => {
                words.derivative = match v.name()? {
                    "measurement" => Derivative::Measurement,
                    _ => return None,
                };
            }
            "filter" => {
                words.filter = Some(FilterWords {
                    smoothing: v.number()?,
                    fraction_bits: v.number()?,
                });
            }
            "anti_windup" => {
                words.anti_windup = match v.name()? {
                    "clamp" => AntiWindup::Clamp,
                    "back-calculation" => AntiWindup::BackCalculation {
                        tracking: v.number()?,
                    },
                    _ => return None,
                };
            }
            "counter" => self.counter = v.counter()?,
            "load_counter" => self.feedback = Feedback::Load(v.counter()?),
            "backlash_compensation" => {
                self.backlash_compensation = Some(v.backlash_compensation()?)
            }
            "dead_band" => self.rest.dead_band = v.number()?,
            "hold_integral" => self.rest.hold_integral = v.number::<u8>()? == 1,
            "following_error" => {
                let monitor = FollowingErrorMonitor::accept(v.number()?, v.word()?, v.number()?);
                monitors.following_error = Some(monitor.ok()?);
            }
            "encoder_loss" => {
                let monitor = EncoderLossMonitor::accept(v.number()?, v.number()?);
                monitors.encoder_loss = Some(monitor.ok()?);
            }
            "saturation" => {
                monitors.saturation = Some(SaturationMonitor::accept(v.number()?).ok()?)
            }
            "ticks" => monitors.ticks = (v.number::<u8>()? == 1).then_some(TickMonitor),
            _ => return None,
        }
        // Nothing may be left over.
        v.end()
    }
}
