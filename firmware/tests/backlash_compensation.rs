//! The backlash compensation of an axis against its exact parabola: the offset
//! at every sample, the limits, the order of moves; and in a loop that
//! overshoots, beside a compensation that follows the error.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod rig;

use firmware::backlash_compensation::{HALF_GAP_MAX, SAMPLES_MAX};
use firmware::law::LawWords;
use firmware::refusal::What;
use firmware::{AxisState, BacklashCompensation, Event, Next, Room, Setpoint, Stretch, Trigger};
use proptest::prelude::*;

/// One count per sample, and per sample², in the unit of [`Room`].
const ONE: u64 = 1 << 32;

const fn room(velocity: u64, acceleration: u64) -> Room {
    Room {
        velocity,
        acceleration,
    }
}

/// An axis without gains that moves with a compensation.
struct Compensated {
    state: AxisState,
    tick: u64,
    samples: u32,
}

impl Compensated {
    fn new(half_gap: u32, room: Room, trigger: Trigger) -> Self {
        let plan = BacklashCompensation::plan(half_gap, room, trigger).expect("planned");
        let mut axis = rig::axis(LawWords::NONE);
        axis.backlash_compensation = Some(plan);
        Self {
            state: rig::started(&axis),
            tick: 0,
            samples: plan.samples(),
        }
    }

    /// Error of a sample with the motor's counter at `count`.
    fn error(&mut self, setpoint: Setpoint, count: i32) -> i32 {
        let mut source = rig::Script::new(|_| Next::Setpoint(setpoint));
        let output = self.state.tick(&rig::at(self.tick, count), &mut source);
        self.tick += 1;
        output.error_counts
    }

    /// The offset of a sample: what its error has beside `r − c`.
    fn offset(&mut self, setpoint: Setpoint) -> i32 {
        self.error(setpoint, 0).wrapping_sub(setpoint.position)
    }

    /// The offset while the axis moves this way.
    fn step(&mut self, direction: i32) -> i32 {
        self.offset(moving(direction))
    }
}

fn moving(velocity: i32) -> Setpoint {
    Setpoint {
        velocity,
        ..Setpoint::default()
    }
}

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
        Self {
            half_gap: half_gap.into(),
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

    /// A move begins in the sample that asks for it, or with the end of the one
    /// before.
    fn begin(&mut self) {
        if self.j == 2 * self.n && self.wanted != self.to {
            (self.from, self.to, self.j) = (self.to, self.wanted, 0);
        }
    }

    fn step(&mut self, direction: i32) -> i128 {
        if direction != 0 {
            self.wanted = direction.signum().into();
        }
        self.begin();
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

    /// Tells whether this is the offset: within `½ + N²·2^−33` counts (from the
    /// centre one and a half of the latter), and at the middle and the end of a
    /// move the nearest integer, half away from zero.
    fn is(&self, offset: i32, numerator: i128) -> bool {
        let denominator = self.denominator();
        let off = (i128::from(offset) * denominator - numerator).abs();
        if self.j % self.n == 0 {
            let magnitude = (2 * numerator.abs() + denominator) / (2 * denominator);
            return i128::from(offset) == magnitude * numerator.signum();
        }
        // From the centre the first difference is rounded, and cut off when halved.
        let halves = if self.from == 0 { 3 } else { 2 };
        off << 34 <= denominator * ((1 << 33) + halves * self.n * self.n)
    }
}

/// Steps axis and model through `directions`, each held for its number of
/// samples; panics at the first sample that is not the model's or leaves the
/// limits. Gives the number of samples.
fn follow(half_gap: u32, room: Room, directions: &[(i32, u32)]) -> u64 {
    let [mut axis, mut mirrored] =
        [(); 2].map(|()| Compensated::new(half_gap, room, Trigger::Velocity));
    let mut exact = Exact::new(half_gap, room);
    assert_eq!(i128::from(axis.samples), 2 * exact.n);
    let limit = |room: u64| i128::from(room) * exact.denominator();
    let (velocity, acceleration) = (limit(room.velocity), limit(room.acceleration));
    let within_velocity = i128::from(room.velocity >> 32) + 2;

    let (mut last, mut last_difference, mut last_offset) = (0, 0, 0);
    for direction in directions
        .iter()
        .flat_map(|&(way, count)| (0..count).map(move |_| way))
    {
        let numerator = exact.step(direction);
        let offset = axis.step(direction);
        let place = [exact.j, exact.n, exact.from, numerator];
        assert!(exact.is(offset, numerator), "{offset} at {place:?}");
        assert_eq!(mirrored.step(-direction), -offset, "not odd");
        exact.begin();

        let difference = numerator - last;
        let change = difference - last_difference;
        assert!(difference.abs() << 32 <= velocity);
        assert!(change.abs() << 32 <= acceleration);
        let moved = i128::from(offset) - i128::from(last_offset);
        assert!(moved.abs() < within_velocity);
        (last, last_difference, last_offset) = (numerator, difference, offset);
    }
    axis.tick
}

fn rooms() -> impl Strategy<Value = Room> {
    // 2^-14 to 2^8 counts per sample, 2^-20 to 2^6 counts per sample².
    (18_u32..40, 12_u32..38, 0_u64..ONE, 0_u64..ONE).prop_map(|(v, a, v_part, a_part)| {
        room(
            (1 << v) + ((v_part << v) >> 32),
            (1 << a) + ((a_part << a) >> 32),
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_offset_is_within_the_bound_of_the_parabola_and_the_limits_hold(
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
    let slow = |half_gap: u64| room(ONE << 20, (half_gap << 33).div_ceil(65_535 * 65_535));
    let directions = [1, -1, 1, -1, 0, 1].map(|sign| (sign, 140_001));
    let samples = [HALF_GAP_MAX, 1_234, 1]
        .map(|half_gap| follow(half_gap, slow(half_gap.into()), &directions));
    assert_eq!(samples, [840_006; 3]);
}

#[test]
fn a_reversal_on_the_way_waits_for_the_end_of_the_move() {
    let mut axis = Compensated::new(10, room(ONE, ONE / 8), Trigger::Velocity);
    // D/N ≤ 1 gives N = 20, D/N² ≤ 1/8 gives N = 13: the speed binds.
    assert_eq!(axis.samples, 40);
    let offsets: Vec<i32> = (0..120)
        .map(|k| axis.step(if k < 13 { 1 } else { -1 }))
        .collect();
    assert_eq!(offsets[39], 10, "the move to the first flank is finished");
    assert!(offsets[..40].is_sorted());
    assert_eq!(offsets[79], -10, "and the opposite one follows at once");
    assert!(offsets[39..80].iter().rev().is_sorted());
    assert_eq!(offsets[80..], [-10; 40], "where it stays");
}

#[test]
fn a_reversal_there_and_back_on_the_way_is_no_move() {
    let mut axis = Compensated::new(10, room(ONE, ONE), Trigger::Velocity);
    for direction in [1, -1, 0, 1] {
        axis.step(direction);
    }
    let offsets = [(); 100].map(|()| axis.step(0));
    assert_eq!(offsets[99], 10);
    assert!(offsets.is_sorted());
}

#[test]
fn each_trigger_sees_its_own_part_of_the_setpoint() {
    let flanks = |trigger, setpoints: &[Setpoint]| -> Vec<i32> {
        let mut axis = Compensated::new(1, room(ONE, ONE), trigger);
        let settle = |setpoint: &Setpoint| {
            axis.offset(*setpoint);
            let rest = rig::position(setpoint.position);
            (0..axis.samples).fold(0, |_, _| axis.offset(rest))
        };
        setpoints.iter().map(settle).collect()
    };
    // Speeding up, at constant speed, braking, at rest, and backwards.
    let motion = [(1, 5), (6, 0), (2, -5), (0, 0), (-1, -5), (-2, 5), (0, 0)];
    let motion = motion.map(|(velocity, acceleration)| Setpoint {
        position: 0,
        velocity,
        acceleration,
        ahead: None,
    });
    let by_velocity = flanks(Trigger::Velocity, &motion);
    assert_eq!(by_velocity, [1, 1, 1, 1, -1, -1, -1]);
    let by_acceleration = flanks(Trigger::Acceleration, &motion);
    assert_eq!(by_acceleration, [1, 1, -1, -1, -1, 1, 1]);

    // Positions alone, across the end of the wheel of 2^32 counts.
    let table = [0, i32::MAX, i32::MIN, i32::MIN, i32::MAX].map(rig::position);
    assert_eq!(flanks(Trigger::Velocity, &table), [0, 1, 1, 1, -1]);
    assert_eq!(flanks(Trigger::Acceleration, &table), [0; 5]);
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_values() {
    let plan = |half_gap_counts, velocity, acceleration| {
        BacklashCompensation::plan(
            half_gap_counts,
            room(velocity, acceleration),
            Trigger::Velocity,
        )
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
    let longest = plan(1, smallest, ONE).map(|plan| plan.samples());
    assert_eq!(longest, Ok(SAMPLES_MAX));
    let error = plan(1, smallest - 1, ONE).expect_err("too slow");
    assert_eq!(
        error.to_string(),
        "with 131074·2^-32 counts/sample and 4294967296·2^-32 counts/sample² left of the axis' \
         limits a half gap of 1 counts takes more than 131070 samples to cross; \
         a slower motion leaves more"
    );
    assert!(plan(HALF_GAP_MAX, u64::MAX, u64::MAX).is_ok());
}

/// A motor that overshoots by half of each step, a load on friction behind a
/// gap of ±40 counts. Moves forth and half-way back; gives the number of
/// flank changes of the offset in the 3000 samples after the first 500 at
/// rest, and the largest error in them. The flank follows the reference, or
/// the error.
fn flank_changes_at_rest(follows_error: bool) -> (u32, i32) {
    const HALF_GAP: i64 = 40 << 16;
    let mut axis = Compensated::new(40, room(4 * ONE, ONE / 2), Trigger::Velocity);
    // Motor, its speed and the load in 2^-16 counts (per sample).
    let (mut motor, mut speed, mut load) = (0_i64, 0_i64, 0_i64);
    let (mut position, mut error, mut side) = (0_i32, 0_i32, 0_i32);
    let (mut changes, mut worst) = (0, 0);
    let counts = |motor: i64| i32::try_from(motor >> 16).expect("small");
    for k in 0..3_900 {
        let velocity = match k {
            0..200 => 5,
            200..300 => -5,
            _ => 0,
        };
        position += velocity;
        let velocity = if follows_error { error } else { velocity };
        let setpoint = Setpoint {
            position,
            ..moving(velocity)
        };
        let count = counts(motor);
        let offset = axis.error(setpoint, count) - (position - count);
        let goal = i64::from(position + offset) << 16;
        // ω = 1/8 per sample, ζ = 1/5: ẍ = ω²·(goal − x) − 2·ζ·ω·ẋ.
        speed += (goal - motor) / 64 - speed / 20;
        motor += speed;
        load = load.clamp(motor - HALF_GAP, motor + HALF_GAP);
        error = position + offset - counts(motor);

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
    assert_eq!(flank_changes_at_rest(false), (0, 1));
}

#[test]
fn following_the_error_would_throw_the_motor_to_and_fro() {
    let (changes, worst) = flank_changes_at_rest(true);
    println!("{changes} changes of flank at rest, {worst} counts");
    assert!(changes > 20, "{changes}");
    assert!(worst > 20, "{worst}");
}

/// A compensation that comes in the middle of a motion takes the flank of the next
/// stretch, though that has the direction of the one before; of none, the offset stays.
#[test]
fn a_compensation_that_comes_in_motion_takes_the_flank_of_the_next_stretch() {
    let without = rig::axis(LawWords::NONE);
    let mut with = without;
    let plan = BacklashCompensation::plan(4, room(2 * ONE, ONE / 2), Trigger::Velocity);
    with.backlash_compensation = Some(plan.expect("planned"));
    let error_at_the_end = |other: &firmware::Axis| {
        let mut state = rig::started(&without);
        let stretch = Stretch {
            samples: 5,
            velocity_sign: 1,
            ..Stretch::resting_at(0)
        };
        let mut source = rig::Script::new(|_| Next::Stretch(stretch));
        let mut error = 0;
        for tick in 0..30 {
            if tick == 3 {
                state.change(other);
            }
            error = state.tick(&rig::at(tick, 0), &mut source).error_counts;
        }
        error
    };
    assert_eq!(error_at_the_end(&with), 4);
    // Contrast: without a compensation it stays where it was.
    assert_eq!(error_at_the_end(&without), 0);
}

/// An axis that is switched off and back on forgets its flank: a motion that starts in the
/// same breath, the way of the one before, takes the gap up again.
#[test]
fn a_motion_that_starts_as_it_is_enabled_asks_for_its_flank() {
    let mut axis = rig::axis(LawWords::NONE);
    let plan = BacklashCompensation::plan(4, room(2 * ONE, ONE / 2), Trigger::Velocity);
    axis.backlash_compensation = Some(plan.expect("planned"));
    let mut state = rig::started(&axis);
    let stretch = Stretch {
        samples: 5,
        velocity_sign: 1,
        ..Stretch::resting_at(0)
    };
    let mut source = rig::Script::new(|_| Next::Stretch(stretch));
    let mut errors = Vec::new();
    for tick in 0..60 {
        if tick == 30 {
            for event in [Event::Disable, Event::Enable, Event::Start] {
                state.request(event).expect("it moves");
            }
        }
        let output = state.tick(&rig::at(tick, 0), &mut source);
        errors.push(output.error_counts);
    }
    // The offset of either motion, from the centre to the flank.
    assert_eq!(errors[..30], errors[30..]);
    assert_eq!((errors[0], errors[29]), (0, 4));
}
