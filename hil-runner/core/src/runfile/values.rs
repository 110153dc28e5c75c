//! Values of keys, and the types of a case that they become.

use plant::{Control, ElasticJoint, Joint, Start};

use crate::case::{AxisTemplate, ComputationDelay, Law, SolverChoice};
use crate::number::seconds;
use crate::options::{
    AntiWindup, Compensation, Derivative, EncoderGlitch, EncoderLoss, FeedForwardGain, Feedback,
    FlankDetection, FollowingErrorLimit, GainChange, GapSource, Quantiser, RestIntegrator,
    SetpointOrigin,
};

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

/// Plain numbers and switches, and the kind of value that they are.
macro_rules! plain {
    ($($setting:ty: $kind:ident),+) => {$(
        impl Setting for $setting {
            fn of(value: Value) -> Option<Self> {
                match value {
                    Value::$kind(plain) => Self::try_from(plain).ok(),
                    _ => None,
                }
            }

            fn value(&self) -> Value {
                Value::$kind((*self).into())
            }
        }
    )+};
}

// Whole numbers of 64 bits are times.
plain!(bool: Flag, f64: Number, u8: Whole, u32: Whole, i32: Whole, u64: Nanoseconds);

/// The word for a delay that the chip's steps make.
pub(super) const MEASURED: &str = "measured";

/// The word for a feed-forward that the model of the plant gives.
pub(super) const PLANT: &str = "plant";

/// Numbers in whose place a word may stand.
macro_rules! or_word {
    ($($setting:ident: $number:ident, $other:ident = $word:ident);+) => {$(
        impl Setting for $setting {
            fn of(value: Value) -> Option<Self> {
                match value {
                    Value::Choice(_) => Some(Self::$other),
                    _ => Setting::of(value).map(Self::$number),
                }
            }

            fn value(&self) -> Value {
                match self {
                    Self::$number(number) => number.value(),
                    Self::$other => Value::Choice($word),
                }
            }
        }
    )+};
}

or_word!(ComputationDelay: Fixed, Measured = MEASURED; FeedForwardGain: Given, Plant = PLANT);

/// Keys of an elastic joint have their place inside.
impl Setting for Joint {
    fn of(value: Value) -> Option<Self> {
        Some(match value {
            Value::Choice("rigid") => Self::Rigid,
            _ => Self::Elastic(ElasticJoint::default()),
        })
    }

    fn value(&self) -> Value {
        Value::Choice(match self {
            Self::Rigid => "rigid",
            Self::Elastic(_) => "elastic",
        })
    }
}

/// Keys of a current drive have their place inside.
impl Setting for Control {
    fn of(value: Value) -> Option<Self> {
        Some(match value {
            Value::Choice("current") => Self::Current {
                current_limit_a: 0.0,
                bandwidth_radps: None,
            },
            _ => Self::default(),
        })
    }

    fn value(&self) -> Value {
        Value::Choice(match self {
            Self::Current { .. } => "current",
            Self::Voltage { .. } => "voltage",
        })
    }
}

/// Settings of several keys, of which the first makes them; the others then
/// have their place inside.
macro_rules! led_by {
    ($($setting:ty: $first:ident),+) => {$(
        impl Setting for $setting {
            fn of(value: Value) -> Option<Self> {
                let $first = Setting::of(value)?;
                Some(Self { $first, ..Self::default() })
            }

            fn value(&self) -> Value {
                self.$first.value()
            }
        }
    )+};
}

led_by!(FollowingErrorLimit: counts, EncoderLoss: after_ns, EncoderGlitch: at_ns, GainChange: at_ns);

/// A setting of which there are a few.
pub(super) trait Choices: Copy + PartialEq + 'static {
    /// All of them.
    const ALL: &'static [Self];
    /// Their names in a run file, in the same order.
    const NAMES: &'static [&'static str];
}

impl<T: Choices> Setting for T {
    fn of(value: Value) -> Option<Self> {
        let mut all = T::ALL.iter().zip(T::NAMES);
        let (setting, _) = all.find(|(_, name)| value == Value::Choice(name))?;
        Some(*setting)
    }

    fn value(&self) -> Value {
        let mut all = T::ALL.iter().zip(T::NAMES);
        let named = all.find(|(known, _)| *known == self);
        Value::Choice(named.map_or("", |(_, name)| name))
    }
}

/// Settings with their choices and the names of these in a run file.
macro_rules! choices {
    ($($setting:ty { $($choice:ident = $name:literal),+ })+) => {$(
        impl Choices for $setting {
            const ALL: &'static [Self] = &[$(Self::$choice),+];
            const NAMES: &'static [&'static str] = &[$($name),+];
        }
    )+};
}

choices! {
    Start { Centred = "centred", PositiveFlank = "positive_flank", NegativeFlank = "negative_flank" }
    AxisTemplate { Ballscrew = "ballscrew", Belt = "belt", Rack = "rack", Gearbox = "gearbox" }
    SolverChoice { Auto = "auto", Exact = "exact", Dopri5 = "dopri5", Rk4 = "rk4" }
    Derivative { Error = "error", Measurement = "measurement" }
    AntiWindup { None = "none", Clamp = "clamp", BackCalculation = "back-calculation" }
    Quantiser { Nearest = "nearest", ErrorFeedback = "error-feedback", Dither = "dither" }
    SetpointOrigin { Table = "table", Generator = "generator", Queue = "queue" }
    Feedback { Motor = "motor", Dual = "dual" }
    RestIntegrator { Run = "run", Hold = "hold" }
    Compensation { None = "none", Velocity = "velocity", Acceleration = "acceleration" }
    GapSource { Given = "given", Measured = "measured" }
    FlankDetection { LoadEncoder = "load-encoder", Effort = "effort" }
}

impl Choices for Law {
    const ALL: &'static [Self] = &Self::ALL;
    const NAMES: &'static [&'static str] = &Self::NAMES;
}

/// A number in its shorter notation: 1e-11 rather than 0.00000000001.
pub(super) fn show_number(number: f64) -> String {
    if number == 0.0 || (1e-4..1e6).contains(&number.abs()) {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}
