//! Values of keys, and the types of a case that they become.

use plant::{ElasticJoint, Joint};

use crate::case::{ComputationDelay, Law, SolverChoice};
use crate::options::{
    AntiWindup, Compensation, Derivative, EncoderGlitch, EncoderLoss, Feedback, FlankDetection,
    FollowingErrorLimit, GainChange, GapSource, Quantiser, RestIntegrator, SetpointOrigin,
};
use crate::time::seconds;

/// A value of the type and in the range that its key asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Words, which stand in the file.
    Text,
    /// A switch.
    Flag(bool),
    /// One of the words that the key allows.
    Choice(&'static str),
    /// A number in the key's unit.
    Number(f64),
    /// A whole number in the key's unit.
    Whole(i64),
    /// A time of the run.
    Nanoseconds(u64),
    /// The intervals of the motion \[s\].
    Intervals([f64; 7]),
}

impl Value {
    /// The value as a number in the key's unit; [`None`] for what is none.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(number),
            Self::Whole(whole) => Some(whole as f64),
            Self::Nanoseconds(ns) => Some(seconds(ns)),
            Self::Text | Self::Flag(_) | Self::Choice(_) | Self::Intervals(_) => None,
        }
    }

    /// The value as a run file would say it.
    pub fn to_toml(self) -> String {
        match self {
            Self::Flag(flag) => flag.to_string(),
            Self::Choice(choice) => format!("\"{choice}\""),
            Self::Whole(whole) => whole.to_string(),
            Self::Intervals(intervals) => format!("{intervals:?}"),
            _ => self.number().map_or(String::new(), show_number),
        }
    }
}

/// A type of a case that a value becomes.
pub(super) trait Setting: Sized {
    fn of(value: Value) -> Option<Self>;
    fn value(&self) -> Value;
}

/// A place of a case that takes values.
pub(super) trait Stored {
    fn store(&mut self, value: Value);
    fn load(&self) -> Option<Value>;
}

impl<T: Setting> Stored for T {
    fn store(&mut self, value: Value) {
        if let Some(setting) = T::of(value) {
            *self = setting;
        }
    }

    fn load(&self) -> Option<Value> {
        Some(self.value())
    }
}

impl<T: Setting> Stored for Option<T> {
    fn store(&mut self, value: Value) {
        *self = T::of(value);
    }

    fn load(&self) -> Option<Value> {
        self.as_ref().map(T::value)
    }
}

impl Setting for f64 {
    fn of(value: Value) -> Option<Self> {
        match value {
            Value::Number(number) => Some(number),
            _ => None,
        }
    }

    fn value(&self) -> Value {
        Value::Number(*self)
    }
}

impl Setting for bool {
    fn of(value: Value) -> Option<Self> {
        match value {
            Value::Flag(flag) => Some(flag),
            _ => None,
        }
    }

    fn value(&self) -> Value {
        Value::Flag(*self)
    }
}

/// Whole numbers of 64 bits are times.
impl Setting for u64 {
    fn of(value: Value) -> Option<Self> {
        match value {
            Value::Nanoseconds(ns) => Some(ns),
            _ => None,
        }
    }

    fn value(&self) -> Value {
        Value::Nanoseconds(*self)
    }
}

impl Setting for u32 {
    fn of(value: Value) -> Option<Self> {
        match value {
            Value::Whole(whole) => Self::try_from(whole).ok(),
            _ => None,
        }
    }

    fn value(&self) -> Value {
        Value::Whole(i64::from(*self))
    }
}

/// The word for a delay that the chip's steps make.
pub(super) const MEASURED: &str = "measured";

impl Setting for ComputationDelay {
    fn of(value: Value) -> Option<Self> {
        match value {
            Value::Choice(_) => Some(Self::Measured),
            _ => u64::of(value).map(Self::Fixed),
        }
    }

    fn value(&self) -> Value {
        self.fixed_ns()
            .map_or(Value::Choice(MEASURED), Value::Nanoseconds)
    }
}

/// Keys of an elastic joint have their place inside.
impl Setting for Joint {
    fn of(value: Value) -> Option<Self> {
        Some(match value {
            Value::Choice("rigid") => Self::Rigid,
            _ => Self::Elastic(ElasticJoint {
                stiffness_nm_per_rad: 0.0,
                damping_nms_per_rad: 0.0,
                backlash_half_rad: 0.0,
                no_pull: false,
            }),
        })
    }

    fn value(&self) -> Value {
        Value::Choice(match self {
            Self::Rigid => "rigid",
            Self::Elastic(_) => "elastic",
        })
    }
}

/// Settings of several keys, of which the first makes them; the others then
/// have their place inside.
impl Setting for FollowingErrorLimit {
    fn of(value: Value) -> Option<Self> {
        let per_speed_s = 0.0;
        u32::of(value).map(|counts| Self {
            counts,
            per_speed_s,
        })
    }

    fn value(&self) -> Value {
        self.counts.value()
    }
}

impl Setting for EncoderLoss {
    fn of(value: Value) -> Option<Self> {
        u64::of(value).map(|after_ns| Self { after_ns, codes: 0 })
    }

    fn value(&self) -> Value {
        self.after_ns.value()
    }
}

impl Setting for EncoderGlitch {
    fn of(value: Value) -> Option<Self> {
        u64::of(value).map(|at_ns| Self { at_ns, counts: 0 })
    }

    fn value(&self) -> Value {
        self.at_ns.value()
    }
}

impl Setting for GainChange {
    fn of(value: Value) -> Option<Self> {
        u64::of(value).map(|at_ns| Self {
            at_ns,
            kp: None,
            ki_per_s: None,
            kd_s: None,
        })
    }

    fn value(&self) -> Value {
        self.at_ns.value()
    }
}

/// A setting of which there are a few.
pub(super) trait Choices: Copy + PartialEq + 'static {
    /// All of them.
    const ALL: &'static [Self];
    /// Their names in a run file, in the same order.
    const NAMES: &'static [&'static str];
}

impl<T: Choices> Setting for T {
    fn of(value: Value) -> Option<Self> {
        let Value::Choice(name) = value else {
            return None;
        };
        let index = T::NAMES.iter().position(|known| *known == name)?;
        T::ALL.get(index).copied()
    }

    fn value(&self) -> Value {
        let index = T::ALL.iter().position(|known| known == self);
        let name = index.and_then(|index| T::NAMES.get(index));
        Value::Choice(name.copied().unwrap_or_default())
    }
}

impl Choices for Law {
    const ALL: &'static [Self] = &Self::ALL;
    const NAMES: &'static [&'static str] = &["continuous", "sampled", "quantised", "firmware"];
}

impl Choices for SolverChoice {
    const ALL: &'static [Self] = &[Self::Auto, Self::Exact, Self::Dopri5, Self::Rk4];
    const NAMES: &'static [&'static str] = &["auto", "exact", "dopri5", "rk4"];
}

impl Choices for Derivative {
    const ALL: &'static [Self] = &[Self::Error, Self::Measurement];
    const NAMES: &'static [&'static str] = &["error", "measurement"];
}

impl Choices for AntiWindup {
    const ALL: &'static [Self] = &[Self::None, Self::Clamp, Self::BackCalculation];
    const NAMES: &'static [&'static str] = &["none", "clamp", "back-calculation"];
}

impl Choices for Quantiser {
    const ALL: &'static [Self] = &[Self::Nearest, Self::ErrorFeedback, Self::Dither];
    const NAMES: &'static [&'static str] = &["nearest", "error-feedback", "dither"];
}

impl Choices for SetpointOrigin {
    const ALL: &'static [Self] = &[Self::Table, Self::Generator, Self::Queue];
    const NAMES: &'static [&'static str] = &["table", "generator", "queue"];
}

impl Choices for Feedback {
    const ALL: &'static [Self] = &[Self::Motor, Self::Dual];
    const NAMES: &'static [&'static str] = &["motor", "dual"];
}

impl Choices for RestIntegrator {
    const ALL: &'static [Self] = &[Self::Run, Self::Hold];
    const NAMES: &'static [&'static str] = &["run", "hold"];
}

impl Choices for Compensation {
    const ALL: &'static [Self] = &[Self::None, Self::Velocity, Self::Acceleration];
    const NAMES: &'static [&'static str] = &["none", "velocity", "acceleration"];
}

impl Choices for GapSource {
    const ALL: &'static [Self] = &[Self::Given, Self::Measured];
    const NAMES: &'static [&'static str] = &["given", "measured"];
}

impl Choices for FlankDetection {
    const ALL: &'static [Self] = &[Self::LoadEncoder, Self::Effort];
    const NAMES: &'static [&'static str] = &["load-encoder", "effort"];
}

/// A number in its shorter notation: 1e-11 rather than 0.00000000001.
pub(super) fn show_number(number: f64) -> String {
    if number == 0.0 || (1e-4..1e6).contains(&number.abs()) {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}
