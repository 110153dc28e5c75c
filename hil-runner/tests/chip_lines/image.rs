//! Images are found, built when they must be, and only then. The compiler and
//! cargo are scripts that note how they were called.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime};

use hil_runner::chip::ChipError;
use hil_runner::chip::image::Finder;
use hil_runner::chip::spec::Target;
use hil_runner::image::Builder;

/// A project with sources, a compiler and a cargo.
struct Project {
    folder: tempfile::TempDir,
}

impl Project {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let project = Self { folder };
        for file in [
            "Cargo.toml",
            "firmware/Cargo.toml",
            "firmware/src/lib.rs",
            "firmware/link/Cargo.toml",
            "firmware/link/src/lib.rs",
            "firmware/cortex-m/Cargo.toml",
            "firmware/cortex-m/images/src/lib.rs",
            "firmware/cortex-m/images/memory/m4.x",
        ] {
            project.write(file, "");
        }
        // Notes its call, and makes both images.
        project.script(
            "cargo",
            "echo \"$RUSTC $RUSTC_BOOTSTRAP $(command -v rust-lld)\" >>.called\n\
             echo \"$*\" >>.called\n\
             while [ $# -gt 0 ]; do\n\
             case $1 in --target) t=$2;; --target-dir) d=$2;; esac; shift\n\
             done\n\
             echo image >$d/$t/release/fifo; echo image >$d/$t/release/uart",
        );
        project.compiler(
            "rustc",
            "lib/rustlib/thumbv7em-none-eabihf/lib/libcore-1.rlib",
        );
        project.script("rustc.root/lib/rustlib/host/bin/rust-lld", "exit 1");
        project
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn write(&self, file: &str, text: &str) {
        let path = self.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// Written by another process: one that this process still had open for
    /// writing in a moment when another thread starts a child could not be run.
    fn script(&self, name: &str, script: &str) {
        let path = self.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let written = Command::new("sh")
            .args([
                "-c",
                r#"printf '#!/bin/sh\n%s\n' "$2" >"$1"; chmod 755 "$1""#,
                "sh",
            ])
            .arg(path)
            .arg(script)
            .status();
        assert!(written.unwrap().success());
    }

    /// A compiler that has `file` in its root.
    fn compiler(&self, name: &str, file: &str) {
        let root = self.path().join(format!("{name}.root"));
        self.write(&format!("{name}.root/{file}"), "");
        self.script(
            name,
            &format!(
                "case $2 in sysroot) echo {root};; \
                 target-libdir) echo {root}/lib/rustlib/$4/lib;; esac",
                root = root.display()
            ),
        );
    }

    /// Writes a file and leaves the time that it had: an hour ago.
    fn write_as_old(&self, file: &str, text: &str) {
        self.write_at(file, text, SystemTime::now() - Duration::from_secs(3600));
    }

    fn write_at(&self, file: &str, text: &str, modified: SystemTime) {
        self.write(file, text);
        let file = File::options().append(true).open(self.path().join(file));
        file.unwrap().set_modified(modified).unwrap();
    }

    fn modified(&self, file: &str) -> SystemTime {
        let data = fs::metadata(self.path().join(file));
        data.unwrap().modified().unwrap()
    }

    fn finder(&self) -> Finder {
        Finder {
            ready: None,
            builder: Builder {
                project: self.path().to_path_buf(),
                target_folder: self.path().join("target"),
                cargo: self.path().join("cargo"),
                compilers: vec![self.path().join("no-such"), self.path().join("rustc")],
            },
        }
    }

    /// The image, and what was told on the way.
    fn image(&self, finder: &Finder) -> (Result<PathBuf, ChipError>, Vec<String>) {
        let mut told = Vec::new();
        let image = finder.image(Target::M4, "fifo", &mut |line| {
            told.push(line.to_owned());
        });
        (image, told)
    }

    /// Number of builds for the image to be had once more.
    fn builds(&self) -> usize {
        let (image, told) = self.image(&self.finder());
        assert!(image.unwrap().is_file());
        told.len()
    }

    fn called(&self) -> String {
        fs::read_to_string(self.path().join("firmware/cortex-m/.called")).unwrap()
    }
}

#[test]
fn ready_image_is_taken_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let finder = Finder {
        ready: Some(folder.path().to_path_buf()),
        ..Project::new().finder()
    };
    let mut none = |line: &str| panic!("{line}");
    let missing = finder.image(Target::M0, "uart", &mut none);
    let sentence = missing.unwrap_err().to_string();
    let words = "m0-uart.elf is not there; MCU_IMAGE_DIR";
    assert!(sentence.contains(words), "{sentence}");
    let path = folder.path().join("m0-uart.elf");
    fs::write(&path, "").unwrap();
    assert_eq!(finder.image(Target::M0, "uart", &mut none).unwrap(), path);
    assert!(finder.available(Target::M0, "uart").is_ok());
    assert!(finder.available(Target::M0, "fifo").is_err());
}

#[test]
fn image_is_built_when_it_is_missing_or_stale() {
    let project = Project::new();
    let finder = project.finder();
    assert!(finder.available(Target::M4, "fifo").is_ok());
    let (image, told) = project.image(&finder);
    assert_eq!(
        image.unwrap(),
        project
            .path()
            .join("target/chip/thumbv7em-none-eabihf/release/fifo")
    );
    assert_eq!(told, ["building the image for m4 (thumbv7em-none-eabihf)"]);
    assert_eq!(project.builds(), 0);
    for file in [
        "firmware/src/lib.rs",
        "firmware/link/src/lib.rs",
        "firmware/cortex-m/images/src/lib.rs",
        "Cargo.toml",
        "firmware/src/added.rs",
    ] {
        project.write_as_old(file, "// changed");
        assert_eq!(project.builds(), 1, "{file}");
        assert_eq!(project.builds(), 0, "{file}");
        // Cargo would not see what has no new time.
        let age = project.modified(file).elapsed().unwrap_or_default();
        assert!(age < Duration::from_secs(600), "{file}: {age:?}");
        // The contrast: a new time and nothing else.
        project.write(file, "// changed");
        assert_eq!(project.builds(), 0, "{file}");
    }
    fs::remove_file(project.path().join("firmware/src/added.rs")).unwrap();
    assert_eq!(project.builds(), 1);
    // Nothing that an image is made of.
    project.write("firmware/cortex-m/target/debug/thing", "");
    project.write("firmware/tests/some.rs", "");
    assert_eq!(project.builds(), 0);
    // Another image than the one that was built.
    let image = "target/chip/thumbv7em-none-eabihf/release/fifo";
    project.write_as_old(image, "damaged");
    assert_eq!(project.builds(), 1);
    assert_ne!(fs::read(project.path().join(image)).unwrap(), b"damaged");
    // As after `cargo clean`.
    fs::remove_dir_all(project.path().join("target")).unwrap();
    assert_eq!(project.builds(), 1);
}

/// A build that failed is newer than the record, and may have compiled what was
/// there between the record and what is put back.
#[test]
fn a_source_newer_than_the_record_gets_a_new_time_too() {
    let project = Project::new();
    assert_eq!(project.builds(), 1);
    let record = "target/chip/thumbv7em-none-eabihf/release/images.built";
    let newer = project.modified(record) + Duration::from_millis(1);
    let [changed, as_it_was] = ["firmware/src/lib.rs", "firmware/link/src/lib.rs"];
    project.write_at(changed, "// changed", newer);
    project.write_at(as_it_was, "", newer);
    assert_eq!(project.builds(), 1);
    assert_ne!(project.modified(changed), newer);
    // The contrast: the content of the record.
    assert_eq!(project.modified(as_it_was), newer);
}

#[test]
fn two_builders_at_a_time_do_not_disturb_each_other() {
    let project = Project::new();
    let build = || project.image(&project.finder()).0.unwrap();
    std::thread::scope(|scope| {
        let builders: Vec<_> = (0..4).map(|_| scope.spawn(build)).collect();
        for builder in builders {
            assert!(builder.join().unwrap().is_file());
        }
    });
    let left = fs::read_dir(
        project
            .path()
            .join("target/chip/thumbv7em-none-eabihf/release"),
    );
    // Two images and the contents of the last build.
    assert_eq!(left.unwrap().count(), 3);
}

#[test]
fn compiler_of_the_installer_needs_nothing() {
    let project = Project::new();
    assert_eq!(project.builds(), 1);
    let called = project.called();
    assert!(
        called.contains("build --profile release --locked --package images --target thumbv7em")
    );
    assert!(!called.contains("-Zbuild-std"), "{called}");
    let rustc = project.path().join("rustc");
    // Neither a permission nor a linker.
    let words = format!("{} ", rustc.display());
    assert!(called.starts_with(&words), "{called}");
}

#[test]
fn compiler_of_a_distribution_builds_its_core_and_is_lent_a_linker() {
    let project = Project::new();
    // The first has a linker but nothing for this target.
    project.compiler("rustc", "lib/rustlib/other/lib/libcore-1.rlib");
    fs::remove_dir_all(
        project
            .path()
            .join("rustc.root/lib/rustlib/thumbv7em-none-eabihf"),
    )
    .unwrap();
    project.compiler("debian", "lib/rustlib/src/rust/library/core/src/lib.rs");
    let mut finder = project.finder();
    finder.builder.compilers.push(project.path().join("debian"));
    let (image, _) = project.image(&finder);
    image.unwrap();
    let called = project.called();
    assert!(called.contains("-Zbuild-std=core"), "{called}");
    let mut words = called.split_whitespace();
    let found = words.next().unwrap();
    assert_eq!(found, project.path().join("debian").to_str().unwrap());
    assert_eq!(words.next(), Some("1"));
    assert!(words.next().unwrap().ends_with("/rust-lld"), "{called}");
}

#[test]
fn without_a_compiler_it_says_what_to_install() {
    let project = Project::new();
    let mut finder = project.finder();
    finder.builder.compilers.pop();
    let available = finder.available(Target::M4, "fifo").unwrap_err();
    let (image, _) = project.image(&finder);
    for error in [available, image.unwrap_err()] {
        let sentence = error.to_string();
        let words = "`rustup target add thumbv7em-none-eabihf`";
        assert!(sentence.contains(words), "{sentence}");
        assert!(sentence.contains("rustc-web"), "{sentence}");
    }
}

/// A target that no image has been written for.
#[test]
fn target_without_a_board_is_not_there() {
    let project = Project::new();
    project.compiler(
        "rustc",
        "lib/rustlib/riscv32imac-unknown-none-elf/lib/libcore-1.rlib",
    );
    let finder = project.finder();
    let there = finder.available(Target::Rv32, "fifo");
    let sentence = there.unwrap_err().to_string();
    let words = "there is no image for rv32 and no sources in ";
    assert!(sentence.starts_with(words), "{sentence}");
    assert!(finder.available(Target::M4, "fifo").is_ok());
}

#[test]
fn errors_of_the_compiler_are_shown() {
    let project = Project::new();
    project.script(
        "cargo",
        "echo 'error[E0308]: mismatched types' >&2; exit 101",
    );
    for _ in 0..2 {
        let (image, told) = project.image(&project.finder());
        let sentence = image.unwrap_err().to_string();
        assert_eq!(
            sentence,
            "the image for m4 could not be built; the compiler says:\n\
             error[E0308]: mismatched types"
        );
        // A build that failed is tried again.
        assert_eq!(told.len(), 1);
    }
}

#[test]
fn build_that_makes_no_image_is_told() {
    let project = Project::new();
    project.script("cargo", "exit 0");
    let (image, _) = project.image(&project.finder());
    let sentence = image.unwrap_err().to_string();
    assert!(
        sentence.starts_with("the build has not made "),
        "{sentence}"
    );
}

#[test]
fn without_sources_an_image_is_used_as_it_is() {
    let project = Project::new();
    assert_eq!(project.builds(), 1);
    fs::remove_dir_all(project.path().join("firmware")).unwrap();
    assert_eq!(project.builds(), 0);
    fs::remove_dir_all(project.path().join("target")).unwrap();
    let (image, _) = project.image(&project.finder());
    let sentence = image.unwrap_err().to_string();
    let words = "there is no image for m4 and no sources in ";
    assert!(sentence.starts_with(words), "{sentence}");
}
