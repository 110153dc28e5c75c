//! Key figures of a run.

use std::collections::BTreeMap;

use plant::{ContactChange, Extremes, Motion, One};
use serde::Serialize;

use crate::budget::{self, Verdict};
use crate::case::{Case, Law};
use crate::chip_cost::ChipReport;
use crate::figures::SUMMARY_FIGURES;
use crate::message::AxisStatus;
use crate::number::{self, seconds};
use crate::rest::{Seen, SeenRows, Window};
use crate::theory::LoopFigures;
use crate::trace::Row;

/// Key figures of a run; the keys are those of the summary file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the run.
    pub name: String,
    /// The rung.
    pub law: &'static str,
    /// The solver really used.
    pub solver: &'static str,
    /// Keys beyond the paper's law that the run file sets and the rung leaves
    /// out; left out where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keys_without_effect: Vec<String>,
    /// Keys whose values the run file still has from its template; left out where there
    /// are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub template_values: Vec<String>,
    /// sup of |ẍ|, contact spikes included \[m/s²\].
    pub peak_abs_acc_mps2: f64,
    /// sup of |ẍ| − sup of |ẍ_ref| \[m/s²\].
    pub peak_acc_overshoot_mps2: f64,
    /// RMS of ẍ − ẍ_ref over the rows \[m/s²\].
    pub rms_acc_error_mps2: f64,
    /// sup of |x_ref − x| \[mm\].
    pub peak_following_error_mm: f64,
    /// x_ref − x at the end \[µm\].
    pub final_error_um: f64,
    /// sup of |x_ref − p·β| \[mm\].
    pub peak_motor_following_error_mm: f64,
    /// x_ref − p·β at the end \[µm\].
    pub final_motor_error_um: f64,
    /// From the motion's end until the carriage stays in the settling band
    /// \[s\]; `None` if it is outside at the end.
    pub settling_time_s: Option<f64>,
    /// Changes of `contact`.
    pub contact_changes: u64,
    /// Changes 0 → ±1 at |ε| = b.
    pub impacts: u64,
    /// Largest |ε̇| at an impact \[rad/s\]; 0 without one.
    pub hardest_impact_radps: f64,
    /// Heat of the joint's damper, `∫ c·ε̇² dt` \[J\].
    pub joint_loss_j: f64,
    /// Largest voltage in force \[V\].
    pub peak_abs_voltage_v: f64,
    /// Time at the amplifier's or the code's limit \[s\].
    pub voltage_saturated_s: f64,
    /// Largest current \[A\].
    pub peak_abs_current_a: f64,
    /// `√(1/T·∫I² dt)` over the run of length T \[A\].
    pub rms_current_a: f64,
    /// `∫V·I dt`: electrical energy into the motor less what came back \[J\].
    pub energy_j: f64,
    /// That by the length of the run \[W\].
    pub mean_power_w: f64,
    /// Largest |V·I| \[W\].
    pub peak_power_w: f64,
    /// Time with the commanded or the real current at its limit \[s\].
    pub current_limited_s: f64,
    /// Largest code after its clamp; `None` on rung `continuous`.
    pub max_abs_dac_code: Option<f64>,
    /// Bits of the smallest converter that has all codes of the run; `None`
    /// where the codes are no whole numbers.
    pub dac_bits_used: Option<u32>,
    /// Bits that tell the counts apart that the encoder went through; `None`
    /// where there are none.
    pub encoder_bits_used: Option<u32>,
    /// Amplitude of the carriage at rest about its straight line \[µm\];
    /// `None`, as what follows, where it does not rest.
    pub rest_ripple_um: Option<f64>,
    /// The same where it is a sustained oscillation, else 0 \[µm\].
    pub limit_cycle_um: Option<f64>,
    /// Period of that \[s\]; `None` without one.
    pub limit_cycle_period_s: Option<f64>,
    /// Highest code at rest less the lowest.
    pub rest_dac_codes: Option<u64>,
    /// Highest count at rest less the lowest.
    pub rest_encoder_counts: Option<u64>,
    /// Largest |x_ref − x| at the rows at rest \[µm\].
    pub rest_error_max_um: Option<f64>,
    /// RMS of x_ref − x over the same rows \[µm\].
    pub rest_error_rms_um: Option<f64>,
    /// Margins of the linear sampled loop; each `None` where there is no such loop.
    #[serde(flatten)]
    pub loops: LoopFigures,
    /// Number of times that the supervision stopped the axis; left out where none runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub faults: Option<u32>,
    /// Report of the axis at the end; left out where no supervision runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisReport>,
    /// Report of the chip; left out where none runs.
    #[serde(flatten)]
    pub chip: Option<ChipReport>,
    /// Every change of contact: `[t_s, from, to]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub events: Option<Vec<(f64, i8, i8)>>,
    /// Limits and whether they hold.
    pub verdicts: Vec<Verdict>,
    /// Figures of which fewer digits hold than tables show, and how many;
    /// left out where there are none, or no second run looked for them.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub digits_that_hold: BTreeMap<&'static str, usize>,
}

impl Summary {
    /// The figures of which fewer digits hold than tables show, and how many: those
    /// that the summary of a second run confirms; see [`number`].
    pub fn digits_confirmed_by(&self, second: &Self) -> BTreeMap<&'static str, usize> {
        let figures = SUMMARY_FIGURES.iter().filter_map(|figure| {
            let values = [self, second].map(|summary| summary.figure(figure.key));
            Some((figure.key, number::confirmed(values, figure.unit)?))
        });
        figures.collect()
    }

    /// A figure by its key; `None` for null and for keys that are no figure.
    pub fn figure(&self, key: &str) -> Option<f64> {
        match key {
            "peak_abs_acc_mps2" => Some(self.peak_abs_acc_mps2),
            "peak_acc_overshoot_mps2" => Some(self.peak_acc_overshoot_mps2),
            "rms_acc_error_mps2" => Some(self.rms_acc_error_mps2),
            "peak_following_error_mm" => Some(self.peak_following_error_mm),
            "final_error_um" => Some(self.final_error_um),
            "peak_motor_following_error_mm" => Some(self.peak_motor_following_error_mm),
            "final_motor_error_um" => Some(self.final_motor_error_um),
            "settling_time_s" => self.settling_time_s,
            "contact_changes" => Some(whole(self.contact_changes)),
            "impacts" => Some(whole(self.impacts)),
            "hardest_impact_radps" => Some(self.hardest_impact_radps),
            "joint_loss_j" => Some(self.joint_loss_j),
            "peak_abs_voltage_v" => Some(self.peak_abs_voltage_v),
            "voltage_saturated_s" => Some(self.voltage_saturated_s),
            "peak_abs_current_a" => Some(self.peak_abs_current_a),
            "rms_current_a" => Some(self.rms_current_a),
            "energy_j" => Some(self.energy_j),
            "mean_power_w" => Some(self.mean_power_w),
            "peak_power_w" => Some(self.peak_power_w),
            "current_limited_s" => Some(self.current_limited_s),
            "max_abs_dac_code" => self.max_abs_dac_code,
            "dac_bits_used" => self.dac_bits_used.map(f64::from),
            "encoder_bits_used" => self.encoder_bits_used.map(f64::from),
            "rest_ripple_um" => self.rest_ripple_um,
            "limit_cycle_um" => self.limit_cycle_um,
            "limit_cycle_period_s" => self.limit_cycle_period_s,
            "rest_dac_codes" => self.rest_dac_codes.map(whole),
            "rest_encoder_counts" => self.rest_encoder_counts.map(whole),
            "rest_error_max_um" => self.rest_error_max_um,
            "rest_error_rms_um" => self.rest_error_rms_um,
            // Without supervision there is none.
            "faults" => Some(f64::from(self.faults.unwrap_or(0))),
            key => {
                let of_chip = || self.chip.as_ref()?.figure(key);
                self.loops.figure(key).or_else(of_chip)
            }
        }
    }

    /// A figure as tables show it, with the digits that hold.
    pub fn shown(&self, key: &str) -> String {
        number::shown(self.figure(key), self.digits(key))
    }

    /// Number of digits of a figure that hold; `None` where all that tables show do.
    pub fn digits(&self, key: &str) -> Option<usize> {
        self.digits_that_hold.get(key).copied()
    }
}

/// Report of the supervision of the axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisReport {
    /// State at the end.
    pub state: &'static str,
    /// Largest `|e|` while the axis was powered \[counts\].
    pub peak_error_counts: u32,
    /// The first fault of the run, whether or not it was reset.
    pub fault: Option<FaultReport>,
}

/// A fault in a summary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultReport {
    /// The limit or fault that tripped.
    pub cause: &'static str,
    /// Number of the sample.
    pub tick: u64,
    /// Time of the sample \[s\].
    pub t_s: f64,
    /// Setpoint \[counts, modulo 2^32\].
    pub setpoint_counts: i32,
    /// Position \[counts, modulo 2^32\].
    pub position_counts: i32,
    /// `e` \[counts\].
    pub error_counts: i32,
    /// The last code before the safe output.
    pub dac_code: i32,
    /// The measured value, in the unit of the cause.
    pub measured: i64,
    /// The limit that it passed.
    pub limit: i64,
    /// The same in a sentence.
    pub message: String,
}

impl AxisReport {
    fn new(status: &AxisStatus, period_ns: u64) -> Self {
        Self {
            state: status.state.name(),
            peak_error_counts: status.peak_error_counts,
            fault: status.first_fault.map(|fault| FaultReport {
                cause: fault.cause.name(),
                tick: fault.tick,
                t_s: seconds(fault.tick * period_ns),
                setpoint_counts: fault.values.setpoint,
                position_counts: fault.values.position,
                error_counts: fault.values.error,
                dac_code: fault.values.code,
                measured: fault.values.measured,
                limit: fault.values.limit,
                message: fault.to_string(),
            }),
        }
    }
}

/// What the rows tell of a run, which the plant's own observer does not see.
#[derive(Debug)]
pub(crate) struct RowFigures<S = Seen> {
    pub(crate) rows: u64,
    pub(crate) squared_acc_error: f64,
    pub(crate) max_abs_dac_code: Option<f64>,
    pub(crate) seen: S,
}

/// That, collected from row to row.
pub(crate) type RowSums = RowFigures<SeenRows<One>>;

impl RowSums {
    pub(crate) fn new(case: &Case) -> Self {
        Self {
            rows: 0,
            squared_acc_error: 0.0,
            max_abs_dac_code: None,
            seen: SeenRows::new(Window::of(case)),
        }
    }

    /// Takes in a row with the count that it was computed from, if there was
    /// one.
    pub(crate) fn add(&mut self, row: &Row, count: Option<f64>) {
        let error = row.acc_mps2 - row.acc_ref_mps2;
        self.squared_acc_error += error * error;
        if let Some(sample) = row.sample {
            let before = self.max_abs_dac_code.unwrap_or(0.0);
            self.max_abs_dac_code = Some(before.max(sample.dac_code.abs()));
        }
        let code = row.sample.map(|sample| sample.dac_code);
        let sample = [code, count].map(|steps| steps.unwrap_or(f64::NAN));
        self.seen.add(One, self.rows, sample, row.x_m);
        self.rows += 1;
    }

    /// The figures of all rows.
    pub(crate) fn figures(&self, end: &EndOfCommand) -> RowFigures {
        let line = self.seen.line();
        let at_rest = self.seen.at_rest(One, &line, end.x_ref_m);
        RowFigures {
            rows: self.rows,
            squared_acc_error: self.squared_acc_error,
            max_abs_dac_code: self.max_abs_dac_code,
            seen: self.seen.of(0, &line, &at_rest),
        }
    }
}

/// The command as it was over a run, seen from its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EndOfCommand {
    /// Where it ends; at rest it stands there.
    pub(crate) x_ref_m: f64,
    /// sup of |ẍ_ref|.
    pub(crate) peak_mps2: f64,
}

impl EndOfCommand {
    pub(crate) fn of(motion: &Motion, duration_ns: u64) -> Self {
        let end_s = seconds(duration_ns);
        Self {
            x_ref_m: motion.at(end_s).displacement_m,
            peak_mps2: motion.peak_acceleration_until_mps2(end_s),
        }
    }
}

/// Facts at the end of a run.
#[derive(Debug)]
pub(crate) struct EndOfRun<'a> {
    pub(crate) case: &'a Case,
    pub(crate) command: EndOfCommand,
    pub(crate) solver: &'static str,
    pub(crate) state: plant::State,
    pub(crate) extremes: &'a Extremes,
    pub(crate) rows: &'a RowFigures,
    /// Time under a held command at its limit, of the voltage and of the current \[ns\].
    pub(crate) held_limit_ns: [u64; 2],
    /// Every change of contact, if they were kept.
    pub(crate) events: Option<&'a [ContactChange]>,
    /// Last report of the axis.
    pub(crate) axis: Option<AxisStatus>,
    /// Report of its chip.
    pub(crate) chip: Option<ChipReport>,
    pub(crate) loops: LoopFigures,
}

impl EndOfRun<'_> {
    /// The figures and the verdicts on them.
    pub(crate) fn summary(&self) -> Summary {
        let mut summary = self.figures();
        summary.verdicts = budget::verdicts(self.case, |key| summary.figure(key));
        summary
    }

    fn figures(&self) -> Summary {
        let (case, extremes) = (self.case, self.extremes);
        let pitch = case.axis.transmission.screw_pitch_m_per_rad;
        let EndOfCommand { x_ref_m, peak_mps2 } = self.command;
        let x_m = pitch * self.state.gamma_rad();
        let beta_rad = self.state.beta_rad - case.start_rad();
        let duration_s = seconds(case.run.duration_ns);
        let resistance_ohm = case.axis.motor.resistance_ohm;
        let peak_abs_acc_mps2 = extremes.peak_abs_acceleration_mps2;
        let seen = &self.rows.seen;
        let (rest, ripple) = (seen.rest, seen.rest.map(|rest| rest.ripple));
        let (axis, period_ns) = (self.axis, case.controller.sample_time_ns);
        // From this rung on codes and counts are whole numbers.
        let whole_numbers = case.controller.law >= Law::Quantised;
        let steps_at_rest = rest.filter(|_| whole_numbers);
        Summary {
            name: case.name.clone(),
            law: case.controller.law.name(),
            solver: self.solver,
            keys_without_effect: case.keys_without_effect.clone(),
            template_values: case.template_values.clone(),
            peak_abs_acc_mps2,
            peak_acc_overshoot_mps2: peak_abs_acc_mps2 - peak_mps2,
            rms_acc_error_mps2: (self.rows.squared_acc_error / whole(self.rows.rows.max(1))).sqrt(),
            peak_following_error_mm: 1e3 * extremes.peak_following_error_m,
            final_error_um: 1e6 * (x_ref_m - x_m),
            peak_motor_following_error_mm: 1e3 * extremes.peak_motor_following_error_m,
            final_motor_error_um: 1e6 * (x_ref_m - pitch * beta_rad),
            settling_time_s: self.settling_time_s(x_m),
            contact_changes: extremes.contact_changes,
            impacts: extremes.impacts,
            hardest_impact_radps: extremes.hardest_impact_radps,
            joint_loss_j: extremes.joint_loss_j,
            peak_abs_voltage_v: extremes.peak_abs_voltage_v,
            voltage_saturated_s: seconds(self.held_limit_ns[0]) + extremes.voltage_limited_s,
            peak_abs_current_a: extremes.peak_abs_current_a,
            rms_current_a: (extremes.armature_loss_j / (resistance_ohm * duration_s)).sqrt(),
            energy_j: extremes.electrical_energy_j,
            mean_power_w: extremes.electrical_energy_j / duration_s,
            peak_power_w: extremes.peak_abs_power_w,
            current_limited_s: seconds(self.held_limit_ns[1]) + extremes.current_limited_s,
            max_abs_dac_code: self.rows.max_abs_dac_code,
            dac_bits_used: whole_numbers.then(|| seen.codes.signed_bits()),
            encoder_bits_used: whole_numbers.then(|| seen.counts.bits_of_width()),
            rest_ripple_um: ripple.map(|ripple| ripple.ripple_um),
            limit_cycle_um: ripple.map(|ripple| ripple.limit_cycle_um),
            limit_cycle_period_s: ripple.and_then(|ripple| ripple.limit_cycle_period_s),
            rest_dac_codes: steps_at_rest.map(|rest| rest.codes.width()),
            rest_encoder_counts: steps_at_rest.map(|rest| rest.counts.width()),
            rest_error_max_um: rest.map(|rest| rest.error_max_um),
            rest_error_rms_um: rest.map(|rest| rest.error_rms_um),
            loops: self.loops,
            faults: axis.map(|axis| axis.faults),
            axis: axis.map(|axis| AxisReport::new(&axis, period_ns.unwrap_or(0))),
            chip: self.chip.clone(),
            events: self.events.filter(|_| case.run.events).map(|events| {
                let event = |e: &ContactChange| (e.time_s, e.from.sign(), e.to.sign());
                events.iter().map(event).collect()
            }),
            verdicts: Vec::new(),
            digits_that_hold: BTreeMap::new(),
        }
    }

    fn settling_time_s(&self, x_m: f64) -> Option<f64> {
        let (motion, band_um) = (&self.case.motion, self.case.run.settling_band_um);
        let outside = |x_m: f64| (motion.travel_m() - x_m).abs() > 1e-6 * band_um;
        if outside(x_m) {
            return None;
        }
        let last_s = self.extremes.last_outside_band_s.unwrap_or(0.0);
        Some((last_s - motion.end_s()).max(0.0))
    }
}

/// A count as a figure; exact below 2^53.
fn whole(n: u64) -> f64 {
    n as f64
}
