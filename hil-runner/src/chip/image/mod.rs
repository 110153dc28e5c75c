//! Images of the targets: found, built where they must be, and read.
//!
//! An image is taken from the folder that `MCU_IMAGE_DIR` names, or built from
//! the firmware's sources with [`compiler`]. It is stale when a source file is
//! newer than the last build; what really has to be compiled then is cargo's to
//! say, and two builders at a time wait for each other by cargo's own lock.

pub mod compiler;

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

use firmware_link::frame::crc32_on;
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use tempfile::NamedTempFile;

use super::line::ChipError;
use super::spec::{Program, Target};
use compiler::Toolchain;

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
        if !image.is_file() || newer_than(&stamp, &self.project) {
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

    /// Looks for an image of a target, or what could build it.
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
        let stale = || newer_than(&self.stamp(target), &self.project);
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

    /// The source that a target's image has of its own; not every one has an image.
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

/// True if any source in `project` is as new as `stamp` or newer. A stamp or a
/// source that cannot be read counts as changed.
fn newer_than(stamp: &Path, project: &Path) -> bool {
    let Ok(built) = fs::metadata(stamp).and_then(|stamp| stamp.modified()) else {
        return true;
    };
    SOURCES
        .iter()
        .any(|source| changed_since(built, &project.join(source)).unwrap_or(true))
}

/// A folder's own time tells of files that were added or removed.
fn changed_since(built: SystemTime, path: &Path) -> io::Result<bool> {
    let metadata = fs::metadata(path)?;
    // Equal times may hide a change: file systems count in milliseconds.
    if metadata.modified()? >= built {
        return Ok(true);
    }
    if !metadata.is_dir() {
        return Ok(false);
    }
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        let name = entry.file_name();
        // Built files, and an editor's or a file manager's own.
        if name == "target" || name.as_encoded_bytes().starts_with(b".") {
            continue;
        }
        if changed_since(built, &entry.path())? {
            return Ok(true);
        }
    }
    Ok(false)
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
/// [`ChipError::NotAnImage`] if the file cannot be read, or is no 32-bit
/// little-endian ELF file with something to load.
pub fn crc32(path: &Path) -> Result<u32, ChipError> {
    let not = |because: String| ChipError::NotAnImage {
        path: path.to_path_buf(),
        because,
    };
    let file = std::fs::read(path).map_err(|error| not(error.to_string()))?;
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
