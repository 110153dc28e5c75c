//! Controller firmware.
#![no_std]
