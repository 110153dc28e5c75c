//! Images of the targets: found, built where they must be, and read.
//!
//! An image is taken from the folder that `MCU_IMAGE_DIR` names, or built from
//! the firmware's sources with a toolchain. It is stale when a source or the image
//! itself is not what it was at the last build, by content and whatever its time
//! says; what really has to be compiled then is cargo's to say, and two builders
//! at a time wait for each other by cargo's own lock.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

use crc::{CRC_64_XZ, Crc};
use firmware_link::frame::crc32_on;
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use tempfile::NamedTempFile;

use super::line::ChipError;
use super::spec::Target;

/// The origin of images.
#[derive(Debug, Clone)]
pub struct Finder {
    /// The folder with ready images, `<target>-<fifo|uart|cost>.elf`; nothing is
    /// built where there is one.
    pub ready: Option<PathBuf>,
    /// The folder of the whole project.
    pub project: PathBuf,
    /// The folder in which images are built.
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

    /// The image of a target by its name, built on the way where it is missing or
    /// stale; `tell` gets one line before that, without its line end.
    ///
    /// # Errors
    /// [`ChipError`] if there is none and it cannot be built.
    pub fn image(
        &self,
        target: Target,
        image: &str,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, ChipError> {
        let (path, is_stale) = self.found(target, image)?;
        if is_stale {
            let (name, triple) = (target.name(), target.triple());
            tell(&format!("building the images for {name} ({triple})"));
            self.build(target)?;
            if !path.is_file() {
                return Err(not_an_image(&path, "the build has not made it"));
            }
        }
        Ok(path)
    }

    /// Looks for an image of a target, or what could build it.
    ///
    /// # Errors
    /// [`ChipError`] that says what is missing.
    pub fn available(&self, target: Target, image: &str) -> Result<(), ChipError> {
        let (_, is_stale) = self.found(target, image)?;
        if !is_stale {
            return Ok(());
        }
        // The map of memory is the image's own of a target; not every one has an image.
        let memory = format!("images/memory/{}.x", target.name());
        if !self.workspace().join(memory).is_file() {
            return Err(self.no_sources(target));
        }
        Toolchain::find(target, &self.compilers, &self.workspace()).map(drop)
    }

    /// The path of an image, and true if it has to be built first.
    fn found(&self, target: Target, image: &str) -> Result<(PathBuf, bool), ChipError> {
        if let Some(folder) = &self.ready {
            let path = folder.join(format!("{}-{image}.elf", target.name()));
            if path.is_file() {
                return Ok((path, false));
            }
            return Err(ChipError(format!(
                "{} is not there; MCU_IMAGE_DIR must name a folder that has it, or be unset",
                path.display()
            )));
        }
        let path = self.built(target).join(image);
        match (self.workspace().is_dir(), path.is_file()) {
            (false, false) => Err(self.no_sources(target)),
            // A program that is used without its sources.
            (false, true) => Ok((path, false)),
            (true, false) => Ok((path, true)),
            (true, true) => {
                let is_stale = self.is_stale(target, &path);
                Ok((path, is_stale))
            }
        }
    }

    /// There is no image and nothing to build it from.
    fn no_sources(&self, target: Target) -> ChipError {
        ChipError(format!(
            "there is no image for {} and no firmware in {} to build it from; MCU_IMAGE_DIR may \
             name a folder with ready images",
            target.name(),
            self.workspace().display()
        ))
    }

    /// The firmware's workspace for chips.
    fn workspace(&self) -> PathBuf {
        self.project.join("firmware").join("cortex-m")
    }

    /// The folder of a target's built images.
    fn built(&self, target: Target) -> PathBuf {
        self.target_folder.join(target.triple()).join("release")
    }

    /// The contents of the last build, as [`Contents`] writes them.
    fn record(&self, target: Target) -> PathBuf {
        self.built(target).join("images.built")
    }

    /// True if a source or the image is another than that of the last build. What
    /// cannot be read counts as another.
    fn is_stale(&self, target: Target, image: &Path) -> bool {
        let last = Contents::read(&self.record(target));
        let sources = Contents::of_sources(&self.project);
        match (last, sources, checksum(image)) {
            (Ok(last), Ok(sources), Ok(sum)) => {
                !last.has(&sources) || last.0.get(&name_of(image)) != Some(&sum)
            }
            _ => true,
        }
    }

    fn build(&self, target: Target) -> Result<(), ChipError> {
        let failed = |output: String| not_built(target, &output);
        let workspace = self.workspace();
        let toolchain = Toolchain::find(target, &self.compilers, &workspace)?;
        let folder = self.built(target);
        let told = |error: io::Error| failed(format!("{}: {error}", folder.display()));
        fs::create_dir_all(&folder).map_err(told)?;
        // One builder at a time: what another one is about to write is not to be judged. A
        // file system without locks has no other builders to wait for.
        let builder = File::create(folder.with_file_name("images.lock")).map_err(told)?;
        let _ = builder.lock();
        // What changes during the build is not in it.
        let sources = Contents::of_sources(&self.project).map_err(told)?;
        if let Ok(last) = Contents::read(&self.record(target)) {
            last.show_changes(&sources, &self.project, &folder);
        }
        let mut cargo = Command::new(&self.cargo);
        cargo
            .args(["build", "--release", "--locked", "--package", "images"])
            .args(["--target", target.triple(), "--target-dir"])
            .arg(&self.target_folder)
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
        toolchain.prepare(&mut cargo, &self.target_folder)?;
        match cargo.output() {
            Err(error) => Err(failed(format!("{}: {error}", self.cargo.display()))),
            Ok(output) if !output.status.success() => {
                Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()))
            }
            Ok(_) => sources
                .with_images(&folder)
                .and_then(|contents| contents.write(&self.record(target)))
                .map_err(told),
        }
    }
}

fn not_built(target: Target, output: &str) -> ChipError {
    ChipError(format!(
        "the image for {} could not be built; the compiler says:\n{}",
        target.name(),
        output.trim_end()
    ))
}

fn not_an_image(path: &Path, because: &str) -> ChipError {
    ChipError(format!(
        "{} is no image for a chip: {because}",
        path.display()
    ))
}

/// A program by name as it is; by path from here, as it will run elsewhere.
fn named_or_absolute(program: PathBuf) -> PathBuf {
    if program.components().nth(1).is_none() {
        return program;
    }
    std::path::absolute(&program).unwrap_or(program)
}

/// Sources of an image, from the project's folder: the firmware takes its
/// edition and the versions of its dependencies from the project's manifest.
const SOURCES: [&str; 6] = [
    "Cargo.toml",
    "firmware/Cargo.toml",
    "firmware/src",
    "firmware/link/Cargo.toml",
    "firmware/link/src",
    "firmware/cortex-m",
];

/// Names of the images.
const IMAGES: [&str; 3] = ["fifo", "uart", "cost"];

/// Checksums of files: of sources by their path from the project's folder, of
/// images by their name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Contents(BTreeMap<String, u64>);

impl Contents {
    fn of_sources(project: &Path) -> io::Result<Self> {
        let mut contents = Self::default();
        for source in SOURCES {
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
    fn with_images(mut self, folder: &Path) -> io::Result<Self> {
        for image in IMAGES.map(|name| folder.join(name)) {
            if image.is_file() {
                self.0.insert(name_of(&image), checksum(&image)?);
            }
        }
        Ok(self)
    }

    /// Tells whether these are the sources of this build: all of them, and no other.
    fn has(&self, sources: &Self) -> bool {
        let own = self.0.iter();
        own.filter(|(name, _)| !IMAGES.contains(&name.as_str()))
            .eq(sources.0.iter())
    }

    /// Shows cargo, which goes by times, what has changed. A source that has gets a
    /// new time, also where its own is newer than the record: of a build that failed,
    /// of another target's or of a script's in this folder the record knows nothing,
    /// and what they compiled may be newer still. An image that is not what was built
    /// goes. A file that cannot be changed is cargo's to judge.
    fn show_changes(&self, sources: &Self, project: &Path, folder: &Path) {
        for (name, sum) in &sources.0 {
            if self.0.get(name) != Some(sum)
                && let Ok(source) = File::options().append(true).open(project.join(name))
            {
                let _ = source.set_modified(SystemTime::now());
            }
        }
        // Of other sources, it is what another builder has just made of them.
        if !self.has(sources) {
            return;
        }
        for image in IMAGES.map(|name| folder.join(name)) {
            if checksum(&image).ok().as_ref() != self.0.get(&name_of(&image)) {
                let _ = fs::remove_file(image);
            }
        }
    }

    /// One file a line: the checksum in 16 hexadecimal digits, its name.
    fn write(&self, path: &Path) -> io::Result<()> {
        let lines = self
            .0
            .iter()
            .map(|(name, sum)| format!("{sum:016x} {name}\n"));
        let folder = path.parent().unwrap_or(path);
        // In one piece: two builders write the same.
        let file = NamedTempFile::new_in(folder)?;
        fs::write(file.path(), lines.collect::<String>())?;
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

/// More than the flash of any chip here; a larger gap between two segments is a
/// mistake of the linker script.
const LARGEST_FLASH: usize = 4 << 20;

/// CRC-32 (ISO-HDLC) over the flash of the image in `path`, as the chip itself
/// computes it over its memory: from the first loadable byte to the last one,
/// the initial values of variables included, by load address. A gap is of zeros,
/// as `objcopy -O binary` writes it and QEMU leaves it.
///
/// # Errors
/// [`ChipError`] if the file cannot be read, or is no 32-bit little-endian ELF
/// file with something to load.
pub fn crc32(path: &Path) -> Result<u32, ChipError> {
    let not = |because: String| not_an_image(path, &because);
    let file = fs::read(path).map_err(|error| not(error.to_string()))?;
    let flash = flash(&file).map_err(not)?;
    Ok(crc32_on(0, &flash))
}

/// The bytes of the flash, from the lowest load address on.
fn flash(file: &[u8]) -> Result<Vec<u8>, String> {
    let wrong = |error: object::read::Error| error.to_string();
    let header = FileHeader32::<LittleEndian>::parse(file).map_err(wrong)?;
    let endian = header.endian().map_err(wrong)?;
    let mut loaded = Vec::new();
    for segment in header.program_headers(endian, file).map_err(wrong)? {
        if segment.p_type(endian) == PT_LOAD && segment.p_filesz(endian) > 0 {
            let bytes = segment
                .data(endian, file)
                .map_err(|()| "a segment lies beyond the end of the file")?;
            loaded.push((segment.p_paddr(endian), bytes));
        }
    }
    loaded.sort_by_key(|&(address, _)| address);
    let &(base, _) = loaded.first().ok_or("it has nothing to load")?;
    let mut flash = Vec::new();
    for (address, bytes) in loaded {
        let at = usize::try_from(address - base).map_err(|error| error.to_string())?;
        if at < flash.len() {
            return Err(format!("two segments are loaded to {address:#010x}"));
        }
        if at.saturating_add(bytes.len()) > LARGEST_FLASH {
            return Err(format!("it is larger than {LARGEST_FLASH} bytes"));
        }
        flash.resize(at, 0);
        flash.extend_from_slice(bytes);
    }
    Ok(flash)
}

/// The name by which the compiler calls its linker.
const LINKER: &str = "rust-lld";

/// A compiler that can build for a target, and a linker where it has none of its
/// own. Rust's own installer has the core library of a target ready; a
/// distribution's compiler has its sources, and builds it on the way.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Toolchain {
    rustc: PathBuf,
    /// True if the core library has to be built too.
    build_core: bool,
    /// The linker, where the compiler would not find it by itself.
    linker: Option<PathBuf>,
    target: Target,
}

impl Toolchain {
    /// The first of `compilers` that can build for `target`, asked in `folder`,
    /// whose settings may choose the toolchain.
    ///
    /// # Errors
    /// [`ChipError`] if there is none, or no linker.
    fn find(target: Target, compilers: &[PathBuf], folder: &Path) -> Result<Self, ChipError> {
        let triple = target.triple();
        let (rustc, build_core) = compilers
            .iter()
            .find_map(|rustc| Some((rustc, needs_core(rustc, target, folder)?)))
            .ok_or_else(|| {
                ChipError(format!(
                    "no compiler here builds for {triple}; install its core with `rustup target \
                     add {triple}`, or Debian's compiler and the core's sources with \
                     `apt-get install --no-install-recommends rustc-web cargo-web rust-web-src lld`"
                ))
            })?;
        let own = |rustc: &PathBuf| bundled_linker(&ask(rustc, &["--print", "sysroot"], folder)?);
        let linker = if own(rustc).is_some() || on_path(LINKER).is_some() {
            None
        } else {
            let other = compilers.iter().find_map(own);
            let linker = other
                .or_else(|| on_path("ld.lld"))
                .or_else(|| on_path("lld"));
            Some(linker.ok_or_else(|| {
                ChipError(format!(
                    "no linker here links for {triple}; install one, for example with \
                     `apt-get install --no-install-recommends lld`"
                ))
            })?)
        };
        Ok(Self {
            rustc: rustc.clone(),
            build_core,
            linker,
            target,
        })
    }

    /// Makes `cargo` build with this toolchain. A linker that the compiler does
    /// not find by itself is linked into `folder`, under the name it looks for.
    ///
    /// # Errors
    /// [`ChipError`] if the link cannot be made.
    fn prepare(&self, cargo: &mut Command, folder: &Path) -> Result<(), ChipError> {
        cargo.env("RUSTC", &self.rustc);
        if self.build_core {
            // Both are of the development version only, unless it is asked for
            // so.
            cargo.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
        }
        if let Some(linker) = &self.linker {
            let failed = |error: io::Error| {
                let output = format!("{LINKER} in {}: {error}", folder.display());
                not_built(self.target, &output)
            };
            let folder = folder.join("linker");
            fs::create_dir_all(&folder).map_err(failed)?;
            link(linker, &folder.join(LINKER)).map_err(failed)?;
            cargo.env("PATH", before_path(folder).map_err(failed)?);
        }
        Ok(())
    }
}

/// True if `rustc` has to build the core library of `target` itself; `None` if
/// it cannot, or is not there.
fn needs_core(rustc: &Path, target: Target, folder: &Path) -> Option<bool> {
    let ready = ask(
        rustc,
        &["--print", "target-libdir", "--target", target.triple()],
        folder,
    )?;
    let is_core = |entry: io::Result<fs::DirEntry>| {
        let name = entry.map(|entry| entry.file_name()).unwrap_or_default();
        let name = name.to_string_lossy();
        name.starts_with("libcore-") && name.ends_with(".rlib")
    };
    if fs::read_dir(ready).is_ok_and(|mut files| files.any(is_core)) {
        return Some(false);
    }
    let sysroot = ask(rustc, &["--print", "sysroot"], folder)?;
    let sources = sysroot.join("lib/rustlib/src/rust/library/core");
    sources.is_dir().then_some(true)
}

/// The path that `rustc` prints.
fn ask(rustc: &Path, arguments: &[&str], folder: &Path) -> Option<PathBuf> {
    let output = Command::new(rustc)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .ok()
        .filter(|output| output.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?;
    Some(PathBuf::from(text.trim_end()))
}

/// The linker that comes with a compiler, one folder for each host.
fn bundled_linker(sysroot: &Path) -> Option<PathBuf> {
    fs::read_dir(sysroot.join("lib/rustlib"))
        .ok()?
        .filter_map(|host| Some(host.ok()?.path().join("bin").join(LINKER)))
        .find(|linker| linker.is_file())
}

/// The path of a program on the search path.
pub(super) fn on_path(program: &str) -> Option<PathBuf> {
    let paths = env::var_os("PATH")?;
    env::split_paths(&paths)
        .map(|folder| folder.join(program))
        .find(|path| path.is_file())
}

/// The search path with `folder` in front.
fn before_path(folder: PathBuf) -> io::Result<OsString> {
    let paths = env::var_os("PATH").unwrap_or_default();
    env::join_paths([folder].into_iter().chain(env::split_paths(&paths))).map_err(io::Error::other)
}

#[cfg(unix)]
fn link(linker: &Path, name: &Path) -> io::Result<()> {
    use std::os::unix::fs::symlink;

    match symlink(linker, name) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            if fs::read_link(name)? == linker {
                return Ok(());
            }
            // The one that was there the last time.
            fs::remove_file(name)?;
            symlink(linker, name)
        }
        result => result,
    }
}

#[cfg(not(unix))]
fn link(linker: &Path, name: &Path) -> io::Result<()> {
    fs::copy(linker, name).map(drop)
}

#[cfg(test)]
mod tests {
    use super::flash;

    /// An ELF file with segments of (load address, bytes), each for elsewhere
    /// in RAM, where it is 8 bytes larger.
    fn elf(segments: &[(u32, &[u8])]) -> Vec<u8> {
        const HEADER: u32 = 52;
        const SEGMENT: u32 = 32;
        let count = u16::try_from(segments.len()).unwrap();
        let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        for half in [2_u16, 40] {
            file.extend(half.to_le_bytes());
        }
        for word in [1_u32, 0, HEADER, 0, 0] {
            file.extend(word.to_le_bytes());
        }
        for half in [52_u16, 32, count, 40, 0, 0] {
            file.extend(half.to_le_bytes());
        }
        let mut at = HEADER + SEGMENT * u32::from(count);
        for (address, bytes) in segments {
            let size = u32::try_from(bytes.len()).unwrap();
            let virtual_address = address + 0x2000_0000;
            for word in [1, at, virtual_address, *address, size, size + 8, 6, 4] {
                file.extend(u32::to_le_bytes(word));
            }
            at += size;
        }
        for (_, bytes) in segments {
            file.extend_from_slice(bytes);
        }
        file
    }

    #[test]
    fn segments_lie_by_load_address_with_zeros_between() {
        let file = elf(&[(0x108, b"data"), (0x100, b"text"), (0x200, b"")]);
        assert_eq!(flash(&file).unwrap(), b"text\0\0\0\0data");
    }

    #[test]
    fn what_is_no_image_is_refused() {
        assert_eq!(flash(&elf(&[])).unwrap_err(), "it has nothing to load");
        let over = flash(&elf(&[(0, b"text"), (3, b"data")])).unwrap_err();
        assert_eq!(over, "two segments are loaded to 0x00000003");
        let apart = flash(&elf(&[(0, b"text"), (0x2000_0000, b"data")])).unwrap_err();
        assert_eq!(apart, "it is larger than 4194304 bytes");
        let mut short = elf(&[(0, b"text")]);
        short.pop();
        assert_eq!(
            flash(&short).unwrap_err(),
            "a segment lies beyond the end of the file"
        );
        for bytes in [&b""[..], b"#!/bin/sh\n", &[0x7f; 60]] {
            assert!(flash(bytes).is_err());
        }
    }
}
