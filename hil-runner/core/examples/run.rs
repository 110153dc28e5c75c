//! A run from Rust: the paper's second case with other gains, its figures, and
//! the code that the firmware answers to every sample.
//!
//! ```text
//! cargo run -p hil-core --example run
//! ```

use hil_core::run::{RunOptions, run};
use hil_core::runfile;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sets = ["controller.kp=4".to_owned(), "run.duration_s=2".to_owned()];
    let case = runfile::builtin("paper-2", &sets)?;
    let mut largest_code = 0.0_f64;
    let outcome = run(&case, RunOptions::default(), &mut |row| {
        let code = row.sample.map_or(0.0, |sample| sample.dac_code);
        largest_code = largest_code.max(code.abs());
        Ok(())
    })?;
    let summary = &outcome.summary;
    for key in ["peak_following_error_mm", "final_error_um"] {
        println!("{key}: {}", summary.shown(key));
    }
    assert!(summary.peak_following_error_mm < 4.0, "{summary:?}");
    assert_eq!(summary.max_abs_dac_code, Some(largest_code));
    assert!(summary.verdicts.iter().all(|verdict| verdict.pass));
    Ok(())
}
