//! Turns runs into what the report shows.

use plant::{ContactChange, Joint};

use crate::bench::CaseRun;
use crate::case::{Case, Law};
use crate::figures;
use crate::ladder::{GRID_NS, Rung};
use crate::quantise::QuantisedGains;
use crate::record::PlotPoint;
use crate::report::{
    CaseReport, ContactInterval, FigureRow, HostTiming, LadderReport, LadderRung, Parameter,
    Report, Traces, VerdictRow,
};

use crate::time::seconds;

/// The report of one or more runs.
pub fn report(title: &str, command_line: &str, runs: &[CaseRun]) -> Report {
    Report {
        title: title.to_owned(),
        command_line: command_line.to_owned(),
        generated_by: concat!("hil-runner ", env!("CARGO_PKG_VERSION")).to_owned(),
        cases: runs.iter().map(case_report).collect(),
        ladder: None,
    }
}

/// The report of a ladder.
pub fn ladder_report(command_line: &str, rungs: &[Rung]) -> Report {
    let name = rungs.first().map_or("", |rung| &rung.outcome.summary.name);
    Report {
        ladder: Some(ladder(name, rungs)),
        ..report(&format!("Ladder of {name}"), command_line, &[])
    }
}

fn case_report(run: &CaseRun) -> CaseReport {
    let (case, outcome) = (&run.case, &run.outcome);
    let summary = &outcome.summary;
    let period_us = case.controller.sample_time_ns.map(|ns| 1e6 * seconds(ns));
    CaseReport {
        name: summary.name.clone(),
        law: summary.law.to_owned(),
        solver: summary.solver.to_owned(),
        parameters: parameters(case)
            .into_iter()
            .chain(run.words.iter().flat_map(words))
            .collect(),
        verdicts: run
            .verdicts()
            .map(|verdict| VerdictRow {
                figure: verdict.figure.clone(),
                unit: figures::unit(&verdict.figure).to_owned(),
                value: verdict.value,
                limit: verdict.limit,
                margin: verdict.margin,
                pass: verdict.pass,
                default: verdict.default,
            })
            .collect(),
        figures: figures::SUMMARY_FIGURES
            .iter()
            .map(|figure| FigureRow {
                key: figure.key.to_owned(),
                label: figure.label.to_owned(),
                unit: figure.unit.to_owned(),
                value: summary.figure(figure.key),
            })
            .collect(),
        host_timing: run.timing.map(|timing| HostTiming {
            steps: u64::try_from(timing.steps).unwrap_or(u64::MAX),
            median_us: timing.median_us,
            p99_us: timing.p99_us,
            max_us: timing.max_us,
            sample_time_us: period_us.unwrap_or(f64::NAN),
        }),
        warnings: run.warnings.clone(),
        traces: traces(case, &outcome.plot, &outcome.contact_changes),
    }
}

/// The settings worth seeing beside the result.
fn parameters(case: &Case) -> Vec<Parameter> {
    let parameter = |label: &str, value: f64, unit: &str| Parameter {
        label: label.to_owned(),
        value: crate::report::number::table(value),
        unit: unit.to_owned(),
    };
    let mut parameters = vec![
        parameter("Travel h", 1e3 * case.motion.travel_m(), "mm"),
        parameter("Motion time", case.motion.end_s(), "s"),
        parameter("Gain Kp", case.controller.gains.kp, "codes/count"),
        parameter("Gain Ki", case.controller.gains.ki_per_s, "codes/(count·s)"),
        parameter("Gain Kd", case.controller.gains.kd_s, "codes·s/count"),
        parameter("Encoder K_enc", case.encoder.counts_per_rad, "counts/rad"),
        parameter("DAC step K_dac", 1e3 * case.dac.step_v, "mV"),
        parameter("Amplifier limit", case.amplifier.voltage_limit_v, "V"),
    ];
    if let (Some(period_ns), false) = (
        case.controller.sample_time_ns,
        case.controller.law == Law::Continuous,
    ) {
        let delay_s = seconds(case.controller.computation_delay_ns);
        parameters.push(parameter("Sample time Δt", 1e3 * seconds(period_ns), "ms"));
        parameters.push(parameter("Computation delay", 1e3 * delay_s, "ms"));
    }
    if case.controller.law >= Law::Quantised {
        parameters.push(parameter("DAC bits", f64::from(case.dac.bits), ""));
    }
    if let Joint::Elastic(joint) = case.axis.transmission.joint {
        let b_deg = joint.backlash_half_rad.to_degrees();
        parameters.push(parameter("Half backlash b", b_deg, "°"));
        parameters.push(parameter(
            "Joint stiffness k",
            joint.stiffness_nm_per_rad,
            "N·m/rad",
        ));
        parameters.push(parameter(
            "Joint damping c",
            joint.damping_nms_per_rad,
            "N·m·s/rad",
        ));
    }
    parameters.push(parameter(
        "Carriage mass M",
        case.axis.carriage.mass_kg,
        "kg",
    ));
    parameters
}

/// The gains in the firmware's words, with what rounding costs.
fn words(words: &QuantisedGains) -> Vec<Parameter> {
    let gains = words.gains.iter().map(|gain| Parameter {
        label: format!("Word of {}", gain.name()),
        value: format!("{} ({:+.1e})", gain.word, gain.relative_error()),
        unit: "codes/count (rounding)".to_owned(),
    });
    let limit = Parameter {
        label: "Declared range of |e|".to_owned(),
        value: words.pid.error_limit().to_string(),
        unit: "counts".to_owned(),
    };
    gains.chain([limit]).collect()
}

fn traces(case: &Case, points: &[PlotPoint], changes: &[ContactChange]) -> Traces {
    let column = |of: &dyn Fn(&PlotPoint) -> f64| points.iter().map(of).collect::<Vec<f64>>();
    let pitch = case.axis.transmission.screw_pitch_m_per_rad;
    let acc_ref = |(i, point): (usize, &PlotPoint)| {
        // Of two points at one instant the first shows the limit before.
        if points.get(i + 1).is_some_and(|next| next.t_s == point.t_s) {
            case.motion.acceleration_before_mps2(point.t_s)
        } else {
            case.motion.at(point.t_s).acceleration_mps2
        }
    };
    let end_s = seconds(case.run.duration_ns);
    let has_codes = case.controller.law != Law::Continuous;
    let elastic = match case.axis.transmission.joint {
        Joint::Rigid => None,
        Joint::Elastic(joint) => Some(joint),
    };
    Traces {
        t_s: column(&|p| p.t_s),
        acc_ref_mps2: points.iter().enumerate().map(acc_ref).collect(),
        acc_mps2: column(&|p| p.acc_mps2),
        following_error_mm: column(&|p| {
            1e3 * (case.motion.at(p.t_s).displacement_m - pitch * p.state.gamma_rad)
        }),
        motor_voltage_v: column(&|p| p.voltage_v),
        voltage_held: has_codes,
        current_a: column(&|p| p.state.current_a),
        dac_code: has_codes.then(|| column(&|p| p.dac_code.unwrap_or(0.0))),
        gap_deg: elastic.map(|_| column(&|p| p.state.epsilon_rad.to_degrees())),
        voltage_limit_v: case.amplifier.voltage_limit_v,
        code_limits: (case.controller.law >= Law::Quantised).then(|| {
            (
                f64::from(case.dac.code_min()),
                f64::from(case.dac.code_max()),
            )
        }),
        backlash_half_deg: elastic.map_or(0.0, |joint| joint.backlash_half_rad.to_degrees()),
        contact_intervals: contact_intervals(points, changes, end_s),
        impacts_s: changes
            .iter()
            .filter(|c| c.impact)
            .map(|c| c.time_s)
            .collect(),
    }
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

fn ladder(case: &str, rungs: &[Rung]) -> LadderReport {
    let rows = rungs.first().map_or(0, |rung| rung.outcome.grid.len());
    let ticks = 0..u64::try_from(rows).unwrap_or(0);
    let below = std::iter::once(None).chain(rungs.iter().map(Some));
    LadderReport {
        case: case.to_owned(),
        t_s: ticks.map(|tick| seconds(tick * GRID_NS)).collect(),
        rungs: rungs
            .iter()
            .zip(below)
            .map(|(rung, below)| ladder_rung(rung, below))
            .collect(),
    }
}

fn ladder_rung(rung: &Rung, below: Option<&Rung>) -> LadderRung {
    let (summary, grid) = (&rung.outcome.summary, &rung.outcome.grid);
    let difference = |of: fn(f64, f64) -> f64, acc: bool| {
        below.map(|below| {
            grid.iter()
                .zip(&below.outcome.grid)
                .map(|(u, l)| {
                    if acc {
                        of(u.acc_mps2, l.acc_mps2)
                    } else {
                        1e6 * of(u.x_m, l.x_m)
                    }
                })
                .collect()
        })
    };
    LadderRung {
        name: rung.law.name().to_owned(),
        adds: rung.law.adds().to_owned(),
        peak_abs_acc_mps2: Some(summary.peak_abs_acc_mps2),
        peak_following_error_mm: Some(summary.peak_following_error_mm),
        final_error_um: Some(summary.final_error_um),
        contact_changes: Some(summary.contact_changes),
        rms_acc_diff_mps2: rung.difference.map(|d| d.rms_acc_mps2),
        rms_pos_diff_um: rung.difference.map(|d| d.rms_position_um),
        acc_mps2: grid.iter().map(|point| point.acc_mps2).collect(),
        acc_diff_mps2: difference(|u, l| u - l, true),
        pos_diff_um: difference(|u, l| u - l, false),
    }
}
