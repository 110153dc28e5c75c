//! Quantities that a file can give in several ways, of which it gives one, and the
//! physical units among them.

use hil_core::runfile::{RunFile, SECTIONS, Section, Way};
use hil_runner::study::{Changes, Study};
use plant::PidGains;

use super::document::samples;
use super::{BASE, base_with, messages, parse};

fn quantities() -> impl Iterator<Item = (&'static Section, &'static [Way])> {
    let of = |section: &'static Section| section.ways.iter().map(move |ways| (section, *ways));
    SECTIONS.iter().flat_map(of)
}

#[test]
fn the_ways_are_made_of_keys() {
    let mut seen: Vec<String> = Vec::new();
    for (section, ways) in quantities() {
        let mut own: Vec<String> = Vec::new();
        for name in ways.iter().copied().flatten() {
            assert!(section.key(name).is_some(), "{}.{name}", section.name);
            own.push(format!("{}.{name}", section.name));
        }
        own.sort();
        own.dedup();
        assert!(!own.iter().any(|path| seen.contains(path)), "{own:?}");
        seen.extend(own);
        assert!(ways.len() > 1);
    }
    assert!(quantities().count() > 10);
}

/// Every two keys of two ways.
#[test]
fn two_ways_at_once_are_refused() {
    let mut pairs = 0;
    for (section, ways) in quantities() {
        let mut names: Vec<&str> = ways.iter().copied().flatten().copied().collect();
        names.sort();
        names.dedup();
        for key in &names {
            for other in names.iter().filter(|other| section.excludes(key, other)) {
                let sets = [key, other].map(|name| {
                    let value = samples(section.key(name).unwrap()).0;
                    format!("{}.{name}={value}", section.name)
                });
                let told = messages(BASE, &[&sets[0], &sets[1]]);
                let both = |told: &&String| {
                    let named = |name: &str| told.contains(&format!("{}.{name} = ", section.name));
                    let words = "gives the same in another way; give ";
                    named(key) && named(other) && told.contains(words)
                };
                assert_eq!(told.iter().filter(both).count(), 1, "{sets:?}: {told:?}");
                pairs += 1;
            }
        }
    }
    assert!(pairs > 80, "{pairs}");
}

/// Gains in volts, of which two are left out.
const HALF: &str = "controller.kp_v_per_rad=30";

#[test]
fn a_set_takes_the_place_of_the_whole_way_of_the_file() {
    let by_set = parse(BASE, &["encoder.lines=500"]).unwrap();
    let by_file = base_with("counts_per_rad = 636.0", "lines = 500");
    assert_eq!(by_set, parse(&by_file, &[]).unwrap());
    assert_ne!(by_set, parse(BASE, &[]).unwrap());

    let whole = [
        HALF,
        "controller.ki_v_per_rad_s=46",
        "controller.kd_vs_per_rad=0.5",
    ];
    let by_file = base_with(
        "kp = 3.2\nki_per_s = 5.0\nkd_s = 0.05",
        "kp_v_per_rad = 30\nki_v_per_rad_s = 46\nkd_vs_per_rad = 0.5",
    );
    assert_eq!(parse(BASE, &whole), parse(&by_file, &[]));
    // What the file has in the way of the override stays, and one of it can be changed.
    let changed = parse(&by_file, &["controller.kp_v_per_rad=15"]).unwrap();
    let gains = parse(&by_file, &[]).unwrap().controller.gains;
    assert_eq!(
        changed.controller.gains,
        PidGains {
            kp: gains.kp / 2.0,
            ..gains
        }
    );

    let must = "; with --set controller.kp_v_per_rad=30 it must come by --set too";
    let told = messages(BASE, &[HALF]);
    assert_eq!(told.len(), 2, "{told:?}");
    for (told, key) in told.iter().zip(["ki_v_per_rad_s", "kd_vs_per_rad"]) {
        let start = format!("cases/x.toml: [controller] (line 26) lacks {key}: ");
        assert!(told.starts_with(&start) && told.ends_with(must), "{told}");
    }
}

/// The base with a screw of a millimetre per radian, and a gain of one code per count
/// that makes two volts per radian.
fn plain(sets: &[&str]) -> hil_core::case::Case {
    let units = [
        "transmission.screw_pitch_mm_per_rev=6.283185307179586",
        "encoder.counts_per_rad=1024",
        "drive.amplifier_gain=2",
        "drive.dac_lsb_v=0.0009765625",
    ];
    parse(BASE, &[&units, sets].concat()).unwrap_or_else(|errors| panic!("{errors}"))
}

#[test]
fn physical_units_are_those_of_a_sheet_of_paper() {
    let near = |found: f64, by_hand: f64| (found / by_hand - 1.0).abs() < 1e-14;
    // 2 kg cm² are 2e-4 kg m², to the last bit.
    let inertias = [
        "motor.inertia_kg_cm2=2",
        "transmission.screw_inertia_kg_cm2=8.5",
    ];
    assert_eq!(plain(&inertias), plain(&[]));
    assert_ne!(plain(&["motor.inertia_kg_cm2=20"]), plain(&[]));
    let joint = |sets: &[&str]| match plain(sets).axis.transmission.joint {
        plant::Joint::Elastic(joint) => joint,
        plant::Joint::Rigid => panic!("the joint is elastic"),
    };
    // A micrometre at the carriage is a thousandth of a radian of the screw, and 100 N
    // a tenth of a newton metre.
    assert!(near(
        joint(&["transmission.stiffness_n_per_um=100"]).stiffness_nm_per_rad,
        100.0
    ));
    assert!(near(
        joint(&["transmission.damping_ns_per_m=1e5"]).damping_nms_per_rad,
        0.1
    ));
    // The whole gap: 20 µm are ± 10 µm.
    assert!(near(
        joint(&["transmission.backlash_um=20"]).backlash_half_rad,
        0.01
    ));
    let friction = plain(&["carriage.resistance_linear_ns_per_m=100"])
        .axis
        .carriage
        .resistance;
    assert!(near(friction.linear_ns_per_rad, 0.1));
    // The paper's screw of 5 mm a turn: 3° either way are 83.3 µm in all, not 41.7.
    let half_deg = |set: &str| {
        let case = parse(BASE, &[set]).unwrap();
        case.axis
            .transmission
            .joint
            .backlash_half_rad()
            .to_degrees()
    };
    assert!(near(
        half_deg("transmission.backlash_um=83.33333333333333"),
        3.0
    ));
    assert!(!near(
        half_deg("transmission.backlash_um=41.66666666666667"),
        3.0
    ));
}

#[test]
fn a_gain_in_volts_is_the_same_number_in_codes() {
    let codes = [
        "controller.kp=3.2",
        "controller.ki_per_s=5",
        "controller.kd_s=0.05",
    ];
    let volts = [
        "controller.kp_v_per_rad=6.4",
        "controller.ki_v_per_rad_s=10",
        "controller.kd_vs_per_rad=0.1",
    ];
    // The whole case: every bit of a run follows from it.
    assert_eq!(plain(&codes), plain(&volts));
    let other = ["drive.amplifier_gain=3"];
    let with = |gains: &[&str]| plain(&[gains, &other].concat());
    assert_ne!(with(&codes), with(&volts));
    // k·(k_v + 1/T_n) = 0.5·(20 + 10), k·k_v/T_n = 0.5·20·10, k, over 2 V/rad.
    let cascade = [
        "controller.kv_per_s=20",
        "controller.velocity_gain_vs_per_rad=0.5",
        "controller.velocity_reset_s=0.1",
    ];
    let gains = PidGains {
        kp: 7.5,
        ki_per_s: 50.0,
        kd_s: 0.25,
    };
    assert_eq!(plain(&cascade).controller.gains, gains);
    // Without the velocity loop's integral part K_p would be 5.
    let slow = [&cascade[..2], &["controller.velocity_reset_s=1e9"]].concat();
    assert!((plain(&slow).controller.gains.kp - 5.0).abs() < 1e-6);
    let change = |key: &str| {
        let sets = ["gain_change.at_s=0.5", key];
        plain(&sets).options.gain_change.unwrap()
    };
    assert_eq!(
        change("gain_change.kp=4"),
        change("gain_change.kp_v_per_rad=8")
    );
    assert_ne!(
        change("gain_change.kp=4"),
        change("gain_change.kp_v_per_rad=4")
    );
}

#[test]
fn a_refused_gain_is_laid_at_what_the_file_says() {
    let sets = [
        "controller.kv_per_s=20",
        "controller.velocity_gain_vs_per_rad=0.5",
    ];
    let sets = [&sets[..], &["controller.velocity_reset_s=0.1"]].concat();
    let sets: Vec<String> = sets.into_iter().map(str::to_owned).collect();
    let nothing_beside = |_: &str, _: &str| Err(String::new());
    let file = RunFile::parse("x.toml", BASE, &sets, nothing_beside).unwrap();
    let told = file.refuse("controller.kp", "it is too much").to_string();
    assert!(
        told.starts_with("--set controller.kv_per_s=20: controller.kp = 1.610"),
        "{told}"
    );
    let end = " is not allowed: it is too much; controller.kv_per_s = 20 (by --set) makes it";
    assert!(told.ends_with(end), "{told}");
}

/// A study of a base with gains in volts or in codes, with steps that make two volts
/// per radian of a code per count.
fn study(gains: &str, body: &str) -> Study {
    let base = BASE
        .replace("kp = 3.2\nki_per_s = 5.0\nkd_s = 0.05", gains)
        .replace("dac_lsb_v = 0.00488", "dac_lsb_v = 0.0009765625")
        .replace("amplifier_gain = 3.0", "amplifier_gain = 2.0")
        .replace("counts_per_rad = 636.0", "counts_per_rad = 1024.0");
    let changes = Changes {
        base_text: Some(base),
        ..Changes::default()
    };
    let text = format!("base = \"base.toml\"\nrungs = [\"sampled\"]\n{body}\n");
    Study::parse("x.toml", &text, &changes).unwrap_or_else(|error| panic!("{error}"))
}

const CODES: &str = "kp = 3.2\nki_per_s = 5\nkd_s = 0.05";
const VOLTS: &str = "kp_v_per_rad = 6.4\nki_v_per_rad_s = 10\nkd_vs_per_rad = 0.1";

fn gains(study: &Study) -> Vec<PidGains> {
    let points = 0..study.plan.points();
    let gains = points.map(|point| study.case(&study.point(point), 0).unwrap().controller.gains);
    gains.collect()
}

#[test]
fn a_study_over_volts_is_one_over_codes() {
    let axis = |key: &str, values: &str| format!("[[axis]]\nkey = \"{key}\"\nvalues = {values}");
    let codes = gains(&study(CODES, &axis("controller.kp", "[1, 2.2, 3.2]")));
    let volts = gains(&study(
        VOLTS,
        &axis("controller.kp_v_per_rad", "[2, 4.4, 6.4]"),
    ));
    assert_eq!(codes, volts);
    let factors = |key: &str| format!("{}\ntimes = \"{key}\"", axis(key, "[0.5, 2]"));
    let codes = gains(&study(CODES, &factors("controller.kp")));
    assert_eq!(
        codes,
        gains(&study(VOLTS, &factors("controller.kp_v_per_rad")))
    );
    assert_eq!(codes[1].kp, 6.4);
}

/// Codes per count follow the encoder where the base says volts, and where the study
/// asks for it; left to themselves they stay.
#[test]
fn gains_in_volts_keep_the_loop_at_other_steps() {
    let encoder = "[[axis]]\nkey = \"encoder.counts_per_rad\"\nvalues = [512, 1024, 4096]";
    let kp = |given: &str, body: &str| -> Vec<f64> {
        gains(&study(given, body))
            .iter()
            .map(|gains| gains.kp)
            .collect()
    };
    let kept = [6.4, 3.2, 0.8];
    assert_eq!(kp(VOLTS, encoder), kept);
    let constant = format!("loop_gain = \"constant\"\n{encoder}");
    assert_eq!(kp(VOLTS, &constant), kept);
    assert_eq!(kp(CODES, &constant), kept);
    assert_eq!(kp(CODES, encoder), [3.2; 3]);
}
