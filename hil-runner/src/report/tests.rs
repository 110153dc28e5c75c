//! Promises of the page: nothing is loaded, nothing leaves its place, all is there.

use hil_core::budget::Verdict;
use hil_core::measured::{LogDifference, MeasuredLog};
use hil_core::report::{
    CaseReport, ContactInterval, FigureRow, LadderReport, LadderRung, LoopReport, NamedLoop,
    Parameter, Report, Traces, compared,
};
use hil_core::run::{CaseRun, HostTiming, RunOptions};
use hil_core::runfile;
use hil_core::theory::{LoopCurves, LoopGains};

use super::*;
use crate::live::{Images, LiveCase};
use crate::page::policy::tests::is_exact;

/// The text between `start` and the next `end`.
fn between<'a>(page: &'a str, start: &str, end: &str) -> &'a str {
    let (_, rest) = page.split_once(start).unwrap();
    rest.split_once(end).unwrap().0
}

fn plot_data(page: &str) -> serde_json::Value {
    serde_json::from_str(between(page, "id=\"plot-data\">", "</script>")).unwrap()
}

#[test]
fn nothing_is_loaded() {
    let page = render(&sample(), None).unwrap();
    assert!(page.contains("default-src 'none'"));
    let (markup, _) = page.split_once("id=\"plot-data\"").unwrap();
    for load in ["src=", "@import", "url(", "http:", "https:", "<iframe"] {
        assert!(!markup.contains(load), "{load}");
    }
    for target in markup.split("href=\"").skip(1) {
        assert!(target.starts_with('#') || target.starts_with("data:,\""));
    }
    // The one address in the file is uPlot's, in its own comment.
    let rest = page.replace("/*! https://github.com/leeoniya/uPlot", "");
    assert!(!rest.contains("http:") && !rest.contains("https:"));
}

#[test]
fn policy_lets_the_own_scripts_and_no_other() {
    let page = render(&sample(), None).unwrap();
    assert!(is_exact(&page));
    assert!(!page.contains("wasm-unsafe-eval") && !page.contains("worker-src"));
    // The contrast: a byte of a script.
    let other = page.replacen("classList.add", "classList.sub", 1);
    assert!(!is_exact(&other));
}

/// A simulator is a section of a page, whose policy lets its scripts too.
#[test]
fn simulator_is_a_section() {
    let text = runfile::builtin_text("paper-1").unwrap();
    let case = LiveCase::new("paper-1", text, &[]).unwrap();
    let live = Live::new(case, &Images::default()).unwrap();
    let page = render(&sample(), Some(&live)).unwrap();
    assert!(is_exact(&page) && page.contains("'wasm-unsafe-eval'"));
    for id in ["simulator", "live", "live-data", "live-worker"] {
        assert_eq!(page.matches(&format!(" id=\"{id}\"")).count(), 1, "{id}");
        // The contrast: a report without one.
        let without = render(&sample(), None).unwrap();
        assert!(!without.contains(&format!(" id=\"{id}\"")), "{id}");
    }
}

#[test]
fn same_report_same_bytes() {
    let report = sample();
    assert_eq!(
        render(&report, None).unwrap(),
        render(&report, None).unwrap()
    );
}

#[test]
fn names_cannot_leave_their_place() {
    let hostile = "</script><script>alert(1)</script><!--\"'&";
    let mut report = sample();
    let clean = render(&report, None).unwrap();
    report.title = hostile.into();
    report.command_line = hostile.into();
    report.cases[0].name = hostile.into();
    report.cases[0].warnings = vec![hostile.into()];
    report.cases[0].figures[0].label = hostile.into();
    report.cases[0].parameters[0].value = hostile.into();
    if let Some(ladder) = &mut report.ladder {
        ladder.rungs[1].name = hostile.into();
    }
    let page = render(&report, None).unwrap();
    for tag in ["<script", "</script", "<!--", "alert(1)<"] {
        let count = |page: &str| page.matches(tag).count();
        assert_eq!(count(&page), count(&clean), "{tag}");
    }
    assert!(page.contains("&lt;script&gt;alert(1)"));
    assert_eq!(plot_data(&page)["ladder"]["rungs"][1]["name"], hostile);
}

#[test]
fn missing_figures_are_dashes_and_holes_are_null() {
    let page = render(&sample(), None).unwrap();
    assert!(page.contains("<td class=\"n\">–</td>"));
    for word in ["NaN", "none</td>", "undefined</td>"] {
        let (tables, _) = page.split_once("id=\"plot-data\"").unwrap();
        assert!(!tables.contains(word), "{word}");
    }
    let data = plot_data(&page);
    assert_eq!(
        data["cases"][1]["traces"]["current_a"][0],
        serde_json::Value::Null
    );
    assert_eq!(
        data["cases"][1]["traces"]["dac_code"],
        serde_json::Value::Null
    );
    assert_eq!(data["cases"][0]["traces"]["t_s"][1], 0.005);
}

#[test]
fn tables_round_and_carry_the_full_value() {
    let page = render(&sample(), None).unwrap();
    assert!(page.contains("<data value=\"-650.535923\" title=\"-650.535923\">−650.54</data>"));
}

#[test]
fn verdicts_come_first() {
    let mut report = sample();
    let page = render(&report, None).unwrap();
    let overall = between(&page, "class=\"overall fail\"", "</p>");
    assert!(overall.contains("FAIL") && overall.contains("2 of 3 verdicts fail"));
    assert!(page.find("class=\"overall").unwrap() < page.find("<table").unwrap());

    report.cases[0].verdicts.truncate(1);
    let page = render(&report, None).unwrap();
    assert!(between(&page, "class=\"overall pass\"", "</p>").contains("PASS"));

    report.cases[0].verdicts.clear();
    assert!(!render(&report, None).unwrap().contains("class=\"overall"));
}

#[test]
fn every_plot_has_a_name_and_absent_curves_have_no_plot() {
    let page = render(&sample(), None).unwrap();
    let body = between(&page, "<body>", "id=\"plot-data\"");
    let found = body.matches("<figure").count();
    assert_eq!(found, body.matches("role=\"img\" aria-label=\"").count());
    let plots = |name: &str| body.matches(&format!("data-plot=\"{name}\"")).count();
    assert_eq!(plots("carriage"), 2);
    assert_eq!((plots("code"), plots("gap")), (1, 1));
    assert_eq!((plots("position"), plots("velocity")), (2, 2));
    // One for the cases, one for the ladder.
    assert_eq!((plots("overlay"), plots("acc_diff")), (2, 2));
    let mut report = sample();
    report.cases.truncate(1);
    report.ladder = None;
    assert!(
        !render(&report, None)
            .unwrap()
            .contains("data-plot=\"overlay\"")
    );
}

/// The plots of the loop, one of each.
const LOOP_PLOTS: [&str; 5] = ["bode_gain", "bode_phase", "nyquist", "nichols", "stiffness"];

#[test]
fn a_loop_has_its_plots_its_figures_and_its_notes() {
    let page = render(&sample(), None).unwrap();
    let body = between(&page, "<body>", "id=\"plot-data\"");
    // The first case has a loop, the second none.
    assert!(body.contains("id=\"loop-1\"") && !body.contains("id=\"loop-2\""));
    for plot in LOOP_PLOTS {
        assert_eq!(body.matches(&format!("data-plot=\"{plot}\"")).count(), 1);
    }
    let section = between(body, "id=\"loop-1\"", "</section>");
    assert!(section.contains("Besides, the linear loop leaves out &lt;b&gt;."));
    let row = between(section, ">Modulus margin 1&#x2f;M_s<", "</tr>");
    assert!(row.contains(">0.57</data>") && row.contains(">0.31</data>"));
    let row = between(section, ">Least stiffness<", "</tr>");
    assert!(row.contains(">1.24</data>"));
    assert!(between(section, ">Gain margin<", "</tr>").contains("–"));

    let data = plot_data(&page);
    let curves = &data["cases"][0]["loop_curves"]["loops"][0]["curves"];
    for (joint, has_stiffness) in [("contact", true), ("gap", false)] {
        let length = |column: &str| curves[joint][column].as_array().map(Vec::len);
        assert!(length("frequency_hz") > Some(100));
        assert_eq!(length("re"), length("frequency_hz"));
        assert_eq!(length("im"), length("frequency_hz"));
        assert_eq!(length("stiffness_n_per_um").is_some(), has_stiffness);
    }
    assert_eq!(data["cases"][1]["loop_curves"], serde_json::Value::Null);
    // Without figures there is no table of them.
    let mut report = sample();
    report.cases[0].figures.clear();
    assert!(
        !render(&report, None)
            .unwrap()
            .contains("Figures of the loop")
    );
}

/// A built-in case with changes, run.
fn ran(sets: &[&str]) -> CaseRun {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    let case = runfile::builtin("paper-2", &sets).unwrap();
    let options = RunOptions {
        plot: true,
        ..RunOptions::default()
    };
    CaseRun::new(&case, options, &mut |_| Ok(())).unwrap()
}

#[test]
fn before_and_after_lie_over_each_other() {
    let report = compared("Tuned", "tune", &[ran(&[]), ran(&["controller.kp=4.5"])]);
    let page = render(&report, None).unwrap();
    let body = between(&page, "<body>", "id=\"plot-data\"");
    let plots = body.matches("data-plot=").count();
    assert_eq!(plots, body.matches("data-of=\"compare\"").count());
    assert_eq!(plots, 8 + LOOP_PLOTS.len());
    for single in [
        "class=\"case\"",
        "id=\"overlay\"",
        "id=\"overview\"",
        "#case-",
    ] {
        assert!(!body.contains(single), "{single}");
    }
    for target in ["compare", "loop-compare", "comparison", "verdicts"] {
        assert!(body.contains(&format!("id=\"{target}\"")), "{target}");
    }
    let settings = between(body, "Settings that differ</caption>", "</table>");
    assert!(
        settings.contains(">3.2</td><td class=\"n\">4.5</td>"),
        "{settings}"
    );
    assert!(!settings.contains("Sample time"));
    let data = plot_data(&page);
    assert_eq!(data["cases"][0]["name"], "before");
    assert_eq!(data["compare"]["one_command"], true);
    let loops = |case: usize| &data["cases"][case]["loop_curves"]["loops"];
    assert_ne!(loops(0), loops(1));
    if let Some(directory) = std::env::var_os("REPORT_SAMPLE_DIR") {
        std::fs::write(std::path::Path::new(&directory).join("compare.html"), &page).unwrap();
    }

    // The contrasts: nothing differs, and the command does.
    let same = compared("", "", &[ran(&[]), ran(&[])]).compare.unwrap();
    assert!(same.one_command && same.changes.is_empty());
    let slower = compared("", "", &[ran(&[]), ran(&["motion.travel_mm=20"])]);
    let slower = slower.compare.unwrap();
    assert!(!slower.one_command);
    assert_eq!(slower.changes[0].after.as_deref(), Some("20"));
}

/// Sections of another page, from data of its own, stand between the report's.
#[test]
fn a_page_can_have_more_sections() {
    let report = compared("Tuned", "tune", &[ran(&[]), ran(&["controller.kp=4.5"])]);
    let template = "{% extends \"report.html\" %}\
        {% block links %}<li>{{ front }}</li>{% endblock %}\
        {% block sections %}<section>{{ front }}, {{ cases | length }}</section>{% endblock %}";
    let page = render_extended(&report, template, context! { front => "<1>" }, None).unwrap();
    assert!(between(&page, "<nav", "</nav>").contains("<li>&lt;1&gt;</li>"));
    let (before, after) = page.split_once("<section>&lt;1&gt;, 2</section>").unwrap();
    assert!(before.contains("id=\"comparison\"") && after.contains("<footer>"));
    assert!(!render(&report, None).unwrap().contains("&lt;1&gt;"));
}

/// Gains that change have a loop before it and one after it.
#[test]
fn a_gain_change_has_two_loops() {
    let loops = |sets: &[&str]| {
        let runs = [ran(sets)];
        let report = hil_core::report::report("", "", &runs).cases.remove(0);
        report.loop_curves.unwrap().loops
    };
    let plain = loops(&[]);
    let changed = loops(&["gain_change.at_s=0.3", "gain_change.kp=4.5"]);
    let names: Vec<&str> = changed.iter().map(|set| set.name.as_str()).collect();
    assert_eq!(names, ["until 0.3 s", "from 0.3 s"]);
    assert_eq!(changed[0].curves, plain[0].curves);
    assert_ne!(changed[1].curves, plain[0].curves);
    assert_eq!((plain.len(), plain[0].name.as_str()), (1, ""));
}

#[test]
fn a_log_has_its_curves_and_its_differences() {
    assert!(!render(&sample(), None).unwrap().contains("id=\"log\""));
    let text = "t_s,x_m,<b>\n0.5,0.012345678,\n0.75,2,\n";
    let log = MeasuredLog::parse("<m>.csv", text, -0.25).unwrap();
    let difference = |largest: f64| LogDifference {
        column: "x_m",
        unit: "m",
        samples: 2,
        rms: Some(0.012_345_678),
        largest: Some(largest),
        largest_at_s: Some(0.5),
    };
    // Two cases and a rung; the other rungs have none.
    let of = [-1.0, -2.0, -3.0].map(|largest| vec![difference(largest)]);
    let page = render(&sample().with_log(log, of.into()), None).unwrap();
    let table = between(&page, "id=\"log\"", "</section>");
    for part in [
        "&lt;m&gt;.csv",
        "ignored: &lt;b&gt;",
        ">−0.25</data> s added",
        "<data value=\"0.012345678\" title=\"0.012345678\">0.012346</data>",
        ">−1</data>",
        ">−2</data>",
        ">−3</data>",
    ] {
        assert!(table.contains(part), "{part} {table}");
    }
    assert_eq!(table.matches("<code>x_m</code>").count(), 3);
    let data = plot_data(&page);
    assert_eq!(data["log"]["t_s"], serde_json::json!([0.25, 0.5]));
    assert_eq!(data["log"]["columns"][0]["name"], "x_m");
    assert_eq!(
        data["log"]["columns"][0]["values"],
        serde_json::json!([0.01234568, 2])
    );
    assert_eq!(data["cases"][1]["log"][0]["largest"], -2.0);
}

#[test]
fn the_page_holds_the_figures_in_full_and_the_curves_rounded() {
    let mut report = sample();
    report.cases[0].figures[0].value = Some(0.123_456_789_012);
    report.cases[0].traces.current_a[0] = 0.123_456_789_012;
    let data = plot_data(&render(&report, None).unwrap());
    assert_eq!(data["cases"][0]["figures"][0]["value"], 0.123_456_789_012);
    assert_eq!(data["cases"][0]["traces"]["current_a"][0], 0.123_456_8);
}

/// Writes the sample page where a browser can open it when the directory is
/// named: `REPORT_SAMPLE_DIR=dir cargo test -p hil-runner sample_page`.
#[test]
fn sample_page_is_one_file() {
    let temporary = tempfile::tempdir().unwrap();
    let directory = std::env::var_os("REPORT_SAMPLE_DIR")
        .map_or_else(|| temporary.path().to_owned(), Into::into);
    let path = directory.join("sample.html");
    std::fs::write(&path, render(&sample(), None).unwrap()).unwrap();
    assert!(std::fs::metadata(&path).unwrap().len() < 350_000);
}

/// Signs that a shell would take apart or put something else in the place of.
#[test]
fn a_shell_takes_the_words_as_they_are() {
    let values = [
        "a b",
        "it's",
        "\"$HOME\" `id` $(id)",
        "motion.intervals_s=[0.1, 0.2, 0.0]",
        "budget={a = 1}",
        "line\nbreak",
        "",
        "*?~!^#;&|<>\\",
        "µ",
    ];
    let line = command_line(values);
    let taken = shlex::split(&line).unwrap();
    assert_eq!(taken[0], "hil-runner");
    assert_eq!(taken[1..], values);
    // And not as they stand.
    assert_ne!(shlex::split(&values.join(" ")).unwrap_or_default(), values);
}

#[test]
fn an_option_stands_before_each_of_its_values() {
    let sets = ["a=1".to_owned(), "b=2".to_owned()];
    let words: Vec<&str> = each_with("--set", &sets).collect();
    assert_eq!(words, ["--set", "a=1", "--set", "b=2"]);
}

/// A small report, shapes like a run's without a simulation: two cases, one of them rigid and continuous with holes, and a ladder.
fn sample() -> Report {
    let rigid = CaseReport {
        name: "rigid".into(),
        law: "continuous".into(),
        figures: vec![figure("settling_time_s", "Settling time", "s", None)],
        verdicts: Vec::new(),
        host_timing: None,
        reserved: None,
        warnings: Vec::new(),
        loop_curves: None,
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
        compare: None,
        ladder: Some(ladder()),
        log: None,
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
            verdict("peak_abs_acc_mps2", Some(1.588_165_799), 3.2, true),
            verdict("final_error_um", Some(-650.535_923), 50.0, false),
            verdict("settling_time_s", None, 0.5, false),
        ],
        figures: vec![
            figure("peak_abs_acc_mps2", "Peak |ẍ|", "m/s²", Some(1.588_165_799)),
            figure("settling_time_s", "Settling time", "s", None),
            figure("modulus_margin_contact", "Modulus margin", "", Some(0.57)),
            figure("modulus_margin_gap", "Modulus margin", "", Some(0.31)),
            figure("least_stiffness_n_per_um", "Stiffness", "N/µm", Some(1.24)),
        ],
        host_timing: Some(HostTiming {
            steps: 1501,
            median_us: 0.04,
            p99_us: 0.09,
            max_us: 3.2,
            clock_us: 0.02,
            sample_time_us: 1000.0,
        }),
        reserved: None,
        warnings: vec!["The code reaches its range.".into()],
        traces: traces(),
        loop_curves: Some(loops()),
        log: Vec::new(),
    }
}

/// The loop of a case of the paper, with a note that it does not have.
fn loops() -> LoopReport {
    let case = runfile::builtin("paper-2", &[]).unwrap();
    LoopReport {
        loops: vec![NamedLoop {
            name: String::new(),
            curves: LoopCurves::of(&case, &LoopGains::of(&case)),
        }],
        notes: vec!["Besides, the linear loop leaves out <b>.".into()],
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

fn verdict(figure: &'static str, value: Option<f64>, limit: f64, pass: bool) -> Verdict {
    Verdict {
        figure,
        value,
        limit,
        at_least: false,
        margin: value.map(|value| limit - value.abs()),
        pass,
        default: figure == "peak_abs_acc_mps2",
    }
}

/// A sine as command, the carriage a little behind, one contact spike.
fn traces() -> Traces {
    let t_s: Vec<f64> = (0..=300).map(|i| f64::from(i) * 5e-3).collect();
    let curve = |f: fn(f64) -> f64| t_s.iter().map(|&t| f(t)).collect::<Vec<_>>();
    let mut acc_mps2 = curve(|t| 1.6 * (6.2 * (t - 0.02)).sin());
    acc_mps2[100] = -1.9;
    Traces {
        acc_ref_mps2: curve(|t| 1.6 * (6.2 * t).sin()),
        acc_mps2,
        x_ref_m: curve(|t| -0.04 * (6.2 * t).sin()),
        x_m: curve(|t| -0.04 * (6.2 * (t - 0.02)).sin()),
        v_ref_mps: curve(|t| -0.26 * (6.2 * t).cos()),
        v_mps: curve(|t| -0.26 * (6.2 * (t - 0.02)).cos()),
        following_error_mm: curve(|t| 3.0 * (6.2 * t).cos()),
        motor_voltage_v: curve(|t| 90.0 * (6.2 * t).sin()),
        voltage_held: true,
        current_a: curve(|t| 4.0 * (6.2 * t).cos()),
        dac_code: Some(curve(|t| (6147.0 * (6.2 * t).sin()).round())),
        gap_deg: Some(curve(|t| 1.2 * (6.2 * t).cos())),
        voltage_limit_v: Some(150.0),
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
    let t_s = traces().t_s;
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
        traces: traces(),
        log: Vec::new(),
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
