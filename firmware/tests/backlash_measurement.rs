//! The measurement of the gap against joints whose gap is known: random gaps,
//! starts and encoders, behind a motor that stands where it is told to and
//! behind one that lags, sticks and needs a controller.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops where its setup fails"
)]

use firmware::backlash_measurement::{CREEP_MAX, RATIO_MAX, SPEED_MAX};
use firmware::refusal::What;
use firmware::{
    BacklashMeasurement, BacklashMeasurementError, BacklashMeasurementRun, Creep, Detection, Gap,
    Next, Observed, Refusal, SetpointSource,
};
use proptest::prelude::*;

/// One motor count in the unit of the model.
const ONE: i64 = 1 << 16;

/// Codes that break the motor away from its own friction, and the load.
const MOTOR_FRICTION: i64 = 40;
const LOAD_FRICTION: i64 = 100;

#[derive(Debug, Clone, Copy)]
enum Motor {
    /// Stands where the reference is; its code shows what it pushes.
    Ideal,
    /// PI control of a motor with friction, `40 + 100` codes with the load.
    Lagging { error_sum: i64 },
}

/// A motor and a load that moves only while it is pushed. Positions in 2^−16
/// motor counts, so that flanks lie anywhere between counts.
#[derive(Debug, Clone, Copy)]
struct Axis {
    kind: Motor,
    motor: i64,
    load: i64,
    half_gap: i64,
    /// Motor counts per load count, 2^−16.
    ratio: i64,
    /// Position of the motor on the wheel of 2^32 counts, and the load.
    wheel: [i32; 2],
    code: i64,
}

impl Axis {
    fn observed(&self) -> Observed {
        let counts = |position: i64, count: i64, wheel: i32| {
            let counts = i32::try_from(position.div_euclid(count)).expect("a short way");
            wheel.wrapping_add(counts)
        };
        Observed {
            position: counts(self.motor, ONE, self.wheel[0]),
            load_position: Some(counts(self.load, self.ratio, self.wheel[1])),
            code: i32::try_from(self.code).expect("small"),
        }
    }

    /// Tells whether the motor stands on the flank that pushes in `direction`.
    fn on_flank(&self, direction: i64) -> bool {
        (self.motor - self.load) * direction >= self.half_gap
    }

    /// One sample with this reference.
    fn follow(&mut self, reference: i32) {
        let reference = reference.wrapping_sub(self.wheel[0]);
        match &mut self.kind {
            Motor::Ideal => {
                let goal = i64::from(reference) * ONE;
                let direction = (goal - self.motor).signum();
                self.motor = goal;
                if direction != 0 {
                    let load = i64::from(self.on_flank(direction)) * LOAD_FRICTION;
                    self.code = direction * (MOTOR_FRICTION + load);
                }
            }
            Motor::Lagging { error_sum } => {
                let error = i64::from(reference) - self.motor.div_euclid(ONE);
                *error_sum += error;
                self.code = 10 * error + *error_sum;
                let direction = self.code.signum();
                let loaded = self.on_flank(direction);
                let friction = MOTOR_FRICTION + i64::from(loaded) * LOAD_FRICTION;
                let way = (self.code.abs() - friction).max(0) * (ONE / 64);
                let flank = self.load + direction * self.half_gap;
                let free = (flank - self.motor) * direction;
                let way = if loaded { way } else { way.min(free) };
                self.motor += direction * way;
            }
        }
        let (low, high) = (self.motor - self.half_gap, self.motor + self.half_gap);
        self.load = self.load.clamp(low, high);
    }

    /// Runs the routine to its end; `disturb` sees every sample before it.
    fn home(
        &mut self,
        backlash_measurement: &BacklashMeasurement,
        mut disturb: impl FnMut(u32, &mut Self),
    ) -> Result<Gap, BacklashMeasurementError> {
        let mut run = backlash_measurement.start(self.observed().position);
        for k in 0..400_000 {
            disturb(k, self);
            match run.next(&self.observed()) {
                Next::Setpoint(setpoint) => {
                    assert_eq!(run.result(), None);
                    self.follow(setpoint.position);
                }
                Next::Stretch(_) => panic!("single setpoints"),
                Next::Last(held) => {
                    let result = run.result().expect("ended");
                    for _ in 0..3 {
                        assert_eq!(run.next(&self.observed()), Next::Last(held), "held");
                    }
                    assert_eq!(run.result(), Some(result), "and the result with it");
                    return result;
                }
                Next::Underrun => panic!("the routine always has a setpoint"),
            }
        }
        panic!("the routine does not end");
    }
}

fn creep() -> Creep {
    Creep {
        speed: 1 << 14,
        longest_counts: 2_000,
        pause_samples: 50,
        tolerance_counts: 3,
    }
}

fn by_encoder(ratio: i64) -> BacklashMeasurement {
    let ratio = u32::try_from(ratio).expect("small");
    BacklashMeasurement::accept(creep(), Detection::LoadEncoder { counts: 2, ratio })
        .expect("accepted")
}

fn by_effort() -> BacklashMeasurement {
    // Free creep takes up to 60 codes, the load 140.
    let detection = Detection::Effort {
        codes: 100,
        samples: 5,
    };
    BacklashMeasurement::accept(creep(), detection).expect("accepted")
}

fn undisturbed(_: u32, _: &mut Axis) {}

fn motors() -> impl Strategy<Value = Motor> {
    prop_oneof![Just(Motor::Ideal), Just(Motor::Lagging { error_sum: 0 })]
}

fn axes() -> impl Strategy<Value = Axis> {
    let gap = prop_oneof![Just(0), 0..4 * ONE, 0..400 * ONE];
    let wheel = prop_oneof![Just(i32::MAX), Just(i32::MIN), any::<i32>()];
    (
        motors(),
        -100..100_i64,
        gap,
        0..=ONE,
        ONE / 50..12 * ONE,
        [wheel.clone(), wheel],
    )
        .prop_map(|(kind, start, half_gap, part, ratio, wheel)| Axis {
            kind,
            motor: start * ONE,
            load: start * ONE + half_gap * (2 * part - ONE) / ONE,
            half_gap,
            ratio,
            wheel,
            code: 0,
        })
}

/// Measured less true half gap [2^−16 counts].
fn excess(axis: &Axis, gap: Gap) -> i64 {
    i64::from(gap.half_counts) * ONE - axis.half_gap
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_load_encoder_gives_the_gap(mut axis in axes()) {
        let gap = axis.home(&by_encoder(axis.ratio), undisturbed);
        let excess = excess(&axis, gap.expect("measured"));
        prop_assert!((-ONE..=2 * ONE).contains(&excess), "{excess}");
        prop_assert!(axis.on_flank(-1), "left on the − flank");
    }

    #[test]
    fn the_effort_gives_the_gap(mut axis in axes()) {
        let gap = axis.home(&by_effort(), undisturbed);
        let excess = excess(&axis, gap.expect("measured"));
        prop_assert!((-ONE..=3 * ONE / 2).contains(&excess), "{excess}");
        prop_assert!(axis.on_flank(-1), "left on the − flank");
    }
}

/// A gap of ±60.3 counts, the load somewhere in it, four motor counts to one of the load.
fn axis(kind: Motor, load: i64) -> Axis {
    Axis {
        kind,
        motor: 0,
        load,
        half_gap: 60 * ONE + ONE * 3 / 10,
        ratio: 4 * ONE,
        wheel: [0, 0],
        code: 0,
    }
}

const LAGGING: Motor = Motor::Lagging { error_sum: 0 };

#[test]
fn one_creep_from_where_the_joint_happens_to_stand_gives_another_gap() {
    let (mut worst_of_one, mut worst) = (0, 0);
    for kind in [Motor::Ideal, LAGGING] {
        for load in (-60..=60).step_by(5) {
            // The same sight of the load, but the way of a single creep for the gap.
            let mut one_way = axis(kind, load * ONE);
            let mut position = 0;
            while one_way.observed().load_position
                < axis(kind, load * ONE)
                    .observed()
                    .load_position
                    .map(|l| l + 2)
            {
                position += 1;
                for _ in 0..4 {
                    one_way.follow(position);
                }
            }
            let way = one_way.motor - 2 * one_way.ratio;
            worst_of_one = worst_of_one.max((way / 2 - one_way.half_gap).abs());

            for backlash_measurement in [by_encoder(4 * ONE), by_effort()] {
                let mut axis = axis(kind, load * ONE);
                let gap = axis
                    .home(&backlash_measurement, undisturbed)
                    .expect("measured");
                worst = worst.max(excess(&axis, gap).abs());
            }
        }
    }
    println!(
        "half gap wrong by {} and {} /65536 counts",
        worst_of_one, worst
    );
    assert!(worst <= 2 * ONE, "{worst}");
    assert!(worst_of_one > 50 * ONE, "{worst_of_one}");
}

#[test]
fn a_load_that_never_follows_ends_the_creep() {
    for kind in [Motor::Ideal, LAGGING] {
        for backlash_measurement in [by_encoder(4 * ONE), by_effort()] {
            let mut axis = axis(kind, 0);
            axis.half_gap = 1_000_000 * ONE;
            let error = axis
                .home(&backlash_measurement, undisturbed)
                .expect_err("a broken joint");
            assert_eq!(
                error,
                BacklashMeasurementError::NeverFollowed { counts: 2_000 }
            );
            let beyond = (axis.motor - 2_000 * ONE).abs();
            assert!(beyond <= 3 * ONE, "{beyond}: further than it may");
        }
    }
}

/// Runs the routine; in one leg (0 to 3) something looks like the load while
/// the joint is open: the load moves by itself, or the code is that of a push.
fn false_sight(
    backlash_measurement: &BacklashMeasurement,
    leg: usize,
    moves: bool,
) -> Result<Gap, BacklashMeasurementError> {
    let (mut opened, mut open_for) = (0, 0);
    axis(Motor::Ideal, 0).home(backlash_measurement, |_, axis| {
        let open = !axis.on_flank(1) && !axis.on_flank(-1);
        opened += usize::from(open && open_for == 0);
        open_for = if open { open_for + 1 } else { 0 };
        if opened == leg + 1 && (40..60).contains(&open_for) {
            let direction = [1, -1, 1, -1][leg];
            if moves {
                axis.load += direction * ONE;
            } else {
                axis.code = direction * LOAD_FRICTION;
            }
        }
    })
}

#[test]
fn what_is_taken_for_the_load_in_one_leg_makes_the_gaps_disagree() {
    for (backlash_measurement, moves) in [(by_encoder(4 * ONE), true), (by_effort(), false)] {
        for leg in 0..4 {
            let error =
                false_sight(&backlash_measurement, leg, moves).expect_err("one engagement is none");
            let BacklashMeasurementError::Disagree {
                full_counts: [first, second, third],
                ..
            } = error
            else {
                panic!("leg {leg}: {error}");
            };
            println!("leg {leg}: {first}, {second}, {third}");
            assert_eq!(
                error.to_string(),
                format!(
                    "three crossings gave gaps of {first}, {second} and {third} counts; \
                     they may differ by 3"
                )
            );
            if leg == 1 {
                // What the third gap is for: the other two agree.
                assert!((first - second).abs() <= 3 && first < 100);
            }
        }
    }
}

#[test]
fn a_wrong_ratio_of_the_encoders_shows_as_a_negative_gap() {
    let mut axis = axis(Motor::Ideal, 0);
    axis.half_gap = 0;
    let error = axis.home(&by_encoder(16 * ONE), undisturbed);
    let error = error.expect_err("the load seems to move four times as far");
    assert!(matches!(error, BacklashMeasurementError::Negative { full_counts: [g, ..] } if g < -3));
}

#[test]
fn a_load_encoder_that_is_missing_or_fails_ends_the_routine() {
    let mut run: BacklashMeasurementRun = by_encoder(ONE).start(7);
    let blind = Observed::default();
    let Next::Last(held) = run.next(&blind) else {
        panic!("nothing to creep for");
    };
    assert_eq!(held.position, 7);
    assert_eq!(
        run.result(),
        Some(Err(BacklashMeasurementError::NoLoadEncoder))
    );

    // The effort needs none.
    assert!(matches!(
        by_effort().start(7).next(&blind),
        Next::Setpoint(_)
    ));
}

#[test]
fn the_reference_creeps_evenly_and_rests_in_between() {
    let mut axis = axis(Motor::Ideal, 0);
    let mut run = by_encoder(4 * ONE).start(0);
    let mut references = vec![0];
    while let Next::Setpoint(setpoint) = run.next(&axis.observed()) {
        assert_eq!((setpoint.velocity, setpoint.acceleration), (0, 0));
        references.push(setpoint.position);
        axis.follow(setpoint.position);
    }
    // 1/4 count a sample: one count every four samples, never two at once.
    let steps: Vec<i32> = references.windows(2).map(|two| two[1] - two[0]).collect();
    assert!(steps.iter().all(|step| step.abs() <= 1));
    let rests = steps
        .split(|step| *step != 0)
        .filter(|rest| rest.len() > 4)
        .map(<[i32]>::len);
    for rest in rests {
        assert!((50..60).contains(&rest), "{rest}");
    }
    let turns: Vec<i32> = steps.into_iter().filter(|step| *step != 0).collect();
    let legs = turns.chunk_by(|a, b| a == b).map(<[i32]>::len);
    assert_eq!(legs.count(), 4);
}

#[test]
fn settings_out_of_range_are_refused_with_their_value() {
    let effort = |codes, samples| Detection::Effort { codes, samples };
    let encoder = |counts, ratio| Detection::LoadEncoder { counts, ratio };
    let good = effort(1, 1);
    let refusal = |what, value: u32, most: u32| {
        let (value, least, most) = (value.into(), 1, most.into());
        Err(Refusal {
            what,
            value,
            least,
            most,
        })
    };
    for speed in [0, SPEED_MAX + 1] {
        let refused = BacklashMeasurement::accept(Creep { speed, ..creep() }, good);
        assert_eq!(refused, refusal(What::CreepSpeed, speed, SPEED_MAX));
    }
    for counts in [0, CREEP_MAX + 1] {
        let long = Creep {
            longest_counts: counts,
            ..creep()
        };
        let refused = BacklashMeasurement::accept(long, good);
        assert_eq!(refused, refusal(What::LongestCreep, counts, CREEP_MAX));
    }
    for ratio in [0, RATIO_MAX + 1] {
        let refused = BacklashMeasurement::accept(creep(), encoder(1, ratio));
        assert_eq!(refused, refusal(What::LoadRatio, ratio, RATIO_MAX));
    }
    for detection in [encoder(0, 1), effort(0, 1), effort(1, 0)] {
        let refused = BacklashMeasurement::accept(creep(), detection);
        assert_eq!(refused, refusal(What::Detection, 0, u32::MAX));
        assert_eq!(
            refused.expect_err("no threshold").to_string(),
            "a detection with a threshold of 0 sees a load where none is; it must be at least 1"
        );
    }
    let widest = Creep {
        speed: SPEED_MAX,
        longest_counts: CREEP_MAX,
        pause_samples: 0,
        tolerance_counts: u32::MAX,
    };
    assert!(BacklashMeasurement::accept(widest, encoder(u32::MAX, RATIO_MAX)).is_ok());
    let still = Creep {
        speed: 0,
        ..creep()
    };
    let refused = BacklashMeasurement::accept(still, good);
    assert_eq!(
        refused.expect_err("no speed").to_string(),
        "a creep of 0·2^-16 counts/sample is not supported; it must lie between 1 and 16777216"
    );
}

#[test]
fn the_memory_is_small() {
    assert!(
        size_of::<BacklashMeasurementRun>() <= 160,
        "{}",
        size_of::<BacklashMeasurementRun>()
    );
}
