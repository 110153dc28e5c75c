//! A controller's parameters as bytes. Who reads them accepts them anew: what
//! came over a line is held to the same proof as what was written by hand.

use heapless::Vec;

use crate::body::{Reader, Writer};
use crate::frame::LARGEST_BODY;
use firmware::axis::{Axis, Feedback, Monitors, Rest};
use firmware::backlash_compensation::{BacklashCompensation, Trigger};
use firmware::dac::Dac;
use firmware::gains::PidWords;
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::pid::Pid;
use firmware::position::CounterParameters;
use firmware::word::GainWord;

/// A part of a configuration.
pub type Payload = Vec<u8, LARGEST_BODY>;

/// The paper's words and converter.
pub fn write_paper(words: &PidWords, dac: Dac) -> Option<Payload> {
    let mut to = Writer::new();
    to.u8(dac_bits(dac));
    to.u8(words.error_bits);
    for word in [words.kp, words.ki_dt, words.kd_per_dt] {
        write_word(&mut to, word);
    }
    to.finish()
}

/// Reads what [`write_paper`] wrote; `None` if it is damaged or refused.
pub fn read_paper(payload: &[u8]) -> Option<(Pid, Dac)> {
    let mut from = Reader::new(payload);
    let dac = Dac::with_bits(u32::from(from.u8()?)).ok()?;
    let words = PidWords {
        error_bits: from.u8()?,
        kp: read_word(&mut from)?,
        ki_dt: read_word(&mut from)?,
        kd_per_dt: read_word(&mut from)?,
    };
    from.end()?;
    Some((Pid::accept(words).ok()?, dac))
}

/// The law of an axis with its converter.
pub fn write_law(law: &Law) -> Option<Payload> {
    let mut to = Writer::new();
    law_to(&mut to, law);
    to.finish()
}

/// Reads what [`write_law`] wrote; `None` if it is damaged or refused.
pub fn read_law(payload: &[u8]) -> Option<Law> {
    let mut from = Reader::new(payload);
    let law = law_from(&mut from)?;
    from.end()?;
    Some(law)
}

/// All parameters of an axis.
pub fn write_axis(axis: &Axis) -> Option<Payload> {
    let mut to = Writer::new();
    law_to(&mut to, axis.law());
    to.u32(axis.output().slew_codes().unwrap_or(0));
    let (kind, seed) = match axis.output().quantiser() {
        Quantiser::Nearest => (0, 0),
        Quantiser::ErrorFeedback => (1, 0),
        Quantiser::Dither { seed } => (2, seed),
    };
    to.u8(kind);
    to.u32(seed);
    counter_to(&mut to, axis.counter);
    match axis.feedback {
        Feedback::Motor => to.u8(0),
        Feedback::Load(counter) => {
            to.u8(1);
            counter_to(&mut to, counter);
        }
    }
    match axis.backlash_compensation {
        None => to.u8(0),
        Some(backlash_compensation) => {
            to.u8(match backlash_compensation.trigger() {
                Trigger::Velocity => 1,
                Trigger::Acceleration => 2,
            });
            to.u32(backlash_compensation.half_gap_counts());
            to.u32(backlash_compensation.samples());
        }
    }
    to.u32(axis.rest.dead_band);
    to.u8(u8::from(axis.rest.hold_integral));
    monitors_to(&mut to, &axis.monitors);
    to.finish()
}

/// Reads what [`write_axis`] wrote; `None` if it is damaged or refused.
pub fn read_axis(payload: &[u8]) -> Option<Axis> {
    let mut from = Reader::new(payload);
    let law = law_from(&mut from)?;
    let slew = from.u32()?;
    let (kind, seed) = (from.u8()?, from.u32()?);
    let quantiser = match kind {
        0 => Quantiser::Nearest,
        1 => Quantiser::ErrorFeedback,
        2 => Quantiser::Dither { seed },
        _ => return None,
    };
    let output = Output::new(law.dac(), (slew != 0).then_some(slew), quantiser).ok()?;
    let mut axis = Axis::new(law, output);
    axis.counter = counter_from(&mut from)?;
    axis.feedback = match from.u8()? {
        0 => Feedback::Motor,
        1 => Feedback::Load(counter_from(&mut from)?),
        _ => return None,
    };
    let trigger = match from.u8()? {
        0 => None,
        1 => Some(Trigger::Velocity),
        2 => Some(Trigger::Acceleration),
        _ => return None,
    };
    axis.backlash_compensation = match trigger {
        None => None,
        Some(trigger) => Some(BacklashCompensation::planned(
            from.u32()?,
            from.u32()?,
            trigger,
        )?),
    };
    axis.rest = Rest {
        dead_band: from.u32()?,
        hold_integral: flag_from(&mut from)?,
    };
    axis.monitors = monitors_from(&mut from)?;
    from.end()?;
    Some(axis)
}

fn law_to<const N: usize>(to: &mut Writer<N>, law: &Law) {
    let words = law.words();
    to.u8(dac_bits(law.dac()));
    to.u8(words.error_bits);
    to.u8(words.sum_fraction_bits);
    to.u8(words.integral_bits);
    for word in [
        words.kp,
        words.ki_dt,
        words.kd_per_dt,
        words.velocity_ff,
        words.acceleration_ff,
        words.friction_ff,
    ] {
        write_word(to, word);
    }
    to.u8(match words.derivative {
        Derivative::Error => 0,
        Derivative::Measurement => 1,
    });
    match words.filter {
        None => to.u8(0),
        Some(filter) => {
            to.u8(1);
            to.i32(filter.smoothing);
            to.u8(filter.fraction_bits);
        }
    }
    match words.anti_windup {
        AntiWindup::None => to.u8(0),
        AntiWindup::Clamp => to.u8(1),
        AntiWindup::BackCalculation { tracking } => {
            to.u8(2);
            to.i32(tracking);
        }
    }
}

fn law_from(from: &mut Reader<'_>) -> Option<Law> {
    let dac = Dac::with_bits(u32::from(from.u8()?)).ok()?;
    let words = LawWords {
        error_bits: from.u8()?,
        sum_fraction_bits: from.u8()?,
        integral_bits: from.u8()?,
        kp: read_word(from)?,
        ki_dt: read_word(from)?,
        kd_per_dt: read_word(from)?,
        velocity_ff: read_word(from)?,
        acceleration_ff: read_word(from)?,
        friction_ff: read_word(from)?,
        derivative: match from.u8()? {
            0 => Derivative::Error,
            1 => Derivative::Measurement,
            _ => return None,
        },
        filter: match from.u8()? {
            0 => None,
            1 => Some(FilterWords {
                smoothing: from.i32()?,
                fraction_bits: from.u8()?,
            }),
            _ => return None,
        },
        anti_windup: match from.u8()? {
            0 => AntiWindup::None,
            1 => AntiWindup::Clamp,
            2 => AntiWindup::BackCalculation {
                tracking: from.i32()?,
            },
            _ => return None,
        },
    };
    Law::accept(words, dac).ok()
}

fn monitors_to<const N: usize>(to: &mut Writer<N>, monitors: &Monitors) {
    // A limit of 0 is none: every monitor refuses it.
    let [limit, mantissa, fraction_bits] = monitors.following_error.map_or([0; 3], |monitor| {
        let (limit, word) = monitor.limits();
        [
            limit,
            word.mantissa.cast_unsigned(),
            u32::from(word.fraction_bits),
        ]
    });
    to.u32(limit);
    to.u32(mantissa);
    to.u32(fraction_bits);
    let (code, samples) = monitors
        .encoder_loss
        .map_or((0, 0), |monitor| monitor.limits());
    to.u32(code);
    to.u32(samples);
    // 2^32 − 1 is none: the monitor refuses it.
    to.u32(
        monitors
            .saturation
            .map_or(u32::MAX, |monitor| monitor.limit()),
    );
    to.u8(u8::from(monitors.ticks.is_some()));
}

fn monitors_from(from: &mut Reader<'_>) -> Option<Monitors> {
    let (limit, mantissa, fraction_bits) = (from.u32()?, from.u32()?, from.u32()?);
    let following_error = if limit == 0 {
        None
    } else {
        let lag = GainWord::new(mantissa.cast_signed(), u8::try_from(fraction_bits).ok()?);
        Some(FollowingErrorMonitor::accept(limit, lag, 0).ok()?)
    };
    let (code, samples) = (from.u32()?, from.u32()?);
    let encoder_loss = if code == 0 {
        None
    } else {
        Some(EncoderLossMonitor::accept(code, samples).ok()?)
    };
    let samples = from.u32()?;
    let saturation = if samples == u32::MAX {
        None
    } else {
        Some(SaturationMonitor::accept(samples).ok()?)
    };
    Some(Monitors {
        following_error,
        encoder_loss,
        saturation,
        ticks: flag_from(from)?.then_some(TickMonitor),
    })
}

fn counter_to<const N: usize>(to: &mut Writer<N>, counter: CounterParameters) {
    to.u8(counter.bits());
    // A jump of 0 is none: a counter refuses it.
    to.u32(counter.largest_jump().unwrap_or(0));
}

fn counter_from(from: &mut Reader<'_>) -> Option<CounterParameters> {
    let (bits, jump) = (from.u8()?, from.u32()?);
    CounterParameters::accept(bits, (jump != 0).then_some(jump)).ok()
}

fn write_word<const N: usize>(to: &mut Writer<N>, word: GainWord) {
    to.i32(word.mantissa);
    to.u8(word.fraction_bits);
}

fn read_word(from: &mut Reader<'_>) -> Option<GainWord> {
    Some(GainWord::new(from.i32()?, from.u8()?))
}

fn flag_from(from: &mut Reader<'_>) -> Option<bool> {
    match from.u8()? {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

fn dac_bits(dac: Dac) -> u8 {
    u8::try_from(dac.bits()).unwrap_or(0)
}
