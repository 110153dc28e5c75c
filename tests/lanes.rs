//! Runs side by side give the figures of runs made one by one, bit for bit.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use bench_tests::draw::Draw;
use bench_tests::{case, reference_folder};
use hil_core::case::{Case, Law};
use hil_core::error::RunError;
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::lanes::{OneByOne, Runs};
use hil_core::options::AxisOptions;
use hil_core::run::{RunOptions, run};
use hil_core::runfile::{Kind, SECTIONS};
use hil_core::summary::Summary;
use hil_runner::files;
use hil_runner::host::figures;
use plant::{
    Batch, Dac, Drive, Encoder, Extremes, ExtremesSettings, Joint, LaneSetup, One, Plant, Solver,
    Surroundings,
};

/// b \[rad\], K_p and K_d of 300 draws.
fn draws() -> Vec<[f64; 3]> {
    let mut reader = csv::Reader::from_path(reference_folder().join("w4-first-300.csv")).unwrap();
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        [0, 1, 2].map(|column| row[column].parse().unwrap())
    });
    rows.collect()
}

/// The draws from `first` on as variants of a case.
fn drawn(case: &Case, first: usize, number: usize) -> Vec<Case> {
    let draws = draws().into_iter().skip(first).take(number);
    draws
        .map(|[backlash_half_rad, kp, kd_s]| {
            let mut case = case.clone();
            if let Joint::Elastic(joint) = &mut case.axis.transmission.joint {
                joint.backlash_half_rad = backlash_half_rad;
            }
            case.controller.gains.kp = kp;
            case.controller.gains.kd_s = kd_s;
            case.run.events = false;
            case
        })
        .collect()
}

fn threads(n: usize) -> NonZeroUsize {
    NonZeroUsize::new(n).unwrap()
}

fn single(case: &Case) -> Result<Summary, RunError> {
    run(case, RunOptions::default(), &mut |_| Ok(())).map(|outcome| outcome.summary)
}

/// Every figure as bits, in the order of the summary.
fn bits(summary: &Summary) -> Vec<Option<u64>> {
    let figures = SUMMARY_FIGURES.iter();
    figures
        .map(|figure| summary.figure(figure.key).map(f64::to_bits))
        .collect()
}

/// Compares a list of cases with runs one by one; returns their contacts.
fn assert_same(cases: &[Case], threads: NonZeroUsize) -> u64 {
    let together = figures(cases, threads).unwrap();
    assert_eq!(together.len(), cases.len());
    let mut contacts = 0;
    for (place, (case, together)) in cases.iter().zip(&together).enumerate() {
        match (single(case), together) {
            (Ok(alone), Ok(together)) => {
                for ((a, b), figure) in bits(&alone)
                    .iter()
                    .zip(bits(together))
                    .zip(&SUMMARY_FIGURES)
                {
                    let key = figure.key;
                    assert_eq!(*a, b, "case {place}: {key}\n{alone:?}\n{together:?}");
                }
                assert_eq!(alone, *together);
                contacts += alone.contact_changes;
            }
            (alone, together) => {
                let message = |result: &Result<_, RunError>| {
                    result
                        .as_ref()
                        .map_err(RunError::to_string)
                        .map(|_: &Summary| ())
                };
                assert_eq!(message(&alone), message(together), "case {place}");
            }
        }
    }
    contacts
}

/// Keys that the rung leaves out are told of runs side by side, too.
#[test]
fn what_the_rung_leaves_out_stands_in_every_summary() {
    let sets = ["controller.law=quantised", "controller.velocity_ff_s=0.02"];
    let case = case("paper-2", &sets);
    assert_eq!(case.keys_without_effect, ["controller.velocity_ff_s"]);
    assert_same(&drawn(&case, 0, 5), threads(1));
}

#[test]
fn random_cases_have_the_figures_of_single_runs() {
    for law in ["sampled", "quantised", "firmware"] {
        let law = format!("controller.law={law}");
        for (first, delay) in ["0.0", "0.0003", "0.001"].into_iter().enumerate() {
            let delay = format!("controller.computation_delay_s={delay}");
            let case = case("paper-2", &[&law, &delay]);
            let contacts = assert_same(&drawn(&case, 60 * first, 120), threads(2));
            assert!(contacts > 500, "{law} {delay}: {contacts}");
        }
    }
}

/// Loads, starts on a flank, friction and limits of the current; codes and voltages at their
/// limits beside, whose time is counted once.
#[test]
fn surroundings_go_side_by_side() {
    const LIMITED: &str = "drive.current_limit_a=8 drive.voltage_limit_v=40";
    const CODES: &str = "drive.current_limit_a=9 drive.dac_bits=8 drive.dac_range_v=40";
    const HANGING: &str = "carriage.load_force_n=491 transmission.start=negative_flank";
    const FRICTION: &str =
        "carriage.resistance_constant_n=60 carriage.resistance_opposes_motion=true";
    let settings: [&[&str]; 7] = [
        &[LIMITED],
        &[CODES],
        &[HANGING],
        &[LIMITED, FRICTION],
        &[CODES, HANGING],
        &[HANGING, FRICTION, "controller.computation_delay_s=0.0004"],
        &[
            FRICTION,
            "transmission.start=positive_flank",
            "carriage.load_force_n=-50",
        ],
    ];
    let (mut saturated, mut limited) = (0, 0);
    for law in ["sampled", "quantised", "firmware"] {
        let law = format!("controller.law={law}");
        for sets in settings {
            let sets = [&[law.as_str()], sets].concat();
            let cases = drawn(&case("paper-2", &sets), 100, 20);
            let contacts = assert_same(&cases, threads(1));
            assert!(contacts > 10, "{sets:?}: {contacts}");
            let mut runs = Runs::new();
            let mut results = Vec::new();
            runs.figures(&cases, &mut results);
            assert_eq!(runs.take_one_by_one(), BTreeMap::new(), "{sets:?}");
            for summary in results.into_iter().flatten() {
                saturated += u32::from(summary.voltage_saturated_s > 0.0);
                limited += u32::from(summary.current_limited_s > 0.0);
            }
        }
    }
    // All of it happens.
    assert!(saturated > 50 && limited > 50, "{saturated} {limited}");
}

/// A run may end within a sample, before or after the delay of its last code.
#[test]
fn the_last_sample_may_be_cut_short() {
    for law in ["sampled", "quantised", "firmware"] {
        for delay in ["0", "0.0003", "0.001"] {
            for duration in ["1.0902", "1.0903", "1.0907"] {
                let sets = [
                    format!("controller.law={law}"),
                    format!("controller.computation_delay_s={delay}"),
                    format!("run.duration_s={duration}"),
                ];
                let sets = sets.each_ref().map(String::as_str);
                let cases = drawn(&case("paper-2", &sets), 40, 12);
                let contacts = assert_same(&cases, threads(1));
                assert!(contacts > 20, "{sets:?}: {contacts}");
                // The contrast: the end shows.
                let shorter = drawn(
                    &case("paper-2", &[sets[0], sets[1], "run.duration_s=1.09"]),
                    40,
                    1,
                );
                let [short, long] =
                    [&shorter[0], &cases[0]].map(|case| bits(&single(case).unwrap()));
                assert_ne!(short, long, "{sets:?}");
            }
        }
    }
}

#[test]
fn lanes_need_not_be_full() {
    let case = case("paper-3", &["controller.law=quantised"]);
    for number in [0, 1, 2, 3, 5, 8, 9, 11, 17] {
        assert_same(&drawn(&case, 200, number), threads(3));
    }
}

/// Encoder, converter, drive and settling band are free; so is b = 0.
#[test]
fn lanes_may_differ_in_everything_but_axis_and_timing() {
    for law in ["sampled", "quantised", "firmware"] {
        let case = case("paper-2", &[&format!("controller.law={law}")]);
        let mut cases = drawn(&case, 30, 24);
        for (n, case) in (0_u32..).zip(&mut cases) {
            case.encoder = Encoder::with_lines(500.0 + 100.0 * f64::from(n));
            case.dac = Dac::with_range(8 + n % 8, 80.0);
            case.amplifier.voltage_limit_v = 30.0 + 5.0 * f64::from(n);
            case.run.settling_band_um = 20.0 + f64::from(n);
            case.name = format!("case {n}");
            if let (Joint::Elastic(joint), 0) = (&mut case.axis.transmission.joint, n % 5) {
                joint.backlash_half_rad = 0.0;
            }
        }
        let saturated = |case: &Case| single(case).unwrap().voltage_saturated_s > 0.0;
        assert!(cases.iter().filter(|case| saturated(case)).count() > 5);
        assert_same(&cases, threads(1));
    }
}

/// Every key of the run file, in two other values beside the base's: what a key
/// changes is each run's own, or parts families.
#[test]
fn every_key_may_differ_from_run_to_run() {
    const NUMBERS: [&str; 14] = [
        "0.0005", "0.002", "0.05", "0.1", "0.2", "0.4", "1", "2", "3", "12", "14", "60", "400",
        "-1",
    ];
    for law in ["sampled", "quantised", "firmware"] {
        let law = format!("controller.law={law}");
        // Runs side by side list no events.
        let base = case("paper-2", &[&law, "run.events=false"]);
        let (mut walked, mut windows) = (0, 0);
        for section in SECTIONS {
            for key in section.keys {
                let values: Vec<String> = match key.kind {
                    Kind::Flag => ["true", "false"].map(str::to_owned).into(),
                    Kind::Choice(names) => names.iter().map(|name| format!("{name:?}")).collect(),
                    _ => NUMBERS.map(str::to_owned).into(),
                };
                let others = values.iter().filter_map(|value| {
                    let set = format!("{}.{}={value}", section.name, key.name);
                    let mut case = files::case("paper-2", &[law.clone(), set]).ok()?;
                    case.run.events = false;
                    (case != base && case.controller.law == base.controller.law).then_some(case)
                });
                let others: Vec<Case> = others.take(2).collect();
                let [first, second] = &others[..] else {
                    continue;
                };
                walked += 1;
                windows += u32::from(key.name == "rest_window_s");
                let together = [first, &base, second, &base].map(Case::clone);
                assert_same(&together, threads(1));
            }
        }
        assert!(walked >= 40 && windows == 1, "{law}: {walked}");
    }
}

/// Options of rung `firmware`: words as on the command line, in which `#` is a whole number
/// between the bounds.
const OPTIONS: [(&str, [u64; 2]); 34] = [
    ("controller.velocity_ff_s=#e-3", [1, 90]),
    ("controller.acceleration_ff_s2=#e-5", [1, 90]),
    ("controller.friction_ff_codes=#", [1, 60]),
    ("controller.derivative=measurement", [0, 0]),
    ("controller.derivative_filter_s=#e-4", [1, 50]),
    ("controller.anti_windup=clamp", [0, 0]),
    (
        "controller.anti_windup=back-calculation controller.tracking_time_s=#e-3",
        [2, 50],
    ),
    ("controller.word_bits=#", [8, 30]),
    ("controller.gain_fraction_bits=#", [12, 32]),
    ("controller.quantiser=error-feedback", [0, 0]),
    (
        "controller.quantiser=dither controller.dither_seed=#",
        [0, 99],
    ),
    ("controller.slew_limit_codes_per_s=#e3", [50, 900]),
    ("controller.setpoints=generator", [0, 0]),
    ("controller.setpoints=queue", [0, 0]),
    ("controller.rest_dead_band_counts=#", [1, 20]),
    ("controller.rest_integrator=hold", [0, 0]),
    ("encoder.counter_bits=#", [12, 31]),
    ("load_encoder.counts_per_rad=#", [500, 3000]),
    (
        "load_encoder.counts_per_mm=# controller.feedback=dual",
        [100, 2000],
    ),
    (
        "backlash.compensation=velocity limits.velocity_mps=# limits.acceleration_mps2=20",
        [1, 3],
    ),
    (
        "backlash.compensation=acceleration limits.velocity_mps=2 limits.acceleration_mps2=# \
         backlash.half_gap_deg=3",
        [5, 40],
    ),
    ("limits.following_error_counts=#", [300, 3000]),
    (
        "limits.following_error_counts=200 limits.following_error_per_speed_s=#e-3",
        [10, 90],
    ),
    ("limits.count_jump_counts=#", [20, 300]),
    (
        "limits.encoder_loss_s=0.02 limits.encoder_loss_codes=#",
        [20, 400],
    ),
    ("limits.saturation_s=#e-3", [5, 200]),
    ("limits.missed_ticks=true", [0, 0]),
    ("sequence.disable_s=0.4 sequence.enable_s=0.#", [41, 95]),
    (
        "sequence.emergency_stop_s=0.6 sequence.emergency_stop_release_s=0.7 sequence.reset_s=0.#",
        [71, 99],
    ),
    (
        "gain_change.at_s=0.# gain_change.kp=2 gain_change.kd_s=0.03",
        [1, 9],
    ),
    (
        "inject.encoder_glitch_s=0.5 inject.encoder_glitch_counts=#",
        [10, 500],
    ),
    ("inject.encoder_freeze_s=0.#", [31, 89]),
    (
        "inject.missed_tick_s=0.# inject.setpoint_underrun_s=0.8",
        [31, 89],
    ),
    ("inject.bus_error_s=0.#", [31, 89]),
];

/// The draws of W4 on rung `firmware`, each with some options, those behind `most` left
/// out; combinations that the run file refuses are drawn again.
fn with_options(draw: &mut Draw, most: usize, number: usize) -> Vec<Case> {
    let base = case("paper-2", &["controller.law=firmware"]);
    let drawn = drawn(&base, 0, number);
    let with_some = |mut of: Case| {
        loop {
            let mut sets = vec!["controller.law=firmware".to_owned()];
            for (words, [low, high]) in &OPTIONS[..most] {
                if draw.chance(0.15) {
                    let number = draw.whole(*low, *high).to_string();
                    let words = words.replace('#', &number);
                    sets.extend(words.split_whitespace().map(str::to_owned));
                }
            }
            if let Ok(case) = files::case("paper-2", &sets) {
                of.options = case.options;
                return of;
            }
        }
    };
    drawn.into_iter().map(with_some).collect()
}

/// The axis of a lane is that of the single run, with its report, its faults and the
/// power that they take away.
#[test]
fn options_of_the_firmware_go_side_by_side() {
    let mut draw = Draw::new(21);
    // Without a load's encoder, or anything that stops the axis, as a tune has them.
    let calm = with_options(&mut draw, 17, 150);
    let all = with_options(&mut draw, OPTIONS.len(), 150);
    for cases in [&calm, &all] {
        let contacts = assert_same(cases, threads(1));
        assert!(contacts > 500, "{contacts}");
    }
    let mut runs = Runs::new();
    let mut results = Vec::new();
    runs.figures(&[calm.clone(), all].concat(), &mut results);
    assert_eq!(runs.take_one_by_one(), BTreeMap::new());
    // All of it happens: refusals, faults of several causes, and runs without any.
    let (mut causes, mut without) = (BTreeMap::new(), 0);
    for summary in results.iter().flatten() {
        match summary.axis.as_ref().map(|axis| &axis.fault) {
            Some(Some(fault)) => *causes.entry(fault.cause).or_insert(0) += 1,
            Some(None) => without += 1,
            None => {}
        }
    }
    let refused = results.iter().filter(|result| result.is_err()).count();
    println!("{refused} refused, {without} without a fault, {causes:?}");
    assert!(refused > 0 && without > 150 && causes.len() >= 5);
    // The contrast: an option that is left out shows.
    let unlike = calm.iter().zip(&results).filter(|(case, with)| {
        let mut paper = (*case).clone();
        paper.options = AxisOptions::default();
        let paper = single(&paper).unwrap();
        !case.options.is_off() && with.as_ref().is_ok_and(|with| bits(with) != bits(&paper))
    });
    let unlike = unlike.count();
    assert!(unlike > 100, "{unlike}");
}

/// Families of their own, cases without one, and cases that fail, all mixed.
#[test]
fn every_case_finds_its_place() {
    let settings: &[&[&str]] = &[
        &[],
        &["controller.law=continuous"],
        &["controller.law=sampled", "transmission.joint=rigid"],
        &["run.solver=dopri5"],
        &["run.duration_s=1.2345"],
        &["controller.law=firmware"],
        &["transmission.no_pull=true"],
        &["carriage.resistance_constant_n=60 carriage.resistance_linear_ns_per_rad=0.01"],
        &["carriage.resistance_constant_n=60 carriage.resistance_opposes_motion=true"],
        &["controller.sample_time_s=0.005"],
        &["motion.travel_mm=-250"],
        &["controller.kp=400"],
        &["run.events=true"],
    ];
    let mut cases = Vec::new();
    for round in 0..3 {
        for sets in settings {
            let sets: Vec<&str> = ["controller.law=quantised"]
                .iter()
                .chain(*sets)
                .copied()
                .collect();
            let mut case = case("paper-2", &sets);
            case.controller.gains.ki_per_s += f64::from(round);
            if case.controller.law == Law::Firmware && round != 1 {
                // More than a word can hold.
                case.controller.gains.kp = 9_000.0;
            }
            case.run.events = false;
            cases.push(case);
        }
    }
    assert_same(&cases, threads(2));
    let results = figures(&cases, threads(1)).unwrap();
    let errors: Vec<_> = results
        .iter()
        .filter_map(|result| result.as_ref().err())
        .collect();
    assert_eq!(errors.len(), 2, "{errors:?}");
}

#[test]
fn more_samples_than_are_kept() {
    let sets = ["controller.law=quantised controller.sample_time_s=0.00002"];
    assert_same(&drawn(&case("paper-2", &sets), 290, 4), threads(1));
}

#[test]
fn single_runs_and_threads_give_the_same() {
    let case_2 = case("paper-2", &["controller.law=quantised"]);
    let case_4 = case("paper-4", &["controller.law=firmware"]);
    let cases = [
        drawn(&case_2, 0, 5),
        drawn(&case_4, 5, 5),
        drawn(&case_2, 10, 5),
    ]
    .concat();
    let mut runs = Runs::new();
    let alone: Vec<_> = cases
        .iter()
        .map(|case| runs.single(case).unwrap())
        .collect();
    for (case, figures) in cases.iter().zip(&alone) {
        assert_eq!(*figures, single(case).unwrap());
    }
    let together = figures(&cases, threads(2)).unwrap();
    assert_eq!(Vec::from_iter(together.into_iter().flatten()), alone);
}

/// Tables that are kept are those of the right axis, whatever came before; more
/// axes than are kept, cases without a family, and few or many at a time.
#[test]
fn runs_keep_the_tables_of_their_axes() {
    let mut runs = Runs::new();
    let mut found = Vec::new();
    let mut cases = Vec::new();
    for (round, number) in [3, 70, 1, 9].into_iter().enumerate() {
        let first = cases.len();
        for mass in ["30", "40", "50", "60", "70"] {
            let mass = format!("carriage.mass_kg={mass}");
            let case = case("paper-2", &["controller.law=quantised", &mass]);
            cases.extend(drawn(&case, 50 * round, number.min(70 / (round + 1))));
        }
        cases.push(case("paper-2", &["run.duration_s=1.2345"]));
        runs.figures(&cases[first..], &mut found);
    }
    assert_eq!(found.len(), cases.len());
    for (case, found) in cases.iter().zip(found) {
        let mut case = case.clone();
        case.run.events = false;
        assert_eq!(found.unwrap(), single(&case).unwrap());
    }
}

/// A resistance that drives the carriage leads out of the numbers. Without a
/// joint, which looks at δ, the lanes once went on with infinite figures.
#[test]
fn what_overflows_fails_in_a_lane_too() {
    const STEP_NS: u64 = 1_000_000_000;
    let case = case("paper-2", &["transmission.joint=rigid"]);
    let mut axis = case.axis;
    axis.motor.torque_constant_nm_per_a = 1e-6;
    (axis.motor.resistance_ohm, axis.motor.inductance_h) = (1e-3, 1e-3);
    axis.carriage.resistance.linear_ns_per_rad = -5.5;
    axis.transmission.screw_pitch_m_per_rad = 1e-3;
    axis.transmission.gear_ratio = 1.0;
    let extremes = ExtremesSettings {
        motion: case.motion.clone(),
        settling_band_m: 1e-4,
    };
    let mut lane = Batch::new(One, &axis, &Surroundings::default(), &[STEP_NS]).unwrap();
    lane.start(&[LaneSetup {
        backlash_half_rad: 0.0,
        extremes: extremes.clone(),
    }]);
    let mut plant = Plant::new(&axis, Solver::Exact);
    let mut seen = Extremes::new(extremes);
    let mut alone = Ok(());
    for step in 1..1000 {
        alone = plant.advance(&Drive::Held(1.0), step * STEP_NS, &mut seen);
        if lane.group(0).advance(0, 1.0, case.motion.travel_m(), 0) {
            lane.catch_up(true);
        }
        lane.look_back();
        assert_eq!(lane.extremes_of(0).err(), alone.err(), "{step}");
        if alone.is_err() {
            break;
        }
    }
    assert!(alone.is_err());
}

/// The comparison sees a last bit: another gain in its last place is not the
/// same run.
#[test]
fn the_last_bit_of_a_gain_shows() {
    let case = case("paper-2", &["controller.law=sampled"]);
    let cases = drawn(&case, 0, 8);
    let mut others = cases.clone();
    for other in &mut others {
        other.controller.gains.kp = other.controller.gains.kp.next_up();
    }
    let (ours, theirs) = [&cases, &others]
        .map(|cases| figures(cases, threads(1)).unwrap())
        .into();
    for (ours, theirs) in ours.iter().flatten().zip(theirs.iter().flatten()) {
        assert_ne!(bits(ours), bits(theirs));
    }
}

/// A run that takes too much ends with the same words alone and side by side; one
/// that may take it has the figures of a run without a limit, to the last bit.
#[test]
fn work_is_limited_alike() {
    // Time constants of a ten-thousandth of a sample.
    let stiff = "carriage.resistance_linear_ns_per_rad=1e7";
    let short = "run.duration_s=0.02";
    let settings: [&[&str]; 4] = [
        &["controller.law=quantised"],
        &["controller.law=quantised", stiff, short],
        &["controller.law=continuous", stiff, short],
        &["controller.law=firmware", "run.solver=dopri5"],
    ];
    for sets in settings {
        let mut free = case("paper-2", sets);
        free.run.events = false;
        let ends = |limit: u64| {
            let mut limited = free.clone();
            limited.run.work_limit = limit;
            let together = figures(&vec![limited.clone(); 3], threads(1)).unwrap();
            let alone = single(&limited);
            for beside in &together {
                let words = |of: &Result<Summary, RunError>| match of {
                    Ok(summary) => Ok(bits(summary)),
                    Err(error) => Err(error.to_string()),
                };
                assert_eq!(words(beside), words(&alone), "{sets:?} {limit}");
            }
            alone
        };
        let RunError::OutOfWork { time_s, work, .. } = ends(3).unwrap_err() else {
            panic!("{sets:?}");
        };
        assert!(work > 3 && time_s < 1.5, "{sets:?}");
        // The contrast: as much as it takes, and no more.
        let all = bits(&ends(free.run.work_limit).unwrap());
        let (mut few, mut enough) = (3, free.run.work_limit);
        while enough - few > 1 {
            let middle = few.midpoint(enough);
            let mut limited = free.clone();
            limited.run.work_limit = middle;
            match single(&limited) {
                Ok(_) => enough = middle,
                Err(_) => few = middle,
            }
        }
        println!("{sets:?}: {enough}");
        assert_eq!(bits(&ends(enough).unwrap()), all, "{sets:?}");
        assert!(ends(few).is_err());
    }
}

/// Runs that lanes cannot take are counted with their reason; the contrast is the same case
/// without the setting, of which none is.
#[test]
fn what_is_made_by_itself_is_counted() {
    const LIMIT: &str = "drive.current_limit_a=20";
    const CURRENT: &str =
        "drive.kind=current drive.amplifier_gain_a_per_v=2 drive.current_limit_a=20";
    const STIFF: &str = "carriage.resistance_linear_ns_per_rad=1e7";
    const MEASURED: &str = "controller.computation_delay_s=\"measured\"";
    const LOAD_ENCODER: &str = "load_encoder.counts_per_rad=1600";
    const COMPENSATED: &str = "load_encoder.counts_per_rad=1600 limits.velocity_mps=2 \
                               limits.acceleration_mps2=20 backlash.compensation=velocity";
    const SUPERVISED: &str = "controller.rest_dead_band_counts=3 limits.saturation_s=0.02 \
                              sequence.disable_s=0.4 inject.encoder_freeze_s=0.3";
    let settings: [(&[&str], Option<OneByOne>); 16] = [
        (&[], None),
        (&["controller.law=continuous"], Some(OneByOne::Continuous)),
        (&["run.solver=dopri5"], Some(OneByOne::Solver)),
        (&[LIMIT], None),
        (&[CURRENT], Some(OneByOne::Surroundings)),
        (
            &[
                "carriage.load_force_n=491",
                "transmission.start=negative_flank",
            ],
            None,
        ),
        // Which fails without a chip, but is counted.
        (&[MEASURED], Some(OneByOne::Delay)),
        (&[COMPENSATED, "backlash.gap=measured"], Some(OneByOne::Gap)),
        // Nobody asks for the gap.
        (&[LOAD_ENCODER, "backlash.gap=measured"], None),
        (&[COMPENSATED], None),
        (&[SUPERVISED], None),
        (&["run.duration_s=1.2345"], None),
        (
            &["controller.sample_time_s=5e-5", "run.rest_window_s=0.3"],
            Some(OneByOne::Rest),
        ),
        (&[STIFF, "run.duration_s=0.02"], Some(OneByOne::Stiff)),
        (&["run.work_limit=3"], Some(OneByOne::Work)),
        // Which acts on rung `firmware` alone.
        (
            &[
                COMPENSATED,
                "backlash.gap=measured",
                "controller.law=quantised",
            ],
            None,
        ),
    ];
    let mut runs = Runs::new();
    for (sets, why) in settings {
        let sets = [&["controller.law=firmware"], sets].concat();
        for number in [1, 5] {
            let mut figures = Vec::new();
            runs.figures(&vec![case("paper-2", &sets); number], &mut figures);
            let expected = why.map(|why| (why, number as u64));
            let expected = BTreeMap::from_iter(expected);
            assert_eq!(runs.take_one_by_one(), expected, "{sets:?} {number}");
        }
    }
}
