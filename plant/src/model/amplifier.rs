//! Power amplifier: what its command asks for, and what it makes of that.
//!
//! The paper's is a voltage drive (Fig. 4). A current drive has a current loop in the
//! amplifier, continuous in time, with its zero on the armature's pole:
//!
//! ```text
//! i_cmd = clamp(K_a·V_out, ±I_max)
//! u = ω_c·L·(i_cmd − I) + ω_c·R·q,   V = clamp(u, ±V_max),   q̇ = (V − ω_c·R·q)/(ω_c·L)
//! ```
//!
//! q̇ is `i_cmd − I` while V is not clamped. Without a bandwidth the loop is ideal: I is
//! i_cmd. A voltage drive may limit the current too: while |I| is at the limit and the
//! commanded voltage would push it further out, `İ = 0`; where no voltage can hold it,
//! the current runs over the limit.

use super::direction::Direction;

/// Power amplifier.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Amplifier {
    /// `K_a`, output per volt at the input, greater than 0: volts at the motor \[1\], or
    /// amperes with [`Control::Current`] \[A/V\].
    pub gain: f64,
    /// `V_max`, limit of the voltage in both directions \[V\], greater than 0.
    pub voltage_limit_v: f64,
    /// Quantity that the input commands.
    pub control: Control,
}

/// Quantity that an amplifier's input commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// The motor voltage.
    Voltage {
        /// Limit of the current in both directions \[A\], greater than 0.
        current_limit_a: Option<f64>,
    },
    /// The armature current.
    Current {
        /// Limit of the command in both directions \[A\], greater than 0.
        current_limit_a: f64,
        /// `ω_c` of the current loop \[rad/s\], greater than 0; `None` where it is ideal.
        bandwidth_radps: Option<f64>,
    },
}

impl Default for Control {
    fn default() -> Self {
        Self::Voltage {
            current_limit_a: None,
        }
    }
}

/// Clamp of the command under the continuous law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AmplifierMode {
    /// The command follows the demand, or is held.
    Linear,
    /// The command stands at its limit.
    AtLimit(Direction),
}

/// State of the amplifier behind its command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StageMode {
    /// The output does what the command asks.
    Follows,
    /// The current loop has `±V_max` at the motor.
    Saturated(Direction),
    /// The current is held at its limit.
    Holding(Direction),
    /// Not even the full voltage against it can hold the current at its limit.
    Overrun(Direction),
}

/// The amplifier as the equations of the axis need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stage {
    /// The motor has the voltage of the command: the paper's.
    Voltage,
    /// The same up to a limit of the current.
    LimitedVoltage { limit_v: f64, limit_a: f64 },
    /// The motor has the current of the command.
    IdealCurrent,
    /// A loop brings the current to the command.
    CurrentLoop { limit_v: f64, omega_radps: f64 },
}

impl Stage {
    /// True of a voltage drive without a limit of the current.
    #[inline]
    pub(crate) fn is_papers(self) -> bool {
        matches!(self, Self::Voltage)
    }

    /// `V_max` \[V\] and `I_max` \[A\] of a voltage drive with a limit of the current.
    #[inline]
    pub(crate) fn limits(self) -> Option<[f64; 2]> {
        match self {
            Self::LimitedVoltage { limit_v, limit_a } => Some([limit_v, limit_a]),
            Self::Voltage | Self::IdealCurrent | Self::CurrentLoop { .. } => None,
        }
    }

    /// `V_max` \[V\], `I_max` \[A\] and ω_c \[rad/s\], of which each stage has its own.
    pub(crate) fn numbers(self) -> (f64, f64, f64) {
        match self {
            Self::Voltage | Self::IdealCurrent => (f64::INFINITY, f64::INFINITY, 0.0),
            Self::LimitedVoltage { limit_v, limit_a } => (limit_v, limit_a, 0.0),
            Self::CurrentLoop {
                limit_v,
                omega_radps,
            } => (limit_v, f64::INFINITY, omega_radps),
        }
    }
}

impl Amplifier {
    /// Limit of the command \[V, or A with a current drive\].
    pub fn limit(&self) -> f64 {
        match self.control {
            Control::Voltage { .. } => self.voltage_limit_v,
            Control::Current {
                current_limit_a, ..
            } => current_limit_a,
        }
    }

    /// `clamp(K_a·V_out, ±limit)`: the commanded voltage \[V\], or current \[A\].
    ///
    /// ```
    /// let amplifier = plant::Amplifier { gain: 3.0, voltage_limit_v: 150.0, ..Default::default() };
    /// assert_eq!(amplifier.command(10.0), 30.0);
    /// assert_eq!(amplifier.command(-60.0), -150.0);
    /// ```
    pub fn command(&self, input_v: f64) -> f64 {
        (self.gain * input_v).clamp(-self.limit(), self.limit())
    }

    /// True if the command stands at its limit for this input.
    pub fn is_limited(&self, input_v: f64) -> bool {
        (self.gain * input_v).abs() >= self.limit()
    }

    /// Largest magnitude of the current that it lets the motor have \[A\].
    pub fn current_limit_a(&self) -> Option<f64> {
        match self.control {
            Control::Voltage { current_limit_a } => current_limit_a,
            Control::Current {
                current_limit_a, ..
            } => Some(current_limit_a),
        }
    }

    /// True if the input commands the current.
    pub fn is_current_drive(&self) -> bool {
        matches!(self.control, Control::Current { .. })
    }

    pub(crate) fn stage(&self) -> Stage {
        let limit_v = self.voltage_limit_v;
        match self.control {
            Control::Voltage { current_limit_a } => match current_limit_a {
                None => Stage::Voltage,
                Some(limit_a) => Stage::LimitedVoltage { limit_v, limit_a },
            },
            Control::Current {
                bandwidth_radps, ..
            } => match bandwidth_radps {
                None => Stage::IdealCurrent,
                Some(omega_radps) => Stage::CurrentLoop {
                    limit_v,
                    omega_radps,
                },
            },
        }
    }
}
