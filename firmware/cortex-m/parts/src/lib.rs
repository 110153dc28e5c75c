//! Parts of every image, whatever its chip: the proof that nothing panics, its
//! bytes in flash and RAM, the depth of its stack, and a ring that carries
//! bytes out of an interrupt.

#![no_std]

pub mod image;
pub mod panic;
pub mod ring;
