//! Bad input gets a sentence with file, line, key and value, and status 2.

use crate::support::{STUDY, folder_with, messages, program, ran, refused};
use crate::table::table;

/// Output for a study that is refused; nothing is written.
fn told(text: &str) -> String {
    let folder = folder_with(text);
    let told = ran(&folder, "small.toml", 2);
    assert!(!folder.path().join("out").exists(), "{told}");
    told
}

const WHOLE: &str = r#"
=> small.toml:1: missing field `base`
base = 3 => small.toml:1: base: invalid type
base = "paper-9" => small.toml:1: base: paper-9: there is no such file
rungs = ["firmware"]\n\nbase = "paper-9" => small.toml:3: base: paper-9: there is no such file
rungs = ["firmware"]\nbase = "paper-2"\n[set]\n\nrun.duration_s = -3
    => small.toml:5: run.duration_s = -3 is not allowed
rungs = ["firmware"]\nbase = "paper-2"\n[set.controller]\nkp = 3\nkpp = 3
    => small.toml:5: unknown key controller.kpp; did you mean kp
rungs = ["firmware"]\nbase = "paper-2"\n[budget]\nfinal_error_um = 3\nimpact = 1
    => small.toml:5: unknown key budget.impact; did you mean impacts
"#;

const OF_THE_BASE: &str = r#"
bse = 1 => small.toml:2: unknown field `bse`
[[axis]]\nkey = "controller.kpp"\nvalues = [1]
    => small.toml:3: unknown key controller.kpp; did you mean kp
[[axis]]\nkey = "backlash.homing_effort_codes"\nvalues = [1]
    => small.toml:3: backlash.homing_effort_codes is now backlash_measurement_effort_codes
[[axis]]\nkey = "controller.law"\nvalues = ["sampled"]
    => small.toml:3: axis controller.law: give the rungs
plan = "sobol" => needs runs
plan = "sobol"\nruns = 0 => small.toml:3: runs = 0 is not allowed
runs = 5 => runs is not allowed
plan = "sobel" => unknown variant `sobel`
rungs = [] => small.toml:2: rungs = [] is not allowed
rungs = ["fuzzy"] => rungs = ["fuzzy"] is not allowed: one or more of continuous, sampled
rungs = ["sampled", "sampled"] => each once
constraints = ["controller.kp"] => there is no <
constraints = ["controller.kp <"] => small.toml:2: constraint "controller.kp <": a term is missing
constraints = ["controller.kpp < 3"] => unknown key controller.kpp
[set]\ncontroller.kpp = 1 => unknown key controller.kpp
[set]\ncontroller.kp = -1 => controller.kp = -1 is not allowed
[budget]\nfinal_error = 1 => unknown key budget.final_error
required_yield_percent = 200 => required_yield_percent = 200 is not allowed
differences = true => needs at least two rungs
"a\u001b" = 1 => a\u{1b}
title = "a\u0001" => "a\u{1}" has characters that are no text
rungs = ["sampled"]\n[set]\ncontroller.law = "firmware" => would be overridden by rungs
plan = "random"\nruns = 9223372036854775807\nrungs = ["sampled", "quantised"] => more rows than 2^53
name = "a/b" => name = "a/b" is not allowed
[[axis]]\nkey = "controller.kp"\nvalues = [1]\n[set]\ncontroller.kp = 2
    => would be overridden by the axis
[[axis]]\nkey = "encoder.lines"\nvalues = [100]\n[set]\nencoder.counts_per_rad = 200
    => encoder.counts_per_rad=200 would be overridden by the axis over encoder.lines
[set.drive]\ndac_lsb_v = 0.1\ndac_range_v = 20 => sets the same quantity; give one of the two
[[axis]]\nkey = "encoder.lines"\nvalues = [1]\n[[axis]]\nkey = "encoder.counts_per_rad"\nvalues = [1]
    => axis encoder.counts_per_rad: the axis over encoder.lines sets the same quantity
seed = -1 => small.toml:2
plan = "random"\nruns = 9\n[[axis]]\nkey = "controller.kp"\nfrom = 1\nto = 2\npoints = 9
    => points = 9 is not allowed: plan = "random" draws
"#;

const OF_THE_AXIS: &str = r#"
values = [] => small.toml:3: axis controller.kp: the list of values is empty
values = [1, nan] => nan is no finite number
=> it has no values
values = [1]\nfrom = 2 => give one of values
from = 1\nto = 2 => a range needs points
from = 1\nto = 2\npoints = 0 => points = 0 is not allowed
from = 1\nto = 1\npoints = 5 => points = 5 is not allowed
from = 1\nto = 2\npoints = 3000000000 => points = 3000000000 is not allowed
from = 0\nto = 2\npoints = 3\nscale = "log" => on a log scale both greater than 0
from = 1\nto = inf\npoints = 3 => finite from and to
distribution = { kind = "uniform", low = 0, high = 1 } => needs a plan that draws
distribution = { kind = "cauchy" } => unknown variant `cauchy`
values = [1, 2]\nlabels = ["a"] => labels must be as many as values, 2
values = [1]\ntimes = "transmission.joint" => has no number here
values = [1]\n[[axis]]\nkey = "controller.kp"\nvalues = [1]
    => there is an axis over this key already
values = [0.5]\nlabels = ["half"]\ntimes = "controller.kd_s"
    => labels are for values, and not for factors of another key
values = [1, 2]\nlabels = [" ", "b"] => label " " is not allowed
values = [1, 2]\nlabels = ["b", "b"] => label "b" is not allowed: each once
from = 1\nto = 2\npoints = 2\nlabels = ["a", "b"] => labels are for a list of values
from = -1.7e308\nto = 1.7e308\npoints = 2 => a finite distance
from = 1\nto = 2\npoints = -3
    => small.toml:6: points: invalid value: integer `-3`, expected a whole number from 0 on
"#;

const OF_THE_MAP: &str = r#"
pass = "margin_open" => picture "f": margin_open is now modulus_margin_gap
border = ["closed"] => unknown variant `closed`, expected `contact` or `gap`
border = ["gap"] => picture "f": a border needs x and y to be axes with from and to
x_range = [1, 1.00000000000001] => x_range = [1, 1.00000000000001] is too narrow
where = { rung = "a\u0001" } => a picture has characters that are no text: "a\u{1}"
x_unit = "furlong" => "furlong"
"#;

#[test]
fn every_mistake_has_its_line() {
    let refused = |text: &str, words: &str| {
        let told = told(text);
        assert!(told.contains(words), "{text}\n--- says\n{told}");
        told
    };
    let base = "base = \"paper-2\"\n";
    let axis = format!("{base}[[axis]]\nkey = \"controller.kp\"\n");
    let picture = "[[picture]]\nkind = \"map\"\nfile = \"f\"\ntitle = \"T\"\n\
                   x = \"controller.kp\"\ny = \"row\"\nz = \"impacts\"\n";
    let map = format!("{axis}values = [1, 2]\n{picture}");
    for (start, cases) in [
        ("", WHOLE),
        (base, OF_THE_BASE),
        (&axis, OF_THE_AXIS),
        (&map, OF_THE_MAP),
    ] {
        for (rest, words) in table(cases) {
            refused(&format!("{start}{rest}\n"), &words);
        }
    }
    let unknown = refused(&format!("{map}pass = \"no\"\n"), "have no column no");
    assert_eq!(unknown.lines().count(), 1, "{unknown}");
    let drawn = axis.replace(base, &format!("{base}plan = \"sobol\"\nruns = 9\n"));
    refused(
        &format!("{drawn}from = 1\nto = 2\n{picture}"),
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

#[test]
fn the_command_line_is_checked() {
    let folder = folder_with(STUDY);
    refused(
        &folder,
        "
nowhere.toml => there is no such file; the ready studies are
. => this is a directory
/dev/zero => more than 4 MiB
small.toml --threads 1000000 => 1..=1024
small.toml --shard 3/2 => a shard is NUMBER/OF
small.toml --threads 0 => --threads
small.toml --set controller.kpp=1 => unknown key controller.kpp
small.toml --base paper-9 => paper-9: there is no such file
small.toml --print => is no ready study
=> STUDY
",
    );
    let mut spaced = program(&folder, "small.toml");
    let spaced = spaced.args(["--set", "controller. kp=4"]).output();
    let told = messages(&spaced.unwrap(), 2);
    let words = "would be overridden by the axis over controller.kp";
    assert!(told.contains(words), "{told}");
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
