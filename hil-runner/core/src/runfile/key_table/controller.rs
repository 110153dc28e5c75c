//! Keys of the controller: its encoders, its law, backlash, other gains.

use super::super::keys::Range::{NotNegative, Positive};
use super::super::keys::{Acts, DefaultValue, Key, Kind, Need, number, of_firmware, time, value};
use crate::case::Law;

/// The word for a delay that the chip's steps make.
const MEASURED: &str = "measured";

/// Keys beyond the paper's law among those that every rung has.
const FIRMWARE: Acts = Acts::From(Law::Firmware);

pub(super) const ENCODER: &[Key] = &[
    number(
        "counts_per_rad",
        Positive,
        "counts/rad",
        "encoder resolution K_enc",
    )
    .needed(Need::OneOf("lines")),
    value(
        "lines",
        Kind::Whole(1, 1_000_000_000),
        "",
        "number N of encoder lines per revolution",
    )
    .needed(Need::OneOf("counts_per_rad")),
    value(
        "counter_bits",
        Kind::Whole(8, 32),
        "bits",
        "width of the motor's counter, and of the load's where it closes the loop,",
    )
    .or(DefaultValue::Whole(32))
    .acting(FIRMWARE),
];

pub(super) const LOAD_ENCODER: &[Key] = &of_firmware([
    number(
        "counts_per_rad",
        Positive,
        "counts/rad",
        "resolution of an encoder on the screw",
    )
    .needed(Need::NotWith("counts_per_mm")),
    number(
        "counts_per_mm",
        Positive,
        "counts/mm",
        "resolution of a scale at the carriage",
    )
    .needed(Need::NotWith("counts_per_rad")),
]);

pub(super) const CONTROLLER: &[Key] = &[
    value(
        "law",
        Kind::Choice(&["continuous", "sampled", "quantised", "firmware"]),
        "",
        "control law",
    ),
    number("kp", NotNegative, "codes/count", "proportional gain K_p"),
    number(
        "ki_per_s",
        NotNegative,
        "codes/(count s)",
        "integral gain K_i",
    ),
    number("kd_s", NotNegative, "codes s/count", "derivative gain K_d"),
    time("sample_time_s", Positive, "sample time Δt")
        .needed(Need::SampledLaw)
        .acting(Acts::From(Law::Sampled)),
    value(
        "computation_delay_s",
        Kind::TimeOrWord(NotNegative, MEASURED),
        "s",
        "delay from sample to new voltage",
    )
    .or(DefaultValue::Nanoseconds(0))
    .acting(Acts::From(Law::Sampled)),
    value(
        "derivative",
        Kind::Choice(&["error", "measurement"]),
        "",
        "quantity of which the derivative is taken",
    )
    .or(DefaultValue::Choice("error"))
    .acting(FIRMWARE),
    number(
        "derivative_filter_s",
        NotNegative,
        "s",
        "time constant of the derivative's first-order filter (0: none)",
    )
    .or(DefaultValue::Number(0.0))
    .acting(FIRMWARE),
    value(
        "anti_windup",
        Kind::Choice(&["none", "clamp", "back-calculation"]),
        "",
        "treatment of integrator wind-up",
    )
    .or(DefaultValue::Choice("none"))
    .acting(FIRMWARE),
    number(
        "tracking_time_s",
        Positive,
        "s",
        "time constant of anti_windup \"back-calculation\"",
    )
    .or(DefaultValue::Number(0.01))
    .acting(FIRMWARE),
    value(
        "word_bits",
        Kind::Whole(8, 31),
        "bits",
        "width of the mantissas of the gains' words",
    )
    .or(DefaultValue::Whole(31))
    .acting(FIRMWARE),
    value(
        "gain_fraction_bits",
        Kind::Whole(0, 40),
        "bits",
        "fraction bits that the gains per sample are rounded to before they become words; \
         without it as many as their words hold,",
    )
    .needed(Need::Optional)
    .acting(FIRMWARE),
    value(
        "quantiser",
        Kind::Choice(&["nearest", "error-feedback", "dither"]),
        "",
        "way from the law's output to a whole code",
    )
    .or(DefaultValue::Choice("nearest"))
    .acting(FIRMWARE),
    value(
        "dither_seed",
        Kind::Whole(0, 4_294_967_295),
        "",
        "seed of quantiser \"dither\"",
    )
    .or(DefaultValue::Whole(1))
    .acting(FIRMWARE),
    number(
        "slew_limit_codes_per_s",
        Positive,
        "codes/s",
        "limit on the rate of the output, rounded down to whole codes per sample,",
    )
    .needed(Need::Optional)
    .acting(FIRMWARE),
    feed_forward(
        "velocity_ff_s",
        "codes s/count",
        "feed-forward per reference velocity",
    ),
    feed_forward(
        "acceleration_ff_s2",
        "codes s²/count",
        "feed-forward per reference acceleration",
    ),
    feed_forward(
        "friction_ff_codes",
        "codes",
        "feed-forward with the sign of the reference velocity",
    ),
    value(
        "setpoints",
        Kind::Choice(&["table", "generator", "queue"]),
        "",
        "source of the setpoints",
    )
    .or(DefaultValue::Choice("table"))
    .acting(FIRMWARE),
    value(
        "feedback",
        Kind::Choice(&["motor", "dual"]),
        "",
        "choice of encoders that close the loop",
    )
    .or(DefaultValue::Choice("motor"))
    .acting(FIRMWARE),
    value(
        "rest_dead_band_counts",
        Kind::Whole(0, 1_000_000),
        "counts",
        "largest error that counts as none at rest",
    )
    .or(DefaultValue::Whole(0))
    .acting(FIRMWARE),
    value(
        "rest_integrator",
        Kind::Choice(&["run", "hold"]),
        "",
        "integrator's part while the axis stands",
    )
    .or(DefaultValue::Choice("run"))
    .acting(FIRMWARE),
];

pub(super) const BACKLASH: &[Key] = &of_firmware([
    value(
        "compensation",
        Kind::Choice(&["none", "velocity", "acceleration"]),
        "",
        "reference quantity whose sign decides on the flank",
    )
    .or(DefaultValue::Choice("none")),
    number(
        "half_gap_deg",
        NotNegative,
        "deg",
        "half gap to be taken up, the joint's own if left out,",
    )
    .needed(Need::Optional),
    value(
        "gap",
        Kind::Choice(&["given", "measured"]),
        "",
        "source of the gap's width",
    )
    .or(DefaultValue::Choice("given")),
    value(
        "backlash_measurement_detection",
        Kind::Choice(&["load-encoder", "effort"]),
        "",
        "evidence of a flank where the gap is \"measured\"",
    )
    .or(DefaultValue::Choice("load-encoder")),
    number(
        "backlash_measurement_speed_counts_per_s",
        Positive,
        "counts/s",
        "motor speed where the gap is \"measured\"",
    )
    .or(DefaultValue::Number(200.0)),
    value(
        "backlash_measurement_effort_codes",
        Kind::Whole(1, MOST_CODES),
        "codes",
        "output that backlash_measurement_detection \"effort\" takes for a flank",
    )
    .or(DefaultValue::Whole(50)),
]);

pub(super) const GAIN_CHANGE: &[Key] = &of_firmware([
    time("at_s", NotNegative, "time of the change").needed(Need::Optional),
    new_gain("kp", "codes/count", "new proportional gain K_p"),
    new_gain("ki_per_s", "codes/(count s)", "new integral gain K_i"),
    new_gain("kd_s", "codes s/count", "new derivative gain K_d"),
]);

/// The largest code that the widest converter has: 2^23 − 1.
pub(super) const MOST_CODES: i64 = 8_388_607;

const fn feed_forward(name: &'static str, unit: &'static str, meaning: &'static str) -> Key {
    number(name, NotNegative, unit, meaning)
        .or(DefaultValue::Number(0.0))
        .acting(FIRMWARE)
}

const fn new_gain(name: &'static str, unit: &'static str, meaning: &'static str) -> Key {
    number(name, NotNegative, unit, meaning).needed(Need::OnlyWith("at_s"))
}
