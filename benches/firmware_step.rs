//! One tick of the controller: setpoint, error, law, code.
//!
//! The counts are those of an axis that follows the paper's second move
//! (250 mm in 1 s, 99 900 counts) some way behind, with a ripple of a few
//! counts; they are computed before the clock starts.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use firmware::{CAPACITY, Controller, ControllerState, Dac};
use hil_runner::quantise::{quantise, setpoint_table};
use plant::PidGains;

/// Samples of the move, at 1 ms.
const SAMPLES: i64 = 1_000;

/// Travel of the motor shaft \[counts\].
const TRAVEL: i64 = 99_900;

/// A smooth move in integers: `3s² − 2s³` with `s = k/1000` \[counts\].
fn setpoint(k: i64) -> i64 {
    let k = k.clamp(0, SAMPLES);
    TRAVEL * k * k * (3 * SAMPLES - 2 * k) / (SAMPLES * SAMPLES * SAMPLES)
}

fn firmware_step(criterion: &mut Criterion) {
    let gains = PidGains {
        kp: 3.2,
        ki_per_s: 5.0,
        kd_s: 0.05,
    };
    let Ok(quantised) = quantise(&gains, 1_000_000, TRAVEL) else {
        return;
    };
    let Ok(dac) = Dac::with_bits(14) else { return };
    let Ok(setpoints) = setpoint_table::<CAPACITY>((0..=SAMPLES).map(setpoint)) else {
        return;
    };
    let controller = Controller::new(quantised.pid, dac, setpoints);

    // 12 ms behind, with a triangle of ±3 counts. 1024 of them so that the
    // index wraps without a division.
    let counts: Vec<i32> = (0..1_024)
        .map(|k| firmware::counts::wrap(setpoint(k - 12) + (k % 13 - 6).abs() - 3))
        .collect();

    criterion.bench_function("firmware/step/paper", |bencher| {
        let mut state = ControllerState::default();
        let mut k = 0;
        bencher.iter(|| {
            k = (k + 1) & 1_023;
            if k == 0 {
                state = ControllerState::default();
            }
            controller.tick(&mut state, black_box(counts[k])).code
        });
    });
}

criterion_group!(benches, firmware_step);
criterion_main!(benches);
