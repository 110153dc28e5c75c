//! Scenarios of the files of vectors, one function a file.

use firmware::counts::wrap;
use firmware::law::LawWords;
use firmware::{Codes, GainWord, MotionPlan, Next, Setpoint};

use super::record::Recorder;
use super::{corners, faults};
use crate::rig::Motor;

/// The paper's gains at 1 ms.
pub(super) const PAPER: &str = "dac_bits = 14
    kp = 1717986918 29
    ki_dt = 21474836 32
    kd_per_dt = 13107200 18
    error_bits = 18";

/// Every file: its name and its text.
pub(crate) fn all() -> Vec<(&'static str, String)> {
    let mut files = vec![
        ("paper", paper()),
        ("derivative-filter", derivative_filter()),
        (
            "clamp",
            wind_up("The integral is refused beyond the limit.", "clamp"),
        ),
        (
            "back-calculation",
            wind_up(
                "The integral is drawn back from the limit.",
                "back-calculation 107374182",
            ),
        ),
        (
            "error-feedback",
            quantiser(
                "What rounding cuts off goes to the next sample.",
                "error-feedback",
            ),
        ),
        (
            "dither",
            quantiser("Random rounding from a seed.", "dither 20260"),
        ),
        ("slew", slew()),
        ("feed-forward", feed_forward()),
        ("dead-band", dead_band()),
        ("dual-loop", dual_loop()),
        (
            "backlash-compensation-velocity",
            backlash_compensation("velocity"),
        ),
        (
            "backlash-compensation-acceleration",
            backlash_compensation("acceleration"),
        ),
        ("wrap-16", wrap_16()),
        ("wrap-32", wrap_32()),
        ("gains-change", gains_change()),
        ("stretches", stretches()),
        ("ahead", ahead()),
    ];
    files.extend(faults::all());
    files.extend(corners::all());
    files
}

const UNIT: i64 = 1 << 16;
/// Samples of a [`travel`].
pub(super) const TRAVEL: i64 = 120;

/// Setpoint `k` of a move by 800 counts: 40 samples at ¼ count/sample², 40 at
/// 10 counts/sample, and 40 to the end; in 2^−16 counts.
pub(super) fn travel(from: i64, direction: i64, k: i64) -> Next {
    let a = UNIT / 4;
    let (mut x, mut v, mut rate) = (from * UNIT, 0, 0);
    for sample in 1..=k {
        rate = match sample {
            1..=40 => a * direction,
            81..=120 => -a * direction,
            _ => 0,
        };
        x += v + rate / 2;
        v += rate;
    }
    let number = |value: i64| i32::try_from(value).expect("a slow motion");
    let setpoint = Setpoint {
        position: wrap(x >> 16),
        velocity: number(v),
        acceleration: number(rate),
        ahead: None,
    };
    if k < TRAVEL {
        Next::Setpoint(setpoint)
    } else {
        Next::Last(setpoint)
    }
}

/// A setpoint without speed.
pub(super) fn step(position: i32) -> Next {
    Next::Setpoint(Setpoint {
        position,
        ..Setpoint::default()
    })
}

/// A move and some samples of rest; the axis is enabled or holding before.
fn go(file: &mut Recorder, requests: &str, from: i64, direction: i64, rest: i64) {
    for k in 0..=TRAVEL {
        let requests = if k == 0 { requests } else { "-" };
        file.row(requests, travel(from, direction, k), |_| {});
    }
    for _ in 0..rest {
        file.row("-", Next::Underrun, |_| {});
    }
}

fn paper() -> String {
    let mut file = Recorder::about(
        "The paper's law with every option off, started in the sample before the first:
        a move, rest, and a step back that drives the output to its limit.",
    );
    file.set(PAPER);
    go(&mut file, "ES", 0, 1, 40);
    for sample in 0..80 {
        file.row(if sample == 0 { "S" } else { "-" }, step(-2_500), |_| {});
    }
    file.into_text()
}

fn derivative_filter() -> String {
    let mut file = Recorder::about(
        "The derivative of the measurement, filtered with a = 1/4: a move and a step.",
    );
    file.set(PAPER);
    file.set("derivative = measurement\nfilter = 536870912 12");
    go(&mut file, "ES", 0, 1, 10);
    for sample in 0..60 {
        file.row(if sample == 0 { "S" } else { "-" }, step(700), |_| {});
    }
    file.into_text()
}

fn wind_up(about: &str, anti_windup: &str) -> String {
    let mut file = Recorder::about(&format!(
        "{about} A step to 6000 counts and back.
        Before it the motor is blocked and the integral comes to the limit on its own."
    ));
    file.set(PAPER);
    file.set(&format!("anti_windup = {anti_windup}"));
    for sample in 0..30 {
        let requests = if sample == 0 { "ES" } else { "-" };
        file.row(requests, step(2_500), |_| {});
        file.motor = Motor::at(0);
    }
    for sample in 0..180 {
        file.row("-", step(if sample < 100 { 6_000 } else { 0 }), |_| {});
    }
    file.into_text()
}

fn quantiser(about: &str, quantiser: &str) -> String {
    let mut file = Recorder::about(&format!("{about} A move and the rest after it."));
    file.set(PAPER);
    file.set(&format!("quantiser = {quantiser}"));
    go(&mut file, "ES", 0, 1, 80);
    file.into_text()
}

fn slew() -> String {
    let mut file = Recorder::about(
        "Codes change by at most 12 a sample. A move that is switched off on its way: the code
        runs down, the power goes with its end. The second time the axis is enabled before.",
    );
    file.set(PAPER);
    file.set("slew_codes = 12");
    for k in 0..60 {
        file.row(if k == 0 { "ES" } else { "-" }, travel(0, 1, k), |_| {});
    }
    for sample in 0..40 {
        file.row(if sample == 0 { "D" } else { "-" }, Next::Underrun, |_| {});
    }
    let here = i64::from(file.motor.counts());
    for k in 0..60 {
        file.row(if k == 0 { "ES" } else { "-" }, travel(here, -1, k), |_| {});
    }
    for sample in 0..60 {
        let requests = match sample {
            0 => "D",
            4 => "E",
            _ => "-",
        };
        file.row(requests, Next::Underrun, |_| {});
    }
    file.into_text()
}

fn feed_forward() -> String {
    let mut file =
        Recorder::about("Feed-forward of velocity, acceleration and friction: there and back.");
    file.set(
        "dac_bits = 14
        kp = 1717986918 29
        ki_dt = 21474836 32
        kd_per_dt = 13107200 18
        velocity_ff = 1638400 32
        acceleration_ff = 32768000 32
        friction_ff = 20971520 20
        error_bits = 18",
    );
    go(&mut file, "ES", 0, 1, 10);
    go(&mut file, "S", 800, -1, 10);
    file.into_text()
}

fn dead_band() -> String {
    let mut file = Recorder::about(
        "Errors up to 12 counts are 0 while the axis stands: a move and the rest after it.",
    );
    file.set(PAPER);
    file.set("dead_band = 12");
    go(&mut file, "ES", 0, 1, 120);
    file.into_text()
}

/// A load at half the motor's counts behind a gap of 3 load counts either way.
struct Load(i64);

impl Load {
    fn follow(&mut self, motor: i32) -> u32 {
        let pushed = i64::from(motor) / 2;
        self.0 = self.0.clamp(pushed - 3, pushed + 3);
        u32::try_from(self.0 & 0xFFF).expect("12 bits")
    }
}

fn dual_loop() -> String {
    let mut file = Recorder::about(
        "Position from the load's counter of 12 bits, damping from the motor's: there and back.
        The setpoint, the position and the error are load counts.",
    );
    file.set(PAPER);
    file.set("derivative = measurement\nload_counter = 12 -");
    let mut load = Load(0);
    for (start, direction) in [(0, 1), (800, -1)] {
        for k in 0..=TRAVEL {
            let requests = match (k, direction) {
                (0, 1) => "ES",
                (0, _) => "S",
                _ => "-",
            };
            let register = load.follow(file.motor.counts());
            file.row(requests, travel(start, direction, k), |inputs| {
                inputs.load_register = Some(register);
            });
        }
    }
    file.into_text()
}

fn backlash_compensation(trigger: &str) -> String {
    let mut file = Recorder::about(&format!(
        "Half a gap of 20 motor counts is taken up by the sign of the {trigger}: there and back.",
    ));
    file.set(PAPER);
    file.set(&format!(
        "backlash_compensation = 20 17179869184 1073741824 {trigger}"
    ));
    go(&mut file, "ES", 0, 1, 10);
    go(&mut file, "S", 800, -1, 30);
    file.into_text()
}

fn wrap_16() -> String {
    let mut file = Recorder::about(
        "A counter of 16 bits that starts at 65 400, which is position -136: across its end.",
    );
    file.set(PAPER);
    file.set("counter = 16 400");
    file.motor = Motor::at(65_400);
    for k in 0..TRAVEL + 20 {
        let next = if k <= TRAVEL {
            travel(-136, 1, k)
        } else {
            Next::Underrun
        };
        file.row(if k == 0 { "ES" } else { "-" }, next, |inputs| {
            inputs.motor_register &= 0xFFFF
        });
    }
    file.into_text()
}

fn wrap_32() -> String {
    let mut file = Recorder::about(
        "From 200 counts before 2^31 across the end of all 32 bits; enabled a sample before.",
    );
    file.set(PAPER);
    let start = (1 << 31) - 200;
    file.motor = Motor::at(start);
    file.row("-", Next::Underrun, |_| {});
    file.row("E", Next::Underrun, |_| {});
    go(&mut file, "S", start, 1, 20);
    file.into_text()
}

fn gains_change() -> String {
    let mut file = Recorder::about(
        "Other gains on the way, others again with a filter, and others with the same filter:
        the code goes on from where it stands. Settings between rows hold from the next row on.",
    );
    file.set(PAPER);
    for k in 0..=TRAVEL {
        match k {
            30 => file.set(
                "kp = 1717986918 30
                ki_dt = 10737418 32
                kd_per_dt = 26214400 18",
            ),
            70 => {
                file.set("kp = 1932735283 29\nfilter = 1073741824 12\nquantiser = error-feedback")
            }
            100 => file.set("kp = 1503238553 29"),
            _ => {}
        }
        file.row(if k == 0 { "ES" } else { "-" }, travel(0, 1, k), |_| {});
    }
    for _ in 0..30 {
        file.row("-", Next::Underrun, |_| {});
    }
    file.into_text()
}

/// A planned move in 122 samples by its stretches, and 20 samples of rest.
fn run_planned(file: &mut Recorder, requests: &str, from: i32, counts: i64) {
    let intervals_ps = [28, 0, 30, 8, 24, 6, 24].map(|ms| ms * 1_000_000_000);
    let plan = MotionPlan::new(counts << 32, intervals_ps, 1_000_000).expect("a slow motion");
    // 25 codes per count and sample, 500 per count and sample², 20 of friction.
    let gain = |codes: i32, bits| GainWord::new(codes << (32 - bits), 32);
    let words = LawWords {
        velocity_ff: gain(25, plan.head().velocity_fraction_bits),
        acceleration_ff: gain(500, plan.head().acceleration_fraction_bits),
        friction_ff: GainWord::new(20, 0),
        ..LawWords::NONE
    };
    let stretches = plan.stretches(&words, from);
    // The source is asked at the first sample of each.
    let asked = stretches.flat_map(|stretch| {
        let others = (1..stretch.samples).map(|_| Next::Underrun);
        core::iter::once(Next::Stretch(stretch)).chain(others)
    });
    let end = Next::Last(Setpoint {
        position: from.wrapping_add(plan.head().end),
        ..Setpoint::default()
    });
    let rest = [Next::Underrun; 20];
    for (k, next) in asked.chain([end]).chain(rest).enumerate() {
        file.row(if k == 0 { requests } else { "-" }, next, |inputs| {
            inputs.motor_register &= 0xFFFF
        });
    }
}

fn stretches() -> String {
    let mut file = Recorder::about(
        "Planned moves as stretches with their feed-forward, across the end of a counter of 16
        bits, with half a gap of 20 counts taken up: there and back. The source is asked at the
        first sample of each stretch.",
    );
    file.set(PAPER);
    file.set(
        "counter = 16 400
        backlash_compensation = 20 17179869184 1073741824 velocity",
    );
    file.motor = Motor::at(65_400);
    run_planned(&mut file, "ES", -136, 800);
    run_planned(&mut file, "S", 664, -800);
    file.into_text()
}

fn ahead() -> String {
    let mut file = Recorder::about(
        "Feed-forward that comes with the setpoints, in fractions of codes and twice beyond what
        the words declare, and that of the words in every fourth sample.",
    );
    file.set(PAPER);
    file.set("velocity_ff = 1638400 32\nfriction_ff = 20971520 20");
    for k in 0..=TRAVEL {
        let next = match travel(0, 1, k) {
            Next::Setpoint(setpoint) if k % 4 != 0 => Next::Setpoint(Setpoint {
                // 25 codes per count and sample, and a disturbance.
                ahead: Some(Codes::from_bits(match k {
                    50..54 => i64::MAX,
                    90..94 => i64::MIN,
                    _ => ((i64::from(setpoint.velocity) * 25) << 16) + 1_234_567_891 * (k % 7),
                })),
                ..setpoint
            }),
            next => next,
        };
        file.row(if k == 0 { "ES" } else { "-" }, next, |_| {});
    }
    for _ in 0..20 {
        file.row("-", Next::Underrun, |_| {});
    }
    file.into_text()
}
