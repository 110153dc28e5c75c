//! The report of a study from the study, its results and its pictures.

pub(super) mod base;
pub(super) mod pictures;
mod render;
pub(super) mod tally;

pub use self::render::{
    AxisRow, FigureTable, Shown, StudyPage, StudyPageError, StudyVerdict, render,
};

use self::base::base_sentences;
use self::pictures::Drawn;
use self::tally::{Best, RungTally, Tally};
use super::plan::axis::{Axis, Scale, Spread};
use super::plan::points::PlanKind;
use super::plan::{LoopGain, Study};
use hil_core::budget::judged;
use hil_core::case::Limit;
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
        base: base_sentences(study),
        axes: (study.axes.iter())
            .map(|axis| axis_row(axis, study.plan_kind))
            .collect(),
        best: best_table(tally),
        figures: figure_table(tally),
        validity: study.notes.clone(),
        repeat: vec![command_line.to_owned()],
        files: [
            ("results.csv", "every run, a row each"),
            ("results.parquet", "the same as Apache Parquet"),
            ("study.toml", "the study file"),
            ("base.toml", "the run file of the base case"),
            (
                "study.json",
                "version, --base and --set as given, checksums",
            ),
        ]
        .map(|(name, words)| (name.to_owned(), words.to_owned()))
        .to_vec(),
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

/// True if enough runs pass, where the study says how many must.
pub fn enough_pass(study: &Study, tally: &Tally) -> Option<bool> {
    let required = study.required_yield_percent?;
    let percent = tally.yield_percent();
    Some(percent.is_some_and(|percent| percent >= required))
}

fn verdict(study: &Study, tally: &Tally) -> Option<StudyVerdict> {
    let percent = number::table(tally.yield_percent()?);
    let rungs = tally.rungs.iter().map(|tally| {
        let (rung, of) = (&tally.rung, tally.made + tally.not_made);
        format!("{rung}: {} of {of} runs keep every limit", tally.passed)
    });
    let lines: Vec<String> = rungs.collect();
    let required = study.required_yield_percent.map(number::table);
    let required = required.map(|required| format!(", required are {required} %"));
    Some(StudyVerdict {
        pass: enough_pass(study, tally),
        line: format!(
            "{} ({percent} % in all{})",
            lines.join("; "),
            required.unwrap_or_default()
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
    let kind = match study.plan_kind {
        PlanKind::Grid => "every value of every axis with every value of the others".to_owned(),
        PlanKind::LatinHypercube => format!("a Latin hypercube, seed {}", study.seed),
        PlanKind::Sobol => format!("points of the Sobol sequence, seed {}", study.seed),
        PlanKind::Random => format!("independent points, seed {}", study.seed),
    };
    let mut lines = vec![
        format!("{points} points: {kind}."),
        format!("Each on rung {}.", study.rung_names()),
    ];
    let (limits, default) = judged(study.template().base());
    let limit = |limit: &Limit| format!("{} ≤ {}", limit.figure, number::table(limit.limit));
    let limits: Vec<String> = limits.iter().map(limit).collect();
    let whose = match default {
        true => ", the defaults for the base",
        false => "",
    };
    if !limits.is_empty() {
        lines.push(format!("Limits: {}{whose}.", limits.join(", ")));
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
    let mut values = match &axis.spread {
        Spread::List(values) => {
            let texts: Vec<String> = values.iter().map(ToString::to_string).collect();
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
        Spread::Random(distribution) => distribution.to_string(),
    };
    match &axis.times {
        Some(_) if axis.is_of_base() => values += ", times what the base has",
        Some(times) => values += &format!(" times {}", times.path()),
        None => {}
    }
    AxisRow {
        column: axis.factor_column().unwrap_or_else(|| axis.key.path()),
        values,
    }
}

/// Says how many runs have a loop that is unstable, if there are any.
pub fn unstable_words(tally: &RungTally) -> Option<String> {
    (tally.unstable > 0).then(|| {
        format!(
            "{}: theory calls the loop of {} of {} runs unstable, with the joint closed or open (margin \
             below 0): their figures may not hold, and --row N says which digits do; {} of them are within \
             the limits, and not among the best",
            tally.rung, tally.unstable, tally.made, tally.unstable_passed
        )
    })
}

/// The best runs of every rung: head and cells of a table, without rows if
/// there are none.
pub fn best_table(tally: &Tally) -> FigureTable {
    let heads = ["rung", "row", "least margin %"].map(str::to_owned);
    let best = |rung: &RungTally, best: &Best| {
        let percent = number::rounded(100.0 * best.margin, 3);
        let own = [rung.rung.clone(), best.row.to_string(), percent];
        own.into_iter().chain(best.axes.iter().cloned()).collect()
    };
    let rungs = tally.rungs.iter();
    FigureTable {
        heads: heads
            .into_iter()
            .chain(tally.axes.iter().cloned())
            .collect(),
        rows: rungs
            .flat_map(|rung| rung.best.iter().map(move |of_rung| best(rung, of_rung)))
            .collect(),
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
    let with_rung = |rung: &RungTally, cells: [String; 8]| {
        let rung = std::iter::once(rung.rung.clone());
        rung.chain(cells).collect()
    };
    let rungs = tally.rungs.iter();
    FigureTable {
        heads: heads.map(str::to_owned).to_vec(),
        rows: rungs
            .flat_map(|rung| figure_rows(rung).map(move |cells| with_rung(rung, cells)))
            .collect(),
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
