//! The figures of many runs, without rows: what studies are made of.
//!
//! Runs that share axis (but for b), command, timing and law are computed side
//! by side in the lanes of the widest vector instructions; every other case by
//! itself. Neither changes a bit of a figure: each lane sees the plant's operations in the
//! order of the single run and gets that run's codes, and nothing is added across lanes.
//!
//! ```text
//! family     the runs that can go side by side, their command, and the work of a thread
//! laws       the sampled laws on all lanes, and gains, encoder and drive lane by lane
//! side_by_side  laws and axes from sample to sample, and what their rows leave behind
//! worker     what one thread keeps from run to run
//! alone      whatever cannot go side by side
//! ```

mod alone;
mod family;
mod laws;
mod side_by_side;
mod worker;

pub use family::{OneByOne, Parcel, parcels};
pub use plant::Vectors;
pub use worker::Runs;

#[cfg(target_arch = "x86_64")]
#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::case::Case;
    use crate::runfile;
    use crate::summary::Summary;

    /// The same bits with every kind of instructions that this machine has.
    #[test]
    fn instructions_change_no_bit() {
        let case = runfile::builtin("paper-2", &["controller.law=quantised".into()]).unwrap();
        let cases: Vec<Case> = (1..=8)
            .map(|n| {
                let mut case = case.clone();
                case.controller.gains.kp = 0.7 * f64::from(n);
                case
            })
            .collect();
        let widest = Level::new();
        let levels = [
            widest.as_sse2().map(Level::Sse2),
            widest.as_avx2().map(Level::Avx2),
        ];
        let figures = |level| -> Vec<Summary> {
            let mut results = Vec::new();
            Runs::with(level).figures(&cases, &mut results);
            results.into_iter().map(Result::unwrap).collect()
        };
        for level in levels.into_iter().flatten() {
            assert_eq!(figures(level), figures(widest), "{level:?}");
        }
    }
}
