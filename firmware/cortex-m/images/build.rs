//! Chooses the board by the target, and gives the linker its memory.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

/// Targets and their boards.
const BOARDS: [(&str, &str); 4] = [
    ("thumbv7em-none-eabihf", "m4"),
    ("thumbv7m-none-eabi", "m3"),
    ("thumbv6m-none-eabi", "m0"),
    ("riscv32imac-unknown-none-elf", "rv32"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let target = env::var("TARGET")?;
    let names: Vec<String> = BOARDS
        .iter()
        .map(|(_, board)| format!("{board:?}"))
        .collect();
    println!(
        "cargo:rustc-check-cfg=cfg(board, values({}))",
        names.join(", ")
    );
    let Some((_, board)) = BOARDS.iter().find(|(triple, _)| *triple == target) else {
        let known: Vec<&str> = BOARDS.iter().map(|(triple, _)| *triple).collect();
        return Err(format!(
            "no board for {target}; build with --target, one of {}",
            known.join(", ")
        )
        .into());
    };
    println!("cargo:rustc-cfg=board=\"{board}\"");

    let memory = format!("memory/{board}.x");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(&memory, out.join("memory.x"))?;
    // The runtime asks it for interrupts that the image leaves alone.
    fs::write(
        out.join("device.x"),
        "PROVIDE(uart_received = DefaultHandler);\n",
    )?;
    println!("cargo:rustc-link-search={}", out.display());
    if board == &"rv32" {
        // Its runtime does not ask for it by itself.
        println!("cargo:rustc-link-arg=-Tmemory.x");
    }
    println!("cargo:rustc-link-arg=-Tlink.x");
    // Without it sections are moved apart to pages, which no chip has.
    println!("cargo:rustc-link-arg=--nmagic");
    println!("cargo:rerun-if-changed={memory}");
    println!("cargo:rerun-if-changed=build.rs");
    Ok(())
}
