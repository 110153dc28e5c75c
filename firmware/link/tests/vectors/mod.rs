//! Records the golden vectors of the axis, `firmware/link/vectors/*.txt`, which
//! [`firmware_link::vectors`] reads.

pub(crate) mod corners;
pub(crate) mod faults;
pub(crate) mod judge;
pub(crate) mod record;
pub(crate) mod scenarios;
