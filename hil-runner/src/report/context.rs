//! What the templates see: the tables' contents, field by field.
//!
//! Curves stay out; the page carries them as JSON, and 10⁵ template values
//! for nothing would be the slowest part of a report.

use minijinja::{Value, context};

use hil_core::report::{
    CaseReport, FigureRow, HostTiming, LadderReport, LadderRung, Parameter, Report, VerdictRow,
};

/// Everything the page shows but plots and assets.
pub(super) fn page_context(report: &Report) -> Value {
    let verdicts = || report.cases.iter().flat_map(|case| &case.verdicts);
    let cases = report.cases.iter().zip(1_u32..);
    context! {
        title => &report.title,
        command_line => &report.command_line,
        generated_by => &report.generated_by,
        standing => report.passed().map(|passed| standing(passed, report.reserved.is_some())),
        reserved => &report.reserved,
        verdict_count => verdicts().count(),
        failed_count => verdicts().filter(|verdict| !verdict.pass).count(),
        default_limits => verdicts().any(|verdict| verdict.default),
        cases => cases.map(|(case, number)| case_context(case, number)).collect::<Vec<_>>(),
        comparison => comparison(report),
        ladder => report.ladder.as_ref().map(ladder_context),
    }
}

/// Which of the three banners stands over a page or a case.
fn standing(passed: bool, reserved: bool) -> &'static str {
    match (passed, reserved) {
        (false, _) => "fail",
        (true, true) => "reserved",
        (true, false) => "pass",
    }
}

/// `number` counts from 1 and names the case's section in links.
fn case_context(case: &CaseReport, number: u32) -> Value {
    let traces = &case.traces;
    context! {
        number => number,
        name => &case.name,
        law => &case.law,
        solver => &case.solver,
        standing => case.passed().map(|passed| standing(passed, case.reserved.is_some())),
        reserved => &case.reserved,
        parameters => case.parameters.iter().map(parameter_context).collect::<Vec<_>>(),
        verdicts => case.verdicts.iter().map(|row| verdict_context(row, case)).collect::<Vec<_>>(),
        figures => case.figures.iter().map(figure_context).collect::<Vec<_>>(),
        host_timing => case.host_timing.as_ref().map(timing_context),
        warnings => case.warnings.clone(),
        has_code => traces.dac_code.is_some(),
        has_gap => traces.gap_deg.is_some(),
        has_backlash => traces.backlash_half_deg > 0.0,
        has_impacts => !traces.impacts_s.is_empty(),
    }
}

fn parameter_context(row: &Parameter) -> Value {
    context! { label => &row.label, value => &row.value, unit => &row.unit }
}

fn figure_context(row: &FigureRow) -> Value {
    context! { key => &row.key, label => &row.label, unit => &row.unit, value => row.value, digits => row.digits }
}

/// The verdict takes its label from the figure it judges; a budget on
/// something outside the summary (host times) shows its key.
fn verdict_context(row: &VerdictRow, case: &CaseReport) -> Value {
    let figure = case.figures.iter().find(|figure| figure.key == row.figure);
    context! {
        figure => &row.figure,
        label => figure.map(|figure| &figure.label),
        unit => &row.unit,
        value => row.value,
        limit => row.limit,
        margin => row.margin,
        pass => row.pass,
        default => row.default,
        digits => row.digits,
        margin_digits => row.margin_digits,
    }
}

fn timing_context(timing: &HostTiming) -> Value {
    context! {
        steps => timing.steps,
        median_us => timing.median_us,
        p99_us => timing.p99_us,
        max_us => timing.max_us,
        sample_time_us => timing.sample_time_us,
    }
}

/// Figures as rows, cases as columns. A row stands where its key first
/// appears, so that cases with different figures still line up.
fn comparison(report: &Report) -> Vec<Value> {
    let mut rows: Vec<&FigureRow> = Vec::new();
    for figure in report.cases.iter().flat_map(|case| &case.figures) {
        if rows.iter().all(|row| row.key != figure.key) {
            rows.push(figure);
        }
    }
    let value_of = |case: &CaseReport, key: &str| {
        let figure = case.figures.iter().find(|figure| figure.key == key);
        figure.map_or((None, None), |figure| (figure.value, figure.digits))
    };
    let across = |row: &FigureRow| {
        let values = report.cases.iter().map(|case| value_of(case, &row.key));
        context! { values => values.collect::<Vec<_>>(), ..figure_context(row) }
    };
    rows.into_iter().map(across).collect()
}

fn ladder_context(ladder: &LadderReport) -> Value {
    context! {
        case => &ladder.case,
        warnings => &ladder.warnings,
        rungs => ladder.rungs.iter().map(rung_context).collect::<Vec<_>>(),
    }
}

fn rung_context(rung: &LadderRung) -> Value {
    context! {
        name => &rung.name,
        adds => &rung.adds,
        peak_abs_acc_mps2 => rung.peak_abs_acc_mps2,
        peak_following_error_mm => rung.peak_following_error_mm,
        final_error_um => rung.final_error_um,
        contact_changes => rung.contact_changes,
        rms_acc_diff_mps2 => rung.rms_acc_diff_mps2,
        rms_pos_diff_um => rung.rms_pos_diff_um,
        warnings => &rung.warnings,
    }
}
