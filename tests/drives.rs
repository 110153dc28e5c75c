//! Drives and loads beyond the paper's: what a control engineer knows of them by hand, and
//! the exact solver against the one that steps.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use bench_tests::{case, paper_axis, reference_folder, rows};
use hil_core::case::Case;
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::run::{CaseRun, RunOptions};
use hil_core::trace::Row;
use hil_runner::host::LinkKind;
use plant::{Amplifier, AxisParameters, Control, Drive, Joint, Plant, Resistance};
use plant::{Solver, Surroundings};

/// The runs of the reference with drives, loads and commands.
const REFERENCES: [&str; 9] = [
    "continuous-limits-short",
    "quantised-moves-current-pi",
    "sampled-profile",
    "continuous-current-pi-load",
    "continuous-voltage-current-limit",
    "quantised-load-pulse",
    "sampled-current-ideal-limit",
    "sampled-current-pi-saturated",
    "sampled-hanging-friction",
];

fn reference(name: &str, sets: &[&str]) -> Case {
    let path = reference_folder().join(format!("{name}.toml"));
    case(path.to_str().unwrap(), sets)
}

fn run_of(case: &Case) -> CaseRun {
    CaseRun::new(case, RunOptions::default(), &mut |_| Ok(())).unwrap()
}

/// The largest relative difference of a figure of two cases, and its key.
fn largest_difference(one: &Case, other: &Case) -> (f64, &'static str) {
    let summaries = [one, other].map(|case| run_of(case).outcome.summary);
    let differences = SUMMARY_FIGURES.iter().map(|figure| {
        let [a, b] = [0, 1].map(|at: usize| summaries[at].figure(figure.key));
        match (a, b) {
            (Some(a), Some(b)) if a != b => {
                // Errors are differences of positions of a tenth of a metre.
                let least = if figure.key.contains("error") {
                    1.0
                } else {
                    1e-3
                };
                ((a - b).abs() / a.abs().max(b.abs()).max(least), figure.key)
            }
            (None, Some(_)) | (Some(_), None) => (f64::INFINITY, figure.key),
            _ => (0.0, figure.key),
        }
    });
    differences.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

#[test]
fn figures_agree_with_those_of_a_solver_that_steps() {
    for name in REFERENCES {
        let exact = reference(name, &[]);
        let stepped = reference(name, &["run.solver=dopri5", "run.tolerance=1e-13"]);
        let (off, key) = largest_difference(&exact, &stepped);
        println!("{name}: {key} differs by {off:.1e}");
        // Measured: 3.2e-9 at most, of a ripple of 1.4 µm; the stepping solver's own scatter
        // between tolerances of 3e-14 and 1e-12 is as large.
        assert!(off < 1e-8, "{name}: {key} differs by {off:e}");
        // The contrast: a carriage that is heavier by a thousandth.
        let mut heavier = exact.clone();
        heavier.axis.carriage.mass_kg *= 1.001;
        let (seen, key) = largest_difference(&exact, &heavier);
        assert!(seen > 1e-5, "{name}: {key} {seen:e}");
    }
}

fn current_drive(current_limit_a: f64, bandwidth_radps: Option<f64>) -> Surroundings {
    Surroundings {
        amplifier: Amplifier {
            gain: 1.0,
            voltage_limit_v: 48.0,
            control: Control::Current {
                current_limit_a,
                bandwidth_radps,
            },
        },
        ..Surroundings::default()
    }
}

/// A rotor that hardly turns, so that the motor is an inductance with a resistance.
fn heavy() -> AxisParameters {
    let mut axis = paper_axis(Joint::Rigid, Resistance::default());
    axis.motor.inertia_kg_m2 = 1e6;
    axis
}

/// `I = i_cmd·(1 − e^{−ω_c·t})`: the zero of the loop stands on the armature's pole.
#[test]
fn a_current_loop_is_a_first_order_lag() {
    let omega = 2.0 * std::f64::consts::PI * 300.0;
    for solver in [Solver::Exact, Solver::Dopri5 { tolerance: 1e-13 }] {
        let worst = |bandwidth: f64| {
            let surroundings = current_drive(10.0, Some(bandwidth));
            let mut plant = Plant::within(&heavy(), &surroundings, solver);
            (1..=20).fold(0.0_f64, |worst, step| {
                let time_ns = 100_000 * step;
                plant.advance(&Drive::Held(2.0), time_ns, &mut ()).unwrap();
                let time_s = 1e-9 * time_ns as f64;
                let expected = 2.0 * (1.0 - libm::exp(-omega * time_s));
                worst.max((plant.state().current_a - expected).abs())
            })
        };
        assert!(worst(omega) < 1e-9, "{:e}", worst(omega));
        // The contrast: another bandwidth.
        assert!(worst(1.01 * omega) > 1e-3);
    }
}

/// 40 A at once would take 15 V and 6.5 mH·40 A·ω_c: the loop stands at its 48 V, the
/// current rises by V/L, and comes to rest without overshoot.
#[test]
fn a_saturated_loop_has_all_the_voltage_and_does_not_wind_up() {
    let omega = 2.0 * std::f64::consts::PI * 500.0;
    let mut plant = Plant::within(&heavy(), &current_drive(50.0, Some(omega)), Solver::Exact);
    let drive = Drive::Held(20.0);
    assert_eq!(plant.just_after(&drive).voltage_v, 48.0);
    let mut peak_a = 0.0_f64;
    for step in 1..=200 {
        plant.advance(&drive, 100_000 * step, &mut ()).unwrap();
        peak_a = peak_a.max(plant.state().current_a);
    }
    assert!((plant.state().current_a - 20.0).abs() < 1e-6);
    assert!(peak_a < 20.0 + 1e-9, "{peak_a}");
    assert!((plant.just_after(&drive).voltage_v - 30.0).abs() < 1e-3);
}

/// The current of a voltage drive with a limit reaches it and stays.
#[test]
fn a_limit_of_the_current_holds_it() {
    let sets = ["drive.current_limit_a=6"];
    let base = ["controller.law=sampled"];
    let free = run_of(&case("paper-2", &base)).outcome.summary;
    let limited = case("paper-2", &[&base[..], &sets].concat());
    let limited = run_of(&limited).outcome.summary;
    assert!(free.peak_abs_current_a > 7.0 && free.current_limited_s == 0.0);
    assert!((limited.peak_abs_current_a - 6.0).abs() < 1e-12);
    assert!(
        limited.current_limited_s > 1e-3,
        "{}",
        limited.current_limited_s
    );
    assert!(limited.peak_following_error_mm > free.peak_following_error_mm);
}

fn rows_of(case: &Case) -> Vec<Row> {
    rows(case, LinkKind::InProcess).0
}

/// A load for ever is that of the carriage, two halves are the whole, and one that has
/// ended before the motion leaves an axis that comes back.
#[test]
fn loads_add_up() {
    let with = |loads: &str| {
        let load = format!("load=[{loads}]");
        rows_of(&case("paper-2", &["controller.law=quantised", &load]))
    };
    let always = case(
        "paper-2",
        &["controller.law=quantised", "carriage.load_force_n=200"],
    );
    let always = rows_of(&always);
    assert_eq!(with("{force_n=200}"), always);
    assert_eq!(with("{force_n=100},{force_n=100}"), always);
    assert_ne!(with("{force_n=200,to_s=0.2}"), always);
    // Positive against positive x: without a loop the carriage would go back.
    assert!(always[30].x_m < 0.0, "{}", always[30].x_m);
}

/// On a flank the joint is in contact from the start, without an impact.
#[test]
fn a_start_on_a_flank_is_no_impact() {
    let of = |start: &str| {
        let start = format!("transmission.start={start}");
        let case = case("paper-2", &["controller.law=sampled", &start]);
        let rows = rows_of(&case);
        (rows[0], rows[100], run_of(&case).outcome.summary)
    };
    let (first, later, flank) = of("positive_flank");
    let b_rad = 3.0_f64.to_radians();
    assert_eq!((first.contact, later.contact), (1, 1));
    assert!((first.beta_rad - b_rad).abs() < 1e-15 && first.gamma_rad == 0.0);
    // The encoder's zero is there: the first error is that of the command alone.
    assert_eq!(first.sample.unwrap().error_counts, 0.0);
    let (first, _, centred) = of("centred");
    assert_eq!(first.contact, 0);
    assert_eq!(flank.contact_changes + 1, centred.contact_changes);
}

/// A first motion away leaves the flank at once, however slowly it begins: with the sine it
/// is of the fifth order in t, without a derivative of the sixth, which rounding of b hides for
/// tens of microseconds.
#[test]
fn a_first_motion_away_leaves_the_flank_at_once() {
    for (start, pull, load, kd) in [
        ("negative_flank", "false", 0, 0.05),
        ("negative_flank", "true", 0, 0.05),
        ("positive_flank", "false", -100, 0.05),
        ("negative_flank", "false", 0, 0.0),
        ("negative_flank", "true", 0, 0.0),
    ] {
        let changes = ["exact", "dopri5"].map(|solver| {
            let sets = format!(
                "controller.law=continuous run.solver={solver} transmission.start={start} \
                 transmission.no_pull={pull} carriage.load_force_n={load} controller.kd_s={kd}"
            );
            let away = run_of(&case("paper-2", &[&sets])).outcome.contact_changes;
            assert_eq!(away[0].time_s, 0.0, "{sets}");
            assert!(away[1].time_s > 1e-3, "{sets}");
            // The contrast: towards the flank.
            let sets = match load {
                0 => sets.replace("negative", "positive"),
                _ => sets.replace("=-100", "=100"),
            };
            let towards = run_of(&case("paper-2", &[&sets])).outcome.contact_changes;
            assert!(towards[0].time_s > 1e-3, "{sets}");
            away.len()
        });
        assert_eq!(changes[0], changes[1], "{start} {pull} {load} {kd}");
    }
}

/// A current at its limit, or an ideal current loop and a computation that ends within a
/// sample: the states then only integrate one another, where nothing damps them.
#[test]
fn a_held_current_is_exact_over_a_part_of_a_step() {
    let drive = "controller.law=quantised drive.kind=current drive.amplifier_gain_a_per_v=4 \
        drive.current_limit_a=25 controller.kp=1.125 controller.ki_per_s=4.5 \
        controller.kd_s=0.025 controller.computation_delay_s=3e-4";
    let limited = "controller.law=quantised drive.current_limit_a=9 \
        controller.computation_delay_s=3e-4";
    let gap = "transmission.backlash_half_deg=3";
    for sets in [
        format!("{drive} {gap}"),
        format!(
            "{drive} {gap} carriage.resistance_opposes_motion=true carriage.resistance_constant_n=40"
        ),
        format!("{drive} transmission.joint=rigid"),
        format!("{limited} {gap}"),
        "controller.law=continuous drive.kind=current drive.amplifier_gain_a_per_v=2 \
         drive.current_limit_a=9 controller.kp_a_per_rad=8 controller.ki_a_per_rad_s=700 \
         controller.kd_as_per_rad=0 transmission.joint=rigid carriage.mass_kg=800 \
         motion.intervals_s=[0.1,0.1,0.1,0.1,0.1,0.1,0.1] motion.travel_mm=20 \
         run.duration_s=0.7 run.row_interval_s=0.05"
            .to_owned(),
    ] {
        let of = |solver: &str| case("paper-2", &[&format!("{sets} {solver}")]);
        let exact = of("");
        let stepped = of("run.solver=dopri5 run.tolerance=1e-13");
        let (off, key) = largest_difference(&exact, &stepped);
        let changes = [&exact, &stepped].map(|case| run_of(case).outcome.contact_changes);
        let apart_s = changes[0].iter().zip(&changes[1]);
        let apart_s = apart_s.map(|(a, b)| (a.time_s - b.time_s).abs());
        let apart_s = apart_s.fold(0.0, f64::max);
        println!("{sets}: {key} differs by {off:.1e}, contacts by {apart_s:.1e} s");
        assert_eq!(changes[0].len(), changes[1].len(), "{sets}");
        assert!(off < 2e-9, "{sets}: {key} differs by {off:e}");
        // Measured: 2.9e-12 s at most, after 1.4 s with friction.
        assert!(apart_s < 1e-10, "{sets}: {apart_s:e} s");
        // The contrast: a carriage that is heavier by a thousandth.
        let mut heavier = exact.clone();
        heavier.axis.carriage.mass_kg *= 1.001;
        assert!(largest_difference(&exact, &heavier).0 > 1e-5, "{sets}");
    }
}

#[test]
fn both_links_and_the_firmware_take_a_current_drive() {
    let name = "quantised-load-pulse";
    let sets = [
        "controller.law=firmware",
        "drive.kind=current",
        "drive.amplifier_gain_a_per_v=4",
        "drive.current_limit_a=25",
        "drive.current_bandwidth_hz=400",
        "controller.kp=1.125",
        "controller.ki_per_s=4.5",
        "controller.kd_s=0.025",
    ];
    let case = reference(name, &sets);
    let (direct, direct_outcome) = rows(&case, LinkKind::InProcess);
    let (threads, threads_outcome) = rows(&case, LinkKind::Channel);
    assert_eq!(direct, threads);
    assert_eq!(direct_outcome.summary, threads_outcome.summary);
    // The contrast: an ideal loop is another run.
    let mut ideal = case.clone();
    if let Control::Current {
        bandwidth_radps, ..
    } = &mut ideal.amplifier.control
    {
        *bandwidth_radps = None;
    }
    assert_ne!(rows_of(&ideal), direct);
}

/// Remarks with their figures, and where there is nothing to say.
#[test]
fn a_slow_loop_and_a_load_that_nothing_holds_are_told() {
    let told = |name: &str, sets: &[&str]| run_of(&reference(name, sets)).warnings;
    let pi = "sampled-current-pi-saturated";
    let slow = told(pi, &["drive.current_bandwidth_hz=20"]);
    assert!(
        slow[..]
            .iter()
            .any(|told| told.starts_with("the current loop of 20 Hz is "))
    );
    let quick = told(pi, &["drive.current_bandwidth_hz=5000"]);
    assert!(
        !quick
            .iter()
            .any(|told| told.contains("the current loop of"))
    );
    // 100 N on 50 kg and the screw's 8.5e-4 kg m²/p²: 0.5·0.0725·2² = 0.05 µm in 1 ms.
    let sets = ["controller.law=sampled", "carriage.load_force_n=100"];
    let told = run_of(&case("paper-2", &sets)).warnings;
    let falls = told
        .iter()
        .find(|told| told.starts_with("nothing holds the load of 100 N"));
    let mass_kg = 50.0 + 8.5e-4 / (5e-3 / std::f64::consts::TAU).powi(2);
    let fall_um = 1e6 * 0.5 * 100.0 / mass_kg * 1e-6;
    let figure = hil_core::number::table(fall_um);
    assert!(
        falls.is_some_and(|told| told.contains(&format!("up to {figure} µm towards -x"))),
        "{told:?}"
    );
    let held = [
        "carriage.resistance_opposes_motion=true",
        "carriage.resistance_constant_n=101",
    ];
    let told = run_of(&case("paper-2", &[&sets[..], &held].concat())).warnings;
    assert!(!told.iter().any(|told| told.contains("nothing holds")));
    // What holds the joint on one flank hides its gap.
    let measured = [
        "controller.law=firmware",
        "backlash.gap=measured",
        "backlash.backlash_measurement_detection=effort",
        "carriage.load_force_n=100",
    ];
    let hides = |sets: &[&str]| {
        let told = run_of(&case("paper-2", &[&measured[..], sets].concat())).warnings;
        told.iter().any(|told| told.contains("finds no gap there"))
    };
    assert!(hides(&[]) && !hides(&held));
}

/// What a run is asked for and does not come to.
#[test]
fn what_comes_after_the_end_is_told() {
    let told = |sets: &[&str]| run_of(&case("paper-2", sets)).warnings.join("\n");
    let late = told(&["load=[{force_n=100,from_s=1.5}]", "sequence.disable_s=2"]);
    for path in ["load.1.from_s = 1.5 is", "sequence.disable_s = 2 is"] {
        assert!(
            late.contains(path) && late.contains("run.duration_s = 1.5"),
            "{late}"
        );
    }
    let within = told(&[
        "load=[{force_n=100,from_s=1.499}]",
        "sequence.disable_s=1.4",
    ]);
    assert!(!within.contains("nothing comes of it"), "{within}");
}

/// The converter's range is a limit as the amplifier's is, where codes have a range.
#[test]
fn a_converter_that_is_too_small_is_told() {
    let sets = [
        "motion.max_acceleration_mps2=2",
        "motion.max_velocity_mps=0.5",
    ];
    let told = |law: &str, more: &str| {
        let law = format!("controller.law={law}");
        let told = run_of(&case("paper-2", &[&sets[..], &[&law, more]].concat())).warnings;
        told.into_iter()
            .find(|told| told.contains("beyond drive and motor"))
    };
    let bits = "drive.dac_bits=12";
    let small = told("quantised", bits).unwrap_or_default();
    // 2047 codes of 4.88 mV, three times as much at the motor.
    assert!(small.contains("the largest code asks for 30 V"), "{small}");
    assert_eq!(told("sampled", bits), None);
    assert_eq!(told("quantised", "drive.dac_bits=16"), None);
}
