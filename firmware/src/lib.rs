//! Position controller of the servo axis: the paper's PID law (section 3,
//! eq. 20-24) in fixed point.
//!
//! ```text
//!  setpoint table          error range         PID words               DAC range
//!  r(k) ──────►(+)── e ──► |e| ≤ E ──┬─► Kp·e ───────────────┐
//!  [counts]     ▲-                   ├─► Σe ─► (Ki·Δt)·Σe ──►(+)─ y ─► floor(y + ½) ─► code
//!               │ [counts]           └─► Δe ─► (Kd/Δt)·Δe ───┘ [codes]  clamped      [codes]
//!  encoder ── c(k)
//!
//!  counts.rs, setpoint.rs   counts.rs      gains.rs, pid.rs               dac.rs
//! ```
//!
//! Every sample period `Δt` the caller reads the encoder, calls
//! [`Controller::tick`] and hands the code to the converter:
//!
//! ```
//! use firmware::{Controller, ControllerState, Dac, GainWord, Pid, PidWords, SetpointTable};
//!
//! // Kp = 3.2 codes per count, Ki = 5 /s and Kd = 0.05 s at Δt = 1 ms.
//! let words = PidWords {
//!     kp: GainWord::new(1_717_986_918, 29),
//!     ki_dt: GainWord::new(1_374_389_535, 38),
//!     kd_per_dt: GainWord::new(1_677_721_600, 25),
//!     error_bits: 18,
//! };
//! let pid = Pid::accept(words)?;
//! let dac = Dac::with_bits(14)?;
//! let setpoints = SetpointTable::<2_048>::from_counts(&[0, 4, 12])?;
//! let controller = Controller::new(pid, dac, setpoints);
//!
//! let mut state = ControllerState::default();
//! // k = 0: no error. k = 1: e = 4, y = 3.2·4 + 0.005·4 + 50·4 = 212.82.
//! assert_eq!(controller.tick(&mut state, 0).code, 0);
//! assert_eq!(controller.tick(&mut state, 0).code, 213);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # What is promised
//!
//! Fed the same counts from `k = 0` on, at every `k` the code differs by at
//! most 1 from the law evaluated in exact rationals with the decimal gains,
//! as long as the counts stay within the declared ranges. The sum before
//! rounding is exactly odd in `e`: a mirrored error sequence gives exactly the
//! opposite sum, because nothing is cut off before the one `floor`. The
//! derivation of every word length is in [`gains`], that of the sum in [`pid`].
//!
//! | quantity | unit | type | declared range |
//! | --- | --- | --- | --- |
//! | setpoint `r`, encoder count `c` | counts | `i32`, modulo 2^32 | all |
//! | error `e` | counts | `i32` | ±2^`error_bits`, 17 to 29; beyond: clamped and flagged |
//! | sum of errors `Σe` | counts | never stored | [`Pid::error_sum_limit`], at least 2^8 times the largest error; beyond: flagged |
//! | words of `Kp`, `Kd/Δt` | codes/count | mantissa `i32`, own exponent 0 to 32 | see [`gains`] |
//! | word of `Ki·Δt` | codes/count | mantissa `i32`, own exponent up to 40 | see [`gains`] |
//! | proportional and derivative terms | codes | [`Codes`] (`I32F32`) | below 2^31 together |
//! | integral, sum `y` | codes | [`CodeSum`] (`I88F40`) | 2^28 and 2^31; cannot overflow |
//! | code | codes | `i32` | −2^(n−1) to 2^(n−1)−1, `n` 2 to 24 |
//! | sample number `k` | 1 | `u64` | all |
//!
//! # What it is not
//!
//! No floating point, no heap, no unsafe code, no panic, no feature switches.
//! Gains in SI units are turned into words on the host; this crate accepts or
//! rejects words and never changes them. The integrator has no anti-windup:
//! that is the paper's law.

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
pub mod controller;
pub mod counts;
pub mod dac;
pub mod faults;
pub mod gains;
pub mod hardware;
pub mod homing;
pub mod law;
pub mod motion;
pub mod output;
pub mod pid;
pub mod position;
pub mod reference;
pub mod setpoint;
pub mod states;
pub mod stream;
pub mod takeup;
pub mod watch;
pub mod word;

pub use axis::{Axis, AxisOutput, AxisState, Inputs};
pub use controller::{Controller, ControllerState, Output, Status};
pub use counts::ErrorRange;
pub use dac::{CodeSum, Codes, Dac, DacError};
pub use faults::{Fault, FaultCause, FaultLatch, FaultValues, Trip};
pub use gains::{Gain, GainError, PidWords};
pub use hardware::Board;
pub use homing::{Creep, Detection, Gap, Homing, HomingError, HomingRun, HomingSetupError};
pub use motion::{MotionError, MotionGenerator, MotionPlan, MotionState};
pub use pid::{Pid, PidOutput, PidState};
pub use position::{CounterParameters, PositionError, PositionState, Reading};
pub use reference::{Next, Observed, Setpoint, SetpointSource};
pub use setpoint::{CAPACITY, CAPACITY_SMALLEST, SetpointError, SetpointTable};
pub use states::{Event, Refused, State};
pub use stream::{Stream, StreamError, StreamReceiver, StreamSender, Streamed};
pub use takeup::{Room, TakeUp, TakeUpError, TakeUpState, Trigger};
pub use watch::WatchError;
pub use word::GainWord;
