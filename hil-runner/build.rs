//! Builds the simulator for web pages into a release binary. Other builds find or build it when
//! a page is asked for (`src/live/image.rs`), so that no test waits for it.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SOURCES: &[&str] = &include!("src/live/sources.in");
const TARGET: &str = "wasm32-unknown-unknown";

fn main() {
    println!("cargo:rustc-check-cfg=cfg(simulator)");
    println!("cargo:rerun-if-changed=build.rs");
    if env::var_os("PROFILE").is_none_or(|profile| profile != "release") {
        return;
    }
    for source in SOURCES {
        println!("cargo:rerun-if-changed=../{source}");
    }
    match built() {
        Ok(()) => println!("cargo:rustc-cfg=simulator"),
        Err(why) => {
            println!("cargo:warning=this program carries no simulator for web pages: {why}");
        }
    }
}

/// Builds the images, and lays them into the folder of what this script makes.
fn built() -> Result<(), String> {
    let variable = |name: &str| env::var_os(name).ok_or_else(|| format!("there is no {name}"));
    let out = PathBuf::from(variable("OUT_DIR")?);
    // <target folder>/release/build/hil-runner-…/out. The lock of a folder of its own is not the
    // one that the cargo which waits for this script holds.
    let target_folder = out.ancestors().nth(4).unwrap_or(&out).join("wasm");
    let cargo = Command::new(variable("CARGO")?)
        .args(["build", "--profile", "wasm", "--locked"])
        .args([
            "--package",
            "hil-web",
            "--package",
            "hil-unpack",
            "--target",
            TARGET,
        ])
        .arg("--target-dir")
        .arg(&target_folder)
        .current_dir(Path::new(&variable("CARGO_MANIFEST_DIR")?).join(".."))
        // Meant for the host.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("RUSTC_WORKSPACE_WRAPPER")
        .stdin(Stdio::null())
        .output()
        .map_err(|error| error.to_string())?;
    if !cargo.status.success() {
        // One line is what a warning has; without the target it is that.
        let told = String::from_utf8_lossy(&cargo.stderr);
        let error = told.lines().find(|line| line.starts_with("error"));
        let error = error.unwrap_or("cargo has ended with an error").to_owned();
        return Err(format!("{error}; rustup target add {TARGET}"));
    }
    for name in ["hil_web.wasm", "hil_unpack.wasm"] {
        let image = target_folder.join(TARGET).join("wasm").join(name);
        let copied = std::fs::copy(&image, out.join(name));
        copied.map_err(|error| format!("{}: {error}", image.display()))?;
    }
    Ok(())
}
