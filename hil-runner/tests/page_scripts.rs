//! The scripts of the pages, run by Node.js: left out where there is none,
//! required with `CI` set.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::Command;

#[test]
fn scripts_do_what_their_pages_need() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/page_scripts.js");
    let output = match Command::new("node").arg(script).output() {
        Err(error) if std::env::var_os("CI").is_none() => {
            eprintln!("left out, there is no node: {error}");
            return;
        }
        output => output.unwrap(),
    };
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{told}");
    // True vectors, in XML that others can read.
    let svg = String::from_utf8(output.stdout).unwrap();
    let svg = roxmltree::Document::parse(&svg).unwrap();
    let count = |tag: &str| svg.descendants().filter(|n| n.has_tag_name(tag)).count();
    assert_eq!((count("clipPath"), count("image")), (1, 0));
    assert!(count("path") > 10 && count("text") > 10);
}
