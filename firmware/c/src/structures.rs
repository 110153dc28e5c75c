//! Structures of C, what they are in Rust, and how a pointer to one is followed.

use firmware::{
    AxisOutput, Codes, Counts, Fault, Inputs, Next, Observed, Setpoint, SetpointSource, State,
    Stretch,
};

/// Readings of the hardware at one sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct servo_inputs {
    /// Number of the sample, counted by the timer that starts it.
    pub tick: u64,
    /// Register of the motor's encoder.
    pub motor_register: u32,
    /// Register of the load's encoder.
    pub load_register: u32,
    /// Transfers on the hardware's buses that failed since the last sample.
    pub failed_transfers: u32,
    /// 1 where `load_register` has been read.
    pub has_load_register: u8,
    /// 1 where the emergency stop is asserted.
    pub emergency_stop: u8,
}

impl From<&servo_inputs> for Inputs {
    fn from(inputs: &servo_inputs) -> Self {
        Self {
            tick: inputs.tick,
            motor_register: inputs.motor_register,
            load_register: (inputs.has_load_register != 0).then_some(inputs.load_register),
            emergency_stop: inputs.emergency_stop != 0,
            failed_transfers: inputs.failed_transfers,
        }
    }
}

/// Command of one sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct servo_setpoint {
    /// Position \[counts, modulo 2^32\].
    pub position: i32,
    /// Velocity, in the unit that the settings were made for.
    pub velocity: i32,
    /// Acceleration, in the unit that the settings were made for.
    pub acceleration: i32,
    /// 1: the last setpoint of the motion; the axis holds it from here on.
    pub last: u8,
    /// 1: `ahead` is the feed-forward; else it follows from velocity and
    /// acceleration.
    pub has_ahead: u8,
    /// Feed-forward of one's own \[2^-32 codes\].
    pub ahead: i64,
}

/// Samples of a motion whose third difference is constant: `r += v`, `v += a`,
/// `a += j` in each. Positions are in 2^-32 counts, codes in 2^-32 codes.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct servo_stretch {
    /// `r` at the first sample, and half a count.
    pub position: i64,
    /// `v`, its change to the next sample.
    pub velocity: i64,
    /// `a`, the change of that.
    pub acceleration: i64,
    /// `j`, the change of that.
    pub jerk: i64,
    /// Feed-forward at the first sample.
    pub ahead: i64,
    /// Its change to the next sample.
    pub ahead_change: i64,
    /// The change of that.
    pub ahead_growth: i64,
    /// Number of samples, at least 1.
    pub samples: u32,
    /// Sign of the velocity on the way: -1, 0 or 1.
    pub velocity_sign: i8,
    /// Sign of the acceleration on the way.
    pub acceleration_sign: i8,
}

/// Motion in stretches. The axis takes one off where it needs one; behind the last
/// one it holds `target`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct servo_motion {
    /// The next stretch.
    pub next: *const servo_stretch,
    /// Number of stretches that are left.
    pub left: u32,
    /// Position at the end \[counts, modulo 2^32\].
    pub target: i32,
}

/// Results of one sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct servo_output {
    /// Code for the converter.
    pub code: i32,
    /// `e = r - c` as measured \[counts\].
    pub error_counts: i32,
    /// `enum servo_state` after this sample.
    pub state: u32,
    /// True if the power stage is to be on.
    pub power: bool,
    /// True if the law left a declared range.
    pub out_of_range: bool,
}

/// Output of a call that could do nothing.
pub(crate) const SAFE: servo_output = servo_output {
    code: 0,
    error_counts: 0,
    state: State::Fault as u32,
    power: false,
    out_of_range: false,
};

impl From<AxisOutput> for servo_output {
    fn from(output: AxisOutput) -> Self {
        Self {
            code: output.code,
            error_counts: output.error_counts,
            state: output.state as u32,
            power: output.power,
            out_of_range: output.out_of_range,
        }
    }
}

/// Record of the first fault.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct servo_fault {
    /// Number of the sample that found it.
    pub tick: u64,
    /// Measured value; its meaning is that of the cause.
    pub measured: i64,
    /// The limit that it passed, in the same unit.
    pub limit: i64,
    /// Setpoint \[counts, modulo 2^32\].
    pub setpoint: i32,
    /// Position \[counts, modulo 2^32\].
    pub position: i32,
    /// `e = r - c` \[counts\].
    pub error_counts: i32,
    /// The code in force when it was found.
    pub code: i32,
    /// `enum servo_cause`.
    pub cause: u32,
}

impl From<&Fault> for servo_fault {
    fn from(fault: &Fault) -> Self {
        let values = &fault.values;
        Self {
            tick: fault.tick,
            measured: values.measured,
            limit: values.limit,
            setpoint: values.setpoint,
            position: values.position,
            error_counts: values.error,
            code: values.code,
            cause: fault.cause as u32,
        }
    }
}

/// Where the setpoints of a call come from.
pub(crate) enum Source<'a> {
    Setpoint(Option<&'a servo_setpoint>),
    Motion(Option<&'a mut servo_motion>),
}

impl SetpointSource for Source<'_> {
    fn next(&mut self, _: &Observed) -> Next {
        match self {
            Self::Setpoint(Some(given)) => {
                let setpoint = Setpoint {
                    position: given.position,
                    velocity: given.velocity,
                    acceleration: given.acceleration,
                    ahead: (given.has_ahead != 0).then_some(Codes::from_bits(given.ahead)),
                };
                if given.last == 0 {
                    Next::Setpoint(setpoint)
                } else {
                    Next::Last(setpoint)
                }
            }
            Self::Motion(Some(motion)) => motion.next(),
            Self::Setpoint(None) | Self::Motion(None) => Next::Underrun,
        }
    }
}

impl servo_motion {
    fn next(&mut self) -> Next {
        let Some(left) = self.left.checked_sub(1) else {
            return Next::Last(Setpoint {
                position: self.target,
                ..Setpoint::default()
            });
        };
        // SAFETY: `left` says that there is one.
        let Some(stretch) = (unsafe { at(self.next) }) else {
            return Next::Underrun;
        };
        self.left = left;
        self.next = self.next.wrapping_add(1);
        Next::Stretch(Stretch {
            position: Counts::from_bits(stretch.position),
            velocity: Counts::from_bits(stretch.velocity),
            acceleration: Counts::from_bits(stretch.acceleration),
            jerk: Counts::from_bits(stretch.jerk),
            ahead: Codes::from_bits(stretch.ahead),
            ahead_change: Codes::from_bits(stretch.ahead_change),
            ahead_growth: Codes::from_bits(stretch.ahead_growth),
            samples: stretch.samples.max(1),
            velocity_sign: stretch.velocity_sign,
            acceleration_sign: stretch.acceleration_sign,
        })
    }
}

/// What a pointer points to; none where it is null or off its alignment.
///
/// # Safety
/// Otherwise it is valid for `'a`.
pub(crate) unsafe fn at<'a, T>(pointer: *const T) -> Option<&'a T> {
    let usable = pointer.is_aligned().then_some(pointer)?;
    // SAFETY: it is aligned, and null or valid.
    unsafe { usable.as_ref() }
}

/// The same, to be changed.
///
/// # Safety
/// As of [`at`], and nothing else refers to it.
pub(crate) unsafe fn at_mut<'a, T>(pointer: *mut T) -> Option<&'a mut T> {
    let usable = pointer.is_aligned().then_some(pointer)?;
    // SAFETY: it is aligned, and null or valid.
    unsafe { usable.as_mut() }
}
