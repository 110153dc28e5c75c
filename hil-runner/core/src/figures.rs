//! The figures of a summary: key, words and unit, for tables, reports and
//! budgets.

/// One figure that a summary has and a budget can limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Figure {
    /// Key in the summary and in `[budget]`, unit as suffix.
    pub key: &'static str,
    /// The same in words.
    pub label: &'static str,
    /// Unit as it is shown; empty for counts of things.
    pub unit: &'static str,
    /// True if it is a whole number in every run.
    pub whole: bool,
    /// True if more is better: a limit on it is a least value.
    pub at_least: bool,
}

const fn figure(key: &'static str, label: &'static str, unit: &'static str) -> Figure {
    Figure {
        key,
        label,
        unit,
        whole: false,
        at_least: false,
    }
}

/// A figure that counts.
const fn count(key: &'static str, label: &'static str, unit: &'static str) -> Figure {
    Figure {
        whole: true,
        ..figure(key, label, unit)
    }
}

/// A figure of which a budget wants a least value.
const fn least(key: &'static str, label: &'static str, unit: &'static str) -> Figure {
    Figure {
        at_least: true,
        ..figure(key, label, unit)
    }
}

/// Constant lists of figures: kind, key, label and unit a line.
macro_rules! figures {
    ($($(#[$doc:meta])* $list:ident: $number:literal = {
        $($kind:ident $key:ident $label:literal $unit:literal)+
    })+) => {$(
        $(#[$doc])*
        pub const $list: [Figure; $number] = [$($kind(stringify!($key), $label, $unit)),+];
    )+};
}

figures! {
    /// Every numeric figure of the summary, in its order.
    SUMMARY_FIGURES: 42 = {
        figure peak_abs_acc_mps2 "Peak carriage acceleration" "m/s²"
        figure peak_acc_overshoot_mps2 "Peak acceleration over the commanded peak" "m/s²"
        figure rms_acc_error_mps2 "RMS acceleration error" "m/s²"
        figure peak_following_error_mm "Peak following error" "mm"
        figure final_error_um "Final error" "µm"
        figure peak_motor_following_error_mm "Peak following error at the motor" "mm"
        figure final_motor_error_um "Final error at the motor" "µm"
        figure settling_time_s "Settling time" "s"
        count contact_changes "Contact changes" ""
        count impacts "Impacts" ""
        figure hardest_impact_radps "Largest speed at which the gap closed" "rad/s"
        figure joint_loss_j "Energy lost in the joint's damper" "J"
        figure peak_abs_voltage_v "Peak motor voltage" "V"
        figure voltage_saturated_s "Time at the voltage or code limit" "s"
        figure peak_abs_current_a "Peak current" "A"
        figure rms_current_a "RMS current" "A"
        figure energy_j "Electrical energy into the motor" "J"
        figure mean_power_w "Mean electrical power" "W"
        figure peak_power_w "Peak electrical power" "W"
        figure current_limited_s "Time at the current limit" "s"
        figure max_abs_dac_code "Largest DAC code" "codes"
        count dac_bits_used "Bits of the converter in use" "bits"
        count encoder_bits_used "Bits of the counts travelled" "bits"
        figure rest_ripple_um "Amplitude of the carriage at rest" "µm"
        figure limit_cycle_um "Amplitude of a limit cycle" "µm"
        figure limit_cycle_period_s "Period of a limit cycle" "s"
        count rest_dac_codes "Range of the codes at rest" "codes"
        count rest_encoder_counts "Range of the counts at rest" "counts"
        figure rest_error_max_um "Largest error at rest" "µm"
        figure rest_error_rms_um "RMS error at rest" "µm"
        least modulus_margin_contact "Modulus margin in contact" ""
        least modulus_margin_gap "Modulus margin in the gap" ""
        least gain_margin_contact_db "Gain margin in contact" "dB"
        least gain_margin_gap_db "Gain margin in the gap" "dB"
        least phase_margin_contact_deg "Phase margin in contact" "°"
        least phase_margin_gap_deg "Phase margin in the gap" "°"
        least crossover_contact_hz "Crossover in contact" "Hz"
        least crossover_gap_hz "Crossover in the gap" "Hz"
        least bandwidth_contact_hz "Bandwidth in contact" "Hz"
        least bandwidth_gap_hz "Bandwidth in the gap" "Hz"
        least least_stiffness_n_per_um "Least stiffness against a force on the carriage" "N/µm"
        count faults "Faults of the axis" ""
    }

    /// Figures that a chip adds to a summary, in its order; a run without one gives none of
    /// it. Figures of instructions need QEMU: a board counts cycles.
    CHIP_FIGURES: 8 = {
        count instructions_per_step_max "Most instructions of a step" ""
        count instructions_per_step_median "Median of the instructions of a step" ""
        count cycles_per_step_max "Most cycles of a step" ""
        figure utilisation_max_percent "Longest step as a share of the sample time" "%"
        count deadline_misses "Deadline misses" ""
        count flash_bytes "Flash of the image" "bytes"
        count ram_bytes "Static RAM less the table of setpoints" "bytes"
        count stack_bytes "Deepest stack" "bytes"
    }
}

/// The controller's step time on the host: a matter of this machine's clock,
/// in no summary, judged only where a budget names it.
pub const HOST_STEP_P99: Figure = figure(
    "host_step_p99_us",
    "99th percentile of the controller step on the host",
    "µs",
);

/// The figure with this key.
pub fn find(key: &str) -> Option<&'static Figure> {
    let all = SUMMARY_FIGURES.iter().chain(&CHIP_FIGURES);
    let mut all = all.chain([&HOST_STEP_P99]);
    all.find(|figure| figure.key == key)
}

/// Its unit; empty where there is none.
pub fn unit(key: &str) -> &'static str {
    find(key).map_or("", |figure| figure.unit)
}
