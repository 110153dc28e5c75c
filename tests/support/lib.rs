//! Shared helpers of the cross-crate tests.

pub mod digest;
pub mod draw;
pub mod quadrature;
pub mod random_case;
pub mod solvers;

use hil_runner::files;
use std::path::{Path, PathBuf};

use hil_core::case::Case;
use hil_core::run::{Outcome, RunOptions};
use hil_core::trace::Row;
use hil_runner::host::LinkKind;
use plant::{AxisParameters, Carriage, Joint, Motor, Resistance, Transmission};

/// Folder with the reference runs.
pub fn reference_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference")
}

/// A case by name or path, with overrides as on the command line: the words of
/// `sets`, none of which has a space.
///
/// # Panics
/// If the case cannot be read: a test cannot go on then.
#[allow(clippy::panic, reason = "a test without its case has failed")]
pub fn case(name_or_path: &str, sets: &[&str]) -> Case {
    let words = sets.iter().flat_map(|sets| sets.split_whitespace());
    let sets: Vec<String> = words.map(str::to_owned).collect();
    match files::case(name_or_path, &sets) {
        Ok(case) => case,
        Err(errors) => panic!("{errors}"),
    }
}

/// Runs a case and keeps its rows.
///
/// # Panics
/// If the run cannot be made.
#[allow(clippy::panic, reason = "a test without its run has failed")]
pub fn rows(case: &Case, link: LinkKind) -> (Vec<Row>, Outcome) {
    let mut rows = Vec::new();
    let result = link.run(case, RunOptions::default(), &mut |row| {
        rows.push(*row);
        Ok(())
    });
    match result {
        Ok(outcome) => (rows, outcome),
        Err(error) => panic!("{}: {error}", case.name),
    }
}

/// The paper's axis (Table 1) with another joint and resistance.
pub fn paper_axis(joint: Joint, resistance: Resistance) -> AxisParameters {
    AxisParameters {
        motor: Motor {
            inertia_kg_m2: 2e-4,
            torque_constant_nm_per_a: 0.25,
            resistance_ohm: 1.5,
            inductance_h: 0.0065,
        },
        transmission: Transmission {
            gear_ratio: 2.0,
            joint,
            screw_inertia_kg_m2: 8.5e-4,
            screw_pitch_m_per_rad: 5e-3 / (2.0 * std::f64::consts::PI),
        },
        carriage: Carriage {
            mass_kg: 50.0,
            resistance,
        },
    }
}
