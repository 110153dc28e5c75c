//! Features that are measured: a name, and a sample of an axis that is a constant.

use firmware::axis::{Axis, AxisState, Inputs};
use firmware::law::{LawInput, LawState};
use firmware::reference::TableSource;
use firmware::{Motion, SetpointTable};

use crate::axes;

/// Setpoints of the longest of the motions.
pub(crate) const SETPOINTS: usize = 256;

/// The same motion from either source.
pub(crate) struct Setpoints<'p> {
    pub(crate) table: TableSource<SetpointTable<SETPOINTS>, SETPOINTS>,
    pub(crate) motion: Motion<'p>,
}

/// A law of which a sample is measured.
pub(crate) struct LawFeature {
    pub(crate) name: &'static str,
    pub(crate) axis: &'static Axis,
    pub(crate) sample: fn(&mut LawState, &LawInput) -> i32,
}

/// An axis of which a sample is measured.
pub(crate) struct TickFeature {
    pub(crate) name: &'static str,
    pub(crate) axis: &'static Axis,
    /// The code.
    pub(crate) sample: fn(&mut AxisState, &Inputs, &mut Setpoints<'_>) -> i32,
}

/// A law by its axis, whose constants the function knows.
macro_rules! law {
    ($name:literal, $axis:ident) => {
        LawFeature {
            name: $name,
            axis: &axes::$axis,
            sample: |state, input| law_of(&axes::$axis, state, input),
        }
    };
}

/// The law alone. The axis' has clamped anti-windup, the derivative of the
/// measurement and error feedback; what follows it in a row is besides or
/// instead.
pub(crate) const LAWS: [LawFeature; 10] = [
    law!("law", PLAIN),
    law!("law, clamp", CLAMP),
    law!("law, clamp, measurement", MEASUREMENT),
    law!("axis law", AXIS),
    law!("axis law, back-calculation", BACK_CALCULATION),
    law!("axis law, derivative filter", FILTER),
    law!("axis law, feed-forward", FEED_FORWARD),
    law!("axis law, slew limit", SLEW),
    law!("axis law, dither", DITHER),
    law!("axis law, words of 31 bits", LONG_WORDS),
];

/// An axis, likewise, and the source of its setpoints.
macro_rules! tick {
    ($name:literal, $axis:ident, $source:ident) => {
        TickFeature {
            name: $name,
            axis: &axes::$axis,
            sample: |state, inputs, from| state.tick(inputs, &mut from.$source).code,
        }
    };
}

/// A whole sample of an axis with the axis' law.
pub(crate) const TICKS: [TickFeature; 7] = [
    tick!("tick", AXIS, table),
    tick!("tick, monitors", MONITORS, table),
    tick!("tick, 16-bit counter", COUNTER, table),
    tick!("tick, two encoders", DUAL, table),
    tick!("tick, motion generator", AXIS, motion),
    tick!("tick, backlash compensation", BACKLASH_COMPENSATION, table),
    tick!("tick, everything", EVERYTHING, motion),
];

/// One sample of a law and its output.
#[inline(always)]
fn law_of(axis: &'static Axis, state: &mut LawState, input: &LawInput) -> i32 {
    // An axis without a dead band has neither, and its source nothing of its own.
    let input = LawInput {
        ahead: firmware::Codes::ZERO,
        within_dead_band: false,
        hold_integral: false,
        ..*input
    };
    axis.law().step(axis.output(), state, &input)
}
