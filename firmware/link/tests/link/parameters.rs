//! Parameters over the line: what comes out is what went in.

use firmware::axis::{Axis, Feedback, Monitors, Rest};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::position::CounterParameters;
use firmware::{BacklashCompensation, Dac, GainWord, Room, Settings, Stretch, Trigger};
use firmware_link::settings::{read, write};

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
        let settings = Settings::of(&axis);
        let payload = write(&settings).expect("fits a frame");
        assert_eq!(payload.len(), 4 * Settings::WORDS);
        assert_eq!(read(&payload), Some(settings));
        assert_eq!(settings.check(), Ok(()));
    }
}

/// No byte may be missing or too many.
#[test]
fn what_is_no_axis_is_refused() {
    let mut payload = write(&Settings::of(&axes()[3])).expect("fits a frame");
    for length in 0..payload.len() {
        assert_eq!(read(&payload[..length]), None, "{length} bytes");
    }
    payload.push(0).unwrap();
    assert_eq!(read(&payload), None);
}

/// Each word of a stretch has its own place.
#[test]
fn a_stretch_comes_out_as_it_went_in() {
    let mut words = core::array::from_fn(|place| 0x0102_0304 * (place as i32 + 1));
    words[15] = 0xff01;
    let stretch = Stretch::from_words(&words);
    assert_eq!(stretch.to_words(), words);
    let signs = [stretch.velocity_sign, stretch.acceleration_sign];
    assert_eq!((stretch.samples, signs), (0x0f1e_2d3c, [1, -1]));
}
