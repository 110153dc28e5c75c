//! Kind `scatter`: one mark per run, by verdict.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::PictureError;
use super::axis::{Axis, Margin, Spacing, extent};
use super::colour::{FAIL, MUTED, PASS};
use super::label::Label;
use super::map::CROSS;
use super::note::Chosen;
use super::reference::{
    Sign, add_base_line, add_limits, legend_of_lines, limit_sign, limits, with_limits,
};
use super::sheet::{Plot, WIDTH, brush, choice, fading, of_marks};
use super::spec::Scatter;

/// Height of the plot \[px\].
const HEIGHT: f64 = 440.0;
/// More runs than this are thinned: those of one verdict whose middles fall into one
/// square of [`SQUARE`] share a mark.
const MOST_MARKS: usize = 4_000;
/// Side of a square \[px\].
const SQUARE: f64 = 4.0;

/// A run's place and verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    row: usize,
    x: f64,
    y: f64,
    pass: Option<bool>,
}

pub(super) fn plot(scatter: &Scatter, chosen: &mut Chosen<'_>) -> Result<Plot, PictureError> {
    let mut runs = runs(scatter, chosen)?;
    let label = Label::of(&scatter.x);
    let span = extent(runs.iter().map(|run| run.x));
    let x = Axis::new(&scatter.x_axis, &label, span, Margin::Around)?;
    let label = Label::of(&scatter.y);
    let log = scatter.y_axis.spacing == Spacing::Log;
    let span = extent(runs.iter().map(|run| run.y));
    let limits = limits(scatter.limit.as_ref(), span, log);
    let span = with_limits(span, &limits, log);
    let y = Axis::new(&scatter.y_axis, &label, span, Margin::Around)?;
    let all = runs.len();
    runs.retain(|run| x.holds(run.x) && y.holds(run.y));
    chosen.left_out.beyond = all - runs.len();
    chosen.tell_left_out("");
    let mut plot = Plot::new(HEIGHT);
    let verdicts = verdicts(&runs);
    plot.marks = marks(&runs, &verdicts, [&x, &y]);
    if plot.marks.len() < runs.len() {
        chosen.notes.push(format!(
            "{} runs, {} marks: runs of one verdict closer than {SQUARE} px share one.",
            runs.len(),
            plot.marks.len()
        ));
    }
    let judged = verdicts.iter().filter(|(_, name, _)| !name.is_empty());
    let (words, looks): (Vec<&String>, Vec<[&str; 2]>) =
        judged.map(|(_, name, look)| (name, *look)).unzip();
    let channel = |at: usize| {
        let range: Vec<&str> = looks.iter().map(|look| look[at]).collect();
        json!({"field": "name", "type": "nominal", "title": null, "scale": {"domain": words, "range": range}})
    };
    let mut encoding = json!({
        "x": x.channel("x"), "y": y.channel("y"),
        "opacity": fading(1.0),
        "tooltip": [{"field": "rows", "title": "row"}, {"field": "x", "title": x.title}, {"field": "y", "title": y.title}],
    });
    let mut mark = json!({"type": "point", "filled": true, "size": 26, "clip": true});
    if words.is_empty() {
        mark["color"] = json!(PASS);
        encoding["opacity"] = json!({"value": 1});
    } else {
        (encoding["color"], encoding["shape"]) = (channel(0), channel(1));
    }
    let mut layer = of_marks(mark, encoding);
    brush(&mut layer, 0, &["x", "y"]);
    if !words.is_empty() {
        choice(&mut layer);
    }
    plot.layers.push(layer);
    let limit = scatter.limit.iter();
    let mut signs: Vec<Sign> = limit.map(|limit| limit_sign(limit, &label)).collect();
    signs.extend(add_base_line(&mut plot, chosen.table, &scatter.x, &x));
    add_limits(&mut plot, &limits, &y, "y");
    plot.layers.extend(legend_of_lines(&signs));
    Ok(plot)
}

/// The runs that have a place on both axes.
fn runs(scatter: &Scatter, chosen: &mut Chosen<'_>) -> Result<Vec<Run>, PictureError> {
    let (table, rows, left_out) = (chosen.table, &chosen.rows, &mut chosen.left_out);
    let x = table.column(&scatter.x)?.numbers()?;
    let y = table.column(&scatter.y)?.numbers()?;
    let pass = table.column_or(scatter.pass.as_ref(), "pass")?;
    let log = [scatter.x_axis.spacing, scatter.y_axis.spacing].map(|of| of == Spacing::Log);
    let mut runs = Vec::new();
    for &row in rows.iter() {
        left_out.of += 1;
        let pass = pass.and_then(|pass| pass.verdict(row));
        let not_above_0 = |x: f64, y: f64| log[0] && x <= 0.0 || log[1] && y <= 0.0;
        match (x[row], y[row]) {
            (Some(x), Some(y)) if not_above_0(x, y) => left_out.not_above_0 += 1,
            (Some(x), Some(y)) => runs.push(Run { row, x, y, pass }),
            _ => left_out.missing += 1,
        }
    }
    Ok(runs)
}

/// A verdict, its words with its runs counted, its colour and its shape.
type Verdict = (Option<bool>, String, [&'static str; 2]);

/// The verdicts of the runs; no words where nobody judges. Those that fail come
/// last, on top.
fn verdicts(runs: &[Run]) -> Vec<Verdict> {
    let judged = runs.iter().any(|run| run.pass.is_some());
    let verdicts = [
        (None, "no verdict", [MUTED, "diamond"]),
        (Some(true), "keeps its limits", [PASS, "circle"]),
        (Some(false), "does not", [FAIL, CROSS]),
    ];
    let named = |(pass, words, look): (Option<bool>, &str, _)| {
        let count = runs.iter().filter(|run| run.pass == pass).count();
        let words = judged.then(|| format!("{words}: {count}"));
        (count > 0).then(|| (pass, words.unwrap_or_default(), look))
    };
    verdicts.into_iter().filter_map(named).collect()
}

/// The marks; where there are many runs those of a square of the plot share one.
fn marks(runs: &[Run], verdicts: &[Verdict], [x, y]: [&Axis; 2]) -> Vec<Value> {
    let thin = runs.len() > MOST_MARKS;
    let square = |axis: &Axis, value: f64, px: f64| (axis.share(value) * px / SQUARE) as usize;
    let mut marks = Vec::new();
    for (pass, name, _) in verdicts {
        let mut of_square: BTreeMap<[usize; 3], Vec<&Run>> = BTreeMap::new();
        for (at, run) in runs.iter().filter(|run| run.pass == *pass).enumerate() {
            let place = match thin {
                true => [square(x, run.x, WIDTH), square(y, run.y, HEIGHT), 0],
                false => [0, 0, at],
            };
            of_square.entry(place).or_default().push(run);
        }
        for runs in of_square.values() {
            let rows: Vec<usize> = runs.iter().map(|run| run.row).collect();
            let mut mark = json!({"rows": rows, "x": x.shown(runs[0].x), "y": y.shown(runs[0].y)});
            if !name.is_empty() {
                mark["name"] = json!(name);
            }
            marks.push(mark);
        }
    }
    marks
}
