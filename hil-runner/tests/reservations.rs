//! Reservations beside a verdict: figures of which no digit holds, a carriage that
//! nothing holds, runs that end too soon; on terminal, summary and page alike.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::{Command, Output};

use hil_core::ladder::GRID_NS;
use hil_core::reservation::{Reservation, kept_but};
use hil_core::run::{CaseRun, Outcome, RunOptions};
use hil_runner::{files, report};

const FLOATING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/cases/floating.toml");

/// The loop is stable in contact and unstable in the gap.
const RATTLING: [&str; 4] = [
    "controller.law=quantised",
    "controller.sample_time_s=2.51e-3",
    "run.duration_s=6",
    "run.events=false",
];

/// A run as the commands make it.
fn ran(name: &str, sets: &[&str]) -> CaseRun {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    let case = files::case(name, &sets).unwrap();
    let options = RunOptions::default();
    let mut run = CaseRun::new(&case, options, &mut |_| Ok(())).unwrap();
    run.confirm(options, &mut |_| Ok(())).unwrap();
    run
}

fn page(run: &CaseRun) -> String {
    let data = hil_core::report::report("title", "command", std::slice::from_ref(run));
    report::render(&data, None).unwrap()
}

fn hil_runner(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Every digit of the paper's moves holds; of an axis that rattles in its gap
/// few do, and those alone are shown. The exact numbers stay in the summary.
#[test]
fn digits_that_do_not_hold_are_not_shown() {
    for name in ["paper-1", "paper-2", "paper-3", "paper-4"] {
        let run = ran(name, &[]);
        assert!(run.outcome.summary.digits_that_hold.is_empty(), "{name}");
        let json = serde_json::to_value(&run.outcome.summary).unwrap();
        assert!(json.get("digits_that_hold").is_none());
    }
    let run = ran("paper-2", &RATTLING);
    let summary = &run.outcome.summary;
    println!("{:?}", summary.digits_that_hold);
    // Measured: no digit of the final error, 1 of the error of the acceleration, all of the
    // following error, whose peak comes before the first contact that rattles.
    let final_error = summary.digits("final_error_um").unwrap();
    assert!(final_error <= 2);
    assert!((1..=3).contains(&summary.digits("rms_acc_error_mps2").unwrap()));
    assert_eq!(summary.digits("peak_following_error_mm"), None);
    let shown = summary.shown("final_error_um");
    let mantissa = shown.split('·').next().unwrap();
    let mantissa = mantissa.trim_start_matches(['−', '0', '.']);
    let significant = mantissa.chars().filter(char::is_ascii_digit).count();
    assert!(significant <= final_error, "{shown}");
    assert!(page(&run).contains("title=\"digits that hold: "));
    let once = CaseRun {
        outcome: exact(&run),
        ..run.clone()
    };
    assert!(!page(&once).contains("title=\"digits that hold: "));
    let json = serde_json::to_value(summary).unwrap();
    assert_eq!(json["digits_that_hold"]["final_error_um"], final_error);
    assert_eq!(json["final_error_um"], summary.final_error_um);
    // The second run changes nothing else.
    let mut without = summary.clone();
    without.digits_that_hold.clear();
    assert_eq!(once.outcome.summary, without);
    assert!(run.reservations.contains(&Reservation::FiguresDoNotHold));
    assert!(run.reservations.contains(&Reservation::UnstableLoop));
    let said = |words: &str| run.warnings.iter().any(|w| w.contains(words));
    assert!(said("in the gap"), "{:?}", run.warnings);
    assert!(!said("in contact"), "{:?}", run.warnings);
    assert!(said("figures do not hold: "), "{:?}", run.warnings);
}

/// The outcome of the first run alone.
fn exact(run: &CaseRun) -> Outcome {
    let once = CaseRun::new(&run.case, RunOptions::default(), &mut |_| Ok(()));
    once.unwrap().outcome
}

/// The place of the carriage at the end of a run is luck on an axis without
/// friction: the verdict on it flips with the duration. With friction it is not.
#[test]
fn a_carriage_that_floats_is_told() {
    let durations = ["0.9", "1.0", "1.1", "1.15", "1.5"];
    let runs = durations.map(|s| ran(FLOATING, &[&format!("run.duration_s={s}")]));
    let figure = |run: &CaseRun, key: &str| run.outcome.summary.figure(key).unwrap();
    let finals = runs.each_ref().map(|run| figure(run, "final_error_um"));
    println!("{finals:?}");
    assert!(finals.iter().any(|um| *um > 5.0) && finals.iter().any(|um| *um < -5.0));
    assert!(runs.iter().any(CaseRun::passes) && !runs.iter().all(CaseRun::passes));
    for run in &runs {
        assert_eq!(run.reservations, [Reservation::Floats]);
        assert_eq!(run.outcome.summary.settling_time_s, Some(0.0));
        assert!(run.warnings[0].contains("rest_error_max_um ("));
        // None of them is within the band of 10 µm at rest.
        assert!(figure(run, "rest_error_max_um") > 14.0);
    }
    let friction = [
        "carriage.resistance_opposes_motion=true",
        "carriage.resistance_constant_n=20",
    ];
    let held = ran(FLOATING, &friction);
    assert!(!held.reservations.contains(&Reservation::Floats));
    let gapless = ran(FLOATING, &["transmission.backlash_half_deg=0"]);
    assert!(!gapless.reservations.contains(&Reservation::Floats));
}

/// A run that is over too soon says which figures it lacks.
#[test]
fn a_run_that_ends_too_soon_names_what_is_missing() {
    let in_motion = ran("paper-2", &["run.duration_s=0.8"]);
    assert_eq!(in_motion.reservations, [Reservation::EndsInMotion]);
    // Seven samples of the window: 1.008 to 1.014 s.
    let sets = ["run.duration_s=1.014", "run.settling_band_um=5000"];
    let before_rest = ran("paper-2", &sets);
    assert_eq!(before_rest.reservations[0], Reservation::EndsBeforeRest);
    for run in [&in_motion, &before_rest] {
        for key in ["rest_error_max_um", "rest_ripple_um", "limit_cycle_um"] {
            assert!(run.warnings[0].contains(key), "{:?}", run.warnings);
        }
    }
    let sets = ["run.duration_s=1.015", "run.settling_band_um=5000"];
    let rests = ran("paper-2", &sets);
    assert!(!rests.reservations.contains(&Reservation::EndsBeforeRest));
}

/// Three banners: a broken limit, limits kept but, and a pass.
#[test]
fn the_banner_passes_without_reservations_only() {
    let banner = |run: &CaseRun| {
        let page = page(run);
        let title = page.split("<title>").nth(1).unwrap();
        let overall = page.split("class=\"overall ").nth(1).unwrap();
        let ends = [title.split('<').next(), overall.split("</p>").next()];
        ends.map(|text| text.unwrap().to_owned())
    };
    // The paper's axis settles in 3 s, and a rigid one does not float.
    let settled = ran("paper-2", &["transmission.joint=rigid", "run.duration_s=4"]);
    assert_eq!(settled.reservations, []);
    let [title, overall] = banner(&settled);
    assert!(
        title.ends_with("– PASS") && overall.starts_with("pass\""),
        "{overall}"
    );

    let reserved = ran("paper-2", &[]);
    assert!(reserved.passes());
    for text in banner(&reserved) {
        assert!(!text.contains("PASS") && !text.contains("FAIL"), "{text}");
        assert!(text.contains("All limits kept, but: not settled"), "{text}");
    }
    assert!(banner(&reserved)[1].starts_with("reserved\""));

    let failed = ran("paper-2", &["budget.final_error_um=50"]);
    let [title, overall] = banner(&failed);
    assert!(
        title.ends_with("– FAIL") && overall.starts_with("fail\""),
        "{overall}"
    );
}

#[test]
fn a_reservation_of_some_runs_names_them() {
    let (one, two) = (
        [Reservation::NotSettled, Reservation::Floats],
        [Reservation::NotSettled],
    );
    let words = kept_but(&[("a", &one[..]), ("b", &two[..])]).unwrap();
    assert_eq!(
        words,
        "All limits kept, but: not settled, floats in its gap (a)"
    );
    assert_eq!(kept_but(&[("a", &[])]), None);
}

/// The terminal tells the same, and the exit status is that of the verdicts.
#[test]
fn the_terminal_tells_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let output = hil_runner(folder.path(), &["run", "paper-2"]);
    assert_eq!(output.status.code(), Some(0));
    let line = "All limits kept, but: not settled, floats in its gap\n";
    assert!(
        text(&output.stdout).contains(line),
        "{}",
        text(&output.stdout)
    );
    let sets = RATTLING.iter().flat_map(|set| ["--set", set]);
    let args: Vec<&str> = ["run", "paper-2"].into_iter().chain(sets).collect();
    let output = hil_runner(folder.path(), &args);
    let run = ran("paper-2", &RATTLING);
    let shown = run.outcome.summary.shown("final_error_um");
    let row = text(&output.stdout);
    let row = row
        .lines()
        .find(|line| line.starts_with("paper-2  quantised"))
        .unwrap();
    assert!(row.contains(&format!(" {shown} ")), "{row}");
    for warning in &run.warnings {
        assert!(text(&output.stderr).contains(warning), "{warning}");
    }
}

/// The ladder's page gives the warnings of its terminal, and its needles have the
/// height of the figures; the rows of 1 ms have not.
#[test]
fn the_ladders_page_tells_and_draws_what_its_terminal_says() {
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "ladder",
        "paper-4",
        "--report",
        "l.html",
        "--set",
        "controller.derivative_filter_s=1e-3",
        "--set",
        "inject.bus_error_s=0.5",
    ];
    let output = hil_runner(folder.path(), &args);
    let told = text(&output.stderr);
    let page = std::fs::read_to_string(folder.path().join("l.html")).unwrap();
    let plain = page.replace("&#x27;", "'").replace("&quot;", "\"");
    let warnings: Vec<&str> = told
        .lines()
        .filter(|line| line.contains(": warning: "))
        .collect();
    for words in ["not settled", "beyond the paper's law", "bus", "leave out"] {
        assert!(
            warnings.iter().any(|line| line.contains(words)),
            "{words}: {told}"
        );
    }
    for line in &warnings {
        let (rung, warning) = line.split_once(": warning: ").unwrap();
        let item = match rung.split_once("rung ") {
            Some((_, rung)) => format!("<li><b>{rung}:</b> {warning}</li>"),
            // What holds for several rungs.
            None => format!("<li>{warning}</li>"),
        };
        assert!(plain.contains(&item), "{item}");
    }
    let list = plain.split("<ul class=\"note\">").nth(1).unwrap();
    let list = list.split("</ul>").next().unwrap();
    assert_eq!(list.matches("<li>").count(), warnings.len());

    let json = page.split("id=\"plot-data\">").nth(1).unwrap();
    let json = json.split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(json).unwrap();
    let rung = &data["ladder"]["rungs"][0];
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        let values = value.as_array().unwrap().iter();
        values.map(|value| value.as_f64().unwrap()).collect()
    };
    let traces = &rung["traces"];
    let (t_s, acc) = (numbers(&traces["t_s"]), numbers(&traces["acc_mps2"]));
    assert!(t_s.is_sorted() && t_s.len() == acc.len());
    let peak = rung["peak_abs_acc_mps2"][0].as_f64().unwrap();
    let height =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |a, b| a.max(b.abs()));
    let drawn = height(&mut acc.iter().copied());
    assert!((drawn / peak - 1.0).abs() < 1e-6, "{drawn} of {peak}");
    // The contrast: of the points on whole milliseconds none is as high.
    let on_grid = |t: f64| (t * 1e9 / GRID_NS as f64).fract() == 0.0;
    let mut rows = t_s
        .iter()
        .zip(&acc)
        .filter(|(t, _)| on_grid(**t))
        .map(|(_, a)| *a);
    let of_rows = height(&mut rows);
    assert!(
        (0.5..0.99).contains(&(of_rows / peak)),
        "{of_rows} of {peak}"
    );
}
