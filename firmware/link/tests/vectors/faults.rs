//! The files of vectors that end in a fault.

use firmware::counts::wrap;
use firmware::{AxisOutput, Next};

use super::record::Recorder;
use super::scenarios::{PAPER, TRAVEL, step, travel};

/// One file a cause: into it from a move, latched, reset, and on.
pub(crate) fn all() -> Vec<(&'static str, String)> {
    type Cause = fn(&mut Recorder, Next, i64) -> AxisOutput;
    let causes: [(&str, &str, Cause); 8] = [
        ("fault-emergency-stop", "", |file, next, _| {
            file.row("-", next, |inputs| inputs.emergency_stop = true)
        }),
        ("fault-hardware-bus", "", |file, next, _| {
            file.row("-", next, |inputs| inputs.failed_transfers = 4)
        }),
        ("fault-missed-tick", "ticks = 1", |file, next, _| {
            file.row("-", next, |inputs| inputs.tick += 3)
        }),
        (
            "fault-encoder-glitch",
            "counter = 32 50",
            |file, next, _| file.row("-", next, |inputs| inputs.motor_register ^= 1 << 9),
        ),
        (
            "fault-encoder-loss",
            "encoder_loss = 60 4",
            |file, next, stuck| {
                file.row("-", next, |inputs| {
                    inputs.motor_register = wrap(stuck).cast_unsigned()
                })
            },
        ),
        ("fault-setpoint-underrun", "", |file, _, _| {
            file.row("-", Next::Underrun, |_| {})
        }),
        (
            "fault-following-error",
            "following_error = 30 5 1 16",
            |file, next, stuck| {
                file.row("-", next, |inputs| {
                    inputs.motor_register = wrap(stuck).cast_unsigned()
                })
            },
        ),
        (
            "fault-saturation-too-long",
            "saturation = 3",
            |file, _, _| file.row("-", step(-9_000), |_| {}),
        ),
    ];
    let file = |(name, settings, cause): (&'static str, &str, Cause)| {
        let mut file = Recorder::about(&format!(
            "{name}: in the middle of a move; a stop later changes nothing; reset, and on.",
        ));
        file.set(PAPER);
        file.set(settings);
        for k in 0..50 {
            file.row(if k == 0 { "ES" } else { "-" }, travel(0, 1, k), |_| {});
        }
        let stuck = i64::from(file.motor.counts());
        let mut k = 50;
        // Until it is latched; the axis is off then and stays off.
        while cause(&mut file, travel(0, 1, k), stuck).power {
            k += 1;
            assert!(k < TRAVEL, "{name} does not come about");
        }
        for _ in 0..3 {
            file.row("-", Next::Underrun, |inputs| inputs.emergency_stop = true);
        }
        file.row("-", Next::Underrun, |_| {});
        file.row("R", Next::Underrun, |_| {});
        file.row("E", Next::Underrun, |_| {});
        let here = i64::from(file.motor.counts());
        for k in 0..30 {
            file.row(if k == 0 { "S" } else { "-" }, travel(here, -1, k), |_| {});
        }
        (name, file.into_text())
    };
    causes.into_iter().map(file).collect()
}
