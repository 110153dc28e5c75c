//! Ready studies of axes that are not the paper's: a ballscrew with
//! feed-forward, a rigid belt, a rotary table with a 12-bit converter, a hanging
//! axis.

use hil_runner::files;
use std::fs;
use std::path::Path;

use hil_core::case::{Case, Law};
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::run::{RunOptions, run};
use hil_core::summary::Summary;
use hil_core::theory::{JointState, margin};
use hil_runner::study::{Cell, Changes, LoopGain, RowMaker, Study, base_sentences, columns, ready};

use crate::support::{messages, said, study};

const AXES: [&str; 4] = ["ballscrew", "belt", "rotary", "hanging"];

/// Words true of the paper's second simulation and of none of these axes.
const OF_THE_PAPER: &str =
    "250 mm|1.5 s|3.2|3°|636|1000 lines|999|79.954|80 V|4.88|second move|command 2|paper|Paper";

fn of_the_paper() -> Vec<&'static str> {
    OF_THE_PAPER.split('|').collect()
}

fn file(axis: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/study/axes");
    folder.join(format!("{axis}.toml")).display().to_string()
}

/// A ready study of an axis; `None` where it has nothing to ask of it.
fn of_axis(name: &str, axis: &str) -> Option<Study> {
    let changes = Changes {
        base: Some(file(axis)),
        ..Changes::default()
    };
    match Study::load(name, &changes) {
        Ok(study) => Some(study),
        Err(error) => {
            let error = error.to_string();
            assert!(error.contains("the base's joint is rigid"), "{error}");
            assert_eq!((name, axis), ("backlash", "belt"));
            None
        }
    }
}

fn all() -> impl Iterator<Item = (&'static str, &'static str, Study)> {
    let pairs = AXES
        .into_iter()
        .flat_map(|axis| ready::names().map(move |name| (name, axis)));
    pairs.filter_map(|(name, axis)| Some((name, axis, of_axis(name, axis)?)))
}

fn figures_of(case: &Case) -> Summary {
    run(case, RunOptions::default(), &mut |_| Ok(()))
        .unwrap()
        .summary
}

/// Everything that people read in a study but for its results.
fn words(study: &Study) -> String {
    let mut words = vec![study.title.clone(), study.description.clone()];
    words.extend(study.notes.iter().cloned());
    words.extend(base_sentences(study));
    for picture in &study.pictures {
        words.push(picture.title.clone());
        words.extend(picture.caption.clone());
    }
    // Sources may be named anywhere.
    words
        .join("\n")
        .replace("Table 2 of the paper", "")
        .replace("Fig. 6 of the paper", "")
}

/// Those of `wanted` that stand in a text; a number stands for itself, not for
/// a part of another.
fn found<'w>(text: &str, wanted: &[&'w str]) -> Vec<&'w str> {
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit() || c == '.');
    let stands = |word: &&&str| {
        text.match_indices(**word).any(|(at, word)| {
            let (before, after) = (&text[..at], &text[at + word.len()..]);
            let number = word.starts_with(|c: char| c.is_ascii_digit());
            !number
                || !(digit(before.chars().last())
                    || after.starts_with(|c: char| c.is_ascii_digit()))
        })
    };
    wanted.iter().filter(stands).copied().collect()
}

#[test]
fn no_text_states_what_is_true_of_the_paper_alone() {
    for (name, axis, study) in all() {
        let words = words(&study);
        let case = study.reference.base();
        // Half of the 3 s that `sample-time` lets an axis rest.
        let besides = match name {
            "sample-time" => words.replace("the last 1.5 s of the run", ""),
            _ => words.clone(),
        };
        let stated = found(&besides, &of_the_paper());
        assert_eq!(stated, [""; 0], "{name} of {axis}: {words}");
        let defaults = case.budget.is_none();
        let says = words.contains("default");
        assert!(defaults || !says, "{name} of {axis}: {words}");
        // What is true of the axis stands there.
        for own in [case.controller.law.name(), axis] {
            assert!(words.contains(own), "{name} of {axis} does not name {own}");
        }
    }
    // The search finds what it looks for where that is true.
    let paper = words(&Study::load("gains", &Changes::default()).unwrap());
    let there = found(&paper, &of_the_paper());
    for word in ["250 mm", "3.2", "3°", "636", "paper"] {
        assert!(there.contains(&word), "{word}: {paper}");
    }
}

/// The first, a middle and the last point of every study on every rung.
#[test]
fn a_row_is_the_run_with_its_sets() {
    let mut compared = 0;
    for (name, axis, study) in all() {
        let columns = columns(&study);
        let place = |name: &str| columns.iter().position(|it| it.name == name).unwrap();
        let mut maker = RowMaker::new(&study);
        let (rungs, points) = (study.rungs.len() as u64, study.plan.points());
        for point in [0, points / 2, points - 1] {
            let rows = maker.rows(point * rungs..(point + 1) * rungs);
            for (rung, row) in rows.iter().enumerate() {
                if row[place("status")] != Cell::Text("ok".into()) {
                    continue;
                }
                let sets = study.row_sets(&study.point(point), rung);
                let case =
                    files::case(&file(axis), &sets).unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(case.controller.law, study.rungs[rung].0);
                let summary = figures_of(&case);
                for figure in SUMMARY_FIGURES {
                    let (key, value) = (figure.key, row[place(figure.key)].as_number());
                    let what = format!("{name} of {axis}, point {point}: {key} of {sets:?}");
                    assert_eq!(value, summary.figure(key), "{what}");
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 100, "{compared}");
}

/// The linear loop has the margins of the base, whatever the steps; feed-forward
/// and limits have its volts and radians.
#[test]
fn a_change_of_resolution_alone_changes_no_loop() {
    for axis in AXES {
        let mut study = of_axis("resolution", axis).unwrap();
        let base = study.reference.base().clone();
        let both = |case: &Case| {
            [JointState::Contact, JointState::Gap]
                .map(|joint| margin(case, joint).map(|margin| margin.signed()))
        };
        let own = both(&base);
        let mut worst = 0.0_f64;
        let (mut steps, mut points) = (Vec::new(), 0);
        for point in (0..study.plan.points()).step_by(7) {
            let Ok(case) = study.case(&study.point(point), 0) else {
                continue;
            };
            for (own, here) in own.iter().zip(both(&case)) {
                assert_eq!(own.is_some(), here.is_some());
                worst = worst.max((own.unwrap_or(0.0) - here.unwrap_or(0.0)).abs());
            }
            let feed = |case: &Case| {
                case.feed_forward()[0] * case.encoder.counts_per_rad * case.dac.step_v
            };
            let change = (feed(&case) - feed(&base)).abs();
            assert!(change <= 1e-12 * feed(&base), "{axis}");
            if let (Some(own), Some(limit)) = (
                base.options.limits.following_error,
                case.options.limits.following_error,
            ) {
                let own_rad = f64::from(own.counts) / base.encoder.counts_per_rad;
                let counts = own_rad * case.encoder.counts_per_rad;
                assert!((f64::from(limit.counts) - counts).abs() <= 0.5, "{axis}");
            }
            steps.push(case.encoder.counts_per_rad * case.dac.step_v);
            points += 1;
        }
        let finer = steps.iter().any(|step| step / steps[0] < 0.1);
        assert!(points > 8 && finer, "{axis}: {steps:?}");
        assert!(worst < 1e-9, "{axis}: {worst}");
        // The measure sees a loop that is not kept.
        study.loop_gain = LoopGain::PerCount;
        let finest = study.case(&study.point(0), 0).unwrap();
        let shift = (both(&finest)[0].unwrap() - own[0].unwrap()).abs();
        assert!(shift > 0.05, "{axis}: {shift}");
    }
}

/// On the rung that feeds forward twice the lines do not cost 6.5 times the
/// error, and the base's own cell is the base's own run.
#[test]
fn finer_steps_keep_the_following_error_of_an_axis_with_feed_forward() {
    let study = of_axis("resolution", "ballscrew").unwrap();
    let base = study.reference.base();
    assert_eq!(base.controller.law, Law::Firmware);
    let mut rungs = study.rungs.iter();
    let rung = rungs.position(|(law, _)| *law == Law::Firmware).unwrap();
    let at = |bits: u32, lines: f64| {
        let all = 0..study.plan.points();
        let mut cases = all.filter_map(|point| study.case(&study.point(point), rung).ok());
        let counts = plant::Encoder::with_lines(lines).counts_per_rad;
        cases
            .find(|case| case.dac.bits == bits && case.encoder.counts_per_rad == counts)
            .unwrap()
    };
    let own = figures_of(&at(16, 2500.0));
    let mut again = base.clone();
    again.run.duration_ns = study.rungs[rung].1.base().run.duration_ns;
    let again = figures_of(&again).peak_following_error_mm;
    assert_eq!(own.peak_following_error_mm, again);
    for (bits, lines) in [(16, 5000.0), (16, 20000.0), (18, 5000.0)] {
        let finer = figures_of(&at(bits, lines)).peak_following_error_mm;
        let ratio = finer / own.peak_following_error_mm;
        let near = (0.8..1.2).contains(&ratio);
        assert!(near, "{bits} bits, {lines} lines: {ratio}");
    }
}

/// Every study with all its rows, pictures and its page, as a user makes it.
#[test]
fn every_study_and_picture_can_be_made_of_any_axis() {
    let folder = tempfile::TempDir::new().unwrap();
    for (name, axis, read) in all() {
        let base = format!("{axis}.toml");
        fs::copy(file(axis), folder.path().join(&base)).unwrap();
        let output = study(&folder, &format!("{name} --base {base}"));
        let told = messages(&output, 0);
        let leave = told.lines().all(|line| line.contains("leave"));
        assert!(leave, "{name} of {axis}");
        let (said, law) = (said(&output), read.reference.base().controller.law);
        let begin = format!("Base {base}: rung {}", law.name());
        assert!(said.starts_with(&begin), "{said}");
        let out = folder.path().join(format!("out/study-{name}-{axis}"));
        for picture in &read.pictures {
            let file = out.join(format!("{}.vl.json", picture.file));
            let specification = fs::read_to_string(file).unwrap();
            let what = format!("{name} of {axis}: {}", picture.file);
            assert!(!specification.contains("no values"), "{what}");
            let mut names = of_the_paper();
            names.retain(|w| w.contains("m") || w.contains('a'));
            assert_eq!(found(&specification, &names), [""; 0], "{what}");
        }
        let page = fs::read_to_string(out.join("report.html")).unwrap();
        assert!(page.contains(&format!("Base {base}")), "{name} of {axis}");
        if let Some(limits) = &read.reference.base().budget {
            let default = page.contains("the defaults for the base");
            assert!(!default, "{name} of {axis}");
            let limit = format!("{} ≤", limits[0].figure);
            assert!(page.contains(&limit), "{name} of {axis}");
        }
    }
}
