//! The reference cases and the built-in ones.

use hil_runner::files;
use std::f64::consts::{PI, TAU};

use hil_core::case::{Case, ComputationDelay, Law, SolverChoice, TargetSettings};
use hil_core::options::AxisOptions;
use hil_core::runfile::{self, Need, SECTIONS, builtin_names, builtin_text};
use plant::Joint;

use super::{BASE, parse};

pub(crate) fn load_reference(name: &str) -> Case {
    let path = format!("{}/reference/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    files::case(&path, &[]).unwrap_or_else(|errors| panic!("{errors}"))
}

#[test]
fn all_reference_cases_load() {
    let laws = [
        ("continuous-1", Law::Continuous),
        ("continuous-2", Law::Continuous),
        ("continuous-3", Law::Continuous),
        ("continuous-4", Law::Continuous),
        ("continuous-rigid-2", Law::Continuous),
        ("quantised-1", Law::Quantised),
        ("quantised-2-fast", Law::Quantised),
        ("quantised-3-saturated", Law::Quantised),
        ("sampled-2", Law::Sampled),
        ("sampled-4-delay", Law::Sampled),
        ("sampled-friction-3", Law::Sampled),
        ("sampled-loose-1", Law::Sampled),
        ("sampled-no-pull-1", Law::Sampled),
        ("sampled-rigid-3", Law::Sampled),
    ];
    for (name, law) in laws {
        let case = load_reference(name);
        assert_eq!(case.name, name);
        assert_eq!(case.controller.law, law, "{name}");
        let found = case.controller.sample_time_ns.is_none();
        assert_eq!(found, law == Law::Continuous);
    }
    let found = load_reference("sampled-rigid-3").axis.transmission.joint;
    assert_eq!(found, Joint::Rigid);
    assert!(
        load_reference("sampled-friction-3")
            .axis
            .carriage
            .resistance
            .opposes_motion
    );
    assert!(
        load_reference("sampled-4-delay")
            .controller
            .computation_delay
            != ComputationDelay::Fixed(0)
    );
}

#[test]
fn units_are_converted_and_defaults_hold() {
    let case = parse(BASE, &[]).unwrap();
    let Joint::Elastic(joint) = case.axis.transmission.joint else {
        panic!("the joint is elastic unless the file says otherwise");
    };
    assert_eq!(case.name, "x");
    assert_eq!(joint.backlash_half_rad, 3.0 * PI / 180.0);
    assert!(!joint.no_pull);
    assert_eq!(case.axis.transmission.screw_pitch_m_per_rad, 5e-3 / TAU);
    assert_eq!(case.motion.travel_m(), 0.25);
    assert_eq!(case.motion.end_s(), 1.0);
    assert_eq!((case.dac.bits, case.dac.step_v), (16, 0.00488));
    assert_eq!(case.controller.sample_time_ns, Some(1_000_000));
    assert_eq!(
        case.controller.computation_delay,
        ComputationDelay::Fixed(0)
    );
    assert_eq!(case.target, TargetSettings::default());
    assert_eq!(case.options, AxisOptions::default());
    assert_eq!(case.run.duration_ns, 1_500_000_000);
    assert_eq!(case.run.solver, SolverChoice::Auto);
    assert_eq!(case.run.row_interval_ns, 1_000_000);
    assert_eq!(case.run.rk4_step_ns, 10_000);
    assert_eq!(case.run.tolerance, 1e-11);
    assert_eq!(case.run.settling_band_um, 100.0);
    assert!(case.run.events);
    assert_eq!(case.budget, None);
}

#[test]
fn pairs_and_total_time_mean_what_they_say() {
    let text = BASE
        .replace("dac_lsb_v = 0.00488", "dac_range_v = 20\ndac_bits = 12")
        .replace("counts_per_rad = 636.0", "lines = 1000")
        .replace("[motion]", "[motion]\ntotal_time_s = 2");
    let case = parse(&text, &[]).unwrap();
    assert_eq!(case.dac.step_v, 20.0 / 4096.0);
    assert_eq!(case.encoder.counts_per_rad, 4000.0 / TAU);
    let found = case.motion.intervals_s();
    assert_eq!(found, Some([0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5]));
}

#[test]
fn a_budget_keeps_its_order_and_an_empty_one_limits_nothing() {
    let figures = |text: &str| -> Vec<(&str, f64)> {
        let limits = parse(&format!("{BASE}{text}"), &[])
            .unwrap()
            .budget
            .unwrap();
        limits.into_iter().map(|l| (l.figure, l.limit)).collect()
    };
    assert_eq!(figures("[budget]\n"), []);
    assert_eq!(
        figures("[budget]\nsettling_time_s = 1\nimpacts = 0\nfinal_error_um = 2.5\n"),
        [
            ("settling_time_s", 1.0),
            ("impacts", 0.0),
            ("final_error_um", 2.5)
        ]
    );
}

#[test]
fn the_built_in_cases_are_the_papers() {
    let names: Vec<&str> = builtin_names().collect();
    assert_eq!(
        names,
        ["paper-1", "paper-2", "paper-3", "paper-4", "paper-2-12bit"]
    );
    for (name, reference) in [
        ("paper-1", "continuous-1"),
        ("paper-2", "continuous-2"),
        ("paper-3", "continuous-3"),
        ("paper-4", "continuous-4"),
        ("paper-2-12bit", "continuous-2"),
    ] {
        let case = files::case(name, &[]).unwrap_or_else(|errors| panic!("{errors}"));
        let mut expected = load_reference(reference);
        assert_eq!(case.name, name);
        assert_eq!(case.dac.bits, if name == "paper-2-12bit" { 12 } else { 14 });
        assert_eq!(case.controller.law, Law::Firmware);
        expected.name.clone_from(&case.name);
        expected.dac.bits = case.dac.bits;
        expected.controller.law = Law::Firmware;
        expected.controller.sample_time_ns = Some(1_000_000);
        // The reference writes 3° as the double next to it.
        if let (Joint::Elastic(ours), Joint::Elastic(theirs)) = (
            case.axis.transmission.joint,
            &mut expected.axis.transmission.joint,
        ) {
            assert!((ours.backlash_half_rad - theirs.backlash_half_rad).abs() < 1e-16);
            theirs.backlash_half_rad = ours.backlash_half_rad;
        }
        assert_eq!(case, expected);
    }
}

/// Whoever starts from a built-in case finds every key in it, the optional
/// ones behind a `#`; budget and tune have tables of their own.
#[test]
fn the_built_in_cases_show_every_key() {
    for name in builtin_names() {
        let text = builtin_text(name).unwrap();
        for section in SECTIONS
            .iter()
            .filter(|section| !["budget", "tune"].contains(&section.name))
        {
            for key in section.keys {
                let shown = |line: &str| {
                    let line = line.trim_start_matches("# ");
                    line.split_once(" = ")
                        .is_some_and(|(name, _)| name == key.name)
                };
                assert!(text.lines().any(shown), "{name} shows {}", key.name);
            }
        }
    }
}

#[test]
fn taking_the_hash_away_from_a_default_changes_nothing() {
    for name in builtin_names() {
        let text = builtin_text(name).unwrap();
        let case = runfile::parse(name, text, &[]).unwrap();
        let keys: Vec<_> = SECTIONS.iter().flat_map(|section| section.keys).collect();
        let uncommented: Vec<&str> = text
            .lines()
            .map(|line| match line.strip_prefix("# ") {
                Some(inner)
                    if keys.iter().any(|key| {
                        matches!(key.need, Need::Default(_))
                            && inner.starts_with(&format!("{} =", key.name))
                    }) =>
                {
                    inner
                }
                _ => line,
            })
            .collect();
        assert!(
            uncommented
                .iter()
                .filter(|line| !text.lines().any(|l| l == **line))
                .count()
                > 10
        );
        let same = runfile::parse(name, &uncommented.join("\n"), &[]);
        assert_eq!(same.unwrap_or_else(|errors| panic!("{errors}")), case);
    }
}
