//! The backlash compensation of backlash against its exact parabola: the offset at every
//! sample, the limits, the order of moves; and in a loop that overshoots,
//! beside a backlash compensation that follows the error.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use firmware::backlash_compensation::{HALF_GAP_MAX, SAMPLES_MAX};
use firmware::refusal::What;
use firmware::{BacklashCompensation, BacklashCompensationState, Room, Setpoint, Trigger};
use proptest::prelude::*;

/// One count per sample, and per sample², in the unit of [`Room`].
const ONE: u64 = 1 << 32;

/// The offset as a fraction of `2·N²`, from the equations of the parabola.
struct Exact {
    half_gap: i128,
    /// `N`.
    n: i128,
    wanted: i128,
    from: i128,
    to: i128,
    /// Samples of the running move, up to `2·N`.
    j: i128,
}

impl Exact {
    fn new(half_gap: u32, room: Room) -> Self {
        // The smallest N with D/N ≤ v and D/N² ≤ a.
        let ceil_ratio = |limit: u64| (u128::from(half_gap) << 33).div_ceil(u128::from(limit));
        let square = ceil_ratio(room.acceleration);
        let root = square.isqrt();
        let root = root + u128::from(root * root < square);
        let n = root.max(ceil_ratio(room.velocity)).max(1);
        let n = i128::try_from(n).expect("small");
        let half_gap = i128::from(half_gap);
        Self {
            half_gap,
            n,
            wanted: 0,
            from: 0,
            to: 0,
            j: 2 * n,
        }
    }

    fn denominator(&self) -> i128 {
        2 * self.n * self.n
    }

    fn step(&mut self, direction: i32) -> i128 {
        if direction != 0 {
            self.wanted = i128::from(direction.signum());
        }
        if self.j == 2 * self.n && self.wanted != self.to {
            (self.from, self.to, self.j) = (self.to, self.wanted, 0);
        }
        self.j = (self.j + 1).min(2 * self.n);
        let (j, n) = (self.j, self.n);
        let travelled = if j <= n {
            j * j
        } else {
            2 * n * n - (2 * n - j) * (2 * n - j)
        };
        let start = self.from * self.half_gap * self.denominator();
        start + (self.to - self.from) * self.half_gap * travelled
    }

    /// To the nearest integer, half away from zero.
    fn nearest(&self, numerator: i128) -> i128 {
        let denominator = self.denominator();
        let magnitude = (2 * numerator.abs() + denominator) / (2 * denominator);
        magnitude * numerator.signum()
    }
}

fn moving(velocity: i32) -> Setpoint {
    Setpoint {
        velocity,
        ..Setpoint::default()
    }
}

fn planned(half_gap: u32, room: Room) -> BacklashCompensation {
    BacklashCompensation::plan(half_gap, room, Trigger::Velocity).expect("planned")
}

/// Steps backlash compensation and model through `directions`, each held for its number of
/// samples; panics at the first sample that is not the model's or leaves the
/// limits. Gives the number of samples.
fn follow(half_gap: u32, room: Room, directions: &[(i32, u32)]) -> u64 {
    let backlash_compensation = planned(half_gap, room);
    let (mut state, mut mirrored) = (
        BacklashCompensationState::default(),
        BacklashCompensationState::default(),
    );
    let mut exact = Exact::new(half_gap, room);
    assert_eq!(i128::from(backlash_compensation.samples()), 2 * exact.n);
    let denominator = exact.denominator();
    let limit = |room: u64| i128::from(room) * denominator;
    let within_velocity = i128::from(room.velocity >> 32) + 2;

    let (mut last, mut last_difference, mut last_offset, mut samples) = (0, 0, 0, 0);
    for &(direction, count) in directions {
        for _ in 0..count {
            let numerator = exact.step(direction);
            let offset = backlash_compensation.step(&mut state, &moving(direction));
            assert_eq!(i128::from(offset), exact.nearest(numerator));
            let opposite = backlash_compensation.step(&mut mirrored, &moving(-direction));
            assert_eq!(opposite, -offset, "not odd");

            let difference = numerator - last;
            let change = difference - last_difference;
            assert!(difference.abs() << 32 <= limit(room.velocity));
            assert!(change.abs() << 32 <= limit(room.acceleration));
            let moved = i128::from(offset) - i128::from(last_offset);
            assert!(moved.abs() < within_velocity);
            (last, last_difference, last_offset) = (numerator, difference, offset);
            samples += 1;
        }
    }
    samples
}

fn rooms() -> impl Strategy<Value = Room> {
    // 2^-14 to 2^8 counts per sample, 2^-20 to 2^6 counts per sample².
    (18_u32..40, 12_u32..38, 0_u64..ONE, 0_u64..ONE).prop_map(|(v, a, v_part, a_part)| Room {
        velocity: (1 << v) + ((v_part << v) >> 32),
        acceleration: (1 << a) + ((a_part << a) >> 32),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_offset_is_the_nearest_to_the_parabola_and_the_limits_hold(
        half_gap in 0_u32..3_000,
        room in rooms(),
        directions in prop::collection::vec((-1_i32..=1, 1_u32..1_500), 1..12),
    ) {
        prop_assume!(BacklashCompensation::plan(half_gap, room, Trigger::Velocity).is_ok());
        follow(half_gap, room, &directions);
    }

    #[test]
    fn the_plan_is_the_shortest_within_the_room(half_gap in 1_u32..=HALF_GAP_MAX, room in rooms()) {
        let n = Exact::new(half_gap, room).n;
        let planned = BacklashCompensation::plan(half_gap, room, Trigger::Velocity);
        if 2 * n <= i128::from(SAMPLES_MAX) {
            prop_assert_eq!(planned.map(|plan| i128::from(plan.samples())), Ok(2 * n));
        } else {
            let refusal = planned.expect_err("too long");
            prop_assert_eq!(refusal.what, What::Crossing([room.velocity, room.acceleration]));
            prop_assert_eq!(refusal.value, i64::from(half_gap));
        }
    }
}

#[test]
fn millions_of_samples_leave_no_remainder_behind() {
    // The longest moves of the widest gap, of a usual one and of a single count.
    let slow = |half_gap: u64| Room {
        velocity: ONE << 20,
        acceleration: (half_gap << 33).div_ceil(65_535 * 65_535),
    };
    let mut samples = 0;
    for half_gap in [HALF_GAP_MAX, 1_234, 1] {
        let directions: Vec<_> = [1, -1, 1, -1, 0, 1]
            .map(|sign| (sign, 140_001))
            .into_iter()
            .collect();
        samples += follow(half_gap, slow(half_gap.into()), &directions);
    }
    assert_eq!(samples, 2_520_018);
}

#[test]
fn a_reversal_on_the_way_waits_for_the_end_of_the_move() {
    let room = Room {
        velocity: ONE,
        acceleration: ONE / 8,
    };
    let backlash_compensation = planned(10, room);
    // D/N ≤ 1 gives N = 20, D/N² ≤ 1/8 gives N = 13: the speed binds.
    assert_eq!(backlash_compensation.samples(), 40);
    let mut state = BacklashCompensationState::default();
    assert!(!state.is_under_way());
    let mut offsets = Vec::new();
    for k in 0..120 {
        let direction = if k < 13 { 1 } else { -1 };
        offsets.push(backlash_compensation.step(&mut state, &moving(direction)));
        assert_eq!(state.is_under_way(), k < 79, "sample {k}");
    }
    assert_eq!(offsets[39], 10, "the move to the first flank is finished");
    assert!(offsets[..40].is_sorted());
    assert_eq!(offsets[79], -10, "and the opposite one follows at once");
    assert!(offsets[39..80].iter().rev().is_sorted());
    assert_eq!(offsets[80..], [-10; 40], "where it stays");
}

#[test]
fn a_reversal_there_and_back_on_the_way_is_no_move() {
    let room = Room {
        velocity: ONE,
        acceleration: ONE,
    };
    let backlash_compensation = planned(10, room);
    let mut state = BacklashCompensationState::default();
    for direction in [1, -1, 0, 1] {
        backlash_compensation.step(&mut state, &moving(direction));
    }
    let offsets = [(); 100].map(|()| backlash_compensation.step(&mut state, &moving(0)));
    assert_eq!(offsets[99], 10);
    assert!(offsets.is_sorted());
}

#[test]
fn each_trigger_sees_its_own_part_of_the_setpoint() {
    let room = Room {
        velocity: ONE,
        acceleration: ONE,
    };
    let flanks = |trigger, setpoints: &[Setpoint]| -> Vec<i32> {
        let backlash_compensation = BacklashCompensation::plan(1, room, trigger).expect("planned");
        let mut state = BacklashCompensationState::default();
        let settle = |setpoint: &Setpoint| {
            backlash_compensation.step(&mut state, setpoint);
            let rest = Setpoint {
                velocity: 0,
                acceleration: 0,
                ..*setpoint
            };
            (0..backlash_compensation.samples())
                .fold(0, |_, _| backlash_compensation.step(&mut state, &rest))
        };
        setpoints.iter().map(settle).collect()
    };
    // Speeding up, at constant speed, braking, at rest, and backwards.
    let motion = [(1, 5), (6, 0), (2, -5), (0, 0), (-1, -5), (-2, 5), (0, 0)];
    let motion = motion.map(|(velocity, acceleration)| Setpoint {
        velocity,
        acceleration,
        ..Setpoint::default()
    });
    let by_velocity = flanks(Trigger::Velocity, &motion);
    assert_eq!(by_velocity, [1, 1, 1, 1, -1, -1, -1]);
    let by_acceleration = flanks(Trigger::Acceleration, &motion);
    assert_eq!(by_acceleration, [1, 1, -1, -1, -1, 1, 1]);

    // Positions alone, across the end of the wheel of 2^32 counts.
    let table = [i32::MAX, i32::MIN, i32::MIN, i32::MAX].map(|position| Setpoint {
        position,
        ..Setpoint::default()
    });
    assert_eq!(flanks(Trigger::Velocity, &table), [0, 1, 1, -1]);
    assert_eq!(flanks(Trigger::Acceleration, &table), [0; 4]);
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_values() {
    let plan = |half_gap_counts, velocity, acceleration| {
        let room = Room {
            velocity,
            acceleration,
        };
        BacklashCompensation::plan(half_gap_counts, room, Trigger::Velocity)
    };
    let too_large = plan(HALF_GAP_MAX + 1, ONE, ONE).expect_err("too large");
    assert_eq!(
        too_large.to_string(),
        "a half gap of 16777217 counts is too large; it must be at most 16777216"
    );
    for (velocity, acceleration) in [(0, ONE), (ONE, 0)] {
        let error = plan(5, velocity, acceleration).expect_err("nothing left");
        assert_eq!(error.what, What::NoRoom([velocity, acceleration]));
        assert_eq!((error.value, error.most), (5, 0));
    }
    assert!(plan(0, 0, 0).is_ok(), "without a gap there is no move");

    // N = 65 535 is the last: D/N = 2/65 535 counts per sample.
    let smallest = (2 * ONE).div_ceil(65_535);
    assert_eq!(
        plan(1, smallest, ONE).map(|plan| plan.samples()),
        Ok(SAMPLES_MAX)
    );
    let error = plan(1, smallest - 1, ONE).expect_err("too slow");
    assert_eq!(
        error.to_string(),
        "with 131074·2^-32 counts/sample and 4294967296·2^-32 counts/sample² left of the axis' \
         limits a half gap of 1 counts takes more than 131070 samples to cross; \
         a slower motion leaves more"
    );
    assert!(plan(HALF_GAP_MAX, u64::MAX, u64::MAX).is_ok());
}

#[test]
fn the_memory_is_small() {
    assert!(size_of::<BacklashCompensationState>() <= 32);
}

/// Choice of the flank in [`flank_changes_at_rest`].
#[derive(Clone, Copy)]
enum Follows {
    Reference,
    Error,
}

/// A motor that overshoots by half of each step, a load on friction behind a
/// gap of ±40 counts. Moves forth and half-way back; gives the number of
/// flank changes of the offset in the 3000 samples after the first 500 at
/// rest, and the largest error in them.
fn flank_changes_at_rest(follows: Follows) -> (u32, i32) {
    const HALF_GAP: i64 = 40 << 16;
    let room = Room {
        velocity: 4 * ONE,
        acceleration: ONE / 2,
    };
    let backlash_compensation = planned(40, room);
    let mut state = BacklashCompensationState::default();
    // Motor, its speed and the load in 2^-16 counts (per sample).
    let (mut motor, mut speed, mut load) = (0_i64, 0_i64, 0_i64);
    let (mut position, mut error, mut side) = (0_i32, 0_i32, 0_i32);
    let (mut changes, mut worst) = (0, 0);
    for k in 0..3_900 {
        let velocity = match k {
            0..200 => 5,
            200..300 => -5,
            _ => 0,
        };
        position += velocity;
        let setpoint = Setpoint {
            position,
            velocity,
            acceleration: 0,
        };
        let offset = match follows {
            Follows::Reference => backlash_compensation.step(&mut state, &setpoint),
            Follows::Error => backlash_compensation.step(&mut state, &moving(error)),
        };
        let goal = i64::from(position + offset) << 16;
        // ω = 1/8 per sample, ζ = 1/5: ẍ = ω²·(goal − x) − 2·ζ·ω·ẋ.
        speed += (goal - motor) / 64 - speed / 20;
        motor += speed;
        load = load.clamp(motor - HALF_GAP, motor + HALF_GAP);
        error = position + offset - i32::try_from(motor >> 16).expect("small");

        if k >= 800 {
            if offset.abs() == 40 && offset != side {
                changes += u32::from(side != 0);
                side = offset;
            }
            worst = worst.max(error.abs());
        }
    }
    assert!((motor - load).abs() <= HALF_GAP);
    (changes, worst)
}

#[test]
fn an_overshooting_motor_does_not_change_the_flank() {
    assert_eq!(flank_changes_at_rest(Follows::Reference), (0, 1));
}

#[test]
fn following_the_error_would_throw_the_motor_to_and_fro() {
    let (changes, worst) = flank_changes_at_rest(Follows::Error);
    println!("{changes} changes of flank at rest, {worst} counts");
    assert!(changes > 20, "{changes}");
    assert!(worst > 20, "{worst}");
}
