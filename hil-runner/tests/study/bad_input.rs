//! Bad input gets a sentence with file, line, key and value, and status 2.

use crate::support::{STUDY, folder_with, ran};
use crate::table::table;

/// Output for a study that is refused; nothing is written.
fn told(text: &str) -> String {
    let folder = folder_with(text);
    let told = ran(&folder, "small.toml", 2);
    assert!(!folder.path().join("out").exists(), "{told}");
    told
}

const WHOLE: &str = include_str!("mistakes/whole.txt");

const OF_THE_BASE: &str = include_str!("mistakes/of-the-base.txt");

const OF_THE_AXIS: &str = include_str!("mistakes/of-the-axis.txt");

const OF_THE_MAP: &str = include_str!("mistakes/of-the-map.txt");

const PICTURE: &str = "[[picture]]\nkind = \"map\"\nfile = \"f\"\ntitle = \"T\"\n\
                       x = \"controller.kp\"\ny = \"row\"\nz = \"impacts\"\n";

/// Files that the mistakes of the tables end: none, with a base, an axis, a map.
fn beginnings() -> [String; 4] {
    let base = "base = \"paper-2\"\n".to_owned();
    let axis = format!("{base}[[axis]]\nkey = \"controller.kp\"\n");
    let map = format!("{axis}values = [1, 2]\n{PICTURE}");
    [String::new(), base, axis, map]
}

/// Every study of the tables, with words of its sentence.
pub(crate) fn mistakes() -> Vec<(String, String)> {
    let tables = [WHOLE, OF_THE_BASE, OF_THE_AXIS, OF_THE_MAP];
    let with = |(start, cases): (String, &str)| {
        let cases = table(cases).into_iter();
        let cases = cases.map(move |(rest, words)| (format!("{start}{rest}\n"), words));
        cases.collect::<Vec<_>>()
    };
    beginnings()
        .into_iter()
        .zip(tables)
        .flat_map(with)
        .collect()
}

#[test]
fn every_mistake_has_its_line() {
    let refused = |text: &str, words: &str| {
        let told = told(text);
        assert!(told.contains(words), "{text}\n--- says\n{told}");
        told
    };
    for (text, words) in mistakes() {
        refused(&text, &words);
    }
    let [_, base, axis, map] = beginnings();
    let unknown = refused(&format!("{map}pass = \"no\"\n"), "have no column no");
    assert_eq!(unknown.lines().count(), 1, "{unknown}");
    let drawn = axis.replace(&base, &format!("{base}plan = \"sobol\"\nruns = 9\n"));
    refused(
        &format!("{drawn}from = 1\nto = 2\n{PICTURE}"),
        "picture \"f\": a map needs a grid, and plan = \"sobol\" draws controller.kp",
    );
    refused(
        &format!("{map}y_label = \"{}\"\n", "W ".repeat(700)),
        "the words beside the plot leave no room for it",
    );
    refused(
        &map.replace("impacts", "status"),
        "column \"status\" has words, and this needs numbers",
    );
    refused(
        &map.replace("\"f\"", "\"f\\u0000\""),
        "small.toml:5: a picture has characters that are no text: \"f\\0\"",
    );
}

#[test]
fn of_very_many_mistakes_the_first_are_listed() {
    let axes = |count: usize| -> String {
        let axis = |n| format!("[[axis]]\nkey = \"strange.key{n}\"\nvalues = [1]\n");
        "base = \"paper-2\"\n".to_owned() + &(0..count).map(axis).collect::<String>()
    };
    assert_eq!(told(&axes(20)).lines().count(), 20);
    let many = told(&axes(5_000));
    let lines: Vec<&str> = many.lines().collect();
    assert_eq!((lines.len(), lines[20]), (21, "and 4980 more mistakes"));
    for (place, line) in lines[..20].iter().enumerate() {
        let words = format!("small.toml:{}: ", 3 + 3 * place);
        assert!(line.starts_with(&words), "{line}");
    }
}

#[test]
fn a_plan_larger_than_the_disk_is_refused_before_anything_is_written() {
    let huge = STUDY.replace("runs = 1500", "runs = 9000000000000");
    let folder = folder_with(&huge);
    let told = ran(&folder, "small.toml --out huge", 2);
    assert!(
        told.contains("GB free") && told.contains("18000000000000 rows"),
        "{told}"
    );
    assert!(!folder.path().join("huge/results.csv").exists());
    let grid = "base = \"paper-2\"\n".to_owned()
        + &["controller.kp", "controller.kd_s", "controller.ki_per_s"]
            .map(|key| format!("[[axis]]\nkey = \"{key}\"\nfrom = 1\nto = 2\npoints = 900000000\n"))
            .concat();
    assert!(self::told(&grid).contains("more rows than 2^53"));
}

/// Keys beyond the paper's law are told where some rungs leave them out, and
/// refused where all do.
#[test]
fn keys_that_a_rung_leaves_out_are_told() {
    let folder = folder_with(
        "base = \"axis.toml\"\nrungs = [\"sampled\", \"firmware\"]\n[set]\nrun.duration_s = 0.1\n\
         [[axis]]\nkey = \"controller.derivative_filter_s\"\nvalues = [0, 1e-3]\n",
    );
    let axis = hil_core::runfile::builtin_text("paper-2").unwrap();
    let axis = axis.replacen("[limits]", "[limits]\nfollowing_error_counts = 4000", 1);
    std::fs::write(folder.path().join("axis.toml"), axis).unwrap();
    let told = ran(&folder, "small.toml --out o", 0);
    let line = "rung sampled leaves out limits.following_error_counts, controller.derivative_filter_s: \
                they act on rung firmware";
    let lines = told.matches(&format!("small: warning: {line}\n")).count();
    assert_eq!(lines, 1, "{told}");
    let page = std::fs::read_to_string(folder.path().join("o/report.html")).unwrap();
    assert!(page.contains(line));
    // The contrast: on rung firmware alone there is nothing to tell.
    let text = std::fs::read_to_string(folder.path().join("small.toml")).unwrap();
    let text = text.replace("\"sampled\", ", "");
    std::fs::write(folder.path().join("small.toml"), &text).unwrap();
    let told = ran(&folder, "small.toml --out p", 0);
    assert!(!told.contains("leaves out"), "{told}");
    let text = text.replace("firmware", "quantised");
    std::fs::write(folder.path().join("small.toml"), &text).unwrap();
    let told = ran(&folder, "small.toml --out q", 2);
    assert!(
        told.contains("small.toml:6: axis controller.derivative_filter_s: it changes nothing on rung quantised"),
        "{told}"
    );
}
