//! The studies that are part of the program.

use std::path::Path;

use hil_runner::study::{Changes, Study, ready};

use crate::support::{messages, study};

/// Each is listed, printed, read, and has what its pictures need.
#[test]
fn every_ready_study_is_right() {
    let folder = tempfile::TempDir::new().unwrap();
    let listed = study(folder.path(), &["--list"]);
    messages(&listed, 0);
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let names: Vec<&str> = ready::names().collect();
    assert_eq!(names.len(), 7);
    for name in names {
        assert!(listed.contains(name), "{listed}");
        let printed = study(folder.path(), &["--print", name]);
        assert_eq!(
            String::from_utf8_lossy(&printed.stdout),
            ready::text(name).unwrap()
        );
        let read = Study::load(name, &Changes::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read.name, name);
        assert!(!read.pictures.is_empty(), "{name} has no picture");
        // The page in the docs, with each picture.
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/studies");
        let page = std::fs::read_to_string(docs.join(format!("{name}.md"))).unwrap();
        assert!(page.contains(&format!("hil-runner study {name}")), "{name}");
    }
}
