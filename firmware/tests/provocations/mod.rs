//! Provocations of each fault.
#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

use firmware::axis::Monitors;
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::{CounterParameters, FaultCause, GainWord, Inputs, Next, Setpoint, State};

use crate::rig::position;

/// Position at which the axis stands and is to stay \[counts\].
pub(crate) const HOME: i32 = 3_000;

/// Provocation of a cause: inputs and setpoints of the samples `0..=last`,
/// the last of which must trip.
pub(crate) struct Provocation {
    pub(crate) cause: FaultCause,
    /// The monitor that sees it, where there is a choice.
    pub(crate) monitors: Monitors,
    pub(crate) counter: CounterParameters,
    /// The samples that it takes, by number.
    pub(crate) inputs: fn(i32, &mut Inputs),
    pub(crate) next: fn() -> Next,
    pub(crate) last: i32,
    pub(crate) measured: i64,
    pub(crate) limit: i64,
    /// The states in which it can occur.
    pub(crate) from: &'static [State],
}

const ALL: &[State] = &[
    State::Disabled,
    State::Enabled,
    State::Moving,
    State::Holding,
];
const POWERED: &[State] = &[State::Enabled, State::Moving, State::Holding];

pub(crate) fn stay() -> Next {
    Next::Setpoint(position(HOME))
}

/// The register of an axis that stands `counts` off.
fn displaced(inputs: &mut Inputs, counts: i32) {
    inputs.motor_register = (HOME + counts).cast_unsigned();
}

/// One monitor alone.
fn only(set: impl FnOnce(&mut Monitors)) -> Monitors {
    let mut monitors = Monitors::default();
    set(&mut monitors);
    monitors
}

pub(crate) fn provocations() -> Vec<Provocation> {
    let quiet = || Provocation {
        cause: FaultCause::EmergencyStop,
        monitors: Monitors::default(),
        counter: CounterParameters::WORD,
        inputs: |_, inputs| inputs.emergency_stop = true,
        next: stay,
        last: 0,
        measured: 0,
        limit: 0,
        from: ALL,
    };
    // 200 counts at rest, 2 samples of lag; velocities in 2^−16 counts per sample.
    let following = FollowingErrorMonitor::accept(200, GainWord::new(2, 0), 16).expect("a monitor");
    let loss = EncoderLossMonitor::accept(300, 5).expect("a monitor");
    let saturation = SaturationMonitor::accept(3).expect("a monitor");
    vec![
        quiet(),
        Provocation {
            cause: FaultCause::HardwareBus,
            inputs: |_, inputs| inputs.failed_transfers = 3,
            measured: 3,
            ..quiet()
        },
        Provocation {
            cause: FaultCause::MissedTick,
            monitors: only(|monitors| monitors.ticks = Some(TickMonitor)),
            inputs: |_, inputs| inputs.tick += 2,
            measured: 2,
            ..quiet()
        },
        Provocation {
            cause: FaultCause::EncoderGlitch,
            counter: CounterParameters::accept(16, Some(500)).expect("a counter"),
            inputs: |_, inputs| displaced(inputs, -501),
            measured: -501,
            limit: 500,
            ..quiet()
        },
        Provocation {
            cause: FaultCause::EncoderLoss,
            monitors: only(|monitors| monitors.encoder_loss = Some(loss)),
            // 2 codes per count: −300 codes from sample 0 on, seen from 1 on.
            inputs: |_, inputs| displaced(inputs, 150),
            last: 5,
            measured: 5,
            limit: 5,
            from: POWERED,
            ..quiet()
        },
        Provocation {
            cause: FaultCause::SetpointUnderrun,
            next: || Next::Underrun,
            inputs: |_, _| {},
            limit: 1,
            from: &[State::Moving],
            ..quiet()
        },
        Provocation {
            cause: FaultCause::FollowingError,
            monitors: only(|monitors| monitors.following_error = Some(following)),
            inputs: |sample, inputs| displaced(inputs, 200 + sample),
            last: 1,
            measured: 201,
            limit: 200,
            from: POWERED,
            ..quiet()
        },
        // At 10.5 counts per sample 221 counts are allowed.
        Provocation {
            cause: FaultCause::FollowingError,
            monitors: only(|monitors| monitors.following_error = Some(following)),
            inputs: |sample, inputs| displaced(inputs, 221 + sample),
            next: || {
                Next::Setpoint(Setpoint {
                    velocity: -21 << 15,
                    ..position(HOME)
                })
            },
            last: 1,
            measured: 222,
            limit: 221,
            from: &[State::Moving],
            ..quiet()
        },
        Provocation {
            cause: FaultCause::SaturationTooLong,
            monitors: only(|monitors| monitors.saturation = Some(saturation)),
            inputs: |_, inputs| displaced(inputs, -5_000),
            last: 3,
            measured: 4,
            limit: 3,
            from: POWERED,
            ..quiet()
        },
    ]
}
