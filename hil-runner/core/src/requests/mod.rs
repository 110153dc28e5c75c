//! The requests of a page: a run file with `--set` values, and what is asked about it.

mod answer;

use std::collections::BTreeMap;

use crate::budget::Verdict;
use crate::case::Law;
use crate::error::{RunError, explain, refusals};
use crate::number;
use crate::report::{CaseReport, FigureRow, LoopReport, Traces};
use crate::run::{CaseRun, RunOptions};
use crate::runfile::{RunFile, RunFileErrors, with_sets};
use serde::Deserialize;
use serde_json::{Value, json};

pub use answer::Answer;

/// A run file, and what is to be done with it.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Request {
    /// Name of the file, for messages.
    pub name: String,
    /// Its text.
    pub text: String,
    /// Values of keys, each as after `--set`.
    pub sets: Vec<String>,
    /// Texts of the files that it names, by the path that it gives.
    pub beside: BTreeMap<String, String>,
    /// True for the curves of the run.
    pub columns: bool,
    /// True for the curves of the linear loop.
    pub loops: bool,
    /// True for a second run, which tells the digits that hold.
    pub confirm: bool,
    /// True for all that `--summary` writes besides.
    pub summary: bool,
}

impl Request {
    fn file(&self) -> Result<RunFile, RunFileErrors> {
        RunFile::parse(&self.name, &self.text, &self.sets, |_: &str, path: &str| {
            let found = self.beside.get(path).cloned();
            found.ok_or_else(|| "the page does not carry it".to_owned())
        })
    }
}

fn refused(errors: RunFileErrors) -> Box<Answer> {
    Box::new(Answer::errors(&[errors]))
}

/// Reads a request and answers it.
fn answer(bytes: &[u8], of: fn(&Request) -> Result<Answer, Box<Answer>>) -> Answer {
    match serde_json::from_slice(bytes) {
        Ok(request) => of(&request).unwrap_or_else(|errors| *errors),
        Err(error) => Answer::error(&format!("the page's request is no request: {error}")),
    }
}

/// The run file as a form.
pub fn describe(bytes: &[u8]) -> Answer {
    answer(bytes, |request| {
        let file = request.file().map_err(refused)?;
        Ok(Answer::of(json!({
            "sections": file.form(),
            "rungs": Law::ALL.map(Law::name),
        })))
    })
}

/// The text of the run file with the sets in it, its comments kept.
pub fn save(bytes: &[u8]) -> Answer {
    answer(bytes, |request| {
        request.file().map_err(refused)?;
        let text = with_sets(&request.name, &request.text, &request.sets).map_err(refused)?;
        Ok(Answer::of(json!({"text": text})))
    })
}

/// A run of the case.
pub fn simulate(bytes: &[u8]) -> Answer {
    answer(bytes, |request| {
        let file = request.file().map_err(refused)?;
        let options = RunOptions {
            plot: request.columns,
            ..RunOptions::default()
        };
        let told = |error: RunError| match refusals(&file, &error).as_slice() {
            [] => Box::new(Answer::error(&explain(&file, &error))),
            keys => Box::new(Answer::errors(keys)),
        };
        let mut run = CaseRun::new(&file.case, options, &mut |_| Ok(())).map_err(told)?;
        if request.confirm {
            run.confirm(options, &mut |_| Ok(())).map_err(told)?;
        }
        Ok(shown(&run, request))
    })
}

/// A run as the page shows it.
fn shown(run: &CaseRun, request: &Request) -> Answer {
    let report = CaseReport::without_curves(run);
    let mut answer = Answer::of(json!({
        "name": report.name,
        "law": report.law,
        "solver": report.solver,
        "figures": report.figures.iter().map(figure).collect::<Vec<_>>(),
        "verdicts": report.verdicts.iter().map(|of| verdict(of, &report.figures)).collect::<Vec<_>>(),
        "reserved": report.reserved,
        "warnings": report.warnings,
        "parameters": report.parameters,
        "summary": request.summary.then_some(&run.outcome.summary),
        "loops": request.loops.then(|| LoopReport::of(&run.case)),
    }));
    if request.columns {
        add_traces(&mut answer, &Traces::of(&run.case, &run.outcome));
    }
    answer
}

fn figure(row: &FigureRow) -> Value {
    json!({
        "key": row.key,
        "label": row.label,
        "unit": row.unit,
        "value": row.value,
        "shown": number::shown(row.value, row.digits),
    })
}

fn verdict(of: &Verdict, figures: &[FigureRow]) -> Value {
    let row = figures.iter().find(|row| row.key == of.figure);
    let digits = row.and_then(|row| row.digits);
    let margin_digits = of.margin_digits(digits);
    json!({
        "figure": of.figure,
        "label": row.map(|row| &row.label),
        "unit": row.map(|row| &row.unit),
        "value": of.value,
        "shown": number::shown(of.value, digits),
        "limit": of.limit,
        "shown_limit": number::table(of.limit),
        "margin": of.margin,
        "shown_margin": number::shown(of.margin, margin_digits),
        "at_least": of.at_least,
        "default": of.default,
        "pass": of.pass,
    })
}

fn add_traces(answer: &mut Answer, traces: &Traces) {
    answer.add("t_s", &traces.t_s);
    answer.add("acc_ref_mps2", &traces.acc_ref_mps2);
    answer.add("acc_mps2", &traces.acc_mps2);
    answer.add("x_ref_m", &traces.x_ref_m);
    answer.add("x_m", &traces.x_m);
    answer.add("v_ref_mps", &traces.v_ref_mps);
    answer.add("v_mps", &traces.v_mps);
    answer.add("following_error_mm", &traces.following_error_mm);
    answer.add("motor_voltage_v", &traces.motor_voltage_v);
    answer.add("current_a", &traces.current_a);
    for (name, column) in [("dac_code", &traces.dac_code), ("gap_deg", &traces.gap_deg)] {
        if let Some(column) = column {
            answer.add(name, column);
        }
    }
    answer.json["traces"] = json!({
        "voltage_held": traces.voltage_held,
        "voltage_limit_v": traces.voltage_limit_v,
        "code_limits": traces.code_limits,
        "backlash_half_deg": traces.backlash_half_deg,
        "contact_intervals": traces.contact_intervals,
        "impacts_s": traces.impacts_s,
    });
}
