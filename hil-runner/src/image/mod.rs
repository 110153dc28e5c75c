//! Programs for other machines than this one: found, and built where they must be.
//!
//! An image is stale when a source or the image itself is not what it was at the last build, by
//! content and whatever its time says; what really has to be compiled then is cargo's to say, and
//! two builders at a time wait for each other by cargo's own lock.

mod recipe;
mod toolchain;

use std::collections::BTreeMap;
use std::env;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

use crc::{CRC_64_XZ, Crc};
use tempfile::NamedTempFile;

pub use recipe::{ImageError, Recipe};
use toolchain::Toolchain;
pub(crate) use toolchain::on_path;

/// Builds images from the project's sources with a toolchain.
#[derive(Debug, Clone)]
pub struct Builder {
    /// The folder of the whole project.
    pub project: PathBuf,
    /// The folder that has a folder for each recipe.
    pub target_folder: PathBuf,
    /// The package manager that builds them.
    pub cargo: PathBuf,
    /// The compilers to try, in this order.
    pub compilers: Vec<PathBuf>,
}

impl Builder {
    /// As the environment says: `MCU_RUSTC`, `CARGO_TARGET_DIR` and `CARGO`.
    pub fn from_environment() -> Self {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let project = here.parent().unwrap_or(here).to_path_buf();
        let target_folder = path_in("CARGO_TARGET_DIR").unwrap_or_else(|| project.join("target"));
        Self {
            // Cargo runs in a folder of its own.
            target_folder: std::path::absolute(&target_folder).unwrap_or(target_folder),
            project,
            cargo: path_in("CARGO").unwrap_or_else(|| "cargo".into()),
            compilers: path_in("MCU_RUSTC")
                .map(named_or_absolute)
                .into_iter()
                .chain(["rustc", "/usr/bin/rustc"].map(PathBuf::from))
                .collect(),
        }
    }

    /// An image by its file, built on the way where it is missing or stale; `tell` gets one line
    /// before that, without its line end.
    ///
    /// # Errors
    /// [`ImageError`] if there is none and it cannot be built.
    pub fn image(
        &self,
        recipe: &Recipe,
        file: &str,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, ImageError> {
        let (path, is_stale) = self.found(recipe, file)?;
        if is_stale {
            tell(&format!("building the {} ({})", recipe.what, recipe.triple));
            self.build(recipe)?;
            if !path.is_file() {
                let path = path.display();
                return Err(ImageError(format!("the build has not made {path}")));
            }
        }
        Ok(path)
    }

    /// Looks for an image, or what could build it.
    ///
    /// # Errors
    /// [`ImageError`] that says what is missing.
    pub fn available(&self, recipe: &Recipe, file: &str) -> Result<(), ImageError> {
        let (_, is_stale) = self.found(recipe, file)?;
        if is_stale {
            Toolchain::find(recipe, &self.compilers, &self.workspace(recipe))?;
        }
        Ok(())
    }

    /// The path of an image, and true if it has to be built first.
    fn found(&self, recipe: &Recipe, file: &str) -> Result<(PathBuf, bool), ImageError> {
        let path = self.built(recipe).join(file);
        let has_sources = self.project.join(&recipe.own_source).is_file();
        if !has_sources && !path.is_file() {
            return Err(ImageError(format!(
                "there is no {} and no sources in {} to build it from; {}",
                recipe.what,
                self.project.display(),
                recipe.elsewhere
            )));
        }
        // A program that is used without its sources is as it is.
        let is_stale = has_sources && self.is_stale(recipe, &path);
        Ok((path, is_stale))
    }

    fn workspace(&self, recipe: &Recipe) -> PathBuf {
        self.project.join(recipe.workspace)
    }

    /// The folder of the built images.
    fn built(&self, recipe: &Recipe) -> PathBuf {
        let folder = self.target_folder.join(recipe.folder);
        folder.join(recipe.triple).join(recipe.profile)
    }

    /// The contents of the last build, as [`Contents`] writes them.
    fn record(&self, recipe: &Recipe) -> PathBuf {
        self.built(recipe).join("images.built")
    }

    /// True if a source or the image is another than that of the last build. What
    /// cannot be read counts as another.
    fn is_stale(&self, recipe: &Recipe, image: &Path) -> bool {
        let last = Contents::read(&self.record(recipe));
        let sources = Contents::of_sources(recipe, &self.project);
        match (last, sources, checksum(image)) {
            (Ok(last), Ok(sources), Ok(sum)) => {
                !last.has(&sources, recipe) || last.0.get(&name_of(image)) != Some(&sum)
            }
            _ => true,
        }
    }

    fn build(&self, recipe: &Recipe) -> Result<(), ImageError> {
        let failed = |output: String| recipe.not_built(&output);
        let workspace = self.workspace(recipe);
        let toolchain = Toolchain::find(recipe, &self.compilers, &workspace)?;
        let target_folder = self.target_folder.join(recipe.folder);
        let folder = self.built(recipe);
        let told = |error: io::Error| failed(format!("{}: {error}", folder.display()));
        fs::create_dir_all(&folder).map_err(told)?;
        // One builder at a time: what another one is about to write is not to be judged. A
        // file system without locks has no other builders to wait for.
        let builder = File::create(folder.with_file_name("images.lock")).map_err(told)?;
        let _ = builder.lock();
        // What changes during the build is not in it.
        let sources = Contents::of_sources(recipe, &self.project).map_err(told)?;
        if let Ok(last) = Contents::read(&self.record(recipe)) {
            // Build scripts lie where those of this machine do.
            let compiled = [&folder, &target_folder.join(recipe.profile)];
            let compiled = compiled
                .into_iter()
                .filter_map(|folder| last_compiled(folder));
            last.show_changes(&sources, &self.project, compiled.max());
            last.remove_others(&sources, recipe, &folder);
        }
        let mut cargo = Command::new(&self.cargo);
        cargo
            .args(["build", "--profile", recipe.profile, "--locked"])
            .args(recipe.packages.iter().flat_map(|name| ["--package", *name]))
            .args(["--target", recipe.triple])
            .arg("--target-dir")
            .arg(&target_folder)
            .arg("--manifest-path")
            .arg(workspace.join("Cargo.toml"))
            // Cargo reads its settings from where it runs.
            .current_dir(&workspace)
            // Meant for the host, and the counts of instructions are those of the
            // flags in the manifest.
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            .env_remove("CARGO_INCREMENTAL")
            .stdin(Stdio::null());
        toolchain.prepare(&mut cargo, &target_folder)?;
        match cargo.output() {
            Err(error) => Err(failed(format!("{}: {error}", self.cargo.display()))),
            Ok(output) if !output.status.success() => {
                Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()))
            }
            Ok(_) => sources
                .with_images(recipe, &folder)
                .and_then(|contents| contents.write(&self.record(recipe)))
                .map_err(told),
        }
    }
}

/// A path of the environment.
pub(crate) fn path_in(variable: &str) -> Option<PathBuf> {
    let value = env::var_os(variable)?;
    (!value.is_empty()).then(|| value.into())
}

/// A program by name as it is; by path from here, as it will run elsewhere.
fn named_or_absolute(program: PathBuf) -> PathBuf {
    if program.components().nth(1).is_none() {
        return program;
    }
    std::path::absolute(&program).unwrap_or(program)
}

/// The last time at which cargo has compiled something in a folder of its.
fn last_compiled(folder: &Path) -> Option<SystemTime> {
    let packages = fs::read_dir(folder.join(".fingerprint")).ok()?;
    let invoked = |package: io::Result<fs::DirEntry>| {
        let stamp = package.ok()?.path().join("invoked.timestamp");
        fs::metadata(stamp).ok()?.modified().ok()
    };
    packages.filter_map(invoked).max()
}

/// Checksums of files: of sources by their path from the project's folder, of
/// images by their name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Contents(BTreeMap<String, u64>);

impl Contents {
    fn of_sources(recipe: &Recipe, project: &Path) -> io::Result<Self> {
        let mut contents = Self::default();
        for source in recipe.sources {
            contents.add(project, Path::new(source))?;
        }
        Ok(contents)
    }

    fn add(&mut self, project: &Path, path: &Path) -> io::Result<()> {
        let here = project.join(path);
        if !here.is_dir() {
            let name = path.to_string_lossy().into_owned();
            self.0.insert(name, checksum(&here)?);
            return Ok(());
        }
        for entry in fs::read_dir(here)? {
            let name = entry?.file_name();
            // Built files, and an editor's or a file manager's own.
            if name != "target" && !name.as_encoded_bytes().starts_with(b".") {
                self.add(project, &path.join(name))?;
            }
        }
        Ok(())
    }

    /// With the images in `folder` that are there.
    fn with_images(mut self, recipe: &Recipe, folder: &Path) -> io::Result<Self> {
        for image in recipe.images.iter().map(|name| folder.join(name)) {
            if image.is_file() {
                self.0.insert(name_of(&image), checksum(&image)?);
            }
        }
        Ok(self)
    }

    /// Tells whether these are the sources of this build: all of them, and no other.
    fn has(&self, sources: &Self, recipe: &Recipe) -> bool {
        let own = self.0.iter();
        own.filter(|(name, _)| !recipe.images.contains(&name.as_str()))
            .eq(sources.0.iter())
    }

    /// Shows cargo, which goes by times, what has changed. A source that has gets a new time,
    /// unless its own is newer than anything that was compiled: of a build that failed, of another
    /// target's or of a script's in this folder the record knows nothing, and what they compiled
    /// may be newer than the source. A file that cannot be changed is cargo's to judge.
    fn show_changes(&self, sources: &Self, project: &Path, compiled: Option<SystemTime>) {
        for (name, sum) in &sources.0 {
            if self.0.get(name) == Some(sum) {
                continue;
            }
            let Ok(source) = File::options().append(true).open(project.join(name)) else {
                continue;
            };
            let modified = source.metadata().and_then(|data| data.modified());
            if modified
                .ok()
                .is_none_or(|modified| compiled.is_none_or(|at| modified <= at))
            {
                let _ = source.set_modified(SystemTime::now());
            }
        }
    }

    /// Removes images that are not what was built. Of other sources, they are what another
    /// builder has just made of them.
    fn remove_others(&self, sources: &Self, recipe: &Recipe, folder: &Path) {
        if !self.has(sources, recipe) {
            return;
        }
        for image in recipe.images.iter().map(|name| folder.join(name)) {
            if checksum(&image).ok().as_ref() != self.0.get(&name_of(&image)) {
                let _ = fs::remove_file(image);
            }
        }
    }

    /// One file a line: the checksum in 16 hexadecimal digits, its name.
    fn write(&self, path: &Path) -> io::Result<()> {
        let line = |(name, sum): (&String, &u64)| format!("{sum:016x} {name}\n");
        let folder = path.parent().unwrap_or(path);
        // In one piece: two builders write the same.
        let file = NamedTempFile::new_in(folder)?;
        fs::write(file.path(), self.0.iter().map(line).collect::<String>())?;
        file.persist(path)?;
        Ok(())
    }

    fn read(path: &Path) -> io::Result<Self> {
        let line = |line: &str| {
            let (sum, name) = line.split_once(' ')?;
            Some((name.to_owned(), u64::from_str_radix(sum, 16).ok()?))
        };
        let text = fs::read_to_string(path)?;
        let contents = text.lines().map(line).collect::<Option<_>>();
        contents
            .map(Self)
            .ok_or_else(|| io::ErrorKind::InvalidData.into())
    }
}

/// CRC-64/XZ of a file.
fn checksum(path: &Path) -> io::Result<u64> {
    Ok(Crc::<u64>::new(&CRC_64_XZ).checksum(&fs::read(path)?))
}

/// The last part of a path.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}
