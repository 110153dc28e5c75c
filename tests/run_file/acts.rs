//! On which rungs a key acts, and what is said of one that does not.

use hil_core::case::Law;
use hil_core::run::{RunOptions, keys_without_effect, run};
use hil_core::runfile::{Key, Need, Section};
use hil_core::trace::Row;
use hil_runner::study::{Changes, Study};

use super::document::{all_keys, beside, samples};
use super::{BASE, parse};

const LOWER: [Law; 3] = [Law::Continuous, Law::Sampled, Law::Quantised];

/// A value that is not the default.
fn another(key: &Key) -> String {
    let (first, second) = samples(key);
    match key.need {
        Need::Default(default) if default.to_toml() == second => first,
        _ => second,
    }
}

fn path(section: &Section, key: &Key) -> String {
    format!("{}.{}", section.name, key.name)
}

fn keys_of_firmware() -> impl Iterator<Item = (String, &'static Key)> {
    all_keys()
        .filter(|(_, key)| key.is_of_firmware())
        .map(|(section, key)| (path(section, key), key))
}

/// The remark on the base with these sets on a rung.
fn told(law: Law, sets: &[&str]) -> Option<String> {
    let of_law = format!("controller.law={}", law.name());
    let case = parse(BASE, &[&[of_law.as_str()], sets].concat());
    keys_without_effect([&case.unwrap_or_else(|errors| panic!("{errors}"))])
}

#[test]
fn a_key_that_the_rung_leaves_out_is_told() {
    let mut keys = 0;
    for (path, key) in keys_of_firmware() {
        let set = format!("{path}={}", another(key));
        let sets = [&beside(&path)[..], &[&set]].concat();
        for law in LOWER {
            let told = told(law, &sets).unwrap_or_default();
            let named = told.starts_with(&format!("rung {} leaves out ", law.name()))
                && told.contains(&path)
                && told.ends_with(" on rung firmware");
            assert!(named, "{set}: {told}");
        }
        assert_eq!(told(Law::Firmware, &sets), None, "{set}");
        if let Need::Default(default) = key.need {
            let set = format!("{path}={}", default.to_toml());
            assert_eq!(told(Law::Quantised, &[&set]), None, "{set}");
        }
        keys += 1;
    }
    assert!(keys > 50, "{keys}");
}

#[test]
fn the_keys_stand_in_one_line_in_the_order_of_the_table() {
    let sets = [
        "limits.following_error_counts=1400",
        "controller.quantiser=nearest",
        "controller.derivative=measurement",
    ];
    assert_eq!(
        told(Law::Sampled, &sets).unwrap(),
        "rung sampled leaves out controller.derivative, limits.following_error_counts: \
         they act on rung firmware"
    );
    assert_eq!(
        told(Law::Quantised, &sets[1..]).unwrap(),
        "rung quantised leaves out controller.derivative: it acts on rung firmware"
    );
    let rungs = Law::ALL.map(|law| {
        let law = format!("controller.law={}", law.name());
        parse(BASE, &[&law, sets[2]]).unwrap()
    });
    assert_eq!(
        keys_without_effect(&rungs).unwrap(),
        "rungs continuous, sampled, quantised leave out controller.derivative: it acts on rung firmware"
    );
}

/// The run's rows and figures, without the list of what the rung leaves out.
fn outcome(law: Law, sets: &[&str]) -> (Vec<Row>, String) {
    let of_law = format!("controller.law={}", law.name());
    let fixed = ["run.duration_s=0.1", of_law.as_str()];
    let case = parse(BASE, &[&fixed, sets].concat()).unwrap_or_else(|errors| panic!("{errors}"));
    let mut rows = Vec::new();
    let outcome = run(&case, RunOptions::default(), &mut |row| {
        rows.push(*row);
        Ok(())
    });
    let mut summary = outcome.unwrap().summary;
    summary.keys_without_effect.clear();
    (rows, format!("{summary:?}"))
}

/// That each key acts on the rungs that it names, too, is shown for those of
/// `firmware` by `tests/features/knobs.rs`.
#[test]
fn a_key_changes_nothing_where_it_does_not_act() {
    let plain = Law::ALL.map(|law| outcome(law, &[]));
    let mut same = 0;
    for (section, key) in all_keys() {
        let path = path(section, key);
        let set = format!("{path}={}", another(key));
        let sets = [&beside(&path)[..], &[&set]].concat();
        // A drive of another kind is not the plain axis.
        let mut drive = beside(&path);
        drive.retain(|set| set.starts_with("drive."));
        for (law, plain) in Law::ALL.into_iter().zip(&plain) {
            if !key.acts.on(law, |_| false) {
                let same_drive = (!drive.is_empty()).then(|| outcome(law, &drive));
                let plain = same_drive.as_ref().unwrap_or(plain);
                assert!(outcome(law, &sets) == *plain, "{set} on {}", law.name());
                same += 1;
            }
        }
    }
    assert!(same > 150, "{same}");
    // The contrast: on the others these do.
    for (set, acting) in [
        ("controller.sample_time_s=0.002", &Law::ALL[1..]),
        ("controller.computation_delay_s=0.001", &Law::ALL[1..]),
        ("drive.dac_bits=4", &Law::ALL[2..]),
        ("run.row_interval_s=0.002", &Law::ALL[..1]),
    ] {
        for law in acting {
            assert!(
                outcome(*law, &[set]) != plain[*law as usize],
                "{set} on {}",
                law.name()
            );
        }
    }
    let range = |bits: &str| {
        let span = "drive={dac_range_v=80, amplifier_gain=3, voltage_limit_v=150}";
        outcome(Law::Continuous, &[span, bits])
    };
    assert!(range("drive.dac_bits=14") != range("drive.dac_bits=12"));
}

/// Reads a study of the base on one rung. The base has what an axis over
/// one key of a pair needs.
fn study(law: Law, body: &str, sets: &[String]) -> Result<Study, String> {
    let pairs = "[gain_change]\nat_s = 0.2\nkp = 3\n[inject]\nencoder_glitch_s = 0.2\n\
                 encoder_glitch_counts = 9\n";
    let folder = tempfile::tempdir().unwrap();
    let base = folder.path().join("base.toml");
    std::fs::write(&base, format!("{BASE}{pairs}")).unwrap();
    let law = law.name();
    let text = format!("base = {base:?}\nrungs = [\"{law}\"]\n{body}\n");
    let changes = Changes {
        sets: sets.to_vec(),
        ..Changes::default()
    };
    Study::parse("x.toml", &text, &changes).map_err(|error| error.to_string())
}

const CURE: &str = "changes nothing on rung quantised of this study: it acts on firmware; \
                    add rungs = [\"firmware\"] or give --rungs firmware";

#[test]
fn a_study_of_such_a_key_is_refused_where_no_rung_acts() {
    for (path, key) in keys_of_firmware().filter(|(path, _)| !path.starts_with("target")) {
        let axis = format!("[[axis]]\nkey = \"{path}\"\nvalues = [{}]", another(key));
        let found = study(Law::Quantised, &axis, &[]).unwrap_err();
        assert_eq!(found, format!("x.toml:4: axis {path}: it {CURE}"));
        let sets: Vec<String> = beside(&path).into_iter().map(str::to_owned).collect();
        let study = study(Law::Firmware, &axis, &sets).unwrap_or_else(|error| panic!("{error}"));
        study
            .case(&study.point(0), 0)
            .unwrap_or_else(|error| panic!("{path}: {error}"));
    }
    let axis = "[[axis]]\nkey = \"target.clock_hz\"\nvalues = [1, 2]";
    let told = study(Law::Firmware, axis, &[]).unwrap_err();
    assert!(told.contains("nothing in the runs of a study"), "{told}");
}

#[test]
fn a_value_for_such_a_key_is_refused_likewise() {
    for (path, key) in keys_of_firmware() {
        let value = another(key);
        let mut sets: Vec<String> = beside(&path).into_iter().map(str::to_owned).collect();
        sets.push(format!("{path}={value}"));
        let told = study(Law::Quantised, "", &sets).unwrap_err();
        let line = format!("x.toml: {path} = {value} {CURE}; or leave it out");
        assert!(told.lines().any(|told| told == line), "{line}\n{told}");
        assert!(study(Law::Firmware, "", &sets).is_ok(), "{path}");
        if let Need::Default(default) = key.need {
            let set = format!("{path}={}", default.to_toml());
            assert!(study(Law::Quantised, "", &[set]).is_ok(), "{path}");
        }
    }
}

/// Bits of a converter are a gain where its range is given.
#[test]
fn other_keys_follow_their_rungs() {
    let bits = "[[axis]]\nkey = \"drive.dac_bits\"\nvalues = [12, 14]";
    assert_eq!(
        study(Law::Sampled, bits, &[]).unwrap_err(),
        "x.toml:4: axis drive.dac_bits: it changes nothing on rung sampled of this study: it acts on \
         quantised, firmware (with dac_range_v every rung); add rungs = [\"quantised\"] or give --rungs quantised"
    );
    assert!(study(Law::Sampled, bits, &["drive.dac_range_v=80".to_owned()]).is_ok());
    let range = "[[axis]]\nkey = \"drive.dac_range_v\"\nvalues = [40, 80]";
    assert!(study(Law::Sampled, &format!("{bits}\n{range}"), &[]).is_ok());
    let time = "[[axis]]\nkey = \"controller.sample_time_s\"\nvalues = [1e-3, 2e-3]";
    assert!(study(Law::Continuous, time, &[]).is_err());
    assert!(study(Law::Sampled, time, &[]).is_ok());
}
