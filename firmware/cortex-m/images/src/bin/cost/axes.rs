//! The axes that are measured, as constants: what is off costs nothing.

use firmware::axis::{Axis, Feedback, Monitors, Rest};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::{BacklashCompensation, CounterParameters, Dac, GainWord, Room, Trigger};

/// Takes what was accepted; ends the build where something was refused.
macro_rules! accepted {
    ($result:expr) => {
        match $result {
            Ok(accepted) => accepted,
            Err(_) => panic!("words that are refused"),
        }
    };
}

/// `Kp` = 3.2, `Ki·Δt` = 0.005, `Kd/Δt` = 50 codes per count: the paper's at
/// 1 ms, in words of 24 bits.
const WORDS: LawWords = LawWords {
    kp: GainWord::new(13_421_773, 22),
    ki_dt: GainWord::new(10_737_418, 31),
    kd_per_dt: GainWord::new(13_107_200, 18),
    ..LawWords::NONE
};

const WITH_CLAMP: LawWords = LawWords {
    anti_windup: AntiWindup::Clamp,
    ..WORDS
};

const OF_AXIS: LawWords = LawWords {
    derivative: Derivative::Measurement,
    ..WITH_CLAMP
};

/// `T_t` = 8 samples.
const TRACKING: AntiWindup = AntiWindup::BackCalculation { tracking: 1 << 27 };

/// `a` = ¼.
const FILTER_WORDS: FilterWords = FilterWords {
    smoothing: 1 << 29,
    fraction_bits: 10,
};

const fn fed_forward(words: LawWords) -> LawWords {
    LawWords {
        velocity_ff: GainWord::new(5_000, 32),
        acceleration_ff: GainWord::new(20_000, 32),
        friction_ff: GainWord::new(40 << 10, 10),
        ..words
    }
}

/// Largest step of the code per sample.
const SLEW_CODES: Option<u32> = Some(900);

const fn axis(words: LawWords, slew: Option<u32>, quantiser: Quantiser) -> Axis {
    let dac = accepted!(Dac::with_bits(14));
    let law = accepted!(Law::accept(words, dac));
    Axis::new(law, accepted!(Output::new(dac, slew, quantiser)))
}

const fn in_service(words: LawWords) -> Axis {
    axis(words, None, Quantiser::ErrorFeedback)
}

pub(crate) static PLAIN: Axis = axis(WORDS, None, Quantiser::Nearest);
pub(crate) static CLAMP: Axis = axis(WITH_CLAMP, None, Quantiser::Nearest);
pub(crate) static MEASUREMENT: Axis = axis(OF_AXIS, None, Quantiser::Nearest);
pub(crate) static AXIS: Axis = in_service(OF_AXIS);
pub(crate) static BACK_CALCULATION: Axis = in_service(LawWords {
    anti_windup: TRACKING,
    ..OF_AXIS
});
pub(crate) static FILTER: Axis = in_service(LawWords {
    filter: Some(FILTER_WORDS),
    ..OF_AXIS
});
pub(crate) static FEED_FORWARD: Axis = in_service(fed_forward(OF_AXIS));
pub(crate) static SLEW: Axis = axis(OF_AXIS, SLEW_CODES, Quantiser::ErrorFeedback);
pub(crate) static DITHER: Axis = axis(OF_AXIS, None, Quantiser::Dither { seed: 1 });
pub(crate) static LONG_WORDS: Axis = in_service(LawWords {
    kp: GainWord::new(1_717_986_918, 29),
    ki_dt: GainWord::new(21_474_836, 32),
    kd_per_dt: GainWord::new(1_677_721_600, 25),
    ..OF_AXIS
});

/// A counter of 16 bits whose glitches are found.
const COUNTER_16: CounterParameters = accepted!(CounterParameters::accept(16, Some(3_000)));

/// Each of them trips in the sequence, but for the missed tick.
const fn monitored(velocity_fraction_bits: u8) -> Monitors {
    Monitors {
        following_error: Some(accepted!(FollowingErrorMonitor::accept(
            30_000,
            GainWord::new(5, 1),
            velocity_fraction_bits,
        ))),
        encoder_loss: Some(accepted!(EncoderLossMonitor::accept(4_000, 400))),
        saturation: Some(accepted!(SaturationMonitor::accept(120))),
        ticks: Some(TickMonitor),
    }
}

/// 40 counts of half a gap.
const fn compensated(trigger: Trigger) -> Option<BacklashCompensation> {
    let room = Room {
        velocity: 4 << 32,
        acceleration: 1 << 30,
    };
    Some(accepted!(BacklashCompensation::plan(40, room, trigger)))
}

pub(crate) static MONITORS: Axis = {
    let mut axis = in_service(OF_AXIS);
    axis.monitors = monitored(0);
    axis
};
pub(crate) static COUNTER: Axis = {
    let mut axis = in_service(OF_AXIS);
    axis.counter = COUNTER_16;
    axis
};
pub(crate) static DUAL: Axis = {
    let mut axis = in_service(OF_AXIS);
    axis.feedback = Feedback::Load(CounterParameters::WORD);
    axis
};
pub(crate) static BACKLASH_COMPENSATION: Axis = {
    let mut axis = in_service(OF_AXIS);
    axis.backlash_compensation = compensated(Trigger::Velocity);
    axis
};
pub(crate) static EVERYTHING: Axis = {
    let words = fed_forward(LawWords {
        filter: Some(FILTER_WORDS),
        anti_windup: TRACKING,
        ..OF_AXIS
    });
    let mut axis = axis(words, SLEW_CODES, Quantiser::ErrorFeedback);
    axis.counter = COUNTER_16;
    axis.backlash_compensation = compensated(Trigger::Velocity);
    axis.rest = Rest {
        dead_band: 2,
        hold_integral: true,
    };
    axis.monitors = monitored(18);
    axis
};
