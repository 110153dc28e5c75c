//! The arrows between files, folders and packages: who uses whom.
//!
//! A room is a file or a folder. In every folder the rooms use each other one
//! way: no circle, whatever it goes through. Packages may use those that
//! [`PACKAGES`] allows.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[path = "arrows/graph.rs"]
mod graph;
#[path = "arrows/sources.rs"]
mod sources;

use std::collections::BTreeMap;
use std::path::Path;

use graph::circles;
use sources::{Package, arrows};

/// Every package of the workspace with a library: its name in Rust, its folder
/// and the packages that it may use.
const PACKAGES: [(&str, &str, &[&str]); 6] = [
    ("firmware", "firmware/src", &[]),
    ("firmware_link", "firmware/link/src", &["firmware"]),
    ("servo", "firmware/c/src", &["firmware"]),
    ("plant", "plant/src", &[]),
    ("hil_core", "hil-runner/core/src", &["firmware", "plant"]),
    (
        "hil_runner",
        "hil-runner/src",
        &["firmware", "firmware_link", "plant", "hil_core"],
    ),
];

/// A room that is to be replaced whole, by a page that draws itself: its circles
/// stay until then.
const LEFT: &str = "hil-runner/src/study/picture";

fn packages() -> Vec<Package> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |(name, folder, _)| Package::read(name, folder, &root.join(folder));
    PACKAGES.map(read).into()
}

/// No circle in any folder.
#[test]
fn arrows_go_one_way() {
    let arrows = arrows(&packages());
    assert!(arrows.len() > 300, "{} arrows", arrows.len());
    let (left, found): (Vec<_>, Vec<_>) = circles(&arrows)
        .into_iter()
        .partition(|circle| circle.starts_with(LEFT));
    // An exception that nothing needs any more goes.
    assert!(!left.is_empty());
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A package uses what it may, and nothing else.
#[test]
fn packages_use_what_they_may() {
    let package = |file: &str| {
        PACKAGES
            .iter()
            .filter(|(_, folder, _)| Path::new(file).starts_with(folder))
            .max_by_key(|(_, folder, _)| folder.len())
            .unwrap()
    };
    let mut used = BTreeMap::new();
    for (from, to) in arrows(&packages()) {
        let (name, _, may_use) = package(&from);
        let (other, _, _) = package(&to);
        if name != other {
            assert!(may_use.contains(other), "{from} uses {to}");
            *used.entry((name, other)).or_insert(0) += 1;
        }
    }
    // The contrast: the arrows that there are were seen.
    assert!(used.contains_key(&(&"hil_runner", &"hil_core")), "{used:?}");
    assert!(used.contains_key(&(&"hil_core", &"plant")), "{used:?}");
}

/// The contrasts: circles between two files, through a re-export, through a
/// folder and through a path in the text are found, and no circle where there
/// is none.
#[test]
fn circles_are_found() {
    let circle_of = |files: &[(&str, &str)]| {
        let package = Package::of_texts("own", "src", files);
        circles(&arrows(&[package]))
    };
    let lib = ("lib.rs", "mod a; mod b; mod c; pub use b::B;");
    let straight = [
        lib,
        ("a.rs", "use crate::B; pub struct A(B);"),
        ("b.rs", "pub struct B; /// [`crate::a`]\nmod inner {}"),
        (
            "c/mod.rs",
            "mod d; pub use d::D; pub const C: u8 = crate::a::N;",
        ),
        (
            "c/d.rs",
            "pub struct D; #[cfg(test)] mod tests { use crate::c::C; }",
        ),
    ];
    assert_eq!(circle_of(&straight), [""; 0]);
    let with = |changed: (&'static str, &'static str)| {
        let files = straight.map(|file| if file.0 == changed.0 { changed } else { file });
        circle_of(&files)
    };
    let two = ["src: a.rs, b.rs"];
    assert_eq!(with(("b.rs", "use crate::a::A; pub struct B(A);")), two);
    assert_eq!(with(("b.rs", "pub fn f() { let _ = super::a::N; }")), two);
    let three = ["src: a.rs, b.rs, c"];
    assert_eq!(with(("b.rs", "use crate::c::D; pub struct B(D);")), three);
    assert_eq!(with(("a.rs", "use crate::c::D;")), ["src: a.rs, c"]);
    assert_eq!(with(("c/d.rs", "use super::C;")), [""; 0]);
    let files = [
        straight[0],
        straight[1],
        straight[2],
        ("c/mod.rs", "mod d; use d::D; pub const C: D = D;"),
        ("c/d.rs", "use super::C;"),
    ];
    assert_eq!(circle_of(&files), ["src/c: d.rs, mod.rs"]);
}
