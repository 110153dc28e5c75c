//! Parameters over the line: what comes out is what went in.

use firmware::axis::{Axis, Feedback, Monitors, Rest};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::position::CounterParameters;
use firmware::{BacklashCompensation, Dac, GainWord, MotionPlan, MotionState, Next, Room, Trigger};
use firmware_link::plan::{parts as plan_parts, take_part};
use firmware_link::settings::{read_axis, read_law, write_axis, write_law};

fn word(mantissa: i32, fraction_bits: u8) -> GainWord {
    GainWord::new(mantissa, fraction_bits)
}

fn paper() -> LawWords {
    LawWords {
        kp: word(1_717_986_918, 29),
        ki_dt: word(21_474_836, 32),
        kd_per_dt: word(1_677_721_600, 25),
        error_bits: 18,
        ..LawWords::NONE
    }
}

/// Axes that differ in everything that an axis has.
pub(crate) fn axes() -> Vec<Axis> {
    let dac = Dac::with_bits(14).unwrap();
    let plain = |quantiser, slew| {
        let law = Law::accept(paper(), dac).unwrap();
        Axis::new(law, Output::new(dac, slew, quantiser).unwrap())
    };
    let everything = LawWords {
        kd_per_dt: word(209_715_200, 22),
        velocity_ff: word(1_638_400, 32),
        acceleration_ff: word(32_768_000, 32),
        friction_ff: word(20_971_520, 20),
        derivative: Derivative::Measurement,
        filter: Some(FilterWords {
            smoothing: 1 << 29,
            fraction_bits: 10,
        }),
        anti_windup: AntiWindup::BackCalculation { tracking: 1 << 27 },
        ..paper()
    };
    let law = Law::accept(everything, dac).unwrap();
    let output = Output::new(dac, Some(40), Quantiser::ErrorFeedback).unwrap();
    let mut full = Axis::new(law, output);
    full.counter = CounterParameters::accept(16, Some(900)).unwrap();
    full.feedback = Feedback::Load(CounterParameters::accept(24, None).unwrap());
    let room = Room {
        velocity: 2 << 32,
        acceleration: 1 << 31,
    };
    full.backlash_compensation =
        Some(BacklashCompensation::plan(40, room, Trigger::Acceleration).unwrap());
    full.rest = Rest {
        dead_band: 3,
        hold_integral: true,
    };
    full.monitors = Monitors {
        following_error: Some(
            FollowingErrorMonitor::accept(200, word(10_485_760, 20), 18).unwrap(),
        ),
        encoder_loss: Some(EncoderLossMonitor::accept(300, 20).unwrap()),
        saturation: Some(SaturationMonitor::accept(0).unwrap()),
        ticks: Some(TickMonitor),
    };
    let clamped = LawWords {
        anti_windup: AntiWindup::Clamp,
        ..paper()
    };
    let mut other = full;
    other.set_law(Law::accept(clamped, Dac::with_bits(24).unwrap()).unwrap());
    other.backlash_compensation =
        Some(BacklashCompensation::plan(7, room, Trigger::Velocity).unwrap());
    vec![
        plain(Quantiser::Nearest, None),
        plain(Quantiser::ErrorFeedback, Some(1)),
        plain(Quantiser::Dither { seed: 0xdead_beef }, Some(1 << 23)),
        full,
        other,
    ]
}

#[test]
fn an_axis_comes_out_as_it_went_in() {
    for axis in axes() {
        let payload = write_axis(&axis).expect("fits a frame");
        assert_eq!(read_axis(&payload), Some(axis));
        let law = write_law(axis.law()).expect("fits a frame");
        assert_eq!(read_law(&law), Some(*axis.law()));
    }
}

/// No byte may be missing or too many, and words that the firmware would not
/// accept do not become an axis by coming over a line.
#[test]
fn what_is_no_axis_is_refused() {
    let axis = axes().remove(3);
    let payload = write_axis(&axis).expect("fits a frame");
    for length in 0..payload.len() {
        assert_eq!(read_axis(&payload[..length]), None, "{length} bytes");
    }
    let mut longer = payload.clone();
    longer.push(0).unwrap();
    assert_eq!(read_axis(&longer), None);
    // The upper byte of Kp's mantissa: a negative gain.
    let mut negative = payload.clone();
    negative[7] |= 0x80;
    assert_eq!(read_axis(&negative), None);
}

#[test]
fn a_plan_runs_alike_wherever_it_was_planned() {
    let intervals_ps = [
        100_000_000_000,
        50_000_000_000,
        80_000_000_000,
        30_000_000_000,
        70_000_000_000,
        0,
        120_000_000_000,
    ];
    let plan = MotionPlan::new(-(54_321 << 32) + 77, intervals_ps, 1_000_000).unwrap();
    let mut other = MotionPlan::default();
    for part in plan_parts(&plan) {
        take_part(&mut other, &part).expect("a part of a plan");
    }
    assert_eq!(other, plan);
    let (mut here, mut there) = (MotionState::default(), MotionState::default());
    for _ in 0..460 {
        assert_eq!(plan.next(&mut here), other.next(&mut there));
    }
    assert!(matches!(plan.next(&mut here), Next::Last(_)));
    // A part too many, and one that is none.
    let part = plan_parts(&plan).nth(1).unwrap();
    take_part(&mut other, &part).expect("seven pieces have room");
    assert_eq!(take_part(&mut other, &part), None);
    assert_eq!(take_part(&mut other, &part[1..]), None);
}
