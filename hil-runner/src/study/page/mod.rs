//! The report of a study from the study, its results and its pictures.

use super::axis::{Axis, AxisValue, Scale, Spread};
use super::base;
use super::definition::{LoopGain, Study};
use super::distribution::Distribution;
use super::drawing::Drawn;
use super::plan::PlanKind;
use super::report::{AxisRow, FigureTable, Shown, StudyPage, StudyVerdict};
use super::tally::{RungTally, Tally};
use hil_core::budget::judged;
use hil_core::figures;
use hil_core::number;

/// The page; `command_line` makes the study again.
pub fn page(study: &Study, tally: &Tally, drawn: &[Drawn], command_line: &str) -> StudyPage {
    let mut page = StudyPage {
        title: study.title.clone(),
        description: vec![
            study
                .description
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" "),
        ],
        generated_by: format!("hil-runner {}", env!("CARGO_PKG_VERSION")),
        verdict: verdict(study, tally),
        warnings: warnings(tally),
        plan: plan(study),
        base: base::sentences(study),
        axes: (study.axes.iter())
            .map(|axis| axis_row(axis, study.plan_kind))
            .collect(),
        best: best_table(tally),
        figures: figure_table(tally),
        validity: study.notes.clone(),
        repeat: vec![command_line.to_owned()],
        files: vec![
            ("results.csv".to_owned(), "every run, a row each".to_owned()),
            (
                "parquet/".to_owned(),
                "the same as Apache Parquet".to_owned(),
            ),
            ("study.toml".to_owned(), "the study file".to_owned()),
            (
                "base.toml".to_owned(),
                "the run file of the base case".to_owned(),
            ),
            (
                "study.json".to_owned(),
                "version, --base and --set as given, checksums".to_owned(),
            ),
        ],
        ..StudyPage::default()
    };
    page.warnings.extend(study.warnings());
    for Drawn { picture, svg } in drawn {
        match svg {
            Ok(svg) => page.pictures.push(Shown {
                file: picture.file.clone(),
                svg: svg.clone(),
                caption: picture.caption.clone().unwrap_or_default(),
            }),
            Err(error) => page.warnings.push(error.to_string()),
        }
    }
    page
}

/// Whether enough runs pass, where the study says how many must.
pub fn enough_pass(study: &Study, tally: &Tally) -> Option<bool> {
    let required = study.required_yield_percent?;
    Some(
        tally
            .yield_percent()
            .is_some_and(|percent| percent >= required),
    )
}

fn verdict(study: &Study, tally: &Tally) -> Option<StudyVerdict> {
    let percent = tally.yield_percent()?;
    let rungs = tally.rungs.iter().map(|rung| {
        let RungTally {
            rung,
            passed,
            made,
            not_made,
            ..
        } = rung;
        format!(
            "{rung}: {passed} of {} runs keep every limit",
            made + not_made
        )
    });
    let lines: Vec<String> = rungs.collect();
    Some(StudyVerdict {
        pass: enough_pass(study, tally),
        line: format!(
            "{} ({} % in all{})",
            lines.join("; "),
            number::table(percent),
            study
                .required_yield_percent
                .map_or_else(String::new, |required| format!(
                    ", required are {} %",
                    number::table(required)
                ))
        ),
    })
}

fn warnings(tally: &Tally) -> Vec<String> {
    let mut warnings = Vec::new();
    for rung in &tally.rungs {
        if let Some((row, reason)) = &rung.first_reason {
            warnings.push(format!(
                "{}: {} runs could not be made; the first is row {row}: {reason}",
                rung.rung, rung.not_made
            ));
        }
        warnings.extend(unstable_words(rung));
    }
    warnings
}

fn plan(study: &Study) -> Vec<String> {
    let points = study.plan.points();
    let rungs: Vec<&str> = study.rungs.iter().map(|(law, _)| law.name()).collect();
    let kind = match study.plan_kind {
        PlanKind::Grid => "every value of every axis with every value of the others".to_owned(),
        PlanKind::LatinHypercube => format!("a Latin hypercube, seed {}", study.seed),
        PlanKind::Sobol => format!("points of the Sobol sequence, seed {}", study.seed),
        PlanKind::Random => format!("independent points, seed {}", study.seed),
    };
    let mut lines = vec![
        format!("{points} points: {kind}."),
        format!("Each on rung {}.", rungs.join(", ")),
    ];
    if let Some((_, base)) = study.rungs.first() {
        let (limits, default) = judged(base.base());
        let texts: Vec<String> = limits
            .iter()
            .map(|limit| format!("{} ≤ {}", limit.figure, number::table(limit.limit)))
            .collect();
        let whose = if default {
            ", the defaults for the base"
        } else {
            ""
        };
        if !texts.is_empty() {
            lines.push(format!("Limits: {}{whose}.", texts.join(", ")));
        }
    }
    if study.loop_gain == LoopGain::Constant {
        lines.push(
            "Gains, feed-forward and limits keep the volts and radians that they have with the steps of the base, where encoder or converter change.".to_owned(),
        );
    }
    if !study.constraints.is_empty() {
        let texts: Vec<String> = study.constraints.iter().map(ToString::to_string).collect();
        lines.push(format!("Only points with {}.", texts.join(" and ")));
    }
    lines
}

fn axis_row(axis: &Axis, plan: PlanKind) -> AxisRow {
    let values = match &axis.spread {
        Spread::List(values) => {
            let texts: Vec<String> = values
                .iter()
                .map(|value| match value {
                    AxisValue::Number(number) => number.to_string(),
                    AxisValue::Other { label, .. } => label.clone(),
                })
                .collect();
            texts.join(", ")
        }
        Spread::Range {
            from,
            to,
            points,
            scale,
        } => {
            let scale = match scale {
                Scale::Linear => "evenly",
                Scale::Log => "logarithmically",
            };
            match plan {
                PlanKind::Grid => format!("{from} to {to}, {points} values {scale} spaced"),
                _ => format!("{from} to {to}, {scale} drawn"),
            }
        }
        Spread::Random(distribution) => distribution_words(distribution),
    };
    match &axis.times {
        Some(_) if axis.is_of_base() => AxisRow {
            column: axis.key.path(),
            values: format!("{values}, times what the base has"),
        },
        Some(times) => AxisRow {
            column: axis.factor_column().unwrap_or_default(),
            values: format!("{values} times {}", times.path()),
        },
        None => AxisRow {
            column: axis.key.path(),
            values,
        },
    }
}

fn distribution_words(distribution: &Distribution) -> String {
    match distribution {
        Distribution::Uniform { low, high } => format!("uniform from {low} to {high}"),
        Distribution::LogUniform { low, high } => format!("log-uniform from {low} to {high}"),
        Distribution::Normal {
            mean,
            deviation,
            low,
            high,
        } => {
            let limit = |words: &str, limit: &Option<f64>| {
                limit.map_or_else(String::new, |limit| format!(", {words} {limit}"))
            };
            format!(
                "normal, mean {mean}, standard deviation {deviation}{}{}",
                limit("not below", low),
                limit("not above", high)
            )
        }
        Distribution::Triangular { low, mode, high } => {
            format!("triangular from {low} over {mode} to {high}")
        }
    }
}

/// Says how many runs have a loop that is unstable, if there are any.
pub fn unstable_words(rung: &RungTally) -> Option<String> {
    let RungTally {
        rung: name,
        made,
        unstable,
        unstable_passed,
        ..
    } = rung;
    (*unstable > 0).then(|| {
        format!(
            "{name}: theory calls the loop of {unstable} of {made} runs unstable, with the joint closed or open (margin \
             below 0): their figures may not hold, and --row N says which digits do; {unstable_passed} of them are within \
             the limits, and not among the best"
        )
    })
}

/// The best runs of every rung: head and cells of a table, without rows if
/// there are none.
pub fn best_table(tally: &Tally) -> FigureTable {
    let heads = ["rung", "row", "least margin %"].map(str::to_owned);
    let mut rows = Vec::new();
    for rung in &tally.rungs {
        rows.extend(rung.best.iter().map(|best| {
            let percent = number::table(number::significant(100.0 * best.margin, 3));
            let own = [rung.rung.clone(), best.row.to_string(), percent];
            own.into_iter().chain(best.axes.iter().cloned()).collect()
        }));
    }
    FigureTable {
        heads: heads
            .into_iter()
            .chain(tally.axes.iter().cloned())
            .collect(),
        rows,
    }
}

fn figure_table(tally: &Tally) -> FigureTable {
    let heads = [
        "rung",
        "figure",
        "least",
        "in row",
        "mean",
        "most",
        "in row",
        "unit",
        "runs without",
    ];
    let mut rows = Vec::new();
    for rung in &tally.rungs {
        rows.extend(figure_rows(rung).map(|cells| {
            let rung = std::iter::once(rung.rung.clone());
            rung.chain(cells).collect()
        }));
    }
    FigureTable {
        heads: heads.map(str::to_owned).to_vec(),
        rows,
    }
}

/// The figures that any run of a rung has: name, least and its row, mean, most
/// and its row, unit, runs without.
pub fn figure_rows(rung: &RungTally) -> impl Iterator<Item = [String; 8]> + '_ {
    rung.figures.iter().filter_map(|figure| {
        let (least, mean, most) = (figure.least?, figure.mean()?, figure.most?);
        Some([
            figure.column.clone(),
            number::table(least.0),
            least.1.to_string(),
            number::table(mean),
            number::table(most.0),
            most.1.to_string(),
            figures::unit(&figure.column).to_owned(),
            figure.empty.to_string(),
        ])
    })
}
