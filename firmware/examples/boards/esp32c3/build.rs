//! Names the linker script that `esp-hal` brings.

fn main() {
    println!("cargo::rustc-link-arg-examples=-Tlinkall.x");
}
