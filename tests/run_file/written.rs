//! The files that the table of keys writes: the reference of all keys, and the lines of
//! the built-in cases for keys that they leave out.

use std::collections::BTreeSet;

use hil_core::number::seconds;
use hil_core::runfile::{
    Key, Kind, LISTS, Need, SECTIONS, Section, Value, Way, builtin_names, builtin_text,
};

#[test]
fn the_key_reference_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/KEYS.md");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(path, key_reference()).unwrap();
    }
    let found = std::fs::read_to_string(path).unwrap();
    assert_eq!(found, key_reference());
}

/// Keys that a file leaves out stand in it as the table has them.
#[test]
fn the_built_in_cases_are_commented_by_the_table() {
    let mut other = Vec::new();
    for name in builtin_names() {
        let path = format!("{}/../cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap();
        let commented = commented(name, &text);
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(&path, &commented).unwrap();
        }
        let mut lines = text.lines();
        let moved = commented.lines().filter(|line| lines.next() != Some(line));
        other.extend(moved.map(|line| format!("{name}: {line}")));
    }
    assert!(other.is_empty(), "{other:#?}");
}

/// The contrast: a line that is not there comes back.
#[test]
fn a_line_that_is_missing_is_written() {
    let text = builtin_text("paper-2").unwrap();
    let (before, after) = text.split_once("# no_pull").unwrap();
    let (_, after) = after.split_once('\n').unwrap();
    assert_eq!(commented("paper-2", &format!("{before}{after}")), text);
}

/// All keys of the run file in Markdown: one table a section.
fn key_reference() -> String {
    let mut page = String::from(
        "# Keys of the run file\n\n\
         TOML, one file a run. Integers serve for numbers; `nan` and `inf` are refused. Numbers\n\
         other than 0 lie between 1e-50 and 1e50 in magnitude. Times of the run (marked \"ns\") are\n\
         whole nanoseconds and at most 1e9 s. `hil-runner schema` prints the same as a JSON schema.\n",
    );
    let sections = SECTIONS.iter().map(|section| match section.name {
        "" => (section, "Top of the file".to_owned()),
        name => (section, format!("`[{name}]`")),
    });
    let rows = LISTS
        .iter()
        .map(|list| (&list.row, format!("`[[{}]]`", list.row.name)));
    for (section, title) in sections.chain(rows) {
        page.push_str(&format!("\n## {title}\n\n{}\n\n", section.meaning));
        page.push_str("| key | unit | allowed | if left out | acts on | meaning |\n");
        page.push_str("| --- | --- | --- | --- | --- | --- |\n");
        for key in section.keys {
            page.push_str(&row(section, key));
        }
        let several = |ways: &&&[Way]| ways.iter().any(|way| way.len() > 1);
        for ways in section.ways.iter().filter(several) {
            page.push_str(&format!("\nOne way of {}.\n", section.ways_words(ways)));
        }
    }
    page
}

fn row(section: &Section, key: &Key) -> String {
    let unit = match key.kind {
        Kind::Time(_) => "s (ns)",
        _ => key.unit,
    };
    // Of each other way the first key that does not stand in one with this key.
    let other_of = |way: &Way| {
        let mut names = way.iter().filter(|name| section.excludes(key.name, name));
        names.next().map(|name| format!("`{name}`"))
    };
    let others = section.ways_with(key.name).iter().filter_map(other_of);
    let others = either(others.collect::<BTreeSet<_>>());
    let excuse = match key.need {
        Need::ElasticJoint => Some("the joint is rigid".to_owned()),
        Need::SampledLaw => Some("the law is \"continuous\"".to_owned()),
        Need::VoltageAtLimit => Some("the current loop is ideal".to_owned()),
        _ => None,
    };
    let given = (!others.is_empty()).then(|| format!("{others} is given"));
    let excuses = either(excuse.into_iter().chain(given));
    let mut absent = match key.need {
        need if need.is_required() && excuses.is_empty() => "required".to_owned(),
        Need::Always | Need::ElasticJoint | Need::SampledLaw | Need::VoltageAtLimit => {
            format!("required unless {excuses}")
        }
        Need::CurrentDrive => "required of a current drive".to_owned(),
        Need::Optional => "–".to_owned(),
        Need::OnlyWith(partner) => format!("–; only with `{partner}`"),
        Need::Limit => "no limit".to_owned(),
        Need::FileStem => "stem of the file's name".to_owned(),
        Need::Default(default) => format!("`{}`", default.to_toml()),
    };
    if !others.is_empty() {
        absent += &match key.need.is_required() {
            true => "; never both".to_owned(),
            false => format!("; never with {others}"),
        };
    }
    let (name, allowed) = (key.name, key.range_words());
    let acts = key.acts.words();
    let meaning = key.meaning.trim_end_matches(',');
    format!("| `{name}` | {unit} | {allowed} | {absent} | {acts} | {meaning} |\n")
}

/// Column in which the remarks of a commented file begin.
const REMARKS: usize = 40;

/// A run file in whose sections every key stands: what it does not give is
/// commented out, with its default or an example, and a remark. Such lines that
/// it has are written anew, missing ones follow the key above them in the table.
fn commented(name: &str, text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for section in SECTIONS.iter().filter(|section| section.name != "budget") {
        let header = format!("[{}]", section.name);
        let header = lines.iter().position(|line| line.starts_with(&header));
        let start = match header {
            Some(line) => line + 1,
            None if section.name.is_empty() => 0,
            None => continue,
        };
        let mut at = start;
        for key in section.keys {
            let shows = |line: &&String| {
                let line = line.trim_start_matches("# ").strip_prefix(key.name);
                line.is_some_and(|rest| rest.starts_with(" = "))
            };
            let body = lines.iter().skip(start);
            let mut body = body.take_while(|line| !line.starts_with('['));
            let found = body.position(|line| shows(&line)).map(|line| start + line);
            let is_given = |line: usize| lines.get(line).is_some_and(|l| !l.starts_with('#'));
            if let Some(line) = found.filter(|line| is_given(*line)) {
                at = line + 1;
            } else if let Some(comment) = comment(key, name) {
                let from = found.unwrap_or(at);
                let more = |line: &&String| line.starts_with("#          ");
                let old = found.map_or(0, |line| {
                    1 + lines.iter().skip(line + 1).take_while(more).count()
                });
                at = from + comment.len();
                lines.splice(from..from + old, comment);
            }
        }
    }
    lines.join("\n") + "\n"
}

/// A key that is not given, in the lines that it takes; nothing for one that
/// must be given.
fn comment(key: &Key, name: &str) -> Option<Vec<String>> {
    let value = match (key.need, key.default()) {
        (Need::FileStem, _) => format!("\"{name}\""),
        (_, Some(Value::Number(number))) => format!("{number:?}"),
        (_, Some(Value::Nanoseconds(0))) => "0.0".to_owned(),
        (_, Some(Value::Nanoseconds(ns))) => seconds(ns).to_string(),
        (_, Some(default)) => default.to_toml(),
        (_, None) if key.example.is_empty() => return None,
        (_, None) => key.example.to_owned(),
    };
    let first = format!("# {} = {value}", key.name);
    let mut remarks: Vec<String> = key.note.iter().map(|&note| note.to_owned()).collect();
    if let (Kind::Choice([_, others @ ..]), []) = (key.kind, key.note) {
        let quoted: Vec<String> = others.iter().map(|c| format!("\"{c}\"")).collect();
        remarks.push(format!("or {}", quoted.join(", ")));
    }
    let beside = |text: &str, remark: &str| {
        let spaces = REMARKS.saturating_sub(text.chars().count()).max(3);
        format!("{text}{:spaces$}# {remark}", "")
    };
    let Some((remark, more)) = remarks.split_first() else {
        return Some(vec![first]);
    };
    let mut lines = vec![beside(&first, remark)];
    lines.extend(more.iter().map(|remark| beside("#", remark)));
    Some(lines)
}

/// `a`, `a or b`, `a, b or c`.
fn either(words: impl IntoIterator<Item = String>) -> String {
    match words.into_iter().collect::<Vec<_>>().as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}
