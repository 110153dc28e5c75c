//! A compiler that can build for another machine, and its linker.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::recipe::{ImageError, Recipe};

/// The name by which the compiler calls its linker.
const LINKER: &str = "rust-lld";

/// A compiler that can build images, and a linker where it has none of its own. Rust's own
/// installer has the library of a target ready; a distribution's compiler has its sources, and
/// builds it on the way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Toolchain<'r> {
    rustc: PathBuf,
    /// True if the library has to be built too.
    build_library: bool,
    /// The linker, where the compiler would not find it by itself.
    linker: Option<PathBuf>,
    recipe: &'r Recipe,
}

impl<'r> Toolchain<'r> {
    /// The first of `compilers` that can build by a recipe, asked in `folder`,
    /// whose settings may choose the toolchain.
    ///
    /// # Errors
    /// [`ImageError`] if there is none, or no linker.
    pub(super) fn find(
        recipe: &'r Recipe,
        compilers: &[PathBuf],
        folder: &Path,
    ) -> Result<Self, ImageError> {
        let (triple, library) = (recipe.triple, recipe.library);
        let (rustc, build_library) = compilers
            .iter()
            .find_map(|rustc| Some((rustc, needs_library(rustc, recipe, folder)?)))
            .ok_or_else(|| {
                ImageError(format!(
                    "no compiler here builds for {triple}; install its {library} with `rustup target \
                     add {triple}`, or Debian's compiler and the library's sources with \
                     `apt-get install --no-install-recommends rustc-web cargo-web rust-web-src lld`"
                ))
            })?;
        let own = |rustc: &PathBuf| bundled_linker(&ask(rustc, &["--print", "sysroot"], folder)?);
        let linker = if own(rustc).is_some() || on_path(LINKER).is_some() {
            None
        } else {
            let other = compilers.iter().find_map(own);
            let linker = other.or_else(|| ["ld.lld", "lld"].into_iter().find_map(on_path));
            Some(linker.ok_or_else(|| {
                ImageError(format!(
                    "no linker here links for {triple}; install one, for example with \
                     `apt-get install --no-install-recommends lld`"
                ))
            })?)
        };
        Ok(Self {
            rustc: rustc.clone(),
            build_library,
            linker,
            recipe,
        })
    }

    /// Makes `cargo` build with this toolchain. A linker that the compiler does
    /// not find by itself is linked into `folder`, under the name it looks for.
    ///
    /// # Errors
    /// [`ImageError`] if the link cannot be made.
    pub(super) fn prepare(&self, cargo: &mut Command, folder: &Path) -> Result<(), ImageError> {
        cargo.env("RUSTC", &self.rustc);
        if self.build_library {
            let library = match self.recipe.library {
                "std" => "std,panic_abort",
                library => library,
            };
            // Both are of the development version only, unless it is asked for so.
            cargo
                .env("RUSTC_BOOTSTRAP", "1")
                .arg(format!("-Zbuild-std={library}"));
        }
        if let Some(linker) = &self.linker {
            let failed = |error: io::Error| {
                let output = format!("{LINKER} in {}: {error}", folder.display());
                self.recipe.not_built(&output)
            };
            let folder = folder.join("linker");
            fs::create_dir_all(&folder).map_err(failed)?;
            link(linker, &folder.join(LINKER)).map_err(failed)?;
            cargo.env("PATH", before_path(folder).map_err(failed)?);
        }
        Ok(())
    }
}

/// True if `rustc` has to build the library of a recipe itself; `None` if it cannot, or is not
/// there.
fn needs_library(rustc: &Path, recipe: &Recipe, folder: &Path) -> Option<bool> {
    let ready = ask(
        rustc,
        &["--print", "target-libdir", "--target", recipe.triple],
        folder,
    )?;
    let start = format!("lib{}-", recipe.library);
    let is_library = |entry: io::Result<fs::DirEntry>| {
        let name = entry.map(|entry| entry.file_name()).unwrap_or_default();
        let name = name.to_string_lossy();
        name.starts_with(&start) && name.ends_with(".rlib")
    };
    if fs::read_dir(ready).is_ok_and(|mut files| files.any(is_library)) {
        return Some(false);
    }
    let sysroot = ask(rustc, &["--print", "sysroot"], folder)?;
    let sources = sysroot.join("lib/rustlib/src/rust/library");
    sources.join(recipe.library).is_dir().then_some(true)
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
pub(crate) fn on_path(program: &str) -> Option<PathBuf> {
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
