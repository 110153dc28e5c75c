//! The servo axis between two voltage updates: motor, gear, joint with
//! backlash, screw and carriage in SI units.

pub mod motion;
mod parameters;

pub use motion::{Motion, MotionError};
pub use parameters::{
    Amplifier, AxisParameters, Carriage, Dac, ElasticJoint, Encoder, Joint, Motor, PidGains,
    Resistance, Transmission,
};
