//! The curves of one run, as columns.

use plant::{ContactChange, MotionPoint};
use serde::Serialize;

use crate::case::{Case, Law};
use crate::lockstep::Outcome;
use crate::number::{column, column_option, seconds};
use crate::record::PlotPoint;

/// Curves over time; every column has one entry per entry of `t_s`.
///
/// The same time may stand twice: the left and the right limit at a jump, so
/// that jumps and contact spikes are drawn at their true height. A column
/// that is continuous there repeats its value. Numbers that are not finite
/// leave a hole in the curve. Every entry goes into the file, about 80 bytes
/// of it: long runs are for the caller to thin out.
///
/// Serialises rounded to [`PLOT_DIGITS`](crate::number::PLOT_DIGITS)
/// significant digits: this is plot data.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Traces {
    /// Time \[s\], never descending.
    #[serde(serialize_with = "column")]
    pub t_s: Vec<f64>,
    /// Commanded carriage acceleration \[m/s²\].
    #[serde(serialize_with = "column")]
    pub acc_ref_mps2: Vec<f64>,
    /// Carriage acceleration ẍ \[m/s²\].
    #[serde(serialize_with = "column")]
    pub acc_mps2: Vec<f64>,
    /// Commanded displacement of the carriage \[m\].
    #[serde(serialize_with = "column")]
    pub x_ref_m: Vec<f64>,
    /// Displacement of the carriage x = p·γ \[m\].
    #[serde(serialize_with = "column")]
    pub x_m: Vec<f64>,
    /// Commanded velocity of the carriage \[m/s\].
    #[serde(serialize_with = "column")]
    pub v_ref_mps: Vec<f64>,
    /// Velocity of the carriage v = p·γ̇ \[m/s\].
    #[serde(serialize_with = "column")]
    pub v_mps: Vec<f64>,
    /// x_ref − x at the carriage \[mm\].
    #[serde(serialize_with = "column")]
    pub following_error_mm: Vec<f64>,
    /// Motor voltage \[V\].
    #[serde(serialize_with = "column")]
    pub motor_voltage_v: Vec<f64>,
    /// True where the voltage holds its value until the next entry and is drawn
    /// as steps; else it is a continuous curve.
    pub voltage_held: bool,
    /// Armature current \[A\].
    #[serde(serialize_with = "column")]
    pub current_a: Vec<f64>,
    /// DAC code, held until the next entry; `None` on rung `continuous`.
    #[serde(serialize_with = "column_option")]
    pub dac_code: Option<Vec<f64>>,
    /// Joint gap ε = β − γ \[°\]; `None` where the joint is rigid.
    #[serde(serialize_with = "column_option")]
    pub gap_deg: Option<Vec<f64>>,
    /// Amplifier limit V_max \[V\], drawn at plus and minus this value; `None` where there
    /// is none.
    pub voltage_limit_v: Option<f64>,
    /// Lowest and highest DAC code; `None` where the code has no range.
    pub code_limits: Option<(f64, f64)>,
    /// Half backlash b \[°\].
    pub backlash_half_deg: f64,
    /// Times at which the joint carries torque, in order.
    pub contact_intervals: Vec<ContactInterval>,
    /// Times of the impacts: the gap closes \[s\].
    #[serde(serialize_with = "column")]
    pub impacts_s: Vec<f64>,
}

impl Traces {
    /// The curves of a run, of the points that it kept for plots.
    pub fn of(case: &Case, outcome: &Outcome) -> Self {
        let (points, changes) = (&outcome.plot, &outcome.contact_changes);
        let of_points =
            |of: &dyn Fn(&PlotPoint) -> f64| points.iter().map(of).collect::<Vec<f64>>();
        let pitch = case.axis.transmission.screw_pitch_m_per_rad;
        let command: Vec<MotionPoint> = points.iter().map(|p| case.motion.at(p.t_s)).collect();
        let of_command = |of: fn(&MotionPoint) -> f64| command.iter().map(of).collect::<Vec<f64>>();
        let acc_ref = |(i, point): (usize, &PlotPoint)| {
            // Of two points at one instant the first shows the limit before.
            if points.get(i + 1).is_some_and(|next| next.t_s == point.t_s) {
                case.motion.acceleration_before_mps2(point.t_s)
            } else {
                command[i].acceleration_mps2
            }
        };
        let following_error_mm = |(point, command): (&PlotPoint, &MotionPoint)| {
            1e3 * (command.displacement_m - pitch * point.state.gamma_rad())
        };
        let with_command = points.iter().zip(&command);
        let end_s = seconds(case.run.duration_ns);
        let has_codes = case.controller.law != Law::Continuous;
        let joint = case.axis.transmission.joint;
        let has_gap = joint.elastic().is_some();
        let limits = [case.dac.code_min(), case.dac.code_max()].map(f64::from);
        let impacts = changes.iter().filter(|c| c.impact);
        Self {
            t_s: of_points(&|p| p.t_s),
            acc_ref_mps2: points.iter().enumerate().map(acc_ref).collect(),
            acc_mps2: of_points(&|p| p.acc_mps2),
            x_ref_m: of_command(|m| m.displacement_m),
            x_m: of_points(&|p| pitch * p.state.gamma_rad()),
            v_ref_mps: of_command(|m| m.velocity_mps),
            v_mps: of_points(&|p| pitch * p.state.gamma_dot_radps()),
            following_error_mm: with_command.map(following_error_mm).collect(),
            motor_voltage_v: of_points(&|p| p.voltage_v),
            voltage_held: case.holds_the_voltage(),
            current_a: of_points(&|p| p.state.current_a),
            dac_code: has_codes.then(|| of_points(&|p| p.dac_code.unwrap_or(0.0))),
            gap_deg: has_gap.then(|| of_points(&|p| p.state.epsilon_rad.to_degrees())),
            voltage_limit_v: case.voltage_limit_v(),
            code_limits: (case.controller.law >= Law::Quantised).then_some(limits.into()),
            backlash_half_deg: joint.backlash_half_rad().to_degrees(),
            contact_intervals: contact_intervals(points, changes, end_s),
            impacts_s: impacts.map(|c| c.time_s).collect(),
        }
    }
}

/// A time during which the joint rests on one flank.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactInterval {
    /// Begin \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// +1 at ε = +b, −1 at ε = −b.
    pub contact: i8,
}

fn contact_intervals(
    points: &[PlotPoint],
    changes: &[ContactChange],
    end_s: f64,
) -> Vec<ContactInterval> {
    let mut intervals = Vec::new();
    let (mut start_s, mut contact) = (0.0, points.first().map_or(0, |p| p.contact.sign()));
    let ends = changes.iter().map(|c| (c.time_s, c.to.sign()));
    for (time_s, next) in ends.chain([(end_s, 0)]) {
        if contact != 0 {
            intervals.push(ContactInterval {
                start_s,
                end_s: time_s,
                contact,
            });
        }
        (start_s, contact) = (time_s, next);
    }
    intervals
}
