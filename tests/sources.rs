//! Words that the sources must not contain.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

/// Every Rust file below a folder of the project.
fn rust_files(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut folders = vec![root.join(folder)];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    assert!(!files.is_empty(), "{folder}");
    files
}

/// The program text of a file, without comments and without its unit tests.
fn program(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The first of `words` that stands in the text as a whole word.
fn finds<'a>(text: &str, words: &[&'a str]) -> Option<&'a str> {
    let of_word = |c: char| c.is_alphanumeric() || c == '_';
    words.iter().copied().find(|&word| {
        text.match_indices(word).any(|(at, _)| {
            let before = text[..at].chars().next_back();
            let after = text[at + word.len()..].chars().next();
            !before.is_some_and(of_word) && !after.is_some_and(of_word)
        })
    })
}

/// The firmware has no float, no unsafe code, no heap and no way to panic
/// that is written out.
#[test]
fn firmware_is_integers_only() {
    let words = [
        "f32", "f64", "unsafe", "std", "alloc", "Box", "panic", "unwrap", "expect", "todo",
    ];
    let files: Vec<PathBuf> = ["firmware/src", "firmware/link/src"]
        .into_iter()
        .flat_map(rust_files)
        .collect();
    for file in &files {
        // A file of tests is no part of the program.
        if file.ends_with("tests.rs") {
            continue;
        }
        let text = program(&std::fs::read_to_string(file).unwrap());
        assert_eq!(finds(&text, &words), None, "{}", file.display());
    }
    let libs = files.iter().filter(|file| file.ends_with("lib.rs"));
    let no_std = |file: &PathBuf| {
        std::fs::read_to_string(file)
            .unwrap()
            .contains("#![no_std]")
    };
    assert_eq!(libs.map(no_std).collect::<Vec<_>>(), [true; 2]);
}

/// The plant and the control laws use nothing whose last bit depends on the
/// machine: no fused multiply-add, no function of the platform's math
/// library (square roots and floors are exact everywhere).
#[test]
fn results_do_not_depend_on_the_platform() {
    let functions = [
        "mul_add", "sin", "cos", "tan", "sin_cos", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log",
        "log2", "log10", "powf", "powi", "cbrt", "hypot", "asin", "acos", "sinh", "cosh", "tanh",
        "atan", "atan2",
    ];
    // As a method; `libm::sin` is the crate's and the same everywhere.
    let calls = functions.map(|function| format!(".{function}("));
    let paths = functions.map(|function| format!("f64::{function}"));
    let mut files: Vec<PathBuf> = ["plant/src", "hil-runner/core/src"]
        .into_iter()
        .flat_map(rust_files)
        .collect();
    // Digits that sentences show, and powers of two; tests are no part of the
    // program.
    let shown = ["number.rs", "quantise.rs", "scaling.rs", "tests.rs"];
    files.retain(|file| {
        let in_tests = file
            .parent()
            .is_some_and(|folder| folder.ends_with("tests"));
        !in_tests && !shown.iter().any(|name| file.ends_with(name))
    });
    for file in files {
        let text = program(&std::fs::read_to_string(&file).unwrap());
        let found = calls
            .iter()
            .chain(&paths)
            .find(|call| text.contains(call.as_str()));
        assert_eq!(found, None, "{}", file.display());
    }
}

/// Paths of files that a page names and that are not there. `core`, `runner`,
/// `firmware` and `plant` stand for the folders of their sources; a name alone is
/// searched below all of them.
fn missing_files(page: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders = [
        ("core/", "hil-runner/core/src/"),
        ("runner/", "hil-runner/src/"),
        ("firmware/", "firmware/src/"),
        ("plant/", "plant/src/"),
    ];
    let sources: Vec<PathBuf> = ["firmware", "plant", "hil-runner", "tests", "benches"]
        .into_iter()
        .flat_map(rust_files)
        .collect();
    let named = page.split('`').skip(1).step_by(2);
    let files = named.filter(|name| name.ends_with(".rs") && !name.contains(['*', '…', ' ']));
    let is_there = |name: &str| {
        let spelled = folders
            .iter()
            .filter_map(|(short, folder)| Some(format!("{folder}{}", name.strip_prefix(short)?)));
        root.join(name).exists()
            || spelled.into_iter().any(|path| root.join(path).exists())
            || sources.iter().any(|file| file.ends_with(name))
    };
    let generic = |name: &&str| name.contains("NAME") || name.contains("KIND");
    files
        .filter(|name| !generic(name) && !is_there(name))
        .map(str::to_owned)
        .collect()
}

/// The pages for who comes next name files that are there.
#[test]
fn pages_name_files_that_are_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for page in ["docs/ARCHITECTURE.md", "CONTRIBUTING.md"] {
        let text = std::fs::read_to_string(root.join(page)).unwrap();
        assert_eq!(missing_files(&text), [""; 0], "{page}");
    }
    // The contrast.
    assert_eq!(missing_files("see `core/nowhere.rs`"), ["core/nowhere.rs"]);
}

/// The programs on the page of one's own board are those that `scripts/boards` builds.
#[test]
fn snippets_are_built() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/BOARD.md")).unwrap();
    let built = rust_files("firmware/examples/boards").into_iter();
    let built: Vec<String> = built
        .map(|file| std::fs::read_to_string(file).unwrap())
        .collect();
    let snippets = page.split("```rust\n").skip(1);
    let snippets: Vec<&str> = snippets
        .filter_map(|rest| rest.split("```").next())
        .collect();
    assert_eq!(snippets.len(), 3);
    for snippet in snippets {
        let is_built = |snippet: &str| built.iter().any(|program| program.contains(snippet));
        assert!(is_built(snippet), "{snippet}");
        // The contrast.
        assert!(!is_built(
            &snippet
                .replacen("drive", "drives", 1)
                .replacen("code", "codes", 1)
        ));
    }
}

/// The contrast: the search finds what it looks for, and only whole words.
#[test]
fn the_search_finds_whole_words() {
    assert_eq!(finds("let x: f64 = 1.0;", &["f64"]), Some("f64"));
    assert_eq!(finds("let if64 = 1;", &["f64"]), None);
    assert_eq!(finds(&program("// f64\nlet x = 1;"), &["f64"]), None);
    assert_eq!(finds(&program("#[cfg(test)]\nf64"), &["f64"]), None);
}
