//! The servo axis between two voltage updates, in SI units: permanent-magnet
//! DC motor, gear, visco-elastic joint with backlash, screw and carriage.
//!
//! ```text
//!  V_m ─► armature ─► k_m·I ─► motor J_m ─► gear z ─► joint k, c, ±b ─► screw J_v ─► carriage M
//!         R, L, k_m             α            β = z·α   ε = β − γ         γ           x = p·γ
//! ```
//!
//! The source is the paper "Modeling and simulation of a position-controlled
//! servo-axis with elasticity and backlash in the transmission"; equation
//! numbers are the paper's. Each physical part is a file of its own that knows
//! nothing of the others; `axis` puts them together and [`Plant`] solves them.
//!
//! The same input gives the same bits on every machine: no fused
//! multiply-add, transcendental functions from the `libm` crate, a fixed
//! order of every sum.

mod adaptive;
mod amplifier;
mod armature;
mod axis;
mod batch;
mod bernstein;
mod dac;
mod dop853;
mod dop853_table;
mod encoder;
mod error;
mod event_search;
mod exact;
mod extremes;
mod guard;
mod joint;
mod joint_loss;
mod mode;
mod motion;
mod parameters;
mod pid;
mod plant;
mod quadrature;
mod quantity;
mod rates;
mod reach;
mod resistance;
mod rk4;
mod septic;
mod span;
mod state;
mod step_size;
mod stepped;
mod transition;

pub use axis::Drive;
pub use batch::{Batch, Eight, Four, InStep, LaneSetup, One, Width};
pub use error::{MotionError, PlantError};
pub use extremes::{Extremes, ExtremesSettings};
pub use joint::Contact;
pub use motion::{Motion, MotionPoint};
pub use parameters::{
    Amplifier, AxisParameters, Carriage, Dac, ElasticJoint, Encoder, Joint, Motor, PidGains,
    Resistance, Transmission,
};
pub use pid::ContinuousPid;
pub use plant::{Plant, Solver};
pub use span::{ContactChange, Span, Watch};
pub use state::State;
