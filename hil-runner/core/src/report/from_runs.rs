//! Turns runs into what the report shows.

use plant::{ContactChange, Joint};

use super::{
    CaseReport, ContactInterval, FigureRow, HostTiming, LadderReport, LadderRung, Report, Traces,
    VerdictRow,
};
use super::{chip, parameters};
use crate::case::{Case, Law};
use crate::case_run::{CaseRun, keys_without_effect};
use crate::figures;
use crate::ladder::{GRID_NS, Rung};
use crate::record::PlotPoint;
use crate::reservation::kept_but;

use crate::run::Outcome;
use crate::time::seconds;

/// The report of one or more runs.
pub fn report(title: &str, command_line: &str, runs: &[CaseRun]) -> Report {
    let named: Vec<_> = runs.iter().map(CaseRun::named_reservations).collect();
    Report {
        title: title.to_owned(),
        command_line: command_line.to_owned(),
        generated_by: concat!("hil-runner ", env!("CARGO_PKG_VERSION")).to_owned(),
        cases: runs.iter().map(case_report).collect(),
        reserved: kept_but(&named),
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
        parameters: parameters::of(case)
            .into_iter()
            .chain(outcome.gains.iter().flat_map(parameters::of_words))
            .chain(summary.chip.iter().flat_map(chip::parameters))
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
                digits: summary.digits(&verdict.figure),
                margin_digits: verdict.margin_digits(summary.digits(&verdict.figure)),
            })
            .collect(),
        figures: figures::SUMMARY_FIGURES
            .iter()
            .map(|figure| FigureRow {
                key: figure.key.to_owned(),
                label: figure.label.to_owned(),
                unit: figure.unit.to_owned(),
                value: summary.figure(figure.key),
                digits: summary.digits(figure.key),
            })
            .chain(chip::figures(summary))
            .chain(run.timing_verdict.iter().map(|verdict| FigureRow {
                key: figures::HOST_STEP_P99.key.to_owned(),
                label: figures::HOST_STEP_P99.label.to_owned(),
                unit: figures::HOST_STEP_P99.unit.to_owned(),
                value: verdict.value,
                digits: None,
            }))
            .collect(),
        host_timing: run.timing.map(|timing| HostTiming {
            steps: u64::try_from(timing.steps).unwrap_or(u64::MAX),
            median_us: timing.median_us,
            p99_us: timing.p99_us,
            max_us: timing.max_us,
            sample_time_us: period_us.unwrap_or(f64::NAN),
        }),
        reserved: kept_but(&[run.named_reservations()]),
        warnings: run.warnings.clone(),
        traces: traces(case, &outcome.plot, &outcome.contact_changes),
    }
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
            1e3 * (case.motion.at(p.t_s).displacement_m - pitch * p.state.gamma_rad())
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
        warnings: Vec::from_iter(keys_without_effect(rungs.iter().map(|rung| &rung.case))),
        t_s: ticks.map(|tick| seconds(tick * GRID_NS)).collect(),
        rungs: rungs
            .iter()
            .zip(below)
            .map(|(rung, below)| ladder_rung(rung, below))
            .collect(),
    }
}

fn ladder_rung(rung: &Rung, below: Option<&Rung>) -> LadderRung {
    let Outcome {
        summary,
        grid,
        plot,
        ..
    } = &rung.outcome;
    let held = |key: &str| (summary.figure(key), summary.digits(key));
    let [acc_digits, position_digits] = rung.difference_digits;
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
        name: rung.name(),
        adds: rung.adds().to_owned(),
        peak_abs_acc_mps2: held("peak_abs_acc_mps2"),
        peak_following_error_mm: held("peak_following_error_mm"),
        final_error_um: held("final_error_um"),
        contact_changes: held("contact_changes"),
        rms_acc_diff_mps2: (rung.difference.map(|d| d.rms_acc_mps2), acc_digits),
        rms_pos_diff_um: (rung.difference.map(|d| d.rms_position_um), position_digits),
        warnings: rung.warnings(),
        t_s: plot.iter().map(|point| point.t_s).collect(),
        acc_mps2: plot.iter().map(|point| point.acc_mps2).collect(),
        acc_diff_mps2: difference(|u, l| u - l, true),
        pos_diff_um: difference(|u, l| u - l, false),
    }
}
