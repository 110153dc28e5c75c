//! Drive of the samples: a motor in integers behind the code, so that
//! every branch of a sample is taken that a real axis takes.

use core::hint::black_box;

use firmware::axis::{Axis, AxisState, Feedback, Inputs};
use firmware::law::words::LARGEST_RATE;
use firmware::law::{Begin, LawInput, LawState};
use firmware::reference::TableSource;
use firmware::{Event, Motion, MotionPlan, PlannedMotion, SetpointTable};

use crate::features::{LawFeature, Setpoints, TickFeature};
use crate::samples::Samples;

/// Follows the code with a time constant of 16 samples, and jitters by a count
/// in one sample of sixteen.
#[derive(Default)]
struct Motor {
    /// \[2^−8 counts\].
    position: i32,
    /// \[2^−8 counts per sample\].
    velocity: i32,
    /// Of the generator of the jitter.
    random: u32,
}

impl Motor {
    /// Reading of the encoder \[counts\].
    fn counts(&mut self) -> i32 {
        // Numerical Recipes, section 7.1.
        self.random = self
            .random
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        let jitter = i32::from(self.random.wrapping_shr(28) == 3);
        self.position.wrapping_shr(8).wrapping_add(jitter)
    }

    /// One sample at `code`; a code of 1 leads to `gain`/256 counts per sample.
    fn step(&mut self, code: i32, gain: i32) {
        let missing = code.wrapping_mul(gain).wrapping_sub(self.velocity);
        self.velocity = self.velocity.wrapping_add(missing.wrapping_shr(4));
        self.position = self.position.wrapping_add(self.velocity);
    }
}

/// Samples that a law is driven for.
const LAW_SAMPLES: i32 = 1_500;

/// The setpoint of a law \[counts\]: small and large jumps to either side, ramps
/// and rests, and at the end errors beyond the declared range.
fn setpoint(k: i32) -> i32 {
    match k {
        ..150 => 3,
        150..300 => 3_000,
        300..450 => 2_000_i32.wrapping_sub(k.wrapping_sub(300).wrapping_mul(20)),
        450..600 => -40_000,
        600..750 => 40_000,
        750..900 => 39_000,
        900..1_050 => 0,
        1_050..1_200 => k.wrapping_sub(1_050).wrapping_mul(10),
        1_200..1_350 => -5,
        _ => 200_000,
    }
}

/// Drives a law and takes the time of every sample.
pub(crate) fn drive_law(feature: &LawFeature, samples: &mut Samples<'_>) -> Option<()> {
    let rate = |now: i32, before: i32| {
        let limit = LARGEST_RATE.cast_signed().wrapping_sub(1);
        now.wrapping_sub(before)
            .max(limit.wrapping_neg())
            .min(limit)
    };
    // A function that is only known when it is called.
    let sample = black_box(feature.sample);
    let (law, output) = (feature.axis.law(), feature.axis.output());
    let mut state = LawState::start(output);
    let mut motor = Motor::default();
    let mut input = LawInput::default();
    let mut counts = 0;
    for k in 0..LAW_SAMPLES {
        let now = motor.counts();
        let velocity = rate(setpoint(k), setpoint(k.saturating_sub(1))).wrapping_shl(12);
        input = LawInput {
            error: setpoint(k).wrapping_sub(now),
            difference: now.wrapping_sub(counts),
            velocity,
            acceleration: rate(velocity, input.velocity),
            ..LawInput::default()
        };
        counts = now;
        let code = if k == 0 {
            law.begin(output, &mut state, &input, Begin::AtRest)
        } else {
            samples.measure(|| sample(&mut state, &input))?
        };
        motor.step(code, 4);
    }
    Some(())
}

/// Samples between two motions of an axis, and how many of them.
const BETWEEN: u64 = 300;
const MOTIONS: u64 = 5;

/// From this sample on the motor is blocked, in the middle of the last motion:
/// the output reaches its limit and stays there until the monitor trips.
const BLOCKED: u64 = BETWEEN * (MOTIONS - 1) + 50;

/// Half the gap between motor and load \[counts\].
const HALF_GAP: i32 = 40;

/// Drives an axis and takes the time of every sample.
pub(crate) fn drive_axis(feature: &TickFeature, samples: &mut Samples<'_>) -> Option<()> {
    // There and back: 6,000 and −60,000 counts in 220 samples of 1 ms. The
    // second is more than the output gives.
    const MS: u64 = 1_000_000_000;
    let intervals_ps = [20, 40, 20, 60, 20, 40, 20].map(|ms: u64| ms.wrapping_mul(MS));
    let mut planned = [Planned::NONE; 2];
    let [there, back] = &mut planned;
    for (planned, counts) in [(&mut *there, 6_000_i64), (&mut *back, -60_000)] {
        let plan = MotionPlan::new(counts.wrapping_shl(32), intervals_ps, 1_000_000).ok()?;
        planned.plan(&plan, feature.axis.law().words()).ok()?;
    }

    let sample = black_box(feature.sample);
    let mut state = AxisState::start(feature.axis);
    state.request(Event::Enable).ok()?;
    let mut run = Run {
        state,
        motor: Motor::default(),
        load: 0,
    };
    let mut start = 0_i32;
    for motion in 0..MOTIONS {
        // The second one goes back.
        let plan: &Planned = if motion == 1 { back } else { there };
        // An axis on a fault refuses it.
        let _ = run.state.request(Event::Start);
        let mut setpoints = from(plan, start);
        start = start.wrapping_add(plan.end());
        for k in 0..BETWEEN {
            let k = motion.wrapping_mul(BETWEEN).wrapping_add(k);
            let inputs = run.inputs(feature.axis, k);
            let code = samples.measure(|| sample(&mut run.state, &inputs, &mut setpoints))?;
            run.motor.step(if k < BLOCKED { code } else { 0 }, 20);
        }
    }
    Some(())
}

/// An axis with its motor and its load.
struct Run {
    state: AxisState,
    motor: Motor,
    load: i32,
}

impl Run {
    /// Readings of sample `k`.
    fn inputs(&mut self, axis: &Axis, k: u64) -> Inputs {
        let counts = self.motor.counts();
        self.load = self
            .load
            .max(counts.wrapping_sub(HALF_GAP))
            .min(counts.wrapping_add(HALF_GAP));
        let [low, high, ..] = counts.to_le_bytes();
        let register = if axis.counter.bits() == 16 {
            u32::from(u16::from_le_bytes([low, high]))
        } else {
            counts.cast_unsigned()
        };
        let reads_load = matches!(axis.feedback, Feedback::Load(_));
        Inputs {
            tick: k,
            motor_register: register,
            load_register: reads_load.then_some(self.load.cast_unsigned()),
            ..Inputs::default()
        }
    }
}

/// The longest of the motions in stretches.
type Planned = PlannedMotion<48>;

/// A planned motion by either source.
fn from(planned: &Planned, start: i32) -> Setpoints<'_> {
    let mut table = SetpointTable::resting_at(start);
    for stretch in planned.stretches() {
        let mut stretch = *stretch;
        for _ in 0..stretch.samples {
            // The motion ends before the table does.
            let _ = table.push(stretch.setpoint().wrapping_add(start));
            stretch.advance();
        }
    }
    let _ = table.push(start.wrapping_add(planned.end()));
    Setpoints {
        table: TableSource::new(table),
        motion: Motion::new(planned, start),
    }
}
