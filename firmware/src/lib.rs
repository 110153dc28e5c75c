//! Position controller of an axis, in integers.
//!
//! # The law
//!
//! One [`law`]: the paper's PID (section 3, eq. 20-24), and behind switches what
//! an axis in service needs. Behind a table of setpoints, and nothing else, it
//! is the paper's [`Controller`]:
//!
//! ```text
//!  setpoint table          error range         words                   range
//!  r(k) ──────►(+)── e ──► |e| ≤ E ──┬─► Kp·e ───────────────┐
//!  [counts]     ▲-                   ├─► (Ki·Δt)·e ──► Σ ───►(+)─ y ─► floor(y + ½) ─► code
//!               │ [counts]           └─► Δe ─► (Kd/Δt)·Δe ───┘ [codes]  clamped      [codes]
//!  encoder ── c(k)
//! ```
//!
//! Every sample period `Δt` the caller reads the encoder, calls
//! [`Controller::tick`] and hands the code to the converter:
//!
//! ```
//! use firmware::law::{Law, LawWords};
//! use firmware::{Controller, ControllerState, Dac, GainWord, SetpointTable};
//!
//! // Kp = 3.2 codes per count, Ki = 5 /s and Kd = 0.05 s at Δt = 1 ms.
//! let words = LawWords {
//!     kp: GainWord::new(1_717_986_918, 29),
//!     ki_dt: GainWord::new(21_474_836, 32),
//!     kd_per_dt: GainWord::new(1_677_721_600, 25),
//!     ..LawWords::NONE
//! };
//! let law = Law::accept(words, Dac::with_bits(14)?)?;
//! let setpoints = SetpointTable::<2_048>::from_counts(&[0, 4, 12])?;
//! let controller = Controller::new(law, setpoints);
//!
//! let mut state = ControllerState::start(&controller);
//! // k = 0: no error. k = 1: e = 4, y = 3.2·4 + 0.005·4 + 50·4 = 212.82.
//! assert_eq!(controller.tick(&mut state, 0).code, 0);
//! assert_eq!(controller.tick(&mut state, 0).code, 213);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # An axis in service: [`Axis`]
//!
//! ```text
//!  registers, e-stop, bus, timer       table, motion, stream, backlash measurement
//!      │                                     │ SetpointSource
//!      ▼                                     ▼
//!  position ───────── c ─────────►(-)     setpoint ── + backlash compensation
//!      │                           │         │ r
//!      ▼                           └─► e ◄───┘
//!  monitors ─► faults ─► states        ▼
//!                         │        law::Law: P, I, D, filter, feed-forward, anti-windup
//!                         ▼            ▼ y
//!                       power      output::Output: slew limit, quantiser, range ─► code
//! ```
//!
//! The caller asks for states with [`AxisState::request`] and calls [`AxisState::tick`] in
//! every sample, or lets [`hardware::serve`] do it on a [`Board`]. An example
//! is at [`Axis`]. Every addition is off until it is asked for.
//!
//! # Modules
//!
//! | numbers | |
//! | --- | --- |
//! | [`counts`] | positions modulo 2^32, their differences, the range of errors |
//! | [`word`] | a gain as mantissa and exponent |
//! | [`dac`] | codes, the converter's range |
//! | [`refusal`] | what is not accepted: the setting, its value, what would do |
//! | **the law** | |
//! | [`law`] | the equation, exact and odd; wind-up, bumpless transfer; derivation of every word length |
//! | [`output`] | slew limit, quantiser, converter's range |
//! | [`controller`] | table, law and converter in one: the paper's |
//! | **the axis in service** | |
//! | [`axis`] | everything below in the order of a sample; options, inputs, memory |
//! | [`position`] | register to position; wrap-around and glitches |
//! | [`monitor`] | following error, encoder loss, saturation, missed tick |
//! | [`faults`], [`states`] | why it stops, the first fault latched; what leads where |
//! | **setpoints and backlash** | |
//! | [`reference`](mod@reference) | what a source of setpoints is; the table |
//! | [`motion`] | the paper's seven intervals, sample by sample |
//! | [`stream`] | a queue that a host fills, without locks or compare-and-swap |
//! | [`backlash_compensation`] | carries the motor across the gap when the load changes flank |
//! | [`backlash_measurement`] | measures the gap |
//! | **electronics** | |
//! | [`hardware`] | [`Board`], a counter and two converters through `embedded-hal` |
//!
//! The line to a host and the golden vectors, for whoever brings the axis to
//! another processor, are a package of their own: `firmware-link`.
//!
//! # Promises
//!
//! * **Law**: fed the same counts from `k = 0` on, within the declared ranges and
//!   rounded to the nearest, the code differs by at most 1 from that of the law
//!   in exact rationals with the decimal gains. The sum before rounding is
//!   exactly odd in `e`. Nothing overflows, whatever comes in. [`law::words`] says
//!   what exact means with a filter or against wind-up.
//! * **Axis, additions off**: started at rest, the codes of [`Controller`], bit
//!   for bit.
//! * **Faults**: act in the sample that finds them, code 0 and power off.
//! * **Changes in motion**: other gains, or enabling, go on from the code in
//!   force.
//! * **Motion**: within ¾ count of the exact command, and ends at the nearest count.
//! * **Backlash compensation**: motion and offset together stay within the axis' limits.
//! * **Backlash measurement**: half the gap, with bounds for either way of seeing the load.
//! * **Memory**: an axis and its settings take 488 bytes, all zeros before it is started.
//!
//! | quantity | unit | range |
//! | --- | --- | --- |
//! | setpoint `r`, position `c` | counts | `i32`, modulo 2^32: all |
//! | error `e` | counts | ±2^`error_bits`, 17 to 29; beyond: held and told |
//! | `Σe` | counts | [`Law::error_sum_limit`](law::Law::error_sum_limit), at least 2^8 of the largest errors |
//! | words | codes/count | `i32`, own exponent to 32 |
//! | sum `y` | codes | [`Codes`] (`I32F32`), below 2^31 |
//! | feed-forward's velocity, acceleration | of their source | below 2^24 |
//! | code | codes | −2^(n−1) to 2^(n−1)−1, `n` 2 to 24 |
//! | sample | 1 | `u64`: all |
//!
//! # Limits
//!
//! No floating point, no heap, no unsafe code, no panic. Its one
//! feature, `defmt`, derives `defmt::Format` for what one logs and changes no sample.
//! Gains in SI units are turned into words on the host; this crate accepts or
//! rejects words and never changes them. It starts no timer: the caller comes
//! at every sample. [`Controller`] has no supervision and no states: that is the
//! paper's; for a machine there is [`Axis`].
//!
//! Of a processor it asks words of 32 bits that are loaded and stored whole,
//! which Cortex-M0 and RV32IMC have as well.

#![no_std]
#![deny(
    clippy::arithmetic_side_effects,
    clippy::as_conversions,
    clippy::float_arithmetic,
    clippy::indexing_slicing,
    clippy::integer_division_remainder_used,
    clippy::string_slice,
    clippy::unreachable
)]

pub mod axis;
pub mod backlash_compensation;
pub mod backlash_measurement;
pub mod controller;
pub mod counts;
pub mod dac;
pub mod faults;
pub mod hardware;
pub mod law;
pub mod monitor;
pub mod motion;
mod named;
pub mod output;
pub mod position;
pub mod reference;
pub mod refusal;
pub mod settings;
pub mod states;
pub mod stream;
mod wide;
pub mod word;

pub use axis::{Axis, AxisOutput, AxisState, Inputs};
pub use backlash_compensation::{BacklashCompensation, Room, Trigger};
pub use backlash_measurement::{
    BacklashMeasurement, BacklashMeasurementError, BacklashMeasurementRun, Creep, Detection, Gap,
};
pub use controller::{Controller, ControllerOutput, ControllerState};
pub use counts::{Counts, ErrorRange};
pub use dac::{Codes, Dac};
pub use faults::{Fault, FaultCause, FaultValues};
pub use hardware::Board;
pub use motion::{Motion, MotionPlan, PlannedMotion};
pub use position::CounterParameters;
pub use reference::{
    CAPACITY, CAPACITY_SMALLEST, InPlace, Next, Observed, Setpoint, SetpointSource, SetpointTable,
    Stretch,
};
pub use refusal::Refusal;
pub use settings::Settings;
pub use states::{Event, Refused, State};
pub use stream::{Stream, StreamReceiver, StreamSender, Streamed};
pub use word::GainWord;
