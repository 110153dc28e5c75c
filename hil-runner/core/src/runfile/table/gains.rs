//! The gains in what the motor gets per radian of the motor, volts or with a current drive
//! amperes: codes/count = (V/rad)/(K_enc·K_a·K_dac).

use plant::PidGains;

use super::super::keys::Access::{Own, Per};
use super::super::keys::Range::{NotNegative, Positive};
use super::super::keys::{Key, Need, Way, number};
use crate::case::{CascadeGains, Case};
use crate::options::GainChange;

/// The ways to give the gains: in codes and counts, in volts, in amperes, and as a position
/// loop around a PI velocity loop in each.
pub(super) const WAYS: &[Way] = &[
    IN_CODES,
    IN_VOLTS,
    &["kv_per_s", "velocity_gain_vs_per_rad", "velocity_reset_s"],
    IN_AMPERES,
    &["kv_per_s", "velocity_gain_as_per_rad", "velocity_reset_s"],
];

/// Those of gains that change during a run.
pub(super) const WAYS_TO_CHANGE: &[Way] = &[IN_CODES, IN_VOLTS, IN_AMPERES];

const IN_CODES: Way = &["kp", "ki_per_s", "kd_s"];
const IN_VOLTS: Way = &["kp_v_per_rad", "ki_v_per_rad_s", "kd_vs_per_rad"];
const IN_AMPERES: Way = &["kp_a_per_rad", "ki_a_per_rad_s", "kd_as_per_rad"];

/// Keys of the drive of one kind, which the other does not have.
pub(crate) const OF_VOLTAGE_DRIVE: [Way; 2] = [IN_VOLTS, &["velocity_gain_vs_per_rad"]];
pub(crate) const OF_CURRENT_DRIVE: [Way; 2] = [IN_AMPERES, &["velocity_gain_as_per_rad"]];

/// The gains of the law in codes per count, unless the drive is of another kind.
fn gains(case: &mut Case, of_current: bool) -> Option<&mut PidGains> {
    let is_it = case.amplifier.is_current_drive() == of_current;
    is_it.then_some(&mut case.controller.gains)
}

/// What becomes of them, if anything does.
fn new_gains(case: &mut Case, of_current: bool) -> Option<&mut GainChange> {
    let is_it = case.amplifier.is_current_drive() == of_current;
    case.options.gain_change.as_mut().filter(|_| is_it)
}

/// Keys for gains per radian of the motor, each with its place in codes per count.
macro_rules! per_radian {
    ($gains:ident, $need:expr; $($name:literal $unit:literal $meaning:literal $shown:literal
        $example:literal, $of_current:literal $gain:ident);+ $(;)?) => {
        [$(number($name, NotNegative, $unit)
            .named($meaning, $shown)
            .needing($need, $example)
            .access(Per(Case::output_per_rad, |c| Some(&mut $gains(c, $of_current)?.$gain)))),+]
    };
}

/// `kp_v_per_rad` … and `kp_a_per_rad` …
pub(super) const PER_RAD: [Key; 6] = per_radian! { gains, Need::Always;
    "kp_v_per_rad" "V/rad" "proportional gain K_p at the motor" "Gain Kp at the motor"
        "30.0", false kp;
    "ki_v_per_rad_s" "V/(rad s)" "integral gain K_i at the motor" "Gain Ki at the motor"
        "46.0", false ki_per_s;
    "kd_vs_per_rad" "V s/rad" "derivative gain K_d at the motor" "Gain Kd at the motor"
        "0.46", false kd_s;
    "kp_a_per_rad" "A/rad" "proportional gain K_p of a current drive" "Gain Kp at the motor"
        "10.0", true kp;
    "ki_a_per_rad_s" "A/(rad s)" "integral gain K_i of a current drive" "Gain Ki at the motor"
        "100.0", true ki_per_s;
    "kd_as_per_rad" "A s/rad" "derivative gain K_d of a current drive" "Gain Kd at the motor"
        "0.2", true kd_s;
};

/// The same of `[gain_change]`.
pub(super) const NEW_PER_RAD: [Key; 6] = per_radian! { new_gains, Need::OnlyWith("at_s");
    "kp_v_per_rad" "V/rad" "new proportional gain K_p at the motor" "" "37.0", false kp;
    "ki_v_per_rad_s" "V/(rad s)" "new integral gain K_i at the motor" "" "74.0", false ki_per_s;
    "kd_vs_per_rad" "V s/rad" "new derivative gain K_d at the motor" "" "0.56", false kd_s;
    "kp_a_per_rad" "A/rad" "new proportional gain K_p of a current drive" "" "12.0", true kp;
    "ki_a_per_rad_s" "A/(rad s)" "new integral gain K_i of a current drive" ""
        "120.0", true ki_per_s;
    "kd_as_per_rad" "A s/rad" "new derivative gain K_d of a current drive" "" "0.25", true kd_s;
};

/// Changes the cascade that the gains are given as, and the gains with it.
fn set_cascade(case: &mut Case, set: impl FnOnce(&mut CascadeGains)) {
    let mut cascade = case.controller.cascade.unwrap_or_default();
    set(&mut cascade);
    case.controller.cascade = Some(cascade);
    let per_rad = case.output_per_rad();
    let [kp, ki_per_s, kd_s] = cascade.gains().map(|gain| gain / per_rad);
    case.controller.gains = PidGains { kp, ki_per_s, kd_s };
}

/// The cascade's k, if the drive is of that kind.
fn velocity_gain(case: &Case, of_current: bool) -> Option<f64> {
    let is_it = case.amplifier.is_current_drive() == of_current;
    Some(case.controller.cascade?.velocity_gain_vs_per_rad).filter(|_| is_it)
}

/// A cascade of position and velocity loop.
pub(super) const OF_CASCADE: [Key; 4] = [
    number("kv_per_s", NotNegative, "1/s")
        .named("gain k_v of the position loop", "Cascade k_v")
        .needing(Need::Always, "20.0")
        .access(Own(
            |c, gain| set_cascade(c, |cascade| cascade.kv_per_s = gain),
            |c| Some(c.controller.cascade?.kv_per_s),
        ))
        .alone()
        .note(&["or a cascade: gain of the position loop"]),
    number("velocity_gain_vs_per_rad", NotNegative, "V s/rad")
        .named("gain k of the velocity loop", "Cascade k")
        .needing(Need::Always, "0.4")
        .access(Own(
            |c, gain| set_cascade(c, |cascade| cascade.velocity_gain_vs_per_rad = gain),
            |c| velocity_gain(c, false),
        ))
        .note(&["gain of the velocity loop, volts per (radian per second)"]),
    number("velocity_gain_as_per_rad", NotNegative, "A s/rad")
        .meaning("gain k of the velocity loop of a current drive")
        .shown("Cascade k")
        .needing(Need::Always, "0.2")
        .access(Own(
            |c, gain| set_cascade(c, |cascade| cascade.velocity_gain_vs_per_rad = gain),
            |c| velocity_gain(c, true),
        ))
        .note(&["the same of a current drive, amperes"]),
    number("velocity_reset_s", Positive, "s")
        .meaning("reset time T_n of the velocity loop")
        .needing(Need::Always, "0.02")
        .access(Own(
            |c, reset_s| set_cascade(c, |cascade| cascade.velocity_reset_s = reset_s),
            |c| Some(c.controller.cascade?.velocity_reset_s),
        ))
        .alone()
        .shown_in("Cascade T_n", 1e3, "ms")
        .note(&["its reset time"]),
];
