//! The gains in what the motor gets per radian of the motor, volts or with a current drive
//! amperes: codes/count = (V/rad)/(K_enc·K_a·K_dac).

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
pub(crate) const OF_VOLTAGE_DRIVE: [&str; 4] = [
    "kp_v_per_rad",
    "ki_v_per_rad_s",
    "kd_vs_per_rad",
    "velocity_gain_vs_per_rad",
];
pub(crate) const OF_CURRENT_DRIVE: [&str; 4] = [
    "kp_a_per_rad",
    "ki_a_per_rad_s",
    "kd_as_per_rad",
    "velocity_gain_as_per_rad",
];

/// A gain in codes per count as one per radian, if the drive is of that kind.
fn per_rad(case: &Case, of_current: bool, codes: Option<f64>) -> Option<f64> {
    let is_it = case.amplifier.is_current_drive() == of_current;
    Some(codes? * case.output_per_rad()).filter(|_| is_it)
}

/// Keys for gains per radian of the motor, each with the way of its codes per count into a
/// case and out of it.
macro_rules! gains {
    ($($name:literal $unit:literal $meaning:literal $shown:literal ($need:expr, $example:literal)
        $of_current:literal $set:expr, $get:expr);+ $(;)?) => {
        [$(number($name, NotNegative, $unit)
            .named($meaning, $shown)
            .needing($need, $example)
            .by(
                |c, gain| {
                    let set: fn(&mut Case, f64) = $set;
                    let codes = gain / c.output_per_rad();
                    set(c, codes);
                },
                |c| {
                    let get: fn(&Case) -> Option<f64> = $get;
                    per_rad(c, $of_current, get(c))
                },
            )),+]
    };
}

/// A gain in codes per count, as it is set and as it is.
type Gain = (fn(&mut Case, f64), fn(&Case) -> Option<f64>);

const KP: Gain = (
    |c, codes| c.controller.gains.kp = codes,
    |c| Some(c.controller.gains.kp),
);
const KI: Gain = (
    |c, codes| c.controller.gains.ki_per_s = codes,
    |c| Some(c.controller.gains.ki_per_s),
);
const KD: Gain = (
    |c, codes| c.controller.gains.kd_s = codes,
    |c| Some(c.controller.gains.kd_s),
);

/// `kp_v_per_rad` … and `kp_a_per_rad` …
pub(super) const PER_RAD: [Key; 6] = gains! {
    "kp_v_per_rad" "V/rad" "proportional gain K_p at the motor" "Gain Kp at the motor"
        (Need::Always, "30.0") false KP.0, KP.1;
    "ki_v_per_rad_s" "V/(rad s)" "integral gain K_i at the motor" "Gain Ki at the motor"
        (Need::Always, "46.0") false KI.0, KI.1;
    "kd_vs_per_rad" "V s/rad" "derivative gain K_d at the motor" "Gain Kd at the motor"
        (Need::Always, "0.46") false KD.0, KD.1;
    "kp_a_per_rad" "A/rad" "proportional gain K_p of a current drive" "Gain Kp at the motor"
        (Need::Always, "10.0") true KP.0, KP.1;
    "ki_a_per_rad_s" "A/(rad s)" "integral gain K_i of a current drive" "Gain Ki at the motor"
        (Need::Always, "100.0") true KI.0, KI.1;
    "kd_as_per_rad" "A s/rad" "derivative gain K_d of a current drive" "Gain Kd at the motor"
        (Need::Always, "0.2") true KD.0, KD.1;
};

/// Changes what becomes of the gains, if anything does.
fn change(case: &mut Case, set: impl FnOnce(&mut GainChange)) {
    if let Some(change) = case.options.gain_change.as_mut() {
        set(change);
    }
}

const NEW_KP: Gain = (
    |c, codes| change(c, |change| change.kp = Some(codes)),
    |c| c.options.gain_change?.kp,
);
const NEW_KI: Gain = (
    |c, codes| change(c, |change| change.ki_per_s = Some(codes)),
    |c| c.options.gain_change?.ki_per_s,
);
const NEW_KD: Gain = (
    |c, codes| change(c, |change| change.kd_s = Some(codes)),
    |c| c.options.gain_change?.kd_s,
);

/// The same of `[gain_change]`.
pub(super) const NEW_PER_RAD: [Key; 6] = gains! {
    "kp_v_per_rad" "V/rad" "new proportional gain K_p at the motor" ""
        (Need::OnlyWith("at_s"), "37.0") false NEW_KP.0, NEW_KP.1;
    "ki_v_per_rad_s" "V/(rad s)" "new integral gain K_i at the motor" ""
        (Need::OnlyWith("at_s"), "74.0") false NEW_KI.0, NEW_KI.1;
    "kd_vs_per_rad" "V s/rad" "new derivative gain K_d at the motor" ""
        (Need::OnlyWith("at_s"), "0.56") false NEW_KD.0, NEW_KD.1;
    "kp_a_per_rad" "A/rad" "new proportional gain K_p of a current drive" ""
        (Need::OnlyWith("at_s"), "12.0") true NEW_KP.0, NEW_KP.1;
    "ki_a_per_rad_s" "A/(rad s)" "new integral gain K_i of a current drive" ""
        (Need::OnlyWith("at_s"), "120.0") true NEW_KI.0, NEW_KI.1;
    "kd_as_per_rad" "A s/rad" "new derivative gain K_d of a current drive" ""
        (Need::OnlyWith("at_s"), "0.25") true NEW_KD.0, NEW_KD.1;
};

/// Changes the cascade that the gains are given as, and the gains with it.
fn set_cascade(case: &mut Case, set: impl FnOnce(&mut CascadeGains)) {
    let mut cascade = case.controller.cascade.unwrap_or_default();
    set(&mut cascade);
    case.controller.cascade = Some(cascade);
    let per_rad = case.output_per_rad();
    let [kp, ki_per_s, kd_s] = cascade.gains().map(|gain| gain / per_rad);
    case.controller.gains = plant::PidGains { kp, ki_per_s, kd_s };
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
        .by(
            |c, gain| set_cascade(c, |cascade| cascade.kv_per_s = gain),
            |c| Some(c.controller.cascade?.kv_per_s),
        )
        .alone()
        .note(&["or a cascade: gain of the position loop"]),
    number("velocity_gain_vs_per_rad", NotNegative, "V s/rad")
        .named("gain k of the velocity loop", "Cascade k")
        .needing(Need::Always, "0.4")
        .by(
            |c, gain| set_cascade(c, |cascade| cascade.velocity_gain_vs_per_rad = gain),
            |c| velocity_gain(c, false),
        )
        .note(&["gain of the velocity loop, volts per (radian per second)"]),
    number("velocity_gain_as_per_rad", NotNegative, "A s/rad")
        .named(
            "gain k of the velocity loop of a current drive",
            "Cascade k",
        )
        .needing(Need::Always, "0.2")
        .by(
            |c, gain| set_cascade(c, |cascade| cascade.velocity_gain_vs_per_rad = gain),
            |c| velocity_gain(c, true),
        )
        .note(&["the same of a current drive, amperes"]),
    number("velocity_reset_s", Positive, "s")
        .meaning("reset time T_n of the velocity loop")
        .needing(Need::Always, "0.02")
        .by(
            |c, reset_s| set_cascade(c, |cascade| cascade.velocity_reset_s = reset_s),
            |c| Some(c.controller.cascade?.velocity_reset_s),
        )
        .alone()
        .shown_in("Cascade T_n", 1e3, "ms")
        .note(&["its reset time"]),
];
