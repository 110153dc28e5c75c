//! The axis in SI units: a file for each physical part with its parameters, none
//! of which knows another, and `axis`, which puts them together (paper, section 2
//! and 3, eq. 1-26); the motion command (Fig. 6) and the continuous law (eq.
//! 27-31) that drive it; `rates`, its equations for a solver that steps.

pub(crate) mod amplifier;
pub(crate) mod axis;
pub(crate) mod dac;
pub(crate) mod direction;
pub(crate) mod encoder;
pub(crate) mod joint;
pub(crate) mod motion;
pub(crate) mod motor;
pub(crate) mod pid;
pub(crate) mod rates;
pub(crate) mod resistance;
pub(crate) mod stage;
pub(crate) mod state;
pub(crate) mod surroundings;
