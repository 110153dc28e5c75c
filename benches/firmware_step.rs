//! One tick of the controller: setpoint, error, law, code; and of the axis with
//! more and more switched on.
//!
//! The counts are those of an axis that follows the paper's second move
//! (250 mm in 1 s, 99 900 counts) some way behind, with a ripple of a few
//! counts; they are computed before the clock starts.

#![allow(
    clippy::expect_used,
    reason = "a bench without its axis would measure nothing"
)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use firmware::axis::Monitors;
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::{
    Axis, AxisState, BacklashCompensation, CAPACITY, Controller, ControllerState, Dac, Event,
    GainWord, Inputs, Motion, MotionPlan, PlannedMotion, Room, SetpointTable, Trigger,
};

/// Samples of the move, at 1 ms.
const SAMPLES: i64 = 1_000;

/// Travel of the motor shaft \[counts\].
const TRAVEL: i64 = 99_900;

/// A smooth move in integers: `3s² − 2s³` with `s = k/1000` \[counts\].
fn setpoint(k: i64) -> i64 {
    let k = k.clamp(0, SAMPLES);
    TRAVEL * k * k * (3 * SAMPLES - 2 * k) / (SAMPLES * SAMPLES * SAMPLES)
}

/// `Kp` = 3.2, `Ki·Δt` = 0.005, `Kd/Δt` = 50 codes per count: the paper at 1 ms.
const PAPER: LawWords = LawWords {
    kp: GainWord::new(13_421_773, 22),
    ki_dt: GainWord::new(10_737_418, 31),
    kd_per_dt: GainWord::new(13_107_200, 18),
    ..LawWords::NONE
};

fn firmware_step(criterion: &mut Criterion) {
    let dac = Dac::with_bits(14).expect("14 bits");
    let law = Law::accept(PAPER, dac).expect("the paper's words");
    let setpoints: Vec<i32> = (0..=SAMPLES)
        .map(|k| firmware::counts::wrap(setpoint(k)))
        .collect();
    let setpoints = SetpointTable::<CAPACITY>::from_counts(&setpoints).expect("1001 of them");
    let controller = Controller::new(law, setpoints);

    // 12 ms behind, with a triangle of ±3 counts. 1024 of them so that the
    // index wraps without a division.
    let counts: Vec<i32> = (0..1_024)
        .map(|k| firmware::counts::wrap(setpoint(k - 12) + (k % 13 - 6).abs() - 3))
        .collect();

    criterion.bench_function("firmware/step/paper", |bencher| {
        let mut state = ControllerState::start(&controller);
        let mut k = 0;
        bencher.iter(|| {
            k = (k + 1) & 1_023;
            if k == 0 {
                state = ControllerState::start(&controller);
            }
            controller.tick(&mut state, black_box(counts[k])).code
        });
    });
}

/// The axis: its law, and everything on.
fn axis_step(criterion: &mut Criterion) {
    let dac = Dac::with_bits(14).expect("14 bits");
    let word = |mantissa, fraction_bits| GainWord::new(mantissa, fraction_bits);
    let guarded = LawWords {
        derivative: Derivative::Measurement,
        anti_windup: AntiWindup::Clamp,
        ..PAPER
    };
    let everything = LawWords {
        velocity_ff: word(1 << 14, 32),
        acceleration_ff: word(1 << 14, 32),
        friction_ff: word(1 << 20, 20),
        filter: Some(FilterWords {
            smoothing: 1 << 29,
            fraction_bits: 10,
        }),
        anti_windup: AntiWindup::BackCalculation { tracking: 1 << 27 },
        ..guarded
    };
    let feedback = Quantiser::ErrorFeedback;
    for (name, words, slew, quantiser) in [
        ("axis-off", PAPER, None, Quantiser::Nearest),
        ("axis-guarded", guarded, None, feedback),
        ("axis-everything", everything, Some(500), feedback),
    ] {
        let law = Law::accept(words, dac).expect("words within the ranges");
        let output = Output::new(dac, slew, quantiser).expect("a slew limit");
        let mut axis = Axis::new(law, output);
        let quarter_ps = 250_000_000_000;
        let intervals_ps = [quarter_ps, 0, quarter_ps, 0, quarter_ps, 0, quarter_ps];
        let plan = MotionPlan::new(TRAVEL << 32, intervals_ps, 1_000_000).expect("a motion");
        let planned = PlannedMotion::<256>::new(&plan, &words).expect("room for its stretches");
        if name == "axis-everything" {
            let room = Room {
                velocity: 100 << 32,
                acceleration: 1 << 32,
            };
            let gap = BacklashCompensation::plan(17, room, Trigger::Acceleration);
            axis.backlash_compensation = Some(gap.expect("room for the gap"));
            let following_error = FollowingErrorMonitor::accept(50_000, word(1, 0), 14);
            let encoder_loss = EncoderLossMonitor::accept(8_000, 1_000);
            let saturation = SaturationMonitor::accept(1_000_000);
            axis.monitors = Monitors {
                following_error: Some(following_error.expect("a limit")),
                encoder_loss: Some(encoder_loss.expect("a code and samples")),
                saturation: Some(saturation.expect("samples")),
                ticks: Some(TickMonitor),
            };
        }
        criterion.bench_function(&format!("firmware/step/{name}"), |bencher| {
            let fresh = || {
                let mut state = AxisState::start(&axis);
                // From rest: neither is refused.
                let _ = state.request(Event::Enable);
                let _ = state.request(Event::Start);
                (state, Motion::new(&planned, 0))
            };
            let (mut state, mut source) = fresh();
            let mut tick = 0;
            bencher.iter(|| {
                tick += 1;
                if tick == 1_000 {
                    tick = 0;
                    (state, source) = fresh();
                }
                let behind = setpoint(tick - 12);
                let inputs = Inputs {
                    tick: tick.unsigned_abs(),
                    motor_register: black_box(firmware::counts::wrap(behind)).cast_unsigned(),
                    ..Inputs::default()
                };
                state.tick(&inputs, &mut source).code
            });
        });
    }
}

criterion_group!(benches, firmware_step, axis_step);
criterion_main!(benches);
