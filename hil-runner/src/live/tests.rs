//! Promises of the page: modules fit together, scripts are the policy's, nothing leaves its place.

use std::collections::BTreeSet;

use hil_core::runfile::builtin_text;

use super::*;
use crate::page::PLOTS;
use crate::page::policy::tests::{is_exact, scripts};

fn live(text: &str) -> Live {
    let case = LiveCase::new("paper-2", text, &["controller.kp=4".to_owned()]).unwrap();
    Live::new(case, &Images::default()).unwrap()
}

fn paper() -> Live {
    live(builtin_text("paper-2").unwrap())
}

/// The modules of a page, of a report and of a study with a simulator.
fn pages() -> [Vec<&'static str>; 3] {
    [
        [&PLOTS[..], &ALONE].concat(),
        [&PLOTS[..], &crate::report::MODULES, &SECTION].concat(),
        [&PLOTS[..], &SECTION].concat(),
    ]
}

/// Names that a module declares for all.
fn declared<'m>(module: &'m str) -> Vec<&'m str> {
    let mut names = Vec::new();
    for line in module.lines() {
        let line = line.strip_prefix("export ").unwrap_or(line);
        let line = line.strip_prefix("async ").unwrap_or(line);
        let kinds = ["const ", "let ", "function ", "class "];
        let Some(rest) = kinds.iter().find_map(|kind| line.strip_prefix(kind)) else {
            continue;
        };
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        match rest.strip_prefix(['{', '[']) {
            None => {
                names.extend(rest.split(|c| !is_name(c)).next());
                // Of `const A = 0, B = 1;` the others.
                let plain = |part: &&'m str| part.split(" = ").count() == 2 && !part.contains('(');
                let parts = rest.split(", ").take_while(plain).skip(1);
                names.extend(parts.filter_map(|part| part.split(" = ").next()));
            }
            Some(rest) => {
                let all = rest.split(['}', ']']).next().unwrap_or_default();
                let each = all.split(',').map(|name| name.trim());
                names.extend(each.filter_map(|name| name.rsplit([' ', ':']).next()));
            }
        }
    }
    names
}

/// The names that a module takes from others.
fn imported(module: &str) -> Vec<&str> {
    let lists = module.split("\nimport {").skip(1);
    let first = module.strip_prefix("import {").into_iter();
    let lists = first.chain(lists);
    lists
        .filter_map(|rest| rest.split('}').next())
        .flat_map(|list| list.split(',').map(str::trim))
        .filter(|name| !name.is_empty())
        .collect()
}

/// The first name that is declared twice, or taken though no module has it.
fn misfit<'m>(modules: &[&'m str]) -> Option<&'m str> {
    let mut known = BTreeSet::new();
    let mut all = modules.iter().flat_map(|module| declared(module));
    let twice = all.find(|name| !known.insert(*name));
    let mut taken = modules.iter().flat_map(|module| imported(module));
    twice.or_else(|| taken.find(|name| !known.contains(name)))
}

#[test]
fn modules_fit_together() {
    for modules in pages() {
        assert_eq!(misfit(&modules), None);
        let all: usize = modules.iter().map(|module| declared(module).len()).sum();
        assert!(all > 100, "{all}");
    }
    // The contrast: a name twice, and one that no module has.
    let own = "export const { a, b: c } = {};\nconst d = 1, e = 2;\nconst f = (g, h = 3) => 1;\n";
    assert_eq!(declared(own), ["a", "c", "d", "e", "f"]);
    assert_eq!(misfit(&[own, "function c() {}\n"]), Some("c"));
    let user = "import {\n  a,\n  d,\n} from \"./own.js\";\n";
    assert_eq!(misfit(&[own, user]), None);
    assert_eq!(misfit(&[user]), Some("a"));
}

#[test]
fn scripts_stay_in_their_elements() {
    let all = pages().concat();
    for text in all.iter().chain([&WORKER, &BEGIN]) {
        assert!(!text.contains("</script") && !text.contains("<!--"));
    }
}

#[test]
fn policy_lets_the_own_scripts_and_no_other() {
    let page = paper().page().unwrap();
    assert!(is_exact(&page));
    for word in [
        "'wasm-unsafe-eval'",
        "worker-src blob:",
        "default-src 'none'",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert!(!page.contains("unsafe-eval'; ") && !page.contains("script-src 'unsafe-inline'"));
    // The contrast: a byte of the script, a script more, and a hash more.
    let changed = page.replacen("<script>", "<script> ", 1);
    let more = page.replacen("</body>", "<script>1</script></body>", 1);
    let hash = page.replacen("'sha256-", "'sha256-a' 'sha256-", 1);
    for other in [changed, more, hash] {
        assert_ne!(other, page);
        assert!(!is_exact(&other));
    }
}

#[test]
fn nothing_is_loaded() {
    let page = paper().page().unwrap();
    let own = page.find("<script>").unwrap();
    for load in [
        " src=",
        "@import",
        "url(",
        "http:",
        "https:",
        "<iframe",
        "<link rel=\"style",
    ] {
        assert!(!page[..own].contains(load), "{load}");
    }
    for load in [
        "fetch(",
        "XMLHttpRequest",
        "importScripts",
        "WebSocket",
        "sendBeacon",
    ] {
        assert!(!scripts(&page).concat().contains(load), "{load}");
    }
}

#[test]
fn run_file_cannot_leave_its_place() {
    let text = builtin_text("paper-2").unwrap();
    let clean = paper().page().unwrap();
    let hostile = format!("# </script><script>alert(1)</script><!-- {{{{ 7*7 }}}}\n{text}");
    let page = live(&hostile).page().unwrap();
    for tag in ["<script", "</script", "<!--"] {
        assert_eq!(
            page.matches(tag).count(),
            clean.matches(tag).count(),
            "{tag}"
        );
    }
    assert!(is_exact(&page));
    let data = page.split_once("id=\"live-data\">").unwrap().1;
    let data = data.split_once("</script>").unwrap().0;
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["text"], hostile);
    assert_eq!(data["sets"], serde_json::json!(["controller.kp=4"]));
}

#[test]
fn same_case_same_bytes_and_another_hash_for_another() {
    assert_eq!(paper().page().unwrap(), paper().page().unwrap());
    let one = LiveCase::new("paper-2", builtin_text("paper-2").unwrap(), &[]).unwrap();
    assert_eq!(one.hash().len(), 16);
    assert_ne!(one.hash(), paper().case.hash());
    let other = LiveCase::new("paper-1", builtin_text("paper-1").unwrap(), &[]).unwrap();
    assert_ne!(one.hash(), other.hash());
}

/// The run file's profile comes along, by the path that the file gives.
#[test]
fn profile_comes_along() {
    let folder = tempfile::tempdir().unwrap();
    let profile = "t_s,x_mm\n0,0\n0.1,1\n0.2,2\n";
    std::fs::write(folder.path().join("p.csv"), profile).unwrap();
    let text = builtin_text("paper-2").unwrap();
    let file = folder.path().join("axis.toml");
    let sets = ["motion.profile=p.csv".to_owned()];
    let case = LiveCase::new(file.to_str().unwrap(), text, &sets);
    let beside = case.unwrap().beside;
    assert_eq!(beside.get("p.csv").map(String::as_str), Some(profile));
    assert_eq!(beside.len(), 1);
}
