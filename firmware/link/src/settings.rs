//! A controller's parameters as bytes. Who reads them accepts them anew: what
//! came over a line is held to the same proof as what was written by hand.

use heapless::Vec;

use crate::body::{Reader, Wire, Writer};
use crate::frame::LARGEST_BODY;
use firmware::axis::{Axis, Feedback, Monitors};
use firmware::backlash_compensation::{BacklashCompensation, Trigger};
use firmware::dac::Dac;
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::position::CounterParameters;
use firmware::word::GainWord;

/// A part of a configuration.
pub type Payload = Vec<u8, LARGEST_BODY>;

/// A law's words and its converter, not accepted yet.
#[derive(Debug, Clone, Copy)]
struct LawSettings {
    dac_bits: u32,
    words: LawWords,
}

impl LawSettings {
    const NONE: Self = Self {
        dac_bits: 0,
        words: LawWords::NONE,
    };

    fn of(law: &Law) -> Self {
        Self {
            dac_bits: law.dac().bits(),
            words: *law.words(),
        }
    }

    /// The law; `None` where the firmware refuses it.
    fn accepted(&self) -> Option<Law> {
        Law::accept(self.words, Dac::with_bits(self.dac_bits).ok()?).ok()
    }

    fn fields(&mut self, wire: &mut impl Wire) -> Option<()> {
        dac(wire, &mut self.dac_bits)?;
        let words = &mut self.words;
        wire.u8(&mut words.error_bits)?;
        wire.u8(&mut words.integral_bits)?;
        word(wire, &mut words.kp)?;
        word(wire, &mut words.ki_dt)?;
        word(wire, &mut words.kd_per_dt)?;
        word(wire, &mut words.velocity_ff)?;
        word(wire, &mut words.acceleration_ff)?;
        word(wire, &mut words.friction_ff)?;
        wire.choice(
            &mut words.derivative,
            &[Derivative::Error, Derivative::Measurement],
        )?;
        const FILTER: FilterWords = FilterWords {
            smoothing: 0,
            fraction_bits: 0,
        };
        wire.choice(&mut words.filter, &[None, Some(FILTER)])?;
        if let Some(filter) = &mut words.filter {
            wire.i32(&mut filter.smoothing)?;
            wire.u8(&mut filter.fraction_bits)?;
        }
        const TREATMENTS: [AntiWindup; 3] = [
            AntiWindup::None,
            AntiWindup::Clamp,
            AntiWindup::BackCalculation { tracking: 0 },
        ];
        wire.choice(&mut words.anti_windup, &TREATMENTS)?;
        match &mut words.anti_windup {
            AntiWindup::BackCalculation { tracking } => wire.i32(tracking),
            AntiWindup::None | AntiWindup::Clamp => Some(()),
        }
    }
}

/// A law with its converter.
pub fn write_law(law: &Law) -> Option<Payload> {
    Writer::body(|to| LawSettings::of(law).fields(to))
}

/// Reads what [`write_law`] wrote; `None` if it is damaged or refused.
pub fn read_law(payload: &[u8]) -> Option<Law> {
    let (mut law, mut from) = (LawSettings::NONE, Reader::new(payload));
    law.fields(&mut from)?;
    from.end()?;
    law.accepted()
}

/// All parameters of an axis.
pub fn write_axis(axis: &Axis) -> Option<Payload> {
    let output = axis.output();
    Writer::body(|to| {
        LawSettings::of(axis.law()).fields(to)?;
        output_fields(to, &mut output.slew_codes(), &mut output.quantiser())?;
        axis_fields(to, &mut { *axis })
    })
}

/// Reads what [`write_axis`] wrote; `None` if it is damaged or refused.
pub fn read_axis(payload: &[u8]) -> Option<Axis> {
    let (mut law, mut from) = (LawSettings::NONE, Reader::new(payload));
    law.fields(&mut from)?;
    let law = law.accepted()?;
    let (mut slew, mut quantiser) = (None, Quantiser::Nearest);
    output_fields(&mut from, &mut slew, &mut quantiser)?;
    let mut axis = Axis::new(law, Output::new(law.dac(), slew, quantiser).ok()?);
    axis_fields(&mut from, &mut axis)?;
    from.end()?;
    Some(axis)
}

/// Slew limit and quantiser of an axis.
fn output_fields(
    wire: &mut impl Wire,
    slew: &mut Option<u32>,
    quantiser: &mut Quantiser,
) -> Option<()> {
    optional(wire, slew)?;
    const QUANTISERS: [Quantiser; 3] = [
        Quantiser::Nearest,
        Quantiser::ErrorFeedback,
        Quantiser::Dither { seed: 0 },
    ];
    wire.choice(quantiser, &QUANTISERS)?;
    match quantiser {
        Quantiser::Dither { seed } => wire.u32(seed),
        Quantiser::Nearest | Quantiser::ErrorFeedback => wire.u32(&mut 0),
    }
}

/// What an axis has besides law and output.
fn axis_fields(wire: &mut impl Wire, axis: &mut Axis) -> Option<()> {
    counter(wire, &mut axis.counter)?;
    const FEEDBACKS: [Feedback; 2] = [Feedback::Motor, Feedback::Load(CounterParameters::WORD)];
    wire.choice(&mut axis.feedback, &FEEDBACKS)?;
    if let Feedback::Load(load) = &mut axis.feedback {
        counter(wire, load)?;
    }
    backlash_compensation(wire, &mut axis.backlash_compensation)?;
    wire.u32(&mut axis.rest.dead_band)?;
    wire.flag(&mut axis.rest.hold_integral)?;
    monitors(wire, &mut axis.monitors)
}

/// Bits of the converter, in a byte.
fn dac(wire: &mut impl Wire, bits: &mut u32) -> Option<()> {
    let mut byte = u8::try_from(*bits).ok()?;
    wire.u8(&mut byte)?;
    *bits = u32::from(byte);
    Some(())
}

fn word(wire: &mut impl Wire, word: &mut GainWord) -> Option<()> {
    wire.i32(&mut word.mantissa)?;
    wire.u8(&mut word.fraction_bits)
}

/// A number that is refused where it is 0, which stands for none.
fn optional(wire: &mut impl Wire, number: &mut Option<u32>) -> Option<()> {
    let mut value = number.unwrap_or(0);
    wire.u32(&mut value)?;
    *number = (value != 0).then_some(value);
    Some(())
}

fn counter(wire: &mut impl Wire, counter: &mut CounterParameters) -> Option<()> {
    let (mut bits, mut jump) = (counter.bits(), counter.largest_jump());
    wire.u8(&mut bits)?;
    optional(wire, &mut jump)?;
    *counter = CounterParameters::accept(bits, jump).ok()?;
    Some(())
}

fn backlash_compensation(
    wire: &mut impl Wire,
    planned: &mut Option<BacklashCompensation>,
) -> Option<()> {
    let mut kind = match planned.map(|plan| plan.trigger()) {
        None => 0,
        Some(Trigger::Velocity) => 1,
        Some(Trigger::Acceleration) => 2,
    };
    wire.u8(&mut kind)?;
    let trigger = match kind {
        0 => return Some(()),
        1 => Trigger::Velocity,
        2 => Trigger::Acceleration,
        _ => return None,
    };
    let (mut half_gap, mut samples) =
        planned.map_or((0, 0), |plan| (plan.half_gap_counts(), plan.samples()));
    wire.u32(&mut half_gap)?;
    wire.u32(&mut samples)?;
    *planned = Some(BacklashCompensation::planned(half_gap, samples, trigger)?);
    Some(())
}

fn monitors(wire: &mut impl Wire, monitors: &mut Monitors) -> Option<()> {
    // A limit of 0 is none: every monitor refuses it.
    let following_error = &mut monitors.following_error;
    let (mut limit, mut lag) =
        following_error.map_or((0, GainWord::new(0, 0)), |monitor| monitor.limits());
    let mut fraction_bits = u32::from(lag.fraction_bits);
    wire.u32(&mut limit)?;
    wire.i32(&mut lag.mantissa)?;
    wire.u32(&mut fraction_bits)?;
    if limit != 0 {
        lag.fraction_bits = u8::try_from(fraction_bits).ok()?;
        *following_error = Some(FollowingErrorMonitor::accept(limit, lag, 0).ok()?);
    }
    let encoder_loss = &mut monitors.encoder_loss;
    let (mut code, mut samples) = encoder_loss.map_or((0, 0), |monitor| monitor.limits());
    wire.u32(&mut code)?;
    wire.u32(&mut samples)?;
    if code != 0 {
        *encoder_loss = Some(EncoderLossMonitor::accept(code, samples).ok()?);
    }
    // 2^32 − 1 is none: the monitor refuses it.
    let saturation = &mut monitors.saturation;
    let mut samples = saturation.map_or(u32::MAX, |monitor| monitor.limit());
    wire.u32(&mut samples)?;
    *saturation = SaturationMonitor::accept(samples).ok();
    let mut ticks = monitors.ticks.is_some();
    wire.flag(&mut ticks)?;
    monitors.ticks = ticks.then_some(TickMonitor);
    Some(())
}
