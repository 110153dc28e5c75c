//! A small report for the tests: shapes like a run's, no simulation.

use hil_core::report::{
    CaseReport, ContactInterval, FigureRow, HostTiming, LadderReport, LadderRung, Parameter,
    Report, Traces, VerdictRow,
};

/// Two cases, one of them rigid and continuous with holes, and a ladder.
pub(super) fn report() -> Report {
    let rigid = CaseReport {
        name: "rigid".into(),
        law: "continuous".into(),
        figures: vec![figure("settling_time_s", "Settling time", "s", None)],
        verdicts: Vec::new(),
        host_timing: None,
        reserved: None,
        warnings: Vec::new(),
        traces: Traces {
            dac_code: None,
            code_limits: None,
            gap_deg: None,
            voltage_held: false,
            current_a: vec![f64::NAN; 301],
            contact_intervals: Vec::new(),
            impacts_s: Vec::new(),
            ..traces()
        },
        ..elastic()
    };
    Report {
        title: "Sample".into(),
        command_line: "hil-runner run sample.toml --report sample.html".into(),
        generated_by: "hil-runner 0.0.0".into(),
        reserved: None,
        cases: vec![elastic(), rigid],
        ladder: Some(ladder()),
    }
}

fn elastic() -> CaseReport {
    CaseReport {
        name: "elastic".into(),
        law: "firmware".into(),
        solver: "dopri5".into(),
        parameters: vec![Parameter {
            label: "Sample time Δt".into(),
            value: "1".into(),
            unit: "ms".into(),
        }],
        verdicts: vec![
            verdict("peak_abs_acc_mps2", "m/s²", Some(1.588_165_799), 3.2, true),
            verdict("final_error_um", "µm", Some(-650.535_923), 50.0, false),
            verdict("settling_time_s", "s", None, 0.5, false),
        ],
        figures: vec![
            figure("peak_abs_acc_mps2", "Peak |ẍ|", "m/s²", Some(1.588_165_799)),
            figure("settling_time_s", "Settling time", "s", None),
        ],
        host_timing: Some(HostTiming {
            steps: 1501,
            median_us: 0.04,
            p99_us: 0.09,
            max_us: 3.2,
            sample_time_us: 1000.0,
        }),
        reserved: None,
        warnings: vec!["The code reaches its range.".into()],
        traces: traces(),
    }
}

fn figure(key: &str, label: &str, unit: &str, value: Option<f64>) -> FigureRow {
    FigureRow {
        key: key.into(),
        label: label.into(),
        unit: unit.into(),
        value,
        digits: None,
    }
}

fn verdict(figure: &str, unit: &str, value: Option<f64>, limit: f64, pass: bool) -> VerdictRow {
    VerdictRow {
        figure: figure.into(),
        unit: unit.into(),
        value,
        limit,
        margin: value.map(|value| limit - value.abs()),
        pass,
        default: figure == "peak_abs_acc_mps2",
        digits: None,
        margin_digits: None,
    }
}

/// A sine as command, the carriage a little late, one contact spike.
fn traces() -> Traces {
    let t_s: Vec<f64> = (0..=300).map(|i| f64::from(i) * 5e-3).collect();
    let curve = |f: fn(f64) -> f64| t_s.iter().map(|&t| f(t)).collect::<Vec<_>>();
    let mut acc_mps2 = curve(|t| 1.6 * (6.2 * (t - 0.02)).sin());
    acc_mps2[100] = -1.9;
    Traces {
        acc_ref_mps2: curve(|t| 1.6 * (6.2 * t).sin()),
        acc_mps2,
        following_error_mm: curve(|t| 3.0 * (6.2 * t).cos()),
        motor_voltage_v: curve(|t| 90.0 * (6.2 * t).sin()),
        voltage_held: true,
        current_a: curve(|t| 4.0 * (6.2 * t).cos()),
        dac_code: Some(curve(|t| (6147.0 * (6.2 * t).sin()).round())),
        gap_deg: Some(curve(|t| 1.2 * (6.2 * t).cos())),
        voltage_limit_v: 150.0,
        code_limits: Some((-8192.0, 8191.0)),
        backlash_half_deg: 1.0,
        contact_intervals: vec![ContactInterval {
            start_s: 0.1,
            end_s: 0.4,
            contact: 1,
        }],
        impacts_s: vec![0.5],
        t_s,
    }
}

fn ladder() -> LadderReport {
    let Traces { t_s, acc_mps2, .. } = traces();
    let difference = |size: f64| Some(t_s.iter().map(|t| size * (40.0 * t).sin()).collect());
    let rung = |name: &str, size: Option<f64>| LadderRung {
        name: name.into(),
        adds: "one effect".into(),
        peak_abs_acc_mps2: (Some(1.9), None),
        peak_following_error_mm: (Some(3.0), None),
        final_error_um: (Some(-12.0), None),
        contact_changes: (Some(2.0), None),
        rms_acc_diff_mps2: (size, None),
        rms_pos_diff_um: (size, None),
        warnings: Vec::new(),
        t_s: t_s.clone(),
        acc_mps2: acc_mps2.clone(),
        acc_diff_mps2: size.and_then(difference),
        pos_diff_um: size.and_then(difference),
    };
    LadderReport {
        case: "elastic".into(),
        warnings: Vec::new(),
        rungs: vec![
            rung("continuous", None),
            rung("sampled", Some(0.1)),
            rung("firmware", Some(0.0)),
        ],
        t_s,
    }
}
