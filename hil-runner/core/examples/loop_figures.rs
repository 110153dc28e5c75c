//! Figures of the linear loops of cases, a line of JSON for each line of
//! standard input: the name of a built-in case and overrides between blanks.
//!
//! ```text
//! echo paper-2 controller.derivative_filter_s=0.002 | cargo run -p hil-core --example loop_figures
//! ```

use std::io::{BufRead, stdin};

use hil_core::runfile;
use hil_core::theory::Loops;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut loops = Loops::default();
    for line in stdin().lock().lines() {
        let line = line?;
        let mut words = line.split_whitespace().map(str::to_owned);
        let name = words
            .next()
            .ok_or("a line begins with the name of a case")?;
        let sets: Vec<String> = words.collect();
        let case = runfile::builtin(&name, &sets)?;
        println!("{}", serde_json::to_string(&loops.figures(&case))?);
    }
    Ok(())
}
