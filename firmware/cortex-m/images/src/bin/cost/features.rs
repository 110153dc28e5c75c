//! Features that are measured: a name, and a sample of an axis that is a constant.

use firmware::axis::{Axis, AxisState, Inputs};
use firmware::law::{LawInput, LawState};
use firmware::output::OutputState;
use firmware::reference::TableSource;
use firmware::{MotionGenerator, SetpointTable};

use crate::axes;

/// Setpoints of the longest of the motions.
pub(crate) const SETPOINTS: usize = 256;

/// The same motion from either source.
pub(crate) struct Setpoints<'p> {
    pub(crate) table: TableSource<SetpointTable<SETPOINTS>, SETPOINTS>,
    pub(crate) motion: MotionGenerator<'p>,
}

/// Memory of a law and its output.
#[derive(Default)]
pub(crate) struct LawMemory {
    law: LawState,
    pub(crate) output: OutputState,
}

/// A law of which a sample is measured.
pub(crate) struct LawFeature {
    pub(crate) name: &'static str,
    pub(crate) sample: fn(&mut LawMemory, &LawInput) -> i32,
}

/// An axis of which a sample is measured.
pub(crate) struct TickFeature {
    pub(crate) name: &'static str,
    pub(crate) axis: &'static Axis,
    /// The code, and whether there is power.
    pub(crate) sample: fn(&mut AxisState, &Inputs, &mut Setpoints<'_>) -> (i32, bool),
    /// True if there is a second encoder to be read.
    pub(crate) reads_load: bool,
}

/// The law alone. The axis' has clamped anti-windup, the derivative of the
/// measurement and error feedback; what follows it in a row is besides or
/// instead.
pub(crate) const LAWS: [LawFeature; 10] = [
    law("law", |m, i| law_of(&axes::PLAIN, m, i)),
    law("law, clamp", |m, i| law_of(&axes::CLAMP, m, i)),
    law("law, clamp, measurement", |m, i| {
        law_of(&axes::MEASUREMENT, m, i)
    }),
    law("axis law", |m, i| law_of(&axes::AXIS, m, i)),
    law("axis law, back-calculation", |m, i| {
        law_of(&axes::BACK_CALCULATION, m, i)
    }),
    law("axis law, derivative filter", |m, i| {
        law_of(&axes::FILTER, m, i)
    }),
    law("axis law, feed-forward", |m, i| {
        law_of(&axes::FEED_FORWARD, m, i)
    }),
    law("axis law, slew limit", |m, i| law_of(&axes::SLEW, m, i)),
    law("axis law, dither", |m, i| law_of(&axes::DITHER, m, i)),
    law("axis law, words of 31 bits", |m, i| {
        law_of(&axes::LONG_WORDS, m, i)
    }),
];

/// A whole sample of an axis with the axis' law, from a table unless it
/// has a motion.
pub(crate) const TICKS: [TickFeature; 7] = [
    tick("tick", &axes::AXIS, |s, i, from| {
        tick_of(&axes::AXIS, s, i, &mut from.table)
    }),
    tick("tick, monitors", &axes::MONITORS, |s, i, from| {
        tick_of(&axes::MONITORS, s, i, &mut from.table)
    }),
    tick("tick, 16-bit counter", &axes::COUNTER, |s, i, from| {
        tick_of(&axes::COUNTER, s, i, &mut from.table)
    }),
    TickFeature {
        reads_load: true,
        ..tick("tick, two encoders", &axes::DUAL, |s, i, from| {
            tick_of(&axes::DUAL, s, i, &mut from.table)
        })
    },
    tick("tick, motion generator", &axes::AXIS, |s, i, from| {
        tick_of(&axes::AXIS, s, i, &mut from.motion)
    }),
    tick(
        "tick, backlash compensation",
        &axes::BACKLASH_COMPENSATION,
        |s, i, from| tick_of(&axes::BACKLASH_COMPENSATION, s, i, &mut from.table),
    ),
    tick("tick, everything", &axes::EVERYTHING, |s, i, from| {
        tick_of(&axes::EVERYTHING, s, i, &mut from.motion)
    }),
];

const fn law(name: &'static str, sample: fn(&mut LawMemory, &LawInput) -> i32) -> LawFeature {
    LawFeature { name, sample }
}

const fn tick(
    name: &'static str,
    axis: &'static Axis,
    sample: fn(&mut AxisState, &Inputs, &mut Setpoints<'_>) -> (i32, bool),
) -> TickFeature {
    TickFeature {
        name,
        axis,
        sample,
        reads_load: false,
    }
}

/// One sample of a law and its output.
#[inline(always)]
fn law_of(axis: &'static Axis, memory: &mut LawMemory, input: &LawInput) -> i32 {
    let (law, output) = (axis.law(), axis.output());
    // An axis without a dead band has neither.
    let input = LawInput {
        within_dead_band: false,
        hold_integral: false,
        ..*input
    };
    let window = output.window(&memory.output);
    let sum = law.step(&mut memory.law, &input, window).sum;
    let bits = law.words().sum_fraction_bits;
    output.code(&mut memory.output, sum, bits, window)
}

/// One sample of an axis.
#[inline(always)]
fn tick_of(
    axis: &'static Axis,
    state: &mut AxisState,
    inputs: &Inputs,
    source: &mut impl firmware::SetpointSource,
) -> (i32, bool) {
    let output = axis.tick(state, inputs, source);
    (output.code, output.power)
}
