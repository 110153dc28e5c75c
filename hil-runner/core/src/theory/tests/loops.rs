//! Figures of linear loops with options, and the loops that have none.

use super::super::{
    JOINT_STATES, LoopCurves, LoopFigures, LoopGains, Loops, left_out, margin, no_loop,
};
use super::case;

/// Settings of a position from the load.
pub(super) const DUAL: [&str; 3] = [
    "controller.feedback=dual",
    "controller.derivative=measurement",
    "load_encoder.counts_per_mm=1000",
];

#[test]
fn figures_are_those_of_the_margins() {
    let mut loops = Loops::default();
    for sets in [&[][..], &["controller.derivative_filter_s=0.002"], &DUAL] {
        let case = case("paper-2", sets);
        let figures = loops.figures(&case);
        println!("{sets:?}: {figures:#?}");
        let [contact, gap] = JOINT_STATES.map(|joint| margin(&case, joint));
        let signed = [contact, gap].map(|margin| margin.map(|margin| margin.signed()));
        assert_eq!(loops.signed_modulus(&case), signed);
        assert_eq!(figures.modulus_margin_contact, signed[0]);
        assert_eq!(figures.modulus_margin_gap, signed[1]);
    }
}

/// The options act on rung `firmware` alone.
#[test]
fn a_lower_rung_has_the_papers_loop() {
    let mut loops = Loops::default();
    let plain = loops.figures(&case("paper-2", &["controller.law=sampled"]));
    let sets = [&DUAL[..], &["controller.derivative_filter_s=0.002"]].concat();
    let on = |law: &str| case("paper-2", &[&sets[..], &[law]].concat());
    for law in ["controller.law=sampled", "controller.law=quantised"] {
        assert_eq!(loops.figures(&on(law)), plain);
    }
    assert_ne!(loops.figures(&on("controller.law=firmware")), plain);
}

#[test]
fn every_loop_that_is_not_there_has_a_reason() {
    let mut loops = Loops::default();
    let continuous: &[&str] = &["controller.law=continuous"];
    let rigid: &[&str] = &["transmission.joint=rigid"];
    let closed: &[&str] = &["transmission.backlash_half_deg=0"];
    for (sets, none) in [
        (&[][..], [false, false]),
        (continuous, [true, true]),
        (rigid, [false, true]),
        (closed, [false, true]),
        (&DUAL, [false, true]),
    ] {
        let case = case("paper-2", sets);
        let reasons = JOINT_STATES.map(|joint| no_loop(&case, joint));
        println!("{sets:?}: {reasons:?}");
        assert_eq!(reasons.map(|reason| reason.is_some()), none);
        assert_eq!(loops.signed_modulus(&case).map(|m| m.is_none()), none);
        let figures = loops.figures(&case);
        assert_eq!(figures.crossover_contact_hz.is_none(), none[0]);
        assert_eq!(figures.crossover_gap_hz.is_none(), none[1]);
        assert_eq!(figures.least_stiffness_n_per_um.is_none(), none[0]);
    }
}

/// What the linear loop is without is named, and changes none of its figures.
#[test]
fn what_is_left_out_is_said() {
    let mut loops = Loops::default();
    let plain = loops.figures(&case("paper-2", &[]));
    let sets = [
        "controller.slew_limit_codes_per_s=1e6",
        "controller.rest_dead_band_counts=2",
        "controller.rest_integrator=hold",
    ];
    for count in 0..=sets.len() {
        let case = case("paper-2", &sets[..count]);
        let note = left_out(&case);
        println!("{note:?}");
        let keys = sets[..count]
            .iter()
            .map(|set| set.split('=').next().unwrap());
        match &note {
            None => assert_eq!(count, 0),
            Some(note) => assert!(keys.clone().all(|key| note.contains(key))),
        }
        assert_eq!(loops.figures(&case), plain);
    }
    assert_eq!(
        left_out(&case("paper-2", &["controller.anti_windup=clamp"])),
        None
    );
}

/// Of two sets of gains, of which each can be had, the figures are, all of them, those of the
/// worse.
#[test]
fn a_gain_change_has_the_worse_of_two_loops() {
    let mut loops = Loops::default();
    let [start, after] = [3.2, 12.0].map(|kp| format!("controller.kp={kp}"));
    let [gentle, hard] = [&start, &after].map(|kp| loops.figures(&case("paper-2", &[kp])));
    assert_ne!(gentle, hard);
    let changed = case(
        "paper-2",
        &[&start, "gain_change.at_s=0.3", "gain_change.kp=12"],
    );
    let back = case(
        "paper-2",
        &[&after, "gain_change.at_s=0.3", "gain_change.kp=3.2"],
    );
    assert!(hard.modulus_margin_contact < gentle.modulus_margin_contact);
    assert!(hard.modulus_margin_gap < gentle.modulus_margin_gap);
    for (case, each) in [(changed, [gentle, hard]), (back, [hard, gentle])] {
        let after = LoopGains::after_change(&case).unwrap();
        let had = [LoopGains::of(&case), after].map(|gains| loops.figures_of(&case, &[gains]));
        assert_eq!(had, each);
        assert_eq!(loops.figures(&case), hard);
    }
}

/// Cases side by side have the figures of each by itself, to the bit: of other families
/// and none, of two sets of gains, stable and not.
#[test]
fn cases_side_by_side_are_those_alone() {
    let change: &[&str] = &["gain_change.at_s=0.3", "gain_change.kp=12"];
    let rigid: &[&str] = &["transmission.joint=rigid"];
    let filter: &[&str] = &["controller.derivative_filter_s=0.002"];
    let mut cases = Vec::new();
    for sets in [&[][..], change, rigid, filter, &DUAL] {
        for kp in ["0.01", "1", "3", "4", "12", "300"] {
            let kp = format!("controller.kp={kp}");
            cases.push(case("paper-2", &[sets, &[kp.as_str()]].concat()));
        }
    }
    let all: Vec<_> = cases.iter().collect();
    for number in [1, 3, 5, all.len()] {
        let mut loops = Loops::default();
        let figures = all.chunks(number).flat_map(|cases| loops.of_cases(cases));
        let figures: Vec<_> = figures.collect();
        let alone = cases.iter().map(|case| Loops::default().figures(case));
        assert_eq!(figures, alone.collect::<Vec<_>>(), "{number}");
        let is_stable = |figures: &&LoopFigures| figures.modulus_margin_contact > Some(0.0);
        let stable = figures.iter().filter(is_stable).count();
        assert!((10..cases.len() - 3).contains(&stable), "{stable}");
    }
}

/// The figures can be read from the curves that are plotted.
#[test]
fn curves_hold_the_figures() {
    let filter: &[&str] = &["controller.derivative_filter_s=0.002"];
    let mut loops = Loops::default();
    for name in ["paper-1", "paper-2", "paper-3", "paper-4"] {
        for sets in [&[][..], filter, &DUAL] {
            let case = case(name, sets);
            let figures = loops.figures(&case);
            let curves = LoopCurves::of(&case, &LoopGains::of(&case));
            let margins = [figures.modulus_margin_contact, figures.modulus_margin_gap];
            for (curve, margin) in [&curves.contact, &curves.gap].into_iter().zip(margins) {
                let Some(curve) = curve else {
                    assert_eq!(margin, None);
                    continue;
                };
                let points = curve.re.iter().zip(&curve.im);
                let distances = points.map(|(re, im)| (1.0 + re).hypot(*im));
                let least = distances.fold(f64::INFINITY, f64::min);
                // As near as a picture of the circle needs.
                let off = least - margin.unwrap().abs();
                println!("{name} {sets:?}: {} points, off {off:.1e}", curve.re.len());
                assert!((-1e-9..0.02).contains(&off), "{off}");
                assert!((300..=700).contains(&curve.re.len()), "{}", curve.re.len());
                assert!(curve.frequency_hz.is_sorted());
                assert!((curve.frequency_hz[curve.re.len() - 1] / 500.0 - 1.0).abs() < 1e-12);
            }
            let contact = curves.contact.unwrap();
            let least = contact.stiffness_n_per_um.unwrap();
            let least = least.into_iter().fold(f64::INFINITY, f64::min);
            let off = least / figures.least_stiffness_n_per_um.unwrap() - 1.0;
            assert!((-1e-9..0.01).contains(&off), "{off}");
            assert!(
                curves
                    .gap
                    .is_none_or(|gap| gap.stiffness_n_per_um.is_none())
            );
        }
    }
}

/// Time of this thread on a processor, without that of others [s]; Linux has it.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    let ns: f64 = text.split(' ').next().unwrap().parse().unwrap();
    1e-9 * ns
}

/// Time of the figures; run by hand, `--ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn times() {
    let filter: &[&str] = &["controller.derivative_filter_s=0.002"];
    for sets in [&[][..], filter, &DUAL] {
        let mut case = case("paper-2", sets);
        let mut loops = Loops::default();
        let mut time = |runs: u32, each: &mut dyn FnMut(&mut Loops, u32)| {
            let start = cpu_s();
            for run in 0..runs {
                each(&mut loops, run);
            }
            1e6 * (cpu_s() - start) / f64::from(runs)
        };
        let known = time(10_000, &mut |loops, _| {
            std::hint::black_box(loops.figures(&case));
        });
        let modulus = time(10_000, &mut |loops, _| {
            std::hint::black_box(loops.signed_modulus(&case));
        });
        let new = time(1000, &mut |loops, run| {
            case.axis.carriage.mass_kg = 50.0 + f64::from(run);
            case.axis.motor.inertia_kg_m2 *= 1.0001;
            std::hint::black_box(loops.figures(&case));
        });
        println!(
            "{sets:?}: figures {known:.2} µs, modulus {modulus:.2} µs, new families {new:.1} µs"
        );
    }
}
