//! Files that go where a campaign of flipped bits found that no other row does
//! (`hil-runner certify --flips`).

use firmware::counts::wrap;
use firmware::{Next, Setpoint};

use super::record::Recorder;
use super::scenarios::{PAPER, TRAVEL, step, travel};
use crate::rig::Motor;

pub(crate) fn all() -> Vec<(&'static str, String)> {
    vec![
        ("measurement-gains-change", measurement_gains_change()),
        ("feed-forward-gains-change", feed_forward_gains_change()),
        ("hold-integral", hold_integral()),
        ("lag", lag()),
        ("late-tick", late_tick()),
        ("load-counter", load_counter()),
        ("out-of-range", out_of_range()),
        ("large-derivative", large_derivative()),
        ("slew-at-the-end", slew_at_the_end()),
        ("negative-loss", negative_loss()),
    ]
}

fn file_of(about: &str, settings: &str) -> Recorder {
    let mut file = Recorder::about(about);
    file.set(PAPER);
    file.set(settings);
    file
}

/// A setpoint of a source that uses all bits of its rates.
fn odd(next: Next) -> Next {
    let odd = |setpoint: Setpoint| Setpoint {
        velocity: setpoint.velocity + 77,
        acceleration: setpoint.acceleration + 4_321,
        ..setpoint
    };
    match next {
        Next::Setpoint(setpoint) => Next::Setpoint(odd(setpoint)),
        next => next,
    }
}

fn measurement_gains_change() -> String {
    let mut file = file_of(
        "Derivative of the measurement: disabled and enabled while the motor turns, other
        gains and a filter on the way.",
        "derivative = measurement",
    );
    for k in 0..=TRAVEL {
        match k {
            60 => file.set("kp = 1717986918 30\nkd_per_dt = 26214400 18"),
            85 => file.set("filter = 1073741824 12"),
            _ => {}
        }
        let requests = match k {
            0 => "ES",
            30 => "D",
            33 => "ES",
            _ => "-",
        };
        file.row(requests, travel(0, 1, k), |_| {});
    }
    file.into_text()
}

fn feed_forward_gains_change() -> String {
    let mut file = file_of(
        "Feed-forward whose words and rates use all their bits; other gains in mid-move, and
        a way back.",
        "velocity_ff = 163841 32
        acceleration_ff = 132768001 32
        friction_ff = 20971520 20",
    );
    for (from, direction) in [(0, 1), (800, -1)] {
        for k in 0..=TRAVEL {
            match (direction, k) {
                (1, 60) => file.set("kp = 1717986918 30"),
                (-1, 60) => file.set("kp = 1717986918 29"),
                _ => {}
            }
            let requests = match (direction, k) {
                (1, 0) => "ES",
                (_, 0) => "S",
                _ => "-",
            };
            file.row(requests, odd(travel(from, direction, k)), |_| {});
        }
    }
    file.into_text()
}

fn hold_integral() -> String {
    let mut file = file_of("The integral is held at rest.", "hold_integral = 1");
    for k in 0..=TRAVEL {
        let requests = if k == 0 { "ES" } else { "-" };
        file.row(requests, travel(0, 1, k), |_| {});
    }
    for _ in 0..60 {
        file.row("-", Next::Underrun, |_| {});
    }
    file.into_text()
}

fn lag() -> String {
    let mut file = file_of(
        "A lag whose product with the speed has more than 32 bits.",
        "following_error = 30 1500000000 34 16",
    );
    for k in 0..80 {
        let requests = if k == 0 { "ES" } else { "-" };
        // Behind by ever more from here on.
        file.row(requests, travel(0, 1, k), |inputs| {
            if k >= 30 {
                inputs.motor_register = 60;
            }
        });
    }
    file.into_text()
}

fn late_tick() -> String {
    let mut file = file_of("Samples across the 2^32th, and a late one.", "ticks = 1");
    file.tick = (1 << 32) - 20;
    for k in 0..80 {
        let requests = if k == 0 { "ES" } else { "-" };
        file.row(requests, travel(0, 1, k), |inputs| {
            if k == 40 {
                inputs.tick += 1 << 33;
            }
        });
    }
    file.into_text()
}

fn load_counter() -> String {
    let mut file = file_of(
        "A counter of 12 bits at the load that starts below 0, wraps, and jumps.",
        "derivative = measurement\nload_counter = 12 60",
    );
    file.motor = Motor::at(-300);
    for k in 0..=TRAVEL {
        let requests = if k == 0 { "ES" } else { "-" };
        // Half a load count a motor count.
        let load = file.motor.counts() / 2 + if k == 100 { 300 } else { 0 };
        file.row(requests, travel(-150, 1, k), |inputs| {
            inputs.load_register = Some(wrap(load.into()).cast_unsigned() & 0xfff);
        });
    }
    file.into_text()
}

fn out_of_range() -> String {
    let mut file = Recorder::about(
        "Errors beyond 2^17 counts, in the first sample and later, either way, and within.",
    );
    file.set(
        "dac_bits = 14
        kp = 13421772 29
        ki_dt = 167772 32
        kd_per_dt = 102400 18
        error_bits = 17
        integral_bits = 12",
    );
    for k in 0..80 {
        let requests = if k == 0 { "ES" } else { "-" };
        let sign = if k / 15 % 2 == 0 { 1 } else { -1 };
        let size = if k < 60 { 300_000 } else { 3_000 };
        file.row(requests, step(size * sign), |_| {});
    }
    file.into_text()
}

fn large_derivative() -> String {
    let mut file = Recorder::about(
        "A derivative so large that a count is worth all the range, and steps far beyond it.",
    );
    file.set(
        "dac_bits = 14
        kp = 1717986918 29
        ki_dt = 21474836 32
        kd_per_dt = 2000000000 16
        error_bits = 18",
    );
    for k in 0..80 {
        let requests = if k == 0 { "ES" } else { "-" };
        let position = if k % 9 < 3 { 3 } else { -100_000 };
        file.row(requests, step(position), |_| {});
    }
    file.into_text()
}

fn slew_at_the_end() -> String {
    let mut file = file_of(
        "A slew limit that meets the converter's end, on either side, against wind-up.",
        "slew_codes = 700\nanti_windup = clamp",
    );
    for k in 0..100 {
        let requests = if k == 0 { "ES" } else { "-" };
        let position = if k < 50 { 9_000 } else { -9_000 };
        file.row(requests, step(position), |_| {});
    }
    file.into_text()
}

fn negative_loss() -> String {
    let mut file = file_of(
        "A lost encoder under codes below 0; reset, and on.",
        "encoder_loss = 60 4",
    );
    for k in 0..90 {
        let requests = match k {
            0 => "ES",
            50 => "R",
            55 => "ES",
            _ => "-",
        };
        let stuck = (30..50).contains(&k);
        file.row(requests, travel(0, -1, k), |inputs| {
            if stuck {
                inputs.motor_register = wrap(-150).cast_unsigned();
            }
        });
    }
    file.into_text()
}
