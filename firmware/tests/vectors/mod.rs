//! Records the golden vectors of the axis, `firmware/vectors/*.txt`, which
//! [`firmware::vectors`] reads.

pub(crate) mod faults;
pub(crate) mod record;
pub(crate) mod scenarios;
