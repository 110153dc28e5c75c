//! Checks that concern several keys at once.

mod options;

use plant::Motion;

use super::assemble::options::{load_encoder, setpoints};
use super::assemble::{encoder, law, motion, solver, transmission};
use super::errors::{Findings, Place, Problem};
use super::keys::path;
use super::keys::show_number;
use super::values::Values;
use crate::case::{Law, SolverChoice};
use crate::options::SetpointOrigin;

/// Most rows that a run may have: a day at 1 ms. More are rather a slip of the
/// keyboard than a wish for tens of gigabytes of trace.
pub const MOST_ROWS: u64 = 100_000_000;

/// Most steps that solver `rk4` may take in a run: minutes of computing.
pub const MOST_RK4_STEPS: u64 = 1_000_000_000;

/// Most encoder counts that a motion may cover, far above any axis: 2^50. Up
/// there `f64` still resolves a quarter of a count.
pub const MOST_COUNTS: f64 = 1_125_899_906_842_624.0;

/// Reports what does not go together. A value that was refused on its own is
/// left out of it.
pub(super) fn check(values: &Values, findings: &mut Findings) {
    let mut consistency = Consistency { values, findings };
    consistency.only_one_of("drive", "dac_lsb_v", "dac_range_v");
    consistency.only_one_of("encoder", "counts_per_rad", "lines");
    consistency.resistance();
    consistency.exact_needs_affine();
    consistency.delay();
    consistency.options();
    match motion(values) {
        Some(Ok(motion)) => {
            consistency.setpoint_table(&motion);
            consistency.travel(&motion);
        }
        Some(Err(error)) => consistency.refuse("motion", "intervals_s", error.to_string()),
        None => {}
    }
    consistency.length();
}

struct Consistency<'a> {
    values: &'a Values,
    findings: &'a mut Findings,
}

impl Consistency<'_> {
    fn refuse(&mut self, section: &str, key: &str, because: String) {
        let (place, problem) = refusal(self.values, section, key, because);
        self.findings.push(place, problem);
    }

    fn only_one_of(&mut self, section: &str, key: &str, partner: &str) {
        let place = |key| self.values.entry(section, key)?.place.clone();
        let (Some(one), Some(other)) = (place(key), place(partner)) else {
            return;
        };
        let line = |place: &Place| match place {
            Place::Line(line) => *line,
            _ => usize::MAX,
        };
        // The message stands with the later line.
        let (key, partner) = if line(&one) > line(&other) {
            (key, partner)
        } else {
            (partner, key)
        };
        let quoted = self.values.quote(section, partner);
        let because = format!("{quoted} sets the same quantity; give one of the two");
        self.refuse(section, key, because);
    }

    fn resistance(&mut self) {
        let v = self.values;
        if v.flag("carriage", "resistance_opposes_motion") != Some(true) {
            return;
        }
        let switch = v.quote("carriage", "resistance_opposes_motion");
        for (key, meaning) in [
            ("resistance_constant_n", "constant resistance a0"),
            (
                "resistance_quadratic_ns2_per_rad2",
                "quadratic resistance a2",
            ),
        ] {
            if v.number("carriage", key).is_some_and(|a| a < 0.0) {
                let because = format!("the {meaning} must be at least 0 with {switch}");
                self.refuse("carriage", key, because);
            }
        }
    }

    fn exact_needs_affine(&mut self) {
        let v = self.values;
        let key = "resistance_quadratic_ns2_per_rad2";
        if solver(v) == Some(SolverChoice::Exact)
            && v.number("carriage", key).is_some_and(|a2| a2 != 0.0)
        {
            let quoted = v.quote("carriage", key);
            let because = format!(
                "the exact solution exists only without quadratic resistance, and {quoted}; \"auto\" and \"dopri5\" solve it"
            );
            self.refuse("run", "solver", because);
        }
    }

    fn delay(&mut self) {
        let v = self.values;
        let sample_ns = v.nanoseconds("controller", "sample_time_s");
        let delay_ns = v.nanoseconds("controller", "computation_delay_s");
        if let (Some(sample_ns), Some(delay_ns)) = (sample_ns, delay_ns)
            && delay_ns > sample_ns
        {
            let sample = v.quote("controller", "sample_time_s");
            let because = format!("the delay must be at most the sample time, {sample}");
            self.refuse("controller", "computation_delay_s", because);
        }
    }

    /// One setpoint a sample from k = 0 to the motion's end must fit into the
    /// firmware's table.
    fn setpoint_table(&mut self, motion: &Motion) {
        let v = self.values;
        let Some(sample_ns) = v.nanoseconds("controller", "sample_time_s") else {
            return;
        };
        // The sum of seven decimal intervals may miss a whole sample by a few
        // units in the last place; a millionth of a sample is rounding.
        let samples = motion.end_s() * 1e9 / sample_ns as f64 - 1e-6;
        let needed = samples.ceil().max(0.0) + 1.0;
        let capacity = firmware::setpoint::CAPACITY;
        let from_table =
            law(v) == Some(Law::Firmware) && setpoints(v) == Some(SetpointOrigin::Table);
        if from_table && needed > capacity as f64 {
            let end = show_number(motion.end_s());
            let because = format!(
                "the motion of {end} s would make {needed} setpoints; the firmware's table holds {capacity}; \
                 controller.setpoints = \"generator\" needs none"
            );
            self.refuse("controller", "sample_time_s", because);
        }
    }

    /// On the rungs with an encoder every position is a whole number of
    /// counts, which `f64` must be able to tell from its neighbours.
    fn travel(&mut self, motion: &Motion) {
        let v = self.values;
        let counted = matches!(law(v), Some(Law::Quantised | Law::Firmware));
        let (Some(encoder), Some(transmission)) = (encoder(v), transmission(v)) else {
            return;
        };
        // γ = x/p and α = γ/z, eq. 3
        let screw_rad = motion.travel_m() / transmission.screw_pitch_m_per_rad;
        let shaft_rad = screw_rad / transmission.gear_ratio;
        let of_motor = (encoder.counts_per_rad * shaft_rad).abs();
        // Only rung `firmware` has a second encoder.
        let of_load = load_encoder(v)
            .filter(|_| law(v) == Some(Law::Firmware))
            .map_or(0.0, |load| (load.counts_per_rad * screw_rad).abs());
        let counts = of_motor.max(of_load);
        if counted && counts > MOST_COUNTS {
            let (counts, most) = (show_number(counts), show_number(MOST_COUNTS));
            let because = format!("it makes {counts} encoder counts; at most {most} are allowed");
            self.refuse("motion", "travel_mm", because);
        }
    }

    fn length(&mut self) {
        let rows = match law(self.values) {
            Some(Law::Continuous) => Some(("run", "row_interval_s")),
            Some(_) => Some(("controller", "sample_time_s")),
            None => None,
        };
        if let Some((section, key)) = rows {
            // The row at t = 0 comes on top.
            self.limit_count(section, key, 1, MOST_ROWS, "rows");
        }
        if solver(self.values) == Some(SolverChoice::Rk4) {
            self.limit_count("run", "rk4_step_s", 0, MOST_RK4_STEPS, "steps");
        }
    }

    /// Refuses a duration that makes more than `most` rows or steps.
    fn limit_count(&mut self, section: &str, key: &str, extra: u64, most: u64, what: &str) {
        let v = self.values;
        let duration_ns = v.nanoseconds("run", "duration_s");
        let interval_ns = v.nanoseconds(section, key);
        if let (Some(duration_ns), Some(interval_ns)) = (duration_ns, interval_ns)
            && let Some(count) = duration_ns.checked_div(interval_ns)
            && count + extra > most
        {
            let (count, quoted) = (count + extra, v.quote(section, key));
            let because =
                format!("with {quoted} it makes {count} {what}; at most {most} are allowed");
            self.refuse("run", "duration_s", because);
        }
    }
}

/// Place and words for a value that is refused after its own check.
pub(super) fn refusal(
    values: &Values,
    section: &str,
    key: &str,
    because: String,
) -> (Place, Problem) {
    let entry = values.entry(section, key);
    let place = entry.and_then(|entry| entry.place.clone());
    let text = match entry {
        Some(entry) if entry.place.is_none() => format!("{} (the default)", entry.text),
        Some(entry) => entry.text.clone(),
        None => "(not given)".to_owned(),
    };
    let key = path(section, key);
    let problem = Problem::NotAllowed { key, text, because };
    (place.unwrap_or(Place::File), problem)
}
