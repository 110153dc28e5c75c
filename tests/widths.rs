//! Runs side by side give the bits of the single run, with every set of
//! instructions that the machine has: state after every step, and extremes,
//! which a batch may look at late, whether they are asked for after every step
//! or once.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use bench_tests::draw::Draw;
use bench_tests::random_case::random_case;
use bench_tests::{case, reference_folder};
use fearless_simd::{Level, Simd};
use hil_core::case::{Case, Law};
use hil_core::controllers::{Controller, IoKind};
use hil_core::message::{Measurement, Steps, whole};
use plant::{
    Batch, Control, Drive, Eight, Extremes, ExtremesSettings, Four, Joint, LaneSetup, Motion, One,
    Plant, PlantError, Single, Solver, Start, State, Width,
};

/// One run after a step as seen from outside, in bits.
#[derive(Debug, Clone, PartialEq)]
struct Look {
    state: [u64; 5],
    acceleration: u64,
    extremes: Result<[u64; 12], PlantError>,
}

impl Look {
    fn new(state: &State, acceleration_mps2: f64, extremes: Result<Extremes, PlantError>) -> Self {
        let state = [
            state.beta_rad,
            state.beta_dot_radps,
            state.epsilon_rad,
            state.epsilon_dot_radps,
            state.current_a,
        ];
        Self {
            state: state.map(f64::to_bits),
            acceleration: acceleration_mps2.to_bits(),
            extremes: Self::bits_of(extremes),
        }
    }

    fn bits_of(extremes: Result<Extremes, PlantError>) -> Result<[u64; 12], PlantError> {
        extremes.map(|e| {
            [
                e.peak_abs_acceleration_mps2.to_bits(),
                e.peak_following_error_m.to_bits(),
                e.peak_motor_following_error_m.to_bits(),
                e.peak_abs_current_a.to_bits(),
                e.peak_abs_voltage_v.to_bits(),
                e.voltage_limited_s.to_bits(),
                u64::from(e.last_outside_band_s.is_some()),
                e.last_outside_band_s.unwrap_or(0.0).to_bits(),
                e.contact_changes,
                e.impacts,
                e.hardest_impact_radps.to_bits(),
                e.joint_loss_j.to_bits(),
            ]
        })
    }
}

impl Look {
    /// The numbers that differ, in words.
    fn differs_from(&self, expected: &Self) -> String {
        let numbers = |look: &Self| {
            let mut numbers = look.state.to_vec();
            numbers.push(look.acceleration);
            match look.extremes {
                Ok(extremes) => numbers.extend(extremes),
                Err(_) => numbers.push(u64::MAX),
            }
            numbers
        };
        let (found, expected) = (numbers(self), numbers(expected));
        let pairs = found.iter().zip(&expected).enumerate();
        let words = pairs.filter(|(_, (f, e))| f != e).map(|(place, (f, e))| {
            let (f, e) = (f64::from_bits(*f), f64::from_bits(*e));
            format!("[{place}] {f:e} for {e:e}, ")
        });
        words.collect()
    }
}

/// Lanes of one axis: all cases share it but for b.
struct Group {
    name: String,
    lanes: Vec<Case>,
}

impl Group {
    fn period_ns(&self) -> u64 {
        self.lanes[0].controller.sample_time_ns.unwrap()
    }

    fn delay_ns(&self) -> u64 {
        let delay = self.lanes[0].controller.computation_delay;
        delay.fixed_ns().unwrap()
    }

    /// Lengths of the steps of a sample; the last one is under the new code.
    fn lengths_ns(&self) -> Vec<u64> {
        let period_ns = self.period_ns();
        match self.delay_ns() {
            0 => vec![period_ns],
            d if d == period_ns => vec![period_ns],
            d => vec![d, period_ns - d],
        }
    }

    /// The first step of a sample is under the code before.
    fn is_delayed(&self) -> bool {
        self.delay_ns() > 0
    }

    fn samples(&self) -> u64 {
        self.lanes[0].run.duration_ns / self.period_ns()
    }
}

fn backlash(case: &Case) -> f64 {
    case.axis.transmission.joint.backlash_half_rad()
}

fn settings(case: &Case) -> ExtremesSettings {
    ExtremesSettings {
        motion: case.motion.clone(),
        settling_band_m: case.run.settling_band_um * 1e-6,
    }
}

/// The voltage that the code of a sample gives.
fn voltage_v(case: &Case, law: &mut Controller, tick: u64, beta_rad: f64) -> f64 {
    let alpha_rad = beta_rad / case.axis.transmission.gear_ratio;
    let measured = Measurement {
        tick,
        position_counts: Steps::Whole(whole(case.encoder.count(alpha_rad))),
        load_counts: None,
    };
    let code = law.step(measured).dac_code;
    case.amplifier.command(case.dac.output_v(code.real()))
}

fn controller(case: &Case) -> Controller {
    Controller::new(case, IoKind::Direct).unwrap().unwrap()
}

fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// The single runs, all steps of all samples one after the other.
fn single(group: &Group) -> Vec<Vec<Look>> {
    let (lengths_ns, delayed) = (group.lengths_ns(), group.is_delayed());
    let of = |case: &Case| {
        let mut plant = Plant::within(&case.axis, &case.surroundings(), Solver::Exact);
        let mut extremes = Extremes::new(settings(case));
        let mut law = controller(case);
        let mut looks = Vec::new();
        let (mut old_v, mut result) = (0.0, Ok(()));
        for tick in 0..group.samples() {
            let new_v = voltage_v(case, &mut law, tick, plant.state().beta_rad);
            for (phase, length_ns) in lengths_ns.iter().enumerate() {
                let voltage_v = if phase == 0 && delayed { old_v } else { new_v };
                if result.is_ok() {
                    let until_ns = plant.time_ns() + length_ns;
                    result = plant.advance(&Drive::Held(voltage_v), until_ns, &mut extremes);
                }
                let (state, acceleration_mps2) = (plant.state(), plant.acceleration_mps2());
                looks.push(Look::new(
                    &state,
                    acceleration_mps2,
                    result.map(|()| extremes.clone()),
                ));
            }
            old_v = new_v;
        }
        looks
    };
    group.lanes.iter().map(of).collect()
}

/// After how many steps extremes are asked for; always at the end.
const RHYTHMS: [usize; 3] = [1, 61, usize::MAX];

/// Runs the group on one width and compares every step; words for the first
/// difference.
#[inline(always)]
fn compare<W: Width>(width: W, group: &Group, expected: &[Vec<Look>]) -> Result<(), String> {
    for rhythm in RHYTHMS {
        compare_at(width, group, expected, rhythm)
            .map_err(|words| format!("extremes after {rhythm} steps: {words}"))?;
    }
    Ok(())
}

#[inline(always)]
fn compare_at<W: Width>(
    width: W,
    group: &Group,
    expected: &[Vec<Look>],
    rhythm: usize,
) -> Result<(), String> {
    let (lengths_ns, delayed) = (group.lengths_ns(), group.is_delayed());
    let case = &group.lanes[0];
    let mut batch = Batch::new(width, &case.axis, &case.surroundings(), &lengths_ns).unwrap();
    for (cases, expected) in group.lanes.chunks(W::LANES).zip(expected.chunks(W::LANES)) {
        let setups = cases.iter().map(|case| LaneSetup {
            backlash_half_rad: backlash(case),
            extremes: settings(case),
        });
        batch.start(&setups.collect::<Vec<_>>());
        let mut laws: Vec<_> = cases.iter().map(controller).collect();
        let mut beta = W::array(0.0);
        let (mut old, mut new) = (W::array(0.0), W::array(0.0));
        let (mut step, mut time_ns) = (0, 0);
        for tick in 0..group.samples() {
            width.store(batch.group(0).beta_rad(), &mut beta);
            for (lane, (case, law)) in cases.iter().zip(&mut laws).enumerate() {
                new.as_mut()[lane] = voltage_v(case, law, tick, beta.as_ref()[lane]);
            }
            for (phase, &length_ns) in lengths_ns.iter().enumerate() {
                let voltage = if phase == 0 && delayed { &old } else { &new };
                let end_s = seconds(time_ns) + seconds(length_ns);
                let mut command = W::array(0.0);
                for (lane, case) in cases.iter().enumerate() {
                    command.as_mut()[lane] = case.motion.at(end_s).displacement_m;
                }
                let (voltage_v, command_m) = (width.load(voltage), width.load(&command));
                batch.group(0).advance(phase, voltage_v, command_m, 0);
                while batch.is_held_up(0) {
                    batch.catch_up(true);
                }
                time_ns += length_ns;
                let mut acceleration = W::array(0.0);
                width.store(batch.group(0).acceleration_mps2(), &mut acceleration);
                let asked = (step + 1) % rhythm == 0 || step + 1 == expected[0].len();
                for (lane, expected) in expected.iter().enumerate() {
                    let mut found = Look::new(
                        &batch.state(lane),
                        acceleration.as_ref()[lane],
                        Err(PlantError::NotAffine),
                    );
                    found.extremes = if asked {
                        batch.look_back();
                        Look::bits_of(batch.extremes_of(lane))
                    } else {
                        expected[step].extremes
                    };
                    if found != expected[step] {
                        return Err(format!(
                            "{}: lane {lane} with b = {:e}, sample {tick}, step {phase}: {}",
                            group.name,
                            backlash(&cases[lane]),
                            found.differs_from(&expected[step])
                        ));
                    }
                }
                step += 1;
            }
            old = new;
        }
    }
    Ok(())
}

fn with_instructions<S: Simd>(
    simd: S,
    group: &Group,
    expected: &[Vec<Look>],
) -> Result<(), String> {
    simd.vectorize(
        #[inline(always)]
        || {
            compare(Single(simd), group, expected)?;
            compare(Four(simd), group, expected)?;
            compare(Eight(simd), group, expected)
        },
    )
}

/// A comparison with its name.
fn compare_with<S: Simd + Sync + 'static>(simd: S) -> Compare {
    Box::new(move |group, expected| with_instructions(simd, group, expected))
}

type Compare = Box<dyn Fn(&Group, &[Vec<Look>]) -> Result<(), String> + Sync>;

/// All widths of this machine.
fn widths() -> Vec<(&'static str, Compare)> {
    let mut widths: Vec<(&'static str, Compare)> =
        vec![("one", Box::new(|group, e| compare(One, group, e)))];
    let level = Level::new();
    #[cfg(target_arch = "x86_64")]
    {
        let (sse2, sse4_2) = (level.as_sse2(), level.as_sse4_2());
        widths.extend(sse2.map(|simd| ("sse2", compare_with(simd))));
        widths.extend(sse4_2.map(|simd| ("sse4.2", compare_with(simd))));
        widths.extend(level.as_avx2().map(|simd| ("avx2", compare_with(simd))));
        widths.extend(level.as_avx512().map(|simd| ("avx512", compare_with(simd))));
    }
    #[cfg(target_arch = "aarch64")]
    widths.extend(level.as_neon().map(|simd| ("neon", compare_with(simd))));
    assert!(widths.len() > 1, "{level:?}");
    widths
}

/// True if runs of this axis do not go side by side: their work has to be counted.
fn is_stiff(group: &Group) -> bool {
    let case = &group.lanes[0];
    let made = Batch::new(One, &case.axis, &case.surroundings(), &group.lengths_ns());
    matches!(made, Err(PlantError::TooStiff { .. }))
}

/// Compares on a thread of its own: the frames of eight lanes do not fit the
/// stack of a test where nothing is optimised.
fn check(groups: &[Group]) {
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .stack_size(32 << 20)
            .spawn_scoped(scope, || check_here(groups))
            .unwrap()
            .join()
            .unwrap();
    });
}

fn check_here(groups: &[Group]) {
    let widths = widths();
    let names: Vec<_> = widths.iter().map(|(name, _)| *name).collect();
    let mut faults = Vec::new();
    let (mut runs, mut changes) = (0, 0);
    for group in groups {
        let expected = single(group);
        runs += expected.len();
        for run in &expected {
            changes += run.last().map_or(0, |look| match look.extremes {
                Ok(extremes) => extremes[8],
                Err(_) => 0,
            });
        }
        for (name, compare) in &widths {
            if let Err(fault) = compare(group, &expected) {
                faults.push(format!("{name}: {fault}"));
            }
        }
    }
    println!("{runs} runs with {changes} contact changes on {names:?}");
    assert!(faults.is_empty(), "{} faults: {faults:#?}", faults.len());
    assert!(changes > 100);
}

/// The first `number` draws of W4 on a variant of simulation 2; every second
/// one travels elsewhere.
fn draws(name: &str, sets: &[&str], number: usize) -> Group {
    let sets = [&["controller.law=quantised"], sets].concat();
    let template = case("paper-2", &sets);
    let path = reference_folder().join("w4-first-300.csv");
    let mut reader = csv::Reader::from_path(path).unwrap();
    let records = reader.deserialize::<(f64, f64, f64)>().take(number);
    let lanes = records.enumerate().map(|(i, record)| {
        let (backlash_half_rad, kp, kd_s) = record.unwrap();
        let mut case = template.clone();
        if let Joint::Elastic(joint) = &mut case.axis.transmission.joint
            && joint.backlash_half_rad > 0.0
        {
            joint.backlash_half_rad = backlash_half_rad;
        }
        (case.controller.gains.kp, case.controller.gains.kd_s) = (kp, kd_s);
        if i % 2 == 1 {
            let motion = case.motion;
            case.motion =
                Motion::new(-0.9 * motion.travel_m(), motion.intervals_s().unwrap()).unwrap();
            case.run.settling_band_um *= 10.0;
        }
        case
    });
    Group {
        name: name.to_owned(),
        lanes: lanes.collect(),
    }
}

#[test]
fn w4_has_the_bits_of_the_single_run() {
    check(&[draws("w4", &[], 300)]);
}

#[test]
fn variants_have_the_bits_of_the_single_run() {
    let variants: [(&str, &str); 20] = [
        ("delay", "controller.computation_delay_s=0.0003"),
        ("whole delay", "controller.computation_delay_s=0.001"),
        ("0.1 ms", "controller.sample_time_s=1e-4"),
        (
            "7 us",
            "controller.sample_time_s=0.000333 controller.computation_delay_s=0.000007",
        ),
        ("no gap", "transmission.backlash_half_deg=0"),
        ("rigid", "transmission.joint=rigid"),
        ("no pull", "transmission.no_pull=true"),
        ("undamped", "transmission.damping_nms_per_rad=0"),
        (
            "friction",
            "carriage.resistance_constant_n=60 carriage.resistance_linear_ns_per_rad=0.5 \
                 carriage.resistance_opposes_motion=true",
        ),
        (
            "friction, rigid",
            "transmission.joint=rigid carriage.resistance_constant_n=60 \
                 carriage.resistance_opposes_motion=true",
        ),
        (
            "load",
            "carriage.resistance_constant_n=-200 carriage.resistance_linear_ns_per_rad=3",
        ),
        (
            "load, rigid",
            "transmission.joint=rigid carriage.resistance_constant_n=200 \
                 carriage.resistance_linear_ns_per_rad=3",
        ),
        ("limited", "drive.voltage_limit_v=40"),
        ("current limit", "drive.current_limit_a=12"),
        (
            "both limits",
            "drive.current_limit_a=9 drive.voltage_limit_v=45 controller.computation_delay_s=0.0003",
        ),
        (
            "current limit, friction",
            "drive.current_limit_a=9 drive.voltage_limit_v=30 carriage.resistance_constant_n=60 \
                 carriage.resistance_opposes_motion=true",
        ),
        (
            "hanging",
            "carriage.load_force_n=491 transmission.start=negative_flank",
        ),
        (
            "hanging, friction",
            "carriage.load_force_n=491 transmission.start=negative_flank \
                 carriage.resistance_constant_n=100 carriage.resistance_opposes_motion=true",
        ),
        (
            "held by friction",
            "carriage.load_force_n=90 transmission.start=positive_flank \
                 carriage.resistance_constant_n=100 carriage.resistance_opposes_motion=true",
        ),
        ("on a flank", "transmission.start=positive_flank"),
    ];
    check(&variants.map(|(name, sets)| draws(name, &[sets], 20)));
}

/// A load at all times, a start on a flank and a limit of the current, each in some cases.
fn surround(draw: &mut Draw, case: &mut Case) {
    if draw.chance(0.3) {
        case.load_force_n = case.axis.carriage.mass_kg * draw.between(-10.0, 10.0);
    }
    if draw.chance(0.3) {
        case.start = match draw.chance(0.5) {
            true => Start::PositiveFlank,
            false => Start::NegativeFlank,
        };
    }
    if draw.chance(0.3) {
        let most_a = case.amplifier.voltage_limit_v / case.axis.motor.resistance_ohm;
        let current_limit_a = Some(most_a * draw.decades(1e-3, 1.0));
        case.amplifier.control = Control::Voltage { current_limit_a };
    }
}

/// Over all that the equations allow; the lanes differ in b, gains and travel.
#[test]
fn random_axes_have_the_bits_of_the_single_run() {
    let group = |seed| {
        let draw = &mut Draw::new(seed);
        let mut first = random_case(draw, &[Law::Quantised, Law::Firmware], (50e-6, 20e-3));
        surround(draw, &mut first);
        let lane = |_| {
            let mut case = first.clone();
            if let Joint::Elastic(joint) = &mut case.axis.transmission.joint
                && joint.backlash_half_rad > 0.0
            {
                joint.backlash_half_rad = draw.decades(1e-15, 0.17);
            }
            case.controller.gains.kp *= draw.between(0.3, 1.0);
            let motion = case.motion;
            case.motion = Motion::new(
                motion.travel_m() * draw.between(-1.0, 1.0),
                motion.intervals_s().unwrap(),
            )
            .unwrap();
            if Controller::new(&case, IoKind::Direct).is_err() {
                case.controller.law = Law::Quantised;
            }
            case
        };
        Group {
            name: format!("random {seed}"),
            lanes: (0..9).map(lane).collect(),
        }
    };
    let (stiff, groups): (Vec<_>, Vec<_>) = (0..90).map(group).partition(is_stiff);
    assert!((1..=20).contains(&stiff.len()), "{} are stiff", stiff.len());
    check(&groups);
}
