//! The compiler that can build for a target.
//!
//! Rust's own installer has the core library of a target ready; a
//! distribution's compiler has its sources, and builds it on the way.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::chip::line::ChipError;
use crate::chip::spec::Target;

/// The name by which the compiler calls its linker.
const LINKER: &str = "rust-lld";

/// A compiler, and a linker where it has none of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Toolchain {
    /// The compiler.
    pub rustc: PathBuf,
    /// True if the core library has to be built too.
    pub build_core: bool,
    /// The linker, where the compiler would not find it by itself.
    pub linker: Option<PathBuf>,
    target: Target,
}

impl Toolchain {
    /// The first of `compilers` that can build for `target`, asked in `folder`,
    /// whose settings may choose the toolchain.
    ///
    /// # Errors
    /// [`ChipError::NoCompiler`], [`ChipError::NoLinker`].
    pub fn find(target: Target, compilers: &[PathBuf], folder: &Path) -> Result<Self, ChipError> {
        let (rustc, build_core) = compilers
            .iter()
            .find_map(|rustc| Some((rustc, needs_core(rustc, target, folder)?)))
            .ok_or(ChipError::NoCompiler { target })?;
        let own = |rustc: &PathBuf| bundled_linker(&ask(rustc, &["--print", "sysroot"], folder)?);
        let linker = if own(rustc).is_some() || on_path(LINKER).is_some() {
            None
        } else {
            let other = compilers.iter().find_map(own);
            let linker = other
                .or_else(|| on_path("ld.lld"))
                .or_else(|| on_path("lld"));
            Some(linker.ok_or(ChipError::NoLinker { target })?)
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
    /// [`ChipError::Build`] if the link cannot be made.
    pub fn prepare(&self, cargo: &mut Command, folder: &Path) -> Result<(), ChipError> {
        cargo.env("RUSTC", &self.rustc);
        if self.build_core {
            // Both are of the development version only, unless it is asked for
            // so.
            cargo.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
        }
        if let Some(linker) = &self.linker {
            let failed = |error: io::Error| ChipError::Build {
                target: self.target,
                output: format!("{LINKER} in {}: {error}", folder.display()),
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

fn on_path(program: &str) -> Option<PathBuf> {
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
