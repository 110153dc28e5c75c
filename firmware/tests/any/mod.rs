//! Any axis and any sample, for property tests.
#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use firmware::axis::{Feedback, Monitors, Rest};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::{
    Axis, BacklashCompensation, Codes, CounterParameters, Event, GainWord, Inputs, Next, Room,
    Setpoint, Stretch, Trigger,
};
use proptest::option::of;
use proptest::prelude::*;

use crate::rig::dac;

/// Any number, all lengths alike, and the corners.
fn number() -> impl Strategy<Value = i32> {
    let any = (any::<i32>(), 0..32_u32).prop_map(|(number, places)| number >> places);
    let corner = prop_oneof![Just(i32::MIN), Just(i32::MAX), Just(0), Just(-1), Just(1)];
    prop_oneof![4 => any, 1 => corner]
}

fn word(bits: core::ops::RangeInclusive<u8>) -> impl Strategy<Value = GainWord> {
    let mantissa = prop_oneof![3 => 0..=i32::MAX, 2 => 0..=1_000_000, 2 => Just(0)];
    (mantissa, bits).prop_map(|(mantissa, bits)| GainWord::new(mantissa, bits))
}

fn words() -> impl Strategy<Value = LawWords> {
    let integral = (0..=1_i32 << 22, 28..=32_u8).prop_map(|(m, bits)| GainWord::new(m, bits));
    let rate = || (0..=1_i32 << 24, 29..=32_u8).prop_map(|(m, bits)| GainWord::new(m, bits));
    let gains = (word(29..=32), integral, word(18..=32));
    let forward = (rate(), rate(), word(20..=32));
    let ranges = (17..=20_u8, 17..=23_u8);
    let filter = of((1..=i32::MAX, 6..=13_u8));
    let anti_windup = prop_oneof![
        Just(AntiWindup::None),
        Just(AntiWindup::Clamp),
        (1..=i32::MAX).prop_map(|tracking| AntiWindup::BackCalculation { tracking }),
    ];
    let derivative = prop_oneof![Just(Derivative::Error), Just(Derivative::Measurement)];
    (gains, forward, ranges, filter, anti_windup, derivative).prop_map(
        |(gains, forward, ranges, filter, anti_windup, derivative)| LawWords {
            kp: gains.0,
            ki_dt: gains.1,
            kd_per_dt: gains.2,
            velocity_ff: forward.0,
            acceleration_ff: forward.1,
            friction_ff: forward.2,
            error_bits: ranges.0,
            integral_bits: ranges.1,
            derivative,
            filter: filter.map(|(smoothing, fraction_bits)| FilterWords {
                smoothing,
                fraction_bits,
            }),
            anti_windup,
        },
    )
}

/// A law that is accepted: options are left out until it is.
fn law(words: LawWords, bits: u32) -> Law {
    let without_filter = LawWords {
        filter: None,
        ..words
    };
    let none = GainWord::new(0, 0);
    let without_forward = LawWords {
        velocity_ff: none,
        acceleration_ff: none,
        ..without_filter
    };
    let soft = LawWords {
        kp: none,
        kd_per_dt: none,
        ki_dt: none,
        ..without_forward
    };
    let wide = LawWords {
        integral_bits: 20,
        friction_ff: none,
        ..soft
    };
    [words, without_filter, without_forward, soft, wide]
        .into_iter()
        .find_map(|words| Law::accept(words, dac(bits)).ok())
        .expect("a law without gains")
}

fn counter() -> impl Strategy<Value = CounterParameters> {
    (8..=32_u8, of(1..=127_u32)).prop_map(|(bits, jump)| {
        CounterParameters::accept(bits, jump).expect("a jump of every counter")
    })
}

fn backlash_compensation() -> impl Strategy<Value = BacklashCompensation> {
    let trigger = prop_oneof![Just(Trigger::Velocity), Just(Trigger::Acceleration)];
    (0..=1_u32 << 24, 30..=60_u32, trigger).prop_filter_map("too slow", |(gap, room, trigger)| {
        let room = Room {
            velocity: 1 << room,
            acceleration: 1 << room,
        };
        BacklashCompensation::plan(gap, room, trigger).ok()
    })
}

fn monitors() -> impl Strategy<Value = Monitors> {
    let following =
        (1..=0x7FFF_FFFF_u32, word(0..=46), 0..=60_u8).prop_map(|(limit, lag, bits)| {
            FollowingErrorMonitor::accept(limit, lag, bits).expect("a monitor")
        });
    let loss = (1..=0x7F_FFFF_u32, 1..=20_u32)
        .prop_map(|(code, ticks)| EncoderLossMonitor::accept(code, ticks).expect("a monitor"));
    let saturation =
        (0..=20_u32).prop_map(|ticks| SaturationMonitor::accept(ticks).expect("a monitor"));
    (
        of(following),
        of(loss),
        of(saturation),
        of(Just(TickMonitor)),
    )
        .prop_map(
            |(following_error, encoder_loss, saturation, ticks)| Monitors {
                following_error,
                encoder_loss,
                saturation,
                ticks,
            },
        )
}

prop_compose! {
    pub(crate) fn axes()(
        bits in 2..=24_u32,
        words in words(),
        slew in of(1..=1_u32 << 24),
        quantiser in prop_oneof![
            Just(Quantiser::Nearest),
            Just(Quantiser::ErrorFeedback),
            any::<u32>().prop_map(|seed| Quantiser::Dither { seed }),
        ],
        counter in counter(),
        load in of(counter()),
        backlash_compensation in of(backlash_compensation()),
        rest in (prop_oneof![Just(0), 1..=9_u32, any::<u32>()], any::<bool>()),
        monitors in monitors(),
    ) -> Axis {
        let output = Output::new(dac(bits), slew, quantiser).expect("an accepted slew limit");
        let mut axis = Axis::new(law(words, bits), output);
        axis.counter = counter;
        axis.feedback = load.map_or(Feedback::Motor, Feedback::Load);
        axis.backlash_compensation = backlash_compensation;
        axis.rest = Rest { dead_band: rest.0, hold_integral: rest.1 };
        axis.monitors = monitors;
        axis
    }
}

/// One sample of anything.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) request: Option<Event>,
    pub(crate) gains_changed: bool,
    pub(crate) inputs: Inputs,
    pub(crate) next: Next,
}

prop_compose! {
    pub(crate) fn samples()(
        request in prop_oneof![3 => Just(None), 2 => prop::sample::select(&Event::ALL[..]).prop_map(Some)],
        gains_changed in prop::bool::weighted(0.05),
        tick in prop_oneof![8 => Just(1_u64), 1 => any::<u64>()],
        motor in prop_oneof![3 => -20..=20_i32, 1 => number()],
        load in prop_oneof![6 => (-20..=20_i32).prop_map(Some), 1 => number().prop_map(Some), 1 => Just(None)],
        stop in prop::bool::weighted(0.03),
        failed in prop_oneof![30 => Just(0_u32), 1 => any::<u32>()],
        kind in 0..20_u8,
        setpoint in (prop_oneof![-50..=50_i32, number()], number(), number(), of(any::<i64>())),
        stretch in (prop::array::uniform16(number()), 0..20_i32),
    ) -> Sample {
        let setpoint = Setpoint {
            position: setpoint.0,
            velocity: setpoint.1,
            acceleration: setpoint.2,
            ahead: setpoint.3.map(Codes::from_bits),
        };
        let (mut words, samples) = stretch;
        words[14] = samples;
        Sample {
            request,
            gains_changed,
            inputs: Inputs {
                tick,
                motor_register: motor.cast_unsigned(),
                load_register: load.map(i32::cast_unsigned),
                emergency_stop: stop,
                failed_transfers: failed,
            },
            next: match kind {
                0 => Next::Underrun,
                1 => Next::Last(setpoint),
                2 => Next::Stretch(Stretch::from_words(&words)),
                _ => Next::Setpoint(setpoint),
            },
        }
    }
}
