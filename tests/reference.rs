//! Every reference run, computed independently, against the bench: states,
//! contacts, events, and on `quantised` the codes (tolerances of the design).

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::path::Path;

use bench_tests::{case, reference_folder, rows};
use hil_core::trace::Row;
use hil_runner::host::LinkKind;

/// A quantity of a row, its column and how far it may be off.
type Column = (&'static str, fn(&Row) -> f64, f64);

const COLUMNS: [Column; 8] = [
    ("x_ref_m", |row| row.x_ref_m, 1e-12),
    ("beta_rad", |row| row.beta_rad, 1e-7),
    ("gamma_rad", |row| row.gamma_rad, 1e-7),
    ("beta_dot_radps", |row| row.beta_dot_radps, 1e-4),
    ("gamma_dot_radps", |row| row.gamma_dot_radps, 1e-4),
    ("current_a", |row| row.current_a, 1e-5),
    ("motor_voltage_v", |row| row.motor_voltage_v, 1e-4),
    ("acc_mps2", |row| row.acc_mps2, 1e-3),
];

/// Within this of an event the acceleration, which jumps there, is not
/// compared \[s\].
const NEAR_EVENT_S: f64 = 20e-6;

struct Reference {
    header: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
    events: Vec<(f64, i8, i8)>,
}

impl Reference {
    fn read(toml: &Path) -> Self {
        let mut reader = csv::Reader::from_path(toml.with_extension("csv")).unwrap();
        let header = reader.headers().unwrap().clone();
        let json = std::fs::read_to_string(toml.with_extension("json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let events = serde_json::from_value(json["events"].clone()).unwrap();
        Self {
            header,
            rows: reader.records().collect::<Result<_, _>>().unwrap(),
            events,
        }
    }

    fn value(&self, row: &csv::StringRecord, column: &str) -> Option<f64> {
        let index = self.header.iter().position(|name| name == column)?;
        Some(row[index].parse().unwrap())
    }
}

/// Compares rows and events; the error is the first thing that does not agree.
fn compare(toml: &Path, link: LinkKind, sets: &[&str]) -> Result<(), String> {
    let reference = Reference::read(toml);
    let (rows, outcome) = rows(&case(toml.to_str().unwrap(), sets), link);
    let quantised = outcome.summary.law == "quantised";
    for expected in &reference.rows {
        let t_s = reference.value(expected, "t_s").unwrap();
        let row = rows
            .iter()
            .find(|row| (row.t_s - t_s).abs() < 1e-9)
            .ok_or(format!("no row at {t_s}"))?;
        let near_event = reference
            .events
            .iter()
            .any(|event| (event.0 - t_s).abs() < NEAR_EVENT_S);
        for (column, of, tolerance) in COLUMNS {
            let expected = reference.value(expected, column).unwrap();
            let off = (of(row) - expected).abs();
            if off > tolerance && !(near_event && column == "acc_mps2") {
                return Err(format!("{column} is off by {off} at {t_s}"));
            }
        }
        let contact = reference.value(expected, "contact").unwrap();
        if f64::from(row.contact) != contact && !near_event {
            return Err(format!("contact {} for {contact} at {t_s}", row.contact));
        }
        if quantised {
            let code = reference.value(expected, "dac_code");
            if row.sample.map(|sample| sample.dac_code) != code {
                return Err(format!("code {:?} for {code:?} at {t_s}", row.sample));
            }
        }
    }
    let events = outcome.summary.events.unwrap_or_default();
    if events.len() != reference.events.len() {
        return Err(format!(
            "{} contact changes for {}",
            events.len(),
            reference.events.len()
        ));
    }
    for (event, expected) in events.iter().zip(&reference.events) {
        if (event.1, event.2) != (expected.1, expected.2) || (event.0 - expected.0).abs() > 1e-5 {
            return Err(format!("contact change {event:?} for {expected:?}"));
        }
    }
    Ok(())
}

fn tomls() -> Vec<std::path::PathBuf> {
    let files = std::fs::read_dir(reference_folder()).unwrap();
    let mut tomls: Vec<_> = files
        .map(|file| file.unwrap().path())
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "toml")
        })
        .collect();
    tomls.sort();
    tomls
}

fn all_agree(link: LinkKind, sets: &[&str]) {
    let tomls = tomls();
    assert_eq!(tomls.len(), 23);
    for toml in tomls {
        if let Err(why) = compare(&toml, link, sets) {
            panic!("{}: {why}", toml.display());
        }
    }
}

#[test]
fn references_agree_in_one_process() {
    all_agree(LinkKind::InProcess, &[]);
}

#[test]
fn references_agree_between_two_threads() {
    all_agree(LinkKind::Channel, &[]);
}

/// None of the references has a quadratic resistance, so that above the exact
/// solver takes them all; here the Runge-Kutta does.
#[test]
fn references_agree_with_dopri5() {
    all_agree(LinkKind::InProcess, &["run.solver=dopri5"]);
}

/// The contrast: the comparison sees a gap that is wider by a ten-thousandth
/// of a degree, a slightly heavier carriage, and a solver that locates
/// nothing.
#[test]
fn a_wrong_plant_does_not_agree() {
    let toml = reference_folder().join("sampled-2.toml");
    for set in [
        "transmission.backlash_half_deg=3.0001",
        "carriage.mass_kg=50.001",
        "run.solver=rk4",
        "controller.computation_delay_s=1e-5",
    ] {
        assert!(
            compare(&toml, LinkKind::InProcess, &[set]).is_err(),
            "{set}"
        );
    }
}

/// Both links give the same bits on every sampled rung.
#[test]
fn both_links_give_the_same_bits() {
    for law in ["sampled", "quantised", "firmware"] {
        let case = case("paper-4", &[&format!("controller.law={law}")]);
        let (direct, direct_outcome) = rows(&case, LinkKind::InProcess);
        let (threads, threads_outcome) = rows(&case, LinkKind::Channel);
        assert_eq!(direct.len(), 1501);
        assert_eq!(direct, threads, "{law}");
        assert_eq!(direct_outcome.summary, threads_outcome.summary, "{law}");
    }
}

/// Against `quantised` the first code that the firmware changes is an exact
/// tie and differs by 1.
#[test]
fn firmware_leaves_quantised_by_one_code() {
    for toml in tomls() {
        if !toml
            .file_stem()
            .unwrap()
            .to_str()
            .unwrap()
            .starts_with("quantised")
        {
            continue;
        }
        let path = toml.to_str().unwrap();
        let codes = |sets: &[&str]| -> Vec<f64> {
            let (rows, _) = rows(&case(path, sets), LinkKind::InProcess);
            rows.iter()
                .map(|row| row.sample.unwrap().dac_code)
                .collect()
        };
        let (quantised, firmware) = (codes(&[]), codes(&["controller.law=firmware"]));
        let first = quantised.iter().zip(&firmware).find(|(q, f)| q != f);
        if let Some((q, f)) = first {
            assert_eq!((q - f).abs(), 1.0, "{path}");
        }
    }
}
