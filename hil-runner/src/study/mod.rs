//! Studies: many runs over axes of parameters, and what comes out of them.

pub mod picture;
