//! Command line of the servo bench.

fn main() {}
