//! Bad input gets a sentence with file, line, key and value, and status 2.

use crate::support::{STUDY, folder_with, messages, study};

/// Output for a study that is refused; nothing is written.
fn told(text: &str) -> String {
    let folder = folder_with(text);
    let told = messages(&study(folder.path(), &["small.toml"]), 2);
    assert!(!folder.path().join("out").exists(), "{told}");
    told
}

#[test]
fn every_mistake_has_its_line() {
    let base = "base = \"paper-2\"\n";
    let axis = |rest: &str| format!("{base}[[axis]]\nkey = \"controller.kp\"\n{rest}\n");
    let map = |rest: &str| {
        "[[picture]]\nkind = \"map\"\nfile = \"f\"\ntitle = \"T\"\nx = \"controller.kp\"\n\
         y = \"row\"\nz = \"impacts\"\n"
            .to_owned()
            + rest
    };
    let unknown = told(&format!(
        "{}{}",
        axis("values = [1, 2]"),
        map("pass = \"no\"\n")
    ));
    assert_eq!(unknown.lines().count(), 1, "{unknown}");
    assert!(unknown.contains("have no column no"), "{unknown}");
    let renamed = told(&format!(
        "{}{}",
        axis("values = [1, 2]"),
        map("pass = \"margin_open\"\n")
    ));
    assert!(renamed.contains("picture \"f\": margin_open is now modulus_margin_gap"));
    for (text, words) in [
        (String::new(), "small.toml:1: missing field `base`"),
        (
            format!("{base}bse = 1\n"),
            "small.toml:2: unknown field `bse`",
        ),
        ("base = 3\n".to_owned(), "small.toml:1: base: invalid type"),
        (
            "base = \"paper-9\"\n".to_owned(),
            "small.toml:1: base: paper-9: there is no such file",
        ),
        (
            format!("rungs = [\"firmware\"]\n{base}[set]\n\nrun.duration_s = -3\n"),
            "small.toml:5: run.duration_s = -3 is not allowed",
        ),
        (
            format!("rungs = [\"firmware\"]\n{base}[set.controller]\nkp = 3\nkpp = 3\n"),
            "small.toml:5: unknown key controller.kpp; did you mean kp",
        ),
        (
            format!("rungs = [\"firmware\"]\n{base}[budget]\nfinal_error_um = 3\nimpact = 1\n"),
            "small.toml:5: unknown key budget.impact; did you mean impacts",
        ),
        (
            "rungs = [\"firmware\"]\n\nbase = \"paper-9\"\n".to_owned(),
            "small.toml:3: base: paper-9: there is no such file",
        ),
        (
            format!("{base}[[axis]]\nkey = \"controller.kpp\"\nvalues = [1]\n"),
            "small.toml:3: unknown key controller.kpp; did you mean kp",
        ),
        (
            format!("{base}[[axis]]\nkey = \"backlash.homing_effort_codes\"\nvalues = [1]\n"),
            "small.toml:3: backlash.homing_effort_codes is now backlash_measurement_effort_codes",
        ),
        (
            format!("{base}[[axis]]\nkey = \"controller.law\"\nvalues = [\"sampled\"]\n"),
            "small.toml:3: axis controller.law: give the rungs",
        ),
        (
            axis("values = []"),
            "small.toml:3: axis controller.kp: the list of values is empty",
        ),
        (axis("values = [1, nan]"), "nan is no finite number"),
        (axis(""), "it has no values"),
        (axis("values = [1]\nfrom = 2"), "give one of values"),
        (axis("from = 1\nto = 2"), "a range needs points"),
        (
            axis("from = 1\nto = 2\npoints = 0"),
            "points = 0 is not allowed",
        ),
        (
            axis("from = 1\nto = 1\npoints = 5"),
            "points = 5 is not allowed",
        ),
        (
            axis("from = 1\nto = 2\npoints = 3000000000"),
            "points = 3000000000 is not allowed",
        ),
        (
            axis("from = 0\nto = 2\npoints = 3\nscale = \"log\""),
            "on a log scale both greater than 0",
        ),
        (axis("from = 1\nto = inf\npoints = 3"), "finite from and to"),
        (
            axis("distribution = { kind = \"uniform\", low = 0, high = 1 }"),
            "needs a plan that draws",
        ),
        (
            axis("distribution = { kind = \"cauchy\" }"),
            "unknown variant `cauchy`",
        ),
        (
            axis("values = [1, 2]\nlabels = [\"a\"]"),
            "labels must be as many as values, 2",
        ),
        (
            axis("values = [1]\ntimes = \"transmission.joint\""),
            "has no number here",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1]"),
                "[[axis]]\nkey = \"controller.kp\"\nvalues = [1]\n"
            ),
            "there is an axis over this key already",
        ),
        (format!("{base}plan = \"sobol\"\n"), "needs runs"),
        (
            format!("{base}plan = \"sobol\"\nruns = 0\n"),
            "small.toml:3: runs = 0 is not allowed",
        ),
        (format!("{base}runs = 5\n"), "runs is not allowed"),
        (
            format!("{base}plan = \"sobel\"\n"),
            "unknown variant `sobel`",
        ),
        (
            format!("{base}rungs = []\n"),
            "small.toml:2: rungs = [] is not allowed",
        ),
        (
            format!("{base}rungs = [\"fuzzy\"]\n"),
            "rungs = [\"fuzzy\"] is not allowed: one or more of continuous, sampled",
        ),
        (
            format!("{base}rungs = [\"sampled\", \"sampled\"]\n"),
            "each once",
        ),
        (
            format!("{base}constraints = [\"controller.kp\"]\n"),
            "there is no <",
        ),
        (
            format!("{base}constraints = [\"controller.kp <\"]\n"),
            "small.toml:2: constraint \"controller.kp <\": a term is missing",
        ),
        (
            format!("{base}constraints = [\"controller.kpp < 3\"]\n"),
            "unknown key controller.kpp",
        ),
        (
            format!("{base}[set]\ncontroller.kpp = 1\n"),
            "unknown key controller.kpp",
        ),
        (
            format!("{base}[set]\ncontroller.kp = -1\n"),
            "controller.kp = -1 is not allowed",
        ),
        (
            format!("{base}[budget]\nfinal_error = 1\n"),
            "unknown key budget.final_error",
        ),
        (
            format!("{base}required_yield_percent = 200\n"),
            "required_yield_percent = 200 is not allowed",
        ),
        (
            format!("{base}differences = true\n"),
            "needs at least two rungs",
        ),
        (
            format!(
                "{}plan = \"random\"\nruns = 9\n{}",
                base, "[[axis]]\nkey = \"controller.kp\"\nfrom = 1\nto = 2\npoints = 9\n"
            ),
            "points = 9 is not allowed: plan = \"random\" draws",
        ),
        (
            format!(
                "{}plan = \"sobol\"\nruns = 9\n{}{}",
                base,
                "[[axis]]\nkey = \"controller.kp\"\nfrom = 1\nto = 2\n",
                map("")
            ),
            "picture \"f\": a map needs a grid, and plan = \"sobol\" draws controller.kp",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map("border = [\"closed\"]\n")
            ),
            "unknown variant `closed`, expected `contact` or `gap`",
        ),
        (
            format!("{}{}", axis("values = [1, 2]"), map("border = [\"gap\"]\n")),
            "picture \"f\": a border needs x and y to be axes with from and to",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map("x_range = [1, 1.00000000000001]\n")
            ),
            "x_range = [1, 1.00000000000001] is too narrow",
        ),
        (
            axis("values = [0.5]\nlabels = [\"half\"]\ntimes = \"controller.kd_s\""),
            "labels are for values, and not for factors of another key",
        ),
        (
            axis("values = [1, 2]\nlabels = [\" \", \"b\"]"),
            "label \" \" is not allowed",
        ),
        (
            axis("values = [1, 2]\nlabels = [\"b\", \"b\"]"),
            "label \"b\" is not allowed: each once",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map("where = { rung = \"a\\u0001\" }\n")
            ),
            "a picture has characters that are no text: \"a\\u{1}\"",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map(&format!("y_label = \"{}\"\n", "W ".repeat(700)))
            ),
            "the words beside the plot leave no room for it",
        ),
        (format!("{base}\"a\\u001b\" = 1\n"), "a\\u{1b}"),
        (
            axis("from = 1\nto = 2\npoints = 2\nlabels = [\"a\", \"b\"]"),
            "labels are for a list of values",
        ),
        (
            axis("from = -1.7e308\nto = 1.7e308\npoints = 2"),
            "a finite distance",
        ),
        (
            axis("from = 1\nto = 2\npoints = -3"),
            "small.toml:6: points: invalid value: integer `-3`, expected a whole number from 0 on",
        ),
        (
            format!("{base}title = \"a\\u0001\"\n"),
            "\"a\\u{1}\" has characters that are no text",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map("x_unit = \"furlong\"\n")
            ),
            "\"furlong\"",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map("").replace("impacts", "status")
            ),
            "column \"status\" has words, and this needs numbers",
        ),
        (
            format!(
                "{}{}",
                axis("values = [1, 2]"),
                map("").replace("\"f\"", "\"f\\u0000\"")
            ),
            "small.toml:5: a picture has characters that are no text: \"f\\0\"",
        ),
        (
            format!("{base}rungs = [\"sampled\"]\n[set]\ncontroller.law = \"firmware\"\n"),
            "would be overridden by rungs",
        ),
        (
            format!(
                "{base}plan = \"random\"\nruns = 9223372036854775807\n\
                 rungs = [\"sampled\", \"quantised\"]\n"
            ),
            "more rows than 2^53",
        ),
        (
            format!("{base}name = \"a/b\"\n"),
            "name = \"a/b\" is not allowed",
        ),
        (
            format!(
                "{base}[[axis]]\nkey = \"controller.kp\"\nvalues = [1]\n[set]\ncontroller.kp = 2\n"
            ),
            "would be overridden by the axis",
        ),
        (
            format!(
                "{base}[[axis]]\nkey = \"encoder.lines\"\nvalues = [100]\n\
                 [set]\nencoder.counts_per_rad = 200\n"
            ),
            "encoder.counts_per_rad=200 would be overridden by the axis over encoder.lines",
        ),
        (
            format!("{base}[set.drive]\ndac_lsb_v = 0.1\ndac_range_v = 20\n"),
            "sets the same quantity; give one of the two",
        ),
        (
            ["encoder.lines", "encoder.counts_per_rad"]
                .map(|key| format!("[[axis]]\nkey = \"{key}\"\nvalues = [100]\n"))
                .iter()
                .fold(base.to_owned(), |text, axis| text + axis),
            "axis encoder.counts_per_rad: the axis over encoder.lines sets the same quantity",
        ),
        (format!("{base}seed = -1\n"), "small.toml:2"),
    ] {
        let told = told(&text);
        assert!(told.contains(words), "{text}\n--- says\n{told}");
    }
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
        assert!(
            line.starts_with(&format!("small.toml:{}: ", 3 + 3 * place)),
            "{line}"
        );
    }
}

#[test]
fn a_plan_larger_than_the_disk_is_refused_before_anything_is_written() {
    let huge = STUDY.replace("runs = 1500", "runs = 9000000000000");
    let folder = folder_with(&huge);
    let told = messages(&study(folder.path(), &["small.toml", "--out", "huge"]), 2);
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
    for (arguments, words) in [
        (
            &["nowhere.toml"][..],
            "there is no such file; the ready studies are",
        ),
        (&["."][..], "this is a directory"),
        (&["/dev/zero"][..], "more than 4 MiB"),
        (&["small.toml", "--threads", "1000000"][..], "1..=1024"),
        (
            &["small.toml", "--set", "controller. kp=4"][..],
            "would be overridden by the axis over controller.kp",
        ),
        (
            &["small.toml", "--shard", "3/2"][..],
            "a shard is NUMBER/OF",
        ),
        (&["small.toml", "--threads", "0"][..], "--threads"),
        (
            &["small.toml", "--set", "controller.kpp=1"][..],
            "unknown key controller.kpp",
        ),
        (
            &["small.toml", "--base", "paper-9"][..],
            "paper-9: there is no such file",
        ),
        (&["small.toml", "--print"][..], "is no ready study"),
        (&[][..], "STUDY"),
    ] {
        let told = messages(&study(folder.path(), arguments), 2);
        assert!(told.contains(words), "{arguments:?}\n{told}");
    }
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
    let told = messages(&study(folder.path(), &["small.toml", "--out", "o"]), 0);
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
    let told = messages(&study(folder.path(), &["small.toml", "--out", "p"]), 0);
    assert!(!told.contains("leaves out"), "{told}");
    let text = text.replace("firmware", "quantised");
    std::fs::write(folder.path().join("small.toml"), &text).unwrap();
    let told = messages(&study(folder.path(), &["small.toml", "--out", "q"]), 2);
    assert!(
        told.contains("small.toml:6: axis controller.derivative_filter_s: it changes nothing on rung quantised"),
        "{told}"
    );
}
