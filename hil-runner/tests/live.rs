//! Pages with the simulator, as the program writes them. Left out where no compiler here builds
//! the simulator, required with `CI` set.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::Read;
use std::path::Path;
use std::process::{Command, Output};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::read::GzDecoder;
use hil_core::runfile::{builtin_names, builtin_text};
use hil_runner::chip::wasm::Page;
use hil_runner::image::{Builder, Recipe};
use hil_runner::live::{Images, recipe};
use serde_json::Value;

/// Runs the program in `folder` with the words of a line.
fn ran(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap()
}

/// True where the simulator can be had.
fn has_simulator() -> bool {
    let Recipe { images, .. } = recipe();
    let available = Builder::from_environment().available(&recipe(), images[0]);
    if let Err(error) = &available {
        eprintln!("left out: {error}");
        assert!(std::env::var_os("CI").is_none());
    }
    available.is_ok()
}

/// The text of an element of a page.
fn element<'p>(page: &'p str, id: &str) -> &'p str {
    let (_, rest) = page.split_once(&format!(" id=\"{id}\">")).unwrap();
    rest.split_once("</script>").unwrap().0
}

/// The bytes of a packed part of a page, as they stand there.
fn carried(page: &str, name: &str) -> Vec<u8> {
    let (_, rest) = page
        .split_once(&format!(" data-packed=\"{name}\">"))
        .unwrap();
    let base64 = rest.split_once("</script>").unwrap().0;
    BASE64_STANDARD.decode(base64).unwrap()
}

/// One that is packed as gzip.
fn unpacked(page: &str, name: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let gzip = carried(page, name);
    GzDecoder::new(&gzip[..]).read_to_end(&mut bytes).unwrap();
    bytes
}

fn data(page: &str) -> Value {
    serde_json::from_str(element(page, "live-data")).unwrap()
}

fn read(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join(file)).unwrap()
}

#[test]
fn page_is_one_file_and_always_the_same() {
    if !has_simulator() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = ran(folder.path(), "live paper-2 --set controller.kp=4");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let page = read(folder.path(), "out/paper-2-live.html");
    let told = String::from_utf8(output.stdout).unwrap();
    let size = format!("out/paper-2-live.html: {} kB", page.len() / 1000);
    assert!(told.starts_with(&size), "{told}");
    assert!(page.len() <= 700_000, "{}", page.len());
    let output = ran(folder.path(), "live paper-2 --set controller.kp=4 --out -");
    let same = output.stdout == page.as_bytes();
    assert!(same, "standard output has other bytes");
    assert_eq!(data(&page)["sets"], serde_json::json!(["controller.kp=4"]));
    // The contrast: another case.
    let other = ran(folder.path(), "live paper-2 --set controller.kp=3 --out -").stdout;
    assert_ne!(other, page.as_bytes());
    let other = data(&String::from_utf8(other).unwrap());
    assert_ne!(other["hash"], data(&page)["hash"]);
}

#[test]
fn every_built_in_case_has_its_page() {
    if !has_simulator() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for name in builtin_names() {
        let output = ran(folder.path(), &format!("live {name} --out page.html"));
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let page = read(folder.path(), "page.html");
        let data = data(&page);
        assert_eq!(data["name"], name);
        assert_eq!(data["file"], name);
        assert_eq!(data["text"].as_str(), builtin_text(name));
        assert_eq!(data["rungs"], Value::Null);
        assert!(unpacked(&page, "unpacker").starts_with(b"\0asm"));
        assert!(!element(&page, "live-worker").trim().is_empty());
    }
}

/// The image that a page carries is the one that was built, as the page itself unpacks it.
#[test]
fn image_unpacks_to_the_same_bytes() {
    if !has_simulator() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let page = ran(folder.path(), "live paper-2 --out -").stdout;
    let page = String::from_utf8(page).unwrap();
    let images = Images::find(&mut |_| ()).unwrap();
    let unpacker = unpacked(&page, "unpacker");
    assert!(unpacker == *images.unpacker);
    let mut unpacker = Page::start(&unpacker).unwrap();
    let mut packed = carried(&page, "simulator");
    assert!(3 * packed.len() < images.simulator.len());
    assert!(unpacker.ask("unpack", &packed).unwrap() == *images.simulator);
    // The contrast: a byte that is another, a half, and nothing.
    packed[100] ^= 1;
    assert!(unpacker.ask("unpack", &packed).unwrap() != *images.simulator);
    packed.truncate(packed.len() / 2);
    for packed in [&packed[..], b""] {
        assert_eq!(unpacker.ask("unpack", packed).unwrap(), b"");
    }
}

/// A run file from standard input, and one with a profile beside it.
#[test]
fn run_file_comes_along() {
    if !has_simulator() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let profile = "t_s,x_mm\n0,0\n0.1,1\n0.2,2\n";
    std::fs::write(folder.join("p.csv"), profile).unwrap();
    let paper = builtin_text("paper-1").unwrap();
    std::fs::write(folder.join("axis.toml"), paper).unwrap();
    let output = ran(folder, "live axis.toml --set motion.profile=p.csv --out -");
    let page = String::from_utf8(output.stdout).unwrap();
    assert_eq!(data(&page)["beside"], serde_json::json!({"p.csv": profile}));
    let program = env!("CARGO_BIN_EXE_hil-runner");
    let piped = format!("'{program}' live - --out - <axis.toml");
    let output = Command::new("sh")
        .args(["-c", &piped])
        .current_dir(folder)
        .output();
    let page = String::from_utf8(output.unwrap().stdout).unwrap();
    assert_eq!(data(&page)["file"], "stdin");
    assert_eq!(data(&page)["text"], paper);
    assert_eq!(data(&page)["beside"], serde_json::json!({}));
}

const STUDY: &str = "\
name = \"two\"
base = \"paper-2\"

[[axis]]
key = \"controller.kp\"
values = [3.0, 3.2]
";

const TUNE: &str = "tune paper-2 --set tune.keys=[\"controller.kp\",\"controller.ki_per_s\"] \
                    --set tune.runs=300 --out tuned --live";

/// The pages of other commands carry the simulator where that is asked for, and only there.
#[test]
fn pages_of_others_carry_it() {
    if !has_simulator() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("two.toml"), STUDY).unwrap();
    for (line, page, name) in [
        (
            "run paper-1 paper-2 --report r.html --live",
            "r.html",
            "paper-1",
        ),
        ("ladder paper-1 --report l.html --live", "l.html", "paper-1"),
        (
            "study two.toml --out two --live",
            "two/report.html",
            "paper-2",
        ),
        (TUNE, "tuned/report.html", "paper-2"),
    ] {
        let output = ran(folder, line);
        assert_eq!(output.status.code(), Some(0), "{line}: {output:?}");
        let html = read(folder, page);
        let data = data(&html);
        assert_eq!(data["name"], name, "{line}");
        assert_eq!(
            data["rungs"].is_null(),
            !line.starts_with("ladder"),
            "{line}"
        );
        assert!(html.contains("'wasm-unsafe-eval'"), "{line}");
        assert_eq!(
            html.matches("<script>").count(),
            html.matches("'sha256-").count()
        );
        // The contrast: the same without.
        let output = ran(folder, &line.replace(" --live", ""));
        assert_eq!(output.status.code(), Some(0), "{line}: {output:?}");
        let html = read(folder, page);
        assert!(!html.contains("id=\"live"), "{line}");
        assert!(!html.contains("wasm-unsafe-eval"), "{line}");
    }
    // Each point of a front has what opens it; what was asked of the search is no part of it.
    ran(folder, TUNE);
    let html = read(folder, "tuned/report.html");
    assert_eq!(data(&html)["sets"], serde_json::json!([]));
    let tune: Value = serde_json::from_str(element(&html, "tune-data")).unwrap();
    let (front, sets) = (
        tune["front"].as_array().unwrap(),
        tune["sets"].as_array().unwrap(),
    );
    assert_eq!(front.len(), sets.len());
    let first = sets[0].as_array().unwrap();
    let value = front[0]["values"][0].as_str().unwrap();
    assert!(
        first.contains(&format!("controller.kp={value}").into()),
        "{first:?}"
    );
}

/// Without a simulator and without a way to make one there is a sentence, and no page.
#[test]
fn simulator_that_cannot_be_made_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(["live", "paper-2", "--out", "page.html"])
        .env("CARGO", "/no/such/cargo")
        .env("CARGO_TARGET_DIR", folder.path())
        .current_dir(folder.path())
        .output()
        .unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    let words = [
        "the simulator for web pages could not be built",
        "no compiler here builds for wasm32",
    ];
    assert!(words.iter().any(|words| told.contains(words)), "{told}");
    assert!(!folder.path().join("page.html").exists());
}

/// What cargo says that the images are made of, by a list of sources.
fn left_out(sources: &[&str]) -> Vec<String> {
    let builder = Builder::from_environment();
    let built = builder
        .target_folder
        .join("wasm/wasm32-unknown-unknown/wasm");
    let made_of = ["hil_web.d", "hil_unpack.d"]
        .map(|file| std::fs::read_to_string(built.join(file)).unwrap())
        .concat();
    let files = made_of
        .split_whitespace()
        .filter(|file| !file.ends_with(':'));
    let own = files.map(|file| {
        let file = Path::new(file).strip_prefix(&builder.project).unwrap();
        file.to_path_buf()
    });
    let is_known = |file: &Path| sources.iter().any(|source| file.starts_with(source));
    let others = own.filter(|file| !is_known(file));
    others.map(|file| file.display().to_string()).collect()
}

#[test]
fn every_source_of_the_simulator_is_looked_at() {
    if !has_simulator() {
        return;
    }
    let mut builder = Builder::from_environment();
    builder
        .image(&recipe(), recipe().images[0], &mut |_| ())
        .unwrap();
    let sources = recipe().sources;
    assert_eq!(left_out(sources), [""; 0]);
    // The contrast: a folder less.
    let fewer: Vec<&str> = sources
        .iter()
        .copied()
        .filter(|source| *source != "plant/src")
        .collect();
    assert!(left_out(&fewer).len() > 10);
    builder.project = "/no/such/project".into();
    builder.target_folder = "/no/such/folder".into();
    let none = builder
        .available(&recipe(), recipe().images[0])
        .unwrap_err()
        .to_string();
    assert!(
        none.starts_with("there is no simulator for web pages and no sources in /no/such/project"),
        "{none}"
    );
}

#[test]
fn the_simulator_is_certified() {
    if !has_simulator() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = ran(
        folder.path(),
        "certify paper-2 paper-2-12bit --link wasm --json",
    );
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let both: Value = serde_json::from_slice(&output.stdout).unwrap();
    let [host, page] = [&both[0], &both[1]];
    assert_eq!(page["target"], "wasm");
    assert_eq!(page["trace_hash"], host["trace_hash"]);
    assert_eq!(page["vectors"], host["vectors"]);
    // Two cases on four rungs, each with all of its curves.
    assert_eq!(page["runs"]["runs"], 8);
    assert_eq!(page["runs"]["difference"], Value::Null);
    assert!(page["runs"]["numbers"].as_u64().unwrap() > 100_000);
    // No chip is a page, and flips are a chip's.
    let refused = ran(folder.path(), "certify paper-2 --link wasm --flips 3");
    assert_eq!(refused.status.code(), Some(2));
}
