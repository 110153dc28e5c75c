//! Keys of what goes wrong and what is done about it: limits, requests,
//! injected faults.

use super::super::keys::Range::{NotNegative, Positive};
use super::super::keys::{DefaultValue, Key, Kind, Need, flag, number, of_firmware, time, value};
use super::controller::MOST_CODES;

/// Largest following error or glitch \[counts\]: beyond any axis, and below half
/// the range of a counter of 32 bits, so that neither wraps around.
const LARGEST_ERROR_COUNTS: i64 = 1_000_000_000;

pub(super) const LIMITS: &[Key] = &of_firmware([
    value(
        "following_error_counts",
        Kind::Whole(1, LARGEST_ERROR_COUNTS),
        "counts",
        "largest following error at standstill",
    )
    .needed(Need::Optional),
    number(
        "following_error_per_speed_s",
        NotNegative,
        "counts/(counts/s)",
        "following error allowed on top per reference speed, 0 if left out,",
    )
    .needed(Need::OnlyWith("following_error_counts")),
    value(
        "count_jump_counts",
        Kind::Whole(1, i32::MAX as i64),
        "counts",
        "largest change of the motor's count in one sample",
    )
    .needed(Need::Optional),
    time(
        "encoder_loss_s",
        Positive,
        "time for which the count may stand still under output",
    )
    .needed(Need::Optional),
    value(
        "encoder_loss_codes",
        Kind::Whole(1, MOST_CODES),
        "codes",
        "output from which encoder_loss_s counts",
    )
    .or(DefaultValue::Whole(100)),
    time(
        "saturation_s",
        Positive,
        "time for which the output may stand at its limit",
    )
    .needed(Need::Optional),
    flag("missed_ticks", "switch that makes a missed tick a fault"),
    number(
        "velocity_mps",
        Positive,
        "m/s",
        "largest speed of the axis, for the backlash compensation,",
    )
    .needed(Need::Optional),
    number(
        "acceleration_mps2",
        Positive,
        "m/s²",
        "largest acceleration of the axis, for the backlash compensation,",
    )
    .needed(Need::Optional),
]);

pub(super) const SEQUENCE: &[Key] = &of_firmware([
    instant("disable_s", "time at which the axis is disabled"),
    instant("enable_s", "time at which the axis is enabled"),
    instant(
        "emergency_stop_s",
        "time at which the emergency stop goes on",
    ),
    time(
        "emergency_stop_release_s",
        Positive,
        "time at which the emergency stop goes off",
    )
    .needed(Need::OnlyWith("emergency_stop_s")),
    instant("reset_s", "time at which the faults are reset"),
]);

pub(super) const INJECT: &[Key] = &of_firmware([
    instant("encoder_glitch_s", "time of one wrong encoder count")
        .needed(Need::OnlyWith("encoder_glitch_counts")),
    value(
        "encoder_glitch_counts",
        Kind::Whole(-LARGEST_ERROR_COUNTS, LARGEST_ERROR_COUNTS),
        "counts",
        "error of the one wrong encoder count",
    )
    .needed(Need::OnlyWith("encoder_glitch_s")),
    instant(
        "encoder_freeze_s",
        "time from which the encoder count stands still",
    ),
    instant("missed_tick_s", "time at which a tick does not come"),
    instant("bus_error_s", "time at which a transfer on the bus fails"),
    instant(
        "setpoint_underrun_s",
        "time from which the queue of setpoints is not filled",
    ),
]);

const fn instant(name: &'static str, meaning: &'static str) -> Key {
    time(name, NotNegative, meaning).needed(Need::Optional)
}
