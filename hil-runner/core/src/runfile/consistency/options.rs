//! What does not go together in the controller beyond the paper's law.
//!
//! Only rung `firmware` takes its setpoints from a table, generator or queue;
//! what hangs on that choice is judged there alone, so that one file serves
//! all rungs.

use super::super::assemble::options::{compensation, feedback, setpoints};
use super::super::assemble::{computation_delay, law};
use super::super::key_table::SECTIONS;
use super::super::keys::{Need, path};
use super::Consistency;
use crate::case::{ComputationDelay, Law};
use crate::options::{Compensation, Feedback, SetpointOrigin};

/// What a load encoder must say.
const LOAD_ENCODER: &str = "load_encoder.counts_per_rad or load_encoder.counts_per_mm";

impl Consistency<'_> {
    /// All checks of this file.
    pub(super) fn options(&mut self) {
        self.only_one_of("load_encoder", "counts_per_rad", "counts_per_mm");
        self.only_with();
        self.gain_change();
        self.count_jump();
        self.emergency_stop();
        self.feedback();
        self.compensation();
        self.measured_gap();
        self.enable();
        if law(self.values) == Some(Law::Firmware) {
            self.setpoint_origin();
            self.damping();
            self.gap_before_the_chip();
        }
    }

    /// The axis is enabled from the start: asking again makes sense only after
    /// something has ended that.
    fn enable(&mut self) {
        let v = self.values;
        let time = |key| v.nanoseconds("sequence", key);
        let Some(enable_ns) = time("enable_s") else {
            return;
        };
        let before = ["disable_s", "reset_s"];
        if !before
            .into_iter()
            .filter_map(time)
            .any(|ns| ns <= enable_ns)
        {
            let because = "the axis is enabled from the start; it needs an earlier \
                           sequence.disable_s or sequence.reset_s"
                .to_owned();
            self.refuse("sequence", "enable_s", because);
        }
    }

    /// With two encoders the error is the load's, and its derivative no
    /// damping of the motor.
    fn damping(&mut self) {
        let v = self.values;
        let measured = v.choice("controller", "derivative") == Some("measurement");
        if feedback(v) == Some(Feedback::Dual) && self.has_load_encoder() && !measured {
            let derivative = v.quote("controller", "derivative");
            let because = format!(
                "\"dual\" takes its damping from the motor, and {derivative}; use derivative = \"measurement\" \
                 (velocity_ff_s = kd_s then gives back the reference's part)"
            );
            self.refuse("controller", "feedback", because);
        }
    }

    fn has_load_encoder(&self) -> bool {
        let v = self.values;
        v.is_given("load_encoder", "counts_per_rad") || v.is_given("load_encoder", "counts_per_mm")
    }

    /// Keys that mean something only beside another one.
    fn only_with(&mut self) {
        for section in SECTIONS {
            for key in section.keys {
                if let Need::OnlyWith(partner) = key.need
                    && self.values.is_given(section.name, key.name)
                    && !self.values.is_given(section.name, partner)
                {
                    let because = format!("it needs {}", path(section.name, partner));
                    self.refuse(section.name, key.name, because);
                }
            }
        }
    }

    fn gain_change(&mut self) {
        let given = |key| self.values.is_given("gain_change", key);
        if given("at_s") && !["kp", "ki_per_s", "kd_s"].into_iter().any(given) {
            let because = "no gain changes; give gain_change.kp, ki_per_s or kd_s".to_owned();
            self.refuse("gain_change", "at_s", because);
        }
    }

    /// A counter of n bits wraps around: it tells jumps below 2^(n−1) from
    /// their complement, longer ones it shows as others.
    fn count_jump(&mut self) {
        let v = self.values;
        let jump: Option<u32> = v.whole("limits", "count_jump_counts");
        let bits: Option<u32> = v.whole("encoder", "counter_bits");
        if let (Some(jump), Some(bits)) = (jump, bits)
            && let Some(half) = 1_u32.checked_shl(bits.saturating_sub(1))
            && jump >= half
        {
            let counter = v.quote("encoder", "counter_bits");
            let because = format!("it must be less than {half}, half the range of {counter}");
            self.refuse("limits", "count_jump_counts", because);
        }
    }

    fn emergency_stop(&mut self) {
        let v = self.values;
        let stop_ns = v.nanoseconds("sequence", "emergency_stop_s");
        let release_ns = v.nanoseconds("sequence", "emergency_stop_release_s");
        if let (Some(stop_ns), Some(release_ns)) = (stop_ns, release_ns)
            && release_ns <= stop_ns
        {
            let stop = v.quote("sequence", "emergency_stop_s");
            let because = format!("the release must come after the stop, {stop}");
            self.refuse("sequence", "emergency_stop_release_s", because);
        }
    }

    fn feedback(&mut self) {
        if feedback(self.values) == Some(Feedback::Dual) && !self.has_load_encoder() {
            let because = format!("\"dual\" needs {LOAD_ENCODER}");
            self.refuse("controller", "feedback", because);
        }
    }

    fn compensation(&mut self) {
        let v = self.values;
        let compensation = compensation(v);
        if matches!(compensation, None | Some(Compensation::None)) {
            return;
        }
        if feedback(v) == Some(Feedback::Dual) {
            let dual = v.quote("controller", "feedback");
            let because = format!(
                "with {dual} the position behind the gap is controlled already; use \"none\" or feedback = \"motor\""
            );
            self.refuse("backlash", "compensation", because);
        }
        let keys = ["velocity_mps", "acceleration_mps2"];
        let missing: Vec<String> = keys
            .into_iter()
            .filter(|key| !v.is_given("limits", key))
            .map(|key| path("limits", key))
            .collect();
        if !missing.is_empty() {
            let because = format!("the take-up of the gap needs {}", missing.join(" and "));
            self.refuse("backlash", "compensation", because);
        }
    }

    fn measured_gap(&mut self) {
        let v = self.values;
        if v.choice("backlash", "gap") == Some("measured")
            && v.choice("backlash", "backlash_measurement_detection") == Some("load-encoder")
            && !self.has_load_encoder()
        {
            let detection = v.quote("backlash", "backlash_measurement_detection");
            let because = format!("{detection} needs {LOAD_ENCODER}");
            self.refuse("backlash", "gap", because);
        }
    }

    /// The gap is measured before the chip has made a step whose time could be
    /// known.
    fn gap_before_the_chip(&mut self) {
        let v = self.values;
        if v.choice("backlash", "gap") == Some("measured")
            && computation_delay(v) == Some(ComputationDelay::Measured)
        {
            let delay = v.quote("controller", "computation_delay_s");
            let because = format!(
                "the gap is measured before the chip's first step, where {delay} is not known yet; \
                 use \"given\", or a delay in seconds"
            );
            self.refuse("backlash", "gap", because);
        }
    }

    fn setpoint_origin(&mut self) {
        let v = self.values;
        let Some(origin) = setpoints(v) else {
            return;
        };
        let quoted = v.quote("controller", "setpoints");
        if origin == SetpointOrigin::Table {
            let because = format!(
                "{quoted} knows positions only; use setpoints = \"generator\" or \"queue\""
            );
            for key in ["velocity_ff_s", "acceleration_ff_s2", "friction_ff_codes"] {
                if v.number("controller", key).is_some_and(|gain| gain > 0.0) {
                    self.refuse("controller", key, because.clone());
                }
            }
            if compensation(v) == Some(Compensation::Acceleration) {
                self.refuse("backlash", "compensation", because);
            }
        }
        if origin != SetpointOrigin::Queue && v.is_given("inject", "setpoint_underrun_s") {
            let because = format!("{quoted} cannot run dry; it needs setpoints = \"queue\"");
            self.refuse("inject", "setpoint_underrun_s", because);
        }
    }
}
