//! Shared by the tests of the axis: words, scripted setpoints, and a motor in
//! integers to close the loop around it.
#![allow(
    dead_code,
    reason = "every test file takes the part of this module that it needs"
)]
#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops where its setup fails"
)]

use firmware::counts::wrap;
use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{
    Axis, AxisOutput, AxisState, Dac, Event, GainWord, Inputs, Next, Observed, Setpoint,
    SetpointSource,
};

/// `Kp` = 3.2, `Ki·Δt` = 0.005, `Kd/Δt` = 50 codes per count: the paper at 1 ms.
/// 12 bits of the last one are left to a filter.
pub(crate) const PAPER: LawWords = LawWords {
    kp: GainWord::new(1_717_986_918, 29),
    ki_dt: GainWord::new(21_474_836, 32),
    kd_per_dt: GainWord::new(52_428_800, 20),
    error_bits: 18,
    ..LawWords::NONE
};

/// A converter of `bits` bits.
pub(crate) fn dac(bits: u32) -> Dac {
    Dac::with_bits(bits).expect("a width of converters")
}

/// An axis with these words and 14 bits, every option off.
pub(crate) fn axis(words: LawWords) -> Axis {
    with_output(words, None, Quantiser::Nearest)
}

/// An axis with 14 bits, a slew limit and a quantiser.
pub(crate) fn with_output(words: LawWords, slew: Option<u32>, quantiser: Quantiser) -> Axis {
    let law = Law::accept(words, dac(14)).expect("accepted words");
    let output = Output::new(dac(14), slew, quantiser).expect("an accepted slew limit");
    Axis::new(law, output)
}

/// An axis that moves from its first sample on.
pub(crate) fn started(axis: &Axis) -> AxisState {
    let mut state = AxisState::start(axis);
    start(&mut state);
    state
}

/// Enables an axis and starts its motion.
pub(crate) fn start(state: &mut AxisState) {
    for event in [Event::Enable, Event::Start] {
        state.request(event).expect("the state allows it");
    }
}

/// The inputs of an undisturbed sample.
pub(crate) fn at(tick: u64, motor: i32) -> Inputs {
    Inputs {
        tick,
        motor_register: motor.cast_unsigned(),
        ..Inputs::default()
    }
}

/// A setpoint that knows its position only.
pub(crate) fn position(position: i32) -> Setpoint {
    Setpoint {
        position,
        ..Setpoint::default()
    }
}

/// Setpoints from a closure of the sample's number since the start of the motion.
pub(crate) struct Script<F> {
    next: F,
    sample: i64,
}

impl<F: FnMut(i64) -> Next> Script<F> {
    pub(crate) fn new(next: F) -> Self {
        Self { next, sample: 0 }
    }
}

impl<F: FnMut(i64) -> Next> SetpointSource for Script<F> {
    fn next(&mut self, _: &Observed) -> Next {
        let next = (self.next)(self.sample);
        self.sample += 1;
        next
    }
}

/// The setpoints of a ramp from `from` to `to` \[counts\] at `speed` counts per sample.
pub(crate) fn ramp(from: i64, to: i64, speed: i64) -> Script<impl FnMut(i64) -> Next> {
    let towards = if to < from { -speed } else { speed };
    Script::new(move |k| {
        let now = from + towards * k;
        if (to - now) * towards <= 0 {
            Next::Last(position(wrap(to)))
        } else {
            Next::Setpoint(Setpoint {
                position: wrap(now),
                velocity: wrap(towards << 16),
                ..Setpoint::default()
            })
        }
    })
}

/// A source that must not be asked.
pub(crate) struct Silent;

impl SetpointSource for Silent {
    fn next(&mut self, _: &Observed) -> Next {
        panic!("an axis that does not move needs no setpoint")
    }
}

/// An inertia with drag, in 2^−16 counts and samples:
/// `v ← v + gain·code − drag·v`, `x ← x + v`.
///
/// With [`PAPER`] around it, `0.0064 + 0.15·s + s²` in samples: damped, 0.08 of
/// a radian per sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motor {
    pub(crate) position: i64,
    pub(crate) velocity: i64,
}

impl Motor {
    const GAIN: i64 = 131;
    const DRAG: i64 = 3_277;

    /// At rest at a position \[counts\].
    pub(crate) fn at(counts: i64) -> Self {
        Self {
            position: counts << 16,
            velocity: 0,
        }
    }

    /// One sample under `code`.
    pub(crate) fn step(&mut self, code: i32) {
        self.velocity += Self::GAIN * i64::from(code) - ((Self::DRAG * self.velocity) >> 16);
        self.position += self.velocity;
    }

    /// Reading of its counter.
    pub(crate) fn counts(&self) -> i32 {
        wrap(self.position >> 16)
    }
}

/// An axis with its memory and its motor.
pub(crate) struct Loop {
    pub(crate) axis: Axis,
    pub(crate) state: AxisState,
    pub(crate) motor: Motor,
    pub(crate) tick: u64,
}

impl Loop {
    pub(crate) fn new(axis: Axis, start_counts: i64) -> Self {
        Self {
            axis,
            state: AxisState::start(&axis),
            motor: Motor::at(start_counts),
            tick: 0,
        }
    }

    /// Asks for what the state must allow.
    pub(crate) fn request(&mut self, event: Event) {
        self.state.request(event).expect("the state allows it");
    }

    /// One sample with the inputs that `change` makes of the undisturbed ones.
    pub(crate) fn tick_with(
        &mut self,
        source: &mut impl SetpointSource,
        change: impl FnOnce(&mut Inputs),
    ) -> AxisOutput {
        let mut inputs = at(self.tick, self.motor.counts());
        change(&mut inputs);
        let output = self.state.tick(&inputs, source);
        self.motor.step(output.code);
        self.tick += 1;
        output
    }

    /// One undisturbed sample.
    pub(crate) fn tick(&mut self, source: &mut impl SetpointSource) -> AxisOutput {
        self.tick_with(source, |_| {})
    }
}
