//! Machine-readable ways in and out: JSON on standard output, a run file from
//! standard input, several cases in one summary, verdicts in XML; completions
//! and man pages.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// Runs the program in `folder` with the words of a line; its standard input has
/// `input`.
fn fed(folder: impl AsRef<Path>, line: &str, input: &str) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(line.split_whitespace())
        .current_dir(folder.as_ref())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A program that refuses its arguments reads nothing.
    let _ = program.stdin.take().unwrap().write_all(input.as_bytes());
    program.wait_with_output().unwrap()
}

/// The same without input.
fn ran(folder: impl AsRef<Path>, line: &str) -> Output {
    fed(folder, line, "")
}

fn status(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Standard output as JSON, which it must be from its first byte to its last.
#[track_caller]
fn json(output: &Output) -> Value {
    let parsed = serde_json::from_slice(&output.stdout);
    assert!(parsed.is_ok(), "{parsed:?}\n{}", stderr(output));
    parsed.unwrap()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn read(folder: &tempfile::TempDir, file: &str) -> String {
    std::fs::read_to_string(folder.path().join(file)).unwrap()
}

/// Of one case the object that `--summary` writes, of several a list in the order
/// that they were given in; the exit status is that of the verdicts.
#[test]
fn run_prints_what_its_summary_has() {
    let folder = folder();
    for (cases, passes) in [("paper-1", 0), ("paper-2-12bit", 1), ("paper-3 paper-1", 0)] {
        let output = ran(&folder, &format!("run {cases} --json --summary s.json"));
        assert_eq!(status(&output), passes, "{}", stderr(&output));
        let text = String::from_utf8(output.stdout.clone()).unwrap();
        assert_eq!(text, read(&folder, "s.json"));
        let summary = json(&output);
        let names: Vec<&str> = match &summary {
            Value::Array(runs) => runs
                .iter()
                .map(|run| run["name"].as_str().unwrap())
                .collect(),
            run => vec![run["name"].as_str().unwrap()],
        };
        assert_eq!(names, cases.split(' ').collect::<Vec<_>>());
        // Warnings stay; the tables do not.
        let told = stderr(&output);
        assert!(told.contains("warning") && !told.contains('─'), "{told}");
    }
    // In a list a case has what it has by itself.
    let both = json(&ran(&folder, "run paper-1 paper-2-12bit --json"));
    assert_eq!(both[1], json(&ran(&folder, "run paper-2-12bit --json")));
    assert_ne!(both[0], both[1]);
}

/// The rungs with their summaries, and the differences that the table shows.
#[test]
fn ladder_prints_its_rungs() {
    let folder = folder();
    let rungs = json(&ran(&folder, "ladder paper-2 --report l.html --json"));
    let names: Vec<&Value> = rungs
        .as_array()
        .unwrap()
        .iter()
        .map(|rung| &rung["rung"])
        .collect();
    assert_eq!(names, ["continuous", "sampled", "quantised", "firmware"]);
    assert_eq!(rungs[0]["difference_to_rung_below"], Value::Null);
    let difference = &rungs[1]["difference_to_rung_below"]["rms_position_um"];
    assert!(
        (difference.as_f64().unwrap() - 5.5852).abs() < 1e-4,
        "{difference}"
    );
    let mut firmware = json(&ran(&folder, "run paper-2 --json"));
    // A ladder's digits are those of its own second run.
    let digits = |summary: &mut Value| summary.as_object_mut().unwrap().remove("digits_that_hold");
    let mut rung = rungs[3]["summary"].clone();
    assert_eq!(digits(&mut rung), digits(&mut firmware));
    assert_eq!(rung, firmware);
}

/// The fixed-point gains are those of a run, and the ranges those of the text.
#[test]
fn scaling_prints_its_gains() {
    let folder = folder();
    let scaled = json(&ran(&folder, "scaling paper-1 --json"));
    let gain = &scaled["gains"][0];
    assert_eq!(gain["key"], "controller.kp");
    assert_eq!(
        (&gain["mantissa"], &gain["fraction_bits"]),
        (&13421773.into(), &22.into())
    );
    assert_eq!(scaled["sample_time_ns"], 1_000_000);
    let text = String::from_utf8(ran(&folder, "scaling paper-1").stdout).unwrap();
    let limit = format!(" = {} counts;", scaled["error_limit_counts"]);
    let headroom = format!("{} bits of headroom", scaled["sum_headroom_bits"]);
    assert!(text.contains(&limit) && text.contains(&headroom), "{text}");
    let both = json(&ran(&folder, "scaling paper-1 paper-2 --json"));
    assert_eq!((&both[0], &both[1]["name"]), (&scaled, &"paper-2".into()));
    for option in ["--rust", "--c"] {
        let output = ran(&folder, &format!("scaling paper-1 --json {option}"));
        assert_eq!(status(&output), 2);
        assert!(
            stderr(&output).contains("cannot be used with"),
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn ready_studies_are_listed() {
    let studies = json(&ran(folder(), "study --list --json"));
    assert_eq!(studies.as_array().unwrap().len(), 7);
    assert_eq!(studies[0]["name"], "sample-time");
    assert!(studies[0]["rows"].as_u64().unwrap() > 1);
    let output = ran(folder(), "study sample-time --json");
    assert_eq!(status(&output), 2, "{}", stderr(&output));
}

/// Two outputs on one stream are no data.
#[test]
fn json_does_not_share_its_stream() {
    let folder = folder();
    for line in [
        "run paper-1 --json --trace -",
        "ladder paper-1 --json --report -",
    ] {
        let output = ran(&folder, line);
        assert_eq!(status(&output), 2);
        assert!(output.stdout.is_empty());
        assert!(
            stderr(&output).contains("- is given for two outputs"),
            "{line}"
        );
    }
}

/// A run file that comes over standard input is that run, under the name `stdin`.
#[test]
fn a_run_file_comes_over_standard_input() {
    let folder = folder();
    let unnamed = hil_core::runfile::builtin_text("paper-2").unwrap();
    let named = format!("name = \"paper-2\"\n{unnamed}");
    let named = json(&fed(&folder, "run - --json", &named));
    assert_eq!(named, json(&ran(&folder, "run paper-2 --json")));
    let here = json(&fed(&folder, "run paper-1 - --json", unnamed));
    assert_eq!(
        (&here[0]["name"], &here[1]["name"]),
        (&"paper-1".into(), &"stdin".into())
    );
    // The ladder reads it for every rung; data in and out share no file.
    for line in ["ladder - --report l.html", "scaling -", "run - --trace -"] {
        let output = fed(&folder, line, unnamed);
        assert_eq!(status(&output), 0, "{line}: {}", stderr(&output));
    }
    assert!(read(&folder, "l.html").contains("Ladder of stdin"));
    // Mistakes have their line, and a file of that name is another one.
    let output = fed(&folder, "run -", &unnamed.replace("kp = ", "kp = -"));
    assert_eq!(status(&output), 2);
    let told = stderr(&output);
    assert!(
        told.starts_with("stdin:") && told.contains("controller.kp = -"),
        "{told}"
    );
    for (line, words) in [
        (
            "run - -",
            "- is given for two cases; standard input has one run file",
        ),
        ("run -", "stdin: "),
        ("study sample-time --base -", "standard input is read once"),
    ] {
        let output = ran(&folder, line);
        assert_eq!(status(&output), 2);
        assert!(
            stderr(&output).contains(words),
            "{line}: {}",
            stderr(&output)
        );
    }
}

/// Suites with their names, and the tests of each: its name, and what became of it.
type Suites = Vec<(String, Vec<(String, String)>)>;

/// The suites of a file of JUnit's XML, whose counts are those of its tests.
fn suites(text: &str) -> Suites {
    let document = roxmltree::Document::parse(text).unwrap();
    let children = |node: roxmltree::Node<'_, '_>| {
        let children = node.children().filter(roxmltree::Node::is_element);
        children.map(|child| child.id()).collect::<Vec<_>>()
    };
    let node = |id| document.get_node(id).unwrap();
    let own = |id, name| node(id).attribute(name).unwrap().to_owned();
    let test = |id| {
        let end = children(node(id)).first().map(|end| node(*end));
        let end = end.map(|end| match end.tag_name().name() {
            "failure" => end.attribute("message").unwrap().to_owned(),
            "skipped" => "skipped".to_owned(),
            name => format!("{name}: {}", end.text().unwrap()),
        });
        (own(id, "name"), end.unwrap_or_default())
    };
    let suite = |id| {
        let tests: Vec<_> = children(node(id)).into_iter().map(test).collect();
        let errors = tests.iter().filter(|(_, end)| end.starts_with("error: "));
        let errors = errors.count();
        let skipped = tests.iter().filter(|(_, end)| end == "skipped").count();
        let others = tests.iter().filter(|(_, end)| !end.is_empty()).count();
        let counts = [
            ("tests", tests.len()),
            ("failures", others - errors - skipped),
            ("errors", errors),
            ("skipped", skipped),
        ];
        for (name, count) in counts {
            assert_eq!(own(id, name), count.to_string(), "{text}");
        }
        (own(id, "name"), tests)
    };
    assert_eq!(document.root_element().tag_name().name(), "testsuites");
    children(document.root_element())
        .into_iter()
        .map(suite)
        .collect()
}

/// A suite a case, a test a verdict; a broken limit has its figure and its limit.
#[test]
fn verdicts_are_written_as_tests() {
    let folder = folder();
    let output = ran(
        &folder,
        "run paper-2-12bit paper-1 --junit v.xml --summary s.json",
    );
    assert_eq!(status(&output), 1, "{}", stderr(&output));
    let found = suites(&read(&folder, "v.xml"));
    let summaries: Value = serde_json::from_str(&read(&folder, "s.json")).unwrap();
    for ((name, tests), summary) in found.iter().zip(summaries.as_array().unwrap()) {
        assert_eq!(name, summary["name"].as_str().unwrap());
        let verdicts = summary["verdicts"].as_array().unwrap();
        assert_eq!(tests.len(), verdicts.len());
        for ((figure, failure), verdict) in tests.iter().zip(verdicts) {
            assert_eq!(figure, verdict["figure"].as_str().unwrap());
            assert_eq!(
                failure.is_empty(),
                verdict["pass"].as_bool().unwrap(),
                "{failure}"
            );
        }
    }
    let (_, tests) = &found[0];
    assert!(
        tests[2].1.starts_with("peak_following_error_mm = ")
            && tests[2].1.ends_with(" mm, limit 5 mm (default)")
    );
    // Without a command the paper's four; with one, its own option is meant.
    assert_eq!(status(&ran(&folder, "--junit v.xml")), 0);
    assert_eq!(suites(&read(&folder, "v.xml")).len(), 4);
    assert_eq!(status(&ran(&folder, "--junit v.xml run paper-1")), 2);
    // A ladder's rungs have verdicts, and it judges nothing.
    let line = "ladder paper-2 --junit v.xml --report l.html --set budget.final_error_um=640";
    assert_eq!(status(&ran(&folder, line)), 0);
    let rungs = suites(&read(&folder, "v.xml"));
    let names: Vec<&str> = rungs.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names[..2], ["paper-2, continuous", "paper-2, sampled"]);
    let ends = rungs.iter().map(|(_, tests)| tests[0].1.as_str());
    let sampled = "final_error_um = −644.89 µm, limit 640 µm";
    assert_eq!(ends.take(2).collect::<Vec<_>>(), ["", sampled]);
}

/// What could not be made is an error with its words, whatever characters they have;
/// runs before it have their verdicts.
#[test]
fn runs_that_could_not_be_made_are_errors() {
    let folder = folder();
    let names = |line: &str, wanted: i32| {
        let output = ran(&folder, line);
        assert_eq!(status(&output), wanted, "{}", stderr(&output));
        let found = suites(&read(&folder, "v.xml"));
        let ends = found
            .into_iter()
            .map(|(name, tests)| (name, tests[0].1.clone()));
        ends.collect::<Vec<_>>()
    };
    for command in ["run paper-1", "ladder --report l.html"] {
        let ends = names(&format!("{command} <&>\"\u{1}.toml --junit v.xml"), 2);
        let (name, end) = ends.last().unwrap();
        assert_eq!(name, "<&>\"\u{fffd}.toml");
        assert!(
            end.starts_with("error: <&>\"\\u{1}.toml: there is no such"),
            "{end}"
        );
        // No case of a command is run unless all can be read.
        assert!(ends.iter().rev().skip(1).all(|(_, end)| end == "skipped"));
    }
    let paper = hil_core::runfile::builtin_text("paper-1").unwrap();
    let driving = "[carriage]\nresistance_linear_ns_per_rad = -1000\n";
    let bad = paper.replace("[carriage]\n", driving);
    assert_ne!(bad, paper);
    std::fs::write(folder.path().join("bad.toml"), bad).unwrap();
    let ends = names("run paper-1 bad.toml paper-2 --junit v.xml", 2);
    let [(paper_1, kept), (bad, end), (paper_2, skipped)] = ends.try_into().unwrap();
    assert_eq!([paper_1, bad, paper_2], ["paper-1", "bad.toml", "paper-2"]);
    assert!(end.contains("left the finite numbers"), "{end}");
    assert_eq!([kept, skipped], ["", "skipped"]);
    // After the runs the fault is no case's.
    #[cfg(target_os = "linux")]
    {
        let ends = names("run paper-1 --report /dev/full --junit v.xml", 2);
        assert_eq!(ends[0], ("paper-1".to_owned(), String::new()));
        let (name, end) = &ends[1];
        assert!(
            name == "hil-runner" && end.contains("No space left"),
            "{end}"
        );
    }
    // The contrast: the run file is none of the outputs that may be replaced.
    let output = ran(&folder, "run bad.toml --junit bad.toml");
    assert!(stderr(&output).contains("bad.toml is a run file of this command"));
    assert!(read(&folder, "bad.toml").contains(driving));
}

/// The commands of the program, as its help lists them.
fn commands() -> Vec<String> {
    let help = String::from_utf8(ran(folder(), "--help").stdout).unwrap();
    let (_, commands) = help.split_once("Commands:\n").unwrap();
    let (commands, _) = commands.split_once("\n\n").unwrap();
    let names = commands
        .lines()
        .map(|line| line.split_whitespace().next().unwrap().to_owned());
    let names: Vec<String> = names.filter(|name| name != "help").collect();
    assert!(names.len() > 10);
    names
}

/// Every shell's completions have every command and the options of `run`; bash reads
/// its own and offers what begins alike.
#[test]
fn shells_complete_commands_and_options() {
    let folder = folder();
    let of = |shell: &str| {
        String::from_utf8(ran(&folder, &format!("completions {shell}")).stdout).unwrap()
    };
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let text = of(shell);
        for word in commands().iter().map(String::as_str).chain(["time-limit"]) {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
    if cfg!(unix) {
        let ask = "COMP_WORDS=(hil-runner run paper-1 --su); COMP_CWORD=3\n\
                   _hil__runner hil-runner --su paper-1; echo \"${COMPREPLY[@]}\"\n";
        let bash = Command::new("bash")
            .arg("-c")
            .arg(of("bash") + "\n" + ask)
            .output()
            .unwrap();
        assert_eq!(String::from_utf8(bash.stdout).unwrap(), "--summary\n");
    }
}

/// A page for the program and for each of its commands, with options and examples.
#[test]
fn man_has_a_page_for_every_command() {
    let folder = folder();
    assert_eq!(status(&ran(&folder, "man pages/man1")), 0);
    for command in commands()
        .iter()
        .map(|command| format!("-{command}"))
        .chain([String::new()])
    {
        let page = read(&folder, &format!("pages/man1/hil-runner{command}.1"));
        assert!(
            page.contains(&format!(".TH hil-runner{command} 1")),
            "{command}"
        );
        assert!(page.contains("Example"), "{command}");
    }
    let page = read(&folder, "pages/man1/hil-runner-run.1");
    assert!(page.contains("\\-\\-time\\-limit"), "{page}");
}
