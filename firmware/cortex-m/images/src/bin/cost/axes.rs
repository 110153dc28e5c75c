//! The axes that are measured, as constants: what is off costs nothing.

use firmware::axis::{Axis, Feedback, Rest, Watches};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::watch::{EncoderLossWatch, FollowingErrorWatch, SaturationWatch, TickWatch};
use firmware::{CounterParameters, Dac, GainWord, Room, TakeUp, Trigger};

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

const OF_PRODUCT: LawWords = LawWords {
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
        velocity_ff: GainWord::new(5_000, 38),
        acceleration_ff: GainWord::new(20_000, 38),
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

const fn product(words: LawWords) -> Axis {
    axis(words, None, Quantiser::ErrorFeedback)
}

pub(crate) static PLAIN: Axis = axis(WORDS, None, Quantiser::Nearest);
pub(crate) static CLAMP: Axis = axis(WITH_CLAMP, None, Quantiser::Nearest);
pub(crate) static MEASUREMENT: Axis = axis(OF_PRODUCT, None, Quantiser::Nearest);
pub(crate) static PRODUCT: Axis = product(OF_PRODUCT);
pub(crate) static BACK_CALCULATION: Axis = product(LawWords {
    anti_windup: TRACKING,
    ..OF_PRODUCT
});
pub(crate) static FILTER: Axis = product(LawWords {
    filter: Some(FILTER_WORDS),
    ..OF_PRODUCT
});
pub(crate) static FEED_FORWARD: Axis = product(fed_forward(OF_PRODUCT));
pub(crate) static SLEW: Axis = axis(OF_PRODUCT, SLEW_CODES, Quantiser::ErrorFeedback);
pub(crate) static DITHER: Axis = axis(OF_PRODUCT, None, Quantiser::Dither { seed: 1 });
pub(crate) static LONG_WORDS: Axis = product(LawWords {
    kp: GainWord::new(1_717_986_918, 29),
    ki_dt: GainWord::new(1_374_389_535, 38),
    kd_per_dt: GainWord::new(1_677_721_600, 25),
    ..OF_PRODUCT
});

/// A counter of 16 bits whose glitches are found.
const COUNTER_16: CounterParameters = accepted!(CounterParameters::accept(16, Some(3_000)));

/// Each of them trips in the sequence, but for the missed tick.
const fn watched(velocity_fraction_bits: u8) -> Watches {
    Watches {
        following_error: Some(accepted!(FollowingErrorWatch::accept(
            30_000,
            GainWord::new(5, 1),
            velocity_fraction_bits,
        ))),
        encoder_loss: Some(accepted!(EncoderLossWatch::accept(4_000, 400))),
        saturation: Some(accepted!(SaturationWatch::accept(120))),
        ticks: Some(TickWatch),
    }
}

/// 40 counts of half a gap.
const fn taken_up(trigger: Trigger) -> Option<TakeUp> {
    let room = Room {
        velocity: 4 << 32,
        acceleration: 1 << 30,
    };
    Some(accepted!(TakeUp::plan(40, room, trigger)))
}

pub(crate) static WATCHES: Axis = {
    let mut axis = product(OF_PRODUCT);
    axis.watches = watched(0);
    axis
};
pub(crate) static COUNTER: Axis = {
    let mut axis = product(OF_PRODUCT);
    axis.counter = COUNTER_16;
    axis
};
pub(crate) static DUAL: Axis = {
    let mut axis = product(OF_PRODUCT);
    axis.feedback = Feedback::Load(CounterParameters::WORD);
    axis
};
pub(crate) static TAKE_UP: Axis = {
    let mut axis = product(OF_PRODUCT);
    axis.take_up = taken_up(Trigger::Velocity);
    axis
};
pub(crate) static EVERYTHING: Axis = {
    let words = fed_forward(LawWords {
        filter: Some(FILTER_WORDS),
        anti_windup: TRACKING,
        ..OF_PRODUCT
    });
    let mut axis = axis(words, SLEW_CODES, Quantiser::ErrorFeedback);
    axis.counter = COUNTER_16;
    axis.take_up = taken_up(Trigger::Velocity);
    axis.rest = Rest {
        dead_band: 2,
        hold_integral: true,
    };
    axis.watches = watched(18);
    axis
};
