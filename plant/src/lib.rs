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
//! numbers are the paper's. Each folder uses those above it and none below:
//!
//! ```text
//! numerics  polynomials known for certain, quadrature, numbers side by side
//! model     a file for each physical part, which knows no other; axis puts them together
//! observe   the solution piece by piece, contact changes, largest values
//! hybrid    modes of the axis, guards that end them, changes from one to the next
//! exact     solver exact: closed form between two changes of mode
//! stepped   solvers dopri5 and rk4
//! batch     many runs of one axis side by side
//! plant     an axis with its state and its solver: Plant
//! ```
//!
//! The same input gives the same bits on every machine: no fused
//! multiply-add, transcendental functions from the `libm` crate, a fixed
//! order of every sum.

mod batch;
mod exact;
mod hybrid;
mod model;
mod numerics;
mod observe;
mod plant;
mod stepped;

pub use batch::{Batch, InStep, LaneSetup};
pub use hybrid::PlantError;
pub use model::amplifier::{Amplifier, Control};
pub use model::axis::{AxisParameters, Drive};
pub use model::dac::Dac;
pub use model::encoder::Encoder;
pub use model::joint::{Contact, ElasticJoint, Joint, Transmission};
pub use model::motion::{Course, Motion, MotionError, MotionLimits, MotionPoint, Profile};
pub use model::motor::Motor;
pub use model::pid::{ContinuousPid, PidGains};
pub use model::resistance::{Carriage, Resistance};
pub use model::state::State;
pub use model::surroundings::{Load, Start, Surroundings};
pub use numerics::vectors::{Vectors, widest, with_four};
pub use numerics::width::{Eight, Four, One, Single, Width};
pub use observe::extremes::{Extremes, ExtremesSettings};
pub use observe::{ContactChange, Span, Watch};
pub use plant::{Moment, Plant, Solver};
