//! Where the image of a target is, and building it where it must be.
//!
//! An image is taken from the folder that `MCU_IMAGE_DIR` names, or built from
//! the firmware's sources with [`compiler`]. It is stale when a source file is
//! newer than the last build; what really has to be compiled then is cargo's to
//! say, and two builders at a time wait for each other by cargo's own lock.

pub mod compiler;
pub mod contents;
mod sources;

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::NamedTempFile;

use super::error::ChipError;
use super::spec::{Program, Target};
use compiler::Toolchain;

pub use contents::crc32;

/// Where images come from.
#[derive(Debug, Clone)]
pub struct Finder {
    /// The folder with ready images, `<target>-<fifo|uart|cost>.elf`; nothing is
    /// built where there is one.
    pub ready: Option<PathBuf>,
    /// The folder of the whole project.
    pub project: PathBuf,
    /// Where images are built.
    pub target_folder: PathBuf,
    /// The package manager that builds them.
    pub cargo: PathBuf,
    /// The compilers to try, in this order.
    pub compilers: Vec<PathBuf>,
}

impl Finder {
    /// As the environment says: `MCU_IMAGE_DIR`, `MCU_RUSTC`,
    /// `CARGO_TARGET_DIR` and `CARGO`.
    pub fn from_environment() -> Self {
        let path = |name: &str| {
            env::var_os(name)
                .filter(|value| !value.is_empty())
                .map(PathBuf::from)
        };
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let project = here.parent().unwrap_or(here).to_path_buf();
        let target_folder = path("CARGO_TARGET_DIR").unwrap_or_else(|| project.join("target"));
        Self {
            ready: path("MCU_IMAGE_DIR"),
            // Cargo runs in a folder of its own.
            target_folder: std::path::absolute(&target_folder)
                .unwrap_or(target_folder)
                .join("chip"),
            project,
            cargo: path("CARGO").unwrap_or_else(|| "cargo".into()),
            compilers: path("MCU_RUSTC")
                .map(named_or_absolute)
                .into_iter()
                .chain(["rustc", "/usr/bin/rustc"].map(PathBuf::from))
                .collect(),
        }
    }

    /// The image of a target, built on the way where it is missing or stale;
    /// `tell` gets one line before that, without its line end.
    ///
    /// # Errors
    /// [`ChipError`] if there is none and it cannot be built.
    pub fn image(
        &self,
        target: Target,
        program: impl Into<Program>,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, ChipError> {
        let program = program.into();
        if let Some(folder) = &self.ready {
            return ready(folder, target, program);
        }
        let image = self.built(target).join(program.name());
        let workspace = self.workspace();
        if !workspace.is_dir() {
            // A program that is used without its sources.
            if image.is_file() {
                return Ok(image);
            }
            return Err(ChipError::NoSources {
                target,
                folder: workspace,
            });
        }
        let stamp = self.stamp(target);
        if !image.is_file() || sources::newer_than(&stamp, &self.project) {
            tell(&format!(
                "building the images for {} ({})",
                target.name(),
                target.triple()
            ));
            self.build(target, &stamp)?;
        }
        if image.is_file() {
            return Ok(image);
        }
        Err(ChipError::NotAnImage {
            path: image,
            because: "the build has not made it".to_owned(),
        })
    }

    /// Whether there is an image of a target, or what could build it.
    ///
    /// # Errors
    /// [`ChipError`] that says what is missing.
    pub fn available(&self, target: Target, program: impl Into<Program>) -> Result<(), ChipError> {
        let program = program.into();
        if let Some(folder) = &self.ready {
            return ready(folder, target, program).map(drop);
        }
        let workspace = self.workspace();
        let image = self.built(target).join(program.name());
        let stale = || sources::newer_than(&self.stamp(target), &self.project);
        match (workspace.is_dir(), image.is_file()) {
            (false, true) => Ok(()),
            (false, false) => Err(ChipError::NoSources {
                target,
                folder: workspace,
            }),
            (true, true) if !stale() => Ok(()),
            (true, _) if !self.board(target).is_file() => Err(ChipError::NoSources {
                target,
                folder: workspace,
            }),
            (true, _) => Toolchain::find(target, &self.compilers, &workspace).map(drop),
        }
    }

    /// The firmware's workspace for chips.
    fn workspace(&self) -> PathBuf {
        self.project.join("firmware").join("cortex-m")
    }

    /// What a target's image has of its own; not every one has an image.
    fn board(&self, target: Target) -> PathBuf {
        let board = format!("images/src/board/{}.rs", target.name());
        self.workspace().join(board)
    }

    /// The folder of a target's built images.
    fn built(&self, target: Target) -> PathBuf {
        self.target_folder.join(target.triple()).join("release")
    }

    /// A file as old as the last build.
    fn stamp(&self, target: Target) -> PathBuf {
        self.built(target).join("images.built")
    }

    fn build(&self, target: Target, stamp: &Path) -> Result<(), ChipError> {
        let failed = |output: String| ChipError::Build { target, output };
        let workspace = self.workspace();
        let toolchain = Toolchain::find(target, &self.compilers, &workspace)?;
        // Its time is that before the build: what changes during it is newer.
        let folder = self.built(target);
        let begun = fs::create_dir_all(&folder)
            .and_then(|()| NamedTempFile::new_in(&folder))
            .map_err(|error| failed(format!("{}: {error}", folder.display())))?;
        let mut cargo = Command::new(&self.cargo);
        cargo
            .args(["build", "--release", "--locked", "--package", "images"])
            .args(["--target", target.triple(), "--target-dir"])
            .arg(&self.target_folder)
            .arg("--manifest-path")
            .arg(workspace.join("Cargo.toml"))
            // Cargo reads its settings from where it runs.
            .current_dir(&workspace)
            // Meant for the host's processor, and the counts of instructions
            // are those of the flags in the manifest.
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            .stdin(Stdio::null());
        toolchain.prepare(&mut cargo, &self.target_folder)?;
        match cargo.output() {
            Err(error) => Err(failed(format!("{}: {error}", self.cargo.display()))),
            Ok(output) if !output.status.success() => {
                Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()))
            }
            Ok(_) => match begun.persist(stamp) {
                Ok(_) => Ok(()),
                Err(error) => Err(failed(format!("{}: {error}", stamp.display()))),
            },
        }
    }
}

/// A program by name as it is; by path from here, as it will run elsewhere.
fn named_or_absolute(program: PathBuf) -> PathBuf {
    if program.components().nth(1).is_none() {
        return program;
    }
    std::path::absolute(&program).unwrap_or(program)
}

fn ready(folder: &Path, target: Target, program: Program) -> Result<PathBuf, ChipError> {
    let path = folder.join(format!("{}-{}.elf", target.name(), program.name()));
    if path.is_file() {
        return Ok(path);
    }
    Err(ChipError::NoReadyImage { path })
}
