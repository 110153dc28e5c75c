//! What the page must never do, and what it must always hold.

use super::*;

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
    let page = render(&sample::report()).unwrap();
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
fn same_report_same_bytes() {
    let report = sample::report();
    assert_eq!(render(&report).unwrap(), render(&report).unwrap());
}

#[test]
fn names_cannot_leave_their_place() {
    let hostile = "</script><script>alert(1)</script><!--\"'&";
    let mut report = sample::report();
    let clean = render(&report).unwrap();
    report.title = hostile.into();
    report.command_line = hostile.into();
    report.cases[0].name = hostile.into();
    report.cases[0].warnings = vec![hostile.into()];
    report.cases[0].figures[0].label = hostile.into();
    report.cases[0].parameters[0].value = hostile.into();
    if let Some(ladder) = &mut report.ladder {
        ladder.rungs[1].name = hostile.into();
    }
    let page = render(&report).unwrap();
    for tag in ["<script", "</script", "<!--", "alert(1)<"] {
        let count = |page: &str| page.matches(tag).count();
        assert_eq!(count(&page), count(&clean), "{tag}");
    }
    assert!(page.contains("&lt;script&gt;alert(1)"));
    assert_eq!(plot_data(&page)["ladder"]["rungs"][1]["name"], hostile);
}

#[test]
fn missing_figures_are_dashes_and_holes_are_null() {
    let page = render(&sample::report()).unwrap();
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
    let page = render(&sample::report()).unwrap();
    assert!(page.contains("<data value=\"-650.535923\" title=\"-650.535923\">−650.54</data>"));
}

#[test]
fn verdicts_come_first() {
    let mut report = sample::report();
    assert_eq!(report.passed(), Some(false));
    let page = render(&report).unwrap();
    let overall = between(&page, "class=\"overall fail\"", "</p>");
    assert!(overall.contains("FAIL") && overall.contains("2 of 3 verdicts fail"));
    assert!(page.find("class=\"overall").unwrap() < page.find("<table").unwrap());

    report.cases[0].verdicts.truncate(1);
    assert_eq!(report.passed(), Some(true));
    let page = render(&report).unwrap();
    assert!(between(&page, "class=\"overall pass\"", "</p>").contains("PASS"));

    report.cases[0].verdicts.clear();
    assert_eq!(report.passed(), None);
    assert!(!render(&report).unwrap().contains("class=\"overall"));
}

#[test]
fn every_plot_has_a_name_and_absent_curves_have_no_plot() {
    let page = render(&sample::report()).unwrap();
    let body = between(&page, "<body>", "id=\"plot-data\"");
    assert_eq!(
        body.matches("<figure").count(),
        body.matches("role=\"img\" aria-label=\"").count()
    );
    let plots = |name: &str| body.matches(&format!("data-plot=\"{name}\"")).count();
    assert_eq!(plots("carriage"), 2);
    assert_eq!((plots("code"), plots("gap")), (1, 1));
    assert_eq!((plots("ladder"), plots("acc_diff")), (1, 2));
}

#[test]
fn the_page_holds_the_figures_in_full_and_the_curves_rounded() {
    let mut report = sample::report();
    report.cases[0].figures[0].value = Some(0.123_456_789_012);
    report.cases[0].traces.current_a[0] = 0.123_456_789_012;
    let data = plot_data(&render(&report).unwrap());
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
    std::fs::write(&path, render(&sample::report()).unwrap()).unwrap();
    assert!(std::fs::metadata(&path).unwrap().len() < 300_000);
}
