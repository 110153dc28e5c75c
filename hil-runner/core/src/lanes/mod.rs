//! The figures of many runs, without rows: what studies are made of.
//!
//! Runs that share axis (but for b), command, timing and law are computed side
//! by side in the lanes of the widest vector instructions; every other case by
//! itself. Neither changes a bit of a figure: each lane sees the operations of the single run in their order, and
//! nothing is added across lanes.
//!
//! ```text
//! family     which runs can go side by side
//! commands   the motion at the samples, computed once for all of them
//! settings   gains, encoder, converter and amplifier, lane by lane
//! laws       the sampled laws on all lanes
//! seen       what the rows leave behind, lane by lane
//! lockstep   laws and axes from sample to sample
//! worker     what one thread keeps from run to run
//! ```

mod commands;
mod family;
mod laws;
mod lockstep;
mod seen;
mod settings;
mod worker;

use std::collections::HashMap;

use crate::case::Case;
use family::Family;

pub use worker::{Runs, SingleRuns};

/// Cases side by side at most.
const LANES: usize = 8;

/// Cases of one family, or cases without one: a piece of work for one thread.
#[derive(Debug)]
pub struct Parcel {
    family: Option<Family>,
    places: Vec<usize>,
}

/// The cases cut into work for a number of threads: as much as is computed at a
/// time, unless that left a thread without any.
pub fn parcels(cases: &[Case], threads: usize) -> Vec<Parcel> {
    let cut = |group: &Group| match group.family {
        None => 1,
        Some(_) => {
            let share = group.places.len().div_ceil(threads);
            share.next_multiple_of(LANES).min(Runs::AT_A_TIME)
        }
    };
    let parcel = |family| {
        move |places: &[usize]| Parcel {
            family,
            places: places.to_vec(),
        }
    };
    groups(cases)
        .iter()
        .flat_map(|group| {
            group
                .places
                .chunks(cut(group))
                .map(parcel(group.family))
                .collect::<Vec<_>>()
        })
        .collect()
}

/// Places of the cases of one family, in order.
struct Group {
    family: Option<Family>,
    places: Vec<usize>,
}

/// The families in the order in which they appear.
fn groups(cases: &[Case]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known = HashMap::new();
    for (place, case) in cases.iter().enumerate() {
        let family = Family::of(case);
        let key = family.as_ref().map(Family::key);
        let number = *known.entry(key).or_insert(groups.len());
        match groups.get_mut(number) {
            Some(group) => group.places.push(place),
            None => groups.push(Group {
                family,
                places: vec![place],
            }),
        }
    }
    groups
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use fearless_simd::Level;

    use super::*;
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
            widest.as_sse4_2().map(Level::Sse4_2),
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
